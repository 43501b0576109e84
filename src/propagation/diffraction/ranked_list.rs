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
/// place where the listener moves on, and nearly 1 for louder ones. `floor` is 0 for a list with room. The weight is by squares of
/// energies, in all lists alike: where a path over one edge goes on as one over two, both have nearly the same weight, and a frame
/// may have the floor of an update some frames old.
pub(super) fn rank_weight(energy: f64, floor: f64) -> f64 {
    match energy > floor {
        true => 1.0 - (floor / energy).powi(2),
        false => 0.0,
    }
}

/// [`rank_weight`] for the edges of a source in sight, by energies. Where a third edge hides one of the list, no path over two edges
/// replaces it: `floor` steps, and with it the weights of all others. By energies they step less than by their squares.
pub(super) fn rank_weight_in_light(energy: f64, floor: f64) -> f64 {
    match energy > floor {
        true => 1.0 - floor / energy,
        false => 0.0,
    }
}
