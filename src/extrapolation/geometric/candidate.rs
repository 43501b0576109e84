//! A path that is or may become audible, and its evaluation in the present graphics frame.

use crate::acoustics::{BANDS, BandArray};
use crate::extrapolation::frame::{FramePath, energy};
use crate::extrapolation::geometric::FrameInputs;
use crate::extrapolation::geometric::frame_geometry::{FrameGeometry, GeometryArena};
use crate::extrapolation::geometric::source_poses::{FrameSource, FrameSources};
use crate::extrapolation::line_extrapolation::{FrameTime, PathEnds, PathLine};
use crate::propagation::amplitude::{apply_directivity, reflected};
use crate::propagation::curved_reflection::CurvedSequence;
use crate::propagation::diffraction::{DiffractionSequence, reflection_gain};
use crate::propagation::image_source::image_path::{ImagePath, mirror_listener, unfold};
use crate::propagation::image_source::sequence::{Precedence, Sequence};
use crate::propagation::{Path, PathId, PathSet};
use crate::scene::{ListenerPose, Scene, SourceId};

/// Largest length difference in metres between an image-source path and its unfolded image.
const LENGTH_TOLERANCE_M: f64 = 1e-3;

/// A path of one of the last updates, and the geometry of its evaluation. What an evaluation reads lies together: most
/// candidates are in no cache when their turn comes.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Candidate {
    /// Its surfaces and edges.
    pub geometry: PathGeometry,
    /// The source.
    pub source: SourceId,
    /// For each reflection the earlier ones that must precede it, in a scene without instances.
    order: Precedence,
    /// Number of the last update in or after which it was valid.
    pub valid_in: u64,
    /// The path in its last update.
    pub path: Path,
    /// The listener of that update.
    pub listener: ListenerPose,
}

/// Visibility and energy of a candidate. Separate from [`Candidate`]: every graphics frame reads all states but few
/// candidates.
#[derive(Debug, Clone, Copy)]
pub struct VisibilityState {
    /// Whether the path is unoccluded, as of frame [`Self::tested`].
    pub is_visible: bool,
    /// Whether the newest update has the path.
    pub in_update: bool,
    /// The last blocked segment of a reflected path.
    pub blocked_segment: u8,
    /// Rays of a test of the whole path.
    pub segments: u8,
    /// Whether it is reflected at planes only.
    pub is_reflection: bool,
    /// The graphics frame of the last test; `None` before the first.
    pub tested: Option<u64>,
    /// The graphics frame of the last change of [`Self::is_visible`].
    pub changed: u64,
    /// Energy over all bands of the last emission or update.
    pub energy: f32,
    /// Largest energy so far: a path that fades at a surface's end may return to it.
    pub peak_energy: f32,
}

/// Surfaces and edges from which a path is computed.
#[derive(Debug, Clone, Copy)]
pub enum PathGeometry {
    /// Surfaces only, in canonical order.
    Reflection(Sequence),
    /// Edges, and surfaces before or after them.
    Diffraction(DiffractionSequence),
    /// A curved surface, and planes before or after it.
    Curved(CurvedSequence),
    /// Unknown: the path is held unchanged from its update.
    Unknown,
}

/// The part of a candidate that depends only on the update, not on the graphics frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PathRecipe {
    pub(crate) id: PathId,
    geometry: PathGeometry,
    order: Precedence,
}

impl PathRecipe {
    fn new(id: PathId, geometry: PathGeometry, scene: &Scene) -> Self {
        let order = match &geometry {
            PathGeometry::Reflection(sequence) => Precedence::of(scene, sequence),
            _ => Precedence::default(),
        };
        Self {
            id,
            geometry,
            order,
        }
    }

    /// The recipe of a path of an update; `scene` has that update's instance poses.
    pub(crate) fn of(path: &Path, update: &PathSet, scene: &Scene) -> Self {
        let recipe = Self::nearby(path, scene);
        let PathGeometry::Reflection(sequence) = recipe.geometry else {
            return recipe;
        };
        let source = update.sources.iter().find(|pose| pose.id == path.source);
        let image = source.and_then(|source| {
            let from = scene.to_local(source.position);
            let ear = scene.to_local(update.listener.position);
            let image_of_ear = mirror_listener(scene, &sequence, ear);
            unfold(scene, &sequence, from, ear, image_of_ear)
        });
        let is_same = |found: ImagePath| {
            (found.length_m - f64::from(path.length_m)).abs() < LENGTH_TOLERANCE_M
        };
        match image.is_some_and(is_same) {
            true => recipe,
            false => Self::new(path.id, PathGeometry::Unknown, scene),
        }
    }

    /// The recipe of a nearby path of an update, without a test of its length.
    pub(crate) fn nearby(path: &Path, scene: &Scene) -> Self {
        let geometry = match DiffractionSequence::of(scene, path) {
            Some(sequence) => PathGeometry::Diffraction(sequence),
            None => match CurvedSequence::of(scene, path) {
                Some(sequence) => PathGeometry::Curved(sequence),
                None => PathGeometry::Reflection(Sequence::canonical(scene, path.surfaces())),
            },
        };
        Self::new(path.id, geometry, scene)
    }
}

impl Candidate {
    /// A candidate from a path of an update.
    pub(crate) fn new(path: &Path, update: &PathSet, recipe: &PathRecipe) -> Self {
        Self {
            geometry: recipe.geometry,
            source: path.source,
            order: recipe.order,
            valid_in: 0,
            path: *path,
            listener: update.listener,
        }
    }

    /// Whether it is reflected at planes only.
    pub(crate) fn is_reflection(&self) -> bool {
        matches!(self.geometry, PathGeometry::Reflection(_))
    }

    /// Whether it is diffracted.
    pub(crate) fn is_diffracted(&self) -> bool {
        matches!(self.geometry, PathGeometry::Diffraction(_))
    }

    /// How a visible candidate with this line is extrapolated in a graphics frame; `None` if the frame must evaluate it.
    #[inline]
    pub(crate) fn extrapolated(
        &self,
        (state, line): (&VisibilityState, &PathLine),
        inputs: &FrameInputs<'_>,
        sources: &FrameSources,
        (frame, every): (u64, u32),
        arena: &mut GeometryArena,
    ) -> Option<FrameGeometry> {
        let source = sources.get(line.source())?;
        if !line.spans(frame, every.into(), source.reach) || !source.is_finite {
            return None;
        }
        if self.is_gone(inputs.scene) {
            return None;
        }
        if state.is_reflection {
            return Some(FrameGeometry::ExtrapolatedReflection);
        }
        let PathGeometry::Diffraction(sequence) = &self.geometry else {
            return Some(FrameGeometry::Extrapolated);
        };
        if source.shadow.share(sequence) == 0.0 {
            return None;
        }
        // A wave that has changed its sign is not on the line through what it was.
        let path = sequence.between(inputs.scene, &source.endpoints);
        let path = path.filter(|path| path.sides(inputs.scene) == line.sides())?;
        Some(arena.push_extrapolated(path))
    }

    /// The line through the path of a frame that has evaluated it, with the sides of its waves, and the evaluation before.
    pub(crate) fn line(
        &self,
        (path, sides): (Option<&FramePath>, u32),
        before: Option<&PathLine>,
        (now, every): ((FrameTime, PathEnds), u32),
    ) -> Option<PathLine> {
        // A path of unknown geometry jumps between updates.
        let path = path.filter(|_| !matches!(self.geometry, PathGeometry::Unknown));
        path.map(|path| PathLine::through((path, sides), now, before, every.into()))
    }

    /// Its geometry in this graphics frame, without visibility; only the points of a reflected path.
    pub(crate) fn evaluate(
        &self,
        inputs: &FrameInputs<'_>,
        source: Option<&FrameSource>,
        arena: &mut GeometryArena,
    ) -> FrameGeometry {
        let Some(source) = source.filter(|source| source.is_finite) else {
            return FrameGeometry::Invalid;
        };
        let scene = inputs.scene;
        if self.is_gone(scene) {
            return FrameGeometry::Invalid;
        }
        let sequence = match &self.geometry {
            PathGeometry::Unknown => {
                return arena.push_held(FramePath::of(
                    &self.path,
                    source.endpoints.from,
                    &self.listener,
                    scene,
                ));
            }
            PathGeometry::Curved(sequence) => {
                let path = sequence.between(scene, &source.endpoints, &self.path);
                return path.map_or(FrameGeometry::Invalid, |path| {
                    let from = source.endpoints.from;
                    arena.push_held(FramePath::of(&path, from, inputs.listener, scene))
                });
            }
            PathGeometry::Diffraction(sequence) => {
                if source.shadow.share(sequence) == 0.0 {
                    return FrameGeometry::Invalid;
                }
                let path = sequence.between(scene, &source.endpoints);
                return path.map_or(FrameGeometry::Invalid, |path| arena.push_diffracted(path));
            }
            PathGeometry::Reflection(sequence) => sequence,
        };
        let [from, ear] = source.local;
        let order = match scene.has_instances() {
            true => &Precedence::of(scene, sequence),
            false => &self.order,
        };
        let line = [from, mirror_listener(scene, sequence, ear)];
        if !arena.unfolded.unfold(scene, sequence, order, line) {
            return FrameGeometry::Invalid;
        }
        arena.line = line;
        FrameGeometry::Unfolded
    }

    /// The audible path of a visible candidate whose points were computed in this frame; its amplitude too, if none is given.
    pub(crate) fn frame_path(
        &self,
        geometry: FrameGeometry,
        inputs: &FrameInputs<'_>,
        source: &FrameSource,
        (arena, amplitude): (&GeometryArena, Option<BandArray>),
    ) -> Option<FramePath> {
        match geometry {
            FrameGeometry::Unevaluated
            | FrameGeometry::Invalid
            | FrameGeometry::Unfolded
            | FrameGeometry::ExtrapolatedReflection
            | FrameGeometry::ExtrapolatedDiffraction(_)
            | FrameGeometry::Extrapolated => None,
            FrameGeometry::Held(index) => Some(*arena.path(index)),
            FrameGeometry::Image(index) => {
                let image = arena.image(index);
                let amplitude =
                    amplitude.unwrap_or_else(|| self.amplitude_of(image, source, inputs));
                Some(self.reflected(image, source, inputs, amplitude))
            }
            FrameGeometry::Diffracted(index) => {
                let diffracted = arena.diffracted(index);
                let shadow = &source.shadow;
                let is_lit = !shadow.is_occluded;
                let (scene, limits) = (inputs.scene, &shadow.limits);
                let mut path = diffracted.ranked_path(scene, &source.endpoints, is_lit, limits)?;
                if let PathGeometry::Diffraction(sequence) = &self.geometry {
                    let share = shadow.share(sequence);
                    path.amplitude = path.amplitude.map(|value| value * share);
                }
                let from = source.endpoints.from;
                Some(FramePath::of(&path, from, inputs.listener, inputs.scene))
            }
        }
    }

    /// The amplitude of a reflected path in this frame: air absorption, spreading, angles and directivity, by the functions of
    /// propagation.
    fn amplitude_of(
        &self,
        image: &ImagePath,
        source: &FrameSource,
        inputs: &FrameInputs<'_>,
    ) -> BandArray {
        let scene = inputs.scene;
        let mut amplitude = reflected(scene, image, source.endpoints.min_distance_m);
        if image.order == 1 {
            let edges = source.reflection_edges(inputs);
            let gain = reflection_gain(scene, &source.endpoints, image.surfaces[0], edges);
            for (value, gain) in amplitude.iter_mut().zip(gain.unwrap_or([1.0; BANDS])) {
                *value *= gain;
            }
        }
        let departure = (image.points[0] - source.local[0]).as_vec3();
        apply_directivity(&mut amplitude, &source.endpoints.source, departure);
        amplitude
    }

    /// A reflected path with this frame's length and directions.
    fn reflected(
        &self,
        image: &ImagePath,
        source: &FrameSource,
        inputs: &FrameInputs<'_>,
        amplitude: BandArray,
    ) -> FramePath {
        let scene = inputs.scene;
        let departure = (image.points[0] - source.local[0]).as_vec3();
        // Rounded as in an update: a static path is bit-identical to it.
        let (position, length_m) = (scene.to_world(image.image), image.length_m as f32);
        FramePath {
            amplitude,
            departure: departure.normalize_or_zero(),
            ..FramePath::from_image(position, length_m, &self.path, inputs.listener, scene)
        }
    }

    /// Whether one of its surfaces belonged to a removed or replaced instance.
    fn is_gone(&self, scene: &Scene) -> bool {
        if !scene.has_instances() {
            return false;
        }
        let exists = |surface: &u32| scene.has_surface(*surface);
        let is_replaced = match self.geometry {
            PathGeometry::Reflection(sequence) => {
                sequence.path_id(scene, self.path.source) != self.path.id
            }
            PathGeometry::Diffraction(_) | PathGeometry::Curved(_) | PathGeometry::Unknown => false,
        };
        is_replaced || !self.path.surfaces().iter().all(exists)
    }
}

impl VisibilityState {
    /// The state of a valid path of an update.
    pub(crate) fn new(path: &Path, is_reflection: bool, frame: u64) -> Self {
        let energy = energy(&path.amplitude);
        Self {
            is_visible: true,
            in_update: true,
            blocked_segment: 0,
            segments: path.points().len() as u8 + 1,
            is_reflection,
            tested: None,
            changed: frame,
            energy,
            peak_energy: energy,
        }
    }

    /// The state of a nearby path of an update.
    pub(crate) fn nearby(path: &Path, is_reflection: bool, frame: u64) -> Self {
        Self {
            is_visible: false,
            in_update: false,
            ..Self::new(path, is_reflection, frame)
        }
    }

    /// Records the emitted amplitude.
    pub(crate) fn record_amplitude(&mut self, amplitude: &BandArray) {
        self.energy = energy(amplitude);
        self.peak_energy = self.peak_energy.max(self.energy);
    }

    /// Records the result of a visibility test.
    pub(crate) fn record_visibility(&mut self, is_visible: bool, frame: u64) {
        if is_visible != self.is_visible {
            self.changed = frame;
        }
        (self.is_visible, self.tested) = (is_visible, Some(frame));
    }
}
