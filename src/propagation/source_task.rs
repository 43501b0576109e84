//! One source's part of an update: source rays, direct field, bent paths, validation of candidates. Depends on no other source, so
//! that sources can be spread over threads.

use glam::{DVec3, Vec3};

use super::amplitude;
use super::diffraction::{self, DirectEdges};
use super::endpoints::Endpoints;
use super::path::{LateEnergy, MAX_DIFFRACTION_ORDER, MAX_ORDER, Path};
use super::settings::PropagationSettings;
use crate::acoustics::BandArray;
use crate::propagation::diffuse::{
    LateEstimator, RayScratch, SourceRays, VisibilityCells, stable_viewpoint,
};
use crate::propagation::image_source::image_path::{ImagePath, Unfolded};
use crate::propagation::image_source::occluder_cache::{Blocked, Occluders};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::image_source::valid_cache::SequenceCache;
use crate::propagation::image_source::validation_queue::{Standing, Waiting};
use crate::propagation::image_source::window_cull::{Candidates, Ready};
use crate::propagation::quality_level::PropagationQuality;
use crate::propagation::rays::directions::{ROTATIONS, mix, rotation};
use crate::scene::edges::NearEdges;
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

/// Rotations whose rays a moving source casts anew in one update at most, as many as while it is at rest. One who walks leaves
/// one of its still places every hundredth of a second.
const MOST_CAST: usize = 1;

/// Farthest from the scene's centre that source and listener are heard, in metres along an axis: squares of such lengths
/// are far within single precision, which rays are cast in. Anything beyond, or no number at all, has no path.
const FARTHEST_M: f64 = 1e9;

/// Paths that a source has room for at first.
const PATHS_AT_FIRST: usize = 256;

/// Most paths nearby that an update names of one source.
const MOST_NEARBY: usize = 256;

/// Another place where the listener may be.
#[derive(Debug, Default)]
pub(super) struct PredictedPosition {
    pub(super) place: Vec3,
    /// The same, local coordinates.
    pub(super) ear: DVec3,
    pub(super) viewpoints: VisibilityCells,
    /// Where the sources will be then, world coordinates.
    pub(super) sources: Vec<Vec3>,
}

/// Sequences that a source tries for itself in an update that names what is nearby, as far as other rotations' rays have found
/// so many.
const MOST_OWN: usize = 2048;

/// What is known when an update begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment<'a> {
    pub(super) scene: &'a Scene,
    pub(super) settings: &'a PropagationSettings,
    pub(super) effort: &'a PropagationQuality,
    pub(super) update: u64,
    /// See [`SourceRays::scene_state`], [`SourceRays::poses_since`] and [`SourceRays::fixed_since`].
    pub(super) scene_state: u64,
    pub(super) poses_since: u64,
    pub(super) fixed_since: u64,
    pub(super) listener: &'a ListenerPose,
    /// The listener, local coordinates.
    pub(super) ear: DVec3,
    /// From where late fields are looked at.
    pub(super) viewpoints: &'a VisibilityCells,
    /// Other places that late fields are estimated for.
    pub(super) way: &'a [PredictedPosition],
    /// Within what distance paths are named that are not there; nothing names none.
    pub(super) reach_m: Option<f64>,
    /// The source rays' lattice before rotation.
    pub(super) directions: &'a [Vec3],
}

/// What all sources share once guide rays have been cast.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shared<'a> {
    pub(super) moment: Moment<'a>,
    /// What guide rays have found.
    pub(super) guide: &'a SequenceSet,
    /// The same, made ready.
    pub(super) candidates: &'a [Candidates],
}

/// What a thread does a source's part of an update in, and then another one's: nothing of it is remembered, and no two threads
/// write to one line of it.
#[derive(Debug)]
#[repr(align(128))]
pub(super) struct Scratch {
    /// Also sequences that a source alone tries.
    rays: RayScratch,
    /// Candidates whose turn comes next.
    waiting: Waiting,
    /// Those that have a path, by number.
    valid: Vec<(u32, Sequence)>,
    /// Where the points of what is nearby lie.
    unfolded: Unfolded,
}

impl Scratch {
    /// Room for what settings ask for.
    pub(super) fn new(settings: &PropagationSettings) -> Self {
        let own = settings.source_rays as usize * settings.depth.max(1) + settings.cache_capacity;
        Self {
            rays: RayScratch::with_capacity(own),
            waiting: Waiting::new(),
            valid: Vec::with_capacity(PATHS_AT_FIRST),
            unfolded: Unfolded::default(),
        }
    }
}

/// What is remembered of one source between updates, and what the last update gave. Far enough from the next one that two
/// threads write to no common cache line, nor to two that are fetched together.
#[derive(Debug)]
#[repr(align(128))]
pub(super) struct SourceTask {
    id: SourceId,
    /// Where it was when its rays were cast last, local coordinates.
    place: Option<DVec3>,
    /// Whether its source has gone, so that another can have it.
    pub(super) waits: bool,
    late: LateEstimator,
    cache: SequenceCache,
    occluders: Occluders,
    /// Rotation of the rays that were cast in this update, or found what they would find again.
    rotation: Option<u64>,
    /// Valid paths in no order that means anything.
    pub(super) paths: Vec<Path>,
    /// Those that are not there, in no order either.
    pub(super) nearby: Vec<Path>,
    /// Edges near the straight line in the last update.
    near: NearEdges,
    /// Edges that its direct field is followed at until the next update.
    pub(super) direct_edges: DirectEdges,
    pub(super) late_source: Option<LateEnergy>,
    /// The same for the other places, in their order.
    pub(super) predicted_late: Vec<LateEnergy>,
    pub(super) rays: u64,
}

impl SourceTask {
    /// Nothing is known yet of this source.
    pub(super) fn new(id: SourceId, settings: &PropagationSettings) -> Self {
        Self {
            id,
            place: None,
            waits: false,
            late: LateEstimator::default(),
            cache: SequenceCache::with_capacity(settings.cache_capacity),
            occluders: Occluders::default(),
            rotation: None,
            paths: Vec::with_capacity(PATHS_AT_FIRST),
            nearby: Vec::new(),
            near: NearEdges::default(),
            direct_edges: DirectEdges::default(),
            late_source: None,
            predicted_late: Vec::new(),
            rays: 0,
        }
    }

    /// Whether it remembers this source.
    pub(super) fn belongs_to(&self, id: SourceId) -> bool {
        self.id == id && !self.waits
    }

    /// Becomes another source's; the memory stays.
    pub(super) fn reset(&mut self, id: SourceId) {
        self.id = id;
        self.place = None;
        self.waits = false;
        self.late = LateEstimator::default();
        self.late_source = None;
        self.cache.clear();
    }

    /// First half, which does not wait for guide rays: casts the source's own, and finds the direct path and bent ones.
    pub(super) fn trace(
        &mut self,
        moment: &Moment<'_>,
        number: usize,
        pose: &SourcePose,
        scratch: &mut Scratch,
    ) {
        self.rays = 0;
        let place = pose.id.slot() as u64;
        let turn = match self.late_source {
            // A new source is not kept waiting.
            None => Some(moment.update),
            Some(_) => moment.effort.late_turn(moment.update, place),
        };
        self.rotation = turn.map(|turn| turn % ROTATIONS);
        match turn {
            Some(turn) => self.cast(moment, number, pose, turn, &mut scratch.rays),
            None => self.predicted_late.clear(),
        }
        self.bend(moment, pose);
    }

    /// The direct path and bent ones.
    fn bend(&mut self, moment: &Moment<'_>, pose: &SourcePose) {
        self.paths.clear();
        self.nearby.clear();
        self.direct_edges = DirectEdges::default();
        if !is_within_reach(moment, pose) {
            return;
        }
        let otherwise_m = f64::from(moment.settings.min_distance_m);
        let spot = Endpoints::of(pose, moment.listener.position, otherwise_m);
        let (rays, paths, near) = (&mut self.rays, &mut self.paths, &mut self.near);
        let diffraction_order = moment.settings.diffraction_order;
        let mut give = |path| paths.push(path);
        self.direct_edges = diffraction::update(
            moment.scene,
            &spot,
            diffraction_order,
            near,
            rays,
            &mut give,
        );
    }

    /// What this source's rays have found and what was valid before, and guide rays have not met: its own list.
    fn gather_own(&mut self, shared: &Shared<'_>, own: &mut SequenceSet) {
        let Moment {
            scene, settings, ..
        } = shared.moment;
        let moves = scene.has_instances();
        own.clear();
        let mut add = |sequence: Sequence| {
            let hash = sequence.hash();
            if sequence.len() <= settings.depth && !shared.guide.contains_hashed(&sequence, hash) {
                own.insert_hashed(sequence, hash);
            }
        };
        if let Some(rotation) = self.rotation {
            self.late.sequences(rotation).iter().for_each(|s| add(*s));
        }
        for sequence in self.cache.entries() {
            add(match moves {
                // What commutes depends on how instances stand.
                true => Sequence::canonical(scene, sequence.surfaces()),
                false => *sequence,
            });
        }
        // What other rotations have found, of which none is lost while the source stays: where there is time.
        let Some(rotation) = self.rotation.filter(|_| shared.moment.reach_m.is_some()) else {
            return;
        };
        for other in 1..ROTATIONS {
            for sequence in self.late.sequences(rotation + other) {
                if own.entries().len() >= MOST_OWN {
                    return;
                }
                let sequence = match moves {
                    true => Sequence::canonical(scene, sequence.surfaces()),
                    false => *sequence,
                };
                if sequence.len() <= settings.depth && !shared.guide.contains(&sequence) {
                    own.insert(sequence);
                }
            }
        }
    }

    /// Casts the source's rays by rotation number `turn` and renews the late field; it is number `place` of all. A moving source's
    /// rays start at places near it that stand still, so that its tail depends on where it is and not on how it came there.
    fn cast(
        &mut self,
        moment: &Moment<'_>,
        place: usize,
        pose: &SourcePose,
        turn: u64,
        scratch: &mut RayScratch,
    ) {
        let Moment {
            scene, settings, ..
        } = *moment;
        let own_seed = mix(u64::from(self.id.bits()));
        let here = scene.to_local(pose.position);
        let moves = self.place.replace(here).is_some_and(|last| last != here);
        let is_wanted = pose.settings.effects.late;
        let estimate = |late: &mut LateEstimator| match is_wanted {
            true => late.estimate(scene, self.id),
            false => LateEnergy::silent(self.id),
        };
        let mut late_at = |source: DVec3, ear: DVec3, viewpoints: &VisibilityCells| {
            let mut left = match (moves, moment.reach_m) {
                (false, _) => 1,
                (true, None) => MOST_CAST,
                (true, Some(_)) => ROTATIONS as usize,
            };
            for turn in turn..turn + ROTATIONS {
                let rays = &mut self.rays;
                let source_rays = SourceRays {
                    origin: match moves {
                        true => stable_viewpoint(scene, source, turn, rays),
                        false => source,
                    },
                    listener: ear,
                    viewpoints,
                    pose: *pose,
                    directions: moment.directions,
                    turn: rotation(turn, settings.seed ^ own_seed),
                    rotation: turn % ROTATIONS,
                    depth: settings.depth,
                    seed: mix(settings.seed) ^ own_seed,
                    scene_state: moment.scene_state,
                    poses_since: moment.poses_since,
                    fixed_since: moment.fixed_since,
                };
                let is_new = self.late.cast_rays(scene, &source_rays, scratch, rays);
                left -= usize::from(is_new || !moves);
                if left == 0 {
                    break;
                }
            }
            self.late
                .test_visibility(scene, [source, ear], viewpoints, &mut self.rays);
            estimate(&mut self.late)
        };
        self.predicted_late.clear();
        for there in moment.way {
            let source = there
                .sources
                .get(place)
                .map_or(here, |at| scene.to_local(*at));
            let late = late_at(source, there.ear, &there.viewpoints);
            self.predicted_late.push(late);
        }
        self.late_source = Some(late_at(here, moment.ear, moment.viewpoints));
    }

    /// Second half: reflected paths. It is number `place` of all.
    pub(super) fn find(
        &mut self,
        shared: &Shared<'_>,
        place: usize,
        pose: &SourcePose,
        scratch: &mut Scratch,
    ) {
        let moment = &shared.moment;
        if pose.settings.effects.reflections && is_within_reach(moment, pose) {
            self.validate(shared, place, pose, scratch);
            keep_loudest(&mut self.nearby);
        }
        let most = moment.settings.cache_updates;
        self.cache.turn(moment.update, most);
    }

    fn validate(
        &mut self,
        shared: &Shared<'_>,
        place: usize,
        pose: &SourcePose,
        scratch: &mut Scratch,
    ) {
        let origin = shared.moment.scene.to_local(pose.position);
        let trial = Trial {
            moment: &shared.moment,
            pose,
            ends: [origin, shared.moment.ear],
        };
        let guide = shared.guide.entries();
        for share in shared.candidates {
            share.seen_from(place, |number| {
                self.put(&trial, scratch, &guide[number], number);
            });
        }
        self.gather_own(shared, &mut scratch.rays.sequences);
        for place in 0..scratch.rays.sequences.entries().len() {
            let sequence = scratch.rays.sequences.entries()[place];
            self.put(&trial, scratch, &sequence, guide.len() + place);
        }
        for length in 1..=MAX_ORDER {
            self.unfold(&trial, scratch, length);
        }
        self.try_all(&trial, scratch);
        scratch.valid.sort_unstable_by_key(|(number, _)| *number);
        for (_, sequence) in scratch.valid.drain(..) {
            self.cache.renew(sequence, shared.moment.update);
        }
    }

    /// Has a candidate wait for its turn, and those that it was waited for take theirs.
    #[inline(always)]
    fn put(
        &mut self,
        trial: &Trial<'_>,
        scratch: &mut Scratch,
        sequence: &Sequence,
        number: usize,
    ) {
        let waiting = &mut scratch.waiting;
        if waiting.put(trial.moment.scene, sequence, number) {
            self.unfold(trial, scratch, sequence.len());
        }
    }

    /// Unfolds the candidates of one length that wait.
    #[inline(never)]
    fn unfold(&mut self, trial: &Trial<'_>, scratch: &mut Scratch, length: usize) {
        let Trial { moment, ends, .. } = *trial;
        let (waiting, unfolded) = (&mut scratch.waiting, &mut scratch.unfolded);
        let is_time = waiting.unfold(
            moment.scene,
            &self.occluders,
            length,
            ends,
            |four, lane, sequence| {
                if let Some(reach_m) = moment.reach_m {
                    let ready = four.ready(lane, length);
                    self.nearby
                        .extend(nearby(trial, unfolded, sequence, &ready, reach_m));
                }
            },
        );
        if is_time {
            self.try_all(trial, scratch);
        }
    }

    /// Adds the paths along the candidates that are left, or has them nearby.
    fn try_all(&mut self, trial: &Trial<'_>, scratch: &mut Scratch) {
        let Trial { moment, pose, .. } = *trial;
        let Scratch {
            waiting,
            valid,
            unfolded,
            ..
        } = scratch;
        let scene = moment.scene;
        waiting.try_all(scene, &mut self.occluders, |occluders, standing, last| {
            let sequence = &standing.sequence;
            if let Some(path) = open(trial, standing, last, occluders, &mut self.rays) {
                valid.push((standing.number, *sequence));
                let level = amplitude::reflected;
                self.paths
                    .push(reflected_path(moment, sequence, pose, &path, level));
            } else if let Some(reach_m) = moment.reach_m {
                let ready = Ready::of(scene, sequence, moment.ear);
                self.nearby
                    .extend(nearby(trial, unfolded, sequence, &ready, reach_m));
            }
        });
    }
}

/// What all candidates of a source are tried with.
#[derive(Debug, Clone, Copy)]
struct Trial<'a> {
    moment: &'a Moment<'a>,
    pose: &'a SourcePose,
    /// Source and listener, local coordinates.
    ends: [DVec3; 2],
}

/// The geometry of the path along a candidate that is left, if nothing blocks it and its points lie on its surfaces.
///
/// What was blocked most likely is again, which is sooner known than whether a point lies on any surface.
fn open(
    trial: &Trial<'_>,
    standing: &Standing,
    last: Option<Blocked>,
    occluders: &mut Occluders,
    rays: &mut u64,
) -> Option<ImagePath> {
    let (scene, ends, unfolded) = (trial.moment.scene, trial.ends, &standing.unfolded);
    let legs = unfolded.legs();
    if last.is_some_and(|blocked| blocked.again(scene, legs, ends))
        || !unfolded.lies_on_surfaces(scene)
        || !occluders.is_clear(scene, standing.hash, legs, ends, rays)
    {
        return None;
    }
    Some(unfolded.finish(scene, [ends[0], unfolded.goal()]))
}

/// The path along a candidate that is not there, but may be for a listener within `reach_m` metres.
fn nearby(
    trial: &Trial<'_>,
    unfolded: &mut Unfolded,
    sequence: &Sequence,
    ready: &Ready,
    reach_m: f64,
) -> Option<Path> {
    let Trial { moment, pose, ends } = *trial;
    let (scene, line) = (moment.scene, [ends[0], ready.image]);
    let is_there = unfolded.along_nearby(scene, sequence, &ready.order, line, reach_m);
    is_there.then(|| {
        let path = unfolded.finish(scene, line);
        reflected_path(moment, sequence, pose, &path, amplitude::unbounded)
    })
}

/// Whether source and listener are where sound is followed.
fn is_within_reach(moment: &Moment<'_>, pose: &SourcePose) -> bool {
    let within = |place: DVec3| place.abs().max_element() < FARTHEST_M && place.is_finite();
    within(moment.scene.to_local(pose.position)) && within(moment.ear)
}

/// The path of a source along a sequence.
fn reflected_path(
    moment: &Moment<'_>,
    sequence: &Sequence,
    pose: &SourcePose,
    path: &ImagePath,
    level: impl Fn(&Scene, &ImagePath, f64) -> BandArray,
) -> Path {
    let scene = moment.scene;
    let min_distance_m = pose
        .settings
        .min_distance_m(f64::from(moment.settings.min_distance_m));
    let mut amplitude = level(scene, path, min_distance_m);
    let departure = (path.points[0] - scene.to_local(pose.position)).as_vec3();
    amplitude::direct_by_source(&mut amplitude, pose, departure);
    Path {
        id: sequence.path_id(scene, pose.id),
        source: pose.id,
        order: path.order as u8,
        diffraction_order: 0,
        surfaces: path.surfaces,
        edges: [0; MAX_DIFFRACTION_ORDER],
        points: path.points.map(|p| scene.to_world(p)),
        image: scene.to_world(path.image),
        length_m: path.length_m as f32,
        amplitude,
    }
}

/// Keeps the loudest [`MOST_NEARBY`].
fn keep_loudest(nearby: &mut Vec<Path>) {
    if nearby.len() > MOST_NEARBY {
        let energy = |path: &Path| path.amplitude.iter().map(|a| a * a).sum::<f32>();
        nearby.select_nth_unstable_by(MOST_NEARBY, |a, b| {
            energy(b)
                .total_cmp(&energy(a))
                .then_with(|| a.id.cmp(&b.id))
        });
        nearby.truncate(MOST_NEARBY);
    }
}
