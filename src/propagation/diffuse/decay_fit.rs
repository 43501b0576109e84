//! Decay rates of the late reverb's groups, from the energy that arrives at a listener.
//!
//! Own; after common slopes (\[GOTZ23\]). The first group has the decay of what arrives late of the whole scene, the last
//! one the early decay of what the listener's surroundings send. The second one lies between; where both are alike, it is
//! slower than they are, since energy that passes from room to room decays more slowly than in any of them.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::transport::STEPS;
use crate::propagation::late_group::LATE_GROUPS;

/// Range of reverberation times in seconds: shorter ones are inaudible with the generator's delay lines, longer ones are
/// numerical accidents.
const DECAY_RANGE_S: (f32, f32) = (0.1, 30.0);

/// 60 dB in nepers of energy.
pub(crate) const NEPERS_OF_60_DB: f64 = 6.0 * std::f64::consts::LN_10;

/// Level below the peak to which the slow decay is fitted: 45 dB.
const SLOW_RANGE: f32 = 3.2e-5;

/// Share of that span after which its fit starts.
const SLOW_START: f32 = 0.5;

/// Fall over which the fast decay is fitted: 12 dB.
const FAST_FALL: f32 = 0.063;

/// First time step of the fast decay's fit, and its least number of steps.
const FAST_START: usize = 2;
const FAST_STEPS: usize = 4;

/// Ratio of the decay rates, in octaves, up to which they are one and from which on they are two.
const ONE_DECAY: f64 = 1.0;
const TWO_DECAYS: f64 = 2.0;

/// Rate of the second group relative to the only decay.
const SLOWER: f64 = 0.8;

/// Decay rates in nepers of energy per second from energies per time step: of all patches, and of those
/// near the listener.
pub(crate) fn rates_of(
    all: &[BandArray; STEPS],
    near: &[BandArray; STEPS],
    step_s: f32,
) -> [BandArray; LATE_GROUPS] {
    let per_s = 1.0 / f64::from(step_s);
    let range = DECAY_RANGE_S;
    let (least, most) = (
        NEPERS_OF_60_DB / f64::from(range.1),
        NEPERS_OF_60_DB / f64::from(range.0),
    );
    let mut rates = [[0.0; BANDS]; LATE_GROUPS];
    for b in 0..BANDS {
        let slow = slow_slope(all, b).map_or(most, |slope| slope * per_s);
        let slow = slow.clamp(least, most);
        let fast = fast_slope(near, b).map_or(most, |slope| slope * per_s);
        let ratio = (fast / slow).max(2.0);
        let share = ((ratio.log2() - ONE_DECAY) / (TWO_DECAYS - ONE_DECAY)).clamp(0.0, 1.0);
        let other = SLOWER.powf(1.0 - share) * ratio.powf(0.5 * share);
        let of_groups = [slow, slow * other, slow * ratio];
        for (rates, rate) in rates.iter_mut().zip(of_groups) {
            rates[b] = rate.clamp(least, most) as f32;
        }
    }
    rates
}

/// Reverberation times in seconds of decay rates in nepers of energy per second.
pub(crate) fn decay_times(rates: &[BandArray; LATE_GROUPS]) -> [BandArray; LATE_GROUPS] {
    rates.map(|rates| rates.map(|rate| (NEPERS_OF_60_DB / f64::from(rate)) as f32))
}

/// Decay per time step in the second half of the audible range.
fn slow_slope(energy: &[BandArray; STEPS], band: usize) -> Option<f64> {
    let peak = energy.iter().map(|energy| energy[band]).fold(0.0, f32::max);
    let is_audible = |energy: &BandArray| energy[band] > SLOW_RANGE * peak;
    let end = 1 + energy.iter().rposition(is_audible)?;
    let first = (SLOW_START * end as f32) as usize;
    slope(&energy[first..end], band)
}

/// Decay per time step over the first [`FAST_FALL`].
fn fast_slope(energy: &[BandArray; STEPS], band: usize) -> Option<f64> {
    let peak = energy.iter().map(|energy| energy[band]).fold(0.0, f32::max);
    let first = energy.iter().position(|energy| energy[band] == peak)?;
    let first = first.clamp(FAST_START, STEPS - FAST_STEPS);
    let floor = FAST_FALL * peak;
    let count = energy[first..]
        .iter()
        .take_while(|energy| energy[band] > floor);
    let end = first + count.count().max(FAST_STEPS);
    slope(&energy[first..end.min(STEPS)], band)
}

/// Fall of a least-squares line through the logarithm, per time step.
fn slope(energy: &[BandArray], band: usize) -> Option<f64> {
    let (mut n, mut t, mut tt, mut y, mut ty) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (step, energy) in energy.iter().enumerate() {
        if energy[band] > 0.0 {
            let (at, nepers) = (step as f64, f64::from(energy[band]).ln());
            n += 1.0;
            t += at;
            tt += at * at;
            y += nepers;
            ty += at * nepers;
        }
    }
    (n > 2.0).then(|| ((t * y - n * ty) / (n * tt - t * t)).max(0.0))
}
