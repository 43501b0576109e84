//! Queues of one source's candidates: by length until a batch is full and unfolded, then until enough are due for validation.
//!
//! The second queue covers the latency of prefetching the last occluders. Per-thread scratch, reused across sources. Own.

use glam::DVec3;

use crate::propagation::image_source::image_path::{MARGIN_M, UnfoldedPath};
use crate::propagation::image_source::occluder_cache::{Occluder, OccluderCache};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::unfold_x4::{LANES, SequenceBatch4};
use crate::propagation::path::MAX_ORDER;
use crate::scene::Scene;

/// Unfolded candidates that are validated together.
const BATCH: usize = 32;

/// Distance in the queue between validation of a candidate and prefetch of an occluder.
const AHEAD: usize = 2;

/// Up to four sequences of one length.
#[derive(Debug)]
struct Bucket {
    batch: SequenceBatch4,
    sequences: [Sequence; LANES],
    indices: [u32; LANES],
    reflected: [Option<f32>; LANES],
    count: usize,
}

impl Bucket {
    const EMPTY: Self = Self {
        batch: SequenceBatch4::EMPTY,
        sequences: [Sequence::EMPTY; LANES],
        indices: [0; LANES],
        reflected: [None; LANES],
        count: 0,
    };
}

/// A candidate with a line that meets all planes within the bounds of its surfaces. It may miss a surface or be occluded.
#[derive(Debug)]
pub(crate) struct Unvalidated {
    pub(crate) sequence: Sequence,
    /// Index among the source's candidates.
    pub(crate) index: u32,
    /// The sequence's hash.
    pub(crate) hash: u64,
    /// See [`ValidationQueue::push`].
    pub(crate) reflected: Option<f32>,
    pub(crate) unfolded: UnfoldedPath,
}

/// Both queues.
#[derive(Debug)]
pub(crate) struct ValidationQueue {
    /// By length, from 1.
    buckets: [Bucket; MAX_ORDER],
    /// Entries beyond `count` are stale.
    unfolded: Vec<Unvalidated>,
    count: usize,
}

impl Default for ValidationQueue {
    fn default() -> Self {
        let entry = || Unvalidated {
            sequence: Sequence::EMPTY,
            index: 0,
            hash: 0,
            reflected: None,
            unfolded: UnfoldedPath::default(),
        };
        Self {
            buckets: [const { Bucket::EMPTY }; MAX_ORDER],
            // A whole batch may be added when one entry is free.
            unfolded: (0..BATCH + LANES).map(|_| entry()).collect(),
            count: 0,
        }
    }
}

impl ValidationQueue {
    /// Queues a sequence of at least one surface, with the energy that its reflections leave, if it is known. Returns whether the
    /// batch of its length is full.
    #[inline(always)]
    pub(crate) fn push(
        &mut self,
        scene: &Scene,
        sequence: &Sequence,
        index: usize,
        reflected: Option<f32>,
    ) -> bool {
        let Some(bucket) = self.buckets.get_mut(sequence.len().wrapping_sub(1)) else {
            return false;
        };
        let lane = bucket.count % LANES;
        bucket.batch.put(scene, lane, sequence);
        bucket.sequences[lane] = *sequence;
        bucket.indices[lane] = index as u32;
        bucket.reflected[lane] = reflected;
        bucket.count = lane + 1;
        bucket.count == LANES
    }

    /// Unfolds the queued sequences of one length. Calls `beside` with each one whose line meets its planes outside the surfaces'
    /// bounds, within `margin_m` metres, and `missed` with the index and the lane of each other one. Returns whether
    /// [`Self::validate`] is due. `ends` are source and listener, local coordinates.
    #[inline(always)]
    pub(crate) fn unfold(
        &mut self,
        scene: &Scene,
        occluders: &OccluderCache,
        length: usize,
        [source, listener]: [DVec3; 2],
        margin_m: f64,
        (mut beside, mut missed): (
            impl FnMut(&Sequence, &mut UnfoldedPath, Option<f32>),
            impl FnMut(u32, &Sequence, (&SequenceBatch4, usize)),
        ),
    ) -> bool {
        let Some(bucket) = self.buckets.get_mut(length.wrapping_sub(1)) else {
            return false;
        };
        let count = std::mem::take(&mut bucket.count);
        if count > 0 {
            bucket.batch.prepare(length, listener);
            bucket.batch.unfold(length, source);
        }
        let sequences = bucket.sequences.iter().zip(bucket.indices);
        for (lane, (sequence, index)) in sequences.enumerate().take(count) {
            let Some(next) = self.unfolded.get_mut(self.count) else {
                break;
            };
            let unfolded = &mut next.unfolded;
            match unfolded.take(scene, sequence, &bucket.batch, lane, margin_m) {
                Some(outside_m) if outside_m <= MARGIN_M => {
                    next.sequence = *sequence;
                    next.index = index;
                    next.hash = sequence.hash();
                    next.reflected = bucket.reflected[lane];
                    occluders.prefetch(next.hash);
                    self.count += 1;
                }
                Some(_) => beside(sequence, unfolded, bucket.reflected[lane]),
                None => missed(index, sequence, (&bucket.batch, lane)),
            }
        }
        self.count >= BATCH
    }

    /// Calls `validate` with each unfolded candidate and its last occluder, prefetches those of later ones meanwhile, and
    /// empties the queue.
    pub(crate) fn validate(
        &mut self,
        scene: &Scene,
        occluders: &mut OccluderCache,
        mut validate: impl FnMut(&mut OccluderCache, &mut Unvalidated, Option<Occluder>),
    ) {
        let list = &mut self.unfolded[..std::mem::take(&mut self.count)];
        let occluder = |occluders: &OccluderCache, list: &[Unvalidated], index: usize| {
            let candidate = list.get(index);
            candidate.and_then(|candidate| occluders.get(candidate.hash))
        };
        for index in 0..2 * AHEAD {
            if let Some(occluder) = occluder(occluders, list, index) {
                occluder.prefetch_triangle(scene);
            }
        }
        for index in 0..list.len() {
            if let Some(occluder) = occluder(occluders, list, index + 2 * AHEAD) {
                occluder.prefetch_triangle(scene);
            }
            if let Some(occluder) = occluder(occluders, list, index + AHEAD) {
                occluder.prefetch_corners(scene);
            }
            let last = occluders.get(list[index].hash);
            validate(occluders, &mut list[index], last);
        }
    }
}
