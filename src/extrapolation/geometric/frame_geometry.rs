//! Geometry of the candidates in one graphics frame: one index per candidate, and lists of the geometry of audible ones.

use glam::DVec3;

use crate::extrapolation::frame::FramePath;
use crate::extrapolation::work_budget::cost;
use crate::propagation::diffraction::DiffractionPath;
use crate::propagation::image_source::image_path::{ImagePath, UnfoldedPath};
use crate::scene::Scene;

/// A candidate's geometry in one graphics frame, with indices in [`GeometryArena`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrameGeometry {
    /// Not computed: the path was blocked when it was last tested.
    Unevaluated,
    /// Silent: a point is off its surface, the source does not exist, or it is visible and the path is diffracted.
    Invalid,
    /// A path of unknown geometry, unchanged from its update, or one over a curved surface.
    Held(u32),
    /// A reflected path extrapolated along its line: a visibility test computes its points.
    ExtrapolatedReflection,
    /// A diffracted path extrapolated along its line.
    ExtrapolatedDiffraction(u32),
    /// Another path extrapolated along its line.
    Extrapolated,
    /// The points of a reflected path, in [`GeometryArena::unfolded`].
    Unfolded,
    /// A reflected path.
    Image(u32),
    /// A diffracted path.
    Diffracted(u32),
}

impl FrameGeometry {
    /// Cost of its computation.
    pub(crate) fn cost(self) -> usize {
        match self {
            Self::Unevaluated => 0,
            Self::ExtrapolatedReflection => cost::CONTINUED,
            Self::ExtrapolatedDiffraction(_) | Self::Extrapolated => cost::EXTRAPOLATED,
            Self::Diffracted(_) => cost::DIFFRACTED,
            Self::Held(_) => cost::CURVED,
            Self::Invalid | Self::Unfolded | Self::Image(_) => cost::UNFOLDED,
        }
    }

    /// Whether the path is extrapolated along its line.
    pub(crate) fn is_extrapolated(self) -> bool {
        matches!(
            self,
            Self::Extrapolated | Self::ExtrapolatedReflection | Self::ExtrapolatedDiffraction(_)
        )
    }

    /// Whether visibility rays can be cast along it.
    pub(crate) fn is_testable(self) -> bool {
        let has_points = matches!(self, Self::Unfolded | Self::Image(_) | Self::Diffracted(_));
        has_points
            || matches!(
                self,
                Self::ExtrapolatedReflection | Self::ExtrapolatedDiffraction(_)
            )
    }
}

/// Geometry of the present graphics frame.
#[derive(Debug, Default)]
pub(crate) struct GeometryArena {
    /// The last unfolded path.
    pub(crate) unfolded: UnfoldedPath,
    /// Its source and the image of the listener.
    pub(crate) line: [DVec3; 2],
    images: Vec<ImagePath>,
    diffracted: Vec<DiffractionPath>,
    paths: Vec<FramePath>,
}

impl GeometryArena {
    /// Reserves capacity for this many candidates.
    pub(crate) fn reserve(&mut self, candidates: usize) {
        self.images.reserve(candidates);
        self.diffracted.reserve(candidates);
        self.paths.reserve(candidates);
    }

    /// Removes the geometry of the last frame.
    pub(crate) fn clear(&mut self) {
        self.images.clear();
        self.diffracted.clear();
        self.paths.clear();
    }

    /// Stores the last unfolded path with its angles and its image source.
    pub(crate) fn push_unfolded(&mut self, scene: &Scene) -> FrameGeometry {
        self.images.push(*self.unfolded.finish(scene, self.line));
        FrameGeometry::Image(self.images.len() as u32 - 1)
    }

    pub(crate) fn push_held(&mut self, path: FramePath) -> FrameGeometry {
        self.paths.push(path);
        FrameGeometry::Held(self.paths.len() as u32 - 1)
    }

    pub(crate) fn push_diffracted(&mut self, path: DiffractionPath) -> FrameGeometry {
        self.diffracted.push(path);
        FrameGeometry::Diffracted(self.diffracted.len() as u32 - 1)
    }

    pub(crate) fn push_extrapolated(&mut self, path: DiffractionPath) -> FrameGeometry {
        self.diffracted.push(path);
        FrameGeometry::ExtrapolatedDiffraction(self.diffracted.len() as u32 - 1)
    }

    /// The path of [`FrameGeometry::Held`].
    pub(crate) fn path(&self, index: u32) -> &FramePath {
        &self.paths[index as usize]
    }

    /// The path of [`FrameGeometry::Image`].
    pub(crate) fn image(&self, index: u32) -> &ImagePath {
        &self.images[index as usize]
    }

    /// The path of [`FrameGeometry::Diffracted`].
    pub(crate) fn diffracted(&self, index: u32) -> &DiffractionPath {
        &self.diffracted[index as usize]
    }

    /// Sides of the boundaries of a path's waves ([`DiffractionPath::sides`]), 0 without an edge.
    pub(crate) fn sides(&self, geometry: FrameGeometry, scene: &Scene) -> u32 {
        match geometry {
            FrameGeometry::Diffracted(index) => self.diffracted(index).sides(scene),
            _ => 0,
        }
    }
}
