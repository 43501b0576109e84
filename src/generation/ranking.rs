//! Which paths are the loudest.
//!
//! Audio side; wait-free, `paths × log count`; allocates at birth only.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::extrapolation::FramePath;

/// Largest amplitude of a path: 60 dB. The source would be a millimetre from the ear.
const MAX_AMPLITUDE: f32 = 1000.0;

/// Room for the ranks of the loudest paths.
#[derive(Debug)]
pub(super) struct Ranking {
    loudest: BinaryHeap<Reverse<u64>>,
}

impl Ranking {
    /// A ranking that can tell up to `most` loudest paths.
    pub(super) fn new(most: usize) -> Self {
        Self {
            loudest: BinaryHeap::with_capacity(most + 1),
        }
    }

    /// The rank from which on a path is among the `count` loudest of those that can sound.
    pub(super) fn threshold(
        &mut self,
        paths: &[FramePath],
        slots: usize,
        longest_s: f64,
        count: usize,
    ) -> u64 {
        if count == 0 {
            return u64::MAX;
        }
        if paths.len() <= count {
            return 0;
        }
        self.loudest.clear();
        for (index, path) in paths.iter().enumerate() {
            if !is_sound(path, slots) || path.delay_s > longest_s {
                continue;
            }
            let rank = rank(path, index);
            if self.loudest.len() < count {
                self.loudest.push(Reverse(rank));
            } else if let Some(mut least) = self.loudest.peek_mut()
                && least.0 < rank
            {
                *least = Reverse(rank);
            }
        }
        match self.loudest.peek() {
            Some(least) if self.loudest.len() == count => least.0,
            _ => 0,
        }
    }
}

/// Whether a path is one that can sound at all: of one of the slots, and every value a number in range.
pub(super) fn is_sound(path: &FramePath, slots: usize) -> bool {
    path.source.slot() < slots
        && path.delay_s >= 0.0
        && path.delay_s.is_finite()
        && path.arrival.is_finite()
        && path.amplitude.iter().all(|a| a.abs() <= MAX_AMPLITUDE)
}

/// Orders paths by energy, then by place; energies are not negative, so their bits are ordered as they are.
pub(super) fn rank(path: &FramePath, index: usize) -> u64 {
    let energy: f32 = path.amplitude.iter().map(|a| a * a).sum();
    u64::from(energy.to_bits()) << 32 | u64::from(!(index as u32))
}
