//! Expansion of discovered sequences by one more surface in front.
//!
//! In a long thin room a thousand rays miss the far images, although all surfaces are visible. Where rays find few
//! sequences, the list is filled up to [`MAX_CANDIDATES`], with large surfaces first, and from another part of the longer
//! sequences in each of sixteen updates. Own.

use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::path::MAX_ORDER;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;

/// Number of candidates up to which a set is filled: that of the default guide rays. Fewer lower the law *recall* in the
/// corridor, more cost each source another cull.
pub const MAX_CANDIDATES: usize = 1024;

/// Number of surfaces to prepend: the largest visible ones.
const SURFACES: usize = 32;

/// Fills a set of discovered sequences up to `most`, usually [`MAX_CANDIDATES`]. The result depends on the set and the update's number only.
pub fn expand(scene: &Scene, update: u64, (depth, most): (usize, usize), set: &mut SequenceSet) {
    if is_full(set, most) {
        return;
    }
    let mut largest = [0u32; SURFACES];
    let count = largest_in_sight(scene, set, &mut largest);
    let surfaces = &largest[..count];
    // Pairs first, since they are loud; then longer sequences in turn.
    for index in 0..set.entries().len() {
        if depth > 1 && set.entries()[index].len() == 1 {
            prepend(scene, (surfaces, most), index, set);
        }
    }
    let count = set.entries().len();
    let start = (count as u64 * (update % ROTATIONS) / ROTATIONS) as usize;
    for index in (start..count).chain(0..start) {
        let order = set.entries()[index].len();
        if order > 1 && order < depth {
            prepend(scene, (surfaces, most), index, set);
        }
    }
}

fn is_full(set: &SequenceSet, most: usize) -> bool {
    set.entries().len() >= most.min(set.capacity())
}

/// Adds the sequences of one of `surfaces` followed by entry number `index`.
fn prepend(scene: &Scene, (surfaces, most): (&[u32], usize), index: usize, set: &mut SequenceSet) {
    let rest = set.entries()[index];
    let mut longer = [0; MAX_ORDER];
    longer[1..=rest.len()].copy_from_slice(rest.surfaces());
    for &surface in surfaces {
        if is_full(set, most) {
            return;
        }
        // No path reflects twice in a row at one plane.
        if surface != longer[1] {
            longer[0] = surface;
            set.insert(Sequence::canonical(scene, &longer[..=rest.len()]));
        }
    }
}

/// Writes the surfaces of the set's single reflections, the largest first. Returns their number.
fn largest_in_sight(scene: &Scene, set: &SequenceSet, largest: &mut [u32; SURFACES]) -> usize {
    let area = |surface: u32| scene.surface(surface).area_m2;
    let mut count = 0;
    for sequence in set.entries() {
        let &[surface] = sequence.surfaces() else {
            continue;
        };
        let index = largest[..count].partition_point(|&other| area(other) >= area(surface));
        if index < SURFACES {
            count = (count + 1).min(SURFACES);
            largest[index..count].rotate_right(1);
            largest[index] = surface;
        }
    }
    count
}
