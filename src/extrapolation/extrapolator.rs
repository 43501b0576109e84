//! Follows paths from update to update and from graphics frame to graphics frame.

use std::sync::Arc;

use super::best::{Best, Now};
use super::frame::{FramePath, FramePaths, LateSend};
use super::hold::Hold;
use super::linear::Linear;
use super::predictor::{FrameContext, Predictor, PredictorKind, TrackedPath};
use super::tracking::match_by_id;
use crate::propagation::direct::direct_path_of;
use crate::propagation::late::{common_decay, tail_steps};
use crate::propagation::{LateSource, Path, PathSet};
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

/// How reflected paths are continued.
enum Rule {
    /// Each path of the newest update by itself.
    PathByPath(Box<dyn Predictor>),
    /// Paths of several updates, together.
    Together(Box<Best>),
}

/// A predictor at work, with what it remembers. Made on the control side; the audio side only swaps it.
pub struct Continuation(Rule);

impl Continuation {
    /// A predictor of this kind. Control side; allocates.
    pub fn of(kind: PredictorKind) -> Self {
        Self(match kind {
            PredictorKind::Hold => Rule::PathByPath(Box::new(Hold)),
            PredictorKind::Linear => Rule::PathByPath(Box::new(Linear)),
            PredictorKind::Best(settings) => Rule::Together(Box::new(Best::new(settings))),
        })
    }

    /// The same with room for updates of this many paths, so that the audio side need not allocate.
    pub fn with_room(kind: PredictorKind, paths: usize) -> Self {
        let mut continuation = Self::of(kind);
        if let Rule::Together(best) = &mut continuation.0 {
            best.bound(CANDIDATES_A_PATH * paths);
        }
        continuation
    }

    /// Most paths of a graphics frame besides direct ones, if updates have this many.
    pub const fn most_paths(paths: usize) -> usize {
        CANDIDATES_A_PATH * paths
    }
}

/// Candidates that [`PredictorKind::Best`] may keep for each path that an update may have.
const CANDIDATES_A_PATH: usize = 3;

/// The extrapolation stage's state. Owned by the sound thread.
///
/// # Real-time
/// [`Self::take_update`] and [`Self::frame`] allocate only while the number of paths exceeds everything seen before.
pub struct Extrapolator {
    scene: Arc<Scene>,
    continuation: Continuation,
    nearest_m: f64,
    current: PathSet,
    previous: PathSet,
    matches: Vec<Option<u32>>,
    level: u32,
    frames_since_update: u32,
    updates: u64,
}

impl Extrapolator {
    /// For a scene; `nearest_m` is the distance in metres below which a source gets no louder
    /// ([`crate::propagation::PropagationSettings::nearest_m`]).
    pub fn new(scene: Arc<Scene>, kind: PredictorKind, nearest_m: f32) -> Self {
        Self {
            scene,
            continuation: Continuation::of(kind),
            nearest_m: f64::from(nearest_m),
            current: PathSet::default(),
            previous: PathSet::default(),
            matches: Vec::new(),
            level: 0,
            frames_since_update: 0,
            updates: 0,
        }
    }

    /// Takes the newest update and the level L of the interval that begins with it; gives an old set back whose memory
    /// may be used again.
    pub fn take_update(&mut self, update: PathSet, level: u32) -> PathSet {
        let newest = std::mem::replace(&mut self.current, update);
        let retired = std::mem::replace(&mut self.previous, newest);
        match_by_id(&self.current.paths, &self.previous.paths, &mut self.matches);
        self.level = level;
        self.frames_since_update = 0;
        self.updates += 1;
        retired
    }

    /// Makes room for updates of this many paths, so that [`Self::take_update`] and [`Self::frame`] need not. Control
    /// side; allocates.
    pub fn reserve(&mut self, paths: usize) {
        self.matches.reserve(paths);
        if let Rule::Together(best) = &mut self.continuation.0 {
            best.bound(CANDIDATES_A_PATH * paths);
        }
    }

    /// Continues with another predictor from the next frame on; gives the old one back.
    pub fn set_predictor(&mut self, predictor: Continuation) -> Continuation {
        std::mem::replace(&mut self.continuation, predictor)
    }

    /// The newest update taken.
    pub fn current(&self) -> &PathSet {
        &self.current
    }

    /// Describes the graphics frame with these poses; the next call describes the next frame. Gives the number of rays
    /// cast. Before the first update there are direct paths only.
    pub fn frame(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        result: &mut FramePaths,
    ) -> u64 {
        self.begin_frame(listener, sources, result) + self.finish_frame(listener, sources, result)
    }

    /// The first half of [`Self::frame`]: the direct paths. Gives the number of rays cast.
    pub fn begin_frame(
        &self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        result: &mut FramePaths,
    ) -> u64 {
        let mut rays = 0;
        result.paths.clear();
        for pose in sources {
            let to = listener.position;
            let direct = direct_path_of(&self.scene, pose, to, self.nearest_m, &mut rays);
            result
                .paths
                .extend(direct.map(|path| self.direct_now(&path, listener)));
        }
        rays
    }

    /// The second half, for the same poses: everything else. Gives the number of rays cast.
    pub fn finish_frame(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        result: &mut FramePaths,
    ) -> u64 {
        let rays = self.reflected_now(listener, sources, &mut result.paths);
        result.paths.sort_unstable_by_key(|path| path.id);
        result.orientation = listener.orientation;
        result.decay_time_s = common_decay(&self.current.late);
        result.late.clear();
        let wanted = |late: &LateSource| {
            let own = sources.iter().find(|pose| pose.id == late.source);
            own.is_some_and(|pose| pose.settings.effects.late)
        };
        for late in self.current.late.iter().filter(|late| wanted(late)) {
            let steps = tail_steps(late, &result.decay_time_s);
            result.late.extend(steps.map(|step| LateSend {
                source: late.source,
                energy_per_s: step.energy_per_s,
                start_s: step.start_s,
            }));
        }
        self.frames_since_update = self.frames_since_update.saturating_add(1);
        rays
    }

    /// Adds the reflected paths; gives the number of rays cast.
    fn reflected_now(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        paths: &mut Vec<FramePath>,
    ) -> u64 {
        let predictor = match &mut self.continuation.0 {
            Rule::PathByPath(predictor) => predictor,
            Rule::Together(best) => {
                let now = Now {
                    scene: &self.scene,
                    listener,
                    sources,
                    nearest_m: self.nearest_m,
                };
                let is_new = self.updates > 0 && self.frames_since_update == 0;
                let rays = best.frame(is_new.then_some(&self.current), &now, paths);
                // What a source has just been told to leave out is still remembered.
                if !sources.iter().all(|pose| pose.settings.effects.reflections) {
                    paths.retain(|path| path.order == 0 || reflects(sources, path.source));
                }
                return rays;
            }
        };
        let at = FrameContext {
            scene: &self.scene,
            listener,
            frames_since_update: self.frames_since_update,
            level: self.level,
        };
        for (current, matched) in self.current.paths.iter().zip(&self.matches) {
            if current.is_direct() || !reflects(sources, current.source) {
                continue;
            }
            let tracked = TrackedPath {
                current,
                previous: matched.map(|i| &self.previous.paths[i as usize]),
                listener: &self.current.listener,
            };
            paths.push(predictor.predict(&tracked, &at));
        }
        0
    }

    fn direct_now(&self, path: &Path, listener: &ListenerPose) -> FramePath {
        FramePath {
            id: path.id,
            source: path.source,
            order: 0,
            amplitude: path.amplitude,
            delay_s: f64::from(path.length_m) / self.scene.speed_of_sound_m_s(),
            // A source inside the head is heard straight ahead.
            arrival: (path.image - listener.position)
                .try_normalize()
                .unwrap_or_else(|| listener.orientation * glam::Vec3::NEG_Z),
        }
    }
}

/// Whether a source is there and its reflections are wanted.
fn reflects(sources: &[SourcePose], id: SourceId) -> bool {
    sources
        .iter()
        .any(|pose| pose.id == id && pose.settings.effects.reflections)
}
