//! Follows paths from update to update and from graphics frame to graphics frame.

use std::sync::Arc;

use super::frame_steps::Step;
use super::hold::Hold;
use super::linear::Linear;
use super::predictor::{Predictor, PredictorKind};
use super::tracking::match_by_id;
use crate::acoustics::{BANDS, BandArray};
use crate::extrapolation::geometric::{GeometricPredictor, PreparedUpdate};
use crate::extrapolation::scene_pair::ScenePair;
use crate::propagation::{LateEnergy, PathSet};
use crate::scene::{InstancePose, Scene};

/// How paths are continued that are not part of the direct field.
pub(super) enum Rule {
    /// Each path of the newest update by itself.
    PathByPath(Box<dyn Predictor>),
    /// Paths of several updates, together.
    Together(Box<GeometricPredictor>),
}

/// A predictor at work, with what it remembers. Made on the control side; the audio side only swaps it.
pub struct PredictorState(pub(super) Rule);

impl PredictorState {
    /// A predictor of this kind. Control side; allocates.
    pub fn of(kind: PredictorKind) -> Self {
        Self(match kind {
            PredictorKind::Hold => Rule::PathByPath(Box::new(Hold)),
            PredictorKind::Linear => Rule::PathByPath(Box::new(Linear)),
            PredictorKind::Geometric(settings) => {
                Rule::Together(Box::new(GeometricPredictor::new(settings)))
            }
        })
    }

    /// The same with room for updates of this many paths and for this many sources, so that the audio side need not
    /// allocate.
    pub fn with_room(kind: PredictorKind, paths: usize, sources: usize) -> Self {
        let mut continuation = Self::of(kind);
        continuation.reserve(paths, sources);
        continuation
    }

    fn reserve(&mut self, paths: usize, sources: usize) {
        if let Rule::Together(best) = &mut self.0 {
            best.bound(CANDIDATES_A_PATH * paths, sources);
        }
    }

    /// Most paths of a graphics frame besides direct ones, if updates have this many.
    pub const fn most_paths(paths: usize) -> usize {
        CANDIDATES_A_PATH * paths
    }
}

/// Updates kept besides the last two.
const OLDER: usize = 2;

/// Candidates that [`PredictorKind::Geometric`] may keep for each path that an update may have.
const CANDIDATES_A_PATH: usize = 3;

/// The extrapolation stage's state. Owned by the sound thread.
///
/// # Real-time
/// [`Self::store_update`], [`Self::frame`] and the parts of a frame allocate only while the number of paths or of sources exceeds everything
/// seen before and what [`Self::reserve`] was told.
pub struct Extrapolator {
    pub(super) scenes: ScenePair,
    pub(super) continuation: PredictorState,
    pub(super) min_distance_m: f64,
    pub(super) current: PathSet,
    /// What has been worked out of it.
    pub(super) groundwork: PreparedUpdate,
    pub(super) previous: PathSet,
    /// Those before, the newest first, whose late fields a listener who comes back may hear again: kept for
    /// [`PredictorKind::Geometric`], who asks.
    pub(super) older: [PathSet; OLDER],
    pub(super) matches: Vec<Option<u32>>,
    /// Of each source of the present graphics frame whether the listener does not see it.
    pub(super) shadowed: Vec<bool>,
    /// The late fields of the present graphics frame.
    pub(super) late: Vec<LateEnergy>,
    /// The tail's decay as last heard.
    pub(super) decay_time_s: BandArray,
    pub(super) level: u32,
    pub(super) frames_since_update: u32,
    pub(super) updates: u64,
    /// How far the present graphics frame has got.
    pub(super) step: Step,
}

impl Extrapolator {
    /// For a scene; `min_distance_m` is the distance in metres below which a source gets no louder
    /// ([`crate::propagation::PropagationSettings::min_distance_m`]).
    pub fn new(scene: Arc<Scene>, kind: PredictorKind, min_distance_m: f32) -> Self {
        Self {
            scenes: ScenePair::of(&scene),
            continuation: PredictorState::of(kind),
            min_distance_m: f64::from(min_distance_m),
            current: PathSet::default(),
            groundwork: PreparedUpdate::default(),
            previous: PathSet::default(),
            older: Default::default(),
            matches: Vec::new(),
            shadowed: Vec::new(),
            late: Vec::new(),
            decay_time_s: [0.0; BANDS],
            level: 0,
            frames_since_update: 0,
            updates: 0,
            step: Step::default(),
        }
    }

    /// Takes the newest update and the level L of the interval that begins with it; gives an old set back whose memory
    /// may be used again.
    pub fn store_update(&mut self, update: PathSet, level: u32) -> PathSet {
        self.groundwork.clear();
        self.take(update, level)
    }

    /// The same with what has been worked out of the update, which takes less time for the same result; an old one comes
    /// back in its place.
    pub fn store_prepared_update(
        &mut self,
        update: PathSet,
        groundwork: &mut PreparedUpdate,
        level: u32,
    ) -> PathSet {
        std::mem::swap(&mut self.groundwork, groundwork);
        self.take(update, level)
    }

    fn take(&mut self, update: PathSet, level: u32) -> PathSet {
        self.begin_anew();
        let newest = std::mem::replace(&mut self.current, update);
        let previous = std::mem::replace(&mut self.previous, newest);
        let retired = match self.continuation.0 {
            Rule::PathByPath(_) => previous,
            Rule::Together(_) => {
                self.older.rotate_right(1);
                std::mem::replace(&mut self.older[0], previous)
            }
        };
        match_by_id(&self.current.paths, &self.previous.paths, &mut self.matches);
        self.level = level;
        self.frames_since_update = 0;
        self.updates += 1;
        self.scenes.update_is_of(&self.current.instances);
        retired
    }

    /// Moves the scene's instances, as they stand from the next frame on; those that the scene does not have are left
    /// out.
    pub fn set_instance_poses(&mut self, poses: &[InstancePose]) {
        self.scenes.stand_at(poses);
    }

    /// Goes on in a scene with other instances, whose paths are followed from the next update on; gives the old one
    /// back in its place. What is fixed must be the same: another scene is another extrapolator's.
    pub fn swap_scene(&mut self, scenes: &mut ScenePair) {
        self.begin_anew();
        std::mem::swap(&mut self.scenes, scenes);
    }

    /// Makes room for updates of this many paths and for this many sources, so that [`Self::store_update`] and
    /// [`Self::frame`] need not. Control side; allocates.
    pub fn reserve(&mut self, paths: usize, sources: usize) {
        self.matches.reserve(paths);
        self.shadowed.reserve(sources);
        self.late.reserve(sources);
        self.continuation.reserve(paths, sources);
    }

    /// Continues with another predictor from the next frame on; gives the old one back.
    pub fn set_predictor(&mut self, predictor: PredictorState) -> PredictorState {
        self.begin_anew();
        // Only one of the predictors keeps these up to date.
        for update in &mut self.older {
            update.late.clear();
        }
        std::mem::replace(&mut self.continuation, predictor)
    }

    /// The newest update taken.
    pub fn current(&self) -> &PathSet {
        &self.current
    }

    /// Leaves a graphics frame that is under way.
    fn begin_anew(&mut self) {
        self.step = Step::default();
        if let Rule::Together(best) = &mut self.continuation.0 {
            best.begin_anew();
        }
    }
}
