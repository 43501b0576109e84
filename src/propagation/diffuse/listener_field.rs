//! What a listener hears of a scene's patches: levels, decays and directions.
//!
//! Own. Surface samples are connected to the listener by Lambert's law, like bounces in
//! [`crate::propagation::diffuse::next_event`], and seen from the same viewpoints. With the responses of
//! [`crate::propagation::diffuse::transport`] that gives the energy over time that arrives for a unit radiated by each
//! patch. Decay times of the groups belong to the scene ([`crate::propagation::diffuse::decay_fit`]), their directions to
//! the listener's position; neither depends on any source.

use glam::Vec3;

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffuse::delayed::add_delayed;
use crate::propagation::diffuse::envelope::STEPS;
use crate::propagation::diffuse::packed_energy::PackedBands;
use crate::propagation::diffuse::surface_samples::{MAX_PATCHES, NO_PATCH};
use crate::propagation::diffuse::transport::SceneField;
use crate::propagation::diffuse::visibility_cells::{GROUPS, VisibilityCells};
use crate::propagation::late_group::{
    LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LATE_GROUPS, LateGroup,
};
use crate::scene::Scene;
use crate::simd::{LaneSet, kernel};

/// Cosine to a direction of [`LATE_DIRECTION_VECTORS`] from which on it takes a share of an arrival.
const DIRECTION_COSINE: f32 = 0.5;

/// What arrives from one patch.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PatchView {
    /// Energy for a unit that leaves the patch, air included.
    pub(crate) energy: BandArray,
    /// Mean delay in seconds.
    pub(crate) delay_s: f32,
    /// Shares of the energy by direction.
    directions: [f32; LATE_DIRECTIONS],
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
    /// Decay times and directions of the groups.
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
        for (to, view) in self.patches.iter().enumerate() {
            if view.energy.iter().any(|energy| *energy > 0.0) {
                let delay = view.delay_s / field.step_s;
                let leaving = field.response_of(to);
                arrive(LaneSet::best(), leaving, view, delay, &mut self.response);
            }
        }
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
        for (sample, is_visible) in field.samples.all.iter().zip(&self.is_visible) {
            let offset = listener - sample.point;
            let square = offset.length_squared();
            let length_m = square.sqrt();
            let cosine = sample.normal.dot(offset) / length_m.max(1e-6);
            if !is_visible || cosine <= 0.0 || sample.patch == NO_PATCH {
                continue;
            }
            let patch = usize::from(sample.patch);
            // A sample is a disc of its area.
            let spread_m2 = sample.area_m2 / std::f32::consts::PI;
            let share = sample.area_m2 / field.samples.patch_m2[patch];
            let by_law = share * cosine / (std::f32::consts::PI * (square + spread_m2));
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
            add_direction(&mut view.directions, towards, kernel);
        }
        let speed_m_s = scene.speed_of_sound_m_s() as f32;
        for (view, weight) in self.patches.iter_mut().zip(weights) {
            if weight > 0.0 {
                view.delay_s /= weight * speed_m_s;
                view.directions = view.directions.map(|share| share / weight);
            }
        }
    }

    /// Shares by direction, of energy that all patches radiate, and for the fastest group of energy that those radiate that
    /// the listener sees.
    fn find_directions(&mut self, field: &SceneField) {
        for (number, group) in self.groups.iter_mut().enumerate() {
            let mut sums = [[0.0; BANDS]; LATE_DIRECTIONS];
            for (to, view) in self.patches.iter().enumerate() {
                if view.energy.iter().all(|energy| *energy == 0.0) {
                    continue;
                }
                let leaving = match field.late_of(to).get(number) {
                    Some(leaving) => *leaving,
                    None => {
                        let mut leaving = [0.0; BANDS];
                        let seen = field.samples.share.iter().zip(&self.patches);
                        for ((share, view), energy) in seen.zip(field.early_of(to)) {
                            for b in 0..BANDS {
                                leaving[b] += share * view.energy[b] * energy[b];
                            }
                        }
                        leaving
                    }
                };
                for (sum, share) in sums.iter_mut().zip(view.directions) {
                    for b in 0..BANDS {
                        sum[b] += share * leaving[b] * view.energy[b];
                    }
                }
            }
            for b in 0..BANDS {
                let total: f32 = sums.iter().map(|sum| sum[b]).sum();
                for (share, sum) in group.directions.iter_mut().zip(&sums) {
                    share[b] = match total > 0.0 {
                        true => sum[b] / total,
                        false => 1.0 / LATE_DIRECTIONS as f32,
                    };
                }
            }
        }
    }
}

/// Divides an energy between the directions around its own.
fn add_direction(shares: &mut [f32; LATE_DIRECTIONS], towards: Vec3, energy: f32) {
    let weight = |direction: &Vec3| {
        (towards.dot(*direction) - DIRECTION_COSINE)
            .max(0.0)
            .powi(2)
    };
    let total: f32 = LATE_DIRECTION_VECTORS.iter().map(weight).sum();
    if total > 0.0 {
        for (share, direction) in shares.iter_mut().zip(&LATE_DIRECTION_VECTORS) {
            *share += energy * weight(direction) / total;
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
