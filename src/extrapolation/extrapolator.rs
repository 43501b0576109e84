//! The state of extrapolation: the last updates, the predictor and the present graphics frame.

use std::sync::Arc;

use super::hold::Hold;
use super::linear::Linear;
use super::predictor::{Predictor, PredictorKind};
use super::tracking::match_by_id;

use crate::extrapolation::direct_lines::DirectLines;
use crate::extrapolation::frame_effort::FrameEffort;
use crate::extrapolation::frame_mix::{FrameMix, MixSmoother};
use crate::extrapolation::geometric::{GeometricPredictor, PreparedUpdate, SourceShadow};
use crate::extrapolation::line_extrapolation::ExtrapolationReach;
use crate::extrapolation::scene_pair::ScenePair;
use crate::extrapolation::source_motion::SourceMotion;
use crate::propagation::diffraction::PointImage;
use crate::propagation::{LATE_GROUPS, LateEnergy, LateGroup, PathSet};
use crate::scene::{InstancePose, Scene, SourceId, SourcePose};

/// Predictor of the paths that are not part of the direct field.
pub(super) enum Rule {
    /// Predicts each path of the newest update separately.
    PathByPath(Box<dyn Predictor>),
    /// Predicts from the paths of several updates.
    Geometric(Box<GeometricPredictor>),
}

/// Progress of a graphics frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// Direct field, from the source at this index on.
    Direct(usize),
    /// The other paths; with [`Rule::PathByPath`] from this index on.
    Continued(usize),
    /// Delays by the time of emission, from the path at this index on.
    Emission(usize),
    /// Sorting of the paths, and late energy.
    Finish,
}

impl Default for Step {
    /// A new frame.
    fn default() -> Self {
        Self::Direct(0)
    }
}

/// A predictor and its state. Constructed on the control side; the audio side only swaps it.
pub struct PredictorState(pub(super) Rule);

impl PredictorState {
    /// A predictor of this kind. Control side; allocates.
    pub fn of(kind: PredictorKind) -> Self {
        Self(match kind {
            PredictorKind::Hold => Rule::PathByPath(Box::new(Hold)),
            PredictorKind::Linear => Rule::PathByPath(Box::new(Linear)),
            PredictorKind::Geometric(settings) => {
                Rule::Geometric(Box::new(GeometricPredictor::new(settings)))
            }
        })
    }

    /// [`Self::of`] with capacity for this many paths per update and sources, which avoids allocation on the audio side.
    pub fn with_room(kind: PredictorKind, paths: usize, sources: usize) -> Self {
        let mut predictor = Self::of(kind);
        predictor.reserve(paths, sources);
        predictor
    }

    fn reserve(&mut self, paths: usize, sources: usize) {
        if let Rule::Geometric(predictor) = &mut self.0 {
            predictor.set_capacity(Self::most_paths(paths), sources);
        }
    }

    /// Most paths of a graphics frame besides direct ones, for updates of at most `paths` paths.
    pub const fn most_paths(paths: usize) -> usize {
        CANDIDATES_PER_PATH * paths
    }
}

/// Updates kept besides the last two.
const OLDER_UPDATES: usize = 2;

/// Candidates of [`PredictorKind::Geometric`] per path of an update.
const CANDIDATES_PER_PATH: usize = 3;

/// The extrapolation stage. Owned by the sound thread.
///
/// # Real-time
/// [`Self::store_update`], [`Self::frame`] and the parts of a frame allocate only when the number of paths or sources
/// exceeds its previous maximum and the capacity of [`Self::reserve`].
///
/// ```
/// # use std::sync::Arc;
/// use foresound::extrapolation::{Extrapolator, FramePaths, PredictorKind};
/// use foresound::propagation::{PathSet, PropagationSettings, Propagator};
/// use foresound::scene::{SourceId, procedural};
/// use foresound::{ListenerPose, MaterialTable, Scene, SceneSettings, SourcePose};
///
/// # fn main() -> foresound::Result<()> {
/// let room = procedural::shoebox([6.0, 3.0, 4.0], "concrete");
/// let scene = Scene::commit(&room, &MaterialTable::built_in(), &SceneSettings::default())?;
/// let scene = Arc::new(scene);
/// let sources = [SourcePose::at(SourceId::new(0, 0), [1.0, 1.5, 1.0])];
/// let mut propagator = Propagator::new(Arc::clone(&scene), PropagationSettings::default())?;
/// let mut extrapolator = Extrapolator::new(scene, PredictorKind::default(), 0.3);
///
/// let mut update = PathSet::default();
/// propagator.update(&ListenerPose::facing([4.0, 1.7, 2.0], 0.0), &sources, 0.0, &mut update);
/// extrapolator.store_update(update, 4);
///
/// // The listener of the next graphics frame:
/// let mut frame = FramePaths::default();
/// extrapolator.frame(&ListenerPose::facing([4.02, 1.7, 2.0], 0.0), &sources, &mut frame);
/// assert!(frame.paths.len() > 6);
/// # Ok(())
/// # }
/// ```
pub struct Extrapolator {
    pub(super) scenes: ScenePair,
    pub(super) predictor: PredictorState,
    pub(super) min_distance_m: f64,
    pub(super) current: PathSet,
    pub(super) prepared: PreparedUpdate,
    pub(super) previous: PathSet,
    /// Earlier updates, the newest first, for the late energy of [`PredictorKind::Geometric`].
    pub(super) older: [PathSet; OLDER_UPDATES],
    /// Index in `previous` of each path of `current`.
    pub(super) matches: Vec<Option<u32>>,
    /// What the direct field tells of each source of the present graphics frame.
    pub(super) shadows: Vec<SourceShadow>,
    /// The late energy of the present graphics frame.
    pub(super) late: Vec<LateEnergy>,
    /// Reverberation time as last emitted.
    pub(super) late_groups: [LateGroup; LATE_GROUPS],
    pub(super) level: u32,
    pub(super) frames_since_update: u32,
    pub(super) updates: u64,
    pub(super) step: Step,
    /// Time of the present graphics frame in seconds, and whether it was recorded with the sources.
    pub(super) time_s: f64,
    pub(super) is_timed: bool,
    pub(super) motion: SourceMotion,
    pub(super) smoother: MixSmoother,
    /// The mix of each source of the present graphics frame.
    pub(super) mixes: Vec<FrameMix>,
    /// The points of each wide source of the present graphics frame.
    pub(super) images: Vec<(SourceId, PointImage)>,
    /// The direct fields that were computed last.
    pub(super) direct_lines: DirectLines,
    /// Rays that have tested edges of the direct field in the present graphics frame.
    pub(super) edge_rays: u64,
}

impl Extrapolator {
    /// For a scene; below `min_distance_m` metres the amplitude of a source is constant
    /// ([`crate::propagation::PropagationSettings::min_distance_m`]). Control side; allocates.
    pub fn new(scene: Arc<Scene>, kind: PredictorKind, min_distance_m: f32) -> Self {
        Self {
            scenes: ScenePair::of(&scene),
            predictor: PredictorState::of(kind),
            min_distance_m: f64::from(min_distance_m),
            current: PathSet::default(),
            prepared: PreparedUpdate::default(),
            previous: PathSet::default(),
            older: Default::default(),
            matches: Vec::new(),
            shadows: Vec::new(),
            late: Vec::new(),
            late_groups: Default::default(),
            level: 0,
            frames_since_update: 0,
            updates: 0,
            step: Step::default(),
            time_s: 0.0,
            is_timed: false,
            motion: SourceMotion::default(),
            smoother: MixSmoother::default(),
            mixes: Vec::new(),
            images: Vec::new(),
            direct_lines: DirectLines::default(),
            edge_rays: 0,
        }
    }

    /// Stores the newest update and the extrapolation level L of the interval it begins; returns an old update for reuse.
    pub fn store_update(&mut self, update: PathSet, level: u32) -> PathSet {
        self.prepared.clear();
        self.store(update, level)
    }

    /// [`Self::store_update`] with a prepared update: the same result with less work. Swaps `prepared` for an old one.
    pub fn store_prepared_update(
        &mut self,
        update: PathSet,
        prepared: &mut PreparedUpdate,
        level: u32,
    ) -> PathSet {
        std::mem::swap(&mut self.prepared, prepared);
        self.store(update, level)
    }

    fn store(&mut self, update: PathSet, level: u32) -> PathSet {
        self.restart_frame();
        let newest = std::mem::replace(&mut self.current, update);
        let previous = std::mem::replace(&mut self.previous, newest);
        let retired = match self.predictor.0 {
            Rule::PathByPath(_) => previous,
            Rule::Geometric(_) => {
                self.older.rotate_right(1);
                std::mem::replace(&mut self.older[0], previous)
            }
        };
        match_by_id(&self.current.paths, &self.previous.paths, &mut self.matches);
        self.level = level;
        self.frames_since_update = 0;
        self.updates += 1;
        self.scenes.set_update_poses(&self.current.instances);
        retired
    }

    /// Records the sources of the next graphics frame, `interval_s` seconds after the frame before. Delays of moving sources
    /// belong to the time of emission, and changes of a mix are smoothed; without records, every source counts as at rest, its
    /// mix applies at once, and frames count as evenly spaced. Real-time.
    pub fn record_sources(&mut self, sources: &[SourcePose], interval_s: f64) {
        // An interval that is no number counts as none.
        if interval_s > 0.0 {
            self.time_s += interval_s.min(10.0);
        }
        self.is_timed = true;
        let speed_m_s = self.scenes.current().speed_of_sound_m_s();
        self.motion.record(sources, interval_s, speed_m_s);
        self.smoother.record(sources, interval_s);
    }

    /// Takes over the recorded sources of an extrapolator that this one replaces. Real-time.
    pub(crate) fn take_motion(&mut self, replaced: &mut Self) {
        std::mem::swap(&mut self.motion, &mut replaced.motion);
        std::mem::swap(&mut self.smoother, &mut replaced.smoother);
    }

    /// Sets the poses of the scene's instances from the next frame on; ignores unknown instances. Real-time.
    pub fn set_instance_poses(&mut self, poses: &[InstancePose]) {
        self.scenes.set_current_poses(poses);
    }

    /// Swaps the scene for one with other instances; their paths are audible from the next update on. The fixed mesh must
    /// be the same: another scene needs another extrapolator. Real-time.
    pub fn swap_scene(&mut self, scenes: &mut ScenePair) {
        self.restart_frame();
        std::mem::swap(&mut self.scenes, scenes);
    }

    /// Reserves capacity for this many paths per update and sources. Control side; allocates.
    pub fn reserve(&mut self, paths: usize, sources: usize) {
        self.matches.reserve(paths);
        self.shadows.reserve(sources);
        self.late.reserve(sources);
        self.predictor.reserve(paths, sources);
        self.motion.reserve(sources);
        self.smoother.reserve(sources);
        self.mixes.reserve(sources);
        self.images.reserve(sources);
        self.direct_lines.reserve(sources);
    }

    /// Replaces the predictor from the next frame on; returns the old one. Real-time.
    pub fn set_predictor(&mut self, predictor: PredictorState) -> PredictorState {
        self.restart_frame();
        // Only the geometric predictor updates these.
        for update in &mut self.older {
            update.late.clear();
        }
        std::mem::replace(&mut self.predictor, predictor)
    }

    /// The effort of the geometric predictor from the next frame on; other predictors have one effort. Real-time.
    pub fn set_effort(&mut self, effort: FrameEffort) {
        if let Rule::Geometric(predictor) = &mut self.predictor.0 {
            predictor.set_effort(effort);
        }
    }

    /// How far a source's edge waves are extrapolated.
    pub(super) fn direct_reach(&self) -> ExtrapolationReach {
        match &self.predictor.0 {
            Rule::PathByPath(_) => ExtrapolationReach::default(),
            Rule::Geometric(predictor) => predictor.next_reach(),
        }
    }

    /// The newest update.
    pub fn current(&self) -> &PathSet {
        &self.current
    }

    /// Discards the progress of a graphics frame.
    fn restart_frame(&mut self) {
        self.step = Step::default();
        if let Rule::Geometric(predictor) = &mut self.predictor.0 {
            predictor.restart_frame();
        }
    }
}
