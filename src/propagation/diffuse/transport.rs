//! Transport of scattered energy between the patches of a scene, and the responses of patches to each other.
//!
//! Own; after acoustic radiance transfer (\[SILTANEN07\]) and common slopes (\[GOTZ23\]). A patch radiates by Lambert's
//! law. Its rays are then reflected specularly; at each reflection the scattered part ends at a patch and is radiated by it
//! again, and the transmitted part is radiated by the patch behind the wall. A ray is also one in the other direction: what its two ends
//! send to each other per area is alike, and each exchange has the rays of both. Specular reflections are therefore exact, the
//! position within a patch is forgotten at scattering. The response of patch `j` to patch `i` is the energy that leaves `j`
//! over time for one unit that `i` radiates, all orders. It belongs to the scene: sources and listeners share it.

use std::ops::Range;

use glam::Vec3;

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffuse::decay_fit::{
    CommonDecays, FITTED_FROM_DB, FirstLegs, PatchDecays, fall_db, sum_of,
};
use crate::propagation::diffuse::delay_sums::{Arrival, DelaySums, LONGEST};
use crate::propagation::diffuse::energy_course::LateBins;
use crate::propagation::diffuse::envelope::NEPERS_OF_60_DB;
use crate::propagation::diffuse::fit_spans::{DIRECTION_SPANS, STEPS};
use crate::propagation::diffuse::late_states::LateStates;
use crate::propagation::diffuse::packed_energy::{PackedBands, pack};
use crate::propagation::diffuse::patch_exchange::{AirEnergy, collect, course_of_air, respond};
use crate::propagation::diffuse::slowest_decay::slowest_decay;
use crate::propagation::diffuse::specular_legs::{Departure, SpecularLegs};
use crate::propagation::diffuse::surface_samples::{NO_PATCH, SurfaceSamples, facing, probe_ray};
use crate::scene::Scene;
use crate::simd::LaneSet;

/// Rays of a sample.
const RAYS_PER_SAMPLE: usize = 16;

/// Boxes that all rays of a field intersect, by estimate: half a second at two nanoseconds each.
const MOST_BOXES: f64 = (1u64 << 28) as f64;

/// Legs of a ray in the mean, with the rays that find the patches, by estimate.
const LEGS_OF_RAY: f64 = 10.0;

/// Samples of a point: surfaces have two sides.
const SIDES: f64 = 2.0;

/// Samples of a step of [`FieldRenewal`].
const SAMPLES_A_STEP: usize = 24;

/// The same where the field in use has next to none around a listener.
const SAMPLES_AN_URGENT_STEP: usize = 128;

/// Most specular reflections of a ray; what is left is then radiated by the last patch.
const MAX_ORDER: usize = 150;

/// Share of a ray's energy below which it ends in the same way: −35 dB. What is radiated then decays faster than what flies on.
const MIN_SHARE: f32 = 3e-4;

/// Fastest decay of the field that specular legs are weighed for, in nepers of energy per time step: 87 dB in the responses. Energies of
/// [`LONGEST`] ago stay finite.
const FASTEST: f32 = 0.25;

/// Range of time steps in seconds.
const STEP_RANGE_S: (f32, f32) = (0.001, 0.05);

/// The late field of a scene.
#[derive(Debug, Clone, Default)]
pub struct SceneField {
    pub(crate) samples: SurfaceSamples,
    /// Length of a time step in seconds.
    pub(crate) step_s: f32,
    /// Speed of sound in metres per second.
    pub(crate) speed_m_s: f32,
    /// Energy that leaves patch `to` in a time step, for a unit that patch `from` radiates at time 0:
    /// `[(to × patches + from) × STEPS + step]`.
    responses: Vec<PackedBands>,
    /// Sums of a response over [`DIRECTION_SPANS`]: `[to × patches + from]`.
    spans: Vec<[BandArray; DIRECTION_SPANS.len()]>,
    /// Energy that begins in the air, evenly and in all directions, and leaves patches.
    of_air: AirEnergy,
    /// How energy is spread over the patches late in the responses.
    late_states: LateStates,
    /// Counts calls of [`Self::renew`].
    pub(crate) renewals: u64,
    /// What becomes of the energy that each patch radiates, up to its first reflection.
    first_legs: Vec<FirstLegs>,
    /// How far specular energy of each patch reaches.
    pub(crate) specular: SpecularLegs,
    /// Decays of the late reverb's groups.
    pub(crate) decays: CommonDecays,
}

impl SceneField {
    /// Finds the field of a scene with about `count` samples. Closed spaces without any of the `occupants`, listener and
    /// sources in local coordinates, are left out ([`Self::leaves_out`]). Adds the rays cast to `rays`.
    pub fn new(scene: &Scene, count: usize, occupants: &[Vec3], rays: &mut u64) -> Self {
        let mut field = Self::untraced(scene, count, occupants, rays);
        field.renew(scene, rays);
        field
    }

    /// The samples of a scene, without patches and transport between them.
    fn untraced(scene: &Scene, count: usize, occupants: &[Vec3], rays: &mut u64) -> Self {
        let count = count.min(affordable(scene.static_crossed_boxes()));
        let samples = SurfaceSamples::new(scene, count, occupants, rays);
        let speed_m_s = scene.speed_of_sound_m_s() as f32;
        let step_s = samples.short_leg_m / speed_m_s;
        Self {
            samples,
            step_s: step_s.clamp(STEP_RANGE_S.0, STEP_RANGE_S.1),
            speed_m_s,
            responses: Vec::new(),
            spans: Vec::new(),
            of_air: AirEnergy::default(),
            late_states: LateStates::default(),
            renewals: 0,
            first_legs: Vec::new(),
            specular: SpecularLegs::default(),
            decays: CommonDecays::default(),
        }
    }

    /// Forms the patches and traces the transport between them anew, after motion of instances. Patches keep their indices.
    /// Returns whether rays may leave their energy at other patches than before. Adds the rays cast to `rays`.
    pub fn renew(&mut self, scene: &Scene, rays: &mut u64) -> bool {
        let is_changed = self.samples.look_around(scene, rays);
        let mut sums = self.begin_trace();
        self.trace(scene, 0..self.samples.all.len(), &mut sums, rays);
        sums.balance();
        self.take_transports(scene, &sums, rays);
        is_changed
    }

    /// Computes responses and decays from the sums of a trace.
    fn take_transports(&mut self, scene: &Scene, sums: &DelaySums, rays: &mut u64) {
        let patches = self.patches();
        self.renewals += 1;
        if patches == 0 {
            return;
        }
        let transports = collect(sums, patches);
        self.of_air = course_of_air(sums, &transports);
        let mut response = vec![[0.0; BANDS]; patches * STEPS];
        self.responses.clear();
        self.responses.reserve_exact(patches * STEPS * patches);
        self.spans.clear();
        for to in 0..patches {
            response.fill([0.0; BANDS]);
            respond(LaneSet::best(), &transports, to as u16, &mut response);
            let responses = response.chunks_exact(STEPS);
            self.spans.extend(
                responses.map(|response| DIRECTION_SPANS.map(|steps| sum_of(&response[steps]))),
            );
            self.responses.extend(response.iter().map(pack));
        }
        let last = DIRECTION_SPANS.len() - 1;
        let late = self.spans.iter().map(|spans| spans[last]);
        self.late_states = LateStates::new(late, &self.of_air.last, &self.samples.leg_m);
        let total = &self.of_air.total;
        let slowest = match fall_db(total).iter().all(|fall| *fall >= FITTED_FROM_DB) {
            true => [0.0; BANDS],
            false => slowest_decay(sums),
        };
        self.decays = CommonDecays::of(&PatchDecays {
            step_s: self.step_s,
            speed_m_s: self.speed_m_s,
            share: &self.samples.share,
            total,
            slowest: &slowest,
            growth: &self.late_states.growth(&self.samples.share),
            kept_by_modes: &self.late_states.kept_by_modes(),
            first_legs: &self.first_legs,
        });
        self.find_reach(scene, sums, rays);
    }

    /// Whether there are closed spaces that had no occupant.
    pub fn leaves_out(&self) -> bool {
        self.samples.left_out > 0
    }

    /// How far a point in local coordinates is from those around which samples are closest, relative to how far these are close; none
    /// if they are alike in the whole scene.
    pub(crate) fn remoteness(&self, point: Vec3) -> Option<f32> {
        self.samples.focus.radii_to(point)
    }

    /// Number of patches.
    pub(crate) fn patches(&self) -> usize {
        self.samples.patches
    }

    /// Energy that leaves a patch in each time step, for each radiating patch: `[from × STEPS + step]`.
    pub(crate) fn response_of(&self, to: usize) -> &[PackedBands] {
        let size = STEPS * self.patches();
        &self.responses[to * size..][..size]
    }

    /// Energy that begins in the air and leaves a patch, in each time step.
    pub(crate) fn of_air(&self, to: usize) -> &[PackedBands] {
        &self.of_air.of_steps[to * STEPS..][..STEPS]
    }

    /// Energy that begins in the air and leaves a patch, in each late bin.
    pub(crate) fn of_air_late(&self, to: usize) -> &LateBins {
        &self.of_air.late[to]
    }

    /// How energy is spread late in the responses.
    pub(crate) fn late_states(&self) -> &LateStates {
        &self.late_states
    }

    /// Energy that leaves a patch within each of [`DIRECTION_SPANS`], for each radiating patch.
    pub(crate) fn spans_of(&self, to: usize) -> &[[BandArray; DIRECTION_SPANS.len()]] {
        &self.spans[to * self.patches()..][..self.patches()]
    }

    /// Empty sums for [`Self::trace`].
    fn begin_trace(&mut self) -> DelaySums {
        let patches = self.patches();
        self.first_legs.clear();
        self.first_legs.resize(patches, FirstLegs::default());
        let samples = self.samples.all.len();
        let first_m = self.step_s * self.speed_m_s;
        self.specular.begin(patches, samples, first_m);
        DelaySums::new(patches)
    }

    /// How far specular energy reaches, after all rays have been traced.
    fn find_reach(&mut self, scene: &Scene, sums: &DelaySums, rays: &mut u64) {
        let mut of_patches = vec![Vec::new(); self.patches()];
        for sample in self.samples.all.iter().filter(|s| s.patch != NO_PATCH) {
            of_patches[usize::from(sample.patch)].push(*sample);
        }
        self.specular.find_volumes(&of_patches, |sample, point| {
            *rays += 1;
            let leg = Ray::between(sample.point, point);
            !scene.any_hit(&leg, [sample.surface, NO_GROUP])
        });
        let step_s = self.step_s;
        let rate = |time_s: f32| (NEPERS_OF_60_DB as f32 * step_s / time_s).min(FASTEST);
        let rates = self.decays.times_s[0].map(rate);
        let leaving = |patch| sums.leaving(patch, &rates);
        self.specular.finish(&rates, &self.samples, leaving);
    }

    /// Traces the rays of a range of samples.
    fn trace(&mut self, scene: &Scene, range: Range<usize>, sums: &mut DelaySums, rays: &mut u64) {
        let step_m = self.step_s * self.speed_m_s;
        let own = self.samples.all.iter().enumerate();
        for (index, sample) in own.skip(range.start).take(range.len()) {
            if sample.patch == NO_PATCH {
                continue;
            }
            let from = usize::from(sample.patch);
            let patch_m2 = self.samples.patch_m2[from];
            let of_ray = sample.area_m2 / (patch_m2 * RAYS_PER_SAMPLE as f32);
            for number in 0..RAYS_PER_SAMPLE {
                let mut ray = probe_ray(sample, index, number, RAYS_PER_SAMPLE);
                let mut last = sample.surface;
                // What the sample would scatter of energy that arrives along the ray.
                let surface = scene.surface(sample.surface);
                let of_start = scene
                    .reflectance_of(surface)
                    .energy(ray.direction.dot(sample.normal));
                let scattering = &scene.material_of(surface).scattering;
                let of_start: BandArray = std::array::from_fn(|b| of_start[b] * scattering[b]);
                let mut share = [of_ray; BANDS];
                let floor = MIN_SHARE * share[0];
                let (mut length_m, mut in_air) = (0.0, 0.0);
                let (mut patch, mut last_sample) = (from, Some(index));
                for order in 0..MAX_ORDER {
                    *rays += 1;
                    let hit = scene.closest_hit(&ray, [last, NO_GROUP]);
                    if order > 0 {
                        // Specular energy is heard along its leg.
                        let leg_m = hit.map(|hit| hit.t);
                        let factor = self.samples.leg_factor(patch, leg_m);
                        let heard = share.map(|share| share * factor);
                        let steps = length_m / step_m;
                        let at = Departure {
                            patch,
                            sample: last_sample,
                            steps,
                        };
                        self.specular.add_leg(at, leg_m, [&share, &heard]);
                        let arrival = Arrival {
                            from,
                            to: patch,
                            steps,
                            in_air,
                        };
                        sums.add(arrival, &heard, &[0.0; BANDS]);
                    } else {
                        self.specular.add_ray(from, hit.map(|hit| hit.t));
                    }
                    let Some(hit) = hit else { break };
                    if order == 0 {
                        // Rays by Lambert's law fill the air evenly: in proportion to their lengths.
                        in_air = hit.t / of_ray;
                        if number == index % RAYS_PER_SAMPLE {
                            let ends = [ray.origin, ray.at(hit.t)];
                            self.specular.add_air(index, ends, sample.area_m2);
                        }
                    }
                    length_m += hit.t;
                    let air = exp_neg(&scene.air_np_per_m().map(|m| 2.0 * m * hit.t));
                    let normal = facing(scene, hit.group, ray.direction);
                    let point = ray.at(hit.t);
                    let cosine = -normal.dot(ray.direction);
                    let found = self.samples.locate(scene, (point, hit.group), normal, rays);
                    if found.is_none() && self.samples.is_left_at(point, normal) {
                        break;
                    }
                    last_sample = found;
                    let found = found.map(|found| &self.samples.all[found]);
                    patch = found.map_or(patch, |found| usize::from(found.patch));
                    let surface = scene.surface(hit.group);
                    let reflected = scene.reflectance_of(surface).energy(cosine);
                    let scattering = &scene.material_of(surface).scattering;
                    let mut scattered = [0.0; BANDS];
                    let mut incident = share;
                    for b in 0..BANDS {
                        incident[b] *= air[b];
                        let leaving = incident[b] * reflected[b];
                        scattered[b] = leaving * scattering[b];
                        share[b] = leaving - scattered[b];
                    }
                    if order == 0 {
                        let legs = &mut self.first_legs[from];
                        legs.length_m += of_ray * hit.t;
                        legs.arriving[patch] += of_ray;
                        for b in 0..BANDS {
                            legs.kept[b] += incident[b] * reflected[b];
                        }
                    }
                    let steps = length_m / step_m;
                    let is_last = order + 1 == MAX_ORDER
                        || steps >= LONGEST
                        || share.iter().all(|s| *s < floor);
                    let arrival = Arrival {
                        from,
                        to: patch,
                        steps,
                        in_air,
                    };
                    let at = Departure {
                        patch,
                        sample: last_sample,
                        steps,
                    };
                    self.specular.add_leaving(at, &scattered);
                    if found.is_some() {
                        let ratio = patch_m2 / self.samples.patch_m2[patch];
                        let backwards = std::array::from_fn(|b| ratio * incident[b] * of_start[b]);
                        sums.add_both_ways(arrival, &scattered, &backwards);
                    } else {
                        sums.add(arrival, &scattered, &scattered);
                    }
                    if is_last {
                        sums.add(arrival, &share, &share);
                        self.specular.add_leaving(at, &share);
                    }
                    if let Some(behind) = found.and_then(|found| found.behind) {
                        let factor = scene.transmission_factor(hit.group);
                        let through = std::array::from_fn(|b| incident[b] * factor[b] * factor[b]);
                        let to = usize::from(behind);
                        sums.add(Arrival { to, ..arrival }, &through, &through);
                    }
                    if is_last {
                        break;
                    }
                    last = hit.group;
                    let onward = ray.direction + 2.0 * cosine * normal;
                    ray = Ray::new(point, onward.normalize_or(normal));
                }
            }
        }
    }
}

/// A field that is made in steps, while an earlier one is in use: parts of the scene have come or gone.
#[derive(Debug, Default)]
pub struct FieldRenewal {
    field: SceneField,
    sums: DelaySums,
    /// Samples that have been traced, and those of a step.
    traced: usize,
    a_step: usize,
}

impl FieldRenewal {
    /// Finds the patches of a scene with about `count` samples, as [`SceneField::new`]; `is_urgent`: in few steps. Adds the rays cast to
    /// `rays`.
    pub fn new(
        scene: &Scene,
        count: usize,
        occupants: &[Vec3],
        after: &SceneField,
        is_urgent: bool,
        rays: &mut u64,
    ) -> Self {
        let mut field = SceneField::untraced(scene, count, occupants, rays);
        field.samples.look_around(scene, rays);
        field.renewals = after.renewals;
        Self {
            sums: field.begin_trace(),
            field,
            traced: 0,
            a_step: match is_urgent {
                true => SAMPLES_AN_URGENT_STEP,
                false => SAMPLES_A_STEP,
            },
        }
    }

    /// See [`SceneField::remoteness`].
    pub(crate) fn remoteness(&self, point: Vec3) -> Option<f32> {
        self.field.remoteness(point)
    }

    /// Whether the samples are those of `field`, and see the same patches: in the same scene, all that is traced from them would be its own.
    /// It then takes over where samples are closest.
    pub(crate) fn has_samples_of(&self, field: &mut SceneField) -> bool {
        let (samples, own) = (&self.field.samples, &mut field.samples);
        let are_same = samples.all == own.all;
        if are_same {
            own.focus.clone_from(&samples.focus);
        }
        are_same
    }

    /// Traces some more samples; returns the field after all of them. Adds the rays cast to `rays`.
    pub fn step(&mut self, scene: &Scene, rays: &mut u64) -> Option<SceneField> {
        let all = self.field.samples.all.len();
        let range = self.traced..all.min(self.traced + self.a_step);
        self.traced = range.end;
        let is_traced = range.is_empty();
        self.field.trace(scene, range, &mut self.sums, rays);
        is_traced.then(|| {
            self.sums.balance();
            self.field.take_transports(scene, &self.sums, rays);
            std::mem::take(&mut self.field)
        })
    }
}

/// Most samples of a scene in which a ray intersects so many boxes: fewer only where thousands of triangles overlap.
fn affordable(crossed_boxes: f64) -> usize {
    let boxes_a_sample = SIDES * RAYS_PER_SAMPLE as f64 * LEGS_OF_RAY * crossed_boxes.max(1.0);
    ((MOST_BOXES / boxes_a_sample) as usize).max(1)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::propagation::rays::directions::{mix, unit};
    use crate::scene::{
        InstanceId, InstancePose, MaterialTable, SceneSettings, TriangleMesh, procedural,
    };

    #[test]
    fn rays_among_slivers_are_fewer_and_those_of_rooms_are_not() {
        assert!(affordable(200.0) >= 512);
        assert!(affordable(35_000.0) < 32);
        assert_eq!(affordable(1e9), 1);
    }

    /// A hollow block in a room: only an occupant of the block asks for other samples than those of the room.
    #[test]
    fn a_field_for_occupants_behind_all_walls_has_the_same_samples() {
        let mut mesh = procedural::shoebox(Vec3::new(12.0, 6.0, 9.0), "concrete");
        let block = procedural::shoebox(Vec3::splat(2.0), "concrete");
        let inside = DAffine3::from_translation(DVec3::splat(2.0));
        mesh.append(&block, &inside).unwrap();
        let table = MaterialTable::built_in();
        let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).unwrap();
        let local = |at: Vec3| scene.to_local(at).as_vec3();
        let listener = local(Vec3::new(8.0, 2.0, 5.0));
        let mut field = SceneField::new(&scene, 256, &[listener], &mut 0);
        assert!(field.leaves_out());
        let mut is_known = |source: Vec3| {
            let occupants = [listener, local(source)];
            FieldRenewal::new(&scene, 256, &occupants, &field, false, &mut 0)
                .has_samples_of(&mut field)
        };
        assert!(is_known(Vec3::new(14.0, 2.0, 5.0)));
        assert!(!is_known(Vec3::splat(3.0)));
    }

    /// Triangles that pass through each other, as the scene and as a part that is joined with a scene.
    #[test]
    fn a_heap_of_triangles_has_as_few_samples_in_a_joined_part() {
        let table = MaterialTable::built_in();
        let commit = |mesh: &TriangleMesh| {
            Arc::new(Scene::commit(mesh, &table, &SceneSettings::default()).unwrap())
        };
        let mut heap = TriangleMesh::default();
        let material = heap.material("concrete");
        let random = |n: u64| 20.0 * unit(mix(n));
        for n in 0..20_000u32 {
            let corner = |k: u32| [0u32, 1, 2].map(|axis| random(u64::from(9 * n + 3 * k + axis)));
            heap.vertices
                .extend([0, 1, 2].map(|k| Vec3::from(corner(k))));
            heap.triangles.push([3 * n, 3 * n + 1, 3 * n + 2]);
            heap.triangle_materials.push(material);
        }
        let heap = commit(&heap);
        let room = commit(&procedural::shoebox(
            Vec3::new(40.0, 30.0, 40.0),
            "concrete",
        ));
        let samples = |scene: &Scene| {
            SceneField::untraced(scene, 512, &[Vec3::splat(5.0)], &mut 0)
                .samples
                .all
                .len()
        };
        let mut joined = Scene::clone(&room);
        let pose = InstancePose::at(InstanceId::default(), DVec3::splat(5.0));
        joined
            .add_joined_instance(Arc::clone(&heap), &pose)
            .unwrap();
        let most = 2 * affordable(heap.bvh().crossed_boxes());
        assert!(most < samples(&room), "{most} samples of the heap");
        assert!(samples(&joined) <= most, "{} of {most}", samples(&joined));
    }
}
