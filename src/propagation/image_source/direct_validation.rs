//! Candidates that few sources look at: each is tried as far as it can be without a ray.
//!
//! Windows that eight candidates are seen through at once ([`crate::propagation::image_source::window_cull`]) cost more to make than a few sources spare
//! by them. Here candidates' lines are followed at once in double precision, four together, until all their planes are met:
//! the very steps that [`crate::propagation::image_source::image_path::unfold`] takes, without a look whether a point of a surface's bounds lies on
//! the surface. Own.

use glam::DVec3;

use crate::propagation::image_source::image_path::Unfolded;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::unfold_x4::{make_ready, unfold};
use crate::propagation::image_source::validation_queue::Bucket;
use crate::propagation::path::MAX_ORDER;
use crate::scene::Scene;

/// Sources that are few, at most the bits of [`Looks::seen`]: with more of them windows are cheaper (instructions of an update
/// in the concert hall).
pub(crate) const FEW: usize = 3;

/// What few sources have seen of a share of the candidates.
#[derive(Debug)]
pub(crate) struct Looks {
    /// From which sources each candidate may have a path, one a bit.
    seen: Vec<u8>,
    buckets: Vec<Bucket>,
    unfolded: Unfolded,
}

impl Looks {
    /// Room for `capacity` candidates.
    pub(crate) fn with_capacity(capacity: usize) -> Self {
        Self {
            seen: Vec::with_capacity(capacity),
            buckets: Bucket::all(),
            unfolded: Unfolded::default(),
        }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.seen.clear();
    }

    /// Finds out which sequences may have a path to `ear`.
    pub(crate) fn look(
        &mut self,
        scene: &Scene,
        sequences: &[Sequence],
        ear: DVec3,
        sources: &[DVec3],
    ) {
        self.seen.resize(sequences.len(), 0);
        for (number, sequence) in (0..).zip(sequences) {
            let bucket = Bucket::of(&mut self.buckets, sequence.len());
            if bucket.is_some_and(|bucket| bucket.put(scene, sequence, number)) {
                self.unfold(scene, sequence.len(), ear, sources);
            }
        }
        for length in 1..=MAX_ORDER {
            self.unfold(scene, length, ear, sources);
        }
    }

    /// Unfolds the sequences of one length that wait, from every source.
    fn unfold(&mut self, scene: &Scene, length: usize, ear: DVec3, sources: &[DVec3]) {
        let Some(bucket) = Bucket::of(&mut self.buckets, length) else {
            return;
        };
        let count = bucket.take();
        if count == 0 {
            return;
        }
        make_ready(&mut bucket.four, length, ear);
        for (place, &source) in sources.iter().enumerate() {
            unfold(&mut bucket.four, length, source);
            for lane in 0..count {
                let (sequence, number) = bucket.lane(lane);
                let sees = self.unfolded.take(scene, sequence, &bucket.four, lane);
                self.seen[number as usize] |= u8::from(sees) << place;
            }
        }
    }

    /// Calls `give` with the number of every sequence that is seen from source number `place`.
    #[inline]
    pub(crate) fn of(&self, place: usize, mut give: impl FnMut(usize)) {
        for (number, from) in self.seen.iter().enumerate() {
            if from >> place & 1 == 1 {
                give(number);
            }
        }
    }
}
