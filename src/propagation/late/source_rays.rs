//! Source rays: how a source's energy spreads over the surfaces of a scene.
//!
//! All rays go as deep as discrete paths do; a few of them go on for [`FAR_BOUNCES`], since what a tail is like is not to
//! be seen from four bounces about the source. Whether a bounce is diffuse is drawn once for all bands.
//!
//! None of it depends on the listener, so what a rotation's rays have found stays true until the source or the scene is
//! another one, and is kept (`Found`).

use glam::{DVec3, Mat3, Quat, Vec3};

use super::super::path::MAX_ORDER;
use super::super::sampling::{lambert_direction, mix, unit};
use super::super::sequence::{Commutation, Sequence};
use super::super::sequence_set::SequenceSet;
use super::connection::{Bounce, Bounces};
use super::decay::DecayCurve;
use super::fixed_way::FixedWay;
use super::ray_log::RayLog;
use super::viewpoints::Viewpoints;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::scene::{Directivity, Scene, SourcePose};
use crate::simd::{LaneSet, kernel, prefetch};

/// Band whose scattering coefficient decides whether a ray bounces diffusely: the one around 1 kHz.
const SCATTERING_BAND: usize = 4;

/// Rays that go on beyond the depth of discrete paths.
pub const FAR_RAYS: usize = 8;

/// Bounces after which those end too: in a diffuse field of absorption 0.1 they have lost 15 dB by then, and the decay
/// of what is left is known.
pub const FAR_BOUNCES: usize = 32;

/// Of so many legs one may be another by now while instances move. Other bounces may be chosen then: a door that swings in a
/// hall brought up to 0.6 dB of a tail's energy and 5 % of its decay (`tests/remembered_rays.rs`).
const FEW_LEGS: usize = 64;

/// Share of its energy below which a ray ends: −60 dB.
const LEAST_SHARE: f32 = 1e-6;

/// Where source rays start and how many there are.
#[derive(Debug, Clone, Copy)]
pub struct SourceRays<'a> {
    /// The source, local coordinates.
    pub origin: DVec3,
    /// The listener, local coordinates.
    pub listener: DVec3,
    /// From where it is looked for what reaches the listener.
    pub viewpoints: &'a Viewpoints,
    /// The source as it is: rays carry what its directivity sends along them.
    pub pose: SourcePose,
    /// The lattice ([`super::super::sampling::lattice`]), one direction a ray.
    pub directions: &'a [Vec3],
    /// Rotation of the lattice.
    pub turn: Mat3,
    /// Number of the rotation, `update % ROTATIONS`.
    pub rotation: u64,
    /// Highest order of discrete paths.
    pub depth: usize,
    /// Seed of the diffuse bounces.
    pub seed: u64,
    /// A number that is another one whenever the scene is: rays find the same in a scene of the same number.
    pub scene_state: u64,
    /// The first state from which on nothing but poses of instances has changed, while they move, and `scene_state` else:
    /// what was found from then on stays for as long as instances touch few rays.
    pub poses_since: u64,
    /// The first state from which on nothing but poses of instances has changed.
    pub fixed_since: u64,
}

/// Rays that one far ray of `count` stands for.
fn far_stands_for(count: usize) -> usize {
    (count / FAR_RAYS).max(1)
}

/// Whether ray `index` of `count` goes on for [`FAR_BOUNCES`] in a rotation: another residue in each, so that far rays see
/// all heights of the lattice.
pub fn is_far(index: usize, count: usize, rotation: u64) -> bool {
    let every = far_stands_for(count);
    index % every == (7 * rotation % every as u64) as usize
}

impl SourceRays<'_> {
    /// A number from 0 to below 1 for a ray's bounce.
    #[inline]
    fn draw(&self, index: usize, step: usize, k: u64) -> f32 {
        let place = self.rotation << 32 | (index as u64) << 8 | (step as u64) << 2;
        unit(mix(self.seed ^ mix(place | k)))
    }

    /// Most legs of all rays.
    fn legs(&self) -> usize {
        let (count, depth) = (self.directions.len(), self.depth.max(1));
        let far = count.div_ceil(far_stands_for(count));
        count * depth + far * FAR_BOUNCES.saturating_sub(depth)
    }

    /// The place of a ray's leg among all.
    #[inline(always)]
    fn leg(&self, ray: &SourceRay, step: usize) -> usize {
        let (count, depth) = (self.directions.len(), self.depth.max(1));
        match ray.far.filter(|_| step >= depth) {
            None => ray.index * depth + step,
            Some(far) => {
                let beyond = FAR_BOUNCES.saturating_sub(depth);
                count * depth + far * beyond + step - depth
            }
        }
    }
}

/// All that rays depend on beside the listener's own things; the lattice is known by its length.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cast {
    origin: DVec3,
    orientation: Quat,
    directivity: Directivity,
    count: usize,
    turn: Mat3,
    rotation: u64,
    depth: usize,
    seed: u64,
    scene_state: u64,
}

impl Cast {
    fn of(from: &SourceRays<'_>) -> Self {
        Self {
            origin: from.origin,
            orientation: from.pose.orientation,
            directivity: from.pose.settings.directivity,
            count: from.directions.len(),
            turn: from.turn,
            rotation: from.rotation,
            depth: from.depth,
            seed: from.seed,
            scene_state: from.scene_state,
        }
    }
}

/// How much of what rays found they would find again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Known {
    /// All of it.
    Wholly,
    /// All but what instances on their way have to do with, which is little.
    Nearly,
    /// Nothing is known.
    Not,
}

/// What the rays of one rotation have found.
#[derive(Debug, Clone, Default)]
pub(super) struct Found {
    cast: Option<Cast>,
    /// The legs of their discrete depth, and how many of them ended at an instance; none in a scene without instances.
    legs: Vec<Ray>,
    legs_to_instances: usize,
    /// Where they went in the fixed scene, and whose rays those were; nothing in a scene without instances.
    way: FixedWay,
    way_of: Option<Cast>,
    /// Specular beginnings, each once, in the order of the rays.
    sequences: Vec<Sequence>,
}

impl Found {
    /// Room for all that `from` can find.
    pub(super) fn reserve(&mut self, scene: &Scene, from: &SourceRays<'_>) {
        let most = from.directions.len() * from.depth.max(1);
        self.sequences
            .reserve(most - self.sequences.len().min(most));
        if scene.has_instances() {
            self.legs.reserve(most - self.legs.len().min(most));
            self.way.reserve(from.directions.len(), from.legs());
        }
    }

    /// How much of it `from` would find again.
    pub(super) fn known(&self, scene: &Scene, from: &SourceRays<'_>) -> Known {
        let now = Cast::of(from);
        let Some(cast) = self.cast else {
            return Known::Not;
        };
        if cast == now {
            return Known::Wholly;
        }
        let scene_state = now.scene_state;
        let but_for_scene = Cast {
            scene_state,
            ..cast
        };
        if but_for_scene != now || cast.scene_state < from.poses_since {
            return Known::Not;
        }
        let most = self.legs.len() / FEW_LEGS;
        let mut touched = self.legs_to_instances;
        for leg in &self.legs {
            if touched > most {
                return Known::Not;
            }
            touched += usize::from(scene.enters_box_of_instance(leg));
        }
        match touched > most {
            true => Known::Not,
            false => Known::Nearly,
        }
    }

    /// Forgets it.
    pub(super) fn forget(&mut self) {
        self.cast = None;
        self.way_of = None;
    }

    /// Specular beginnings, each once, in the order of the rays.
    pub(super) fn sequences(&self) -> &[Sequence] {
        &self.sequences
    }

    /// Casts the rays. `set` is empty and becomes what they begin with.
    pub(super) fn renew(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        set: &mut SequenceSet,
        curve: &mut DecayCurve,
        bounces: &mut Bounces,
        rays: &mut u64,
    ) {
        let (count, depth) = (from.directions.len(), from.depth.max(1));
        bounces.near.renew(count * depth);
        let far_rays = count.div_ceil(far_stands_for(count));
        let beyond = FAR_BOUNCES.saturating_sub(depth);
        bounces.far.renew(far_rays * beyond);
        bounces.log.renew(count, depth, far_rays);
        if scene.has_instances() {
            bounces.log.reserve_legs(count * depth);
            let way_of = Some(Cast {
                scene_state: from.fixed_since,
                ..Cast::of(from)
            });
            let is_known = std::mem::replace(&mut self.way_of, way_of) == way_of;
            self.way.begin(count, from.legs(), is_known);
        }
        std::mem::swap(&mut self.way, &mut bounces.way);
        follow(LaneSet::best(), scene, from, set, bounces, rays);
        std::mem::swap(&mut self.way, &mut bounces.way);
        bounces.log.tell(curve);
        self.legs.clear();
        self.legs.extend_from_slice(bounces.log.legs());
        self.legs_to_instances = bounces.log.legs_to_instances();
        self.sequences.clear();
        self.sequences.extend_from_slice(set.entries());
        self.cast = Some(Cast::of(from));
    }
}

/// Rays that are followed side by side: enough for the next one's way to begin before the last one's is worked out, few enough
/// to stay at hand.
pub(super) const TOGETHER: usize = 16;

/// Most far rays that there are of any number of rays: every one in `count / FAR_RAYS`, rounded down, is one.
const MOST_FAR: usize = 2 * FAR_RAYS;

kernel! {
    /// Follows all rays: what they carry, the energy that each bounce has for the tail, and the specular sequences they begin
    /// with. Eight bands are eight lanes; every product is rounded, so all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn follow<L>(
        scene: &Scene,
        from: &SourceRays<'_>,
        found: &mut SequenceSet,
        bounces: &mut Bounces,
        rays: &mut u64,
    ) {
        let count = from.directions.len();
        let depth = from.depth.max(1);
        let mut far = [SourceRay::ENDED; MOST_FAR];
        let mut far_count = 0;
        for first in (0..count).step_by(TOGETHER) {
            let mut together = [SourceRay::ENDED; TOGETHER];
            let together = &mut together[..TOGETHER.min(count - first)];
            for (ray, index) in together.iter_mut().zip(first..) {
                *ray = SourceRay::new(from, index);
                if is_far(index, count, from.rotation) && far_count < MOST_FAR {
                    ray.far = Some(far_count);
                    bounces.log.begin_far(index, far_count);
                    far_count += 1;
                }
            }
            for step in 0..depth {
                bounce_all(scene, from, bounces, together, step, rays);
            }
            bounces.log.give_sequences(first, found);
            for ray in together {
                if let Some(number) = ray.far {
                    far[number] = *ray;
                }
            }
        }
        let far = &mut far[..far_count];
        for step in depth..FAR_BOUNCES {
            bounce_all(scene, from, bounces, far, step, rays);
        }
        for (number, ray) in far.iter().enumerate().filter(|(_, ray)| !ray.has_escaped) {
            bounces
                .log
                .leave(number, &ray.share, ray.time_s(scene));
        }
    }
}

/// Bounce number `step` of some rays, into the lists: all are cast before what they met is looked at, which has come by then.
#[inline(always)]
fn bounce_all(
    scene: &Scene,
    from: &SourceRays<'_>,
    bounces: &mut Bounces,
    together: &mut [SourceRay],
    step: usize,
    rays: &mut u64,
) {
    let has_instances = scene.has_instances();
    for ray in together.iter_mut().filter(|ray| !ray.has_ended) {
        *rays += 1;
        ray.hit = match has_instances {
            true => {
                let leg = [ray.index, from.leg(ray, step)];
                let way = &mut bounces.way;
                way.closest_hit(scene, &ray.ray, ray.last, leg)
            }
            false => scene.closest_hit(&ray.ray, [ray.last, NO_GROUP]),
        };
        if let Some(surface) = ray.hit.and_then(|hit| scene.kept_surface(hit.group)) {
            prefetch(surface);
            prefetch(&surface.material);
        }
    }
    let is_kept = step < from.depth.max(1) && has_instances;
    for ray in together.iter_mut().filter(|ray| !ray.has_ended) {
        if is_kept {
            let ends_at_instance = ray.hit.is_some_and(|hit| scene.is_of_instance(hit.group));
            let t_max = ray.hit.map_or(ray.ray.t_max, |hit| hit.t);
            bounces.log.keep(Ray { t_max, ..ray.ray }, ends_at_instance);
        }
        ray.follow(scene, from, bounces, step);
    }
}

/// A ray under way.
#[derive(Clone, Copy)]
struct SourceRay {
    index: usize,
    /// Its number among the far rays.
    far: Option<usize>,
    has_ended: bool,
    has_escaped: bool,
    ray: Ray,
    /// What it met last of all, and the surface that it starts from.
    hit: Option<Hit>,
    last: u32,
    length_m: f32,
    /// The source's directivity along it.
    factor: BandArray,
    /// Energy left of what it set out with, without air.
    share: BandArray,
    /// What of it the discrete paths carry.
    specular: BandArray,
    /// Surfaces that it was mirrored in, and their normals.
    surfaces: [u32; MAX_ORDER],
    normals: [DVec3; MAX_ORDER],
    commutation: Commutation,
    /// Whether all its bounces so far were mirror reflections by panels.
    mirrored: bool,
    /// Whether all surfaces so far were panels.
    panels: bool,
}

impl SourceRay {
    /// In place of one.
    const ENDED: Self = Self {
        index: 0,
        far: None,
        has_ended: true,
        has_escaped: false,
        ray: Ray {
            origin: Vec3::ZERO,
            direction: Vec3::X,
            t_min: 0.0,
            t_max: 0.0,
        },
        hit: None,
        last: NO_GROUP,
        length_m: 0.0,
        factor: [1.0; BANDS],
        share: [1.0; BANDS],
        specular: [1.0; BANDS],
        surfaces: [0; MAX_ORDER],
        normals: [DVec3::ZERO; MAX_ORDER],
        commutation: Commutation::NONE,
        mirrored: true,
        panels: true,
    };

    #[inline(always)]
    fn new(from: &SourceRays<'_>, index: usize) -> Self {
        let ray = Ray::new(from.origin.as_vec3(), from.turn * from.directions[index]);
        let factor = match from.pose.settings.directivity.is_omni() {
            true => [1.0; BANDS],
            false => from.pose.factor_towards(ray.direction),
        };
        Self {
            index,
            has_ended: false,
            ray,
            factor,
            ..Self::ENDED
        }
    }

    #[inline(always)]
    fn time_s(&self, scene: &Scene) -> f64 {
        f64::from(self.length_m) / scene.speed_of_sound_m_s()
    }

    /// Away from what it has met as bounce number `step`, into the lists.
    #[inline(always)]
    fn follow(&mut self, scene: &Scene, from: &SourceRays<'_>, bounces: &mut Bounces, step: usize) {
        let Some(mut bounce) = self.advance(scene, from, &mut bounces.log, step) else {
            self.has_ended = true;
            return;
        };
        let (count, depth) = (from.directions.len(), from.depth.max(1));
        if !from.pose.settings.directivity.is_omni() {
            for b in 0..BANDS {
                bounce.energy[b] *= self.factor[b] * self.factor[b];
            }
        }
        let beyond = FAR_BOUNCES.saturating_sub(depth);
        let (list, place, stands_for) = match self.far.filter(|_| step >= depth) {
            None => (&mut bounces.near, self.index * depth + step, 1),
            Some(far) => (
                &mut bounces.far,
                far * beyond + step - depth,
                far_stands_for(count),
            ),
        };
        let gain = 4.0 * std::f32::consts::PI * stands_for as f32 / count as f32;
        for b in 0..BANDS {
            bounce.energy[b] *= gain;
        }
        list.put(place, bounce, from.origin.as_vec3());
    }

    /// Away from the surface that it has met; `None` where the ray ends.
    #[inline(always)]
    fn advance(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        log: &mut RayLog,
        step: usize,
    ) -> Option<Bounce> {
        let Some(hit) = self.hit else {
            self.has_escaped = true;
            return None;
        };
        log.leg(self.index, step, hit.t);
        self.length_m += hit.t;
        if let Some(far) = self.far {
            log.carry(far, step, &self.share, self.time_s(scene));
        }
        let surface = scene.surface(hit.group);
        let plane = surface.normal;
        let normal = facing(plane.as_vec3(), self.ray.direction);
        let into = normal.dot(self.ray.direction);
        let scattering = &scene.material_of(surface).scattering;
        let kept = scene.reflectance_of(surface).energy(into.abs());
        self.panels = self.panels && step < from.depth && scene.is_panel(hit.triangle);
        for b in 0..BANDS {
            self.share[b] *= kept[b];
        }
        let mut energy = self.share;
        if self.panels {
            // Loops of one product each become lanes.
            let mut mirrored = [0.0; BANDS];
            for b in 0..BANDS {
                mirrored[b] = kept[b] * (1.0 - scattering[b]);
            }
            for b in 0..BANDS {
                self.specular[b] *= mirrored[b];
            }
            for b in 0..BANDS {
                let rest = energy[b] - self.specular[b];
                energy[b] = if rest > 0.0 { rest } else { 0.0 };
            }
        }
        self.mirrored &= self.panels;
        if self.mirrored && step < MAX_ORDER {
            self.surfaces[step] = hit.group;
            self.normals[step] = plane;
            self.commutation.put_last(&self.normals[..=step]);
            let sequence = self.commutation.canonical(&self.surfaces[..=step]);
            log.sequence(self.index, step, sequence);
        }
        let point = self.ray.at(hit.t);
        let draw = |k: u64| from.draw(self.index, step, k);
        let onward = if draw(0) < scattering[SCATTERING_BAND] {
            self.mirrored = false;
            lambert_direction(normal, draw(1), draw(2))
        } else {
            self.ray.direction - 2.0 * into * normal
        };
        self.ray = Ray::new(point, onward.normalize_or(normal));
        self.last = hit.group;
        let mut alive = false;
        for b in 0..BANDS {
            alive |= self.share[b] > LEAST_SHARE;
        }
        alive.then_some(Bounce {
            point,
            normal,
            surface: hit.group,
            length_m: self.length_m,
            energy,
        })
    }
}

/// The normal on the side that a ray comes from.
#[inline]
fn facing(normal: Vec3, direction: Vec3) -> Vec3 {
    if normal.dot(direction) > 0.0 {
        -normal
    } else {
        normal
    }
}
