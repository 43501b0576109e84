//! Diffuse late sound of one source: the energy outside of discrete paths, its arrival times and its decay.
//!
//! Runs within a propagation update. Input: source and listener; output: a [`LateEnergy`]. Bounded by the rays of one update
//! (`count × depth + FAR_RAYS × FAR_BOUNCES`) and [`next_event::SHADOW_RAYS`] rays to the listener for each of sixteen
//! rotations: none for a listener at rest, a few for a walking one ([`visibility_cells`]).
//!
//! Energy balance (own; next-event estimation after \[SCHROEDER11\], "diffuse rain"): a source sends an energy of 4π (free
//! field of 1 at 1 m) in equal shares along its rays. A bounce reflects the share times the product of reflected
//! energies. Discrete paths carry the product of specular energies of it, within their depth and as long as every surface
//! is a panel. *The rest is late energy*: scattered sound, reflections of small facets, and orders beyond the depth. It
//! leaves the bounce by Lambert's law and is connected to the listener; neither a room's volume nor a ceiling is
//! required. Decay: [`decay_fit`]. Energy envelope without gap or overlap with discrete paths: [`envelope`].
//!
//! Sixteen rotations of the ray lattice take turns, and the estimate is their sum, independent of the time and index of
//! updates in a scene at rest. A rotation's rays are cached: they are traced again only after source or scene have
//! changed, with the same bits. While instances move, rays stay valid as long as few of them are affected; sixteen updates
//! after the last motion all are exact. The cache takes about 0.4 MB per source with 128 rays to a depth of 4
//! (`cached_rays`), and 0.4 MB more in a scene with instances (`static_hit_cache`).

mod bounce_buffer;
mod cached_rays;
pub mod decay_fit;
pub mod envelope;
pub mod next_event;
mod ray_statistics;
pub mod source_rays;
mod static_hit_cache;
mod trace;
pub mod visibility_cells;

pub use crate::propagation::diffuse::envelope::{LateSegment, common_decay, late_segments};
pub use crate::propagation::diffuse::source_rays::SourceRays;
pub use crate::propagation::diffuse::visibility_cells::{VisibilityCells, stable_viewpoint};

use glam::{DVec3, Vec3};

use crate::propagation::diffuse::cached_rays::{CachedRays, Validity};
use crate::propagation::diffuse::decay_fit::{CurveTree, Decay};
use crate::propagation::diffuse::envelope::ArrivalHistogram;
use crate::propagation::diffuse::next_event::SecondarySources;
use crate::propagation::diffuse::trace::TraceBuffers;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::path::LateEnergy;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::{Scene, SourceId};

/// Distance in metres of a moving source from a rotation's origin up to which the rotation has at least half the weight,
/// and the number of rotations that have it at any distance. Keeps the estimate local while a source moves.
const SAME_POSITION_M: f64 = 0.35;
const MIN_ROTATIONS: usize = 6;

/// Weight of a rotation traced at a distance from the source: 1 at 0 m, ½ at `reach_m`.
fn weight(distance_m: f64, reach_m: f64) -> f64 {
    // At an infinite distance no rotation is nearer than another.
    if !distance_m.is_finite() {
        return 1.0;
    }
    let square = (distance_m / reach_m).powi(2);
    1.0 / (1.0 + square * square)
}

/// Results of one rotation.
#[derive(Debug, Clone, Default)]
struct RotationEntry {
    filled: bool,
    /// The source when the rays were traced, local coordinates.
    origin: DVec3,
    cached: CachedRays,
    secondary: SecondarySources,
}

/// Per-thread scratch, reused across sources.
#[derive(Debug, Clone)]
pub struct RayScratch {
    /// Specular prefixes of rays, each once.
    pub(crate) sequences: SequenceSet,
    buffers: TraceBuffers,
}

impl RayScratch {
    /// Memory for so many sequences; it grows if rays find more.
    pub fn with_capacity(sequences: usize) -> Self {
        Self {
            sequences: SequenceSet::with_capacity(sequences),
            buffers: TraceBuffers::default(),
        }
    }
}

/// Running estimate of one source's late field.
#[derive(Debug, Clone)]
pub struct LateEstimator {
    entries: Vec<RotationEntry>,
    curves: CurveTree,
    /// Decay of the curves, unless they have changed since.
    decay: Option<Option<Decay>>,
    /// The latest position of the source, local coordinates.
    source: DVec3,
    /// Delay of the straight line.
    nearest_s: f64,
    /// The latest position of the listener, local coordinates.
    listener: Vec3,
}

impl Default for LateEstimator {
    fn default() -> Self {
        Self {
            entries: vec![RotationEntry::default(); ROTATIONS as usize],
            curves: CurveTree::default(),
            decay: None,
            source: DVec3::ZERO,
            nearest_s: 0.0,
            listener: Vec3::ZERO,
        }
    }
}

impl LateEstimator {
    /// Traces source rays with diffuse bounces, unless the cached results are valid, and connects them to the listener. Adds
    /// the rays cast to `rays`.
    pub fn trace(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        scratch: &mut RayScratch,
        rays: &mut u64,
    ) {
        self.cast_rays(scene, from, scratch, rays);
        let ends = [from.origin, from.listener];
        self.test_visibility(scene, ends, from.viewpoints, rays);
    }

    /// The first half of [`Self::trace`]; returns whether rays were cast.
    pub fn cast_rays(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        scratch: &mut RayScratch,
        rays: &mut u64,
    ) -> bool {
        let index = (from.rotation % ROTATIONS) as usize;
        for entry in &mut self.entries {
            entry.cached.reserve(scene, from);
            entry.secondary.reserve();
        }
        let entry = &mut self.entries[index];
        let validity = entry.cached.validity(scene, from);
        let is_new = validity == Validity::Invalid;
        if validity == Validity::NearlyValid {
            entry.secondary.invalidate_visibility();
        }
        if is_new {
            let RayScratch { sequences, buffers } = scratch;
            sequences.clear();
            self.curves.prefetch(index);
            self.curves.renew(index, |curve| {
                entry
                    .cached
                    .renew(scene, from, sequences, curve, buffers, rays);
            });
            self.decay = None;
            let TraceBuffers {
                near, far, sums, ..
            } = buffers;
            entry.secondary.select(scene, near, far, sums);
        }
        entry.filled = true;
        entry.origin = from.origin;
        is_new
    }

    /// The second half: connects all rotations to a listener, for [`Self::estimate`]. Source and listener are in local
    /// coordinates. Adds the rays cast to `rays`.
    pub fn test_visibility(
        &mut self,
        scene: &Scene,
        [source, listener]: [DVec3; 2],
        viewpoints: &VisibilityCells,
        rays: &mut u64,
    ) {
        for index in 0..self.entries.len() {
            // Sixteen rotations of as many sources exceed the cache between updates.
            if let Some(next) = self.entries.get(index + 1) {
                next.secondary.prefetch();
            }
            let entry = &mut self.entries[index];
            if entry.filled {
                let viewpoints = viewpoints.of_rotation(index);
                entry.secondary.test_visibility(scene, viewpoints, rays);
            }
        }
        self.source = source;
        self.nearest_s = source.distance(listener) / scene.speed_of_sound_m_s();
        self.listener = listener.as_vec3();
    }

    /// Specular prefixes of a rotation's rays, each once, in the order of the rays.
    pub fn sequences(&self, rotation: u64) -> &[Sequence] {
        self.entries[(rotation % ROTATIONS) as usize]
            .cached
            .sequences()
    }

    /// Makes all cached rays invalid; the estimate stays.
    pub fn invalidate_rays(&mut self) {
        for entry in &mut self.entries {
            entry.cached.invalidate();
        }
    }

    /// The estimate over all rotations, for the latest listener.
    pub fn estimate(&mut self, scene: &Scene, source: SourceId) -> LateEnergy {
        let curves = &self.curves;
        let decay = self.decay.get_or_insert_with(|| curves.sum().decay(scene));
        let filled = || self.entries.iter().filter(|entry| entry.filled);
        let Some(decay) = decay else {
            return LateEnergy::silent(source);
        };
        let mut late = LateEnergy {
            // A source at an infinite distance is silent.
            start_s: (self.nearest_s as f32).min(f32::MAX),
            mean_free_time_s: decay.mean_free_time_s as f32,
            decay_time_s: decay.decay_time_s,
            ..LateEnergy::silent(source)
        };
        let reach_m = self.reach_m();
        let weight =
            |entry: &RotationEntry| weight(entry.origin.distance(self.source), reach_m) as f32;
        let mut histogram = ArrivalHistogram::new(f64::from(late.mean_free_time_s), self.nearest_s);
        let mut weights = 0.0;
        for entry in filled() {
            let weight = weight(entry);
            weights += f64::from(weight);
            entry
                .secondary
                .gather(scene, self.listener, weight, &mut histogram);
        }
        histogram.write_energy(weights, &mut late);
        late
    }

    /// Distance at which a rotation has the weight ½: [`SAME_POSITION_M`], or more for [`MIN_ROTATIONS`].
    fn reach_m(&self) -> f64 {
        let mut distances = [f64::INFINITY; ROTATIONS as usize];
        let filled = self.entries.iter().filter(|entry| entry.filled);
        for (distance, entry) in distances.iter_mut().zip(filled) {
            *distance = entry.origin.distance(self.source);
        }
        distances.sort_unstable_by(f64::total_cmp);
        let enough = distances[MIN_ROTATIONS - 1];
        match enough.is_finite() {
            true => enough.max(SAME_POSITION_M),
            false => f64::INFINITY,
        }
    }
}
