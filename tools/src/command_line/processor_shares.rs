//! Share of its period that each block's work takes, by processor time of the sound thread.
//!
//! The bins are allocated before the first block; counting does not allocate.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use foresound::runtime::threads::clock::thread_processor_time;

/// Width of a bin, as a share of the period.
const BIN: f64 = 0.001;
/// Up to four periods; longer blocks share the last bin.
const BINS: usize = 4001;

/// Blocks by the share of the period that they took.
pub(crate) struct ProcessorShares {
    period_s: f64,
    bins: Box<[AtomicU64]>,
}

impl ProcessorShares {
    pub(crate) fn new(period_s: f64) -> Self {
        Self {
            period_s,
            bins: (0..BINS).map(|_| AtomicU64::new(0)).collect(),
        }
    }

    /// Counts a block.
    pub(crate) fn record(&self, time: Duration) {
        let bin = (time.as_secs_f64() / self.period_s / BIN) as usize;
        self.bins[bin.min(BINS - 1)].fetch_add(1, Ordering::Relaxed);
    }

    /// The share that a fraction of all blocks does not exceed; `None` without blocks.
    pub(crate) fn percentile(&self, share: f64) -> Option<f64> {
        let counts: Vec<u64> = self
            .bins
            .iter()
            .map(|bin| bin.load(Ordering::Relaxed))
            .collect();
        let all: u64 = counts.iter().sum();
        let rank = (share * all as f64).ceil().max(1.0) as u64;
        let mut seen = 0;
        let reaches = |count: &u64| {
            seen += count;
            seen >= rank
        };
        let bin = counts.iter().position(reaches)?;
        Some((bin + 1) as f64 * BIN)
    }
}

/// Processor time of this thread in seconds; 0 where the system does not report it.
pub(crate) fn processor_s() -> f64 {
    thread_processor_time().map_or(0.0, |time| time.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_is_the_end_of_its_bin() {
        let shares = ProcessorShares::new(0.01);
        assert_eq!(shares.percentile(0.5), None);
        for _ in 0..999 {
            shares.record(Duration::from_micros(1005));
        }
        shares.record(Duration::from_secs(1));
        for (share, expected) in [(0.5, 0.101), (0.999, 0.101), (1.0, 4.001)] {
            let found = shares.percentile(share).unwrap_or_default();
            assert!((found - expected).abs() < 1e-9, "{share}: {found}");
        }
    }
}
