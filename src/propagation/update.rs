//! One propagation update: discover, unfold, validate, weigh, sort.

use std::sync::Arc;

use glam::DVec3;

use super::amplitude;
use super::diffraction::{self, Spot};
use super::discovery::trace_guide_rays;
use super::image_source::{is_clear, mirror_listener, unfold};
use super::late::{LateEstimator, SourceRays};
use super::path::{MAX_BENDS, MAX_ORDER, Path, PathSet};
use super::sampling::{ROTATIONS, mix, rotation};
use super::sequence::{Sequence, SequenceSet};
use crate::error::{Error, Result};
use crate::scene::{ListenerPose, Scene, SourceId, SourcePose};

/// What propagation may spend, and where its limits are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PropagationSettings {
    /// Guide rays from the listener, 1 to 65,536. The paper: 1,024.
    pub guide_rays: u32,
    /// Source rays of each source, 1 to 65,536. The paper: 128.
    pub source_rays: u32,
    /// Highest reflection order, 0 to [`MAX_ORDER`]. The paper: 4.
    pub depth: usize,
    /// Seed of the rays' rotations and diffuse bounces.
    pub seed: u64,
    /// Updates for which a sequence that was valid is tried again without being rediscovered.
    pub cache_updates: u64,
    /// Sequences remembered for each source.
    pub cache_capacity: usize,
    /// Distance in metres below which a source gets no louder.
    pub nearest_m: f32,
    /// Most edges that one path bends around, 0 to [`MAX_BENDS`]; 0 is sound without diffraction.
    pub bends: usize,
}

impl Default for PropagationSettings {
    fn default() -> Self {
        Self {
            guide_rays: 1024,
            source_rays: 128,
            depth: MAX_ORDER,
            seed: 1,
            cache_updates: 16,
            cache_capacity: 2048,
            nearest_m: 0.3,
            bends: MAX_BENDS,
        }
    }
}

impl PropagationSettings {
    fn check(&self) -> Result<()> {
        let range = |name: &str, value: u64, low: u64, high: u64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            let problem = format!("{value} is outside {low} to {high}");
            Err(Error::setting(
                name,
                problem,
                "choose a value in that range",
            ))
        };
        range("guide_rays", self.guide_rays.into(), 1, 65_536)?;
        range("source_rays", self.source_rays.into(), 1, 65_536)?;
        range("depth", self.depth as u64, 0, MAX_ORDER as u64)?;
        range("bends", self.bends as u64, 0, MAX_BENDS as u64)?;
        range("cache_capacity", self.cache_capacity as u64, 1, 65_536)?;
        if self.nearest_m.is_finite() && self.nearest_m > 0.0 {
            return Ok(());
        }
        let problem = format!("{} is no distance", self.nearest_m);
        Err(Error::setting(
            "nearest_m",
            problem,
            "give metres above zero",
        ))
    }
}

/// What is remembered of one source between updates.
#[derive(Debug)]
struct SourceMemory {
    id: SourceId,
    late: LateEstimator,
    /// Sequences that were valid, with the update in which they last were.
    cache: Vec<(Sequence, u64)>,
}

/// Computes path sets of one scene. Owned by the propagation thread; one call at a time.
///
/// # Real-time
/// Not for the audio thread. Allocates while a scene is new, not afterwards.
#[derive(Debug)]
pub struct Propagator {
    scene: Arc<Scene>,
    settings: PropagationSettings,
    update: u64,
    memories: Vec<SourceMemory>,
    guide: SequenceSet,
    own: SequenceSet,
    next_cache: Vec<(Sequence, u64)>,
}

impl Propagator {
    /// For a committed scene.
    ///
    /// # Errors
    /// [`Error::Setting`] names a setting outside its range.
    pub fn new(scene: Arc<Scene>, settings: PropagationSettings) -> Result<Self> {
        settings.check()?;
        let guide_capacity = settings.guide_rays as usize * settings.depth.max(1);
        let own_capacity =
            settings.source_rays as usize * settings.depth.max(1) + settings.cache_capacity;
        Ok(Self {
            scene,
            settings,
            update: 0,
            memories: Vec::new(),
            guide: SequenceSet::with_capacity(guide_capacity),
            own: SequenceSet::with_capacity(own_capacity),
            next_cache: Vec::with_capacity(settings.cache_capacity),
        })
    }

    /// The scene that paths are computed in.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The settings in force.
    pub fn settings(&self) -> &PropagationSettings {
        &self.settings
    }

    /// Runs sixteen updates at one place and drops their results, so that every ray rotation has been seen there and
    /// the next update finds what a listener at rest would hear.
    pub fn warm_up(&mut self, listener: &ListenerPose, sources: &[SourcePose]) {
        let mut scratch = PathSet::default();
        for _ in 0..ROTATIONS {
            self.update(listener, sources, 0.0, &mut scratch);
        }
    }

    /// Computes all valid paths for these poses into `result`, whose memory is used again.
    pub fn update(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        time_s: f64,
        result: &mut PathSet,
    ) {
        let scene = Arc::clone(&self.scene);
        let ear = scene.to_local(listener.position);
        let mut rays = 0;
        let turn = rotation(self.update, self.settings.seed);
        self.guide.clear();
        trace_guide_rays(
            &scene,
            ear,
            &turn,
            self.settings.guide_rays,
            self.settings.depth,
            &mut self.guide,
            &mut rays,
        );
        self.forget_absent(sources);
        result.paths.clear();
        result.late.clear();
        result.direct_edges.clear();
        for pose in sources {
            self.update_source(&scene, listener, ear, pose, result, &mut rays);
        }
        result.paths.sort_unstable_by_key(|path| path.id);
        result.sources.clear();
        result.sources.extend_from_slice(sources);
        result.update = self.update;
        result.time_s = time_s;
        result.listener = *listener;
        result.rays = rays;
        self.update += 1;
    }

    fn update_source(
        &mut self,
        scene: &Scene,
        listener: &ListenerPose,
        ear: DVec3,
        pose: &SourcePose,
        result: &mut PathSet,
        rays: &mut u64,
    ) {
        let settings = self.settings;
        let origin = scene.to_local(pose.position);
        let place = self.memory_of(pose.id);
        let memory = &mut self.memories[place];
        self.own.clear();
        let source_rays = SourceRays {
            origin,
            turn: rotation(self.update, settings.seed ^ mix(u64::from(pose.id.bits()))),
            rotation: self.update % ROTATIONS,
            count: settings.source_rays,
            depth: settings.depth.max(1),
            seed: mix(settings.seed) ^ mix(u64::from(pose.id.bits())),
        };
        memory.late.trace(scene, &source_rays, &mut self.own, rays);
        result.late.push(memory.late.estimate(scene, pose.id));
        for (sequence, _) in &memory.cache {
            self.own.insert(*sequence);
        }
        let nearest_m = f64::from(settings.nearest_m);
        let spot = Spot {
            source: pose.id,
            from: pose.position,
            to: listener.position,
            nearest_m,
        };
        diffraction::update(scene, &spot, settings.bends, result, rays);
        self.next_cache.clear();
        let own = self
            .own
            .entries()
            .iter()
            .filter(|s| !self.guide.contains(s));
        for sequence in self.guide.entries().iter().chain(own) {
            if sequence.len() > settings.depth {
                continue;
            }
            let image = mirror_listener(scene, sequence, ear);
            let Some(path) = unfold(scene, sequence, origin, ear, image) else {
                continue;
            };
            if !is_clear(scene, &path, origin, ear, rays) {
                continue;
            }
            if self.next_cache.len() < settings.cache_capacity {
                self.next_cache.push((*sequence, self.update));
            }
            result.paths.push(Path {
                id: sequence.path_id(scene, pose.id),
                source: pose.id,
                order: path.order as u8,
                bends: 0,
                surfaces: path.surfaces,
                edges: [0; MAX_BENDS],
                points: path.points.map(|p| scene.to_world(p)),
                image: scene.to_world(path.image),
                length_m: path.length_m as f32,
                amplitude: amplitude::reflected(scene, &path, nearest_m),
            });
        }
        self.keep_recent(place);
    }

    /// Carries cached sequences over that were valid not long ago though not now.
    fn keep_recent(&mut self, place: usize) {
        let memory = &mut self.memories[place];
        let fresh = self.next_cache.len();
        for &(sequence, seen) in &memory.cache {
            let recent = self.update - seen < self.settings.cache_updates;
            let room = self.next_cache.len() < self.settings.cache_capacity;
            let renewed = || self.next_cache[..fresh].iter().any(|(s, _)| *s == sequence);
            if recent && room && !renewed() {
                self.next_cache.push((sequence, seen));
            }
        }
        std::mem::swap(&mut memory.cache, &mut self.next_cache);
    }

    fn memory_of(&mut self, id: SourceId) -> usize {
        if let Some(place) = self.memories.iter().position(|m| m.id == id) {
            return place;
        }
        self.memories.push(SourceMemory {
            id,
            late: LateEstimator::default(),
            cache: Vec::with_capacity(self.settings.cache_capacity),
        });
        self.memories.len() - 1
    }

    fn forget_absent(&mut self, sources: &[SourcePose]) {
        self.memories
            .retain(|memory| sources.iter().any(|pose| pose.id == memory.id));
    }
}
