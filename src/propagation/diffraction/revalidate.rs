//! A diffracted path between moved end points: the same reflections and edges.
//!
//! Extrapolation recomputes diffracted paths between updates. Geometry, wave and visibility rays are those of the update, so
//! a path at rest has the same bits.

use crate::propagation::diffraction::second_order;
use crate::propagation::diffraction::two_edge_path::TwoEdgePath;
use crate::propagation::diffraction::with_reflections::ReflectedEdgePath;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::{Interaction, interaction_path_id};
use crate::propagation::path::Path;
use crate::scene::Scene;

/// Most rays that [`DiffractionPath::is_unoccluded`] casts.
pub const MAX_RAYS: u64 = 4;

/// The interactions of a diffracted path, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiffractionSequence {
    /// One edge, with a reflection before it, after it, or both.
    Reflected {
        /// Index of the edge.
        edge: u32,
        /// Indices of the surfaces before and after the edge.
        surfaces: [Option<u32>; 2],
    },
    /// Indices of two edges.
    TwoEdges([u32; 2]),
}

impl DiffractionSequence {
    /// The sequence of a path; `None` without an edge, and for one edge alone, which belongs to the direct field.
    pub fn of(scene: &Scene, path: &Path) -> Option<Self> {
        match (path.edges(), path.surfaces()) {
            (&[first, second], []) => Some(Self::TwoEdges([first, second])),
            (&[edge], &[before, after]) => Some(Self::Reflected {
                edge,
                surfaces: [Some(before), Some(after)],
            }),
            (&[edge], &[surface]) => {
                // Only the path's identity has the order of surface and edge.
                let interactions =
                    [Interaction::Surface(surface), Interaction::Edge(edge)].into_iter();
                let is_before = interaction_path_id(scene, path.source, interactions) == path.id;
                let surfaces = match is_before {
                    true => [Some(surface), None],
                    false => [None, Some(surface)],
                };
                Some(Self::Reflected { edge, surfaces })
            }
            _ => None,
        }
    }

    /// The surface of the single reflection that it continues, if it has one edge and one surface.
    pub fn continued_reflection(&self) -> Option<u32> {
        match *self {
            Self::Reflected {
                surfaces: [Some(surface), None] | [None, Some(surface)],
                ..
            } => Some(surface),
            Self::Reflected { .. } | Self::TwoEdges(_) => None,
        }
    }

    /// Whether it has two edges.
    pub fn has_two_edges(&self) -> bool {
        matches!(self, Self::TwoEdges(_))
    }

    /// The geometry of this sequence between two end points, if it exists. Occlusion is not tested.
    pub fn between(&self, scene: &Scene, endpoints: &Endpoints) -> Option<DiffractionPath> {
        match *self {
            Self::Reflected { edge, surfaces } => {
                ReflectedEdgePath::over(scene, edge, surfaces, endpoints)
                    .map(DiffractionPath::Reflected)
            }
            Self::TwoEdges(edges) => {
                TwoEdgePath::over(scene, edges, endpoints).map(DiffractionPath::TwoEdges)
            }
        }
    }
}

/// The geometry of a [`DiffractionSequence`].
#[derive(Debug, Clone, Copy)]
pub enum DiffractionPath {
    /// One edge and reflections.
    Reflected(ReflectedEdgePath),
    /// Two edges.
    TwoEdges(TwoEdgePath),
}

impl DiffractionPath {
    /// The path, if audible ([`crate::propagation::diffraction::MIN_RELATIVE_AMPLITUDE`]). `is_lit` is whether the direct
    /// path is visible. Occlusion is not tested.
    pub fn path(&self, scene: &Scene, endpoints: &Endpoints, is_lit: bool) -> Option<Path> {
        self.ranked_path(scene, endpoints, is_lit, 0.0)
    }

    /// The same, where a path over two edges has its weight in an update's list: `two_edge_floor` is
    /// [`super::NearEdges::two_edge_floor`].
    pub fn ranked_path(
        &self,
        scene: &Scene,
        endpoints: &Endpoints,
        is_lit: bool,
        two_edge_floor: f64,
    ) -> Option<Path> {
        match self {
            Self::Reflected(path) => path.path(scene, endpoints, is_lit),
            Self::TwoEdges(path) => path
                .path(scene, endpoints)
                .map(|path| second_order::ranked(path, two_edge_floor)),
        }
    }

    /// Sides of the boundaries of its waves (`WedgeAngles::sides`).
    pub fn sides(&self, scene: &Scene) -> u32 {
        match self {
            Self::Reflected(path) => path.sides(scene),
            Self::TwoEdges(path) => path.sides(scene),
        }
    }

    /// Whether nothing occludes it. Adds the rays cast, [`MAX_RAYS`] at most, to `rays`.
    pub fn is_unoccluded(&self, scene: &Scene, endpoints: &Endpoints, rays: &mut u64) -> bool {
        match self {
            Self::Reflected(path) => path.is_unoccluded(scene, rays),
            Self::TwoEdges(path) => path.is_unoccluded(scene, endpoints, rays),
        }
    }
}
