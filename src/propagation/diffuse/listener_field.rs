//! What a listener hears of a scene's patches: levels, decays and directions.
//!
//! Own. Surface samples are connected to the listener by Lambert's law, like bounces in
//! [`crate::propagation::diffuse::next_event`], and seen from the same viewpoints. With the responses of
//! [`crate::propagation::diffuse::transport`] that gives the energy over time that arrives for a unit radiated by each
//! patch, and its directions. Decay times of the groups belong to the scene ([`crate::propagation::diffuse::decay_fit`]).

use glam::Vec3;

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffuse::delayed::add_delayed;
use crate::propagation::diffuse::energy_course::{EnergyCourse, LateBins, add_bins};
use crate::propagation::diffuse::fit_spans::{DIRECTION_SPANS, STEPS};
use crate::propagation::diffuse::late_directions::{MOMENTS, Moments, moments};
use crate::propagation::diffuse::lifted_kernel::lifted_kernel;
use crate::propagation::diffuse::long_responses::{LongResponse, bins_of, continue_responses};
use crate::propagation::diffuse::packed_energy::PackedBands;
use crate::propagation::diffuse::surface_samples::{MAX_PATCHES, NO_PATCH};
use crate::propagation::diffuse::transport::SceneField;
use crate::propagation::diffuse::visibility_cells::{GROUPS, VisibilityCells};
use crate::propagation::late_group::{LATE_GROUPS, LateGroup};
use crate::scene::Scene;
use crate::simd::{LaneSet, kernel};

/// What arrives from one patch.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PatchView {
    /// Energy for a unit that leaves the patch, air included.
    pub(crate) energy: BandArray,
    /// Mean delay in seconds.
    pub(crate) delay_s: f32,
    /// Moments of the directions, of a unit of energy.
    pub(crate) directions: [f32; MOMENTS],
}

/// The field at one listener position.
#[derive(Debug, Clone, Default)]
pub struct ListenerField {
    /// Position and scene revision of the results.
    pub(crate) of: Option<(Vec3, u64)>,
    is_visible: Vec<bool>,
    viewpoints: Vec<Option<Vec3>>,
    scene_state: u64,
    pub(crate) patches: Vec<PatchView>,
    /// Energy that arrives in each time step for a unit that a patch radiates: `[patch × STEPS + step]`.
    pub(crate) response: Vec<BandArray>,
    /// Moments of the energy that arrives in each of [`DIRECTION_SPANS`] for a unit that a patch radiates.
    pub(crate) arriving: Vec<[Moments; DIRECTION_SPANS.len()]>,
    /// What arrives of energy that begins in the air, evenly and in all directions.
    pub(crate) of_air: EnergyCourse,
    /// Energy that arrives in bins of time for a unit that a patch radiates, for longer than the responses.
    pub(crate) long: Vec<LongResponse>,
    /// Decay times of the groups.
    pub groups: [LateGroup; LATE_GROUPS],
}

impl ListenerField {
    /// Makes the results invalid, as another field has other samples.
    pub(crate) fn invalidate(&mut self) {
        self.of = None;
        self.is_visible.clear();
    }

    /// Whether the listener sees nothing of the field.
    pub(crate) fn is_outside(&self) -> bool {
        self.of.is_some() && !self.is_visible.contains(&true)
    }

    /// Finds the field at a position in local coordinates, independently of earlier calls. Returns the number of rays cast.
    pub fn renew(
        &mut self,
        scene: &Scene,
        field: &SceneField,
        listener: Vec3,
        cells: &VisibilityCells,
        scene_state: u64,
    ) -> u64 {
        if self.of == Some((listener, scene_state)) {
            return 0;
        }
        self.of = Some((listener, scene_state));
        let rays = self.test_visibility(scene, field, cells, scene_state);
        self.connect(scene, field, listener);
        self.response.clear();
        self.response.resize(STEPS * field.patches(), [0.0; BANDS]);
        let mut of_air = [[0.0; BANDS]; STEPS];
        let mut late = LateBins::default();
        for (to, view) in self.patches.iter().enumerate() {
            if view.energy.iter().any(|energy| *energy > 0.0) {
                let delay = view.delay_s / field.step_s;
                let leaving = field.response_of(to);
                arrive(LaneSet::best(), leaving, view, delay, &mut self.response);
                arrive(LaneSet::best(), field.of_air(to), view, delay, &mut of_air);
                add_bins(&mut late, field.of_air_late(to), &view.energy, delay);
            }
        }
        self.of_air.set(&of_air, &late);
        let mut bins_of_air = bins_of(&of_air);
        let first = bins_of_air.len() + 1 - late.len();
        bins_of_air[first..].copy_from_slice(&late[1..]);
        let states = field.late_states();
        continue_responses(states, &self.response, &bins_of_air, &mut self.long);
        for (group, time_s) in self.groups.iter_mut().zip(&field.decays.times_s) {
            group.decay_time_s = *time_s;
        }
        self.find_directions(field);
        rays
    }

    fn test_visibility(
        &mut self,
        scene: &Scene,
        field: &SceneField,
        cells: &VisibilityCells,
        scene_state: u64,
    ) -> u64 {
        let samples = &field.samples.all;
        if self.scene_state != scene_state || self.is_visible.len() != samples.len() {
            self.scene_state = scene_state;
            self.is_visible.clear();
            self.is_visible.resize(samples.len(), false);
            self.viewpoints.clear();
            self.viewpoints.resize(GROUPS, None);
        }
        let mut rays = 0;
        for group in 0..GROUPS {
            let to = cells.viewpoint(group);
            if self.viewpoints[group].replace(to) == Some(to) {
                continue;
            }
            for index in (group..samples.len()).step_by(GROUPS) {
                let sample = &samples[index];
                if sample.normal.dot(to - sample.point) <= 0.0 {
                    self.is_visible[index] = false;
                    continue;
                }
                rays += 1;
                let leg = Ray::between(sample.point, to);
                self.is_visible[index] = !scene.any_hit(&leg, [sample.surface, NO_GROUP]);
            }
        }
        rays
    }

    /// Connects the visible samples to the listener.
    fn connect(&mut self, scene: &Scene, field: &SceneField, listener: Vec3) {
        let patches = field.patches();
        self.patches.clear();
        self.patches.resize(patches, PatchView::default());
        let mut weights = [0.0f32; MAX_PATCHES];
        let samples = field.samples.all.iter().zip(&self.is_visible);
        for (index, (sample, is_visible)) in samples.enumerate() {
            let offset = listener - sample.point;
            let square = offset.length_squared();
            let length_m = square.sqrt();
            let height_m = sample.normal.dot(offset);
            if !is_visible || height_m <= 0.0 || sample.patch == NO_PATCH {
                continue;
            }
            let patch = usize::from(sample.patch);
            // A sample is a disc of its area.
            let lifted_m2 = 0.5 * sample.area_m2 / std::f32::consts::PI;
            let by_law = field.specular.share(index) * lifted_kernel(square, height_m, lifted_m2);
            let leg_m = field.samples.leg_m[patch];
            let factor = field.specular.factor(patch, length_m, leg_m);
            let air = exp_neg(&scene.air_np_per_m().map(|m| 2.0 * m * length_m));
            let view = &mut self.patches[patch];
            for b in 0..BANDS {
                view.energy[b] += by_law * factor[b] * air[b];
            }
            let kernel = by_law * factor.iter().sum::<f32>() / BANDS as f32;
            view.delay_s += kernel * length_m;
            weights[patch] += kernel;
            let towards = -offset / length_m.max(1e-6);
            for (sum, moment) in view.directions.iter_mut().zip(moments(towards)) {
                *sum += kernel * moment;
            }
        }
        let speed_m_s = scene.speed_of_sound_m_s() as f32;
        for (view, weight) in self.patches.iter_mut().zip(weights) {
            if weight > 0.0 {
                view.delay_s /= weight * speed_m_s;
                view.directions = view.directions.map(|sum| sum / weight);
            }
        }
    }

    /// Directions of what arrives of each patch.
    fn find_directions(&mut self, field: &SceneField) {
        self.arriving.clear();
        self.arriving.resize(field.patches(), Default::default());
        for (to, view) in self.patches.iter().enumerate() {
            if view.energy.iter().any(|energy| *energy > 0.0) {
                add_moments(
                    LaneSet::best(),
                    field.spans_of(to),
                    view,
                    &mut self.arriving,
                );
            }
        }
    }
}

kernel! {
    /// Adds what arrives of one patch, `delay` time steps after it leaves. No fused products: all machines give the same bits.
    fn arrive<L>(leaving: &[PackedBands], view: &PatchView, delay: f32, response: &mut [BandArray]) {
        let whole = (delay as usize).min(STEPS);
        let rest = delay - whole as f32;
        for (sums, leaving) in response.chunks_exact_mut(STEPS).zip(leaving.chunks_exact(STEPS)) {
            add_delayed::<L>(leaving, 0, &view.energy, rest, &mut sums[whole..]);
        }
    }
}

kernel! {
    /// Adds the moments of what arrives of one patch, of energy that leaves it in each span for each radiating patch. No fused
    /// products: all machines give the same bits.
    fn add_moments<L>(
        leaving: &[[BandArray; DIRECTION_SPANS.len()]],
        view: &PatchView,
        sums: &mut [[Moments; DIRECTION_SPANS.len()]],
    ) {
        let energy = L::load(&view.energy);
        let mut directions = [energy; MOMENTS];
        for m in 0..MOMENTS {
            directions[m] = L::splat(view.directions[m]);
        }
        for (leaving, sums) in leaving.as_flattened().iter().zip(sums.as_flattened_mut()) {
            let arriving = L::load(leaving).mul(energy);
            for m in 0..MOMENTS {
                L::load(&sums[m]).add(arriving.mul(directions[m])).store(&mut sums[m]);
            }
        }
    }
}
