//! One path that is or may soon be heard, and how it stands in the present graphics frame.

use crate::acoustics::BandArray;
use crate::extrapolation::frame::FramePath;
use crate::extrapolation::geometric::frame_geometry::{Shapes, Standing};
use crate::extrapolation::geometric::line_extrapolation::Trend;
use crate::extrapolation::geometric::source_poses::Place;
use crate::extrapolation::geometric::{GeometricSettings, Now};
use crate::extrapolation::predictor::{as_of_update, heard_from};
use crate::propagation::amplitude::{direct_by_source, free_field, reflected};
use crate::propagation::diffraction::DiffractionSequence;
use crate::propagation::image_source::image_path::{ImagePath, mirror_listener, unfold};
use crate::propagation::image_source::sequence::{Order, Sequence};
use crate::propagation::{Path, PathId, PathSet};
use crate::scene::{ListenerPose, Scene};
use glam::DVec3;

/// Difference in metres between a path's length and what its surfaces give, above which it is no image-source path.
const FOREIGN_M: f64 = 1e-3;

/// A path known from one of the last updates: what it can be computed from.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// The path as the last update that had it gives it.
    pub path: Path,
    /// The listener of that update.
    pub listener: ListenerPose,
    /// What the path can be computed from.
    pub course: Course,
    /// Which of its surfaces change places, in a scene in which nothing moves.
    order: Order,
    /// The number of the update in or after which it was last valid.
    pub valid_in: u64,
    /// What was heard of it when that was worked out last; `None` where every frame works it out.
    pub trend: Option<Trend>,
}

/// What is known of a candidate's visibility and level. Every graphics frame looks at all of these, and at few candidates
/// besides.
#[derive(Debug, Clone, Copy)]
pub struct Mark {
    /// Whether nothing blocks it, as of frame [`Self::tested`].
    pub open: bool,
    /// Whether the newest update has it.
    pub named: bool,
    /// The leg of a reflected path that was blocked last.
    pub blocked_leg: u8,
    /// Rays that a look along the whole of it takes.
    pub legs: u8,
    /// The graphics frame whose visibility is known; `None` before the first test.
    pub tested: Option<u64>,
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
    Bends(DiffractionSequence),
    /// Nothing that is known here: it is held as the update has it.
    Unknown,
}

/// What can be said of a path of an update apart from any graphics frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grounds {
    pub(crate) id: PathId,
    course: Course,
    order: Order,
}

impl Grounds {
    /// Of a path of which nothing is known.
    pub(crate) fn unknown(id: PathId) -> Self {
        Self {
            id,
            course: Course::Unknown,
            order: Order::default(),
        }
    }

    fn diffraction_order(id: PathId, course: DiffractionSequence) -> Self {
        Self {
            course: Course::Bends(course),
            ..Self::unknown(id)
        }
    }

    fn mirrors(id: PathId, sequence: Sequence, scene: &Scene) -> Self {
        Self {
            id,
            course: Course::Mirrors(sequence),
            order: Order::of(scene, &sequence),
        }
    }

    /// Of a path of an update; `scene` is as it stood for that update.
    pub(crate) fn of(path: &Path, update: &PathSet, scene: &Scene) -> Self {
        if let Some(bent) = DiffractionSequence::of(scene, path) {
            return Self::diffraction_order(path.id, bent);
        }
        let source = update.sources.iter().find(|pose| pose.id == path.source);
        let Some(source) = source else {
            return Self::unknown(path.id);
        };
        let (from, ear) = (
            scene.to_local(source.position),
            scene.to_local(update.listener.position),
        );
        let sequence = Sequence::canonical(scene, path.surfaces());
        let image_of_ear = mirror_listener(scene, &sequence, ear);
        let image = unfold(scene, &sequence, from, ear, image_of_ear);
        let same = |found: ImagePath| (found.length_m - f64::from(path.length_m)).abs() < FOREIGN_M;
        match image.is_some_and(same) {
            true => Self::mirrors(path.id, sequence, scene),
            false => Self::unknown(path.id),
        }
    }

    /// Of a path that an update names as one nearby; `scene` is as it stood for that update.
    pub(crate) fn nearby(path: &Path, scene: &Scene) -> Self {
        match DiffractionSequence::of(scene, path) {
            Some(bent) => Self::diffraction_order(path.id, bent),
            None => {
                let sequence = Sequence::canonical(scene, path.surfaces());
                Self::mirrors(path.id, sequence, scene)
            }
        }
    }
}

impl Candidate {
    /// From a path of an update.
    pub(crate) fn new(path: &Path, update: &PathSet, grounds: &Grounds) -> Self {
        Self {
            path: *path,
            listener: update.listener,
            course: grounds.course,
            order: grounds.order,
            valid_in: 0,
            trend: None,
        }
    }

    /// How an open one goes on along its trend, if its turn to be worked out is in another frame.
    pub(crate) fn continued(
        &self,
        now: &Now<'_>,
        place: Option<&Place>,
        (frame, every): (u64, u32),
    ) -> Option<FramePath> {
        let path = self.trend.as_ref()?.at(frame, every.into())?;
        let diffraction_order = match self.course {
            // As the update has it, which is no line from one update to the next.
            Course::Unknown => return None,
            Course::Bends(_) => true,
            Course::Mirrors(_) => false,
        };
        let is_shadowed = place.is_some_and(|place| place.is_shadowed);
        let is_out = self.has_gone(now.scene) || diffraction_order && !is_shadowed;
        (!is_out).then_some(path)
    }

    /// Keeps what is heard of it in a frame that has worked it out.
    pub(crate) fn remember(&mut self, heard: Option<&FramePath>, frame: u64, every: u32) {
        let before = self.trend.take();
        let heard = heard.filter(|_| !matches!(self.course, Course::Unknown));
        self.trend = heard.map(|path| Trend::of(path, frame, before.as_ref(), every.into()));
    }

    /// How it stands in the graphics frame `now`, whatever may block it. Of a reflected path the points alone.
    pub(crate) fn stand(
        &self,
        now: &Now<'_>,
        place: Option<&Place>,
        settings: &GeometricSettings,
        shapes: &mut Shapes,
    ) -> Standing {
        let Some(place) = place.filter(|place| place.is_somewhere) else {
            return Standing::Out;
        };
        if self.has_gone(now.scene) {
            return Standing::Out;
        }
        let sequence = match &self.course {
            Course::Unknown => return shapes.path(self.held(now)),
            // An update leaves these out where the direct path is seen.
            Course::Bends(_) if !place.is_shadowed => return Standing::Out,
            Course::Bends(_) if !settings.exact_geometry => return shapes.path(self.held(now)),
            Course::Bends(course) => {
                return match course.between(now.scene, &place.spot) {
                    Some(way) => shapes.bent(way),
                    None => Standing::Out,
                };
            }
            Course::Mirrors(sequence) => sequence,
        };
        let [from, ear] = place.ends;
        let order = match now.scene.has_instances() {
            true => &Order::of(now.scene, sequence),
            false => &self.order,
        };
        let line = [from, mirror_listener(now.scene, sequence, ear)];
        if shapes.unfolded.along(now.scene, sequence, order, line) {
            shapes.line = line;
            return Standing::Legs;
        }
        match (settings.drop_outside, settings.exact_geometry) {
            (true, _) => Standing::Out,
            (false, false) => shapes.path(self.held(now)),
            (false, true) => shapes.path(self.unbounded(from, ear, now)),
        }
    }

    /// What is heard of it while it is open.
    pub(crate) fn heard(
        &self,
        standing: Standing,
        now: &Now<'_>,
        place: &Place,
        settings: &GeometricSettings,
        shapes: &Shapes,
    ) -> Option<FramePath> {
        match standing {
            Standing::Unasked | Standing::Out | Standing::Legs => None,
            Standing::Path(number) | Standing::Continued(number) => Some(*shapes.path_of(number)),
            Standing::Image(_) if !settings.exact_geometry => Some(self.held(now)),
            Standing::Image(number) => Some(self.exact(shapes.image_of(number), place, now)),
            Standing::Bent(number) => {
                let path = shapes.way_of(number).path(now.scene, &place.spot)?;
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
    fn exact(&self, image: &ImagePath, place: &Place, now: &Now<'_>) -> FramePath {
        let mut amplitude = reflected(now.scene, image, place.spot.min_distance_m);
        let departure = (image.points[0] - place.ends[0]).as_vec3();
        direct_by_source(&mut amplitude, &place.spot.source, departure);
        // Rounded the way an update's paths are, so that a path at rest has the same bits either way.
        let (seen_at, length_m) = (now.scene.to_world(image.image), image.length_m as f32);
        FramePath {
            amplitude,
            ..heard_from(seen_at, length_m, &self.path, now.listener, now.scene)
        }
    }

    /// As if its surfaces had no ends: the level follows the distance alone.
    fn unbounded(&self, from: DVec3, ear: DVec3, now: &Now<'_>) -> FramePath {
        let scene = now.scene;
        let surfaces = self.path.surfaces().iter();
        let image = surfaces.fold(from, |point, &surface| scene.surface(surface).mirror(point));
        let length_m = image.distance(ear);
        let then = free_field(scene, f64::from(self.path.length_m), now.min_distance_m);
        let today = free_field(scene, length_m, now.min_distance_m);
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
}

impl Mark {
    /// Of a path of an update, open.
    pub(crate) fn new(path: &Path, frame: u64) -> Self {
        let energy = energy(&path.amplitude);
        Self {
            open: true,
            named: true,
            blocked_leg: 0,
            legs: path.order + path.diffraction_order + 1,
            tested: None,
            since: frame,
            energy,
            most_energy: energy,
        }
    }

    /// Of a path that an update names as one nearby, closed.
    pub(crate) fn nearby(path: &Path, frame: u64) -> Self {
        Self {
            open: false,
            named: false,
            ..Self::new(path, frame)
        }
    }

    /// Keeps how loud it is.
    pub(crate) fn note_level(&mut self, amplitude: &BandArray) {
        self.energy = energy(amplitude);
        self.most_energy = self.most_energy.max(self.energy);
    }

    /// Keeps whether it is open in a graphics frame that has asked.
    pub(crate) fn note_visibility(&mut self, open: bool, frame: u64) {
        if open != self.open {
            self.since = frame;
        }
        (self.open, self.tested) = (open, Some(frame));
    }
}

/// Pressure squared over all bands.
pub(crate) fn energy(amplitude: &BandArray) -> f32 {
    amplitude.iter().map(|a| a * a).sum()
}
