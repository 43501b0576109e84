//! One path that is or may soon be heard, and how it stands in the present graphics frame.

use super::super::frame::FramePath;
use super::super::predictor::as_of_update;
use super::{BestSettings, Now};
use crate::acoustics::{BANDS, BandArray};
use crate::propagation::amplitude::{free_field, reflected};
use crate::propagation::image_source::{ImagePath, mirror_listener, unfold};
use crate::propagation::sequence::Sequence;
use crate::propagation::{Path, PathSet};
use crate::scene::{ListenerPose, Scene, SourceId};
use glam::DVec3;

/// Difference in metres between a path's length and what its surfaces give, above which it is no image-source path.
const FOREIGN_M: f64 = 1e-3;

/// Analytic amplitude below which a ratio to it says nothing.
const NO_LEVEL: f32 = 1e-12;

/// A path known from one of the last updates.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// The path as the last update that had it gives it.
    pub path: Path,
    /// The listener of that update.
    pub listener: ListenerPose,
    /// The path's surfaces in canonical order.
    pub sequence: Sequence,
    /// What the update's amplitude is to the analytic one at its own poses: 1 where nothing else is modelled.
    pub residual: BandArray,
    /// Whether surfaces alone give the path; else it is held as the update has it.
    pub analytic: bool,
    /// Whether nothing blocks it, as of frame [`Self::tested`].
    pub open: bool,
    /// The graphics frame whose visibility is known; `None` before the first test.
    pub tested: Option<u64>,
    /// The number of the update in or after which it was last valid.
    pub valid_in: u64,
}

/// How a candidate stands in one graphics frame.
#[derive(Debug, Clone, Copy)]
pub struct Standing {
    /// What is heard if nothing blocks it; `None` if a point has left its surface.
    pub path: Option<FramePath>,
    /// Geometry to cast rays along.
    pub image: Option<ImagePath>,
}

impl Candidate {
    /// From a path of an update, open; `scene` is as it stood for that update.
    pub fn new(path: &Path, update: &PathSet, scene: &Scene, nearest_m: f64) -> Self {
        let mut candidate = Self {
            path: *path,
            listener: update.listener,
            sequence: Sequence::canonical(scene, path.surfaces()),
            residual: [1.0; BANDS],
            analytic: false,
            open: true,
            tested: None,
            valid_in: 0,
        };
        let source = update.sources.iter().find(|pose| pose.id == path.source);
        let Some(source) = source else {
            return candidate;
        };
        let (from, ear) = (
            scene.to_local(source.position),
            scene.to_local(update.listener.position),
        );
        let image = trace(scene, &candidate.sequence, from, ear);
        let same =
            |found: &ImagePath| (found.length_m - f64::from(path.length_m)).abs() < FOREIGN_M;
        if let Some(found) = image.filter(same) {
            candidate.analytic = true;
            let analytic = reflected(scene, &found, nearest_m);
            for b in 0..BANDS {
                if analytic[b].abs() > NO_LEVEL {
                    candidate.residual[b] = path.amplitude[b] / analytic[b];
                }
            }
        }
        candidate
    }

    /// Where it comes from, how late and how loud it is in the graphics frame `now`, whatever may block it.
    pub(super) fn stand(&self, now: &Now<'_>, settings: &BestSettings) -> Standing {
        let nothing = Standing {
            path: None,
            image: None,
        };
        let Some(from) = position_of(now, self.path.source) else {
            return nothing;
        };
        if self.has_gone(now.scene) {
            return nothing;
        }
        let held = || as_of_update(&self.path, &self.listener, now.scene);
        if !self.analytic {
            return Standing {
                path: Some(held()),
                ..nothing
            };
        }
        let ear = now.scene.to_local(now.listener.position);
        let image = trace(now.scene, &self.sequence, from, ear);
        let path = match &image {
            Some(_) if !settings.exact_geometry => Some(held()),
            Some(found) => Some(self.exact(found, now)),
            None if settings.drop_outside => None,
            None if !settings.exact_geometry => Some(held()),
            None => Some(self.unbounded(from, ear, now)),
        };
        Standing { path, image }
    }

    /// Exact for an image-source path: length, air, spreading, angles and direction of this frame.
    fn exact(&self, image: &ImagePath, now: &Now<'_>) -> FramePath {
        let mut amplitude = reflected(now.scene, image, now.nearest_m);
        for b in 0..BANDS {
            amplitude[b] *= self.residual[b];
        }
        // Rounded the way an update's paths are, so that a path at rest has the same bits either way.
        let path = Path {
            image: now.scene.to_world(image.image),
            length_m: image.length_m as f32,
            amplitude,
            ..self.path
        };
        as_of_update(&path, now.listener, now.scene)
    }

    /// As if its surfaces had no ends: the level follows the distance alone.
    fn unbounded(&self, from: DVec3, ear: DVec3, now: &Now<'_>) -> FramePath {
        let scene = now.scene;
        let surfaces = self.path.surfaces().iter();
        let image = surfaces.fold(from, |point, &surface| scene.surface(surface).mirror(point));
        let length_m = image.distance(ear);
        let then = free_field(scene, f64::from(self.path.length_m), now.nearest_m);
        let today = free_field(scene, length_m, now.nearest_m);
        let path = Path {
            image: scene.to_world(image),
            length_m: length_m as f32,
            amplitude: std::array::from_fn(|b| self.path.amplitude[b] * today[b] / then[b]),
            ..self.path
        };
        as_of_update(&path, now.listener, scene)
    }

    /// Whether one of its surfaces was an instance's that is there no more, or whose number is another's now.
    fn has_gone(&self, scene: &Scene) -> bool {
        let exists = |surface: &u32| scene.has_surface(*surface);
        !self.sequence.surfaces().iter().all(exists)
            || (scene.has_instances()
                && self.sequence.path_id(scene, self.path.source) != self.path.id)
    }

    /// Pressure squared over all bands when last seen in an update.
    pub fn energy(&self) -> f32 {
        self.path.amplitude.iter().map(|a| a * a).sum()
    }
}

/// The place of a source in local coordinates, if it is still there.
pub(super) fn position_of(now: &Now<'_>, source: SourceId) -> Option<DVec3> {
    let pose = now.sources.iter().find(|pose| pose.id == source)?;
    Some(now.scene.to_local(pose.position))
}

fn trace(scene: &Scene, sequence: &Sequence, from: DVec3, ear: DVec3) -> Option<ImagePath> {
    unfold(
        scene,
        sequence,
        from,
        ear,
        mirror_listener(scene, sequence, ear),
    )
}
