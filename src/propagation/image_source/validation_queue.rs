//! One source's candidates while they wait: for three more of their length, to be unfolded together, then for what blocked
//! them last, which is asked for meanwhile. Memory of a thread, used for source after source. Own.

use glam::DVec3;

use crate::propagation::image_source::image_path::Unfolded;
use crate::propagation::image_source::occluder_cache::{Blocked, Occluders};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::unfold_x4::{LANES, SequenceBatch4, make_ready, unfold};
use crate::propagation::path::MAX_ORDER;
use crate::scene::Scene;

/// Candidates that have a path unless it is blocked wait for their turn together, so that what is remembered of them has come
/// by then.
const TRIED_TOGETHER: usize = 32;

/// Candidates between one that is tried and one whose blocker is asked for.
const AHEAD: usize = 2;

/// Sequences of one length, up to four.
#[derive(Debug)]
pub(crate) struct Bucket {
    pub(crate) four: SequenceBatch4,
    sequences: [Sequence; LANES],
    numbers: [u32; LANES],
    count: usize,
}

impl Bucket {
    const EMPTY: Self = Self {
        four: SequenceBatch4::EMPTY,
        sequences: [Sequence::NONE; LANES],
        numbers: [0; LANES],
        count: 0,
    };

    /// One for each length from 1.
    pub(crate) fn all() -> Vec<Self> {
        (0..MAX_ORDER).map(|_| Self::EMPTY).collect()
    }

    /// The one for sequences of a length.
    #[inline(always)]
    pub(crate) fn of(all: &mut [Self], length: usize) -> Option<&mut Self> {
        all.get_mut(length.wrapping_sub(1))
    }

    /// Adds a sequence and its number; gives whether it is full.
    #[inline(always)]
    pub(crate) fn put(&mut self, scene: &Scene, sequence: &Sequence, number: u32) -> bool {
        let lane = self.count % LANES;
        self.four.put(scene, lane, sequence);
        self.sequences[lane] = *sequence;
        self.numbers[lane] = number;
        self.count = lane + 1;
        self.count == LANES
    }

    /// Empties it; gives how many lanes there were.
    #[inline(always)]
    pub(crate) fn take(&mut self) -> usize {
        std::mem::take(&mut self.count)
    }

    /// The sequence in a lane and its number.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> (&Sequence, u32) {
        (&self.sequences[lane % LANES], self.numbers[lane % LANES])
    }
}

/// A candidate that has a path unless it is blocked or misses its surfaces within their bounds.
#[derive(Debug)]
pub(crate) struct Standing {
    pub(crate) sequence: Sequence,
    /// Its number among the source's candidates.
    pub(crate) number: u32,
    /// The sequence's.
    pub(crate) hash: u64,
    pub(crate) unfolded: Unfolded,
}

/// All that wait.
#[derive(Debug, Default)]
pub(crate) struct Waiting {
    /// By length, from 1.
    buckets: Vec<Bucket>,
    /// The first `standing` of them wait.
    list: Vec<Standing>,
    standing: usize,
}

impl Waiting {
    /// Room for all.
    pub(crate) fn new() -> Self {
        let standing = || Standing {
            sequence: Sequence::NONE,
            number: 0,
            hash: 0,
            unfolded: Unfolded::default(),
        };
        Self {
            buckets: Bucket::all(),
            // Four may join when one place is left.
            list: (0..TRIED_TOGETHER + LANES).map(|_| standing()).collect(),
            standing: 0,
        }
    }

    /// Has a sequence of at least one surface wait; gives whether as many of its length do as can be unfolded together.
    #[inline(always)]
    pub(crate) fn put(&mut self, scene: &Scene, sequence: &Sequence, number: usize) -> bool {
        let number = number as u32;
        Bucket::of(&mut self.buckets, sequence.len())
            .is_some_and(|bucket| bucket.put(scene, sequence, number))
    }

    /// Unfolds those of one length. Calls `give` with each that has no path and its lane; gives whether it is time to try those
    /// that are left. `ends` are source and listener, local coordinates.
    #[inline(always)]
    pub(crate) fn unfold(
        &mut self,
        scene: &Scene,
        occluders: &Occluders,
        length: usize,
        ends: [DVec3; 2],
        mut give: impl FnMut(&SequenceBatch4, usize, &Sequence),
    ) -> bool {
        let Some(bucket) = Bucket::of(&mut self.buckets, length) else {
            return false;
        };
        let count = bucket.take();
        if count > 0 {
            make_ready(&mut bucket.four, length, ends[1]);
            unfold(&mut bucket.four, length, ends[0]);
        }
        for lane in 0..count {
            let (sequence, number) = bucket.lane(lane);
            let Some(there) = self.list.get_mut(self.standing) else {
                break;
            };
            if there.unfolded.take(scene, sequence, &bucket.four, lane) {
                there.sequence = *sequence;
                there.number = number;
                there.hash = sequence.hash();
                occluders.prefetch(there.hash);
                self.standing += 1;
            } else {
                give(&bucket.four, lane, sequence);
            }
        }
        self.standing >= TRIED_TOGETHER
    }

    /// Calls `try_it` with each that is left and what blocked it last; asks for that of later ones meanwhile. Then none waits.
    pub(crate) fn try_all(
        &mut self,
        scene: &Scene,
        occluders: &mut Occluders,
        mut try_it: impl FnMut(&mut Occluders, &Standing, Option<Blocked>),
    ) {
        let list = &self.list[..std::mem::take(&mut self.standing)];
        let blocked = |occluders: &Occluders, place: usize| {
            let standing: Option<&Standing> = list.get(place);
            standing.and_then(|standing| occluders.recall(standing.hash))
        };
        for place in 0..2 * AHEAD {
            if let Some(blocked) = blocked(occluders, place) {
                blocked.prefetch_triangle(scene);
            }
        }
        for (place, standing) in list.iter().enumerate() {
            if let Some(blocked) = blocked(occluders, place + 2 * AHEAD) {
                blocked.prefetch_triangle(scene);
            }
            if let Some(blocked) = blocked(occluders, place + AHEAD) {
                blocked.prefetch_corners(scene);
            }
            let last = occluders.recall(standing.hash);
            try_it(occluders, standing, last);
        }
    }
}
