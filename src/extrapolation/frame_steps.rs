//! One graphics frame of extrapolation, whole or in parts.
//!
//! Audio side. First the direct paths, source by source, then everything else; each part ends when its effort is spent
//! and the next one goes on from there. Where a frame is cut changes none of its bits.

use super::extrapolator::{Extrapolator, Rule};
use super::frame::{FramePath, FramePaths, LateSend};
use super::predictor::{FrameContext, TrackedPath};
use crate::extrapolation::geometric::{Now, late_now};
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::propagation::diffraction::{Endpoints, direct_field};
use crate::propagation::diffuse::{common_decay, late_segments};
use crate::propagation::{LateEnergy, Path};
use crate::scene::edges::DiffractingEdges;
use crate::scene::{ListenerPose, SourceId, SourcePose};

/// How far a graphics frame has got.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// Direct paths of the sources from this one on.
    Direct(usize),
    /// Everything else, from this path of the newest update on where each is continued by itself.
    Continued(usize),
    /// What concerns all paths together, and the late field.
    Together,
}

impl Default for Step {
    /// A new frame.
    fn default() -> Self {
        Self::Direct(0)
    }
}

/// What came of a part of a graphics frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Rays cast.
    pub rays: u64,
    /// Whether nothing is left to do.
    pub is_done: bool,
}

impl Extrapolator {
    /// Describes the graphics frame with these poses; the next call describes the next frame. Gives the number of rays
    /// cast. Before the first update there are direct paths only.
    pub fn frame(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        result: &mut FramePaths,
    ) -> u64 {
        let effort = &mut WorkBudget::boundless();
        let direct = self.direct_part(listener, sources, effort, result);
        direct.rays + self.other_part(listener, sources, effort, result).rays
    }

    /// Goes on with the direct paths of a graphics frame until the effort is spent. Until the frame is done
    /// ([`Self::other_part`]) poses and result have to be the same and updates, scenes and predictors have to wait: taken
    /// in between they begin the frame anew.
    pub fn direct_part(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        effort: &mut WorkBudget,
        result: &mut FramePaths,
    ) -> Part {
        let mut rays = 0;
        let Step::Direct(first) = self.step else {
            return Part {
                rays,
                is_done: true,
            };
        };
        if first == 0 {
            result.paths.clear();
            self.shadowed.clear();
        }
        for (number, pose) in sources.iter().enumerate().skip(first) {
            if effort.is_spent() {
                self.step = Step::Direct(number);
                return Part {
                    rays,
                    is_done: false,
                };
            }
            let (before, mut own) = (result.paths.len(), 0);
            let spot = Endpoints::of(pose, listener.position, self.min_distance_m);
            let edges = self.direct_edges(&spot);
            let listed = edges.as_slice().iter().map(|found| found.edge);
            let field = direct_field(self.scenes.now(), &spot, listed, &mut own, &mut |path| {
                result.paths.push(self.direct_now(&path, listener));
            });
            self.shadowed.push(!field.visible);
            let waves = field
                .edges
                .as_slice()
                .len()
                .max(result.paths.len() - before);
            effort.spend(cost::DIRECT + cost::RAY * own as usize + cost::WAVE * waves);
            rays += own;
        }
        self.step = Step::Continued(0);
        Part {
            rays,
            is_done: true,
        }
    }

    /// Goes on with everything but direct paths until the effort is spent, once those are done, for the same poses.
    pub fn other_part(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        effort: &mut WorkBudget,
        result: &mut FramePaths,
    ) -> Part {
        let mut part = match self.step {
            Step::Direct(_) => Part {
                rays: 0,
                is_done: false,
            },
            Step::Continued(first) => {
                self.continued_part(listener, sources, first, effort, &mut result.paths)
            }
            Step::Together => Part {
                rays: 0,
                is_done: true,
            },
        };
        if !part.is_done {
            return part;
        }
        if effort.is_spent() {
            self.step = Step::Together;
            part.is_done = false;
            return part;
        }
        effort.spend(result.paths.len() / cost::SORTED + cost::LATE * self.current.late.len());
        result.paths.sort_unstable_by_key(|path| path.id);
        result.orientation = listener.orientation;
        part.rays += self.late_now(listener, sources);
        let decay_time_s = common_decay(&self.late);
        for (known, new) in self.decay_time_s.iter_mut().zip(decay_time_s) {
            // Where nothing is heard of any tail, what is left of one decays as before.
            *known = if new > 0.0 { new } else { *known };
        }
        result.decay_time_s = self.decay_time_s;
        result.late.clear();
        let wanted = |late: &LateEnergy| {
            let own = sources.iter().find(|pose| pose.id == late.source);
            own.is_some_and(|pose| pose.settings.effects.late)
        };
        for late in self.late.iter().filter(|late| wanted(late)) {
            let steps = late_segments(late, &result.decay_time_s);
            result.late.extend(steps.map(|step| LateSend {
                source: late.source,
                energy_per_s: step.energy_per_s,
                start_s: step.start_s,
            }));
        }
        self.frames_since_update = self.frames_since_update.saturating_add(1);
        self.step = Step::default();
        part
    }

    /// The edges that the last two updates name for a source, shortest way first: one of them was computed for a place
    /// before this one, the other, as it may be, for a place behind it.
    fn direct_edges(&self, spot: &Endpoints) -> DiffractingEdges {
        let named = self.current.direct_edges.iter();
        let named = named
            .chain(&self.previous.direct_edges)
            .filter(|(id, _)| *id == spot.source.id)
            .map(|(_, edge)| *edge);
        let scene = self.scenes.now();
        let [from, to] = [spot.from, spot.to].map(|place| scene.to_local(place));
        scene.diffracting_edges_over(named, from, to)
    }

    /// Adds the reflected paths, and the bent ones that are not part of the direct field.
    fn continued_part(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        first: usize,
        effort: &mut WorkBudget,
        paths: &mut Vec<FramePath>,
    ) -> Part {
        let predictor = match &mut self.continuation.0 {
            Rule::PathByPath(predictor) => predictor,
            Rule::Together(best) => {
                let now = Now {
                    scene: self.scenes.now(),
                    then: self.scenes.then(),
                    listener,
                    sources,
                    shadowed: &self.shadowed,
                    min_distance_m: self.min_distance_m,
                };
                let is_new = self.updates > 0 && self.frames_since_update == 0;
                let arrived = is_new.then_some((&self.current, &self.groundwork));
                let part = best.part(arrived, &now, effort, paths);
                // What a source has just been told to leave out is still remembered.
                if part.is_done && !sources.iter().all(|pose| pose.settings.effects.reflections) {
                    paths.retain(|path| path.order == 0 || reflects(sources, path.source));
                }
                return part;
            }
        };
        let at = FrameContext {
            scene: self.scenes.now(),
            listener,
            frames_since_update: self.frames_since_update,
            level: self.level,
        };
        let each = self.current.paths.iter().zip(&self.matches);
        for (number, (current, matched)) in each.enumerate().skip(first) {
            if effort.is_spent() {
                self.step = Step::Continued(number);
                return Part {
                    rays: 0,
                    is_done: false,
                };
            }
            effort.spend(cost::CONTINUED);
            let exists = |surface: &u32| self.scenes.now().has_surface(*surface);
            let gone = !current.surfaces().iter().all(exists);
            if current.is_frame_validated() || gone || !is_wanted(sources, current) {
                continue;
            }
            let tracked = TrackedPath {
                current,
                previous: matched.map(|i| &self.previous.paths[i as usize]),
                listener: &self.current.listener,
            };
            paths.push(predictor.predict(&tracked, &at));
        }
        Part {
            rays: 0,
            is_done: true,
        }
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
            min_distance_m: self.min_distance_m,
        };
        let late = &mut self.late;
        let updates = [&self.current, &self.previous].into_iter();
        late_now(updates.chain(&self.older), &now, |source| late.push(source))
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
            && (path.diffraction_order == 0 || effects.diffraction)
    })
}

/// Whether a source is there and its reflections are wanted.
fn reflects(sources: &[SourcePose], id: SourceId) -> bool {
    sources
        .iter()
        .any(|pose| pose.id == id && pose.settings.effects.reflections)
}
