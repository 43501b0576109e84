//! Memory use of a run and its growth.
//!
//! Resident memory varies by megabytes as the allocator keeps and returns pages; live memory (allocated and not freed)
//! shows every leak.

use std::sync::atomic::Ordering;

use crate::counting;

/// Memory while the engine runs, once a second.
#[derive(Default)]
pub(crate) struct Memory {
    /// Seconds since the beginning, resident and live megabytes.
    samples: Vec<[f64; 3]>,
}

impl Memory {
    /// Takes a sample at a time in seconds.
    pub(crate) fn sample(&mut self, time_s: f64) {
        self.samples.push([time_s, resident_mb(), live_mb()]);
    }

    /// The most of a kind, in the first and in the last third of the time.
    pub(crate) fn most(&self, kind: usize) -> [f64; 2] {
        let third = self.samples.len().div_ceil(3);
        let parts = [
            &self.samples[..third],
            &self.samples[self.samples.len() - third..],
        ];
        parts.map(|part| {
            part.iter()
                .fold(0.0f64, |most, sample| most.max(sample[kind]))
        })
    }

    /// Growth of a kind in megabytes a minute, by least squares.
    pub(crate) fn growth(&self, kind: usize) -> f64 {
        let count = self.samples.len().max(1) as f64;
        let mean = |kind: usize| self.samples.iter().map(|s| s[kind]).sum::<f64>() / count;
        let (time, size) = (mean(0), mean(kind));
        let (mut up, mut across) = (0.0, 0.0);
        for sample in &self.samples {
            up += (sample[0] - time) * (sample[kind] - size);
            across += (sample[0] - time).powi(2);
        }
        if across > 0.0 {
            60.0 * up / across
        } else {
            0.0
        }
    }
}

/// Live memory in MB.
fn live_mb() -> f64 {
    counting::LIVE.load(Ordering::Relaxed) as f64 / 1_048_576.0
}

/// Memory in use in MB; 0 where the system does not report it.
pub(crate) fn resident_mb() -> f64 {
    status_mb("VmRSS:")
}

/// The part of it that is pages of files: of the program itself, which the system drops when memory is short.
pub(crate) fn resident_files_mb() -> f64 {
    status_mb("RssFile:")
}

fn status_mb(name: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    let kilobytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}
