//! Bounded lists of the best candidates, best first.

/// Inserts `new` after the entries for which `precedes` holds. Returns what a full list drops: its last entry or `new`.
pub(crate) fn insert_ranked<T: Copy>(
    list: &mut [Option<T>],
    new: T,
    precedes: impl Fn(&T) -> bool,
) -> Option<T> {
    let index = list.partition_point(|entry| entry.as_ref().is_some_and(&precedes));
    if index == list.len() {
        return Some(new);
    }
    list[index..].rotate_right(1);
    list[index].replace(new)
}

/// Amplitude factor of a path of a list of the loudest: 0 at the energy `floor` of the loudest one that is left out, which takes its
/// place where the listener moves on, and nearly 1 for louder ones. `floor` is 0 for a list with room.
pub(super) fn rank_weight(energy: f64, floor: f64) -> f64 {
    match energy > floor {
        true => 1.0 - floor / energy,
        false => 0.0,
    }
}
