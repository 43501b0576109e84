//! The predictor `best`: exact paths in some graphics frames ([`GeometricSettings::exact_every`]), extrapolated linearly in the
//! others, visibility by a few rays.
//!
//! Runs on the sound thread. Input: updates as they arrive; output: the reflected and diffracted paths of each graphics
//! frame, without those of the direct field. Bounded by the number of candidates and
//! [`GeometricSettings::rays_per_source`]; allocates only beyond the previous maximum and the reserved number of candidates.
//! Own, after measurements (docs/experiments/extrapolation.md): between two updates a stale delay causes the largest error,
//! then stale visibility, then the amplitude.
//!
//! - [`prepared_update`]: the work per update, on the propagation thread;
//! - [`update_dating`]: the graphics frame that an update describes;
//! - [`candidate_set`]: the candidates, merged with every update;
//! - [`candidate`], `frame_geometry`: a path in the present graphics frame; `source_poses`: its source;
//! - [`visibility_scheduler`]: the visibility tests of a graphics frame;
//! - `late_energy`: the late energy between two updates.

pub mod candidate;
pub mod candidate_set;
mod frame_geometry;
mod late_energy;
pub mod prepared_update;
pub mod settings;
mod source_poses;
pub mod update_dating;
pub mod visibility_scheduler;

use glam::Vec3;

use crate::extrapolation::frame::FramePath;
use crate::extrapolation::frame_effort::FrameEffort;
use crate::extrapolation::line_extrapolation::{ExtrapolationReach, FrameTime, PathEnds};
use crate::extrapolation::scene_pair::has_moved;
use crate::extrapolation::work_budget::{Progress, WorkBudget, cost};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffraction::{
    DiffractionSequence, MAX_REFLECTED_EDGE_PATHS, MAX_TWO_EDGE_PATHS,
};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::{PathSet, ReflectionEdge};
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

pub(crate) use crate::extrapolation::geometric::late_energy::extrapolate_late;
pub use crate::extrapolation::geometric::prepared_update::PreparedUpdate;
pub use crate::extrapolation::geometric::settings::{GeometricSettings, PredictionTarget};

use crate::extrapolation::geometric::candidate::{Candidate, PathGeometry};
use crate::extrapolation::geometric::candidate_set::CandidateSet;
use crate::extrapolation::geometric::frame_geometry::{FrameGeometry, GeometryArena};
pub(crate) use crate::extrapolation::geometric::source_poses::SourceShadow;
use crate::extrapolation::geometric::source_poses::{FrameSource, FrameSources};
use crate::extrapolation::geometric::update_dating::ListenerHistory;
use crate::extrapolation::geometric::visibility_scheduler::VisibilityScheduler;

/// Distance in metres between two graphics frames from which the past of all paths tells nothing: who moves is slower.
pub(super) const JUMP_M: f32 = 1.0;

/// The inputs of one graphics frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameInputs<'a> {
    pub(crate) scene: &'a Scene,
    /// The scene with the instance poses of the newest update.
    pub(crate) update_scene: &'a Scene,
    pub(crate) listener: &'a ListenerPose,
    pub(crate) sources: &'a [SourcePose],
    /// Time of the graphics frame in seconds.
    pub(crate) time_s: f64,
    /// What the direct field tells of each source.
    pub(crate) shadows: &'a [SourceShadow],
    pub(crate) min_distance_m: f64,
    /// [`PathSet::reflection_edges`] of the newest update.
    pub(crate) reflection_edges: &'a [(SourceId, ReflectionEdge)],
    /// Rays that have tested edges of the direct field in this frame.
    pub(crate) edge_rays: u64,
}

impl FrameInputs<'_> {
    /// A source and the listener, if the source exists and both positions are finite.
    fn endpoints(&self, source: SourceId) -> Option<Endpoints> {
        let pose = self.sources.iter().find(|pose| pose.id == source)?;
        let are_finite = pose.position.is_finite() && self.listener.position.is_finite();
        are_finite.then(|| Endpoints::of(pose, self.listener.position, self.min_distance_m))
    }

    fn shadow(&self, source: SourceId) -> SourceShadow {
        let mut each = self.sources.iter().zip(self.shadows);
        let found = each.find(|(pose, _)| pose.id == source);
        found.map_or(SourceShadow::default(), |(_, shadow)| *shadow)
    }
}

/// Progress of a graphics frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Begin,
    MergeUpdate,
    Evaluate,
    TestVisibility,
    /// Emits the paths of the candidates from this index on.
    Emit(usize),
}

/// State of the predictor.
#[derive(Debug)]
pub(crate) struct GeometricPredictor {
    settings: GeometricSettings,
    /// Of the next frame, and of this one.
    next_effort: FrameEffort,
    effort: FrameEffort,
    /// Whether instances have moved since the newest update.
    has_moved: bool,
    /// Whether earlier frames tell nothing of this one's paths: listener or sources were put elsewhere, or the listener has passed
    /// through a surface, where all that one hears changes at once.
    is_elsewhere: bool,
    set: CandidateSet,
    history: ListenerHistory,
    scheduler: VisibilityScheduler,
    sources: FrameSources,
    /// Geometry of each candidate in this frame.
    geometries: Vec<FrameGeometry>,
    arena: GeometryArena,
    /// Diffracted paths of this frame.
    diffracted: Vec<(DiffractionSequence, FramePath)>,
    /// Sources and surfaces of the single reflections of this frame.
    single_reflections: Vec<(u32, u32)>,
    frame: u64,
    step: Step,
}

impl GeometricPredictor {
    pub(crate) fn new(settings: GeometricSettings) -> Self {
        Self {
            settings,
            next_effort: FrameEffort::WHOLE,
            effort: FrameEffort::WHOLE,
            has_moved: false,
            is_elsewhere: false,
            set: CandidateSet::default(),
            history: ListenerHistory::default(),
            scheduler: VisibilityScheduler::default(),
            sources: FrameSources::default(),
            geometries: Vec::new(),
            arena: GeometryArena::default(),
            diffracted: Vec::new(),
            single_reflections: Vec::new(),
            frame: 0,
            step: Step::Begin,
        }
    }

    /// Limits the number of candidates and reserves capacity for them and for this many sources: [`Self::resume`] does not
    /// allocate.
    pub(crate) fn set_capacity(&mut self, candidates: usize, sources: usize) {
        self.set.set_capacity(candidates);
        self.scheduler.reserve(candidates);
        self.geometries.reserve(candidates);
        self.arena.reserve(candidates);
        self.diffracted.reserve(candidates);
        self.single_reflections.reserve(candidates);
        self.sources.reserve(sources);
    }

    /// The effort from the next frame on.
    pub(crate) fn set_effort(&mut self, effort: FrameEffort) {
        self.next_effort = effort;
    }

    /// See [`GeometricSettings::exact_every`]: at least 1, and more with less effort.
    fn exact_every(&self) -> u32 {
        self.next_effort.every(self.settings.exact_every.max(1))
    }

    /// How far paths of the next frame are extrapolated.
    pub(crate) fn next_reach(&self) -> ExtrapolationReach {
        ExtrapolationReach::of(self.exact_every(), self.next_effort.reach)
    }

    /// Resumes a graphics frame until the budget is spent and appends its paths to `paths`; `arrived` is the new update, if
    /// there is one.
    pub(crate) fn resume(
        &mut self,
        arrived: Option<(&PathSet, &PreparedUpdate)>,
        inputs: &FrameInputs<'_>,
        budget: &mut WorkBudget,
        paths: &mut Vec<FramePath>,
    ) -> Progress {
        let mut progress = Progress::default();
        if self.step == Step::Begin && !budget.is_spent() {
            progress.rays = self.begin(arrived, inputs);
            budget.spend(cost::RAY * progress.rays as usize);
            self.step = Step::MergeUpdate;
        }
        if self.step == Step::MergeUpdate
            && arrived.is_none_or(|arrived| self.set.merge_part(arrived, inputs, budget))
        {
            self.geometries.clear();
            self.arena.clear();
            self.step = Step::Evaluate;
        }
        if self.step == Step::Evaluate {
            self.evaluate(inputs, budget);
            if !budget.is_spent() {
                let count = inputs.sources.len();
                // What edges have had is not there for paths, of which half of the rays find nearly all.
                let whole = self.settings.rays(count);
                let left = whole.saturating_sub(inputs.edge_rays).max(whole / 2);
                let rays = self.effort.rays(left);
                let states = &self.set.states;
                let rays = (rays, self.is_elsewhere);
                self.scheduler
                    .begin(rays, self.frame, states, &self.geometries);
                budget.spend(states.len() / cost::QUEUED);
                self.step = Step::TestVisibility;
            }
        }
        if self.step == Step::TestVisibility {
            let (rays, is_done) = self.scheduler.resume(
                self.set.updates,
                (&mut self.set.candidates, &mut self.set.states),
                (&mut self.geometries, &mut self.arena),
                (inputs, &self.sources),
                budget,
            );
            progress.rays += rays;
            if is_done {
                self.diffracted.clear();
                self.single_reflections.clear();
                self.step = Step::Emit(0);
            }
        }
        if let Step::Emit(first) = self.step {
            self.step = self.emit(first, inputs, budget, paths);
            if self.step == Step::Begin {
                self.emit_loudest_diffracted(inputs.scene, paths);
                self.frame += 1;
                progress.is_done = true;
            }
        }
        progress
    }

    /// Discards the progress of a graphics frame.
    pub(crate) fn restart_frame(&mut self) {
        self.step = Step::Begin;
    }

    /// Begins a graphics frame, and the merge of a new update; returns the number of rays cast.
    fn begin(
        &mut self,
        arrived: Option<(&PathSet, &PreparedUpdate)>,
        inputs: &FrameInputs<'_>,
    ) -> u64 {
        self.effort = self.next_effort;
        self.has_moved = has_moved(inputs.scene, inputs.update_scene);
        let listener = inputs.listener.position;
        let is_far = |a: Vec3, b: Vec3| a.distance_squared(b) > JUMP_M * JUMP_M;
        let mut rays = 0;
        let listener_jumped = self.history.last().is_some_and(|last| {
            is_far(last, listener) || passes_surface(inputs.scene, [last, listener], &mut rays)
        });
        self.history.push(listener);
        let source_jumped = self.sources.update(inputs, self.next_reach(), is_far);
        self.is_elsewhere = listener_jumped || source_jumped;
        if self.is_elsewhere {
            let sources = &self.sources;
            self.set.forget_past(self.frame, |source| {
                listener_jumped || sources.get(source).is_some_and(|source| source.has_jumped)
            });
        }
        if let Some((update, _)) = arrived {
            let mut epoch = self.history.date(update.listener.position, self.frame);
            // The listener's position does not date an update if instances have moved since.
            epoch.is_reached &= !self.has_moved;
            self.set.begin_update(self.frame, epoch);
        }
        rays
    }

    /// Evaluates or extrapolates the visible candidates; the visibility tests evaluate blocked ones.
    fn evaluate(&mut self, inputs: &FrameInputs<'_>, budget: &mut WorkBudget) {
        let turn = (self.frame, self.exact_every());
        // Only the amplitudes of reflections are then extrapolated.
        let has_exact_points = self.effort.is_far() || self.has_moved;
        let set = &mut self.set;
        let each = set.candidates.iter().zip(&set.lines).zip(&mut set.states);
        for ((candidate, line), state) in each.skip(self.geometries.len()) {
            if budget.is_spent() {
                return;
            }
            if !state.is_visible {
                self.geometries.push(FrameGeometry::Unevaluated);
                continue;
            }
            let line = line
                .as_ref()
                .filter(|_| !(has_exact_points && state.is_reflection));
            let extrapolated = line.and_then(|line| {
                candidate.extrapolated((state, line), inputs, &self.sources, turn, &mut self.arena)
            });
            let mut geometry = extrapolated.unwrap_or_else(|| {
                let source = self.sources.get(candidate.source);
                candidate.evaluate(inputs, source, &mut self.arena)
            });
            if geometry == FrameGeometry::Unfolded {
                geometry = self.arena.push_unfolded(inputs.scene);
            }
            budget.spend(geometry.cost());
            // Tested soon after its points are on their surfaces again.
            if geometry == FrameGeometry::Invalid && state.is_reflection {
                state.tested = None;
            }
            self.geometries.push(geometry);
        }
    }

    /// Emits the paths of the visible candidates from `first` on.
    fn emit(
        &mut self,
        first: usize,
        inputs: &FrameInputs<'_>,
        budget: &mut WorkBudget,
        paths: &mut Vec<FramePath>,
    ) -> Step {
        let time = FrameTime {
            frame: self.frame,
            time_s: inputs.time_s,
        };
        let every = self.exact_every();
        let set = &mut self.set;
        let each = set.candidates.iter().zip(&mut set.lines);
        let each = each.zip(&mut set.states).zip(&self.geometries);
        for (index, (((candidate, line), state), &geometry)) in each.enumerate().skip(first) {
            if geometry == FrameGeometry::Unevaluated || !state.is_visible {
                continue;
            }
            if geometry == FrameGeometry::Invalid {
                *line = None;
                continue;
            }
            if budget.is_spent() {
                return Step::Emit(index);
            }
            budget.spend(cost::EMITTED);
            let id = match line {
                Some(line) => line.source(),
                None => candidate.source,
            };
            let Some(source) = self.sources.get(id) else {
                continue;
            };
            let now = (time, PathEnds::of(&source.endpoints, inputs.scene));
            let path = if geometry.is_extrapolated() {
                let line = line.as_ref();
                line.and_then(|line| line.ahead(now, source.reach))
            } else {
                let amplitude = match (geometry, line.as_ref()) {
                    (FrameGeometry::Image(_), Some(line)) => line
                        .ahead(now, source.reach)
                        .filter(|_| line.spans(time.frame, every.into(), source.reach))
                        .map(|path| path.amplitude),
                    _ => None,
                };
                budget.spend(match amplitude {
                    Some(_) => cost::CONTINUED,
                    None => emission_cost(geometry, candidate, source, inputs),
                });
                let own = (&self.arena, amplitude);
                let path = candidate.frame_path(geometry, inputs, source, own);
                if every > 1 && amplitude.is_none() {
                    let sides = self.arena.sides(geometry, inputs.scene);
                    *line = candidate.line((path.as_ref(), sides), line.as_ref(), (now, every));
                }
                path
            };
            let Some(path) = path.filter(|path| source.allows(path)) else {
                continue;
            };
            state.record_amplitude(&path.amplitude);
            match candidate.geometry {
                _ if state.is_reflection && path.order > 1 => paths.push(path),
                PathGeometry::Diffraction(sequence) => {
                    self.diffracted.push((sequence, path));
                }
                PathGeometry::Reflection(_) | PathGeometry::Curved(_) | PathGeometry::Unknown => {
                    if let [surface] = candidate.path.surfaces() {
                        let named = inputs.scene.naming_surface(*surface);
                        let single = (candidate.source.bits(), named);
                        self.single_reflections.push(single);
                    }
                    paths.push(path);
                }
            }
        }
        Step::Begin
    }

    /// Emits the loudest diffracted paths of each source, up to the limits of an update, without those that are part of a
    /// reflection.
    fn emit_loudest_diffracted(&mut self, scene: &Scene, paths: &mut Vec<FramePath>) {
        self.single_reflections.sort_unstable();
        let reflections = &self.single_reflections;
        self.diffracted.retain(|(sequence, path)| {
            let surface = sequence.continued_reflection();
            let is_part = |surface| {
                let single = (path.source.bits(), scene.naming_surface(surface));
                reflections.binary_search(&single).is_ok()
            };
            !surface.is_some_and(is_part)
        });
        let group = |(sequence, path): &(DiffractionSequence, FramePath)| {
            (path.source.bits(), sequence.has_two_edges())
        };
        self.diffracted.sort_unstable_by(|a, b| {
            let louder = b.1.energy().total_cmp(&a.1.energy());
            group(a)
                .cmp(&group(b))
                .then(louder)
                .then(a.1.id.cmp(&b.1.id))
        });
        for same in self.diffracted.chunk_by(|a, b| group(a) == group(b)) {
            let most = match same[0].0.has_two_edges() {
                true => MAX_TWO_EDGE_PATHS,
                false => MAX_REFLECTED_EDGE_PATHS,
            };
            paths.extend(same.iter().take(most).map(|(_, path)| *path));
        }
    }
}

/// Whether a listener who moves from one position to the other passes through a surface.
fn passes_surface(scene: &Scene, [from, to]: [Vec3; 2], rays: &mut u64) -> bool {
    if from == to {
        return false;
    }
    *rays += 1;
    let [from, to] = [from, to].map(|position| scene.to_local(position).as_vec3());
    scene.any_hit(&Ray::between(from, to), [NO_GROUP; 2])
}

/// Cost of the amplitude of a candidate that was evaluated in this frame.
fn emission_cost(
    geometry: FrameGeometry,
    candidate: &Candidate,
    source: &FrameSource,
    inputs: &FrameInputs<'_>,
) -> usize {
    match (geometry, &candidate.geometry) {
        (FrameGeometry::Diffracted(_), PathGeometry::Diffraction(sequence))
            if sequence.has_two_edges() =>
        {
            2 * cost::WAVE
        }
        (FrameGeometry::Diffracted(_), _) => cost::WAVE,
        (FrameGeometry::Image(_), _) if candidate.path.order == 1 => {
            let edges = source.reflection_edges(inputs);
            let surface = candidate.path.surfaces[0];
            let own = edges.filter(|edge| edge.is_beside(inputs.scene, surface));
            cost::REFLECTED + cost::WAVE * own.count()
        }
        (FrameGeometry::Image(_), _) => cost::REFLECTED,
        _ => 0,
    }
}
