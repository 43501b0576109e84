//! The predictor `best`: exact geometry in every graphics frame, visibility by a few rays.
//!
//! Runs on the sound thread. Takes updates as they arrive, gives the reflected and bent paths of each graphics frame
//! (less the direct field's, which every predictor has anew). Bounded by
//! the number of candidates and by [`GeometricSettings::rays_per_source`]; allocates only while there are more candidates
//! than ever before, and not at all once bounded. Own work, after the measurements that ARCHITECTURE.md tells of: between two updates the stale delay
//! of a path does the most harm, its stale visibility comes second, its amplitude last.
//!
//! - [`candidate`]: one path as it stands now, from its surfaces and today's poses;
//! - `standing`: how each stands in a graphics frame, `places`: where its source is then;
//! - [`groundwork`]: what can be worked out about an update before it is taken;
//! - [`memory`]: candidates from update to update, and whose word on visibility counts;
//! - [`history`]: where the listener was, so that an update's word can be dated;
//! - [`rays`]: which candidates are asked whether something blocks them;
//! - `tail`: the late field between two updates;
//! - [`trend`]: paths between the frames that work them out.

pub mod candidate;
pub mod candidate_set;
mod frame_geometry;
mod late_energy;
pub mod line_extrapolation;
pub mod prepared_update;
pub mod settings;
mod source_poses;
pub mod update_dating;
pub mod visibility_scheduler;

use crate::extrapolation::frame::FramePath;
use crate::extrapolation::frame_steps::Part;
use crate::extrapolation::scene_pair::has_moved;
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::propagation::PathSet;
use crate::propagation::diffraction::{Endpoints, MAX_REFLECTED_EDGE_PATHS, MAX_TWO_EDGE_PATHS};
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

pub(crate) use crate::extrapolation::geometric::late_energy::late_now;
pub use crate::extrapolation::geometric::prepared_update::PreparedUpdate;
pub use crate::extrapolation::geometric::settings::{GeometricSettings, PredictionTarget};

use crate::extrapolation::geometric::candidate::Course;
use crate::extrapolation::geometric::candidate_set::Memory;
use crate::extrapolation::geometric::frame_geometry::{Shapes, Standing};
use crate::extrapolation::geometric::source_poses::Places;
use crate::extrapolation::geometric::update_dating::History;
use crate::extrapolation::geometric::visibility_scheduler::Inspection;

/// What one graphics frame is asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Now<'a> {
    pub(crate) scene: &'a Scene,
    /// The scene as it stood for the newest update.
    pub(crate) then: &'a Scene,
    pub(crate) listener: &'a ListenerPose,
    pub(crate) sources: &'a [SourcePose],
    /// Of each source whether the listener does not see it.
    pub(crate) shadowed: &'a [bool],
    pub(crate) min_distance_m: f64,
}

impl Now<'_> {
    /// A source and the listener as they are, if the source is still there and both are somewhere.
    fn spot(&self, source: SourceId) -> Option<Endpoints> {
        let pose = self.sources.iter().find(|pose| pose.id == source)?;
        let are_places = pose.position.is_finite() && self.listener.position.is_finite();
        are_places.then(|| Endpoints::of(pose, self.listener.position, self.min_distance_m))
    }

    fn is_shadowed(&self, source: SourceId) -> bool {
        let mut each = self.sources.iter().zip(self.shadowed);
        each.any(|(pose, shadowed)| pose.id == source && *shadowed)
    }
}

/// How far a graphics frame has got.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Begin,
    /// Takes an update over.
    Take,
    /// How candidates stand.
    Stand,
    /// Rays for them.
    Ask,
    /// What is heard of the candidates from this one on.
    Hear(usize),
}

/// State of the predictor.
#[derive(Debug)]
pub(crate) struct GeometricPredictor {
    settings: GeometricSettings,
    memory: Memory,
    history: History,
    inspection: Inspection,
    /// Where the sources are in this frame.
    places: Places,
    /// How candidates stand, and what that tells of.
    standings: Vec<Standing>,
    shapes: Shapes,
    /// Bent paths that may be heard in this frame, and whether they bend twice.
    bent: Vec<(bool, FramePath)>,
    frame: u64,
    step: Step,
}

impl GeometricPredictor {
    pub(crate) fn new(settings: GeometricSettings) -> Self {
        Self {
            settings,
            memory: Memory::default(),
            history: History::default(),
            inspection: Inspection::default(),
            places: Places::default(),
            standings: Vec::new(),
            shapes: Shapes::default(),
            bent: Vec::new(),
            frame: 0,
            step: Step::Begin,
        }
    }

    /// Makes room for this many candidates and keeps to it, and for this many sources, so that [`Self::part`] allocates
    /// nothing.
    pub(crate) fn bound(&mut self, candidates: usize, sources: usize) {
        self.memory.bound(candidates);
        self.inspection.reserve(candidates);
        self.standings.reserve(candidates);
        self.shapes.reserve(candidates);
        self.bent.reserve(candidates);
        self.places.reserve(sources);
    }

    /// Goes on until the effort is spent, and adds the paths of a graphics frame to `paths` that are not part of the direct
    /// field; `arrived` is the update that is used from this frame on, if there is one, with what has been worked out of
    /// it.
    pub(crate) fn part(
        &mut self,
        arrived: Option<(&PathSet, &PreparedUpdate)>,
        now: &Now<'_>,
        effort: &mut WorkBudget,
        paths: &mut Vec<FramePath>,
    ) -> Part {
        let mut part = Part {
            rays: 0,
            is_done: false,
        };
        if self.step == Step::Begin && !effort.is_spent() {
            self.begin(arrived, now);
            self.step = Step::Take;
        }
        if self.step == Step::Take && self.take(arrived, now, effort) {
            self.standings.clear();
            self.shapes.clear();
            self.step = Step::Stand;
        }
        if self.step == Step::Stand {
            self.stand(now, effort);
            if !effort.is_spent() {
                self.make_queue(now, effort);
                self.step = Step::Ask;
            }
        }
        if self.step == Step::Ask {
            let (rays, is_done) = self.ask(now, effort);
            part.rays = rays;
            if is_done {
                self.bent.clear();
                self.step = Step::Hear(0);
            }
        }
        if let Step::Hear(first) = self.step {
            self.step = self.hear(first, now, effort, paths);
            if self.step == Step::Begin {
                self.keep_loudest_bent(paths);
                self.frame += 1;
                part.is_done = true;
            }
        }
        part
    }

    /// Leaves a graphics frame that is under way.
    pub(crate) fn begin_anew(&mut self) {
        self.step = Step::Begin;
    }

    /// Begins a graphics frame, and an update if one has arrived.
    fn begin(&mut self, arrived: Option<(&PathSet, &PreparedUpdate)>, now: &Now<'_>) {
        self.history.push(now.listener.position);
        self.places.look(now);
        if let Some((update, _)) = arrived {
            let mut word = self.history.date(update.listener.position, self.frame);
            // The listener's place does not date an update of a scene that has moved since.
            word.binding &= !has_moved(now.scene, now.then);
            self.memory.begin_update(self.frame, word);
        }
    }

    /// Goes on taking over the update that has arrived, if one has; gives whether it is taken over.
    fn take(
        &mut self,
        arrived: Option<(&PathSet, &PreparedUpdate)>,
        now: &Now<'_>,
        effort: &mut WorkBudget,
    ) -> bool {
        arrived.is_none_or(|arrived| {
            let settings = &self.settings;
            self.memory.take_part(arrived, now, settings, effort)
        })
    }

    /// How candidates stand. Of what is closed only what rays are cast for has to be known.
    fn stand(&mut self, now: &Now<'_>, effort: &mut WorkBudget) {
        let every = self.settings.exact_every.max(1);
        let memory = &mut self.memory;
        let each = memory.candidates.iter().zip(&mut memory.marks);
        for (candidate, mark) in each.skip(self.standings.len()) {
            if effort.is_spent() {
                return;
            }
            // Most are closed, and nothing is written of them but that.
            if !mark.open {
                self.standings.push(Standing::Unasked);
                continue;
            }
            let place = self.places.of(candidate.path.source);
            let continued = match every > 1 {
                true => candidate.continued(now, place, (self.frame, every)),
                false => None,
            };
            let shapes = &mut self.shapes;
            let mut standing = match continued {
                Some(path) => shapes.continued(path),
                None => candidate.stand(now, place, &self.settings, shapes),
            };
            if standing == Standing::Legs {
                standing = shapes.finish(now.scene);
            }
            effort.spend(standing.cost());
            // What comes back onto its surfaces is asked soon.
            if let (Standing::Out, Course::Mirrors(_)) = (standing, candidate.course) {
                mark.tested = None;
            }
            self.standings.push(standing);
        }
    }

    /// Puts in order whom the frame's rays are for.
    fn make_queue(&mut self, now: &Now<'_>, effort: &mut WorkBudget) {
        let budget = self.settings.rays(now.sources.len());
        let marks = &self.memory.marks;
        self.inspection
            .begin(budget, self.frame, marks, &self.standings);
        effort.spend(marks.len() / cost::SORTED);
    }

    /// Casts the frame's rays until the effort is spent; gives their number, and whether all are cast.
    fn ask(&mut self, now: &Now<'_>, effort: &mut WorkBudget) -> (u64, bool) {
        self.inspection.go_on(
            self.memory.updates,
            (&mut self.memory.candidates, &mut self.memory.marks),
            (&mut self.standings, &mut self.shapes),
            (now, &self.places, &self.settings),
            effort,
        )
    }

    /// What is heard of the candidates from one on.
    fn hear(
        &mut self,
        first: usize,
        now: &Now<'_>,
        effort: &mut WorkBudget,
        paths: &mut Vec<FramePath>,
    ) -> Step {
        let every = self.settings.exact_every.max(1);
        let marks = self.memory.marks.iter_mut();
        let each = marks.zip(&mut self.memory.candidates);
        let each = each.zip(&self.standings);
        for (number, ((mark, candidate), &standing)) in each.enumerate().skip(first) {
            // Whoever was not asked is closed.
            if standing == Standing::Unasked || !mark.open {
                continue;
            }
            let place = self.places.of(candidate.path.source);
            let Some(place) = place.filter(|place| place.wants(&candidate.path)) else {
                continue;
            };
            if effort.is_spent() {
                return Step::Hear(number);
            }
            effort.spend(cost::HEARD);
            effort.spend(match (standing, candidate.course) {
                (Standing::Bent(_), Course::Bends(course)) if course.has_two_edges() => {
                    2 * cost::WAVE
                }
                (Standing::Bent(_), _) => cost::WAVE,
                (Standing::Image(_), _) => cost::REFLECTED,
                _ => 0,
            });
            let heard = candidate.heard(standing, now, place, &self.settings, &self.shapes);
            let is_new = !matches!(standing, Standing::Continued(_));
            if every > 1 && is_new && self.settings.exact_geometry {
                candidate.remember(heard.as_ref(), self.frame, every);
            }
            let Some(path) = heard else {
                continue;
            };
            mark.note_level(&path.amplitude);
            match candidate.course {
                Course::Bends(course) => self.bent.push((course.has_two_edges(), path)),
                Course::Mirrors(_) | Course::Unknown => paths.push(path),
            }
        }
        Step::Begin
    }

    /// Adds as many bent paths of each source as an update has at most, the loudest.
    fn keep_loudest_bent(&mut self, paths: &mut Vec<FramePath>) {
        let energy = |path: &FramePath| path.amplitude.iter().map(|a| a * a).sum::<f32>();
        let group = |(double, path): &(bool, FramePath)| (path.source.bits(), *double);
        self.bent.sort_unstable_by(|a, b| {
            let louder = energy(&b.1).total_cmp(&energy(&a.1));
            group(a)
                .cmp(&group(b))
                .then(louder)
                .then(a.1.id.cmp(&b.1.id))
        });
        for same in self.bent.chunk_by(|a, b| group(a) == group(b)) {
            let most = if same[0].0 {
                MAX_TWO_EDGE_PATHS
            } else {
                MAX_REFLECTED_EDGE_PATHS
            };
            paths.extend(same.iter().take(most).map(|(_, path)| *path));
        }
    }
}
