//! From a bounce to the listener: which bounces are looked at, and what arrives.
//!
//! Every bounce knows what it would send to the listener by Lambert's law if nothing stood in between; a fixed number
//! of shadow rays asks whether something does, given to bounces in proportion to what they would send (systematic
//! sampling, \[COCHRAN77\] 9A.2), so that the sum stays right and a strong bounce is never missed.

use glam::Vec3;

use super::source_rays::Bounces;
use crate::acoustics::bands::fading;
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
pub(super) struct Bounce {
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
}

impl Bounce {
    /// From what leaves to what arrives: Lambert's cosine law over the way to the listener, with air.
    #[inline]
    pub(super) fn weigh(&mut self, scene: &Scene, listener: Vec3, gain: f32) {
        let way = listener - self.point;
        let distance_m = way.length();
        let cosine = self.normal.dot(way) / distance_m.max(1e-6);
        let spread = distance_m * distance_m + SPREAD_M * SPREAD_M;
        let kernel = gain * cosine.max(0.0) / (std::f32::consts::PI * spread);
        self.length_m += distance_m;
        let nepers = scene.air_np_per_m();
        let mut air = [0.0; BANDS];
        for b in 0..BANDS {
            air[b] = 2.0 * nepers[b] * self.length_m;
        }
        let air = fading(&air);
        for b in 0..BANDS {
            self.energy[b] *= kernel * air[b];
        }
        let e = &self.energy;
        self.weight = ((e[0] + e[4]) + (e[2] + e[6])) + ((e[1] + e[5]) + (e[3] + e[7]));
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
    bounces: &Bounces,
    arrivals: &mut Vec<Arrival>,
    rays: &mut u64,
) {
    for list in [&bounces.near, &bounces.far] {
        let total: f64 = list.iter().map(|bounce| f64::from(bounce.weight)).sum();
        let stride = total / (SHADOW_RAYS / 2) as f64;
        if stride <= 0.0 {
            continue;
        }
        // Marks stand at (n + ½) strides along the sum of weights.
        let mut mark = 0.5 * stride;
        let mut sum = 0.0;
        for bounce in list {
            sum += f64::from(bounce.weight);
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
            if scene.bvh().any_hit(&leg, [bounce.surface, NO_GROUP]) {
                continue;
            }
            let gain = (marks * stride / f64::from(bounce.weight)) as f32;
            let mut energy = bounce.energy;
            for value in &mut energy {
                *value *= gain;
            }
            arrivals.push(Arrival {
                delay_s: f64::from(bounce.length_m) / scene.speed_of_sound_m_s(),
                energy,
            });
        }
    }
}
