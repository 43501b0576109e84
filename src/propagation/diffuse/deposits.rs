//! Energy of one rotation's rays at the patches of the scene.
//!
//! Bounces that [`crate::propagation::diffuse::next_event`] selects leave their scattered energy at the patch that they see;
//! what the wall transmits goes to the patch behind it. Deposits of one patch and span of time are added.

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::bounce_buffer::Bounce;
use crate::propagation::diffuse::delay_sums::varied;
use crate::propagation::diffuse::delayed::add_delayed;
use crate::propagation::diffuse::energy_course::add_response;
use crate::propagation::diffuse::envelope::{ArrivalHistogram, GroupShares};
use crate::propagation::diffuse::fit_spans::{DIRECTION_SPANS, STEPS};
use crate::propagation::diffuse::late_directions::{LateDirections, MOMENTS, Moments};
use crate::propagation::diffuse::listener_field::{ListenerField, PatchView};
use crate::propagation::diffuse::surface_samples::{MAX_PATCHES, NO_PATCH};
use crate::propagation::diffuse::transport::SceneField;
use crate::propagation::late_group::LATE_GROUPS;
use crate::scene::Scene;
use crate::simd::{LaneSet, Lanes, kernel};

/// Ends of the spans of time in time steps before they are varied; the last span has none.
const SPAN_ENDS: [f32; SPANS - 1] = [2.0, 4.0, 7.0, 11.0, 16.0, 23.0, 32.0, 44.0, 58.0];
const SPANS: usize = 10;

/// Neighbouring spans that are one for directions and after the responses.
const SPANS_TOGETHER: usize = 3;

/// Least factor of a patch's ends, and their range: the ratio of two ends. With the same ends for all patches, energy that
/// flies between walls for long would arrive in bursts.
const VARIED: (f32, f32) = (0.82, 0.38);

/// Energy at a patch in a span of time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Deposit {
    /// Patch and span.
    key: u32,
    /// Energy that the patch radiates.
    scattered: BandArray,
    /// Energy that leaves the patch and is heard directly.
    leaving: BandArray,
    /// Sums of delays in time steps times weights, and of weights.
    steps: f32,
    weight: f32,
    /// Sum of the squares of the weights: with the sum itself, how few bounces stand for the energy.
    squares: f32,
}

impl Deposit {
    /// Index of the patch.
    pub(crate) fn patch(&self) -> usize {
        self.key as usize / SPANS
    }

    /// Energy in all bands.
    pub(crate) fn energy(&self) -> f32 {
        self.weight
    }

    /// Relative variance of the energy.
    #[inline(always)]
    fn variance(&self) -> f32 {
        self.squares / (self.weight * self.weight).max(f32::MIN_POSITIVE)
    }
}

/// Deposits of one rotation of a source.
#[derive(Debug, Clone, Default)]
pub(crate) struct Deposits {
    entries: Vec<Deposit>,
}

impl Deposits {
    /// Removes all; reserves memory for `most`.
    pub(crate) fn begin(&mut self, most: usize) {
        self.entries.clear();
        self.entries.reserve(most);
    }

    /// The deposits, each patch and span once.
    pub(crate) fn as_slice(&self) -> &[Deposit] {
        &self.entries
    }

    /// Adds a bounce times a gain; `is_heard` if its leaving energy is heard through the patch. Returns the patch, or
    /// [`NO_PATCH`]. Adds the rays cast to `rays`.
    pub(crate) fn add(
        &mut self,
        scene: &Scene,
        field: &SceneField,
        bounce: &Bounce,
        gain: f32,
        is_heard: bool,
        rays: &mut u64,
    ) -> u16 {
        let (point, normal) = (bounce.point, bounce.normal);
        let place = (point, bounce.surface);
        let Some(sample) = field.samples.locate(scene, place, normal, rays) else {
            return NO_PATCH;
        };
        let sample = field.samples.all[sample];
        let steps = bounce.length_m / (scene.speed_of_sound_m_s() as f32 * field.step_s);
        let mut air = exp_neg(&scene.air_np_per_m().map(|m| 2.0 * m * bounce.length_m));
        for value in &mut air {
            *value *= gain;
        }
        let times = |energy: &BandArray| std::array::from_fn(|b| energy[b] * air[b]);
        let scattered = times(&bounce.energy.scattered);
        let mut leaving = [0.0; BANDS];
        if is_heard {
            leaving = times(&bounce.energy.leaving);
            let patch = usize::from(sample.patch);
            let factor = field.samples.leg_factor(patch, bounce.next_m);
            for b in 0..BANDS {
                leaving[b] = scattered[b] + (leaving[b] - scattered[b]).max(0.0) * factor;
            }
        }
        self.add_to(sample.patch, steps, &scattered, &leaving);
        if let Some(behind) = sample.behind {
            let factor = scene.transmission_factor(bounce.surface);
            let incident = times(&bounce.energy.incident);
            let through = std::array::from_fn(|b| incident[b] * factor[b] * factor[b]);
            self.add_to(behind, steps, &through, &through);
        }
        sample.patch
    }

    fn add_to(&mut self, patch: u16, steps: f32, scattered: &BandArray, leaving: &BandArray) {
        let sum: f32 = scattered.iter().chain(leaving).sum();
        // A source at an infinite distance is silent.
        if !(sum.is_finite() && steps.is_finite()) {
            return;
        }
        let varied_steps = steps * varied(VARIED, usize::from(patch));
        let span = SPAN_ENDS.iter().filter(|end| varied_steps >= **end);
        let span = span.count();
        let key = u32::from(patch) * SPANS as u32 + span as u32;
        let found = self.entries.iter().position(|other| other.key == key);
        let index = found.unwrap_or_else(|| {
            self.entries.push(Deposit {
                key,
                ..Deposit::default()
            });
            self.entries.len() - 1
        });
        let deposit = &mut self.entries[index];
        for b in 0..BANDS {
            deposit.scattered[b] += scattered[b];
            deposit.leaving[b] += leaving[b];
        }
        deposit.steps += sum * steps;
        deposit.weight += sum;
        deposit.squares += sum * sum;
    }
}

/// Sum of a source's deposits over its rotations.
#[derive(Debug, Clone)]
pub(crate) struct DepositSums {
    sums: Box<[Deposit; MAX_PATCHES * SPANS]>,
}

impl Default for DepositSums {
    fn default() -> Self {
        Self {
            sums: Box::new([Deposit::default(); MAX_PATCHES * SPANS]),
        }
    }
}

impl DepositSums {
    pub(crate) fn clear(&mut self) {
        self.sums.fill(Deposit::default());
    }

    /// Adds deposits times a gain.
    pub(crate) fn add(&mut self, deposits: &[Deposit], gain: f32) {
        add_deposits(LaneSet::best(), &mut self.sums, deposits, gain);
    }

    /// Adds what arrives at the listener.
    pub(crate) fn gather(
        &self,
        field: &SceneField,
        listener: &ListenerField,
        histogram: &mut ArrivalHistogram,
    ) {
        gather(LaneSet::best(), &self.sums, field, listener, histogram);
        gather_late(LaneSet::best(), &self.sums, listener, histogram);
    }
}

impl DepositSums {
    /// Directions of what arrives at the listener in the groups; `shares` are those of `histogram`.
    pub(crate) fn directions(
        &self,
        field: &SceneField,
        listener: &ListenerField,
        histogram: &ArrivalHistogram,
        shares: &GroupShares,
    ) -> LateDirections {
        let mut result = LateDirections::default();
        let views = listener.patches.iter().zip(&listener.arriving);
        for (deposits, (view, arriving)) in self.sums.chunks_exact(SPANS).zip(views) {
            if deposits.iter().any(|deposit| deposit.weight > 0.0) {
                let arrival = Arrival {
                    view,
                    delay: view.delay_s / field.step_s,
                    arriving,
                    nearest: histogram.nearest_steps(),
                };
                add_directions(LaneSet::best(), deposits, &arrival, shares, &mut result);
            }
        }
        result
    }
}

/// How what a patch radiates arrives at the listener. Times are in time steps.
struct Arrival<'a> {
    view: &'a PatchView,
    delay: f32,
    arriving: &'a [Moments; DIRECTION_SPANS.len()],
    /// Arrival of the straight line.
    nearest: f32,
}

kernel! {
    /// Adds the moments of what arrives of one patch, divided between the groups. No fused products: all machines give the same bits.
    fn add_directions<L>(
        deposits: &[Deposit],
        arrival: &Arrival<'_>,
        shares: &GroupShares,
        result: &mut LateDirections,
    ) {
        let mut direct = [L::splat(0.0); LATE_GROUPS];
        let mut radiated = [[L::splat(0.0); LATE_GROUPS]; DIRECTION_SPANS.len()];
        for deposits in deposits.chunks(SPANS_TOGETHER) {
            let (mut scattered, mut leaving) = (L::splat(0.0), L::splat(0.0));
            let (mut steps, mut weight) = (0.0, 0.0);
            for deposit in deposits {
                scattered = scattered.add(L::load(&deposit.scattered));
                leaving = leaving.add(L::load(&deposit.leaving));
                steps += deposit.steps;
                weight += deposit.weight;
            }
            if weight <= 0.0 {
                continue;
            }
            let steps = steps / weight - arrival.nearest;
            let of_groups = shares.at(steps + arrival.delay);
            for g in 0..LATE_GROUPS {
                direct[g] = direct[g].add(leaving.mul(L::load(&of_groups[g])));
            }
            for span in 0..DIRECTION_SPANS.len() {
                let middle = 0.5 * (DIRECTION_SPANS[span].start + DIRECTION_SPANS[span].end) as f32;
                let of_groups = shares.at(steps + middle);
                for g in 0..LATE_GROUPS {
                    let sum = &mut radiated[span][g];
                    *sum = sum.add(scattered.mul(L::load(&of_groups[g])));
                }
            }
        }
        let energy = L::load(&arrival.view.energy);
        for g in 0..LATE_GROUPS {
            let direct = direct[g].mul(energy);
            for m in 0..MOMENTS {
                let sum = &mut result[g][m];
                let mut lanes = L::load(sum).add(direct.mul(L::splat(arrival.view.directions[m])));
                for span in 0..DIRECTION_SPANS.len() {
                    lanes = lanes.add(radiated[span][g].mul(L::load(&arrival.arriving[span][m])));
                }
                lanes.store(sum);
            }
        }
    }
}

kernel! {
    /// Adds deposits times a gain. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn add_deposits<L>(sums: &mut [Deposit; MAX_PATCHES * SPANS], deposits: &[Deposit], gain: f32) {
        for deposit in deposits {
            let sum = &mut sums[deposit.key as usize];
            for b in 0..BANDS {
                sum.scattered[b] += gain * deposit.scattered[b];
                sum.leaving[b] += gain * deposit.leaving[b];
            }
            sum.steps += gain * deposit.steps;
            sum.weight += gain * deposit.weight;
            sum.squares += gain * gain * deposit.squares;
        }
    }
}

kernel! {
    /// Adds what arrives at the listener: what leaves the patches, and what they radiate, by their responses. No fused products: all
    /// machines give the same bits.
    fn gather<L>(
        sums: &[Deposit; MAX_PATCHES * SPANS],
        field: &SceneField,
        listener: &ListenerField,
        histogram: &mut ArrivalHistogram,
    ) {
        for (key, deposit) in sums.iter().enumerate() {
            let patch = key / SPANS;
            if deposit.weight <= 0.0 || patch >= listener.patches.len() {
                continue;
            }
            let delay_s = deposit.steps / deposit.weight * field.step_s;
            let view = &listener.patches[patch];
            let mut direct = deposit.leaving;
            for b in 0..BANDS {
                direct[b] *= view.energy[b];
            }
            histogram.add_of_few(delay_s + view.delay_s, &direct, deposit.variance());
            let response = &listener.response[patch * STEPS..][..STEPS];
            // Negative before the straight line's arrival: the response starts later.
            let at = delay_s / field.step_s - histogram.nearest_steps();
            convolve::<L>(response, &deposit.scattered, at, &mut histogram.energy);
        }
    }
}

kernel! {
    /// Adds what arrives of what patches radiate after their responses. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn gather_late<L>(
        sums: &[Deposit; MAX_PATCHES * SPANS],
        listener: &ListenerField,
        histogram: &mut ArrivalHistogram,
    ) {
        for (deposits, response) in sums.chunks_exact(SPANS).zip(&listener.long) {
            for deposits in deposits.chunks(SPANS_TOGETHER) {
                let (mut scattered, mut steps, mut weight) = ([0.0; BANDS], 0.0, 0.0);
                for deposit in deposits {
                    for b in 0..BANDS {
                        scattered[b] += deposit.scattered[b];
                    }
                    steps += deposit.steps;
                    weight += deposit.weight;
                }
                if weight > 0.0 {
                    add_response(&mut histogram.late, response, &scattered, steps / weight);
                }
            }
        }
    }
}

/// Adds a response times an energy, `at` time steps later.
#[inline(always)]
fn convolve<L: Lanes>(
    response: &[BandArray],
    energy: &BandArray,
    at: f32,
    sum: &mut [BandArray; STEPS],
) {
    let whole = at.floor();
    // Beyond the steps of a response any number is as good: a byte, to which few instructions convert.
    let (skipped, first) = (-whole as u8, whole as u8);
    let sum = sum.get_mut(usize::from(first)..).unwrap_or_default();
    add_delayed::<L>(response, skipped.into(), energy, at - whole, sum);
}
