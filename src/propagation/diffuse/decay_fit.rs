//! Reverberation time from what far source rays still carry as time goes on.
//!
//! Own. In a diffuse room the sum over the rays falls as \[KUTTRUFF\] 5.1 has it (Eyring's −ln(1 − ᾱ) a mean free path,
//! and a little slower by the spread of free paths, 5.30); where it is not diffuse, or rooms are coupled, or the sky is
//! open, it falls as the rays do. The line is laid through the part that lies beyond the discrete paths' bounces: a
//! source on a stage has short legs and soft curtains about it at first, which say nothing of the hall.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;
use crate::simd::prefetch;

/// Moments at which the rays' energy is looked at, and the seconds between them: a second in all, 32 bounces in
/// rooms up to a concert hall's size.
const MOMENTS: usize = 128;
const MOMENT_S: f64 = 0.008;

/// Mean free times after which the line begins.
const FIRST_FREE_TIME: f64 = 4.0;

/// Mean free times after which it ends at the latest: most rays are followed so far.
const LAST_FREE_TIME: f64 = 28.0;

/// Share of all energy below which there is no line to lay there, and it begins at once: an open sky.
const LEAST_REST: f64 = 1e-3;

/// Fall over which the line is laid, an energy ratio: 25 dB.
const FALL: f64 = 3.2e-3;

/// Range of decays that are told, in seconds: beyond lies a numerical accident, not a room; a tail shorter than the
/// generator's delay lines cannot be heard as one.
const DECAY_RANGE_S: (f64, f64) = (0.1, 30.0);

/// 60 dB in nepers of energy.
pub(crate) const NEPERS_OF_60_DB: f64 = 6.0 * std::f64::consts::LN_10;

/// What rays have shown of a decay.
#[derive(Debug, Clone)]
pub(crate) struct DecayCurve {
    /// Sum of what far rays carry at each moment, without air.
    energy: [BandArray; MOMENTS],
    /// Far rays.
    count: u32,
    /// Lengths of all legs after the first, and their number.
    legs_m: f64,
    legs: u32,
    /// First legs, which start anywhere.
    first_m: f64,
    first: u32,
}

/// The curves of sixteen rotations and their sum, as a tree: of one new curve four sums follow. The sum depends on the
/// curves by their numbers, not on which is the newest.
#[derive(Debug, Clone)]
pub(crate) struct CurveTree {
    /// The root is at 1, what `i` sums up at `2 i` and `2 i + 1`, the curves are at the end.
    nodes: Vec<DecayCurve>,
}

/// Place of the first curve in the tree.
const LEAVES: usize = ROTATIONS as usize;

impl Default for CurveTree {
    fn default() -> Self {
        Self {
            nodes: vec![DecayCurve::default(); 2 * LEAVES],
        }
    }
}

impl CurveTree {
    /// Asks for what [`Self::renew`] reads and writes.
    pub(crate) fn prefetch(&self, number: usize) {
        const A_LINE: usize = 64 / size_of::<BandArray>();
        let mut place = LEAVES + number % LEAVES;
        while place > 1 {
            for node in [place, place ^ 1] {
                let energy = self.nodes[node].energy.iter();
                energy.step_by(A_LINE).for_each(prefetch);
            }
            place /= 2;
        }
    }

    /// Has a curve drawn anew.
    pub(crate) fn renew(&mut self, number: usize, draw: impl FnOnce(&mut DecayCurve)) {
        let mut place = LEAVES + number % LEAVES;
        let curve = &mut self.nodes[place];
        *curve = DecayCurve::default();
        draw(curve);
        while place > 1 {
            place /= 2;
            let (sums, parts) = self.nodes.split_at_mut(2 * place);
            sums[place].set_sum(&parts[0], &parts[1]);
        }
    }

    /// The sum of all.
    pub(crate) fn sum(&self) -> &DecayCurve {
        &self.nodes[1]
    }
}

/// What the curve says.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Decay {
    /// Mean free path over the speed of sound.
    pub(crate) mean_free_time_s: f64,
    /// T60 in each band.
    pub(crate) decay_time_s: BandArray,
}

/// Sums of legs, as in [`DecayCurve`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Legs {
    rest_m: f64,
    rest: u32,
    first_m: f64,
    first: u32,
}

impl Legs {
    /// A leg that met something.
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
            energy: [[0.0; BANDS]; MOMENTS],
            count: 0,
            legs_m: 0.0,
            legs: 0,
            first_m: 0.0,
            first: 0,
        }
    }
}

impl DecayCurve {
    /// What is known of legs, to be added to.
    pub(crate) fn legs(&self) -> Legs {
        Legs {
            rest_m: self.legs_m,
            rest: self.legs,
            first_m: self.first_m,
            first: self.first,
        }
    }

    /// Puts it back.
    pub(crate) fn set_legs(&mut self, legs: Legs) {
        (self.legs_m, self.legs) = (legs.rest_m, legs.rest);
        (self.first_m, self.first) = (legs.first_m, legs.first);
    }

    /// A far ray sets out.
    #[inline(always)]
    pub(crate) fn begin(&mut self) {
        self.count += 1;
    }

    /// A far ray carries `share` from moment number `first` up to a time in seconds. Gives the number of the first moment from
    /// then on.
    #[inline(always)]
    pub(crate) fn carry(&mut self, share: &BandArray, first: u32, to_s: f64) -> u32 {
        let next = (to_s / MOMENT_S).ceil() as u32;
        let end = (next as usize).min(MOMENTS);
        for sum in &mut self.energy[(first as usize).min(end)..end] {
            for (sum, share) in sum.iter_mut().zip(share) {
                *sum += share;
            }
        }
        next
    }

    /// A far ray is followed no further than `at_s`: from there it goes on as it came.
    pub(crate) fn leave(&mut self, share: &BandArray, at_s: f64) {
        let first = (at_s / MOMENT_S).ceil() as usize;
        let factor = share.map(|s| f64::from(s).powf(MOMENT_S / at_s.max(MOMENT_S)) as f32);
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
        self.legs_m = a.legs_m + b.legs_m;
        self.legs = a.legs + b.legs;
        self.first_m = a.first_m + b.first_m;
        self.first = a.first + b.first;
    }

    /// `None` if no ray met anything.
    pub(crate) fn decay(&self, scene: &Scene) -> Option<Decay> {
        let mean_free_path_m = if self.legs > 0 {
            self.legs_m / f64::from(self.legs)
        } else if self.first > 0 {
            self.first_m / f64::from(self.first)
        } else {
            return None;
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

    /// Nepers a second by which the energy of a band falls: the slope of a line through its logarithm by least squares.
    fn slope(&self, band: usize, mean_free_time_s: f64) -> f64 {
        let energy = |moment: usize| f64::from(self.energy[moment][band]);
        let joint = ((FIRST_FREE_TIME * mean_free_time_s / MOMENT_S) as usize).min(MOMENTS / 2);
        let first = if energy(joint) > LEAST_REST * f64::from(self.count) {
            joint
        } else {
            0
        };
        let floor = FALL * energy(first);
        let (mut n, mut t, mut tt, mut y, mut ty) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let end = (LAST_FREE_TIME * mean_free_time_s / MOMENT_S) as usize;
        for moment in first..end.clamp(first + 3, MOMENTS) {
            if energy(moment) <= floor {
                break;
            }
            let (at_s, nepers) = ((moment - first) as f64 * MOMENT_S, energy(moment).ln());
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
