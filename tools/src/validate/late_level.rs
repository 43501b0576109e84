//! Law *late/level*: energy of the late reverb in each octave, beside what the graphics frame asks for.
//!
//! The reference is the definition of [`LateSend`]: the energy of the response in a band is the integral of its envelope.

use std::sync::Arc;

use super::late_sound::{RATE_HZ, power, render};
use super::{Case, Row};
use foresound::acoustics::bands::{CENTRES_HZ, NOMINAL_HZ};
use foresound::acoustics::{BANDS, BandArray};
use foresound::error::Result;
use foresound::extrapolation::{FramePaths, LATE_GROUPS, LateGroup, LateSend};
use foresound::generation::Hrtf;
use foresound::scene::SourceId;

/// Length of a response in seconds.
const LENGTH_S: f64 = 4.0;

/// Start of the envelope after emission in seconds.
const START_S: f32 = 0.02;

/// Sources, each with its own signs in the network: a single response has the random spectrum of noise.
const SLOTS: usize = 8;

/// Half of the width in octaves of what counts of a band: next to its edges, other bands have a share.
const HALF_WIDTH: f64 = 0.25;

/// Decay times in seconds per band: flat, and as in a furnished hall.
const DECAYS_S: [(&str, BandArray); 2] = [
    ("flat", [1.0; BANDS]),
    ("hall", [2.2, 2.0, 1.8, 1.6, 1.5, 1.3, 1.0, 0.7]),
];

/// Law *late/level*.
pub(super) fn level() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (name, decays_s) in DECAYS_S {
        let mut mean = [0.0; BANDS];
        for group in 0..LATE_GROUPS {
            for slot in 0..SLOTS {
                let found = energies(group, slot, decays_s)?;
                for (mean, energy) in mean.iter_mut().zip(found) {
                    *mean += energy / (LATE_GROUPS * SLOTS) as f64;
                }
            }
        }
        let mut case = Case::new(format!("late/level: {name}"));
        for (band, energy) in mean.into_iter().enumerate() {
            let off_db = 10.0 * energy.log10();
            let what = format!("{} Hz", NOMINAL_HZ[band]);
            case.at_most(&what, off_db.abs(), 1.0, "dB");
        }
        rows.append(&mut case.rows);
    }
    Ok(rows)
}

/// Energy in each band of the response to an impulse, for a group that is sent the energy 1 in each.
fn energies(group: usize, slot: usize, decays_s: BandArray) -> Result<[f64; BANDS]> {
    let mut frame = FramePaths {
        late_groups: [LateGroup::isotropic(decays_s); LATE_GROUPS],
        ..FramePaths::default()
    };
    let energy_per_s = decays_s.map(|decay_s| {
        let rate = 6.0 * std::f32::consts::LN_10 / decay_s;
        rate * (rate * START_S).exp()
    });
    frame.late.push(LateSend {
        source: SourceId::new(slot as u16, 0),
        group: group as u8,
        energy_per_s,
        start_s: START_S,
    });
    let [response, _] = render(
        &frame,
        &Arc::new(Hrtf::omnidirectional(RATE_HZ)?),
        slot,
        LENGTH_S,
    )?;
    let response: Vec<f64> = response.iter().map(|v| f64::from(*v)).collect();
    let length = response.len().next_power_of_two();
    let power = power(&response, length);
    let bin_hz = f64::from(RATE_HZ) / length as f64;
    Ok(std::array::from_fn(|band| {
        let center_hz = CENTRES_HZ[band];
        let edge = |octaves: f64| (center_hz * octaves.exp2() / bin_hz) as usize;
        let bins = &power[edge(-HALF_WIDTH)..edge(HALF_WIDTH)];
        bins.iter().sum::<f64>() / bins.len() as f64
    }))
}
