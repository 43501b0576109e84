//! Candidates that few sources look at: each is tried as far as it can be without a ray.
//!
//! Windows that eight candidates are seen through at once ([`super::candidates`]) cost more to make than a few sources spare
//! by them. Here a candidate's line is followed at once in double precision, plane after plane, until it misses one:
//! the very steps that [`super::image_source::unfold`] takes, without a look whether a point of a surface's bounds lies on
//! the surface. Own.

use glam::DVec3;

use super::candidates::Ready;
use super::image_source::Unfolded;
use super::sequence::Sequence;
use crate::scene::Scene;

/// Sources that are few, at most the bits of [`Seen::from`]: with more of them windows are cheaper (instructions of an update
/// in the concert hall).
pub(super) const FEW: usize = 3;

/// A candidate that may have a path.
#[derive(Debug, Clone, Copy)]
struct Seen {
    number: u32,
    /// From which sources, one a bit.
    from: u8,
    ready: Ready,
}

/// What few sources have seen of a share of the candidates.
#[derive(Debug)]
pub(super) struct Looks {
    seen: Vec<Seen>,
    unfolded: Unfolded,
}

impl Looks {
    /// Room for `capacity` candidates.
    pub(super) fn with_capacity(capacity: usize) -> Self {
        Self {
            seen: Vec::with_capacity(capacity),
            unfolded: Unfolded::default(),
        }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.seen.clear();
    }

    /// Finds out which sequences may have a path to `ear`.
    pub(super) fn look(
        &mut self,
        scene: &Scene,
        sequences: &[Sequence],
        ear: DVec3,
        sources: &[DVec3],
    ) {
        for (number, sequence) in sequences.iter().enumerate() {
            let ready = Ready::of(scene, sequence, ear);
            let mut from = 0;
            for (place, &source) in sources.iter().enumerate() {
                let (line, order) = ([source, ready.image], &ready.order);
                let unfolded = &mut self.unfolded;
                let sees = unfolded.along_clear(scene, sequence, order, line, |_, _| true);
                from |= u8::from(sees) << place;
            }
            if from != 0 {
                self.seen.push(Seen {
                    number: number as u32,
                    from,
                    ready,
                });
            }
        }
    }

    /// Calls `give` with the number of every sequence that is seen from source number `place`, and what is ready of it.
    #[inline]
    pub(super) fn of(&self, place: usize, mut give: impl FnMut(usize, &Ready)) {
        for seen in &self.seen {
            if seen.from >> place & 1 == 1 {
                give(seen.number as usize, &seen.ready);
            }
        }
    }
}
