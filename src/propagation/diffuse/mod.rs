//! What the late reverb needs of one source: the energy that no discrete path carries, when it arrives, and how it
//! decays.
//!
//! Runs inside a propagation update. Takes source and listener, gives a [`LateEnergy`]. Bounded by the rays of one
//! update (`count × depth + FAR_RAYS × FAR_BOUNCES`) and [`connection::SHADOW_RAYS`] rays to the listener for each of sixteen
//! rotations at most: none for a listener at rest, a few for one who walks ([`viewpoints`]).
//!
//! The balance (own; connection of bounces to the listener after \[SCHROEDER11\], "diffuse rain"): a source sends 4π of
//! energy (free field of one at 1 m) in even shares along its rays. What leaves a bounce is the share's product of
//! reflected energies. Of it the discrete paths carry the product of specular shares, as long as the order is within
//! their depth and every surface is a panel; *the rest is the tail's*: what was scattered, what small facets took out of
//! the mirror images, and everything beyond the last order. It is taken to leave the bounce by Lambert's law and is
//! connected to the listener, so no volume has to be known and a scene without a ceiling needs no rule of its own.
//! Decay: [`decay`]. From arrivals to a tail that starts without gap or double energy: [`envelope`].
//!
//! The arrivals of sixteen updates are kept by the number of their ray rotation, so that what is told of a scene at rest
//! does not depend on when it is looked at, nor on how often. So is what their rays found: while neither source nor scene
//! has changed since a rotation's rays were cast, they are not cast again, and bits are the same. While instances move, rays
//! stay as well if few of them have to do with an instance; sixteen updates after the last move everything is looked at
//! anew. What that costs is memory, about 0.4 MB a source with 128 rays to a depth of 4 (`source_rays::Found`), and 0.4 MB
//! more in a scene with instances, where it is known besides where rays go in the fixed scene (`fixed_way`).

mod bounce_buffer;
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
pub use crate::propagation::diffuse::visibility_cells::{VisibilityCells, still_place};

use glam::{DVec3, Vec3};

use crate::propagation::diffuse::bounce_buffer::Bounces;
use crate::propagation::diffuse::decay_fit::{CurveTree, Decay};
use crate::propagation::diffuse::envelope::Spans;
use crate::propagation::diffuse::next_event::Arrivals;
use crate::propagation::diffuse::source_rays::{Found, Known};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::path::LateEnergy;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::{Scene, SourceId};

/// Within how far a moving source counts as where it is, in metres, and rotations that have to be counted even if it was
/// farther away. So a tail is of where a source is and not of where it was sixteen updates ago, however often they come.
const SAME_PLACE_M: f64 = 0.35;
const FEWEST_ROTATIONS: usize = 6;

/// What rays count that were cast at a distance from where the source is; 1 there.
fn weight(distance_m: f64, reach_m: f64) -> f64 {
    // At no place a source is as good as at any.
    if !distance_m.is_finite() {
        return 1.0;
    }
    let square = (distance_m / reach_m).powi(2);
    1.0 / (1.0 + square * square)
}

/// What the rays of one rotation found.
#[derive(Debug, Clone, Default)]
struct Slot {
    filled: bool,
    /// Where the source was, local coordinates.
    origin: DVec3,
    found: Found,
    arrivals: Arrivals,
}

/// Memory that rays are followed in: whose they were nobody asks again, so one does for all sources that take turns.
#[derive(Debug, Clone)]
pub struct RayScratch {
    /// What rays begin with, each sequence once.
    pub(crate) sequences: SequenceSet,
    /// All bounces of one rotation, while some are chosen.
    bounces: Bounces,
}

impl RayScratch {
    /// Room for so many sequences; it grows where rays find more.
    pub fn with_capacity(sequences: usize) -> Self {
        Self {
            sequences: SequenceSet::with_capacity(sequences),
            bounces: Bounces::default(),
        }
    }
}

/// Running estimate of one source's late field.
#[derive(Debug, Clone)]
pub struct LateEstimator {
    slots: Vec<Slot>,
    curves: CurveTree,
    /// What the curves say, unless they have been drawn anew since.
    decay: Option<Option<Decay>>,
    /// The newest place of the source, local coordinates.
    source: DVec3,
    /// The newest straight line's time.
    nearest_s: f64,
    /// The newest place of the listener, local coordinates.
    listener: Vec3,
}

impl Default for LateEstimator {
    fn default() -> Self {
        Self {
            slots: vec![Slot::default(); ROTATIONS as usize],
            curves: CurveTree::default(),
            decay: None,
            source: DVec3::ZERO,
            nearest_s: 0.0,
            listener: Vec3::ZERO,
        }
    }
}

impl LateEstimator {
    /// Traces source rays with diffuse bounces, or knows still what they found ([`Self::sequences`]), and connects them to
    /// the listener. Adds the rays it cast to `rays`.
    pub fn trace(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        scratch: &mut RayScratch,
        rays: &mut u64,
    ) {
        self.cast(scene, from, scratch, rays);
        let ends = [from.origin, from.listener];
        self.look(scene, ends, from.viewpoints, rays);
    }

    /// The first half of [`Self::trace`]; gives whether rays were cast.
    pub fn cast(
        &mut self,
        scene: &Scene,
        from: &SourceRays<'_>,
        scratch: &mut RayScratch,
        rays: &mut u64,
    ) -> bool {
        let number = (from.rotation % ROTATIONS) as usize;
        for slot in &mut self.slots {
            slot.found.reserve(scene, from);
            slot.arrivals.reserve();
        }
        let slot = &mut self.slots[number];
        let known = slot.found.known(scene, from);
        let is_new = known == Known::Not;
        if known == Known::Nearly {
            slot.arrivals.forget_sight();
        }
        if is_new {
            let RayScratch { sequences, bounces } = scratch;
            sequences.clear();
            self.curves.prefetch(number);
            self.curves.renew(number, |curve| {
                slot.found
                    .renew(scene, from, sequences, curve, bounces, rays);
            });
            self.decay = None;
            slot.arrivals.choose(scene, bounces);
        }
        slot.filled = true;
        slot.origin = from.origin;
        is_new
    }

    /// Connects what is known to a listener, whose estimate [`Self::estimate`] gives then; the source and he in local
    /// coordinates. Adds the rays it cast to `rays`.
    pub fn look(
        &mut self,
        scene: &Scene,
        [source, listener]: [DVec3; 2],
        viewpoints: &VisibilityCells,
        rays: &mut u64,
    ) {
        for number in 0..self.slots.len() {
            // Sixteen rotations of as many sources are more than stays at hand from one update to the next.
            if let Some(next) = self.slots.get(number + 1) {
                next.arrivals.prefetch();
            }
            let slot = &mut self.slots[number];
            if slot.filled {
                let viewpoints = viewpoints.of_rotation(number);
                slot.arrivals.look(scene, viewpoints, rays);
            }
        }
        self.source = source;
        self.nearest_s = source.distance(listener) / scene.speed_of_sound_m_s();
        self.listener = listener.as_vec3();
    }

    /// What rays of a rotation begin with when they were last cast: specular sequences, each once, in the rays' order.
    pub fn sequences(&self, rotation: u64) -> &[Sequence] {
        self.slots[(rotation % ROTATIONS) as usize]
            .found
            .sequences()
    }

    /// Forgets what rays found, so that all are cast again; the estimate stays.
    pub fn forget_rays(&mut self) {
        for slot in &mut self.slots {
            slot.found.forget();
        }
    }

    /// The estimate over the last sixteen updates, for the listener of the last.
    pub fn estimate(&mut self, scene: &Scene, source: SourceId) -> LateEnergy {
        let curves = &self.curves;
        let decay = self.decay.get_or_insert_with(|| curves.sum().decay(scene));
        let filled = || self.slots.iter().filter(|slot| slot.filled);
        let Some(decay) = decay else {
            return LateEnergy::silent(source);
        };
        let mut late = LateEnergy {
            // Beyond all numbers a source is silent, and nothing is to start.
            start_s: (self.nearest_s as f32).min(f32::MAX),
            mean_free_time_s: decay.mean_free_time_s as f32,
            decay_time_s: decay.decay_time_s,
            ..LateEnergy::silent(source)
        };
        let reach_m = self.reach_m();
        let weight = |slot: &Slot| weight(slot.origin.distance(self.source), reach_m) as f32;
        let mut spans = Spans::new(f64::from(late.mean_free_time_s), self.nearest_s);
        let mut weights = 0.0;
        for slot in filled() {
            let weight = weight(slot);
            weights += f64::from(weight);
            slot.arrivals
                .gather(scene, self.listener, weight, &mut spans);
        }
        spans.tell(weights, &mut late);
        late
    }

    /// How far from the source's place rays may have been cast that count for half: near, unless few have been.
    fn reach_m(&self) -> f64 {
        let mut distances = [f64::INFINITY; ROTATIONS as usize];
        let filled = self.slots.iter().filter(|slot| slot.filled);
        for (distance, slot) in distances.iter_mut().zip(filled) {
            *distance = slot.origin.distance(self.source);
        }
        distances.sort_unstable_by(f64::total_cmp);
        let enough = distances[FEWEST_ROTATIONS - 1];
        match enough.is_finite() {
            true => enough.max(SAME_PLACE_M),
            false => f64::INFINITY,
        }
    }
}
