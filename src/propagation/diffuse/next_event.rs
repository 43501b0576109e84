//! Next-event estimation: diffuse energy from bounces to the listener.
//!
//! Every bounce sends to the listener by Lambert's law if nothing occludes it. A fixed number of bounces represents all of
//! a rotation, selected in proportion to their possible contribution (systematic sampling, \[COCHRAN77\] 9A.2), which keeps
//! the expected sum. Shadow rays test occlusion.
//!
//! The selection does not depend on the listener. A secondary source's contribution is computed for the listener's position
//! at each evaluation, its occlusion from viewpoints that depend on that position alone
//! ([`crate::propagation::diffuse::visibility_cells`]). The sum is therefore a function of the position.

use glam::Vec3;

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffuse::bounce_buffer::{Bounce, BounceBuffer};
use crate::propagation::diffuse::envelope::ArrivalHistogram;
use crate::propagation::diffuse::lifted_kernel::lifted_kernel;
use crate::propagation::diffuse::surface_samples::NO_PATCH;
use crate::propagation::diffuse::trace::TraceBuffers;
use crate::propagation::diffuse::transport::SceneField;
use crate::propagation::diffuse::visibility_cells::GROUPS_PER_ROTATION;
use crate::scene::Scene;
use crate::simd::{LaneSet, kernel, prefetch};

/// Bounces selected of one source and rotation: within the depth of discrete paths, and beyond.
const NEAR_BOUNCES: usize = 32;
const FAR_BOUNCES: usize = 64;

/// Most secondary sources: the bounces within the depth of discrete paths. Rounding may add one.
pub const SHADOW_RAYS: usize = NEAR_BOUNCES + 1;

/// Most entries of [`crate::propagation::diffuse::deposits::Deposits`]: rounding may add one to each part, and every bounce has two sides.
const MAX_DEPOSITS: usize = 2 * (NEAR_BOUNCES + FAR_BOUNCES + 2);

/// What a bounce is lifted by for [`lifted_kernel`], in square metres: that of a disc of 0.7 m radius.
const LIFTED_M2: f32 = 0.5 * 0.7 * 0.7;

/// Arrivals computed at once.
const ARRIVAL_LANES: usize = 16;

/// A bounce that represents others.
#[derive(Debug, Clone, Copy)]
struct SecondarySource {
    point: Vec3,
    normal: Vec3,
    surface: u32,
    /// Path length from the source.
    before_m: f32,
    /// Energy leaving all represented bounces, air absorption up to here included.
    energy: BandArray,
    /// Patch of the scene's late field, or [`NO_PATCH`].
    patch: u16,
    /// Whether its group's viewpoint is visible.
    is_visible: bool,
}

/// What one of several listeners sees of the secondary sources of a rotation.
#[derive(Debug, Clone, Default)]
pub(crate) struct SourceView {
    /// Of the sources it is about.
    selection: u64,
    /// One bit a source.
    is_visible: u64,
    viewpoints: [Option<Vec3>; GROUPS_PER_ROTATION],
}

// A bit each.
const _: () = assert!(SHADOW_RAYS <= u64::BITS as usize);

/// The secondary sources of a rotation in [`GROUPS_PER_ROTATION`] interleaved groups, and the groups' viewpoints.
#[derive(Debug, Clone, Default)]
pub(crate) struct SecondarySources {
    sources: Vec<SecondarySource>,
    /// Indices of the visible ones.
    visible: Vec<u32>,
    viewpoints: [Option<Vec3>; GROUPS_PER_ROTATION],
    /// Increases with every selection, and whenever visibility has to be tested anew.
    selection: u64,
}

impl SecondarySources {
    /// Reserves the capacity.
    pub(crate) fn reserve(&mut self) {
        let count = self.sources.len();
        self.sources.reserve(SHADOW_RAYS.saturating_sub(count));
        let count = self.visible.len();
        self.visible.reserve(SHADOW_RAYS.saturating_sub(count));
    }

    /// Prefetches the sources into the cache.
    #[inline]
    pub(crate) fn prefetch(&self) {
        self.sources.iter().for_each(prefetch);
    }

    /// Makes the next [`Self::test_visibility`] test all sources.
    pub(crate) fn invalidate_visibility(&mut self) {
        self.viewpoints = [None; GROUPS_PER_ROTATION];
        self.selection += 1;
    }

    /// Keeps what the present listener sees, for its next turn.
    pub(crate) fn store_view(&self, view: &mut SourceView) {
        view.selection = self.selection;
        view.viewpoints = self.viewpoints;
        view.is_visible = 0;
        for index in &self.visible {
            view.is_visible |= 1 << *index;
        }
    }

    /// Goes on with what another listener saw, as far as it is still about these sources.
    pub(crate) fn load_view(&mut self, view: &SourceView) {
        let is_known = view.selection == self.selection;
        let (bits, viewpoints) = match is_known {
            true => (view.is_visible, view.viewpoints),
            false => (0, [None; GROUPS_PER_ROTATION]),
        };
        self.viewpoints = viewpoints;
        self.visible.clear();
        for (index, source) in (0..).zip(&mut self.sources) {
            source.is_visible = bits >> index & 1 == 1;
            if source.is_visible {
                self.visible.push(index);
            }
        }
    }

    /// Selects among the bounces within the depth of discrete paths and beyond; their energy at the scene's patches is in the
    /// buffers afterwards. Adds the rays cast to `rays`.
    pub(crate) fn select(
        &mut self,
        scene: &Scene,
        field: &SceneField,
        buffers: &mut TraceBuffers,
        first_mark: f64,
        rays: &mut u64,
    ) {
        let TraceBuffers {
            near,
            far,
            sums,
            deposits,
            ..
        } = buffers;
        deposits.begin(MAX_DEPOSITS);
        self.sources.clear();
        self.visible.clear();
        self.invalidate_visibility();
        let sources = &mut self.sources;
        select_from(
            near,
            f64::from,
            NEAR_BOUNCES,
            first_mark,
            sums,
            |bounce, gain| {
                let patch = deposits.add(scene, field, &bounce, gain, false, rays);
                let air = exp_neg(&scene.air_np_per_m().map(|m| 2.0 * m * bounce.length_m));
                let leaving = &bounce.energy.leaving;
                sources.push(SecondarySource {
                    point: bounce.point,
                    normal: bounce.normal,
                    surface: bounce.surface,
                    before_m: bounce.length_m,
                    energy: std::array::from_fn(|b| leaving[b] * gain * air[b]),
                    patch,
                    is_visible: false,
                });
            },
        );
        // Beyond, the square root: late bounces have little energy, but nothing else arrives then.
        let root = |weight: f32| f64::from(weight).sqrt();
        select_from(far, root, FAR_BOUNCES, first_mark, sums, |bounce, gain| {
            deposits.add(scene, field, &bounce, gain, true, rays);
        });
    }

    /// Removes the sources of patches that are not `kept`.
    pub(crate) fn retain_patches(&mut self, kept: impl Fn(usize) -> bool) {
        let is_kept =
            |source: &SecondarySource| source.patch == NO_PATCH || kept(source.patch.into());
        if !self.sources.iter().all(is_kept) {
            self.sources.retain(is_kept);
            self.visible.clear();
            self.invalidate_visibility();
        }
    }

    /// Tests the visibility of changed viewpoints from their groups' sources. Adds the rays cast to `rays`.
    pub(crate) fn test_visibility(&mut self, scene: &Scene, viewpoints: &[Vec3], rays: &mut u64) {
        let mut is_new = false;
        for (group, (&to, tested)) in viewpoints.iter().zip(&mut self.viewpoints).enumerate() {
            if tested.replace(to) == Some(to) {
                continue;
            }
            is_new = true;
            for source in self
                .sources
                .iter_mut()
                .skip(group)
                .step_by(GROUPS_PER_ROTATION)
            {
                // A surface radiates to its front only.
                if source.normal.dot(to - source.point) <= 0.0 {
                    source.is_visible = false;
                    continue;
                }
                *rays += 1;
                let leg = Ray::between(source.point, to);
                source.is_visible = !scene.any_hit(&leg, [source.surface, NO_GROUP]);
            }
        }
        if is_new {
            self.visible.clear();
            let indices = self.sources.iter().zip(0..);
            let visible = indices.filter(|(source, _)| source.is_visible);
            self.visible.extend(visible.map(|(_, index)| index));
        }
    }

    /// Adds the energy that arrives at the listener, times a weight.
    pub(crate) fn gather(
        &self,
        scene: &Scene,
        listener: Vec3,
        weight: f32,
        histogram: &mut ArrivalHistogram,
    ) {
        let receiver = Receiver {
            position: listener,
            air: *scene.air_np_per_m(),
            speed_m_s: scene.speed_of_sound_m_s(),
        };
        gather(
            LaneSet::best(),
            &self.sources,
            &self.visible,
            &receiver,
            weight,
            histogram,
        );
    }
}

/// Selects about `count` bounces in proportion to `selection_weight` of their weights; one may represent several marks. Calls
/// `take` with each and its gain.
fn select_from(
    bounces: &BounceBuffer,
    selection_weight: impl Fn(f32) -> f64,
    count: usize,
    first_mark: f64,
    sums: &mut Vec<f64>,
    mut take: impl FnMut(Bounce, f32),
) {
    let mut sum = 0.0;
    sums.clear();
    sums.extend(bounces.weights.iter().map(|weight| {
        sum += selection_weight(*weight);
        sum
    }));
    let stride = sum / count as f64;
    if !(stride > 0.0 && stride.is_finite()) {
        return;
    }
    // Marks are at (n + first) strides along the cumulative weight.
    let mut mark = first_mark * stride;
    let mut index = 0;
    loop {
        // Most bounces have no mark: steps of eight first.
        const SKIPPED: usize = 8;
        let is_passed = |index| sums.get(index).is_some_and(|sum: &f64| mark >= *sum);
        while is_passed(index + SKIPPED - 1) {
            index += SKIPPED;
        }
        while is_passed(index) {
            index += 1;
        }
        let Some(&sum) = sums.get(index) else { break };
        let mut marks = 0.0;
        while mark < sum {
            mark += stride;
            marks += 1.0;
        }
        let gain = (marks * stride / selection_weight(bounces.weights[index])) as f32;
        take(bounces.bounce(index), gain);
        index += 1;
    }
}

/// A listener, and the air around.
struct Receiver {
    position: Vec3,
    air: BandArray,
    speed_m_s: f64,
}

kernel! {
    /// Adds the contributions of the visible sources, times a weight. Bands are lanes, and so are neighbours in the list. No fused
    /// products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn gather<L>(sources: &[SecondarySource], visible: &[u32], receiver: &Receiver, weight: f32, histogram: &mut ArrivalHistogram) {
        for indices in visible.chunks(ARRIVAL_LANES) {
            // Unused lanes are not read.
            let mut connections = Connections::NONE;
            for (lane, index) in indices.iter().enumerate() {
                connections.set(lane, &sources[*index as usize], receiver);
            }
            let (after_m, kernel, delay_s) = connections.evaluate(receiver);
            for (lane, index) in indices.iter().enumerate() {
                let mut energy = sources[*index as usize].energy;
                for b in 0..BANDS {
                    // Fourth power of the exponential's first terms: 0.1 dB too little of 6 dB, 2 dB of 20.
                    let x = 0.5 * receiver.air[b] * after_m[lane];
                    let root = 1.0 / (1.0 + x + 0.5 * x * x);
                    let square = root * root;
                    energy[b] *= kernel[lane] * square * square;
                }
                for b in 0..BANDS {
                    energy[b] *= weight;
                }
                histogram.add(delay_s[lane] as f32, &energy);
            }
        }
    }
}

/// One value per connection.
type Lanes<T> = [T; ARRIVAL_LANES];

/// Straight lines from secondary sources to the listener, one per lane.
struct Connections {
    offset: [Lanes<f32>; 3],
    normal: [Lanes<f32>; 3],
    before_m: Lanes<f32>,
}

impl Connections {
    const NONE: Self = Self {
        offset: [[0.0; ARRIVAL_LANES]; 3],
        normal: [[0.0; ARRIVAL_LANES]; 3],
        before_m: [0.0; ARRIVAL_LANES],
    };

    #[inline(always)]
    fn set(&mut self, lane: usize, source: &SecondarySource, receiver: &Receiver) {
        let (offset, normal) = (receiver.position - source.point, source.normal);
        for axis in 0..3 {
            self.offset[axis][lane] = offset[axis];
            self.normal[axis][lane] = normal[axis];
        }
        self.before_m[lane] = source.before_m;
    }

    /// Lengths in metres, Lambert's factor on energy without air, and delays in seconds from emission.
    #[inline(always)]
    fn evaluate(&self, receiver: &Receiver) -> (Lanes<f32>, Lanes<f32>, Lanes<f64>) {
        let (mut after_m, mut kernel) = ([0.0; ARRIVAL_LANES], [0.0; ARRIVAL_LANES]);
        let mut delay_s = [0.0; ARRIVAL_LANES];
        for l in 0..ARRIVAL_LANES {
            let [x, y, z] = [self.offset[0][l], self.offset[1][l], self.offset[2][l]];
            let n = [self.normal[0][l], self.normal[1][l], self.normal[2][l]];
            let length_m = (x * x + y * y + z * z).sqrt();
            let height_m = n[0] * x + n[1] * y + n[2] * z;
            after_m[l] = length_m;
            kernel[l] = match height_m > 0.0 {
                true => lifted_kernel(length_m * length_m, height_m, LIFTED_M2),
                false => 0.0,
            };
        }
        for l in 0..ARRIVAL_LANES {
            delay_s[l] = f64::from(self.before_m[l] + after_m[l]) / receiver.speed_m_s;
        }
        (after_m, kernel, delay_s)
    }
}
