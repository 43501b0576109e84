//! How much of what a moving source sees is seen from the origins of its rotations.
//!
//! Own. A rotation's origin may be on the other side of a door that the source has passed: the straight line to it is free, but
//! its rays fill the other room. Some of the late field's samples lie in all rooms; of those that the source or the origin
//! sees, the share that both see is the rotation's share in the estimate. In a convex room it is 1. Where it is not for all
//! origins around, the source is near an opening: its rays start in smaller cells. What a source sees is found at
//! the centre of a small cell around it, so shares are a function of position.

use glam::{DVec3, Vec3};

use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffuse::surface_samples::NO_PATCH;
use crate::propagation::diffuse::transport::SceneField;
use crate::propagation::diffuse::visibility_cells::{SOURCE_CELLS_M, find_viewpoint, group_of};
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;

/// Most samples that are tested.
const PROBES: usize = 32;

/// Edge lengths in metres of the cells of what a source sees, as in [`crate::propagation::diffuse::visibility_cells`].
const CELLS_M: [f32; 2] = [0.25, 0.062_5];

/// Share from which on two points see the same.
const ALIKE: f32 = 0.7;

/// Origins of a rotation of which it is kept what they see.
const KEPT: usize = 2;

/// Samples seen from the source and from the latest origins, one a bit.
#[derive(Debug, Clone, Default)]
pub(crate) struct SharedView {
    /// See [`SceneField::renewals`].
    renewals: u64,
    viewpoint: Option<Vec3>,
    seen: u32,
    origins: [[Option<(Vec3, u32)>; KEPT]; ROTATIONS as usize],
    is_near_opening: bool,
}

impl SharedView {
    /// Moves the source; local coordinates. Adds the rays cast to `rays`.
    pub(crate) fn renew(
        &mut self,
        scene: &Scene,
        field: &SceneField,
        source: Vec3,
        rays: &mut u64,
    ) {
        if self.renewals != field.renewals {
            *self = Self::default();
            self.renewals = field.renewals;
        }
        let viewpoint = find_viewpoint(scene, source, 0, &CELLS_M, rays);
        if self.viewpoint.replace(viewpoint) == Some(viewpoint) {
            return;
        }
        self.seen = seen_from(scene, field, viewpoint, rays);
        self.is_near_opening = false;
        for rotation in 0..ROTATIONS {
            let origin =
                find_viewpoint(scene, viewpoint, group_of(rotation), &SOURCE_CELLS_M, rays);
            let share = self.of(scene, field, rotation as usize, origin, rays);
            self.is_near_opening |= share < ALIKE;
        }
    }

    /// Whether a few steps of the source change what it sees.
    pub(crate) fn is_near_opening(&self) -> bool {
        self.is_near_opening
    }

    /// Share of what the source or a rotation's origin sees that both see. Adds the rays cast to `rays`.
    pub(crate) fn of(
        &mut self,
        scene: &Scene,
        field: &SceneField,
        rotation: usize,
        origin: Vec3,
        rays: &mut u64,
    ) -> f32 {
        let kept = &mut self.origins[rotation];
        let known = kept.iter().flatten().find(|(of, _)| *of == origin);
        let seen = match known {
            Some((_, seen)) => *seen,
            None => {
                let seen = seen_from(scene, field, origin, rays);
                kept.rotate_right(1);
                kept[0] = Some((origin, seen));
                seen
            }
        };
        match (seen | self.seen).count_ones() {
            0 => 1.0,
            either => (seen & self.seen).count_ones() as f32 / either as f32,
        }
    }

    /// A point near a source, constant within a cell, one per rotation; local coordinates. Adds the rays cast to `rays`.
    pub(crate) fn origin(
        &self,
        scene: &Scene,
        source: DVec3,
        rotation: u64,
        rays: &mut u64,
    ) -> DVec3 {
        let cells_m = match self.is_near_opening {
            true => &SOURCE_CELLS_M[1..],
            false => &SOURCE_CELLS_M,
        };
        find_viewpoint(scene, source.as_vec3(), group_of(rotation), cells_m, rays).as_dvec3()
    }
}

/// The samples that a point sees, one a bit.
fn seen_from(scene: &Scene, field: &SceneField, point: Vec3, rays: &mut u64) -> u32 {
    let samples = &field.samples.all;
    let stride = samples.len().div_ceil(PROBES).max(1);
    let mut seen = 0;
    for (bit, sample) in samples.iter().step_by(stride).enumerate() {
        if sample.patch == NO_PATCH || sample.normal.dot(point - sample.point) <= 0.0 {
            continue;
        }
        *rays += 1;
        let leg = Ray::between(sample.point, point);
        seen |= u32::from(!scene.any_hit(&leg, [sample.surface, NO_GROUP])) << bit;
    }
    seen
}
