//! The longest edges of a scene: more are not kept.

use super::edge::Edge;

/// Most edges of a scene, the longest ones: 131,072 of them with their tree and graph take 32 MB. A town of 10,000 blocks has as
/// many; with fewer it has none but those of its roofs, and sound ends at its corners.
pub const MOST_EDGES: usize = 1 << 17;

/// The [`MOST_EDGES`] longest entries, longest first, each as an edge; of equal ones the first in the list.
pub(super) fn longest<T>(
    list: &[T],
    length_m: impl Fn(&T) -> f64,
    edge: impl Fn(&T) -> Edge,
) -> Vec<Edge> {
    // Bits of positive numbers sort as the numbers do; inverted, the longest comes first.
    let rank = |(index, entry): (u32, &T)| (!length_m(entry).to_bits(), index);
    let mut order: Vec<(u64, u32)> = (0..).zip(list).map(rank).collect();
    if order.len() > MOST_EDGES {
        order.select_nth_unstable(MOST_EDGES);
        order.truncate(MOST_EDGES);
    }
    order.sort_unstable();
    let of_index = |(_, index)| edge(&list[index as usize]);
    order.into_iter().map(of_index).collect()
}
