//! The surfaces of a path over a curved one, from which later positions give the path anew.
//!
//! Any thread; a few steps of Newton's method and one ray, which finds the surface's end.

use glam::DVec3;

use super::{Bounces, Query, Search};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::{Interaction, interaction_path_id};
use crate::propagation::path::{Path, PathId};
use crate::scene::Scene;
use crate::scene::surface::curved::CurvedSurface;

/// Largest distance in metres of a reflection point from its curved surface: rounding to single precision.
const ON_SHAPE_M: f64 = 5e-3;

/// A curved surface, with the planes before, between and after its reflections.
#[derive(Debug, Clone, Copy)]
pub struct CurvedSequence {
    index: u32,
    planes: [Option<u32>; 2],
    bounces: Bounces,
    /// Number of the path among those of the same surfaces.
    number: u64,
    /// Which of the path's points is the first on the curved surface.
    step: usize,
}

impl CurvedSequence {
    /// The sequence of a path; none if the path has no curved surface.
    pub fn of(scene: &Scene, path: &Path) -> Option<Self> {
        if scene.curved_surfaces().is_empty() || path.diffraction_order > 0 {
            return None;
        }
        let surfaces = path.surfaces();
        // Facets are no panels.
        let is_facet = |&step: &usize| scene.surface(surfaces[step]).panel_triangle_count == 0;
        let step = (0..surfaces.len()).find(is_facet)?;
        let last = (0..surfaces.len()).rfind(is_facet)?;
        let bounces = match last - step {
            0 => Bounces::Once,
            1 => Bounces::Twice(None),
            2 => Bounces::Twice(Some(surfaces[step + 1])),
            _ => return None,
        };
        let planes = [step.checked_sub(1), Some(last + 1)]
            .map(|near| near.and_then(|near| surfaces.get(near).copied()));
        let is_on = |index: &u32| {
            let curved = scene.curved_surfaces().get(*index as usize);
            let off_m = |step: usize, curved: &CurvedSurface| {
                let point = scene.to_local(path.points[step]);
                curved.shape.distance_m(point).abs()
            };
            curved.is_some_and(|curved| off_m(step, curved).max(off_m(last, curved)) < ON_SHAPE_M)
        };
        let mut near = (0..scene.curved_surfaces().len() as u32).filter(is_on);
        near.find_map(|index| {
            let along = interactions(index, planes, bounces);
            let id = interaction_path_id(scene, path.source, along);
            let number = path.id.0.wrapping_sub(id.0) >> 61;
            let is_same = id.0.wrapping_add(number << 61) == path.id.0;
            is_same.then_some(Self {
                index,
                planes,
                bounces,
                number,
                step,
            })
        })
    }

    /// The path at other positions, near the points of the `last` one. Occlusion is not tested.
    pub fn between(&self, scene: &Scene, endpoints: &Endpoints, last: &Path) -> Option<Path> {
        let query = Query {
            scene,
            endpoints,
            ends: [endpoints.from, endpoints.to].map(|end| scene.to_local(end)),
            index: self.index,
            surface: scene.curved_surfaces().get(self.index as usize)?,
            planes: self.planes,
            bounces: self.bounces,
        };
        let images = query.images();
        let unfolded = [images[0], query.unfolded(images[1])];
        let mut points: Option<[DVec3; 2]> = None;
        let near = scene.to_local(last.points[self.step]);
        query.stationary_points(unfolded, Search::Near(near), |found| points = Some(found));
        let reflections = query.reflections(points?, images, &mut 0)?;
        let path = query.path(&reflections, self.number)?;
        Some(Path {
            id: PathId(last.id.0),
            ..path
        })
    }
}

/// The interactions of a path over a curved surface, from source to listener.
pub(super) fn interactions(
    index: u32,
    planes: [Option<u32>; 2],
    bounces: Bounces,
) -> impl Iterator<Item = Interaction> {
    let plane = |plane: Option<u32>| plane.map(Interaction::Surface).into_iter();
    let curved = Interaction::Curved(index);
    let (between, second) = match bounces {
        Bounces::Once => (None, None),
        Bounces::Twice(between) => (between, Some(curved)),
    };
    plane(planes[0])
        .chain([curved])
        .chain(plane(between))
        .chain(second)
        .chain(plane(planes[1]))
}
