//! Tracing of source rays in packets: their energy from bounce to bounce, and the late energy of each bounce. Rays are
//! reflected specularly; what scatters leaves them.

use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::propagation::diffuse::bounce_buffer::{
    BounceBuffer, BounceEnergy, BouncePacket, amplify_by, weight,
};
use crate::propagation::diffuse::curved_prefix::CurvedPrefix;
use crate::propagation::diffuse::deposits::Deposits;
use crate::propagation::diffuse::ray_statistics::RayStatistics;
use crate::propagation::diffuse::source_rays::{FAR_BOUNCES, FAR_RAYS, SourceRays};
use crate::propagation::diffuse::static_hit_cache::StaticHitCache;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::rays::packet::{PACKET_SIZE, PerRay, RayPacket, lanes, put_vector, vector};
use crate::scene::{Scene, Surface};
use crate::simd::kernel;

/// Share of its energy below which a ray ends: −50 dB.
const MIN_SHARE: f32 = 1e-5;

/// Least weight of a bounce in the selection relative to the energy that its surface transmits, which the room behind hears of the same
/// selection: an open window reflects nothing, and a mirror nothing that discrete paths do not carry.
const OF_TRANSMITTED: f32 = 1.0 / 16.0;

// Far rays are one packet.
const _: () = assert!(FAR_RAYS <= PACKET_SIZE);

/// Scratch memory and results of tracing one rotation's rays.
#[derive(Debug, Clone, Default)]
pub(crate) struct TraceBuffers {
    /// Bounces within the depth of discrete paths.
    pub(crate) near: BounceBuffer,
    /// Bounces of far rays beyond.
    pub(crate) far: BounceBuffer,
    /// Cumulative weights during selection.
    pub(crate) sums: Vec<f64>,
    /// Energy of the selected bounces at the scene's patches.
    pub(crate) deposits: Deposits,
    /// States of all packets at the discrete depth.
    states: Vec<RayState>,
    /// Legs and specular prefixes.
    pub(crate) statistics: RayStatistics,
    /// The rotation's hits in the fixed scene, in a scene with instances.
    pub(crate) static_hits: StaticHitCache,
}

kernel! {
    /// Traces all rays into `buffers`, and their specular prefixes into `found`. Rays and bands are lanes. No fused products:
    /// all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    pub(crate) fn trace_rays<L>(
        scene: &Scene,
        from: &SourceRays<'_>,
        found: &mut SequenceSet,
        buffers: &mut TraceBuffers,
        rays: &mut u64,
    ) {
        let (count, depth) = (from.count(), from.near_bounces());
        let TraceBuffers { near, far, statistics, static_hits, states, .. } = buffers;
        // The source sends 4π.
        let gain = 4.0 * std::f32::consts::PI / count as f32;
        states.clear();
        for first in (0..count).step_by(PACKET_SIZE) {
            let mut packet_rays = RayState::NONE;
            for (lane, index) in (first..count).take(PACKET_SIZE).enumerate() {
                packet_rays.begin(from, lane, index);
            }
            let (packets, weights) = near.packets_from(first);
            for step in 0..depth {
                let weights = &mut weights[step..];
                let bounce = PacketStep { step, gain, weights, stride: depth, statistics, static_hits };
                packet_rays.bounce(scene, from, bounce, &mut packets[step], rays);
            }
            statistics.emit_sequences(scene, packets, found);
            states.push(packet_rays);
        }
        let beyond = from.far_bounces();
        if beyond > 0 {
            let mut far_rays = select_far_rays(states, from.rotation);
            if scene.has_instances() {
                for lane in lanes(far_rays.rays.active) {
                    let legs = from.far_leg_index(lane as u8, depth);
                    static_hits.begin_far_ray(lane, far_rays.index[lane], legs..legs + beyond);
                }
            }
            let (packets, weights) = far.packets_from(0);
            for step in depth..FAR_BOUNCES {
                let index = step - depth;
                let weights = &mut weights[index..];
                let bounce = PacketStep { step, gain, weights, stride: beyond, statistics, static_hits };
                far_rays.bounce(scene, from, bounce, &mut packets[index], rays);
            }
        }
    }
}

/// The part of incident energy that a surface transmits.
#[inline(never)]
fn transmitted(scene: &Scene, surface: u32, incident: &BandArray) -> BandArray {
    let factor = scene.transmission_factor(surface);
    std::array::from_fn(|b| incident[b] * factor[b] * factor[b])
}

/// Chooses [`FAR_RAYS`] rays in proportion to the energy that they still have (systematic sampling, \[COCHRAN77\] 9A.2), with
/// another start in each rotation; each represents the others' energy.
#[inline(always)]
fn select_far_rays(packets: &[RayState], rotation: u64) -> RayState {
    let mut far = RayState::NONE;
    let rays = || {
        packets
            .iter()
            .flat_map(|rays| lanes(rays.rays.active).map(move |lane| (rays, lane)))
    };
    let total: f64 = rays().map(|(rays, lane)| rays.energy(lane)).sum();
    let stride = total / FAR_RAYS as f64;
    // The golden ratio spreads the starts.
    let mut mark = stride * (rotation as f64 * 0.618_033_988_75 + 0.5).fract();
    let (mut sum, mut count) = (0.0, 0);
    for (rays, lane) in rays() {
        let energy = rays.energy(lane);
        sum += energy;
        let mut marks = 0.0;
        while mark < sum {
            mark += stride;
            marks += 1.0;
        }
        if marks > 0.0 && count < FAR_RAYS {
            far.take(count, rays, lane);
            far.represented[count] = (marks * stride / energy) as f32;
            count += 1;
        }
    }
    far
}

/// One bounce of a packet.
struct PacketStep<'a> {
    /// Its index.
    step: usize,
    gain: f32,
    /// Weights of the bounces, `stride` apart.
    weights: &'a mut [f32],
    stride: usize,
    statistics: &'a mut RayStatistics,
    static_hits: &'a mut StaticHitCache,
}

/// State of a packet's rays, one per lane.
#[derive(Debug, Clone, Copy)]
struct RayState {
    rays: RayPacket,
    /// Indices among all rays.
    index: PerRay<u32>,
    /// Rays that each one represents.
    represented: PerRay<f32>,
    /// Bit mask of the rays that were reflected by panels only, within the discrete depth.
    panels: u32,
    /// Bit mask of the rays whose reflections may go on as a discrete path over a curved surface, and how.
    bent: u32,
    curved: PerRay<CurvedPrefix>,
    length_m: PerRay<f32>,
    /// The source's directivity as energy.
    squares: PerRay<BandArray>,
    /// Share of the initial energy that is not scattered, without air absorption.
    share: PerRay<BandArray>,
}

impl RayState {
    const NONE: Self = Self {
        rays: RayPacket::NONE,
        index: [0; PACKET_SIZE],
        represented: [1.0; PACKET_SIZE],
        panels: u32::MAX,
        bent: 0,
        curved: [CurvedPrefix::None; PACKET_SIZE],
        length_m: [0.0; PACKET_SIZE],
        squares: [[1.0; BANDS]; PACKET_SIZE],
        share: [[1.0; BANDS]; PACKET_SIZE],
    };

    /// Starts a ray.
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

    /// Energy of a ray in all bands.
    #[inline(always)]
    fn energy(&self, lane: usize) -> f64 {
        let bands = self.share[lane].iter().zip(&self.squares[lane]);
        f64::from(bands.map(|(share, square)| share * square).sum::<f32>())
    }

    /// Continues a ray of another packet beyond the discrete depth.
    #[inline(always)]
    fn take(&mut self, lane: usize, others: &Self, other: usize) {
        let (to, rays) = (&mut self.rays, &others.rays);
        put_vector(&mut to.origin, lane, vector(&rays.origin, other));
        put_vector(&mut to.direction, lane, vector(&rays.direction, other));
        to.last[lane] = rays.last[other];
        to.active |= (rays.active >> other & 1) << lane;
        self.index[lane] = others.index[other];
        self.length_m[lane] = others.length_m[other];
        self.squares[lane] = others.squares[other];
        self.share[lane] = others.share[other];
    }

    /// Casts the rays, records their bounces and reflects them.
    #[inline(always)]
    fn bounce(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        bounce: PacketStep<'_>,
        packet: &mut BouncePacket,
        rays: &mut u64,
    ) {
        *rays += u64::from(self.rays.active.count_ones());
        if scene.has_instances() {
            self.cast_among_instances(scene, from, bounce.static_hits, bounce.step, packet);
            if bounce.step < from.near_bounces() {
                self.record_legs(scene, packet, bounce.statistics);
            }
        } else {
            self.rays.cast(scene, &mut packet.met);
        }
        let mut surfaces = [None; PACKET_SIZE];
        let mut discrete = self.gather_surfaces(scene, bounce.step, packet, &mut surfaces);
        if bounce.step >= from.depth {
            (self.panels, discrete) = (0, 0);
        }
        packet.mirrored = self.panels & packet.met.rays;
        for l in 0..PACKET_SIZE {
            self.length_m[l] += packet.met.leg_m[l];
        }
        let cosines = self.rays.mirror(&packet.met, &mut packet.normal);
        packet.point = self.rays.origin;
        packet.length_m = self.length_m;
        let spread_factors = packet.spread_factors(from.origin.as_vec3());
        let is_omni = from.pose.settings.directivity.is_omni();
        self.rays.last = packet.met.surface;
        self.rays.active = 0;
        for lane in lanes(packet.met.rays) {
            let Some(surface) = surfaces[lane] else {
                continue;
            };
            let scattering = &scene.material_of(surface).scattering;
            let reflected = scene.reflectance_of(surface).energy(cosines[lane]);
            let is_last = bounce.step + 1 == FAR_BOUNCES;
            let mut energy = self.reflect(lane, &reflected, scattering, is_last);
            if discrete >> lane & 1 == 1 {
                energy.leaving = energy.scattered;
            }
            if !is_omni {
                amplify_by(&mut energy, &self.squares[lane]);
            }
            let gain = bounce.gain * self.represented[lane];
            amplify_by(&mut energy, &[gain; BANDS]);
            let [leaving, incident] =
                [&energy.leaving, &energy.incident].map(|e| weight(e, spread_factors[lane]));
            let mut selected = leaving;
            if leaving < OF_TRANSMITTED * incident {
                let through = transmitted(scene, packet.met.surface[lane], &energy.incident);
                selected = leaving.max(OF_TRANSMITTED * weight(&through, spread_factors[lane]));
            }
            bounce.weights[lane * bounce.stride] = selected;
            packet.energy[lane] = energy;
            let mut is_alive = false;
            for b in 0..BANDS {
                is_alive |= self.share[lane][b] > MIN_SHARE;
            }
            self.rays.active |= u32::from(is_alive) << lane;
        }
        self.rays.normalize_or(&packet.normal);
    }

    /// Surfaces hit and their normals; updates `panels` and `bent`. Returns the bit mask of the rays whose reflection
    /// is a discrete path: at panels only, or at a curved surface once or twice with one panel before or after it
    /// ([`crate::propagation::curved_reflection`]).
    #[inline(always)]
    fn gather_surfaces<'a>(
        &mut self,
        scene: &'a Scene,
        step: usize,
        packet: &mut BouncePacket,
        surfaces: &mut PerRay<Option<&'a Surface>>,
    ) -> u32 {
        let (mut panels, mut curved) = (0, 0);
        let mut at_curved = [0; PACKET_SIZE];
        for lane in lanes(packet.met.rays) {
            let surface = scene.surface(packet.met.surface[lane]);
            let triangle = packet.met.triangle[lane];
            surfaces[lane] = Some(surface);
            put_vector(&mut packet.normal, lane, surface.normal.as_vec3());
            panels |= u32::from(scene.is_panel(triangle)) << lane;
            let leg = vector(&self.rays.direction, lane) * packet.met.leg_m[lane];
            let point = vector(&self.rays.origin, lane) + leg;
            if let Some((index, normal)) = scene.smooth_normal(triangle, point.as_dvec3()) {
                put_vector(&mut packet.normal, lane, normal.as_vec3());
                curved |= 1 << lane;
                at_curved[lane] = index;
            }
        }
        let before = self.panels;
        self.panels &= panels;
        let mut discrete = self.panels;
        // Few rays meet curved surfaces.
        for lane in lanes(packet.met.rays & (curved | self.bent)) {
            let meets = match curved >> lane & 1 {
                0 => None,
                _ => Some(at_curved[lane]),
            };
            let first = (before >> lane & 1 == 1).then_some(step);
            let is_panel = panels >> lane & 1 == 1;
            let state = &mut self.curved[lane];
            *state = match meets {
                Some(index) => state.at_curved(scene, index, first),
                None if is_panel => state.at_panel(scene, packet.met.surface[lane]),
                None => CurvedPrefix::None,
            };
            discrete |= u32::from(state.is_discrete()) << lane;
            let is_over = *state == CurvedPrefix::None;
            self.bent = self.bent & !(1 << lane) | u32::from(!is_over) << lane;
        }
        discrete
    }

    /// Reflects a ray's energy. What is left after the last bounce is scattered.
    #[inline(always)]
    fn reflect(
        &mut self,
        lane: usize,
        reflected: &BandArray,
        scattering: &BandArray,
        is_last: bool,
    ) -> BounceEnergy {
        let share = &mut self.share[lane];
        let mut energy = BounceEnergy {
            incident: *share,
            ..BounceEnergy::default()
        };
        for b in 0..BANDS {
            energy.leaving[b] = share[b] * reflected[b];
        }
        for b in 0..BANDS {
            energy.scattered[b] = energy.leaving[b] * scattering[b];
        }
        for b in 0..BANDS {
            share[b] = energy.leaving[b] - energy.scattered[b];
        }
        if is_last {
            energy.scattered = energy.leaving;
        }
        energy
    }

    /// Casts the rays with cached hits of the fixed scene.
    #[inline(never)]
    fn cast_among_instances(
        &self,
        scene: &Scene,
        from: &SourceRays<'_>,
        static_hits: &mut StaticHitCache,
        step: usize,
        packet: &mut BouncePacket,
    ) {
        self.rays
            .cast_by(scene, &mut packet.met, |lane, ray, last| {
                let leg = match step < from.near_bounces() {
                    true => from.near_leg_index(self.index[lane], step),
                    false => from.far_leg_index(lane as u8, step),
                };
                static_hits.closest_hit(scene, ray, last, [self.index[lane] as usize, leg])
            });
    }

    /// Records the legs of all rays cast.
    #[inline(never)]
    fn record_legs(&self, scene: &Scene, packet: &BouncePacket, statistics: &mut RayStatistics) {
        for lane in lanes(self.rays.active) {
            let has_met = packet.met.rays >> lane & 1 == 1;
            let ends_at_instance = has_met && scene.is_of_instance(packet.met.surface[lane]);
            let ray = self.rays.ray(lane);
            let t_max = match has_met {
                true => packet.met.leg_m[lane],
                false => ray.t_max,
            };
            statistics.record_leg(Ray { t_max, ..ray }, ends_at_instance);
        }
    }
}
