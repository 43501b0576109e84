//! From a bounce to the listener: which bounces are looked at, and what arrives.
//!
//! Every bounce knows what it would send to the listener by Lambert's law if nothing stood in between; a fixed number
//! of shadow rays asks whether something does, given to bounces in proportion to what they may send (systematic
//! sampling, \[COCHRAN77\] 9A.2), so that the sum stays right and a strong bounce is hardly ever missed.
//!
//! What is chosen depends on the listener's place to `CELL_M` only, and what a chosen bounce sends is computed anew for
//! wherever the listener is when the sum is asked for. So the sum is a smooth function of the place, and not of how many
//! updates the listener took to get there.

use glam::Vec3;

use crate::acoustics::BandArray;
use crate::acoustics::bands::fading;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::Scene;

/// Shadow rays of one source and update: half of them for bounces within the depth of discrete paths, half beyond.
pub const SHADOW_RAYS: usize = 64;

/// Radius in metres over which a bounce is spread, so that a listener who stands beside one does not hear it alone.
const SPREAD_M: f32 = 0.7;

/// Width in metres of the cells in which the same bounces are chosen.
const CELL_M: f32 = 2.0;

/// Radius in metres over which a bounce is spread for the choice: a listener is up to 1.7 m from the cell's centre.
const CHOICE_SPREAD_M: f32 = 1.5;

/// Energy that a bounce has for the tail.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Bounce {
    pub(super) point: Vec3,
    /// Unit normal on the side that sound leaves to.
    pub(super) normal: Vec3,
    pub(super) surface: u32,
    /// Way from the source.
    pub(super) length_m: f32,
    /// Energy leaving, without air.
    pub(super) energy: BandArray,
}

impl Bounce {
    /// What it may send to a listener about the middle of a cell, over all bands: what it is chosen by.
    #[inline]
    fn weight(&self, cell: Vec3) -> f32 {
        let spread = self.point.distance_squared(cell) + CHOICE_SPREAD_M * CHOICE_SPREAD_M;
        let e = &self.energy;
        let sum = ((e[0] + e[4]) + (e[2] + e[6])) + ((e[1] + e[5]) + (e[3] + e[7]));
        sum / spread
    }
}

/// Bounces that may be looked at from the listener, in the order of the rays.
#[derive(Debug, Clone, Default)]
pub(super) struct Bounces {
    /// Within the depth of discrete paths.
    pub(super) near: Vec<Bounce>,
    /// Beyond.
    pub(super) far: Vec<Bounce>,
}

/// A bounce whose sound arrives at the listener.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    point: Vec3,
    normal: Vec3,
    /// Way from the source to the bounce.
    before_m: f32,
    /// Way from there to where the listener was when it was looked at.
    after_m: f32,
    /// Energy leaving, one a band, less what the air over both ways takes.
    energy: BandArray,
}

impl Arrival {
    /// Seconds from emission, and energy relative to the free field's at 1 m: Lambert's cosine law over the way to the
    /// listener, with air.
    pub(super) fn at(&self, scene: &Scene, listener: Vec3) -> (f64, BandArray) {
        let way = listener - self.point;
        let after_m = way.length();
        let cosine = self.normal.dot(way).max(0.0) / after_m.max(1e-6);
        let kernel = cosine / (std::f32::consts::PI * (after_m * after_m + SPREAD_M * SPREAD_M));
        let further_m = after_m - self.after_m;
        let mut energy = self.energy;
        for (energy, m) in energy.iter_mut().zip(scene.air_np_per_m()) {
            // The exponential's first terms, never below nothing: it is a matter of a few metres.
            let x = 2.0 * m * further_m;
            *energy *= kernel / (1.0 + x + 0.5 * x * x);
        }
        let length_m = f64::from(self.before_m + after_m);
        (length_m / scene.speed_of_sound_m_s(), energy)
    }
}

/// Looks from bounces to the listener. Adds the rays it cast to `rays`; `weights` is memory to work in.
pub(super) fn connect(
    scene: &Scene,
    listener: Vec3,
    bounces: &Bounces,
    arrivals: &mut Vec<Arrival>,
    weights: &mut Vec<f32>,
    rays: &mut u64,
) {
    let cell = (listener / CELL_M).floor() * CELL_M + 0.5 * CELL_M;
    for list in [&bounces.near, &bounces.far] {
        weights.clear();
        weights.extend(list.iter().map(|bounce| bounce.weight(cell)));
        let total: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
        let stride = total / (SHADOW_RAYS / 2) as f64;
        if stride <= 0.0 {
            continue;
        }
        // Marks stand at (n + ½) strides along the sum of weights.
        let mut mark = 0.5 * stride;
        let mut sum = 0.0;
        for (bounce, &weight) in list.iter().zip(&*weights) {
            sum += f64::from(weight);
            if mark >= sum {
                continue;
            }
            let mut marks = 0.0;
            while mark < sum {
                mark += stride;
                marks += 1.0;
            }
            *rays += 1;
            let leg = Ray::between(bounce.point, listener);
            if scene.any_hit(&leg, [bounce.surface, NO_GROUP]) {
                continue;
            }
            let gain = (marks * stride / f64::from(weight)) as f32;
            let after_m = bounce.point.distance(listener);
            let length_m = bounce.length_m + after_m;
            let mut air = *scene.air_np_per_m();
            for m in &mut air {
                *m *= 2.0 * length_m;
            }
            let air = fading(&air);
            arrivals.push(Arrival {
                point: bounce.point,
                normal: bounce.normal,
                before_m: bounce.length_m,
                after_m,
                energy: std::array::from_fn(|b| bounce.energy[b] * gain * air[b]),
            });
        }
    }
}
