//! Diffuse late sound of one source: the energy outside of discrete paths, its arrival times and its decays.
//!
//! Runs within a propagation update. Input: source and listener; output: a [`LateEnergy`]. Bounded by the rays of one update
//! (`count × depth + FAR_RAYS × FAR_BOUNCES`) and [`next_event::SHADOW_RAYS`] rays to the listener for each of sixteen
//! rotations: none for a listener at rest, a few for a walking one ([`visibility_cells`]).
//!
//! Energy balance (own; next-event estimation after \[SCHROEDER11\], "diffuse rain"): a source sends an energy of 4π (free
//! field of 1 at 1 m) in equal shares along its rays, which are reflected specularly. Discrete paths carry the specular
//! energy within their depth and as long as every surface is a panel. *The rest is late energy*: scattered sound,
//! reflections of small facets, and orders beyond the depth. It is heard from the bounce by Lambert's law; what is scattered
//! then belongs to a patch of the scene, which distributes it ([`transport`]). Neither a room's volume nor a ceiling is
//! required. What a listener hears of the patches, and the decays, are common to all sources ([`listener_field`]); a
//! source's energy is fitted to those decays ([`envelope`]).
//!
//! Sixteen rotations of the ray lattice take turns, and the estimate is their sum, independent of the time and index of
//! updates in a scene at rest. A rotation's rays are cached: they are traced again only after source or scene have
//! changed, with the same bits. While instances move, rays stay valid as long as few of them are affected; sixteen updates
//! after the last motion all are exact. The cache takes about 0.15 MB per source with 128 rays to a depth of 4
//! (`by_rotation`), and 0.4 MB more in a scene with instances (`static_hit_cache`).

mod air_spaces;
mod bounce_buffer;
mod by_rotation;
mod cached_rays;
mod curved_prefix;
pub mod decay_fit;
mod delay_sums;
mod delayed;
mod deposits;
mod energy_course;
pub mod envelope;
mod fit_spans;
pub mod late_directions;
mod late_states;
mod lifted_kernel;
pub mod listener_field;
mod long_responses;
pub mod next_event;
mod packed_energy;
mod packed_sequences;
mod patch_exchange;
mod patches;
mod ray_statistics;
mod sample_points;
mod sample_search;
mod slowest_decay;
pub mod source_rays;
mod specular_legs;
mod static_hit_cache;
mod steady_tail;
mod surface_samples;
mod trace;
pub mod transport;
pub mod visibility_cells;

pub use crate::propagation::diffuse::envelope::{LateSegment, late_segments};
pub use crate::propagation::diffuse::listener_field::ListenerField;
pub use crate::propagation::diffuse::source_rays::SourceRays;
pub use crate::propagation::diffuse::transport::{FieldRenewal, SceneField};
pub use crate::propagation::diffuse::visibility_cells::{VisibilityCells, stable_viewpoint};

use glam::{DVec3, Vec3};

use crate::propagation::diffuse::by_rotation::ByRotation;
use crate::propagation::diffuse::cached_rays::{CachedRays, Validity};
use crate::propagation::diffuse::deposits::{Deposit, DepositSums};
use crate::propagation::diffuse::envelope::{ArrivalHistogram, STEPS_PER_FREE_TIME};
use crate::propagation::diffuse::late_directions::LateDirections;
use crate::propagation::diffuse::next_event::{SecondarySources, SourceView};
use crate::propagation::diffuse::packed_sequences::PackedSequences;
use crate::propagation::diffuse::surface_samples::MAX_PATCHES;
use crate::propagation::diffuse::trace::TraceBuffers;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::path::{LateEnergy, MAX_ORDER};
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::{Scene, SourceId};

/// Distance in metres of a moving source from a rotation's origin up to which the rotation has at least half the weight,
/// and the number of rotations that have it at any distance. Keeps the estimate local while a source moves. Most positions in a cell
/// are nearer to its centre.
const SAME_POSITION_M: f64 = 0.7 * visibility_cells::SOURCE_CELLS_M[0] as f64;
const MIN_ROTATIONS: usize = 6;

/// Share of the most energy at a patch below which what arrives may have passed a wall.
const TRANSMITTED: f32 = 1e-3;

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
    /// Whether the scene has changed so that some of the results are wrong.
    is_contradicted: bool,
    /// The source's centre when the rays were traced, local coordinates.
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
    words: Vec<u16>,
}

impl RayScratch {
    /// Memory for so many sequences; it grows if rays find more.
    pub fn with_capacity(sequences: usize) -> Self {
        Self {
            sequences: SequenceSet::with_capacity(sequences),
            buffers: TraceBuffers::default(),
            words: Vec::new(),
        }
    }
}

/// What an estimate depends on besides the source's rays.
#[derive(Debug, Clone, Copy, PartialEq)]
struct EstimateKey {
    source: DVec3,
    /// Position and scene revision of the listener's field.
    listener: Option<(Vec3, u64)>,
    renewals: u64,
    /// See [`LateEstimator::version`].
    version: u64,
}

/// An estimate of one source's late energy at the listener.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateEstimate {
    /// The energy.
    pub energy: LateEnergy,
    /// Where it arrives from.
    pub directions: LateDirections,
}

impl LateEstimate {
    /// No late energy.
    pub fn silent(source: SourceId) -> Self {
        Self {
            energy: LateEnergy::silent(source),
            directions: LateDirections::default(),
        }
    }
}

/// What one of several listeners has of an estimate, while it is the turn of others.
#[derive(Debug, Clone, Default)]
pub(crate) struct ListenerView {
    rotations: Vec<SourceView>,
    latest: Option<(EstimateKey, LateEstimate)>,
}

/// Running estimate of one source's late field.
#[derive(Debug, Clone)]
pub struct LateEstimator {
    entries: Vec<RotationEntry>,
    /// Specular prefixes of each rotation, each once, in the order of the rays.
    sequences: PackedSequences,
    /// Energy at the scene's patches of each rotation.
    deposits: ByRotation<Deposit>,
    /// The deposits of all rotations, times `weights`.
    sum: DepositSums,
    /// Weight of each rotation in `sum`; 0 if it has no results.
    weights: [f32; ROTATIONS as usize],
    /// Whether a rotation has results that are not in `sum`.
    has_new_rays: bool,
    /// Increases whenever `sum` changes.
    version: u64,
    /// The latest estimate and what it holds for.
    latest: Option<(EstimateKey, LateEstimate)>,
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
            sequences: PackedSequences::default(),
            deposits: ByRotation::default(),
            sum: DepositSums::default(),
            weights: [0.0; ROTATIONS as usize],
            has_new_rays: false,
            version: 0,
            latest: None,
            source: DVec3::ZERO,
            nearest_s: 0.0,
            listener: Vec3::ZERO,
        }
    }
}

impl LateEstimator {
    /// Traces a rotation's rays, unless its cached results are valid; returns whether rays were cast. Adds the rays cast to
    /// `rays`.
    pub fn cast_rays(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        scratch: &mut RayScratch,
        rays: &mut u64,
    ) -> bool {
        let index = (from.rotation % ROTATIONS) as usize;
        let entry = &mut self.entries[index];
        let validity = entry.cached.validity(scene, from);
        let is_new = validity == Validity::Invalid;
        if validity == Validity::NearlyValid {
            entry.secondary.invalidate_visibility();
        }
        if is_new {
            // The first cast takes the memory of all.
            for entry in &mut self.entries {
                entry.cached.reserve(scene, from);
                entry.secondary.reserve();
            }
            let entry = &mut self.entries[index];
            let RayScratch {
                sequences,
                buffers,
                words,
            } = scratch;
            sequences.clear();
            entry.cached.renew(scene, from, sequences, buffers, rays);
            self.sequences.replace(index, sequences.entries(), words);
            entry
                .secondary
                .select(scene, from.field, buffers, from.first_mark(), rays);
            self.deposits.replace(index, buffers.deposits.as_slice());
        }
        let entry = &mut self.entries[index];
        self.has_new_rays |= is_new || !entry.filled;
        entry.filled = true;
        entry.origin = from.origin - from.offset;
        if is_new {
            self.drop_what_is_wrong(index);
        }
        is_new
    }

    /// Connects all rotations to a listener, for [`Self::estimate`]. Source and listener are in local
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
    pub fn sequences(&self, rotation: u64) -> impl Iterator<Item = Sequence> {
        self.short_sequences(rotation, MAX_ORDER)
    }

    /// Those of up to `most` reflections.
    fn short_sequences(&self, rotation: u64, most: usize) -> impl Iterator<Item = Sequence> {
        self.sequences.of((rotation % ROTATIONS) as usize, most)
    }

    /// Those of all rotations.
    pub(crate) fn packed(&self) -> &PackedSequences {
        &self.sequences
    }

    /// The same, to mark them.
    pub(crate) fn packed_mut(&mut self) -> &mut PackedSequences {
        &mut self.sequences
    }

    /// Whether rays have been cast, and none of any rotation has left energy at the scene's patches.
    pub(crate) fn is_outside_field(&self) -> bool {
        self.entries.iter().any(|entry| entry.filled)
            && (0..ROTATIONS as usize).all(|rotation| self.deposits.of(rotation).is_empty())
    }

    /// Distance in metres from a source's position to where the rays of a rotation were cast; infinite if none were.
    pub(crate) fn distance_m(&self, rotation: u64, source: DVec3) -> f64 {
        let entry = &self.entries[(rotation % ROTATIONS) as usize];
        match entry.filled {
            true => entry.origin.distance(source),
            false => f64::INFINITY,
        }
    }

    /// Makes all cached rays invalid; the estimate stays.
    pub fn invalidate_rays(&mut self) {
        for entry in &mut self.entries {
            entry.cached.invalidate();
        }
    }

    /// Drops energy of contradicted rotations at patches that the rays of one that is right do not reach: behind a door that has
    /// shut.
    fn drop_what_is_wrong(&mut self, right: usize) {
        let mut energy = [0.0; MAX_PATCHES];
        for deposit in self.deposits.of(right) {
            energy[deposit.patch()] += deposit.energy();
        }
        let least = TRANSMITTED
            * energy
                .iter()
                .fold(0.0, |most: f32, energy| most.max(*energy));
        let is_right = |patch: usize| energy[patch] > least;
        for (index, entry) in self.entries.iter_mut().enumerate() {
            if !std::mem::take(&mut entry.is_contradicted) || index == right {
                continue;
            }
            entry.secondary.retain_patches(is_right);
            self.deposits
                .retain(index, |deposit| is_right(deposit.patch()));
        }
    }

    /// The late field's patches have changed in a scene revision: makes its rays invalid, and drops what is wrong from the
    /// estimate as soon as other rays have been cast.
    pub(crate) fn follow_patches(&mut self, scene: &Scene, scene_state: u64) {
        for entry in &mut self.entries {
            entry.is_contradicted |= entry.cached.is_contradicted(scene, scene_state);
            entry.cached.invalidate_of(scene_state);
        }
    }

    /// Keeps what the present listener sees, for its next turn.
    pub(crate) fn store_view(&self, view: &mut ListenerView) {
        view.rotations
            .resize(self.entries.len(), SourceView::default());
        for (entry, view) in self.entries.iter().zip(&mut view.rotations) {
            entry.secondary.store_view(view);
        }
        view.latest = self.latest;
    }

    /// Goes on with what another listener saw.
    pub(crate) fn load_view(&mut self, view: &ListenerView) {
        let nothing = SourceView::default();
        for (index, entry) in self.entries.iter_mut().enumerate() {
            let view = view.rotations.get(index).unwrap_or(&nothing);
            entry.secondary.load_view(view);
        }
        self.latest = view.latest;
    }

    /// The estimate over all rotations, for the latest listener, whose field is `listener`.
    pub fn estimate(
        &mut self,
        scene: &Scene,
        field: &SceneField,
        listener: &ListenerField,
        source: SourceId,
    ) -> LateEstimate {
        // A source at an infinite distance is silent.
        let start_s = (self.nearest_s as f32).min(f32::MAX);
        let mut late = LateEstimate::silent(source);
        late.energy.start_s = start_s;
        late.energy.mean_free_time_s = STEPS_PER_FREE_TIME * field.step_s;
        self.version += u64::from(self.sum_deposits());
        let key = EstimateKey {
            source: self.source,
            listener: listener.of,
            renewals: field.renewals,
            version: self.version,
        };
        let is_known = |(of, _): &(EstimateKey, LateEstimate)| *of == key;
        if let Some((_, estimate)) = self.latest.filter(is_known) {
            return estimate;
        }
        let mut histogram = ArrivalHistogram::new(field.step_s, start_s);
        for (entry, weight) in self.entries.iter().zip(self.weights) {
            if weight > 0.0 {
                let secondary = &entry.secondary;
                secondary.gather(scene, self.listener, weight, &mut histogram);
            }
        }
        let weights = self.weights.iter().sum();
        if weights > 0.0 {
            self.sum.gather(field, listener, &mut histogram);
            let fitted = &mut late.energy;
            let columns = &field.decays.columns;
            let shares = histogram.fit(columns, &listener.of_air, weights, fitted);
            let directions = self.sum.directions(field, listener, &histogram, &shares);
            late.directions = directions.map(|m| m.map(|e| e.map(|energy| energy / weights)));
        }
        self.latest = Some((key, late));
        late
    }

    /// Adds up the deposits of all rotations; returns whether they have changed.
    fn sum_deposits(&mut self) -> bool {
        let reach_m = self.reach_m();
        let weights = std::array::from_fn(|index| {
            let entry = &self.entries[index];
            match entry.filled {
                true => weight(entry.origin.distance(self.source), reach_m) as f32,
                false => 0.0,
            }
        });
        if !std::mem::take(&mut self.has_new_rays) && weights == self.weights {
            return false;
        }
        self.weights = weights;
        self.sum.clear();
        for (rotation, weight) in weights.into_iter().enumerate() {
            if weight > 0.0 {
                self.sum.add(self.deposits.of(rotation), weight);
            }
        }
        true
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
