//! A bent path taken up again: the same reflections and edges between other places.
//!
//! Between two updates extrapolation asks for each bent path anew; the geometry, the wave and the sight lines are those of
//! the update itself, so that a path at rest has the same bits either way.

use crate::propagation::diffraction::second_order::Way;
use crate::propagation::diffraction::with_reflections::Mirrored;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::{Interaction, interaction_path_id};
use crate::propagation::path::Path;
use crate::scene::Scene;

/// Most rays that [`DiffractionPath::is_clear`] casts.
pub const MOST_RAYS: u64 = 4;

/// What a path with bends meets, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiffractionSequence {
    /// One edge, with a surface before it, behind it, or both.
    Mirrored {
        /// The edge.
        edge: u32,
        /// The surfaces.
        mirrors: [Option<u32>; 2],
    },
    /// Two edges.
    Double([u32; 2]),
}

impl DiffractionSequence {
    /// The course of an update's path; `None` if it does not bend, or only belongs to the direct field.
    pub fn of(scene: &Scene, path: &Path) -> Option<Self> {
        match (path.edges(), path.surfaces()) {
            (&[first, second], []) => Some(Self::Double([first, second])),
            (&[edge], &[before, behind]) => Some(Self::Mirrored {
                edge,
                mirrors: [Some(before), Some(behind)],
            }),
            (&[edge], &[surface]) => {
                // Whether the surface comes before the edge, only the path's identity tells.
                let stops = [Interaction::Surface(surface), Interaction::Edge(edge)];
                let mirrors =
                    match interaction_path_id(scene, path.source, stops.into_iter()) == path.id {
                        true => [Some(surface), None],
                        false => [None, Some(surface)],
                    };
                Some(Self::Mirrored { edge, mirrors })
            }
            _ => None,
        }
    }

    /// Whether it bends twice.
    pub fn is_double(&self) -> bool {
        matches!(self, Self::Double(_))
    }

    /// The way along this course between today's places, if there is one. Says nothing of what stands in between.
    pub fn way(&self, scene: &Scene, spot: &Endpoints) -> Option<DiffractionPath> {
        match *self {
            Self::Mirrored { edge, mirrors } => {
                Mirrored::over(scene, edge, mirrors, spot).map(DiffractionPath::Mirrored)
            }
            Self::Double(edges) => Way::over(scene, edges, spot).map(DiffractionPath::Double),
        }
    }
}

/// A way along a [`DiffractionSequence`].
#[derive(Debug, Clone, Copy)]
pub enum DiffractionPath {
    /// One bend and reflections.
    Mirrored(Mirrored),
    /// Two bends.
    Double(Way),
}

impl DiffractionPath {
    /// Its path, if that is loud enough ([`crate::propagation::diffraction::WEAKEST`]).
    pub fn path(&self, scene: &Scene, spot: &Endpoints) -> Option<Path> {
        match self {
            Self::Mirrored(way) => way.path(scene, spot),
            Self::Double(way) => way.path(scene, spot),
        }
    }

    /// Whether nothing stands on the way. Adds the rays it cast, [`MOST_RAYS`] at most, to `rays`.
    pub fn is_clear(&self, scene: &Scene, spot: &Endpoints, rays: &mut u64) -> bool {
        match self {
            Self::Mirrored(way) => way.is_clear(scene, rays),
            Self::Double(way) => way.is_clear(scene, spot, rays),
        }
    }
}
