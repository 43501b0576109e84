//! How soon an estimate agrees with its reference after listener or source are put elsewhere.
//!
//! The signal of a jump is the reference from it to the next one, at least 20 dB below the mean of all: voices pause
//! together. The difference is taken between the samples, at equal gain.

use serde::{Deserialize, Serialize};

/// Seconds after a jump from which the difference is measured.
pub const WITHIN_S: f64 = 0.25;

/// Level of the difference in dB relative to the signal at which an estimate has settled.
pub const SETTLED_DB: f64 = -30.0;

/// Least power of a signal relative to the mean of all.
const QUIET: f64 = 0.01;

/// Length in seconds of the windows in which settling is looked for.
const WINDOW_S: f64 = 0.02;

/// The difference after jumps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settling {
    /// Number of jumps.
    pub jumps: usize,
    /// Level of the difference from [`WITHIN_S`] after a jump to the next, in dB relative to the signal: median and
    /// largest.
    pub after_db: [f64; 2],
    /// Milliseconds from a jump until the difference stays below [`SETTLED_DB`], until the next jump if it never does:
    /// median and largest.
    pub settled_ms: [f64; 2],
}

impl Settling {
    /// Of an estimate with jumps at some seconds; `None` without jumps.
    pub fn of(
        reference: [&[f32]; 2],
        estimate: [&[f32]; 2],
        rate_hz: u32,
        jumps_s: &[f64],
    ) -> Option<Self> {
        let end = reference[0].len().min(estimate[0].len());
        let sample = |seconds: f64| ((seconds * f64::from(rate_hz)).round() as usize).min(end);
        let signal = |from: usize, to: usize| power(reference.map(|ear| &ear[from..to]), [&[]; 2]);
        let difference = |from: usize, to: usize| {
            power(
                reference.map(|ear| &ear[from..to]),
                estimate.map(|ear| &ear[from..to]),
            )
        };
        let mean = signal(0, end);
        let (mut after_db, mut settled_ms) = (Vec::new(), Vec::new());
        for (index, &jump_s) in jumps_s.iter().enumerate() {
            let from = sample(jump_s);
            let to = jumps_s.get(index + 1).map_or(end, |next| sample(*next));
            let later = sample(jump_s + WITHIN_S);
            if later + sample(WINDOW_S) > to {
                // The recording ends too early after the last one.
                continue;
            }
            let least = signal(from, to).max(QUIET * mean);
            let level_db = |from: usize, to: usize| {
                let ratio = difference(from, to) / least.max(f64::MIN_POSITIVE);
                10.0 * ratio.max(1e-12).log10()
            };
            after_db.push(level_db(later, to));
            let window = sample(WINDOW_S).max(1);
            let windows = (from..to).step_by(window);
            let unsettled = windows
                .map(|start| [start, (start + window).min(to)])
                .rfind(|[start, stop]| level_db(*start, *stop) > SETTLED_DB);
            let until = unsettled.map_or(from, |[_, stop]| stop);
            settled_ms.push(1e3 * (until - from) as f64 / f64::from(rate_hz));
        }
        let of_all = |mut figures: Vec<f64>| {
            figures.sort_by(f64::total_cmp);
            Some([*figures.get(figures.len() / 2)?, *figures.last()?])
        };
        Some(Self {
            jumps: after_db.len(),
            after_db: of_all(after_db)?,
            settled_ms: of_all(settled_ms)?,
        })
    }

    /// Of several renderings: all their jumps, the mean of the medians, the largest of the others; `None` of none.
    pub fn worst(all: impl IntoIterator<Item = Self>) -> Option<Self> {
        let all: Vec<Self> = all.into_iter().collect();
        let of = |pick: &dyn Fn(&Self) -> [f64; 2]| {
            let sum: f64 = all.iter().map(|one| pick(one)[0]).sum();
            let largest = all.iter().map(|one| pick(one)[1]);
            [sum / all.len() as f64, largest.fold(f64::MIN, f64::max)]
        };
        (!all.is_empty()).then(|| Self {
            jumps: all.iter().map(|one| one.jumps).sum(),
            after_db: of(&|one| one.after_db),
            settled_ms: of(&|one| one.settled_ms),
        })
    }
}

/// Mean square of both ears' difference; an absent ear is silent.
fn power(a: [&[f32]; 2], b: [&[f32]; 2]) -> f64 {
    let ears = a.into_iter().zip(b);
    let squares = ears.flat_map(|(a, b)| {
        let others = b.iter().copied().chain(std::iter::repeat(0.0));
        a.iter().zip(others).map(|(a, b)| f64::from(a - b).powi(2))
    });
    squares.sum::<f64>() / (2 * a[0].len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: u32 = 10_000;

    /// Four seconds of a tone.
    fn tone() -> Vec<f32> {
        (0..40_000).map(|n| (0.3 * n as f32).sin()).collect()
    }

    #[test]
    fn an_error_counts_as_long_as_it_lasts() {
        let reference = tone();
        let mut estimate = reference.clone();
        // A tenth of the amplitude, 20 dB below, for 0.4 s after the second jump.
        for sample in &mut estimate[20_000..24_000] {
            *sample *= 0.9;
        }
        let pair = |ear| [ear; 2];
        let settling = Settling::of(
            pair(&reference[..]),
            pair(&estimate[..]),
            RATE_HZ,
            &[1.0, 2.0, 3.0],
        );
        let settling = settling.unwrap();
        assert_eq!(settling.jumps, 3);
        // 0.15 s of the 0.75 s from a quarter of a second on.
        let expected = -20.0 + 10.0 * (0.15f64 / 0.75).log10();
        assert!(
            (settling.after_db[1] - expected).abs() < 0.1,
            "{settling:?}"
        );
        assert_eq!(settling.after_db[0], -120.0);
        assert_eq!(settling.settled_ms, [0.0, 400.0]);
    }

    #[test]
    fn pauses_do_not_make_small_errors_large() {
        let mut reference = tone();
        reference[20_000..30_000].fill(0.0);
        let estimate: Vec<f32> = reference.iter().map(|sample| sample + 1e-3).collect();
        let pair = |ear| [ear; 2];
        let settling = Settling::of(
            pair(&reference[..]),
            pair(&estimate[..]),
            RATE_HZ,
            &[1.0, 2.0, 3.0],
        );
        let [_, worst] = settling.unwrap().after_db;
        // 57 dB below the tone of three quarters of the time, of which a pause counts as 20 dB less.
        let expected = -60.0 + 10.0 * (1.0f64 / (0.5 * 0.75 * QUIET)).log10();
        assert!((worst - expected).abs() < 0.1, "{worst} {expected}");
    }

    #[test]
    fn nothing_is_found_without_jumps() {
        let reference = tone();
        assert_eq!(
            Settling::of([&reference; 2], [&reference; 2], RATE_HZ, &[]),
            None
        );
    }
}
