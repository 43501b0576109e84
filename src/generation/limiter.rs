//! Keeps the output below full scale.
//!
//! Audio side; wait-free, amortised constant time per frame; allocates at construction only. Input and output: interleaved
//! channels.
//!
//! Look-ahead peak limiter of the usual construction: the required gain of every frame is held over the look-ahead and
//! averaged over the same length, which reaches it when the peak leaves the delay. All channels share one gain. The loss
//! of gain is an integer and its sums are exact: below the ceiling the gain is exactly one and the limiter a pure delay,
//! bit for bit.

use crate::error::{Error, Result};

/// Look-ahead in seconds.
const LOOK_AHEAD_S: f64 = 0.0015;
/// Loss of a gain of zero. 2^30 times the window fits in `u64`.
const ONE: u32 = 1 << 30;
/// Power of two by which the loss decays per frame: a time constant of 4096 frames, 93 ms at 44.1 kHz.
const RELEASE_SHIFT: u32 = 12;

/// Look-ahead limiter of interleaved channels.
///
/// ```
/// use foresound::generation::Limiter;
///
/// # fn main() -> foresound::Result<()> {
/// let mut limiter = Limiter::new(44_100, 2, -0.3)?;
/// let mut block = [2.0; 2 * 256];
/// assert!(limiter.process(&mut block) < 1.0);
/// assert!(block.iter().all(|sample| sample.abs() < 1.0));
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Limiter {
    ceiling: f32,
    /// Frames of delay; the window is one longer.
    look_ahead: usize,
    channels: usize,
    /// A ring of interleaved frames.
    delayed: Vec<f32>,
    /// Losses of the averaging window.
    averaged: Vec<u32>,
    sum: u64,
    /// Monotonic queue of frames and losses that may become the window's maximum; a ring.
    candidates: Vec<(u64, u32)>,
    head: usize,
    queued: usize,
    /// The loss after release.
    released: u32,
    frame: u64,
    /// Indices of this frame in the rings.
    at_delayed: usize,
    at_averaged: usize,
}

impl Limiter {
    /// A limiter at rest. Control side; allocates.
    ///
    /// Range: 1 to 64 channels, `ceiling_db` from −60 to 0 dB re full scale.
    ///
    /// Errors: [`Error::Setting`] outside them.
    pub fn new(rate_hz: u32, channels: usize, ceiling_db: f32) -> Result<Self> {
        if !(-60.0..=0.0).contains(&ceiling_db) {
            return Err(Error::setting(
                "ceiling_db",
                format!("{ceiling_db} dB"),
                "choose a ceiling from -60 to 0 dB",
            ));
        }
        if !(1..=64).contains(&channels) {
            return Err(Error::setting(
                "channels",
                format!("{channels} channels"),
                "choose a number from 1 to 64",
            ));
        }
        let look_ahead = (LOOK_AHEAD_S * f64::from(rate_hz)).round() as usize;
        Ok(Self {
            ceiling: 10f32.powf(ceiling_db / 20.0),
            look_ahead,
            channels,
            delayed: vec![0.0; look_ahead * channels],
            averaged: vec![0; look_ahead + 1],
            sum: 0,
            candidates: vec![(0, 0); look_ahead + 2],
            head: 0,
            queued: 0,
            released: 0,
            frame: 0,
            at_delayed: 0,
            at_averaged: 0,
        })
    }

    /// Delay in frames.
    pub fn latency_frames(&self) -> usize {
        self.look_ahead
    }

    /// Limits in place; returns the smallest linear gain, 1 without limiting. Samples must be finite. Real-time: no
    /// allocation.
    pub fn process(&mut self, interleaved: &mut [f32]) -> f32 {
        let mut max_loss = 0;
        for frame in interleaved.chunks_exact_mut(self.channels) {
            let peak = frame
                .iter()
                .fold(0.0f32, |peak, sample| peak.max(sample.abs()));
            let loss = self.loss(peak);
            let index = self.at_delayed * self.channels;
            self.at_delayed = following(self.at_delayed, self.look_ahead);
            self.frame += 1;
            max_loss = max_loss.max(loss);
            let gain = if loss > 0 { self.gain(loss) } else { 1.0 };
            let delayed = &mut self.delayed[index..index + self.channels];
            for (sample, delayed) in frame.iter_mut().zip(delayed) {
                std::mem::swap(sample, delayed);
                if loss > 0 {
                    // The product of the rounded gain may exceed the ceiling by one bit.
                    *sample = (*sample * gain).clamp(-self.ceiling, self.ceiling);
                }
            }
        }
        self.gain(max_loss)
    }

    fn gain(&self, loss: u64) -> f32 {
        let whole = f64::from(ONE) * self.averaged.len() as f64;
        (1.0 - loss as f64 / whole) as f32
    }

    /// Adds a frame's peak; returns the sum of the losses over the window, for the frame that leaves the delay.
    fn loss(&mut self, peak: f32) -> u64 {
        let needed = if peak > self.ceiling {
            let kept = f64::from(self.ceiling) / f64::from(peak);
            ((1.0 - kept) * f64::from(ONE)).ceil() as u32
        } else {
            0
        };
        let fall = (self.released >> RELEASE_SHIFT) + 1;
        self.released = needed.max(self.released.saturating_sub(fall));
        let largest = self.largest(self.released);
        let oldest = std::mem::replace(&mut self.averaged[self.at_averaged], largest);
        self.at_averaged = following(self.at_averaged, self.averaged.len());
        self.sum = self.sum + u64::from(largest) - u64::from(oldest);
        self.sum
    }

    /// Largest loss of the last `look_ahead + 1` frames.
    fn largest(&mut self, loss: u32) -> u32 {
        let size = self.candidates.len();
        // Less than twice the size.
        let wrapped = |index: usize| if index >= size { index - size } else { index };
        while self.queued > 0 && self.candidates[wrapped(self.head + self.queued - 1)].1 <= loss {
            self.queued -= 1;
        }
        self.candidates[wrapped(self.head + self.queued)] = (self.frame, loss);
        self.queued += 1;
        if self.candidates[self.head].0 + (self.look_ahead as u64) < self.frame {
            self.head = following(self.head, size);
            self.queued -= 1;
        }
        self.candidates[self.head].1
    }
}

/// The index after another in a ring.
fn following(index: usize, length: usize) -> usize {
    if index + 1 < length { index + 1 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(frames: usize, level: f32) -> Vec<f32> {
        let mut state = 0x2545_f491u32;
        (0..2 * frames)
            .map(|i| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let value = (state >> 8) as f32 / (1 << 23) as f32 - 1.0;
                // Loud bursts between quiet stretches.
                if (i / 3000) % 2 == 0 {
                    value * level
                } else {
                    value * 0.2
                }
            })
            .collect()
    }

    #[test]
    fn quiet_signal_passes_bit_for_bit_after_the_delay() {
        let mut limiter = Limiter::new(44_100, 2, -0.3).unwrap();
        let signal = noise(5000, 0.9);
        let mut out = signal.clone();
        assert_eq!(limiter.process(&mut out), 1.0);
        let delay = 2 * limiter.latency_frames();
        assert_eq!(limiter.latency_frames(), 66);
        assert_eq!(out[delay..], signal[..signal.len() - delay]);
        assert!(out[..delay].iter().all(|&s| s == 0.0));
    }

    #[test]
    fn no_sample_exceeds_the_ceiling() {
        for level in [1.1, 5.0, 1e6] {
            let mut limiter = Limiter::new(48_000, 2, -0.3).unwrap();
            let ceiling = limiter.ceiling;
            let mut out = noise(40_000, level);
            let least = limiter.process(&mut out);
            assert!(least < 1.0);
            assert!(out.iter().all(|s| s.abs() <= ceiling));
        }
    }

    #[test]
    fn gain_is_reduced_before_the_peak_and_returns_to_one() {
        let mut limiter = Limiter::new(44_100, 2, 0.0).unwrap();
        let mut out = vec![0.25; 2 * 120_000];
        out[2 * 1000] = 4.0;
        limiter.process(&mut out);
        let delay = limiter.latency_frames();
        // The peak leaves at the ceiling without the clamp: neighbours have the same gain.
        assert!((out[2 * (1000 + delay)] - 1.0).abs() < 1e-6);
        assert!((out[2 * (1000 + delay) + 1] - 0.0625).abs() < 1e-6);
        // No step is larger than the full loss spread over the window.
        let largest = 0.25 * 0.75 / (delay as f32 + 1.0) + 1e-6;
        for pair in out[3..].chunks_exact(2).collect::<Vec<_>>().windows(2) {
            assert!((pair[1][0] - pair[0][0]).abs() <= largest || pair[1][0] == 0.25);
        }
        assert_eq!(out[2 * 119_999], 0.25);
    }

    #[test]
    fn block_split_does_not_change_a_bit() {
        let signal = noise(3000, 3.0);
        let (mut whole, mut parts) = (signal.clone(), signal);
        Limiter::new(44_100, 2, -1.0).unwrap().process(&mut whole);
        let mut limiter = Limiter::new(44_100, 2, -1.0).unwrap();
        for part in parts.chunks_mut(2 * 37) {
            limiter.process(part);
        }
        assert_eq!(whole, parts);
    }
}
