//! One source's part of an update: source rays, direct path, validation of candidates. Depends on no other source, so
//! that sources can be spread over threads.

use glam::DVec3;

use super::amplitude;
use super::cache::SequenceCache;
use super::candidates::{Candidates, image_for_one};
use super::direct::direct_path_of;
use super::effort::Effort;
use super::image_source::unfold;
use super::late::{LateEstimator, SourceRays};
use super::occluders::Occluders;
use super::path::{LateSource, Path};
use super::sampling::{ROTATIONS, mix, rotation};
use super::sequence::Sequence;
use super::sequence_set::SequenceSet;
use super::settings::PropagationSettings;
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

/// Farthest from the scene's centre that source and listener are heard, in metres along an axis: squares of such lengths
/// are far within single precision, which rays are cast in. Anything beyond, or no number at all, has no path.
const FARTHEST_M: f64 = 1e9;

/// Paths that a source has room for at first.
const PATHS_AT_FIRST: usize = 256;

/// What all sources share in one update.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shared<'a> {
    pub(super) scene: &'a Scene,
    pub(super) settings: &'a PropagationSettings,
    pub(super) effort: &'a Effort,
    pub(super) update: u64,
    pub(super) listener: &'a ListenerPose,
    /// The listener, local coordinates.
    pub(super) ear: DVec3,
    /// What guide rays have found.
    pub(super) guide: &'a SequenceSet,
    /// The same, made ready.
    pub(super) candidates: &'a [Candidates],
}

/// What is remembered of one source between updates, and what the last update gave.
#[derive(Debug)]
pub(super) struct SourceTask {
    id: SourceId,
    /// Whether its source has gone, so that another can have it.
    pub(super) waits: bool,
    late: LateEstimator,
    cache: SequenceCache,
    occluders: Occluders,
    own: SequenceSet,
    /// Candidates that the first look has left over.
    likely: Vec<(u32, DVec3)>,
    /// Valid paths in no order that means anything.
    pub(super) paths: Vec<Path>,
    pub(super) late_source: Option<LateSource>,
    pub(super) rays: u64,
}

impl SourceTask {
    /// Nothing is known yet of this source.
    pub(super) fn new(id: SourceId, settings: &PropagationSettings, candidates: usize) -> Self {
        let own = settings.source_rays as usize * settings.depth.max(1) + settings.cache_capacity;
        Self {
            id,
            waits: false,
            late: LateEstimator::default(),
            cache: SequenceCache::with_capacity(settings.cache_capacity),
            occluders: Occluders::default(),
            own: SequenceSet::with_capacity(own),
            likely: Vec::with_capacity(candidates),
            paths: Vec::with_capacity(PATHS_AT_FIRST),
            late_source: None,
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
        self.waits = false;
        self.late = LateEstimator::default();
        self.late_source = None;
        self.cache.clear();
    }

    /// Does the whole part of this source.
    pub(super) fn run(&mut self, shared: &Shared<'_>, pose: &SourcePose) {
        let origin = shared.scene.to_local(pose.position);
        self.rays = 0;
        self.paths.clear();
        self.trace(shared, pose, origin);
        let within_reach =
            |place: DVec3| place.abs().max_element() < FARTHEST_M && place.is_finite();
        if within_reach(origin) && within_reach(shared.ear) {
            self.find_paths(shared, pose, origin);
        }
        let most = shared.settings.cache_updates;
        self.cache.turn(shared.update, most);
    }

    /// The direct path and all reflected ones.
    fn find_paths(&mut self, shared: &Shared<'_>, pose: &SourcePose, origin: DVec3) {
        let otherwise_m = f64::from(shared.settings.nearest_m);
        let to = shared.listener.position;
        self.paths.extend(direct_path_of(
            shared.scene,
            pose,
            to,
            otherwise_m,
            &mut self.rays,
        ));
        if pose.settings.effects.reflections {
            self.validate(shared, pose, origin);
        }
    }

    /// Casts the source's rays; what they find and what was valid before is this source's own list.
    fn trace(&mut self, shared: &Shared<'_>, pose: &SourcePose, origin: DVec3) {
        self.own.clear();
        let place = pose.id.slot() as u64;
        let turn = match self.late_source {
            // A new source is not kept waiting.
            None => Some(shared.update),
            Some(_) => shared.effort.late_turn(shared.update, place),
        };
        if let Some(turn) = turn {
            self.cast(shared, pose, origin, turn);
        }
        for sequence in self.cache.entries() {
            self.own.insert(*sequence);
        }
    }

    /// Casts the source's rays by rotation number `turn` and renews the late field.
    fn cast(&mut self, shared: &Shared<'_>, pose: &SourcePose, origin: DVec3, turn: u64) {
        let settings = shared.settings;
        let own_seed = mix(u64::from(self.id.bits()));
        let source_rays = SourceRays {
            origin,
            listener: shared.ear,
            pose: *pose,
            turn: rotation(turn, settings.seed ^ own_seed),
            rotation: turn % ROTATIONS,
            count: settings.source_rays,
            depth: settings.depth,
            seed: mix(settings.seed) ^ own_seed,
        };
        self.late
            .trace(shared.scene, &source_rays, &mut self.own, &mut self.rays);
        self.late_source = Some(match pose.settings.effects.late {
            true => self.late.estimate(shared.scene, self.id),
            false => LateSource::silent(self.id),
        });
    }

    fn validate(&mut self, shared: &Shared<'_>, pose: &SourcePose, origin: DVec3) {
        self.likely.clear();
        for share in shared.candidates {
            share.of_source(origin, |number, image| {
                self.likely.push((number as u32, image));
            });
        }
        for place in 0..self.likely.len() {
            let (number, image) = self.likely[place];
            let sequence = shared.guide.entries()[number as usize];
            self.try_candidate(shared, &sequence, pose, origin, image);
        }
        for place in 0..self.own.entries().len() {
            let sequence = self.own.entries()[place];
            let tried = sequence.len() > shared.settings.depth || shared.guide.contains(&sequence);
            if tried {
                continue;
            }
            if let Some(image) = image_for_one(shared.scene, &sequence, origin, shared.ear) {
                self.try_candidate(shared, &sequence, pose, origin, image);
            }
        }
    }

    /// Adds the path along a sequence if there is one.
    fn try_candidate(
        &mut self,
        shared: &Shared<'_>,
        sequence: &Sequence,
        pose: &SourcePose,
        origin: DVec3,
        image: DVec3,
    ) {
        let scene = shared.scene;
        let Some(path) = unfold(scene, sequence, origin, shared.ear, image) else {
            return;
        };
        let ends = [origin, shared.ear];
        let hash = sequence.hash();
        if !self
            .occluders
            .is_clear(scene, hash, &path, ends, &mut self.rays)
        {
            return;
        }
        self.cache.renew(*sequence, shared.update);
        let nearest_m = pose
            .settings
            .nearest_m(f64::from(shared.settings.nearest_m));
        let mut amplitude = amplitude::reflected(scene, &path, nearest_m);
        let departure = (path.points[0] - origin).as_vec3();
        amplitude::direct_by_source(&mut amplitude, pose, departure);
        self.paths.push(Path {
            id: sequence.path_id(scene, self.id),
            source: self.id,
            order: path.order as u8,
            surfaces: path.surfaces,
            points: path.points.map(|p| scene.to_world(p)),
            image: scene.to_world(path.image),
            length_m: path.length_m as f32,
            amplitude,
        });
    }
}
