//! Reverberation time from the losses of source rays.
//!
//! Source: [KUTTRUFF] 5.1, Eyring's decay −ln(1 − ᾱ) a mean free path, with air and with legs that leave the scene as a
//! loss. Differs in that ᾱ and the mean free path are means over what the rays still carry in each band, and are taken
//! from bounces that have forgotten where the source stands: a source on a stage has short legs at first.

use crate::acoustics::{BANDS, BandArray};
use crate::scene::Scene;

/// Weight of a bounce within the discrete paths' depth against a later one. Enough to speak where no ray comes further,
/// as under an open sky; too little to matter in a room.
const EARLY_WEIGHT: f64 = 0.01;

/// Least share of energy that a bounce leaves: beyond it a logarithm says nothing.
const LEAST_KEPT: f64 = 1e-3;

/// Range of decays that are told, in seconds: beyond lies a numerical accident, not a room; a tail shorter than the
/// generator's delay lines cannot be heard as one.
const DECAY_RANGE_S: (f64, f64) = (0.1, 30.0);

/// Sums over the bounces of rays.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Losses {
    /// Energy that arrived at the ends of legs, one of them perhaps the sky.
    carried: [f64; BANDS],
    /// Energy that went on from there.
    kept: [f64; BANDS],
    /// Energy that arrived at surfaces, and the same times its leg's length.
    met: [f64; BANDS],
    met_m: [f64; BANDS],
    /// All legs that met something after the first, and their number.
    legs_m: f64,
    legs: f64,
    /// First legs, which start anywhere.
    first_m: f64,
    first: f64,
}

/// What the losses say.
#[derive(Debug, Clone, Copy)]
pub(super) struct Decay {
    /// Mean free path over the speed of sound.
    pub(super) mean_free_time_s: f64,
    /// T60 in each band.
    pub(super) decay_time_s: BandArray,
}

impl Losses {
    /// A first leg that met something.
    pub(super) fn first_leg(&mut self, leg_m: f64) {
        self.first_m += leg_m;
        self.first += 1.0;
    }

    /// A later leg that met something, with the energy it carried and what the surface leaves of it.
    pub(super) fn bounce(&mut self, late: bool, leg_m: f64, carried: &BandArray, kept: &BandArray) {
        let weight = if late { 1.0 } else { EARLY_WEIGHT };
        for b in 0..BANDS {
            let energy = weight * f64::from(carried[b]);
            self.carried[b] += energy;
            self.met[b] += energy;
            self.met_m[b] += energy * leg_m;
            self.kept[b] += weight * f64::from(kept[b]);
        }
        self.legs_m += weight * leg_m;
        self.legs += weight;
    }

    /// A later leg that left the scene.
    pub(super) fn escape(&mut self, late: bool, carried: &BandArray) {
        let weight = if late { 1.0 } else { EARLY_WEIGHT };
        for b in 0..BANDS {
            self.carried[b] += weight * f64::from(carried[b]);
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        for b in 0..BANDS {
            self.carried[b] += other.carried[b];
            self.kept[b] += other.kept[b];
            self.met[b] += other.met[b];
            self.met_m[b] += other.met_m[b];
        }
        self.legs_m += other.legs_m;
        self.legs += other.legs;
        self.first_m += other.first_m;
        self.first += other.first;
    }

    /// `None` if no ray met anything.
    pub(super) fn decay(&self, scene: &Scene) -> Option<Decay> {
        let mean_free_path_m = if self.legs > 0.0 {
            self.legs_m / self.legs
        } else if self.first > 0.0 {
            self.first_m / self.first
        } else {
            return None;
        };
        let speed_m_s = scene.speed_of_sound_m_s();
        let decay_time_s = std::array::from_fn(|b| {
            let kept = if self.carried[b] > 0.0 {
                (self.kept[b] / self.carried[b]).max(LEAST_KEPT)
            } else {
                LEAST_KEPT
            };
            let leg_m = if self.met[b] > 0.0 {
                self.met_m[b] / self.met[b]
            } else {
                mean_free_path_m
            };
            let air = 2.0 * f64::from(scene.air_np_per_m()[b]);
            let nepers_per_s = speed_m_s * (-kept.ln() / leg_m + air);
            (NEPERS_OF_60_DB / nepers_per_s).clamp(DECAY_RANGE_S.0, DECAY_RANGE_S.1) as f32
        });
        Some(Decay {
            mean_free_time_s: mean_free_path_m / speed_m_s,
            decay_time_s,
        })
    }
}

/// 60 dB in nepers of energy.
pub(super) const NEPERS_OF_60_DB: f64 = 6.0 * std::f64::consts::LN_10;
