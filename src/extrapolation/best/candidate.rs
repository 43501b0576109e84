//! One path that is or may soon be heard, and how it stands in the present graphics frame.

use super::super::frame::FramePath;
use super::super::predictor::as_of_update;
use super::trend::Trend;
use super::{BestSettings, Now};
use crate::acoustics::BandArray;
use crate::propagation::amplitude::{direct_by_source, free_field, reflected};
use crate::propagation::diffraction::{BentCourse, BentWay, Spot};
use crate::propagation::image_source::{ImagePath, mirror_listener, unfold};
use crate::propagation::sequence::Sequence;
use crate::propagation::{Path, PathId, PathSet};
use crate::scene::{ListenerPose, Scene};
use glam::DVec3;

/// Difference in metres between a path's length and what its surfaces give, above which it is no image-source path.
const FOREIGN_M: f64 = 1e-3;

/// A path known from one of the last updates.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// The path as the last update that had it gives it.
    pub path: Path,
    /// The listener of that update.
    pub listener: ListenerPose,
    /// What the path can be computed from.
    pub course: Course,
    /// Whether nothing blocks it, as of frame [`Self::tested`].
    pub open: bool,
    /// The graphics frame whose visibility is known; `None` before the first test.
    pub tested: Option<u64>,
    /// The leg of a reflected path that was blocked last.
    pub blocked_leg: u8,
    /// The number of the update in or after which it was last valid.
    pub valid_in: u64,
    /// What was heard of it when that was worked out last; `None` where every frame works it out.
    pub trend: Option<Trend>,
    /// Whether the newest update has it.
    pub named: bool,
    /// The graphics frame since which it is open, or closed, as far as is known.
    pub since: u64,
    /// Pressure squared over all bands as last heard, or as an update gives it.
    pub energy: f32,
    /// The most of that so far: what fades at a surface's end comes back this loud.
    pub most_energy: f32,
}

/// What a path can be computed from anew.
#[derive(Debug, Clone, Copy)]
pub enum Course {
    /// Surfaces alone, in canonical order.
    Mirrors(Sequence),
    /// Edges, and surfaces before or behind them.
    Bends(BentCourse),
    /// Nothing that is known here: it is held as the update has it.
    Unknown,
}

/// How a candidate stands in one graphics frame.
#[derive(Debug, Clone, Copy)]
pub enum Standing {
    /// Not looked at: closed, and nobody has asked yet.
    Unasked,
    /// Nothing of it is to be heard: a point has left its surface, its source has gone or, for a bent path, is seen.
    Out,
    /// Heard like this if nothing blocks it, and nothing to cast rays along.
    Path(FramePath),
    /// The same, of a path that was not worked out in this frame.
    Continued(FramePath),
    /// A reflected path.
    Image(ImagePath),
    /// A bent path.
    Bent(BentWay),
}

/// What can be said of a path of an update apart from any graphics frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grounds {
    pub(super) id: PathId,
    course: Course,
}

impl Grounds {
    #[cfg(test)]
    pub(super) const fn unknown(id: PathId) -> Self {
        Self {
            id,
            course: Course::Unknown,
        }
    }

    /// Of a path of an update; `scene` is as it stood for that update.
    pub(super) fn of(path: &Path, update: &PathSet, scene: &Scene) -> Self {
        let mut grounds = Self {
            id: path.id,
            course: Course::Unknown,
        };
        if let Some(bent) = BentCourse::of(scene, path) {
            grounds.course = Course::Bends(bent);
            return grounds;
        }
        let source = update.sources.iter().find(|pose| pose.id == path.source);
        let Some(source) = source else {
            return grounds;
        };
        let (from, ear) = (
            scene.to_local(source.position),
            scene.to_local(update.listener.position),
        );
        let sequence = Sequence::canonical(scene, path.surfaces());
        let image = trace(scene, &sequence, from, ear);
        let same =
            |found: &ImagePath| (found.length_m - f64::from(path.length_m)).abs() < FOREIGN_M;
        if image.is_some_and(|found| same(&found)) {
            grounds.course = Course::Mirrors(sequence);
        }
        grounds
    }
}

impl Candidate {
    /// From a path of an update, open.
    pub(super) fn new(path: &Path, update: &PathSet, grounds: &Grounds, frame: u64) -> Self {
        let energy = energy(&path.amplitude);
        Self {
            path: *path,
            listener: update.listener,
            course: grounds.course,
            open: true,
            tested: None,
            blocked_leg: 0,
            valid_in: 0,
            trend: None,
            named: true,
            since: frame,
            energy,
            most_energy: energy,
        }
    }

    /// From a path that an update names as one nearby, closed; `scene` is as it stood for that update.
    pub(super) fn nearby(path: &Path, update: &PathSet, scene: &Scene, frame: u64) -> Self {
        let course = match BentCourse::of(scene, path) {
            Some(bent) => Course::Bends(bent),
            None => Course::Mirrors(Sequence::canonical(scene, path.surfaces())),
        };
        let grounds = Grounds {
            id: path.id,
            course,
        };
        Self {
            open: false,
            named: false,
            ..Self::new(path, update, &grounds, frame)
        }
    }

    /// How an open one goes on along its trend, if its turn to be worked out is in another frame.
    pub(super) fn continued(&self, now: &Now<'_>, frame: u64, every: u32) -> Option<FramePath> {
        let path = self.trend?.at(frame, every.into())?;
        let bends = match self.course {
            // As the update has it, which is no line from one update to the next.
            Course::Unknown => return None,
            Course::Bends(_) => true,
            Course::Mirrors(_) => false,
        };
        let is_out = self.has_gone(now.scene) || bends && !now.is_shadowed(self.path.source);
        (!is_out).then_some(path)
    }

    /// Keeps what is heard of it in a frame that has worked it out.
    pub(super) fn remember(&mut self, heard: Option<&FramePath>, frame: u64, every: u32) {
        let before = self.trend.take();
        let heard = heard.filter(|_| !matches!(self.course, Course::Unknown));
        self.trend = heard.map(|path| Trend::of(path, frame, before.as_ref(), every.into()));
    }

    /// How it stands in the graphics frame `now`, whatever may block it.
    pub(super) fn stand(&self, now: &Now<'_>, settings: &BestSettings) -> Standing {
        let Some(spot) = now.spot(self.path.source) else {
            return Standing::Out;
        };
        if self.has_gone(now.scene) {
            return Standing::Out;
        }
        let sequence = match self.course {
            Course::Unknown => return Standing::Path(self.held(now)),
            // An update leaves these out where the direct path is seen.
            Course::Bends(_) if !now.is_shadowed(self.path.source) => return Standing::Out,
            Course::Bends(_) if !settings.exact_geometry => {
                return Standing::Path(self.held(now));
            }
            Course::Bends(course) => {
                return course
                    .way(now.scene, &spot)
                    .map_or(Standing::Out, Standing::Bent);
            }
            Course::Mirrors(sequence) => sequence,
        };
        let from = now.scene.to_local(spot.from);
        let ear = now.scene.to_local(spot.to);
        match trace(now.scene, &sequence, from, ear) {
            Some(image) => Standing::Image(image),
            None if settings.drop_outside => Standing::Out,
            None if !settings.exact_geometry => Standing::Path(self.held(now)),
            None => Standing::Path(self.unbounded(from, ear, now)),
        }
    }

    /// What is heard of it while it is open.
    pub(super) fn heard(
        &self,
        standing: &Standing,
        now: &Now<'_>,
        settings: &BestSettings,
    ) -> Option<FramePath> {
        match standing {
            Standing::Unasked | Standing::Out => None,
            Standing::Path(path) | Standing::Continued(path) => Some(*path),
            Standing::Image(_) if !settings.exact_geometry => Some(self.held(now)),
            Standing::Image(image) => {
                let spot = now.spot(self.path.source)?;
                Some(self.exact(image, &spot, now))
            }
            Standing::Bent(way) => {
                let path = way.path(now.scene, &now.spot(self.path.source)?)?;
                Some(as_of_update(&path, now.listener, now.scene))
            }
        }
    }

    /// As the update has it.
    fn held(&self, now: &Now<'_>) -> FramePath {
        as_of_update(&self.path, &self.listener, now.scene)
    }

    /// Exact for an image-source path: length, air, spreading, angles, directivity and direction of this frame, by the
    /// update's own functions.
    fn exact(&self, image: &ImagePath, spot: &Spot, now: &Now<'_>) -> FramePath {
        let mut amplitude = reflected(now.scene, image, spot.nearest_m);
        let departure = (image.points[0] - now.scene.to_local(spot.from)).as_vec3();
        direct_by_source(&mut amplitude, &spot.source, departure);
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
        if !scene.has_instances() {
            return false;
        }
        let exists = |surface: &u32| scene.has_surface(*surface);
        let another = match self.course {
            Course::Mirrors(sequence) => sequence.path_id(scene, self.path.source) != self.path.id,
            Course::Bends(_) | Course::Unknown => false,
        };
        another || !self.path.surfaces().iter().all(exists)
    }

    /// Keeps how loud it is.
    pub(super) fn note_level(&mut self, amplitude: &BandArray) {
        self.energy = energy(amplitude);
        self.most_energy = self.most_energy.max(self.energy);
    }

    /// Keeps whether it is open in a graphics frame that has asked.
    pub(super) fn note_visibility(&mut self, open: bool, frame: u64) {
        if open != self.open {
            self.since = frame;
        }
        (self.open, self.tested) = (open, Some(frame));
    }
}

/// Pressure squared over all bands.
pub(super) fn energy(amplitude: &BandArray) -> f32 {
    amplitude.iter().map(|a| a * a).sum()
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
