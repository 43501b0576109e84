//! One propagation update: casts all rays, culls the sequences of guide rays, validates source by source, sorts.
//!
//! Each phase is a list of independent shares for the caller's [`Workers`]. Results are merged in the order of the list: the
//! number of threads does not change a bit.

mod collect;
mod field;
mod guide;
mod guide_origins;
mod listeners;
mod rest;
mod uncovered_occupants;
#[cfg(test)]
mod untried_tests;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use self::guide::{GuideCasts, GuideShare};
use self::guide_origins::GuideOrigins;
use self::rest::CommonInputs;
use self::uncovered_occupants::UncoveredOccupants;
use crate::error::Result;
use crate::propagation::diffuse::{FieldRenewal, ListenerField, SceneField, VisibilityCells};
use crate::propagation::image_source::discovery_history::{
    DiscoveryHistory, GuideCast, MAX_AGE, Visit,
};
use crate::propagation::image_source::expansion::{MAX_CANDIDATES, expand};
use crate::propagation::image_source::nearby_gate::{MirrorEnergies, NearbyGate};
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::image_source::window_cull::{CandidateCull, CullViews};
use crate::propagation::path::PathSet;
use crate::propagation::quality_level::PropagationQuality;
use crate::propagation::rays::directions::{
    ROTATIONS, fill_interleaved_lattices, fill_lattice, interleaved_lattices, lattice,
};
use crate::propagation::scene_revision::SceneRevision;
use crate::propagation::settings::PropagationSettings;
use crate::propagation::source_task::{
    PredictedPosition, ReflectionContext, Scratch, SourceTask, UpdateContext,
};
use crate::propagation::update_scope::UpdateScope;
use crate::propagation::workers::{Serial, Workers};
use crate::scene::{ListenerPose, Scene, SourcePose};

/// Shares of the guide rays and of the candidates: several a thread, for even load.
const SHARES: usize = 16;

/// Most listeners of a propagator.
const MAX_LISTENERS: usize = 16;

/// Time of updates before the first one.
const LONG_AGO_S: f64 = f64::NEG_INFINITY;

/// Updates without motion of an instance after which the late field is traced anew: less than a cycle of rotations.
const UPDATES_AT_REST: u64 = 4;

/// What depends on the listener, while it is the turn of others.
#[derive(Debug, Default)]
struct ListenerState {
    cells: VisibilityCells,
    field: ListenerField,
    predicted: Vec<PredictedPosition>,
    history: DiscoveryHistory,
    guide_origins: GuideOrigins,
}

/// Computes path sets of one scene. One thread owns it and makes one call at a time.
///
/// # Real-time
/// Not for the audio thread. Allocates while sources or numbers of paths are new, not afterwards.
///
/// ```
/// use std::sync::Arc;
/// use foresound::paths::{PathSet, Propagator};
/// use foresound::{
///     ListenerPose, MaterialTable, PropagationSettings, Scene, SceneSettings, SourceId, SourcePose, glam::Vec3, shoebox,
/// };
///
/// # fn main() -> foresound::Result<()> {
/// let room = shoebox(Vec3::new(6.0, 3.0, 4.0), "concrete");
/// let scene = Scene::commit(&room, &MaterialTable::built_in(), &SceneSettings::default())?;
/// let mut propagator = Propagator::new(Arc::new(scene), PropagationSettings::default())?;
/// let source = SourcePose::at(SourceId::new(0, 0), Vec3::new(1.0, 1.5, 2.0));
/// let listener = ListenerPose::facing([4.0, 1.5, 2.0], 0.0);
/// let mut set = PathSet::default();
/// propagator.update(&listener, &[source], 0.0, &mut set);
/// // Direct sound, and the six walls' first reflections.
/// assert!(set.paths.iter().any(|path| path.is_direct()));
/// assert_eq!(set.paths.iter().filter(|path| path.order == 1).count(), 6);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Propagator {
    scene: Arc<Scene>,
    /// Whether the scene may have changed since the last update.
    is_scene_touched: bool,
    revision: SceneRevision,
    cells: VisibilityCells,
    /// The scene's late field.
    field: SceneField,
    /// Scene revision of the field, and the update since which the present one holds.
    field_of: Option<u64>,
    /// The field of a scene whose joined parts have changed, and the revision that it is made for.
    renewal: Option<(FieldRenewal, u64)>,
    /// Whether one was dropped since the field was last made.
    has_dropped_renewal: bool,
    uncovered: UncoveredOccupants,
    /// The scene's revision, and since which search it is.
    resting_since: (u64, u64),
    /// Of the last update, if it was a whole one.
    last_inputs: Option<CommonInputs>,
    /// Whether the last update had the results of the one before.
    is_kept: bool,
    listener_field: ListenerField,
    predicted: Vec<PredictedPosition>,
    /// As given at creation.
    settings: PropagationSettings,
    /// Within the present quality.
    active_settings: PropagationSettings,
    quality: PropagationQuality,
    update: u64,
    /// Updates that have searched, in which the ages of what is remembered are counted.
    searches: u64,
    /// Chooses rotations: with several listeners the same for all.
    round: u64,
    /// Whether an update has had this number.
    is_round_begun: bool,
    /// The listener whose turn it is, and the state of all, by index; with one listener empty.
    listener: usize,
    listeners: Vec<ListenerState>,
    /// Directions before rotation.
    guide_directions: Vec<Vec3>,
    /// Those of updates with fewer guide rays.
    few_directions: Vec<Vec3>,
    source_directions: Vec<Vec3>,
    shares: Vec<GuideShare>,
    guide: SequenceSet,
    history: DiscoveryHistory,
    guide_origins: GuideOrigins,
    nearby_m: Option<f64>,
    /// For the gates of nearby paths.
    energies: MirrorEnergies,
    /// Of the next update.
    scope: UpdateScope,
    candidates: Vec<CandidateCull>,
    /// Positions of the sources that are searched for, in local coordinates.
    source_positions: Vec<DVec3>,
    /// Of those sources.
    gates: Vec<NearbyGate>,
    /// Those of the update's sources in their order, then idle ones.
    tasks: Vec<SourceTask>,
    /// One per thread.
    scratch: Vec<Scratch>,
    /// Scratch: paths by identity, task and index within it.
    order: Vec<u128>,
}

impl Propagator {
    /// A propagator for a committed scene. Allocates its memory.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) names a setting outside its range.
    pub fn new(scene: Arc<Scene>, settings: PropagationSettings) -> Result<Self> {
        settings.check()?;
        let count = settings.guide_rays;
        let sequences = (count as usize).div_ceil(SHARES) * settings.depth;
        let capacity = (SHARES * sequences).max(DiscoveryHistory::CAPACITY);
        Ok(Self {
            scene,
            is_scene_touched: true,
            revision: SceneRevision::default(),
            cells: VisibilityCells::default(),
            field: SceneField::default(),
            field_of: None,
            renewal: None,
            has_dropped_renewal: false,
            uncovered: UncoveredOccupants::default(),
            resting_since: (0, 0),
            last_inputs: None,
            is_kept: false,
            listener_field: ListenerField::default(),
            predicted: Vec::new(),
            settings,
            active_settings: settings,
            quality: PropagationQuality::full(&settings),
            update: 0,
            searches: 0,
            round: 0,
            is_round_begun: false,
            listener: 0,
            listeners: Vec::new(),
            guide_directions: lattice(count),
            few_directions: Vec::new(),
            source_directions: interleaved_lattices(settings.source_rays),
            shares: (0..SHARES)
                .map(|_| GuideShare::with_capacity(sequences))
                .collect(),
            guide: SequenceSet::with_capacity(capacity),
            history: DiscoveryHistory::default(),
            guide_origins: GuideOrigins::default(),
            nearby_m: None,
            energies: MirrorEnergies::default(),
            scope: UpdateScope::default(),
            candidates: (0..SHARES)
                .map(|_| CandidateCull::with_capacity(capacity.div_ceil(SHARES)))
                .collect(),
            source_positions: Vec::new(),
            gates: Vec::new(),
            tasks: Vec::new(),
            scratch: Vec::new(),
            order: Vec::new(),
        })
    }

    /// The scene that paths are computed in.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Mutable access to move, add and remove instances; the next update uses the result. Copies the scene, but not its fixed
    /// data, while another reference to it exists. Caches keep what is still valid.
    pub fn scene_mut(&mut self) -> &mut Scene {
        self.is_scene_touched = true;
        Arc::make_mut(&mut self.scene)
    }

    /// The settings given at creation; a quality level in force does not change them.
    pub fn settings(&self) -> &PropagationSettings {
        &self.settings
    }

    /// Sets the quality of the next updates, limited by the settings given at creation. Caches are kept. Allocates nothing.
    pub(crate) fn set_quality(&mut self, quality: PropagationQuality) {
        let quality = quality.within(&self.settings);
        if quality.guide_rays != self.quality.guide_rays {
            fill_lattice(&mut self.guide_directions, quality.guide_rays);
        }
        if quality.source_rays != self.quality.source_rays {
            fill_interleaved_lattices(&mut self.source_directions, quality.source_rays);
        }
        self.quality = quality;
        self.active_settings = PropagationSettings {
            guide_rays: quality.guide_rays,
            source_rays: quality.source_rays,
            depth: quality.depth,
            cache_updates: quality.cache_updates,
            ..self.settings
        };
    }

    /// Enables [`PathSet::nearby`] in the next updates: reflected paths that may become valid for a listener within `radius_m`
    /// metres (0 or more). `None`, the initial value, disables it.
    pub fn set_nearby_radius(&mut self, radius_m: Option<f64>) {
        self.nearby_m = radius_m.map(|radius_m| radius_m.max(0.0));
    }

    /// Limits the next update, and only that one.
    #[doc(hidden)]
    pub fn set_scope(&mut self, scope: UpdateScope) {
        self.scope = scope;
    }

    /// Sets further listener positions (world coordinates, metres) at which the next updates estimate late energy, in
    /// [`PathSet::predicted_late`]. Initially none. An estimate costs the shadow rays of a move to that position.
    ///
    /// `sources` has the positions of the update's sources for each listener position in turn; sources without one are taken
    /// to be at rest.
    pub fn set_predicted_positions(&mut self, listeners: &[Vec3], sources: &[Vec3]) {
        self.predicted
            .resize_with(listeners.len(), PredictedPosition::default);
        let count = sources.len() / listeners.len().max(1);
        for (index, (there, listener)) in self.predicted.iter_mut().zip(listeners).enumerate() {
            there.position = *listener;
            there.sources.clear();
            let own = sources.get(index * count..(index + 1) * count);
            there.sources.extend_from_slice(own.unwrap_or_default());
        }
    }

    /// Runs one update for each ray rotation at one pose and drops the results. The next update has the paths of a listener at
    /// rest.
    pub fn warm_up(&mut self, listener: &ListenerPose, sources: &[SourcePose]) {
        let mut set = PathSet::default();
        for _ in 0..ROTATIONS {
            self.update(listener, sources, LONG_AGO_S, &mut set);
            self.round += 1;
        }
    }

    /// Computes all valid paths for these poses into `result` and reuses its memory; `time_s` becomes [`PathSet::time_s`]. With
    /// nearby paths the time since the update before bounds how many rays a source that starts to move casts at once; updates
    /// that all have one time cast all. Runs on the calling thread.
    pub fn update(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        time_s: f64,
        result: &mut PathSet,
    ) {
        self.update_with(&Serial, listener, sources, time_s, result);
    }

    /// [`Self::update`] on the caller's workers. Their number does not change a bit of the result. Where
    /// [`Workers::is_interrupted`] becomes true, the update ends early and `result` stays as it was.
    pub fn update_with(
        &mut self,
        workers: &impl Workers,
        listener: &ListenerPose,
        sources: &[SourcePose],
        time_s: f64,
        result: &mut PathSet,
    ) {
        if std::mem::take(&mut self.is_scene_touched) {
            self.revision.refresh(&self.scene, self.update);
        }
        self.revision.begin_update(self.update);
        let scene_state = self.revision.current();
        let listeners = self.listeners.len().max(1) as u64;
        self.is_round_begun = true;
        if listeners == 1 {
            self.round = self.update;
        }
        self.arrange_tasks(sources);
        while self.scratch.len() < workers.count() {
            self.scratch.push(Scratch::new(&self.settings));
        }
        let scene = &*self.scene;
        let ear = scene.to_local(listener.position);
        let mut cell_rays = 0;
        if self.resting_since.0 != scene_state {
            self.resting_since = (scene_state, self.searches);
        }
        // A moving instance changes what listener and sources see of the field; the field itself follows when it rests.
        let is_at_rest = self.searches - self.resting_since.1 >= UPDATES_AT_REST;
        cell_rays += self.renew_field(listener, sources, is_at_rest);
        let scope = std::mem::take(&mut self.scope);
        let scene = &*self.scene;
        let field = &self.field;
        if !scope.skips_late {
            let ear = ear.as_vec3();
            cell_rays += self.cells.renew(scene, ear, scene_state);
            let (own, cells) = (&mut self.listener_field, &self.cells);
            cell_rays += own.renew(scene, field, ear, cells, scene_state);
        }
        cell_rays += self.guide_origins.renew(scene, ear.as_vec3(), scene_state);
        let has_cast = cell_rays > 0;
        for there in &mut self.predicted {
            there.listener = scene.to_local(there.position);
            let ear = there.listener.as_vec3();
            cell_rays += there.cells.renew(scene, ear, scene_state);
            let (own, cells) = (&mut there.field, &there.cells);
            cell_rays += own.renew(scene, field, ear, cells, scene_state);
        }
        self.is_kept = self.keep_sources_at_rest(listener, sources, (&scope, has_cast));
        if self.is_kept {
            let count = self.predicted.len();
            for task in &mut self.tasks[..sources.len()] {
                task.keep(count, time_s);
            }
            self.finish((listener, sources, time_s), (scope, 0), result);
            return;
        }
        let (scene, field) = (&*self.scene, &self.field);
        let depth = scope.depth(self.active_settings.depth);
        let most = self.guide_directions.len() as u32;
        let count = scope.guide_rays.map_or(most, |count| count.min(most));
        let guide_directions = match count < most {
            true => {
                if self.few_directions.len() != count as usize {
                    fill_lattice(&mut self.few_directions, count);
                }
                &self.few_directions
            }
            false => &self.guide_directions,
        };
        if self.nearby_m.is_some() {
            self.energies.renew(scene);
        }
        let context = UpdateContext {
            scene,
            settings: &self.active_settings,
            quality: &self.quality,
            round: self.round,
            listeners,
            scene_state,
            poses_since: self.revision.poses_since(),
            fixed_since: self.revision.fixed_since(),
            listener,
            ear,
            cells: &self.cells,
            scene_field: field,
            listener_field: &self.listener_field,
            predicted: &self.predicted,
            time_s,
            nearby_m: self.nearby_m,
            energies: &self.energies,
            directions: &self.source_directions,
            scope: &scope,
            depth,
        };
        let guide_casts = GuideCasts::due(
            (&self.history, &self.guide_origins),
            self.round,
            GuideCast {
                scene_state,
                rays: count,
                depth,
                ..GuideCast::default()
            },
            (guide_directions, self.active_settings.seed),
        );
        // Sources first: each is a larger piece of work than a share of the guide rays.
        workers.for_both(
            (&mut self.tasks[..sources.len()], &mut self.shares),
            &mut self.scratch,
            |index, task, scratch| {
                if !workers.is_interrupted() {
                    task.trace(&context, index, &sources[index], scratch);
                }
            },
            |index, share, _| {
                if !workers.is_interrupted() {
                    share.trace(scene, guide_casts.rays(), index);
                }
            },
        );
        if workers.is_interrupted() {
            self.abandon();
            return;
        }
        // After a jump few rays are cast, which stand for no rotation.
        let is_whole = count == most && depth == self.active_settings.depth;
        let visit = Visit {
            update: self.searches,
            listener: ear.as_vec3(),
        };
        guide_casts.remember(&self.shares, is_whole, visit, &mut self.history);
        self.guide.clear();
        let limit = scope.max_candidates;
        self.history.merge(
            scene,
            visit,
            (self.resting_since.1, listeners * MAX_AGE),
            (limit.unwrap_or(DiscoveryHistory::CAPACITY), depth),
            &mut self.guide,
        );
        let most = limit.unwrap_or(MAX_CANDIDATES);
        expand(scene, self.round, (depth, most), &mut self.guide);
        let sequences = self.guide.entries();
        self.source_positions.clear();
        self.gates.clear();
        let tasks = self.tasks[..sources.len()].iter_mut().zip(sources);
        let searched = tasks.filter(|(task, _)| task.is_searched);
        for (view, (task, source)) in searched.enumerate() {
            task.view = view;
            self.source_positions.push(scene.to_local(source.position));
            self.gates.push(task.nearby_gate);
        }
        let views = CullViews {
            listener: ear,
            nearby_m: self.nearby_m,
            sources: &self.source_positions,
            gates: &self.gates,
            energies: &self.energies,
        };
        workers.for_both(
            (&mut self.candidates, &mut [(); 0]),
            &mut self.scratch,
            |index, candidates, scratch| {
                let range = share_range(index, sequences.len());
                let share = &sequences[range.clone()];
                if !workers.is_interrupted() {
                    candidates.cull(scene, share, range.start, &views, &mut scratch.cull);
                }
            },
            |_, (), _| (),
        );
        let context = ReflectionContext {
            update: context,
            guide: &self.guide,
            candidates: &self.candidates,
        };
        workers.for_both(
            (&mut self.tasks[..sources.len()], &mut [(); 0]),
            &mut self.scratch,
            |index, task, scratch| {
                if !workers.is_interrupted() {
                    task.find_reflections(&context, &sources[index], scratch);
                }
            },
            |_, (), _| (),
        );
        if workers.is_interrupted() {
            self.abandon();
            return;
        }
        let has_cast = self.shares.iter().any(|share| share.rays > 0);
        for task in &mut self.tasks[..sources.len()] {
            task.end_update(has_cast);
        }
        self.searches += 1;
        self.finish((listener, sources, time_s), (scope, cell_rays), result);
    }

    /// Whether the last update had the results of the one before, without a search: nothing had changed for many updates.
    pub(crate) fn is_kept(&self) -> bool {
        self.is_kept
    }

    /// Ends an update with the results of its tasks, and rays besides theirs.
    fn finish(
        &mut self,
        (listener, sources, time_s): (&ListenerPose, &[SourcePose], f64),
        (scope, rays): (UpdateScope, u64),
        result: &mut PathSet,
    ) {
        self.collect(sources, result);
        result.rays += rays;
        if self.is_kept {
            result.rays = 0;
        }
        result.update = self.update;
        result.time_s = time_s;
        result.listener = *listener;
        result.scope = scope;
        self.update += 1;
    }

    /// Ends an interrupted update.
    fn abandon(&mut self) {
        self.last_inputs = None;
        self.searches += 1;
        self.update += 1;
    }

    /// Brings the tasks into the order of the sources. New sources reuse the tasks of removed sources.
    fn arrange_tasks(&mut self, sources: &[SourcePose]) {
        for (index, pose) in sources.iter().enumerate() {
            let own = (index..self.tasks.len()).find(|&i| self.tasks[i].belongs_to(pose.id));
            if let Some(own) = own {
                self.tasks.swap(index, own);
                continue;
            }
            let is_needed =
                |task: &SourceTask| sources[index..].iter().any(|s| task.belongs_to(s.id));
            let free = (index..self.tasks.len()).find(|&i| !is_needed(&self.tasks[i]));
            let free = free.unwrap_or_else(|| {
                let task = SourceTask::new(pose.id, &self.settings);
                self.tasks.push(task);
                self.tasks.len() - 1
            });
            self.tasks[free].reset(pose.id);
            self.tasks.swap(index, free);
        }
        for task in &mut self.tasks {
            task.select_listener(self.listener, &self.settings);
        }
        for task in &mut self.tasks[sources.len()..] {
            task.is_idle = true;
        }
    }
}

/// Range of share `index` of `count` items.
fn share_range(index: usize, count: usize) -> std::ops::Range<usize> {
    index * count / SHARES..(index + 1) * count / SHARES
}
