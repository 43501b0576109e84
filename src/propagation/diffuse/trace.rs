//! Source rays, followed side by side: what they carry from bounce to bounce, and the energy that each bounce has for the
//! tail.

use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::propagation::diffuse::bounce_buffer::{Block, Bounces, amplify, weight};
use crate::propagation::diffuse::ray_statistics::RayLog;
use crate::propagation::diffuse::source_rays::{
    FAR_BOUNCES, FAR_RAYS, SourceRays, far_stands_for, is_far,
};
use crate::propagation::diffuse::static_hit_cache::FixedWay;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::rays::directions::lambert_direction;
use crate::propagation::rays::packet::{PACKET_SIZE, PerRay, RayPacket, lanes, put_vector, vector};
use crate::scene::{Scene, Surface};
use crate::simd::kernel;

/// Band whose scattering coefficient decides whether a ray bounces diffusely: the one around 1 kHz.
const SCATTERING_BAND: usize = 4;

/// Share of its energy below which a ray ends: −60 dB.
const LEAST_SHARE: f32 = 1e-6;

/// Most far rays that there are of any number of rays: every one in `count / FAR_RAYS`, rounded down, is one. All of them are
/// followed side by side.
const MOST_FAR: usize = 2 * FAR_RAYS;
const _: () = assert!(MOST_FAR <= PACKET_SIZE);

kernel! {
    /// Follows all rays: what they carry, the energy that each bounce has for the tail, and the specular sequences they begin
    /// with. Rays are lanes, and where bands differ eight bands are; every product is rounded, so all machines give the same
    /// bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    pub(crate) fn follow<L>(
        scene: &Scene,
        from: &SourceRays<'_>,
        found: &mut SequenceSet,
        bounces: &mut Bounces,
        rays: &mut u64,
    ) {
        let count = from.directions.len();
        let depth = from.depth.max(1);
        let Bounces { near, far, log, way, .. } = bounces;
        let mut far_rays = Following::NONE;
        for first in (0..count).step_by(PACKET_SIZE) {
            let mut together = Following::NONE;
            let mut far_lanes = 0;
            for (lane, index) in (first..count).take(PACKET_SIZE).enumerate() {
                together.begin(from, lane, index);
                if is_far(index, count, from.rotation) && log.far_count() < MOST_FAR {
                    together.far[lane] = log.begin_far(index) as u8;
                    far_lanes |= 1 << lane;
                }
            }
            let (blocks, weights) = near.together_from(first);
            let gain = gain(1, count);
            for step in 0..depth {
                let weights = &mut weights[step..];
                let own = Step { step, stands_for_gain: gain, far_lanes, weights, stride: depth, log, way };
                together.bounce(scene, from, own, &mut blocks[step], rays);
            }
            log.give_sequences(scene, blocks, found);
            for lane in lanes(far_lanes) {
                far_rays.take(usize::from(together.far[lane]), &together, lane);
            }
        }
        let far_lanes = (1 << log.far_count()) - 1;
        let beyond = FAR_BOUNCES.saturating_sub(depth);
        if beyond > 0 && far_lanes != 0 {
            let (blocks, weights) = far.together_from(0);
            let gain = gain(far_stands_for(count), count);
            for step in depth..FAR_BOUNCES {
                let place = step - depth;
                let weights = &mut weights[place..];
                let own = Step { step, stands_for_gain: gain, far_lanes, weights, stride: beyond, log, way };
                far_rays.bounce(scene, from, own, &mut blocks[place], rays);
            }
        }
        for lane in lanes(far_lanes & !far_rays.escaped) {
            log.leave(lane, &far_rays.share[lane], far_rays.time_s(scene, lane));
        }
    }
}

/// What is sent by a bounce of one in `count` rays that stands for some of them.
fn gain(stands_for: usize, count: usize) -> f32 {
    4.0 * std::f32::consts::PI * stands_for as f32 / count as f32
}

/// A bounce of rays that are followed side by side.
struct Step<'a> {
    /// Its number.
    step: usize,
    stands_for_gain: f32,
    /// Far rays, one a bit.
    far_lanes: u32,
    /// Weights of the rays' bounces, `stride` apart.
    weights: &'a mut [f32],
    stride: usize,
    log: &'a mut RayLog,
    way: &'a mut FixedWay,
}

/// Rays under way, a ray a lane.
#[derive(Clone, Copy)]
struct Following {
    rays: RayPacket,
    /// Numbers among all rays, and among the far ones of those that are.
    index: PerRay<u32>,
    far: PerRay<u8>,
    /// Rays that have met nothing, one a bit; whose bounces so far were mirror reflections by panels; whose surfaces so far
    /// were panels.
    escaped: u32,
    mirrored: u32,
    panels: u32,
    length_m: PerRay<f32>,
    /// Squares of the source's directivity along each.
    squares: PerRay<BandArray>,
    /// Energy left of what each set out with, without air.
    share: PerRay<BandArray>,
    /// What of it the discrete paths carry.
    specular: PerRay<BandArray>,
}

impl Following {
    /// None.
    const NONE: Self = Self {
        rays: RayPacket::NONE,
        index: [0; PACKET_SIZE],
        far: [0; PACKET_SIZE],
        escaped: 0,
        mirrored: u32::MAX,
        panels: u32::MAX,
        length_m: [0.0; PACKET_SIZE],
        squares: [[1.0; BANDS]; PACKET_SIZE],
        share: [[1.0; BANDS]; PACKET_SIZE],
        specular: [[1.0; BANDS]; PACKET_SIZE],
    };

    /// A ray sets out.
    #[inline(always)]
    fn begin(&mut self, from: &SourceRays<'_>, lane: usize, index: usize) {
        let ray = Ray::new(from.origin.as_vec3(), from.turn * from.directions[index]);
        self.rays.begin(lane, &ray);
        self.index[lane] = index as u32;
        if !from.pose.settings.directivity.is_omni() {
            let factor = from.pose.factor_towards(ray.direction);
            for b in 0..BANDS {
                self.squares[lane][b] = factor[b] * factor[b];
            }
        }
    }

    /// Goes on with a ray of others, which has come to the end of discrete paths.
    #[inline(always)]
    fn take(&mut self, lane: usize, others: &Self, other: usize) {
        let (to, rays) = (&mut self.rays, &others.rays);
        put_vector(&mut to.origin, lane, vector(&rays.origin, other));
        put_vector(&mut to.direction, lane, vector(&rays.direction, other));
        to.last[lane] = rays.last[other];
        to.active |= (rays.active >> other & 1) << lane;
        self.index[lane] = others.index[other];
        self.far[lane] = others.far[other];
        self.escaped |= (others.escaped >> other & 1) << lane;
        self.length_m[lane] = others.length_m[other];
        self.squares[lane] = others.squares[other];
        self.share[lane] = others.share[other];
    }

    #[inline(always)]
    fn time_s(&self, scene: &Scene, lane: usize) -> f64 {
        f64::from(self.length_m[lane]) / scene.speed_of_sound_m_s()
    }

    /// On to what they meet next, into the lists, and away from it.
    #[inline(always)]
    fn bounce(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        own: Step<'_>,
        block: &mut Block,
        rays: &mut u64,
    ) {
        *rays += u64::from(self.rays.active.count_ones());
        if scene.has_instances() {
            self.cast_among_instances(scene, from, own.way, own.step, block);
            if own.step < from.depth.max(1) {
                self.keep_legs(scene, block, own.log);
            }
        } else {
            self.rays.cast(scene, &mut block.met);
        }
        self.escaped |= self.rays.active & !block.met.rays;
        let mut surfaces = [None; PACKET_SIZE];
        self.look_at_surfaces(scene, block, &mut surfaces);
        if own.step >= from.depth {
            self.panels = 0;
        }
        self.mirrored &= self.panels;
        block.mirrored = self.mirrored & block.met.rays;
        for l in 0..PACKET_SIZE {
            self.length_m[l] += block.met.leg_m[l];
        }
        for lane in lanes(block.met.rays & own.far_lanes) {
            let far = usize::from(self.far[lane]);
            own.log
                .carry(far, own.step, &self.share[lane], self.time_s(scene, lane));
        }
        let cosines = self.rays.mirror(&block.met, &mut block.normal);
        block.point = self.rays.origin;
        block.length_m = self.length_m;
        let spreads = block.spreads(from.origin.as_vec3());
        let mut draws = [0.0; PACKET_SIZE];
        for l in 0..PACKET_SIZE {
            draws[l] = from.draw(self.index[l], own.step, 0);
        }
        let is_omni = from.pose.settings.directivity.is_omni();
        self.rays.last = block.met.surface;
        self.rays.active = 0;
        for lane in lanes(block.met.rays) {
            let Some(surface) = surfaces[lane] else {
                continue;
            };
            let scattering = &scene.material_of(surface).scattering;
            let kept = scene.reflectance_of(surface).energy(cosines[lane]);
            let mut energy = self.reflect(lane, &kept, scattering);
            let draw = |k: u64| from.draw(self.index[lane], own.step, k);
            if draws[lane] < scattering[SCATTERING_BAND] {
                self.mirrored &= !(1 << lane);
                let normal = vector(&block.normal, lane);
                let onward = lambert_direction(normal, draw(1), draw(2));
                put_vector(&mut self.rays.direction, lane, onward);
            }
            let mut is_alive = false;
            for b in 0..BANDS {
                is_alive |= self.share[lane][b] > LEAST_SHARE;
            }
            if !is_alive {
                continue;
            }
            self.rays.active |= 1 << lane;
            if !is_omni {
                for b in 0..BANDS {
                    energy[b] *= self.squares[lane][b];
                }
            }
            amplify(&mut energy, own.stands_for_gain);
            own.weights[lane * own.stride] = weight(&energy, spreads[lane]);
            block.energy[lane] = energy;
        }
        self.rays.normalize_or(&block.normal);
    }

    /// Normals of what was met, and whether all of it were panels.
    #[inline(always)]
    fn look_at_surfaces<'a>(
        &mut self,
        scene: &'a Scene,
        block: &mut Block,
        surfaces: &mut PerRay<Option<&'a Surface>>,
    ) {
        let mut panels = 0;
        for lane in lanes(block.met.rays) {
            let surface = scene.surface(block.met.surface[lane]);
            surfaces[lane] = Some(surface);
            put_vector(&mut block.normal, lane, surface.normal.as_vec3());
            panels |= u32::from(scene.is_panel(block.met.triangle[lane])) << lane;
        }
        self.panels &= panels;
    }

    /// What a ray has left when it is reflected; gives what of it is the tail's.
    #[inline(always)]
    fn reflect(&mut self, lane: usize, kept: &BandArray, scattering: &BandArray) -> BandArray {
        let share = &mut self.share[lane];
        for b in 0..BANDS {
            share[b] *= kept[b];
        }
        let mut energy = *share;
        if self.panels >> lane & 1 == 1 {
            let specular = &mut self.specular[lane];
            // Loops of one product each become lanes.
            let mut mirrored = [0.0; BANDS];
            for b in 0..BANDS {
                mirrored[b] = kept[b] * (1.0 - scattering[b]);
            }
            for b in 0..BANDS {
                specular[b] *= mirrored[b];
            }
            for b in 0..BANDS {
                let rest = energy[b] - specular[b];
                energy[b] = if rest > 0.0 { rest } else { 0.0 };
            }
        }
        energy
    }

    /// Casts them where the fixed scene may be known.
    #[inline(never)]
    fn cast_among_instances(
        &self,
        scene: &Scene,
        from: &SourceRays<'_>,
        way: &mut FixedWay,
        step: usize,
        block: &mut Block,
    ) {
        self.rays.cast_by(scene, &mut block.met, |lane, ray, last| {
            let place = match step < from.depth.max(1) {
                true => from.near_leg(self.index[lane], step),
                false => from.far_leg(self.far[lane], step),
            };
            way.closest_hit(scene, ray, last, [self.index[lane] as usize, place])
        });
    }

    /// Keeps the legs of all that were under way.
    #[inline(never)]
    fn keep_legs(&self, scene: &Scene, block: &Block, log: &mut RayLog) {
        for lane in lanes(self.rays.active) {
            let has_met = block.met.rays >> lane & 1 == 1;
            let ends_at_instance = has_met && scene.is_of_instance(block.met.surface[lane]);
            let ray = self.rays.ray(lane);
            let t_max = match has_met {
                true => block.met.leg_m[lane],
                false => ray.t_max,
            };
            log.keep(Ray { t_max, ..ray }, ends_at_instance);
        }
    }
}
