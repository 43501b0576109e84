//! Reverberation time from the energy decay of far source rays.
//!
//! Own. In a diffuse room the rays' energy decays by \[KUTTRUFF\] 5.1 (Eyring's −ln(1 − ᾱ) per mean free path, and a
//! little slower by the variance of free paths, 5.30); in coupled, non-diffuse or open spaces the rays determine the decay.
//! The line is fitted beyond the bounces of discrete paths: the first legs about a source on a stage, short and between
//! soft curtains, do not represent the hall.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;
use crate::simd::prefetch;

/// Samples of the decay curve and their distance in seconds: one second, 32 bounces in rooms up to a concert hall's size.
const TIME_STEPS: usize = 128;
const TIME_STEP_S: f64 = 0.008;

/// Start of the fit in mean free times.
const FIRST_FREE_TIME: f64 = 4.0;

/// Latest end of the fit in mean free times: most rays last so long.
const LAST_FREE_TIME: f64 = 28.0;

/// Share of all energy at the start below which the fit starts at once: an open sky.
const MIN_REMAINDER: f64 = 1e-3;

/// Energy ratio over which the line is fitted: 25 dB.
const DECAY_FALL: f64 = 3.2e-3;

/// Range of reverberation times in seconds: shorter ones are inaudible with the generator's delay lines, longer ones are
/// numerical accidents.
const DECAY_RANGE_S: (f64, f64) = (0.1, 30.0);

/// 60 dB in nepers of energy.
pub(crate) const NEPERS_OF_60_DB: f64 = 6.0 * std::f64::consts::LN_10;

/// Energy decay curve of far rays, and legs of all rays.
#[derive(Debug, Clone)]
pub(crate) struct DecayCurve {
    /// Sum of the far rays' shares at each time step, without air absorption.
    energy: [BandArray; TIME_STEPS],
    /// Number of far rays.
    count: u32,
    /// Legs of all rays.
    pub(crate) legs: LegSums,
}

/// Lengths and numbers of legs that end at a surface.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LegSums {
    rest_m: f64,
    rest: u32,
    /// First legs, which do not start at a surface.
    first_m: f64,
    first: u32,
}

/// The curves of sixteen rotations and their sum, as a tree: a new curve changes four sums. The sum does not depend on the
/// order of the updates.
#[derive(Debug, Clone)]
pub(crate) struct CurveTree {
    /// The root is at 1, the children of `i` are at `2 i` and `2 i + 1`, the curves are at the end.
    nodes: Vec<DecayCurve>,
}

/// Index of the first curve in the tree.
const FIRST_LEAF: usize = ROTATIONS as usize;

impl Default for CurveTree {
    fn default() -> Self {
        Self {
            nodes: vec![DecayCurve::default(); 2 * FIRST_LEAF],
        }
    }
}

impl CurveTree {
    /// Prefetches the memory of [`Self::renew`].
    pub(crate) fn prefetch(&self, number: usize) {
        const A_LINE: usize = 64 / size_of::<BandArray>();
        let mut index = FIRST_LEAF + number % FIRST_LEAF;
        while index > 1 {
            for node in [index, index ^ 1] {
                let energy = self.nodes[node].energy.iter();
                energy.step_by(A_LINE).for_each(prefetch);
            }
            index /= 2;
        }
    }

    /// Replaces a curve and updates the sums.
    pub(crate) fn renew(&mut self, number: usize, draw: impl FnOnce(&mut DecayCurve)) {
        let mut index = FIRST_LEAF + number % FIRST_LEAF;
        let curve = &mut self.nodes[index];
        *curve = DecayCurve::default();
        draw(curve);
        while index > 1 {
            index /= 2;
            let (sums, parts) = self.nodes.split_at_mut(2 * index);
            sums[index].set_sum(&parts[0], &parts[1]);
        }
    }

    /// The sum of all.
    pub(crate) fn sum(&self) -> &DecayCurve {
        &self.nodes[1]
    }
}

/// Parameters of the decay.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Decay {
    /// Mean free path over the speed of sound, in seconds.
    pub(crate) mean_free_time_s: f64,
    /// T60 per band in seconds.
    pub(crate) decay_time_s: BandArray,
}

impl LegSums {
    /// Adds a leg.
    #[inline(always)]
    pub(crate) fn add(&mut self, is_first: bool, leg_m: f32) {
        let leg_m = f64::from(leg_m);
        if is_first {
            self.first_m += leg_m;
            self.first += 1;
        } else {
            self.rest_m += leg_m;
            self.rest += 1;
        }
    }
}

impl Default for DecayCurve {
    fn default() -> Self {
        Self {
            energy: [[0.0; BANDS]; TIME_STEPS],
            count: 0,
            legs: LegSums::default(),
        }
    }
}

impl DecayCurve {
    /// Adds a far ray.
    #[inline(always)]
    pub(crate) fn begin(&mut self) {
        self.count += 1;
    }

    /// Adds a far ray's share from time step `first` up to a time in seconds. Returns the next time step.
    #[inline(always)]
    pub(crate) fn accumulate(&mut self, share: &BandArray, first: u32, to_s: f64) -> u32 {
        let next = (to_s / TIME_STEP_S).ceil() as u32;
        let end = (next as usize).min(TIME_STEPS);
        for sum in &mut self.energy[(first as usize).min(end)..end] {
            for (sum, share) in sum.iter_mut().zip(share) {
                *sum += share;
            }
        }
        next
    }

    /// Extrapolates a far ray's mean decay from its last bounce at `at_s` seconds.
    pub(crate) fn extrapolate(&mut self, share: &BandArray, at_s: f64) {
        let first = (at_s / TIME_STEP_S).ceil() as usize;
        let factor = share.map(|s| f64::from(s).powf(TIME_STEP_S / at_s.max(TIME_STEP_S)) as f32);
        let mut left = *share;
        for sum in self.energy.iter_mut().skip(first) {
            for b in 0..BANDS {
                sum[b] += left[b];
                left[b] *= factor[b];
            }
        }
    }

    fn set_sum(&mut self, a: &Self, b: &Self) {
        let parts = a.energy.as_flattened().iter().zip(b.energy.as_flattened());
        for (sum, (a, b)) in self.energy.as_flattened_mut().iter_mut().zip(parts) {
            *sum = a + b;
        }
        self.count = a.count + b.count;
        self.legs = LegSums {
            rest_m: a.legs.rest_m + b.legs.rest_m,
            rest: a.legs.rest + b.legs.rest,
            first_m: a.legs.first_m + b.legs.first_m,
            first: a.legs.first + b.legs.first,
        };
    }

    /// `None` if no ray hit a surface.
    pub(crate) fn decay(&self, scene: &Scene) -> Option<Decay> {
        let mean_free_path_m = match self.legs {
            LegSums { rest_m, rest, .. } if rest > 0 => rest_m / f64::from(rest),
            LegSums { first_m, first, .. } if first > 0 => first_m / f64::from(first),
            _ => return None,
        };
        let speed_m_s = scene.speed_of_sound_m_s();
        let mean_free_time_s = mean_free_path_m / speed_m_s;
        let decay_time_s = std::array::from_fn(|b| {
            let air = 2.0 * f64::from(scene.air_np_per_m()[b]);
            let nepers_per_s = self.slope(b, mean_free_time_s) + speed_m_s * air;
            (NEPERS_OF_60_DB / nepers_per_s).clamp(DECAY_RANGE_S.0, DECAY_RANGE_S.1) as f32
        });
        Some(Decay {
            mean_free_time_s,
            decay_time_s,
        })
    }

    /// Decay of a band's energy in nepers per second: the slope of a least-squares line through its logarithm.
    fn slope(&self, band: usize, mean_free_time_s: f64) -> f64 {
        let energy = |time_step: usize| f64::from(self.energy[time_step][band]);
        let joint =
            ((FIRST_FREE_TIME * mean_free_time_s / TIME_STEP_S) as usize).min(TIME_STEPS / 2);
        let has_rest = energy(joint) > MIN_REMAINDER * f64::from(self.count);
        let first = if has_rest { joint } else { 0 };
        let floor = DECAY_FALL * energy(first);
        let (mut n, mut t, mut tt, mut y, mut ty) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let end = (LAST_FREE_TIME * mean_free_time_s / TIME_STEP_S) as usize;
        for time_step in first..end.clamp(first + 3, TIME_STEPS) {
            if energy(time_step) <= floor {
                break;
            }
            let at_s = (time_step - first) as f64 * TIME_STEP_S;
            let nepers = energy(time_step).ln();
            n += 1.0;
            t += at_s;
            tt += at_s * at_s;
            y += nepers;
            ty += at_s * nepers;
        }
        if n < 2.0 {
            return NEPERS_OF_60_DB / DECAY_RANGE_S.0;
        }
        ((t * y - n * ty) / (n * tt - t * t)).max(0.0)
    }
}
