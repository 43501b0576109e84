//! Results of one rotation's source rays, reused while neither source nor scene changes.

use glam::{DVec3, Mat3, Quat};

use crate::geometry::Ray;
use crate::propagation::diffuse::source_rays::SourceRays;
use crate::propagation::diffuse::static_hit_cache::StaticHitCache;
use crate::propagation::diffuse::trace::{TraceBuffers, trace_rays};
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::scene::{Directivity, Scene};
use crate::simd::LaneSet;

/// While instances move, one in this many legs may be stale. Stale rays may select other bounces: a door that swings in a
/// hall changed up to 1.1 dB of the late energy with one in 64 (`tests/remembered_rays.rs`).
const LEGS_PER_STALE_LEG: usize = 64;

/// All inputs of rays except the listener; the lattice is identified by its size.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CacheKey {
    origin: DVec3,
    orientation: Quat,
    directivity: Directivity,
    count: usize,
    turn: Mat3,
    rotation: u64,
    depth: usize,
    scene_state: u64,
}

impl CacheKey {
    fn of(from: &SourceRays<'_>, scene_state: u64) -> Self {
        Self {
            origin: from.origin,
            orientation: from.pose.orientation,
            directivity: from.pose.settings.directivity,
            count: from.count(),
            turn: from.turn,
            rotation: from.rotation,
            depth: from.depth,
            scene_state,
        }
    }
}

/// Validity of cached rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Validity {
    /// Tracing again has the same result.
    Valid,
    /// Moving instances affect few legs.
    NearlyValid,
    /// Trace again.
    Invalid,
}

/// Results of one rotation's rays.
#[derive(Debug, Clone, Default)]
pub(crate) struct CachedRays {
    key: Option<CacheKey>,
    /// The legs within the discrete depth, and how many end at an instance; none in a scene without instances.
    legs: Vec<Ray>,
    legs_to_instances: usize,
    /// Hits in the fixed scene and their key; none in a scene without instances.
    static_hits: StaticHitCache,
    static_hits_key: Option<CacheKey>,
}

impl CachedRays {
    /// Reserves memory for the results of `from`.
    pub(crate) fn reserve(&mut self, scene: &Scene, from: &SourceRays<'_>) {
        if scene.has_instances() {
            let most = from.count() * from.near_bounces();
            self.legs.reserve(most.saturating_sub(self.legs.len()));
            self.static_hits.reserve(from.count(), from.max_legs());
        }
    }

    /// Whether the results are those of `from`.
    pub(crate) fn validity(&self, scene: &Scene, from: &SourceRays<'_>) -> Validity {
        let Some(key) = self.key else {
            return Validity::Invalid;
        };
        if key == CacheKey::of(from, from.scene_state) {
            return Validity::Valid;
        }
        if key != CacheKey::of(from, key.scene_state) || key.scene_state < from.poses_since {
            return Validity::Invalid;
        }
        match self.are_stale(scene, self.legs.len() / LEGS_PER_STALE_LEG) {
            true => Validity::Invalid,
            false => Validity::NearlyValid,
        }
    }

    /// Whether instances affect more than `most` legs, where they were or where they are.
    fn are_stale(&self, scene: &Scene, most: usize) -> bool {
        let mut stale = self.legs_to_instances;
        let mut legs = self.legs.iter();
        while stale <= most {
            match legs.next() {
                Some(leg) => stale += usize::from(scene.enters_box_of_instance(leg)),
                None => return false,
            }
        }
        true
    }

    /// Whether some of the results are wrong now that the late field's patches have changed in `scene_state`: they are of that
    /// revision with other patches, or an instance affects a leg.
    pub(crate) fn is_contradicted(&self, scene: &Scene, scene_state: u64) -> bool {
        let of = self.key.map(|key| key.scene_state);
        of.is_some_and(|of| of == scene_state || self.are_stale(scene, 0))
    }

    /// Makes the results invalid.
    pub(crate) fn invalidate(&mut self) {
        self.key = None;
        self.static_hits_key = None;
    }

    /// Makes results of a scene revision invalid.
    pub(crate) fn invalidate_of(&mut self, scene_state: u64) {
        self.key.take_if(|key| key.scene_state == scene_state);
    }

    /// Traces the rays. `set` is empty and receives their specular prefixes.
    pub(crate) fn renew(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        set: &mut SequenceSet,
        buffers: &mut TraceBuffers,
        rays: &mut u64,
    ) {
        let (count, depth, far_rays) = (from.count(), from.near_bounces(), from.max_far_rays());
        buffers.near.renew(count, depth);
        buffers.far.renew(far_rays, from.far_bounces());
        buffers.statistics.renew(count, depth);
        if scene.has_instances() {
            buffers.statistics.legs.reserve(count * depth);
            let key = Some(CacheKey::of(from, from.fixed_since));
            let is_valid = std::mem::replace(&mut self.static_hits_key, key) == key;
            self.static_hits.begin(count, from.max_legs(), is_valid);
        }
        std::mem::swap(&mut self.static_hits, &mut buffers.static_hits);
        trace_rays(LaneSet::best(), scene, from, set, buffers, rays);
        std::mem::swap(&mut self.static_hits, &mut buffers.static_hits);
        let statistics = &buffers.statistics;
        self.legs.clear();
        self.legs.extend_from_slice(&statistics.legs);
        self.legs_to_instances = statistics.legs_to_instances;
        self.key = Some(CacheKey::of(from, from.scene_state));
    }
}
