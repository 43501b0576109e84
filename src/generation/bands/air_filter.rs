//! Absorption of air above the highest band, as a short filter of a path.
//!
//! Construction: control side. [`AirFilter::of`] and [`AirState::filter`]: audio side, no allocation. A band's amplitude holds from its
//! centre on: above 8 kHz the bands alone would lose at 16 kHz what they lose at 8 kHz, 10 dB instead of 36 dB over 100 m.
//! The filter has nine symmetric taps. Its response is 1 at 0 Hz and, at [`HIGH_AIR_HZ`], that of the air over the whole
//! path, raised by what the interpolation of the delay line loses there; the band gains are divided by its response at
//! the band centres. At 20 °C and 50 % the sum follows ISO 9613-1 within 0.2 dB up to 16 kHz and 100 m at 44.1 and 48 kHz. Own.

use std::f64::consts::{PI, TAU};

use crate::acoustics::bands::{CENTRES_HZ, exp_neg};
use crate::acoustics::medium::HIGH_AIR_HZ;
use crate::acoustics::{BANDS, BandArray};
use crate::generation::delay::interpolation::weights;
use crate::simd::{F32x8, LaneSet, Lanes, kernel};

/// Taps on each side of the middle, and the delay of the filter in frames.
pub(crate) const AIR_DELAY: usize = 4;

/// Frames by which scratch memory is longer than what is filtered.
pub(crate) const AIR_SCRATCH: usize = 2 * AIR_DELAY + 7;

/// The middle tap, and those at distance 1 to [`AIR_DELAY`].
pub(crate) type AirTaps = [f32; AIR_DELAY + 1];

/// Fewest nepers at 16 kHz of a path with a filter: 1.3 dB.
const MIN_NEPERS: f32 = 0.15;

/// Mean of the interpolation's loss over all fractions of a frame, relative to that halfway.
const MEAN_SHARE: f32 = 0.55;

/// Most nepers at 16 kHz that the filter reproduces: 37 dB. A longer path keeps the filter of this loss.
const MAX_NEPERS: f32 = 4.3;

/// Least sample rate in Hz with frequencies to filter.
const MIN_RATE_HZ: u32 = 32_000;

// Twice the frequencies are lanes.
const _: () = assert!(2 * HIGH_AIR_HZ.len() == BANDS);

/// The taps of a path in motion, and of one at rest. The interpolation's loss depends on the fraction of a frame, which a
/// path in motion passes through many times in a graphics frame: it has the mean.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PathTaps {
    pub(crate) moving: AirTaps,
    pub(crate) resting: AirTaps,
}

/// The filter of one path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PathAir {
    pub(crate) taps: PathTaps,
    /// The response at the band centres.
    pub(crate) response: BandArray,
}

/// Filters at one sample rate, linear in the loss at each of [`HIGH_AIR_HZ`].
#[derive(Debug, Clone)]
pub(crate) struct AirFilter {
    /// Change of the taps by loss; the rest of the lanes is zero.
    taps: [F32x8; HIGH_AIR_HZ.len()],
    /// Change of the response at the band centres by loss.
    response: [F32x8; HIGH_AIR_HZ.len()],
    /// What the interpolation halfway between two frames loses, twice.
    halfway_loss: F32x8,
    is_needed: bool,
}

impl AirFilter {
    pub(crate) fn new(rate_hz: u32) -> Self {
        let x = |hz: f64| 1.0 - (TAU * hz / f64::from(rate_hz)).cos();
        let nodes = HIGH_AIR_HZ.map(x);
        let mut filter = Self {
            taps: Default::default(),
            response: Default::default(),
            halfway_loss: F32x8(std::array::from_fn(|lane| {
                let hz = HIGH_AIR_HZ[lane % HIGH_AIR_HZ.len()];
                halfway_loss(hz / f64::from(rate_hz)) as f32
            })),
            is_needed: rate_hz >= MIN_RATE_HZ,
        };
        for node in 0..HIGH_AIR_HZ.len() {
            // The polynomial in x = 1 − cos ω that is 1 at this node and 0 at 0 Hz and at the other nodes.
            let value = |x: f64| -> f64 {
                let others = (0..nodes.len()).filter(|other| *other != node);
                let factor = |root: f64| (x - root) / (nodes[node] - root);
                factor(0.0) * others.map(|other| factor(nodes[other])).product::<f64>()
            };
            for (lane, tap) in filter.taps[node].0.iter_mut().zip(taps_of(value)) {
                *lane = tap as f32;
            }
            filter.response[node] = F32x8(CENTRES_HZ.map(|hz| value(x(hz)) as f32));
        }
        filter
    }

    /// The filter of a path of `delay_s` seconds in air of these Np/s at [`HIGH_AIR_HZ`], read at this fraction of a frame;
    /// `None` for a short path.
    pub(crate) fn of(
        &self,
        np_per_s: &[f32; HIGH_AIR_HZ.len()],
        delay_s: f64,
        fraction: f32,
    ) -> Option<PathAir> {
        let highest = np_per_s[HIGH_AIR_HZ.len() - 1];
        let nepers = highest * delay_s as f32;
        if !self.is_needed || !(MIN_NEPERS..f32::INFINITY).contains(&nepers) {
            return None;
        }
        let delay_s = (delay_s as f32).min(MAX_NEPERS / highest);
        let mut losses = [0.0; BANDS];
        for (lane, loss) in losses.iter_mut().enumerate() {
            *loss = np_per_s[lane % HIGH_AIR_HZ.len()] * delay_s;
        }
        // Of the loss halfway; within 3 % at all fractions.
        let resting = 4.0 * fraction * (1.0 - fraction);
        let resting = (resting * resting * resting).sqrt();
        // In motion and at rest.
        let shares = F32x8(std::array::from_fn(|lane| match lane < HIGH_AIR_HZ.len() {
            true => MEAN_SHARE,
            false => resting,
        }));
        let one = F32x8::splat(1.0);
        let losses = F32x8(exp_neg(&losses)) / (one - shares * self.halfway_loss) - one;
        let mut taps = [F32x8([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]); 2];
        let mut response = one;
        for node in 0..HIGH_AIR_HZ.len() {
            let [moving, resting] = [0, HIGH_AIR_HZ.len()].map(|from| losses.0[from + node]);
            taps[0] += F32x8::splat(moving) * self.taps[node];
            taps[1] += F32x8::splat(resting) * self.taps[node];
            response += F32x8::splat(moving) * self.response[node];
        }
        let [moving, resting] = taps.map(|taps| std::array::from_fn(|tap| taps.0[tap]));
        let taps = PathTaps { moving, resting };
        let response = response.0;
        Some(PathAir { taps, response })
    }
}

/// Taps of a polynomial in x = 1 − cos ω, by its values at even steps of ω: a cosine transform.
fn taps_of(value: impl Fn(f64) -> f64) -> [f64; AIR_DELAY + 1] {
    let ends = |index: usize| {
        if index.is_multiple_of(AIR_DELAY) {
            0.5
        } else {
            1.0
        }
    };
    std::array::from_fn(|tap| {
        let term = |step: usize| {
            let turn = PI * step as f64 / AIR_DELAY as f64;
            ends(step) * value(1.0 - turn.cos()) * (turn * tap as f64).cos()
        };
        let sum: f64 = (0..=AIR_DELAY).map(term).sum();
        if tap == AIR_DELAY {
            0.5 * sum / AIR_DELAY as f64
        } else {
            sum / AIR_DELAY as f64
        }
    })
}

/// Loss of amplitude by the interpolation halfway between two frames, at a frequency relative to the sample rate.
fn halfway_loss(frequency: f64) -> f64 {
    let weights = weights(0.5).into_iter().enumerate();
    // The weights are symmetric about 2.5.
    let cosine = |index: usize| (TAU * frequency * (index as f64 - 2.5)).cos();
    1.0 - weights
        .map(|(index, weight)| f64::from(weight) * cosine(index))
        .sum::<f64>()
}

kernel! {
    /// Filters `input`, which begins with twice [`AIR_DELAY`] earlier frames and has a whole number of eights after them,
    /// into `output`.
    fn filter_lanes<L>(input: &[f32], taps: &AirTaps, output: &mut [f32]) {
        let taps = taps.map(L::splat);
        let (eights, rest) = output.as_chunks_mut::<8>();
        let mut from = 0;
        for eight in eights {
            filter_eight(&input[from..], &taps).store(eight);
            from += 8;
        }
        if !rest.is_empty() {
            let eight = filter_eight(&input[from..], &taps).to_array();
            rest.copy_from_slice(&eight.0[..rest.len()]);
        }
    }
}

/// Eight filtered frames; zeros if the input is shorter than they need.
#[inline(always)]
fn filter_eight<L: Lanes>(input: &[f32], taps: &[L; AIR_DELAY + 1]) -> L {
    let Some(window) = input.first_chunk::<{ 8 + 2 * AIR_DELAY }>() else {
        return L::splat(0.0);
    };
    let mut sum = L::load_at(window, AIR_DELAY).mul(taps[0]);
    for away in 1..=AIR_DELAY {
        let before = L::load_at(window, AIR_DELAY - away);
        let pair = before.add(L::load_at(window, AIR_DELAY + away));
        sum = pair.mul_add(taps[away], sum);
    }
    sum
}

/// State of a filtered path.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct AirState {
    pub(crate) taps: AirTaps,
    /// The last input.
    last: [f32; 2 * AIR_DELAY],
}

impl AirState {
    pub(crate) fn new(taps: &PathTaps) -> Self {
        Self {
            taps: taps.resting,
            ..Self::default()
        }
    }

    /// Forgets the last input.
    pub(crate) fn clear(&mut self) {
        self.last = Default::default();
    }

    /// Filters frames in place; `scratch` is longer by [`AIR_SCRATCH`].
    pub(crate) fn filter(&mut self, set: LaneSet, frames: &mut [f32], scratch: &mut [f32]) {
        let count = frames.len();
        let input = &mut scratch[..count.next_multiple_of(8) + 2 * AIR_DELAY];
        input[..2 * AIR_DELAY].copy_from_slice(&self.last);
        input[2 * AIR_DELAY..][..count].copy_from_slice(frames);
        self.last.copy_from_slice(&input[count..][..2 * AIR_DELAY]);
        filter_lanes(set, input, &self.taps, frames);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Response of taps at a frequency.
    fn response(taps: &AirTaps, turn: f64) -> f64 {
        let each = taps.iter().enumerate().skip(1);
        let sides = each.map(|(away, tap)| 2.0 * f64::from(*tap) * (turn * away as f64).cos());
        f64::from(taps[0]) + sides.sum::<f64>()
    }

    #[test]
    fn the_response_is_the_loss_at_its_frequencies() {
        let np_per_s = [1.0, 2.0, 3.0, 5.0];
        for rate_hz in [44_100, 48_000, 96_000] {
            // Without a loss by interpolation.
            let air = AirFilter {
                halfway_loss: F32x8::ZERO,
                ..AirFilter::new(rate_hz)
            };
            let air = air.of(&np_per_s, 0.3, 0.5).expect("long");
            let turn = |hz: f64| TAU * hz / f64::from(rate_hz);
            // The exponential's 2.5e-6, and nine taps of terms that cancel, each rounded by 6e-8: up to 20, at 96 kHz 3000.
            let error = if rate_hz == 96_000 { 1.6e-3 } else { 1.4e-5 };
            for (hz, np_per_s) in HIGH_AIR_HZ.iter().zip(np_per_s) {
                let exact = f64::from(-0.3 * np_per_s).exp();
                let found = response(&air.taps.moving, turn(*hz));
                assert!(
                    (found - exact).abs() < error,
                    "{found} for {exact} at {hz} of {rate_hz} Hz"
                );
            }
            for (hz, found) in CENTRES_HZ.iter().zip(air.response) {
                let found = f64::from(found);
                assert!((response(&air.taps.moving, turn(*hz)) - found).abs() < error);
            }
            assert!((response(&air.taps.moving, 0.0) - 1.0).abs() < error);
        }
    }

    #[test]
    fn short_paths_and_low_rates_have_no_filter() {
        let np_per_s = [1.0, 2.0, 3.0, 5.0];
        assert!(AirFilter::new(48_000).of(&np_per_s, 0.01, 0.5).is_none());
        assert!(AirFilter::new(48_000).of(&[0.0; 4], 1.0, 0.5).is_none());
        assert!(AirFilter::new(16_000).of(&np_per_s, 0.3, 0.5).is_none());
    }

    #[test]
    fn parts_do_not_matter() {
        let resting = [0.5, 0.2, 0.04, 0.01, 0.002];
        let taps = &PathTaps {
            moving: [0.0; AIR_DELAY + 1],
            resting,
        };
        let mut whole: Vec<f32> = (0..100u16).map(|n| f32::from(n * 37 % 101)).collect();
        let mut parts = whole.clone();
        let mut scratch = [0.0; 128];
        AirState::new(taps).filter(LaneSet::best(), &mut whole, &mut scratch);
        let mut state = AirState::new(taps);
        for part in parts.chunks_mut(13) {
            state.filter(LaneSet::best(), part, &mut scratch);
        }
        assert_eq!(whole, parts);
    }
}
