//! A diffracted path between moved end points: the same reflections and edges.
//!
//! Extrapolation recomputes diffracted paths between updates. Geometry, wave and visibility rays are those of the update, so
//! a path at rest has the same bits.

use crate::propagation::diffraction::edge_wave::local_positions;
use crate::propagation::diffraction::two_edge_path::TwoEdgePath;
use crate::propagation::diffraction::with_reflections::ReflectedEdgePath;
use crate::propagation::diffraction::{near_list, second_order};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::{Interaction, interaction_path_id};
use crate::propagation::path::{EdgeLimits, Path};
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
        self.ranked_path(scene, endpoints, is_lit, &EdgeLimits::default())
    }

    /// The same with its weight in an update's lists, which end at `limits`.
    pub fn ranked_path(
        &self,
        scene: &Scene,
        endpoints: &Endpoints,
        is_lit: bool,
        limits: &EdgeLimits,
    ) -> Option<Path> {
        let (from, to) = local_positions(scene, endpoints);
        match self {
            // In the light its edges are those of the direct field.
            Self::Reflected(path) if is_lit => path.path(scene, endpoints, true),
            Self::Reflected(path) => {
                let share = near_list::reflected_share(scene, path.edge(), [from, to], limits);
                let path = path.path(scene, endpoints, false)?;
                (share > 0.0).then(|| path.scaled(share as f32))
            }
            Self::TwoEdges(path) => {
                let share = near_list::two_edge_share(scene, path.edges(), [from, to], limits);
                let (path, energy) = path.path(scene, endpoints)?;
                let listed = (path.scaled(share as f32), energy * share * share);
                let ranked = second_order::ranked(listed, limits.two_edge_floor);
                ranked.filter(|_| share > 0.0)
            }
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
