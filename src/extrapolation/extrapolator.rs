//! Follows paths from update to update and from graphics frame to graphics frame.

use std::sync::Arc;

use super::best::{Best, Groundwork, Now, late_now};
use super::frame::{FramePath, FramePaths, LateSend};
use super::hold::Hold;
use super::linear::Linear;
use super::posed::PosedScenes;
use super::predictor::{FrameContext, Predictor, PredictorKind, TrackedPath};
use super::tracking::match_by_id;
use crate::propagation::diffraction::{Spot, direct_field};
use crate::propagation::late::{common_decay, tail_steps};
use crate::propagation::{LateSource, Path, PathSet};
use crate::scene::edges::NearEdges;
use crate::scene::{InstancePose, ListenerPose, Scene, SourceId, SourcePose};

/// How paths are continued that are not part of the direct field.
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
/// [`Self::take_update`] and [`Self::frame`] allocate only while the number of paths or of sources exceeds everything
/// seen before and what [`Self::reserve`] was told.
pub struct Extrapolator {
    scenes: PosedScenes,
    continuation: Continuation,
    nearest_m: f64,
    current: PathSet,
    /// What has been worked out of it.
    groundwork: Groundwork,
    previous: PathSet,
    matches: Vec<Option<u32>>,
    /// Of each source of the present graphics frame whether the listener does not see it.
    shadowed: Vec<bool>,
    /// The late fields of the present graphics frame.
    late: Vec<LateSource>,
    level: u32,
    frames_since_update: u32,
    updates: u64,
}

impl Extrapolator {
    /// For a scene; `nearest_m` is the distance in metres below which a source gets no louder
    /// ([`crate::propagation::PropagationSettings::nearest_m`]).
    pub fn new(scene: Arc<Scene>, kind: PredictorKind, nearest_m: f32) -> Self {
        Self {
            scenes: PosedScenes::of(&scene),
            continuation: Continuation::of(kind),
            nearest_m: f64::from(nearest_m),
            current: PathSet::default(),
            groundwork: Groundwork::default(),
            previous: PathSet::default(),
            matches: Vec::new(),
            shadowed: Vec::new(),
            late: Vec::new(),
            level: 0,
            frames_since_update: 0,
            updates: 0,
        }
    }

    /// Takes the newest update and the level L of the interval that begins with it; gives an old set back whose memory
    /// may be used again.
    pub fn take_update(&mut self, update: PathSet, level: u32) -> PathSet {
        self.groundwork.clear();
        self.take(update, level)
    }

    /// The same with what has been worked out of the update, which takes less time for the same result; an old one comes
    /// back in its place.
    pub fn take_prepared_update(
        &mut self,
        update: PathSet,
        groundwork: &mut Groundwork,
        level: u32,
    ) -> PathSet {
        std::mem::swap(&mut self.groundwork, groundwork);
        self.take(update, level)
    }

    fn take(&mut self, update: PathSet, level: u32) -> PathSet {
        let newest = std::mem::replace(&mut self.current, update);
        let retired = std::mem::replace(&mut self.previous, newest);
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
    pub fn swap_scene(&mut self, scenes: &mut PosedScenes) {
        std::mem::swap(&mut self.scenes, scenes);
    }

    /// Makes room for updates of this many paths and for this many sources, so that [`Self::take_update`] and
    /// [`Self::frame`] need not. Control side; allocates.
    pub fn reserve(&mut self, paths: usize, sources: usize) {
        self.matches.reserve(paths);
        self.shadowed.reserve(sources);
        self.late.reserve(sources);
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
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        result: &mut FramePaths,
    ) -> u64 {
        let mut rays = 0;
        result.paths.clear();
        self.shadowed.clear();
        for pose in sources {
            let spot = Spot::of(pose, listener.position, self.nearest_m);
            let edges = self.direct_edges(&spot);
            let listed = edges.as_slice().iter().map(|found| found.edge);
            let field = direct_field(self.scenes.now(), &spot, listed, &mut rays, &mut |path| {
                result.paths.push(self.direct_now(&path, listener));
            });
            self.shadowed.push(!field.visible);
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
        let mut rays = self.continued_now(listener, sources, &mut result.paths);
        result.paths.sort_unstable_by_key(|path| path.id);
        result.orientation = listener.orientation;
        rays += self.late_now(listener, sources);
        result.decay_time_s = common_decay(&self.late);
        result.late.clear();
        let wanted = |late: &LateSource| {
            let own = sources.iter().find(|pose| pose.id == late.source);
            own.is_some_and(|pose| pose.settings.effects.late)
        };
        for late in self.late.iter().filter(|late| wanted(late)) {
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

    /// The edges that the last two updates name for a source, shortest way first: one of them was computed for a place
    /// before this one, the other, as it may be, for a place behind it.
    fn direct_edges(&self, spot: &Spot) -> NearEdges {
        let named = self.current.direct_edges.iter();
        let named = named
            .chain(&self.previous.direct_edges)
            .filter(|(id, _)| *id == spot.source.id)
            .map(|(_, edge)| *edge);
        let scene = self.scenes.now();
        let [from, to] = [spot.from, spot.to].map(|place| scene.to_local(place));
        scene.bends_over(named, from, to)
    }

    /// Adds the reflected paths, and the bent ones that are not part of the direct field; gives the number of rays cast.
    fn continued_now(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        paths: &mut Vec<FramePath>,
    ) -> u64 {
        let predictor = match &mut self.continuation.0 {
            Rule::PathByPath(predictor) => predictor,
            Rule::Together(best) => {
                let now = Now {
                    scene: self.scenes.now(),
                    then: self.scenes.then(),
                    listener,
                    sources,
                    shadowed: &self.shadowed,
                    nearest_m: self.nearest_m,
                };
                let is_new = self.updates > 0 && self.frames_since_update == 0;
                let rays = best.frame(
                    is_new.then_some((&self.current, &self.groundwork)),
                    &now,
                    paths,
                );
                // What a source has just been told to leave out is still remembered.
                if !sources.iter().all(|pose| pose.settings.effects.reflections) {
                    paths.retain(|path| path.order == 0 || reflects(sources, path.source));
                }
                return rays;
            }
        };
        let at = FrameContext {
            scene: self.scenes.now(),
            listener,
            frames_since_update: self.frames_since_update,
            level: self.level,
        };
        for (current, matched) in self.current.paths.iter().zip(&self.matches) {
            let exists = |surface: &u32| self.scenes.now().has_surface(*surface);
            let gone = !current.surfaces().iter().all(exists);
            if current.is_revalidated() || gone || !is_wanted(sources, current) {
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

    /// The late field of every source of the newest update: as that has it, or as it is by now. Gives the number of rays
    /// cast.
    fn late_now(&mut self, listener: &ListenerPose, sources: &[SourcePose]) -> u64 {
        self.late.clear();
        if let Rule::PathByPath(_) = self.continuation.0 {
            self.late.extend_from_slice(&self.current.late);
            return 0;
        }
        let now = Now {
            scene: self.scenes.now(),
            then: self.scenes.then(),
            listener,
            sources,
            shadowed: &self.shadowed,
            nearest_m: self.nearest_m,
        };
        let late = &mut self.late;
        late_now(&self.current, &self.previous, &now, |source| {
            late.push(source)
        })
    }

    fn direct_now(&self, path: &Path, listener: &ListenerPose) -> FramePath {
        FramePath {
            id: path.id,
            source: path.source,
            order: 0,
            amplitude: path.amplitude,
            delay_s: f64::from(path.length_m) / self.scenes.now().speed_of_sound_m_s(),
            // A source inside the head is heard straight ahead.
            arrival: (path.image - listener.position)
                .try_normalize()
                .unwrap_or_else(|| listener.orientation * glam::Vec3::NEG_Z),
        }
    }
}

/// Whether a path's source is there and may be heard that way: what a source has just been told to leave out is still
/// in the last update.
pub(super) fn is_wanted(sources: &[SourcePose], path: &Path) -> bool {
    sources.iter().any(|pose| {
        let effects = pose.settings.effects;
        pose.id == path.source
            && (path.order == 0 || effects.reflections)
            && (path.bends == 0 || effects.diffraction)
    })
}

/// Whether a source is there and its reflections are wanted.
fn reflects(sources: &[SourcePose], id: SourceId) -> bool {
    sources
        .iter()
        .any(|pose| pose.id == id && pose.settings.effects.reflections)
}
