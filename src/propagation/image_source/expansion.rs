//! Sequences that no ray has met but that lie beside some: what was met, with one more surface before it.
//!
//! A long thin room hides its far images from a thousand rays, though their surfaces are all in sight. Where rays find
//! few sequences there is time to try what they have missed: the list is filled up to [`CANDIDATES`], large surfaces
//! first, another part of the longer ones in each of sixteen updates. Own.

use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::path::MAX_ORDER;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;

/// Candidates that every update has at least, if there are so many: as many as guide rays. Fewer lower the law *recall*
/// in the corridor, more cost each source another look.
pub const CANDIDATES: usize = 1024;

/// Surfaces that are put before what was met: the largest of those in sight.
const SURFACES: usize = 32;

/// Fills a set of guide rays' sequences up with their neighbours. What is added depends on the set and the update's
/// number only.
pub fn fill_up(scene: &Scene, update: u64, depth: usize, set: &mut SequenceSet) {
    if is_full(set) {
        return;
    }
    let mut largest = [0u32; SURFACES];
    let count = largest_in_sight(scene, set, &mut largest);
    let surfaces = &largest[..count];
    // Every pair first, for they are loud; then longer ones in turn.
    let met = set.entries().len();
    for place in 0..met {
        if depth > 1 && set.entries()[place].len() == 1 {
            put_before(scene, surfaces, place, set);
        }
    }
    let met = set.entries().len();
    let start = (met as u64 * (update % ROTATIONS) / ROTATIONS) as usize;
    for place in (start..met).chain(0..start) {
        let order = set.entries()[place].len();
        if order > 1 && order < depth {
            put_before(scene, surfaces, place, set);
        }
    }
}

/// Whether nothing is added to a set.
fn is_full(set: &SequenceSet) -> bool {
    set.entries().len() >= CANDIDATES.min(set.capacity())
}

/// Adds the sequences that begin with one of `surfaces` and go on as the entry at `place`.
fn put_before(scene: &Scene, surfaces: &[u32], place: usize, set: &mut SequenceSet) {
    let rest = set.entries()[place];
    let mut longer = [0; MAX_ORDER];
    longer[1..=rest.len()].copy_from_slice(rest.surfaces());
    for &surface in surfaces {
        if is_full(set) {
            return;
        }
        // Nothing is reflected twice in a row by one plane.
        if surface != longer[1] {
            longer[0] = surface;
            set.insert(Sequence::canonical(scene, &longer[..=rest.len()]));
        }
    }
}

/// The surfaces that a single reflection was met in, by area; gives how many they are.
fn largest_in_sight(scene: &Scene, set: &SequenceSet, largest: &mut [u32; SURFACES]) -> usize {
    let area = |surface: u32| scene.surface(surface).area_m2;
    let mut count = 0;
    for sequence in set.entries() {
        let &[surface] = sequence.surfaces() else {
            continue;
        };
        let place = largest[..count].partition_point(|&other| area(other) >= area(surface));
        if place < SURFACES {
            count = (count + 1).min(SURFACES);
            largest[place..count].rotate_right(1);
            largest[place] = surface;
        }
    }
    count
}
