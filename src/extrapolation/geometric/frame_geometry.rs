//! How candidates stand in one graphics frame: most in a word, those that are heard with their geometry in a list.

use glam::DVec3;

use crate::extrapolation::frame::FramePath;
use crate::extrapolation::work_budget::cost;
use crate::propagation::diffraction::DiffractionPath;
use crate::propagation::image_source::image_path::{ImagePath, Unfolded};
use crate::scene::Scene;

/// How a candidate stands in one graphics frame; numbers are those of [`Shapes`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Standing {
    /// Not looked at: closed, and nobody has asked yet.
    Unasked,
    /// Nothing of it is to be heard: a point has left its surface, its source has gone or, for a bent path, is seen.
    Out,
    /// Heard like this if nothing blocks it, and nothing to cast rays along.
    Path(u32),
    /// The same, of a path that was not worked out in this frame.
    Continued(u32),
    /// A reflected path of which the points are known, and no more: the last that was unfolded.
    Legs,
    /// A reflected path.
    Image(u32),
    /// A bent path.
    Bent(u32),
}

impl Standing {
    /// What finding it out has cost.
    pub(crate) fn cost(self) -> usize {
        match self {
            Self::Unasked => 0,
            Self::Continued(_) => cost::CONTINUED,
            Self::Bent(_) => cost::BENT_WAY,
            Self::Out | Self::Path(_) | Self::Legs | Self::Image(_) => cost::UNFOLDED,
        }
    }
}

/// What standings tell of.
#[derive(Debug, Default)]
pub(crate) struct Shapes {
    /// The reflected path that was unfolded last, and along which line.
    pub(crate) unfolded: Unfolded,
    pub(crate) line: [DVec3; 2],
    images: Vec<ImagePath>,
    ways: Vec<DiffractionPath>,
    paths: Vec<FramePath>,
}

impl Shapes {
    /// Makes room for this many candidates.
    pub(crate) fn reserve(&mut self, candidates: usize) {
        self.images.reserve(candidates);
        self.ways.reserve(candidates);
        self.paths.reserve(candidates);
    }

    /// Forgets a graphics frame.
    pub(crate) fn clear(&mut self) {
        self.images.clear();
        self.ways.clear();
        self.paths.clear();
    }

    /// Keeps the path that was unfolded last, with its angles and its image.
    pub(crate) fn finish(&mut self, scene: &Scene) -> Standing {
        self.images.push(self.unfolded.finish(scene, self.line));
        Standing::Image(self.images.len() as u32 - 1)
    }

    pub(crate) fn path(&mut self, path: FramePath) -> Standing {
        self.paths.push(path);
        Standing::Path(self.paths.len() as u32 - 1)
    }

    pub(crate) fn continued(&mut self, path: FramePath) -> Standing {
        self.paths.push(path);
        Standing::Continued(self.paths.len() as u32 - 1)
    }

    pub(crate) fn bent(&mut self, way: DiffractionPath) -> Standing {
        self.ways.push(way);
        Standing::Bent(self.ways.len() as u32 - 1)
    }

    /// What [`Self::path`] and [`Self::continued`] have kept.
    pub(crate) fn path_of(&self, number: u32) -> &FramePath {
        &self.paths[number as usize]
    }

    /// What [`Self::finish`] has kept.
    pub(crate) fn image_of(&self, number: u32) -> &ImagePath {
        &self.images[number as usize]
    }

    /// What [`Self::bent`] has kept.
    pub(crate) fn way_of(&self, number: u32) -> &DiffractionPath {
        &self.ways[number as usize]
    }
}
