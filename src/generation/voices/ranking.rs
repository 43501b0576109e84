//! Selects the loudest paths.
//!
//! Audio side; wait-free, bounded by the number of paths; allocates at construction only.

use crate::acoustics::BandArray;
use crate::extrapolation::FramePath;

/// Largest valid amplitude of a path: 60 dB, that of a source at one millimetre.
const MAX_AMPLITUDE: f32 = 1000.0;

/// Scratch memory for the ranks of the loudest paths.
#[derive(Debug)]
pub(crate) struct Ranking {
    /// Twice the number selected: the quieter half is dropped when it is full.
    loudest: Vec<u64>,
}

impl Ranking {
    /// For selections of up to `most` paths. Control side; allocates.
    pub(crate) fn new(most: usize) -> Self {
        Self {
            loudest: Vec::with_capacity(2 * most),
        }
    }

    /// Least rank of the `count` loudest valid paths.
    pub(crate) fn threshold(
        &mut self,
        paths: &[FramePath],
        longest_s: &[f64],
        count: usize,
    ) -> u64 {
        if count == 0 || paths.len() <= count {
            return if count == 0 { u64::MAX } else { 0 };
        }
        self.collect(paths, longest_s, count);
        self.least_of(count)
    }

    /// [`Self::threshold`] of two counts, from one look at the paths if the second is not greater than the first.
    pub(crate) fn thresholds(
        &mut self,
        paths: &[FramePath],
        longest_s: &[f64],
        [more, fewer]: [usize; 2],
    ) -> [u64; 2] {
        if fewer == 0 || fewer > more || paths.len() <= more {
            return [more, fewer].map(|count| self.threshold(paths, longest_s, count));
        }
        self.collect(paths, longest_s, more);
        [self.least_of(more), self.least_of(fewer)]
    }

    /// Collects the ranks of at least the `count` loudest valid paths.
    fn collect(&mut self, paths: &[FramePath], longest_s: &[f64], count: usize) {
        let full = (2 * count).min(self.loudest.capacity());
        let mut least = 0;
        self.loudest.clear();
        for (index, path) in paths.iter().enumerate() {
            let rank = rank(path, index);
            if rank < least || !is_valid(path, longest_s.len()) || !fits(path, longest_s) {
                continue;
            }
            self.loudest.push(rank);
            if self.loudest.len() == full {
                least = self.keep(count);
            }
        }
    }

    /// Least of the `count` greatest ranks collected, which are kept; 0 if there are fewer.
    fn least_of(&mut self, count: usize) -> u64 {
        if self.loudest.len() >= count {
            self.keep(count)
        } else {
            0
        }
    }

    /// Keeps the `count` greatest ranks; returns the least of them.
    fn keep(&mut self, count: usize) -> u64 {
        let last = count.min(self.loudest.len()) - 1;
        let (_, &mut least, _) = self.loudest.select_nth_unstable_by(last, |a, b| b.cmp(a));
        self.loudest.truncate(last + 1);
        least
    }
}

/// Whether a path is valid: its source has a slot, and every value is in range.
pub(crate) fn is_valid(path: &FramePath, slots: usize) -> bool {
    path.source.slot() < slots
        && path.delay_s >= 0.0
        && path.delay_s.is_finite()
        && path.arrival.is_finite()
        && are_in_range(&path.amplitude)
}

/// Whether all amplitudes are valid, without a branch for each.
fn are_in_range(amplitude: &BandArray) -> bool {
    let each = amplitude.iter().map(|a| a.abs() <= MAX_AMPLITUDE);
    each.fold(true, |all, one| all & one)
}

/// Whether a valid path is no longer than its source's delay line, in seconds by slot.
pub(crate) fn fits(path: &FramePath, longest_s: &[f64]) -> bool {
    let slot = path.source.slot();
    longest_s
        .get(slot)
        .is_some_and(|longest| path.delay_s <= *longest)
}

/// Rank of a path: by energy, then by index. The bits of non-negative energies sort as the energies.
pub(crate) fn rank(path: &FramePath, index: usize) -> u64 {
    u64::from(path.energy().to_bits()) << 32 | u64::from(!(index as u32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extrapolation::PathKind;
    use crate::propagation::PathId;
    use crate::scene::SourceId;
    use glam::Vec3;

    fn path(id: u64, amplitude: f32) -> FramePath {
        FramePath {
            id: PathId(id),
            source: SourceId::new(0, 0),
            kind: PathKind::Reflected,
            order: 0,
            amplitude: [amplitude; 8],
            delay_s: 0.1,
            air_delay_s: 0.1,
            arrival: Vec3::X,
            departure: Vec3::ZERO,
        }
    }

    #[test]
    fn the_threshold_is_the_rank_of_the_quietest_selected_path() {
        let mut paths: Vec<FramePath> = (0..500u64)
            .map(|n| path(n, 0.1 + ((n * 7919) % 97) as f32))
            .collect();
        paths[3].amplitude[2] = f32::NAN;
        paths[5].delay_s = 2.0;
        paths[7].source = SourceId::new(9, 0);
        let mut ranks: Vec<u64> = (0..paths.len())
            .filter(|n| ![3, 5, 7].contains(n))
            .map(|n| rank(&paths[n], n))
            .collect();
        ranks.sort_unstable_by(|a, b| b.cmp(a));
        let mut ranking = Ranking::new(300);
        for count in [1, 2, 10, 150, 299, 300] {
            let found = ranking.threshold(&paths, &[1.0; 4], count);
            assert_eq!(found, ranks[count - 1], "{count}");
            for other in (0..=300).step_by(7) {
                let both = ranking.thresholds(&paths, &[1.0; 4], [count, other]);
                let alone = ranking.threshold(&paths, &[1.0; 4], other);
                assert_eq!(both, [found, alone], "{count} {other}");
            }
        }
        let few = &paths[..12];
        let both = ranking.thresholds(few, &[1.0; 4], [20, 5]);
        assert_eq!(both, [0, ranking.threshold(few, &[1.0; 4], 5)]);
        // Fewer valid paths than the count; a count of zero; exactly as many paths as the count.
        assert_eq!(ranking.threshold(&paths[..12], &[1.0; 4], 10), 0);
        assert_eq!(ranking.threshold(&paths, &[1.0; 4], 0), u64::MAX);
        assert_eq!(ranking.threshold(&paths[..10], &[1.0; 4], 10), 0);
    }
}
