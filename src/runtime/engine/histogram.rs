//! Concurrent histogram of times, for percentiles.
//!
//! Wait-free: two atomic operations per time. A bin is 1/32 of its lower end wide and a percentile is the upper end of
//! a bin, so percentiles are at most 3.2 % too high.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::runtime::threads::clock::nanoseconds;

/// Bins per octave, as a power of two.
const FINE: u32 = 5;
/// Octaves above the linear range: 2^40 ns are 18 minutes.
const OCTAVES: usize = 36;
const BINS: usize = (OCTAVES + 1) << FINE;

/// Histogram of times.
pub(super) struct Histogram {
    bins: Box<[AtomicU64]>,
    longest_ns: AtomicU64,
}

/// Percentiles of times in seconds; zeros without any.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Percentiles {
    /// Number of times.
    pub count: u64,
    /// Median.
    pub p50_s: f64,
    /// 95th percentile.
    pub p95_s: f64,
    /// 99.9th percentile.
    pub p999_s: f64,
    /// Maximum.
    pub worst_s: f64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self {
            bins: (0..BINS).map(|_| AtomicU64::new(0)).collect(),
            longest_ns: AtomicU64::new(0),
        }
    }
}

impl Histogram {
    /// Adds a time.
    pub(super) fn record(&self, time: Duration) {
        let time_ns = nanoseconds(time);
        self.bins[bin(time_ns)].fetch_add(1, Ordering::Relaxed);
        self.longest_ns.fetch_max(time_ns, Ordering::Relaxed);
    }

    /// Percentiles so far. Allocates; control side.
    pub(super) fn percentiles(&self) -> Percentiles {
        let counts: Vec<u64> = self
            .bins
            .iter()
            .map(|bin| bin.load(Ordering::Relaxed))
            .collect();
        let count: u64 = counts.iter().sum();
        if count == 0 {
            return Percentiles::default();
        }
        let worst_s = self.longest_ns.load(Ordering::Relaxed) as f64 * 1e-9;
        let at = |share: f64| {
            let rank = (share * count as f64).ceil() as u64;
            let mut seen = 0;
            let reaches = |n: &u64| {
                seen += n;
                seen >= rank
            };
            let found = counts.iter().position(reaches).unwrap_or(BINS - 1);
            (upper_ns(found) as f64 * 1e-9).min(worst_s)
        };
        Percentiles {
            count,
            p50_s: at(0.5),
            p95_s: at(0.95),
            p999_s: at(0.999),
            worst_s,
        }
    }
}

fn bin(time_ns: u64) -> usize {
    let octave = (u64::BITS - (time_ns >> FINE).leading_zeros()) as usize;
    if octave == 0 {
        return time_ns as usize;
    }
    // The leading bit is the octave's; the next five choose the bin.
    let fine = (time_ns >> (octave - 1)) as usize - (1 << FINE);
    ((octave << FINE) + fine).min(BINS - 1)
}

/// Upper end of a bin.
fn upper_ns(bin: usize) -> u64 {
    let (octave, fine) = (bin >> FINE, (bin & ((1 << FINE) - 1)) as u64);
    match octave {
        0 => fine,
        _ => ((fine + (1 << FINE) + 1) << (octave - 1)) - 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_is_in_a_bin_that_is_hardly_wider() {
        let mut last = 0;
        for time_ns in (0..200).chain((0..1000).map(|k| 200 + k * k * 977)) {
            let index = bin(time_ns);
            assert!(index >= last || time_ns == 200);
            last = index;
            let upper = upper_ns(index);
            // 1/32 is a bin's width relative to its beginning.
            assert!(upper >= time_ns && (upper - time_ns) as f64 <= time_ns as f64 / 32.0);
        }
        assert_eq!(bin(u64::MAX), BINS - 1);
    }

    #[test]
    fn percentiles_are_ranks() {
        let histogram = Histogram::default();
        assert_eq!(histogram.percentiles(), Percentiles::default());
        for time_us in 1..=1000 {
            histogram.record(Duration::from_micros(time_us));
        }
        let found = histogram.percentiles();
        assert_eq!((found.count, found.worst_s), (1000, 0.001));
        for (value, exact) in [
            (found.p50_s, 500e-6),
            (found.p95_s, 950e-6),
            (found.p999_s, 999e-6),
        ] {
            assert!(
                value >= exact && value <= 1.033 * exact,
                "{value} for {exact}"
            );
        }
    }
}
