//! Source rays: how a source's energy spreads over the surfaces of a scene.
//!
//! All rays go as deep as discrete paths do; a few of them go on for [`FAR_BOUNCES`], since what a tail is like is not to
//! be seen from four bounces about the source. Whether a bounce is diffuse is drawn once for all bands.

use glam::{DVec3, Mat3, Vec3};

use super::super::path::MAX_ORDER;
use super::super::sampling::{fibonacci_direction, lambert_direction, mix, unit};
use super::super::sequence::Sequence;
use super::super::sequence_set::SequenceSet;
use super::connection::Candidate;
use super::decay::DecayCurve;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::{Scene, SourcePose};

/// Band whose scattering coefficient decides whether a ray bounces diffusely: the one around 1 kHz.
const SCATTERING_BAND: usize = 4;

/// Rays that go on beyond the depth of discrete paths.
pub const FAR_RAYS: u32 = 8;

/// Bounces after which those end too: in a diffuse field of absorption 0.1 they have lost 15 dB by then, and the decay
/// of what is left is known.
pub const FAR_BOUNCES: usize = 32;

/// Share of its energy below which a ray ends: −60 dB.
const LEAST_SHARE: f32 = 1e-6;

/// Where source rays start and how many there are.
#[derive(Debug, Clone, Copy)]
pub struct SourceRays {
    /// The source, local coordinates.
    pub origin: DVec3,
    /// The listener, local coordinates.
    pub listener: DVec3,
    /// The source as it is: rays carry what its directivity sends along them.
    pub pose: SourcePose,
    /// Rotation of the lattice.
    pub turn: Mat3,
    /// Number of the rotation, `update % ROTATIONS`.
    pub rotation: u64,
    /// Number of rays.
    pub count: u32,
    /// Highest order of discrete paths.
    pub depth: usize,
    /// Seed of the diffuse bounces.
    pub seed: u64,
}

impl SourceRays {
    /// A number from 0 to below 1 for a ray's bounce.
    fn draw(&self, index: u32, step: usize, k: u64) -> f32 {
        let place = self.rotation << 32 | u64::from(index) << 8 | (step as u64) << 2;
        unit(mix(self.seed ^ mix(place | k)))
    }
}

/// Follows all rays: what they carry, the energy that each bounce has for the tail, and the specular sequences they begin
/// with.
pub(super) fn follow(
    scene: &Scene,
    from: &SourceRays,
    found: &mut SequenceSet,
    curve: &mut DecayCurve,
    candidates: &mut Vec<Candidate>,
    rays: &mut u64,
) {
    let every = (from.count / FAR_RAYS).max(1);
    for index in 0..from.count {
        // Another residue in each rotation, so that far rays see all heights of the lattice.
        let is_far = index % every == (7 * from.rotation % u64::from(every)) as u32;
        let bounces = if is_far {
            FAR_BOUNCES
        } else {
            from.depth.max(1)
        };
        let mut ray = SourceRay::new(from, index, is_far);
        let directivity = from.pose.factor_towards(ray.ray.direction);
        if is_far {
            curve.begin();
        }
        for step in 0..bounces {
            *rays += 1;
            let far_of = if step >= from.depth.max(1) { every } else { 1 };
            match ray.advance(scene, from, found, curve, step) {
                Some(mut candidate) => {
                    candidate.is_far = far_of > 1;
                    let gain = 4.0 * std::f32::consts::PI * far_of as f32 / from.count as f32;
                    for (energy, factor) in candidate.energy.iter_mut().zip(directivity) {
                        *energy *= factor * factor;
                    }
                    candidate.weigh(from.listener.as_vec3(), gain);
                    candidates.push(candidate);
                }
                None => break,
            }
        }
        if is_far && !ray.escaped {
            curve.leave(&ray.share, ray.time_s(scene));
        }
    }
}

/// A ray under way.
struct SourceRay {
    index: u32,
    is_far: bool,
    escaped: bool,
    ray: Ray,
    last: u32,
    length_m: f32,
    /// Energy left of what it set out with, without air.
    share: BandArray,
    /// What of it the discrete paths carry.
    specular: BandArray,
    surfaces: [u32; MAX_ORDER],
    /// Whether all its bounces so far were mirror reflections by panels.
    mirrored: bool,
    /// Whether all surfaces so far were panels.
    panels: bool,
}

impl SourceRay {
    fn new(from: &SourceRays, index: u32, is_far: bool) -> Self {
        let direction = from.turn * fibonacci_direction(index, from.count);
        Self {
            index,
            is_far,
            escaped: false,
            ray: Ray::new(from.origin.as_vec3(), direction),
            last: NO_GROUP,
            length_m: 0.0,
            share: [1.0; BANDS],
            specular: [1.0; BANDS],
            surfaces: [0; MAX_ORDER],
            mirrored: true,
            panels: true,
        }
    }

    fn time_s(&self, scene: &Scene) -> f64 {
        f64::from(self.length_m) / scene.speed_of_sound_m_s()
    }

    /// To the next surface and away from it; `None` where the ray ends.
    fn advance(
        &mut self,
        scene: &Scene,
        from: &SourceRays,
        found: &mut SequenceSet,
        curve: &mut DecayCurve,
        step: usize,
    ) -> Option<Candidate> {
        let from_s = self.time_s(scene);
        let Some(hit) = scene.closest_hit(&self.ray, [self.last, NO_GROUP]) else {
            self.escaped = true;
            return None;
        };
        self.length_m += hit.t;
        curve.leg(step == 0, f64::from(hit.t));
        if self.is_far {
            curve.carry(&self.share, from_s, self.time_s(scene));
        }
        let normal = facing(
            scene.surface(hit.group).normal.as_vec3(),
            self.ray.direction,
        );
        let reflectance = scene.reflectance(hit.group);
        let scattering = scene.material(hit.group).scattering;
        let kept = reflectance.energy(normal.dot(self.ray.direction).abs());
        self.panels &= scene.is_panel(hit.triangle) && step < from.depth;
        let mut energy = [0.0; BANDS];
        for b in 0..BANDS {
            self.share[b] *= kept[b];
            self.specular[b] *= kept[b] * (1.0 - scattering[b]);
            let discrete = if self.panels { self.specular[b] } else { 0.0 };
            energy[b] = (self.share[b] - discrete).max(0.0);
        }
        self.mirrored &= self.panels;
        if self.mirrored && step < MAX_ORDER {
            self.surfaces[step] = hit.group;
            found.insert(Sequence::canonical(scene, &self.surfaces[..=step]));
        }
        let point = self.ray.at(hit.t);
        let draw = |k: u64| from.draw(self.index, step, k);
        let onward = if draw(0) < scattering[SCATTERING_BAND] {
            self.mirrored = false;
            lambert_direction(normal, draw(1), draw(2))
        } else {
            self.ray.direction - 2.0 * normal.dot(self.ray.direction) * normal
        };
        self.ray = Ray::new(point, onward.normalize_or(normal));
        self.last = hit.group;
        let alive = self.share.iter().any(|share| *share > LEAST_SHARE);
        alive.then_some(Candidate {
            point,
            normal,
            surface: hit.group,
            length_m: self.length_m,
            energy,
            ..Candidate::default()
        })
    }
}

/// The normal on the side that a ray comes from.
fn facing(normal: Vec3, direction: Vec3) -> Vec3 {
    if normal.dot(direction) > 0.0 {
        -normal
    } else {
        normal
    }
}
