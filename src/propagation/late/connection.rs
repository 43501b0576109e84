//! From a bounce to the listener: which bounces are looked at, and what arrives.
//!
//! Every bounce knows what it would send to the listener by Lambert's law if nothing stood in between; a fixed number
//! of shadow rays asks whether something does, given to bounces in proportion to what they would send (systematic
//! sampling, \[COCHRAN77\] 9A.2), so that the sum stays right and a strong bounce is never missed.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::Scene;

/// Shadow rays of one source and update: half of them for bounces within the depth of discrete paths, half beyond.
pub const SHADOW_RAYS: usize = 64;

/// Radius in metres over which a bounce is spread, so that a listener who stands beside one does not hear it alone.
const SPREAD_M: f32 = 0.7;

/// Energy that a bounce has for the tail.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Candidate {
    pub(super) point: Vec3,
    /// Unit normal on the side that sound leaves to.
    pub(super) normal: Vec3,
    pub(super) surface: u32,
    /// Way from the source, then to the listener.
    pub(super) length_m: f32,
    /// Energy leaving, then arriving.
    pub(super) energy: BandArray,
    /// Sum over the bands.
    pub(super) weight: f32,
    /// Beyond the depth of discrete paths.
    pub(super) is_far: bool,
}

impl Candidate {
    /// From what leaves to what arrives: Lambert's cosine law over the way to the listener, with air.
    pub(super) fn weigh(&mut self, scene: &Scene, listener: Vec3, gain: f32) {
        let way = listener - self.point;
        let distance_m = way.length();
        let cosine = self.normal.dot(way) / distance_m.max(1e-6);
        let spread = distance_m * distance_m + SPREAD_M * SPREAD_M;
        let kernel = gain * cosine.max(0.0) / (std::f32::consts::PI * spread);
        self.length_m += distance_m;
        for (energy, m) in self.energy.iter_mut().zip(scene.air_np_per_m()) {
            *energy *= kernel * (-2.0 * m * self.length_m).exp();
        }
        self.weight = self.energy.iter().sum();
    }
}

/// Energy that arrives at the listener at one moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    /// Seconds from emission.
    pub(super) delay_s: f64,
    /// Relative to the free field's at 1 m, one a band.
    pub(super) energy: BandArray,
}

/// Looks from bounces to the listener. Adds the rays it cast to `rays`.
pub(super) fn connect(
    scene: &Scene,
    listener: Vec3,
    candidates: &[Candidate],
    arrivals: &mut Vec<Arrival>,
    rays: &mut u64,
) {
    for is_far in [false, true] {
        let chosen = || candidates.iter().filter(|c| c.is_far == is_far);
        let total: f64 = chosen().map(|c| f64::from(c.weight)).sum();
        let stride = total / (SHADOW_RAYS / 2) as f64;
        if stride <= 0.0 {
            continue;
        }
        // Marks stand at (n + ½) strides along the sum of weights.
        let mut mark = 0.5 * stride;
        let mut sum = 0.0;
        for candidate in chosen() {
            sum += f64::from(candidate.weight);
            let mut marks = 0.0;
            while mark < sum {
                mark += stride;
                marks += 1.0;
            }
            if marks == 0.0 {
                continue;
            }
            *rays += 1;
            let leg = Ray::between(candidate.point, listener);
            if scene.any_hit(&leg, [candidate.surface, NO_GROUP]) {
                continue;
            }
            let gain = (marks * stride / f64::from(candidate.weight)) as f32;
            let mut energy = candidate.energy;
            for value in energy.iter_mut().take(BANDS) {
                *value *= gain;
            }
            arrivals.push(Arrival {
                delay_s: f64::from(candidate.length_m) / scene.speed_of_sound_m_s(),
                energy,
            });
        }
    }
}
