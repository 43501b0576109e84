//! Bounded lists of the best candidates, best first.

/// Inserts `new` after the entries for which `precedes` holds. A full list drops its last entry.
pub(crate) fn insert_ranked<T: Copy>(
    list: &mut [Option<T>],
    new: T,
    precedes: impl Fn(&T) -> bool,
) {
    let index = list.partition_point(|entry| entry.as_ref().is_some_and(&precedes));
    if index < list.len() {
        list[index..].rotate_right(1);
        list[index] = Some(new);
    }
}
