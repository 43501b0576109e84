//! One source's part of an update: source rays, direct and diffracted paths, validation of reflections. Depends on no other
//! source: sources are spread over threads.

mod listener_part;
mod listener_walk;
mod near_casts;
mod own_candidates;
mod query;
mod rest;
mod state;

use glam::{DVec3, Vec3};

use super::curved_reflection;
use super::diffraction::{self, ExtentPoints, LastSearch, NearEdges, path_in_shadow};
use super::endpoints::Endpoints;
use super::path::{MAX_ORDER, Path};
use super::settings::PropagationSettings;
use crate::propagation::diffuse::{
    LateEstimate, LateEstimator, ListenerField, RayScratch, SceneField, SourceRays,
    VisibilityCells, stable_viewpoint,
};
use crate::propagation::image_source::image_path::MARGIN_M;
use crate::propagation::image_source::miss_distance::Miss;
use crate::propagation::image_source::nearby_gate::{
    MirrorEnergies, NearbyGate, RankedPath, keep_loudest,
};
use crate::propagation::image_source::occluder_cache::OccluderCache;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::image_source::valid_cache::ValidCache;
use crate::propagation::image_source::validation_queue::ValidationQueue;
use crate::propagation::image_source::window_cull::{CandidateCull, CullScratch};
use crate::propagation::quality_level::PropagationQuality;
use crate::propagation::rays::directions::{ROTATIONS, lattice_of, rotation};
use crate::propagation::update_scope::UpdateScope;
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};
use listener_part::ListenerPart;
use listener_walk::ListenerWalk;
use near_casts::NearCasts;
use own_candidates::OwnIndices;
use query::SourceQuery;
use rest::SourceRest;

/// Most rotations that a moving source recasts in an update without nearby paths: as many as a source at rest. A walking source
/// leaves one of its ray origins every tenth of a second.
const MAX_CAST_ROTATIONS: usize = 1;

/// Distance in metres from the source up to which rays start near it: no more than that of most positions in a cell from its centre.
const NEAR_M: f64 = 1.0;

/// Most rotations that a source recasts in one update after a jump: none of those cast elsewhere counts.
const CAST_AFTER_JUMP: usize = 1;

/// Largest coordinate of source and listener in metres. Rays are in single precision, which represents its
/// square. A position beyond it or a non-finite one has no path.
const MAX_COORDINATE_M: f64 = 1e9;

/// A predicted position of the listener.
#[derive(Debug, Default)]
pub(super) struct PredictedPosition {
    /// In world coordinates.
    pub(super) position: Vec3,
    /// In local coordinates.
    pub(super) listener: DVec3,
    pub(super) cells: VisibilityCells,
    /// The late field there.
    pub(super) field: ListenerField,
    /// Positions of the sources at that time, in world coordinates.
    pub(super) sources: Vec<Vec3>,
}

/// Input of an update that all sources share.
#[derive(Debug, Clone, Copy)]
pub(super) struct UpdateContext<'a> {
    pub(super) scene: &'a Scene,
    pub(super) settings: &'a PropagationSettings,
    pub(super) quality: &'a PropagationQuality,
    /// Number of the round in which each listener has its turn, which chooses rotations: of one listener the update's.
    pub(super) round: u64,
    /// Number of listeners.
    pub(super) listeners: u64,
    /// See [`SourceRays::scene_state`], [`SourceRays::poses_since`] and [`SourceRays::fixed_since`].
    pub(super) scene_state: u64,
    pub(super) poses_since: u64,
    pub(super) fixed_since: u64,
    pub(super) listener: &'a ListenerPose,
    /// The listener in local coordinates.
    pub(super) ear: DVec3,
    pub(super) cells: &'a VisibilityCells,
    /// The scene's late field, and what the listener hears of it.
    pub(super) scene_field: &'a SceneField,
    pub(super) listener_field: &'a ListenerField,
    pub(super) predicted: &'a [PredictedPosition],
    /// Time of the poses in seconds.
    pub(super) time_s: f64,
    /// See [`crate::propagation::Propagator::set_nearby_radius`].
    pub(super) nearby_m: Option<f64>,
    pub(super) energies: &'a MirrorEnergies,
    /// Directions of the source rays of all rotations
    /// ([`crate::propagation::rays::directions::interleaved_lattices`]), before they are turned.
    pub(super) directions: &'a [Vec3],
    /// What is searched for, and the highest reflection order of the search.
    pub(super) scope: &'a UpdateScope,
    pub(super) depth: usize,
}

/// Input of the second half of an update.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReflectionContext<'a> {
    pub(super) update: UpdateContext<'a>,
    /// Candidates of the guide rays.
    pub(super) guide: &'a SequenceSet,
    /// The same, culled for every source.
    pub(super) candidates: &'a [CandidateCull],
}

/// Per-thread scratch, reused across sources. Aligned to two cache lines: threads write to
/// neighbouring ones.
#[derive(Debug)]
#[repr(align(128))]
pub(super) struct Scratch {
    /// Also the present source's own sequences.
    rays: RayScratch,
    own: OwnIndices,
    pub(super) cull: CullScratch,
    queue: ValidationQueue,
    /// Valid sequences by candidate index.
    valid: Vec<(u32, Sequence)>,
    /// Of nearby paths.
    ranks: Vec<RankedPath>,
}

impl Scratch {
    pub(super) fn new(settings: &PropagationSettings) -> Self {
        let own = settings.source_rays as usize * settings.depth.max(1) + settings.cache_capacity;
        Self {
            rays: RayScratch::with_capacity(own),
            own: OwnIndices::default(),
            cull: CullScratch::default(),
            queue: ValidationQueue::default(),
            valid: Vec::new(),
            ranks: Vec::new(),
        }
    }
}

/// State of one source between updates, and its results in the last one. With several listeners the state of the one whose turn it
/// is; rays are common to all. Aligned to two cache lines: threads write to
/// neighbouring ones.
#[derive(Debug)]
#[repr(align(128))]
pub(super) struct SourceTask {
    id: SourceId,
    /// Position when its rays were last cast, in local coordinates.
    last_position: Option<DVec3>,
    /// Whether its source was removed.
    pub(super) is_idle: bool,
    /// Whether it is searched for in this update.
    pub(super) is_searched: bool,
    /// Its index among those that are.
    pub(super) view: usize,
    /// Whether paths that are no reflections at planes are those of the update before.
    keeps_others: bool,
    /// The listener whose turn it is, and the state of the others, by index.
    listener: usize,
    parts: Vec<ListenerPart>,
    /// The last round in which its rays were cast, and whether the source moved then; the last in which it was put elsewhere.
    cast_in: Option<(u64, bool)>,
    jumped_in: Option<u64>,
    near_casts: NearCasts,
    /// Rotations that are still to be cast since it was put elsewhere.
    missing_rotations: usize,
    late: LateEstimator,
    walk: ListenerWalk,
    cache: ValidCache,
    occluders: OccluderCache,
    /// Rotation of this update's rays, cast or cached; `None` if none are due.
    rotation: Option<u64>,
    /// Valid paths, unsorted.
    pub(super) paths: Vec<Path>,
    /// Nearby paths, unsorted.
    pub(super) nearby: Vec<Path>,
    pub(super) nearby_gate: NearbyGate,
    /// Estimated energies of the nearby paths that passed the gate.
    nearby_estimates: Vec<f32>,
    /// Of diffracted paths in the last update.
    last_search: LastSearch,
    /// Edges of the direct field and of reflections until the next update.
    pub(super) near_edges: NearEdges,
    pub(super) latest_late: Option<LateEstimate>,
    /// Late energy at the predicted positions, in their order.
    pub(super) predicted_late: Vec<LateEstimate>,
    pub(super) rays: u64,
    /// Whether rays of a rotation were cast in the last update.
    has_cast: bool,
    pub(super) rest: SourceRest,
    /// Whether this update keeps the results of the one before.
    pub(super) is_kept: bool,
    /// Number of those that did not, in which the ages of valid sequences are counted.
    searches: u64,
}

impl SourceTask {
    /// First half of an update, independent of the guide rays: source rays, direct path and diffracted ones. `index` is the
    /// source's position in the list of sources.
    pub(super) fn trace(
        &mut self,
        context: &UpdateContext<'_>,
        index: usize,
        pose: &SourcePose,
        scratch: &mut Scratch,
    ) {
        if self.is_kept {
            self.keep(context.predicted.len(), context.time_s);
            return;
        }
        self.searches += 1;
        self.rays = 0;
        self.has_cast = false;
        let is_new = self.latest_late.is_none();
        self.is_searched = is_new || context.scope.has_source(self.id);
        self.keeps_others = context.scope.only_planes && !is_new;
        if context.scope.jumped.contains(&self.id) {
            self.drop_rays(context.round);
            self.nearby_gate = NearbyGate::default();
        }
        let slot = pose.id.slot() as u64;
        let turn = match self.latest_late {
            // A new source is due at once.
            None => Some(context.round),
            Some(_) if context.scope.skips_late => None,
            Some(_) => context.quality.late_turn(context.round, slot),
        };
        self.rotation = turn.map(|turn| turn % ROTATIONS);
        match turn {
            Some(turn) => self.update_late(context, index, pose, turn, &mut scratch.rays),
            None => self.predicted_late.clear(),
        }
        match (self.is_searched, self.keeps_others) {
            (true, false) => self.find_direct_and_diffracted(context, pose),
            (true, true) => {
                self.paths.retain(|path| !path.is_of_planes(context.scene));
                self.nearby.clear();
            }
            (false, _) => {}
        }
    }

    fn find_direct_and_diffracted(&mut self, context: &UpdateContext<'_>, pose: &SourcePose) {
        self.paths.clear();
        self.nearby.clear();
        self.near_edges = NearEdges::default();
        if !is_in_range(context, pose) {
            return;
        }
        let default_m = f64::from(context.settings.min_distance_m);
        let endpoints = Endpoints::of(pose, context.listener.position, default_m);
        let (rays, paths, near) = (&mut self.rays, &mut self.paths, &mut self.last_search);
        let order = context.settings.diffraction_order;
        let mut push = |path| paths.push(path);
        self.near_edges =
            diffraction::update(context.scene, &endpoints, order, near, rays, &mut push);
    }

    /// Whether none of the source's rays has left energy at the patches of the field.
    pub(super) fn is_outside_field(&self) -> bool {
        self.late.is_outside_field()
    }

    /// The field's patches have changed in a scene revision: its rays are cast again, each rotation in its turn.
    pub(super) fn follow_patches(&mut self, scene: &Scene, scene_state: u64) {
        self.late.follow_patches(scene, scene_state);
    }

    /// Drops what the source has left at the patches of an earlier field: as after a jump, all rotations are due. One that moves
    /// goes on moving: its rays start where later ones do.
    pub(super) fn forget_late(&mut self) {
        self.drop_estimate();
        self.missing_rotations = ROTATIONS as usize;
    }

    /// Casts the source's rays of rotation `turn` and estimates the late field. The rays of a moving source start at fixed
    /// points near it: the late energy then depends on its position and not on its past.
    fn update_late(
        &mut self,
        context: &UpdateContext<'_>,
        index: usize,
        pose: &SourcePose,
        turn: u64,
        scratch: &mut RayScratch,
    ) {
        let UpdateContext {
            scene, settings, ..
        } = *context;
        let position = scene.to_local(pose.position);
        let last = self.last_position.replace(position);
        // Another listener's turn of this round has cast the rays.
        let cast = self
            .cast_in
            .filter(|(round, _)| *round == context.round && context.listeners > 1);
        let is_cast = cast.is_some() && last == Some(position);
        let moves = match cast {
            Some((_, moves)) if is_cast => moves,
            _ => last.is_some_and(|last| last != position),
        };
        self.cast_in = Some((context.round, moves));
        let is_audible = pose.settings.effects.late;
        let missing = self.missing_rotations;
        let most_missing = match context.scope.late_sources {
            0 => CAST_AFTER_JUMP,
            sources => (ROTATIONS as usize).div_ceil(sources),
        };
        self.missing_rotations = match context.nearby_m {
            _ if is_cast => missing,
            Some(_) => 0,
            None => missing.saturating_sub(most_missing),
        };
        // The positions of an update share the casts: about one for each rotation. A walking source leaves the cells of two or three.
        let positions = context.predicted.len() + 1;
        let most_cast = (ROTATIONS as usize).div_ceil(positions);
        let most_near = match (self.near_casts.most(context.time_s), missing) {
            (most, 0) => most.div_ceil(positions),
            _ => most_cast,
        };
        let points = ExtentPoints::of(scene, pose, &mut self.rays);
        let mut late_at =
            |source: DVec3, listener: DVec3, cells: &VisibilityCells, field: &ListenerField| {
                let mut left = match (moves, context.nearby_m) {
                    (_, None) if missing > 0 => most_missing,
                    (false, Some(_)) if missing > 0 => ROTATIONS as usize,
                    (false, _) => 1,
                    (true, None) => MAX_CAST_ROTATIONS,
                    (true, Some(_)) => most_cast,
                };
                let mut left_near = match (moves, context.nearby_m) {
                    (true, Some(_)) => most_near,
                    _ => left,
                };
                let rays = &mut self.rays;
                for turn in turn..turn + ROTATIONS {
                    let is_near = self.late.distance_m(turn, source) <= NEAR_M;
                    if is_near && left_near == 0 {
                        continue;
                    }
                    // Each rotation starts at another point: their mean is that of a source with a size.
                    let offset = points.map(|points| points.of_rotation(turn, ROTATIONS));
                    let from = offset.map_or(source, |offset| source + offset);
                    // The lattices of a point are interleaved; those of several points are one, turned by all rotations, or each
                    // point would have its own directions.
                    let (lattice, turned) = match offset {
                        None => (turn, 0),
                        Some(_) => (0, turn),
                    };
                    let source_rays = SourceRays {
                        origin: match moves {
                            true => stable_viewpoint(scene, from, turn, rays),
                            false => from,
                        },
                        offset: offset.unwrap_or_default(),
                        field: context.scene_field,
                        pose: *pose,
                        directions: lattice_of(context.directions, lattice),
                        turn: rotation(turned, settings.seed),
                        rotation: turn % ROTATIONS,
                        depth: settings.depth,
                        scene_state: context.scene_state,
                        poses_since: context.poses_since,
                        fixed_since: context.fixed_since,
                    };
                    let is_new = self.late.cast_rays(scene, &source_rays, scratch, rays);
                    self.has_cast |= is_new;
                    left_near -= usize::from(is_new && is_near);
                    left -= usize::from(is_new || !moves || is_cast);
                    if left == 0 {
                        break;
                    }
                }
                self.late
                    .test_visibility(scene, [source, listener], cells, rays);
                match is_audible {
                    true => self
                        .late
                        .estimate(scene, context.scene_field, field, self.id),
                    false => LateEstimate::silent(self.id),
                }
            };
        self.predicted_late.clear();
        for there in context.predicted {
            let source = there.sources.get(index);
            let source = source.map_or(position, |source| scene.to_local(*source));
            let late = late_at(source, there.listener, &there.cells, &there.field);
            self.predicted_late.push(late);
        }
        let field = context.listener_field;
        self.latest_late = Some(late_at(position, context.ear, context.cells, field));
    }

    /// Second half of an update: reflected paths.
    pub(super) fn find_reflections(
        &mut self,
        context: &ReflectionContext<'_>,
        pose: &SourcePose,
        scratch: &mut Scratch,
    ) {
        if self.is_kept {
            return;
        }
        let update = &context.update;
        if !self.is_searched {
            self.nearby.clear();
            return;
        }
        if pose.settings.effects.reflections && is_in_range(update, pose) {
            let default_m = f64::from(update.settings.min_distance_m);
            let near_edges = self.near_edges;
            let query = SourceQuery {
                context: update,
                endpoints: Endpoints::of(pose, update.listener.position, default_m),
                ends: [update.scene.to_local(pose.position), update.ear],
                near_edges: &near_edges,
            };
            self.validate_candidates(context, &query, scratch);
            let (rays, paths) = (&mut self.rays, &mut self.paths);
            let mut push = |path| paths.push(path);
            if !self.keeps_others {
                curved_reflection::find(
                    update.scene,
                    &query.endpoints,
                    update.depth,
                    rays,
                    &mut push,
                );
                self.add_paths_for_missing_reflections(&query);
            }
            if update.nearby_m.is_some() {
                self.nearby_gate = NearbyGate::after(&mut self.nearby_estimates);
            }
            self.nearby_estimates.clear();
            keep_loudest(&mut self.nearby, &mut scratch.ranks);
        }
        let max_age = update
            .settings
            .cache_updates
            .saturating_mul(update.listeners);
        self.cache.end_update(self.searches, max_age);
    }

    fn validate_candidates(
        &mut self,
        context: &ReflectionContext<'_>,
        query: &SourceQuery<'_>,
        scratch: &mut Scratch,
    ) {
        let guide = context.guide.entries();
        for share in context.candidates {
            share.visible_from(self.view, |index, reflected| {
                self.queue(query, scratch, &guide[index], (index, reflected));
            });
        }
        self.walk_on(query);
        self.collect_own(context, scratch);
        for index in 0..scratch.rays.sequences.entries().len() {
            let sequence = scratch.rays.sequences.entries()[index];
            self.queue(query, scratch, &sequence, (guide.len() + index, None));
        }
        for length in 1..=MAX_ORDER {
            self.unfold(query, scratch, length);
        }
        self.validate(query, scratch);
        scratch.valid.sort_unstable_by_key(|(index, _)| *index);
        for (_, sequence) in scratch.valid.drain(..) {
            self.cache.insert(sequence, self.searches);
        }
    }

    /// Adds the diffracted paths that continue single reflections which are not valid. The others are nearby paths.
    fn add_paths_for_missing_reflections(&mut self, query: &SourceQuery<'_>) {
        let has_nearby = query.context.nearby_m.is_some();
        let found = self.paths.len();
        for near in query.near_edges.reflections.iter() {
            let is_continued = |found: &Path| {
                found.order == 1
                    && found.diffraction_order == 0
                    && near.0.is_beside(query.context.scene, found.surfaces[0])
            };
            let is_missing = !self.paths[..found].iter().any(is_continued);
            if is_missing || has_nearby {
                let path = path_in_shadow(query.context.scene, &query.endpoints, near);
                match is_missing {
                    true => self.paths.extend(path),
                    false => self.nearby.extend(path),
                }
            }
        }
    }

    /// Queues a candidate; unfolds a full batch.
    #[inline(always)]
    fn queue(
        &mut self,
        query: &SourceQuery<'_>,
        scratch: &mut Scratch,
        sequence: &Sequence,
        (index, reflected): (usize, Option<f32>),
    ) {
        let scene = query.context.scene;
        if scratch.queue.push(scene, sequence, index, reflected) {
            self.unfold(query, scratch, sequence.len());
        }
    }

    /// Unfolds the queued candidates of one length; validates when enough are unfolded.
    #[inline(never)]
    fn unfold(&mut self, query: &SourceQuery<'_>, scratch: &mut Scratch, length: usize) {
        let SourceQuery { context, ends, .. } = *query;
        let margin_m = MARGIN_M + context.nearby_m.unwrap_or(0.0);
        let (walk, own, marked) = (&self.walk, &scratch.own, self.late.packed_mut());
        let is_due = scratch.queue.unfold(
            context.scene,
            &self.occluders,
            length,
            ends,
            margin_m,
            (
                |sequence, unfolded, reflected| {
                    let gate = (self.nearby_gate, &mut self.nearby_estimates);
                    if let Some(path) = query.nearby_path(sequence, unfolded, reflected, gate) {
                        self.nearby.push(path);
                    }
                },
                |index, sequence, (batch, lane)| {
                    if let (Some(index), true) = (own.in_rays(index), walk.is_steady()) {
                        let miss = Miss {
                            scene: context.scene,
                            sequence,
                            batch,
                            lane,
                            source: ends[0],
                            margin_m,
                        };
                        marked.mark(index, walk.mark(miss.distance_m()));
                    }
                },
            ),
        );
        if is_due {
            self.validate(query, scratch);
        }
    }

    /// Adds the paths along the unfolded candidates, or nearby ones.
    fn validate(&mut self, query: &SourceQuery<'_>, scratch: &mut Scratch) {
        let (scene, occluders, valid) =
            (query.context.scene, &mut self.occluders, &mut scratch.valid);
        scratch
            .queue
            .validate(scene, occluders, |occluders, candidate, last| {
                let sequence = candidate.sequence;
                if query.is_valid(candidate, last, occluders, &mut self.rays) {
                    valid.push((candidate.index, sequence));
                    let path = query.valid_path(&sequence, &mut candidate.unfolded);
                    self.paths.push(path);
                } else if query.context.nearby_m.is_some() {
                    let gate = (self.nearby_gate, &mut self.nearby_estimates);
                    let (unfolded, reflected) = (&mut candidate.unfolded, candidate.reflected);
                    if let Some(path) = query.nearby_path(&sequence, unfolded, reflected, gate) {
                        self.nearby.push(path);
                    }
                }
            });
    }
}

/// Whether source and listener are at positions within [`MAX_COORDINATE_M`].
fn is_in_range(context: &UpdateContext<'_>, pose: &SourcePose) -> bool {
    let in_range = |at: DVec3| at.abs().max_element() < MAX_COORDINATE_M && at.is_finite();
    in_range(context.scene.to_local(pose.position)) && in_range(context.ear)
}
