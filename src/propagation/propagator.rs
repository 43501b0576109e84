//! One propagation update: cast all rays, make ready what guide rays found, validate a source at a time, sort.
//!
//! Each phase is a list of shares that do not depend on each other, given to the caller's [`Workers`]; results are put
//! together in the order of the list, so the number of threads does not change a bit.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::error::Result;
use crate::propagation::diffraction::MAX_DIRECT_EDGES;
use crate::propagation::diffuse::VisibilityCells;
use crate::propagation::image_source::discovery_history::GuideMemory;
use crate::propagation::image_source::expansion::fill_up;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::image_source::window_cull::{Candidates, Onlookers};
use crate::propagation::path::{Path, PathId, PathSet};
use crate::propagation::quality_level::PropagationQuality;
use crate::propagation::rays::directions::{ROTATIONS, lattice, renew_lattice, rotation};
use crate::propagation::rays::guide_rays::GuideRays;
use crate::propagation::rays::prefix_set::Beginnings;
use crate::propagation::scene_revision::SceneState;
use crate::propagation::settings::PropagationSettings;
use crate::propagation::source_task::{Moment, PredictedPosition, Scratch, Shared, SourceTask};
use crate::propagation::workers::{Serial, Workers};
use crate::scene::{ListenerPose, Scene, SourcePose};

/// Shares that guide rays and their sequences are split into: several a thread, so that none waits long for another.
const SHARES: usize = 16;

/// One share of the guide rays. Far enough from the next one that two threads write to no common cache line, nor to two that
/// are fetched together.
#[derive(Debug)]
#[repr(align(128))]
struct GuideShare {
    met: Beginnings,
    found: Vec<Sequence>,
    rays: u64,
}

impl GuideShare {
    fn trace(&mut self, scene: &Scene, rays: &GuideRays<'_>, number: usize) {
        self.found.clear();
        let range = part(number, rays.directions.len());
        let found = &mut self.found;
        self.rays = rays.trace_with(&mut self.met, scene, range, |sequence| found.push(sequence));
    }
}

/// Computes path sets of one scene. Owned by the propagation thread; one call at a time.
///
/// # Real-time
/// Not for the audio thread. Allocates while a source or a number of paths is new, not afterwards.
#[derive(Debug)]
pub struct Propagator {
    scene: Arc<Scene>,
    /// Whether somebody may have changed it since it was last looked at.
    is_touched: bool,
    state: SceneState,
    viewpoints: VisibilityCells,
    /// See [`Self::set_predicted_positions`].
    way: Vec<PredictedPosition>,
    /// As it was made.
    settings: PropagationSettings,
    /// As much of it as is in use.
    in_use: PropagationSettings,
    effort: PropagationQuality,
    update: u64,
    /// The rays' lattices before rotation.
    guide_directions: Vec<Vec3>,
    source_directions: Vec<Vec3>,
    shares: Vec<GuideShare>,
    guide: SequenceSet,
    memory: GuideMemory,
    /// See [`Self::set_nearby_radius`].
    reach_m: Option<f64>,
    candidates: Vec<Candidates>,
    /// Of the update's sources, local coordinates.
    places: Vec<DVec3>,
    /// Those of the update's sources first, in their order; then those that wait for another source.
    tasks: Vec<SourceTask>,
    /// What they are worked in, one a thread.
    scratch: Vec<Scratch>,
    /// The paths of all tasks by identity: task and place.
    order: Vec<(PathId, u32, u32)>,
}

impl Propagator {
    /// For a committed scene.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] names a setting outside its range.
    pub fn new(scene: Arc<Scene>, settings: PropagationSettings) -> Result<Self> {
        settings.check()?;
        let count = settings.guide_rays;
        let rays_a_share = (count as usize).div_ceil(SHARES);
        let sequences = rays_a_share * settings.depth;
        let capacity = (SHARES * sequences).max(GuideMemory::MOST);
        let share = |_| GuideShare {
            met: Beginnings::with_capacity(sequences),
            found: Vec::with_capacity(sequences),
            rays: 0,
        };
        Ok(Self {
            scene,
            is_touched: true,
            state: SceneState::default(),
            viewpoints: VisibilityCells::default(),
            way: Vec::new(),
            settings,
            in_use: settings,
            effort: PropagationQuality::full(&settings),
            update: 0,
            guide_directions: lattice(count),
            source_directions: lattice(settings.source_rays),
            shares: (0..SHARES).map(share).collect(),
            guide: SequenceSet::with_capacity(capacity),
            memory: GuideMemory::default(),
            reach_m: None,
            candidates: (0..SHARES)
                .map(|_| Candidates::with_capacity(capacity.div_ceil(SHARES)))
                .collect(),
            places: Vec::new(),
            tasks: Vec::new(),
            scratch: Vec::new(),
            order: Vec::new(),
        })
    }

    /// The scene that paths are computed in.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The same to move its instances, to add and to remove some: the next update is computed with them as they stand
    /// then. Copies the scene, but not what is fixed, as long as somebody else has it too. What is remembered of paths
    /// stays, and is seen again where it stands.
    pub fn scene_mut(&mut self) -> &mut Scene {
        self.is_touched = true;
        Arc::make_mut(&mut self.scene)
    }

    /// The settings it was made with.
    pub fn settings(&self) -> &PropagationSettings {
        &self.settings
    }

    /// Spends as much as this from the next update on, within the settings it was made with; what it remembers stays.
    /// Allocates nothing.
    pub fn set_quality(&mut self, effort: PropagationQuality) {
        let effort = effort.within(&self.settings);
        if effort.guide_rays != self.effort.guide_rays {
            renew_lattice(&mut self.guide_directions, effort.guide_rays);
        }
        if effort.source_rays != self.effort.source_rays {
            renew_lattice(&mut self.source_directions, effort.source_rays);
        }
        self.effort = effort;
        self.in_use = PropagationSettings {
            guide_rays: effort.guide_rays,
            source_rays: effort.source_rays,
            depth: effort.depth,
            cache_updates: effort.cache_updates,
            ..self.settings
        };
    }

    /// Has the next updates name reflected paths that are not there, but may be for a listener within `reach_m` metres, in
    /// [`PathSet::nearby`]; `None` names none, which is where a propagator begins.
    pub fn set_nearby_radius(&mut self, reach_m: Option<f64>) {
        self.reach_m = reach_m;
    }

    /// Has the next updates estimate the late reverb for these places too, world coordinates, in [`PathSet::way`]; none is
    /// where a propagator begins. An estimate costs the shadow rays of a listener who goes there.
    ///
    /// `sources` says where the sources will be then: for each place all of them, in the order of the update's; where it says
    /// nothing they are taken to be where the update has them.
    pub fn set_predicted_positions(&mut self, places: &[Vec3], sources: &[Vec3]) {
        self.way
            .resize_with(places.len(), PredictedPosition::default);
        let count = sources.len() / places.len().max(1);
        for (number, (there, place)) in self.way.iter_mut().zip(places).enumerate() {
            there.place = *place;
            there.sources.clear();
            let own = sources.get(number * count..(number + 1) * count);
            there.sources.extend_from_slice(own.unwrap_or_default());
        }
    }

    /// Runs sixteen updates at one place and drops their results, so that every ray rotation has been seen there and
    /// the next update finds what a listener at rest would hear.
    pub fn warm_up(&mut self, listener: &ListenerPose, sources: &[SourcePose]) {
        let mut scratch = PathSet::default();
        for _ in 0..ROTATIONS {
            self.update(listener, sources, 0.0, &mut scratch);
        }
    }

    /// Computes all valid paths for these poses into `result`, whose memory is used again. On the calling thread.
    pub fn update(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        time_s: f64,
        result: &mut PathSet,
    ) {
        self.update_with(&Serial, listener, sources, time_s, result);
    }

    /// The same on the caller's workers; their number does not change a bit of the result.
    pub fn update_with(
        &mut self,
        workers: &impl Workers,
        listener: &ListenerPose,
        sources: &[SourcePose],
        time_s: f64,
        result: &mut PathSet,
    ) {
        if std::mem::take(&mut self.is_touched) {
            self.state.look(&self.scene, self.update);
        }
        self.state.go_on(self.update);
        let scene_state = self.state.now();
        self.arrange(sources);
        while self.scratch.len() < workers.count() {
            self.scratch.push(Scratch::new(&self.settings));
        }
        let ear = self.scene.to_local(listener.position);
        let own_rays = self
            .viewpoints
            .renew(&self.scene, ear.as_vec3(), scene_state);
        let mut way_rays = 0;
        for there in &mut self.way {
            there.ear = self.scene.to_local(there.place);
            let ear = there.ear.as_vec3();
            way_rays += there.viewpoints.renew(&self.scene, ear, scene_state);
        }
        let moment = Moment {
            scene: &self.scene,
            settings: &self.in_use,
            effort: &self.effort,
            update: self.update,
            scene_state,
            poses_since: self.state.poses_since(),
            fixed_since: self.state.fixed_since(),
            listener,
            ear,
            viewpoints: &self.viewpoints,
            way: &self.way,
            reach_m: self.reach_m,
            directions: &self.source_directions,
        };
        let guide_rays = GuideRays {
            origin: ear,
            turn: rotation(self.update, self.in_use.seed),
            directions: &self.guide_directions,
            depth: self.in_use.depth,
        };
        let tasks = &mut self.tasks[..sources.len()];
        // All rays at once: a source's are a larger piece than a share of the guide rays, so they come first.
        workers.for_both(
            (tasks, &mut self.shares),
            &mut self.scratch,
            |place, task, scratch| task.trace(&moment, place, &sources[place], scratch),
            |number, share, _| share.trace(moment.scene, &guide_rays, number),
        );
        merge(&moment, &self.shares, &mut self.guide, &mut self.memory);
        let sequences = self.guide.entries();
        self.places.clear();
        let place = |source: &SourcePose| self.scene.to_local(source.position);
        self.places.extend(sources.iter().map(place));
        let onlookers = Onlookers {
            ear,
            reach_m: moment.reach_m,
            sources: &self.places,
        };
        workers.for_each(&mut self.candidates, |number, candidates| {
            let range = part(number, sequences.len());
            let share = &sequences[range.clone()];
            candidates.prepare(moment.scene, share, range.start, &onlookers);
        });
        let shared = Shared {
            moment,
            guide: &self.guide,
            candidates: &self.candidates,
        };
        workers.for_both(
            (&mut self.tasks[..sources.len()], &mut [(); 0]),
            &mut self.scratch,
            |place, task, scratch| task.find(&shared, place, &sources[place], scratch),
            |_, (), _| (),
        );
        self.gather(sources, result);
        result.rays += own_rays + way_rays;
        result.update = self.update;
        result.time_s = time_s;
        result.listener = *listener;
        self.update += 1;
    }

    /// Puts the tasks into the order of the sources. New sources take over the tasks of those that have gone.
    fn arrange(&mut self, sources: &[SourcePose]) {
        for (place, pose) in sources.iter().enumerate() {
            let known = (place..self.tasks.len()).find(|&i| self.tasks[i].belongs_to(pose.id));
            if let Some(there) = known {
                self.tasks.swap(place, there);
                continue;
            }
            let wanted = |task: &SourceTask| sources[place..].iter().any(|s| task.belongs_to(s.id));
            let free = (place..self.tasks.len()).find(|&i| !wanted(&self.tasks[i]));
            let there = free.unwrap_or_else(|| {
                let task = SourceTask::new(pose.id, &self.settings);
                self.tasks.push(task);
                self.tasks.len() - 1
            });
            self.tasks[there].reset(pose.id);
            self.tasks.swap(place, there);
        }
        for task in &mut self.tasks[sources.len()..] {
            task.waits = true;
        }
    }

    /// Puts the tasks' paths together, sorted by identity.
    fn gather(&mut self, sources: &[SourcePose], result: &mut PathSet) {
        let tasks = &self.tasks[..sources.len()];
        sorted(
            tasks,
            |task| &task.paths,
            &mut self.order,
            &mut result.paths,
        );
        let nearby = &mut result.nearby;
        sorted(tasks, |task| &task.nearby, &mut self.order, nearby);
        result.direct_edges.clear();
        result.direct_edges.reserve(tasks.len() * MAX_DIRECT_EDGES);
        for (pose, task) in sources.iter().zip(tasks) {
            let edges = task.direct_edges.as_slice().iter();
            result
                .direct_edges
                .extend(edges.map(|edge| (pose.id, *edge)));
        }
        result.late.clear();
        result
            .late
            .extend(tasks.iter().filter_map(|task| task.late_source));
        result.way.clear();
        result.predicted_late.clear();
        result.predicted_sources.clear();
        let all_looked = tasks
            .iter()
            .all(|t| t.predicted_late.len() == self.way.len());
        for (number, there) in self.way.iter().enumerate().filter(|_| all_looked) {
            result.way.push(there.place);
            let late = tasks.iter().map(|task| task.predicted_late[number]);
            result.predicted_late.extend(late);
            let at = |(place, pose): (usize, &SourcePose)| {
                there.sources.get(place).copied().unwrap_or(pose.position)
            };
            result
                .predicted_sources
                .extend(sources.iter().enumerate().map(at));
        }
        result.instances.clear();
        result.instances.extend(self.scene.instance_poses());
        result.sources.clear();
        result.sources.extend_from_slice(sources);
        let guide_rays: u64 = self.shares.iter().map(|share| share.rays).sum();
        result.rays = guide_rays + tasks.iter().map(|task| task.rays).sum::<u64>();
    }
}

/// Puts one of the tasks' lists together, sorted by identity.
fn sorted(
    tasks: &[SourceTask],
    list: impl Fn(&SourceTask) -> &Vec<Path>,
    order: &mut Vec<(PathId, u32, u32)>,
    result: &mut Vec<Path>,
) {
    order.clear();
    for (number, task) in tasks.iter().enumerate() {
        let entries = list(task).iter().enumerate();
        order.extend(entries.map(|(place, path)| (path.id, number as u32, place as u32)));
    }
    order.sort_unstable();
    result.clear();
    // Room for half as many again, so that a walk seldom asks for more.
    result.reserve((order.len() * 3 / 2).next_power_of_two());
    let path = |&(_, task, place): &(PathId, u32, u32)| list(&tasks[task as usize])[place as usize];
    result.extend(order.iter().map(path));
}

/// The set of what guide rays have found in the order of the rays, filled up with what they found before and with neighbours.
fn merge(
    moment: &Moment<'_>,
    shares: &[GuideShare],
    guide: &mut SequenceSet,
    memory: &mut GuideMemory,
) {
    guide.clear();
    for sequence in shares.iter().flat_map(|share| &share.found) {
        guide.insert(*sequence);
    }
    memory.turn(moment.scene, moment.update, moment.reach_m.is_some(), guide);
    fill_up(moment.scene, moment.update, moment.settings.depth, guide);
}

/// Share `number` of `count` things.
fn part(number: usize, count: usize) -> std::ops::Range<usize> {
    number * count / SHARES..(number + 1) * count / SHARES
}
