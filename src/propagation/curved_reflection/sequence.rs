//! The surfaces of a path over a curved one, from which later positions give the path anew.
//!
//! Any thread; a few steps of Newton's method and one ray, which finds the surface's end.

use glam::DVec3;

use super::Query;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::{Interaction, interaction_path_id};
use crate::propagation::path::{Path, PathId};
use crate::scene::Scene;

/// Largest distance in metres of a reflection point from its curved surface: rounding to single precision.
const ON_SHAPE_M: f64 = 5e-3;

/// A curved surface, with the planes before and after it.
#[derive(Debug, Clone, Copy)]
pub struct CurvedSequence {
    index: u32,
    planes: [Option<u32>; 2],
    /// Number of the path among those of the same surfaces.
    number: u64,
    /// Which of the path's points is on the curved surface.
    step: usize,
}

impl CurvedSequence {
    /// The sequence of a path; none if the path has no curved surface.
    pub fn of(scene: &Scene, path: &Path) -> Option<Self> {
        if scene.curved_surfaces().is_empty() || path.diffraction_order > 0 {
            return None;
        }
        (0..path.surfaces().len()).find_map(|step| {
            // Facets are no panels.
            if scene.surface(path.surfaces[step]).panel_triangle_count > 0 {
                return None;
            }
            let point = scene.to_local(path.points[step]);
            let planes = [step.checked_sub(1), Some(step + 1)]
                .map(|near| near.and_then(|near| path.surfaces().get(near).copied()));
            let mut near = (0..)
                .zip(scene.curved_surfaces())
                .filter(|(_, curved)| curved.shape.distance_m(point).abs() < ON_SHAPE_M);
            near.find_map(|(index, _)| {
                let plane = |end: usize| planes[end].map(Interaction::Surface).into_iter();
                let all = plane(0).chain([Interaction::Curved(index)]).chain(plane(1));
                let id = interaction_path_id(scene, path.source, all);
                let number = path.id.0.wrapping_sub(id.0) >> 61;
                let is_same = id.0.wrapping_add(number << 61) == path.id.0;
                is_same.then_some(Self {
                    index,
                    planes,
                    number,
                    step,
                })
            })
        })
    }

    /// The path at other positions, near the point of the `last` one. Occlusion is not tested.
    pub fn between(&self, scene: &Scene, endpoints: &Endpoints, last: &Path) -> Option<Path> {
        let query = Query {
            scene,
            endpoints,
            ends: [endpoints.from, endpoints.to].map(|end| scene.to_local(end)),
            index: self.index,
            surface: scene.curved_surfaces().get(self.index as usize)?,
            planes: self.planes,
        };
        let images = query.images();
        let mut point: Option<DVec3> = None;
        let near = scene.to_local(last.points[self.step]);
        query.stationary_points(images, Some(near), |found| point = Some(found));
        let path = query.path(point?, images, self.number, &mut 0)?.path;
        Some(Path {
            id: PathId(last.id.0),
            ..path
        })
    }
}
