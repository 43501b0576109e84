//! How far energy reaches from a patch along specular legs: what a listener hears of it relative to Lambert's law.
//!
//! Own. Energy by Lambert's law falls with the square of the distance. Energy that stays specular for long does not: it flies
//! along a corridor, or between the walls of a flat room. It is at every distance that its legs reach, so its density at a
//! distance is that by Lambert's law times the share of specular legs that are longer, over the share of rays by Lambert's
//! law that are. Both shares are means over spans of distance. Few rays by Lambert's law reach the end of a corridor: where they
//! do not suffice, the share is that of the volume that the patch sees there, by points in the air that lie evenly.
//!
//! On open ground not all places of a patch are reached alike: under a roof energy stays that beside it is lost. There half of a
//! sample's share in its patch is by the energy that leaves it.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::surface_samples::{SurfaceSample, SurfaceSamples};
use crate::propagation::rays::directions::{mix, unit};

/// Spans of distance; each ends farther than the one before by [`RATIO`].
const SPANS: usize = 12;
const RATIO: f32 = 1.5;

/// Times, and their length in time steps: together the responses and somewhat more. Later legs are left out.
const TIMES: usize = 16;
const STEPS_PER_TIME: f32 = 6.0;

/// Rays longer than a span from which on its share is theirs: their scatter is a quarter.
const MIN_RAYS: u32 = 16;

/// Points in a span that count; with fewer it is one with the next spans.
const MIN_POINTS: u32 = 8;

/// Most that is heard of a ray that meets nothing, relative to Lambert's law: few others reach as far.
const MOST_OF_MISSING: f32 = 4.0;

/// Part of a sample's share in its patch that is by energy where samples are uneven; the rest is by area. Few rays stand for one
/// sample's energy: in an even street half a share by it put late energy up to 2 dB off between a mesh and its chunks.
const BY_ENERGY: f32 = 0.5;

/// A point in the air, and the volume that it stands for.
#[derive(Debug, Clone, Copy)]
struct AirPoint {
    position: Vec3,
    volume_m3: f32,
}

/// Sums of a patch.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// By time: lengths in metres within each span of specular legs times their energy, and energy that is heard along them.
    legs: [[f32; SPANS]; TIMES],
    heard: [BandArray; TIMES],
    /// Energy that is heard of rays that meet nothing, and of all that leaves.
    missing: [BandArray; TIMES],
    leaving: [BandArray; TIMES],
    /// Lengths in metres within each span of rays by Lambert's law, their number, and number of those that are longer.
    rays_m: [f32; SPANS],
    rays: f32,
    longer: [u32; SPANS],
    /// Means of those lengths by points in the air, and number of points.
    points_m: [f32; SPANS],
    points: [u32; SPANS],
}

/// What is heard of one patch relative to Lambert's law, in the middle of each span of distance.
#[derive(Debug, Clone, Copy, Default)]
struct Reach {
    /// Along specular legs, for a mean length of one metre.
    along: [f32; SPANS],
    /// Of rays that meet nothing.
    open: [f32; SPANS],
    /// Shares of both in what is heard of the patch.
    share_along: BandArray,
    share_open: BandArray,
}

/// One ray's energy when it leaves a patch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Departure {
    pub(crate) patch: usize,
    /// Index of its sample, if it has one.
    pub(crate) sample: Option<usize>,
    /// Time steps since the ray began.
    pub(crate) steps: f32,
}

impl Departure {
    /// Index of its time, unless it is too late.
    fn time(&self) -> Option<usize> {
        let time = (self.steps / STEPS_PER_TIME) as usize;
        (time < TIMES).then_some(time)
    }
}

/// The specular legs of a scene's rays.
#[derive(Debug, Clone, Default)]
pub(crate) struct SpecularLegs {
    /// End of the first span in metres.
    first_m: f32,
    sums: Vec<Sums>,
    /// Energy in all bands that is heard of each sample, by time.
    of_samples: Vec<[f32; TIMES]>,
    reach: Vec<Reach>,
    /// Share of each sample in what leaves its patch.
    shares: Vec<f32>,
    air: Vec<AirPoint>,
}

impl SpecularLegs {
    /// Removes all; the first span of distance ends at `first_m` metres.
    pub(crate) fn begin(&mut self, patches: usize, samples: usize, first_m: f32) {
        self.first_m = first_m;
        self.sums.clear();
        self.sums.resize(patches, Sums::default());
        self.of_samples.clear();
        self.of_samples.resize(samples, [0.0; TIMES]);
        self.reach.clear();
        self.air.clear();
    }

    /// Start and end of each span in metres.
    fn spans(first_m: f32) -> impl Iterator<Item = (f32, f32)> {
        let first = (0.0, first_m);
        std::iter::successors(Some(first), |(_, end_m)| Some((*end_m, RATIO * end_m))).take(SPANS)
    }

    /// Adds a ray by Lambert's law from a patch; `None` if it meets nothing.
    pub(crate) fn add_ray(&mut self, patch: usize, length_m: Option<f32>) {
        let length_m = length_m.unwrap_or(f32::INFINITY);
        let sums = &mut self.sums[patch];
        sums.rays += 1.0;
        for (span, (start_m, end_m)) in Self::spans(self.first_m).enumerate() {
            sums.rays_m[span] += (length_m.min(end_m) - start_m).max(0.0);
            sums.longer[span] += u32::from(length_m >= end_m);
        }
    }

    /// Adds a point on a ray by Lambert's law, which stands for `area_m2` of its surface.
    pub(crate) fn add_air(&mut self, number: usize, [from, to]: [Vec3; 2], area_m2: f32) {
        // Another number than that of the ray's direction.
        let along = unit(mix(mix(number as u64) ^ 1));
        self.air.push(AirPoint {
            position: from.lerp(to, along),
            // A volume is a quarter of its surface times the mean ray.
            volume_m3: 0.25 * area_m2 * from.distance(to),
        });
    }

    /// Adds energy that is heard when it leaves a patch.
    pub(crate) fn add_leaving(&mut self, at: Departure, heard: &BandArray) {
        let Some(time) = at.time() else { return };
        for (sum, heard) in self.sums[at.patch].leaving[time].iter_mut().zip(heard) {
            *sum += heard;
        }
        if let Some(sample) = at.sample {
            self.of_samples[sample][time] += heard.iter().sum::<f32>();
        }
    }

    /// Adds the energy of a specular leg, of which `heard` is heard along the leg; `None` if it meets nothing.
    pub(crate) fn add_leg(
        &mut self,
        at: Departure,
        length_m: Option<f32>,
        [energy, heard]: [&BandArray; 2],
    ) {
        self.add_leaving(at, heard);
        let Some(time) = at.time() else { return };
        let sums = &mut self.sums[at.patch];
        let total = match length_m {
            Some(_) => &mut sums.heard[time],
            None => &mut sums.missing[time],
        };
        for (total, heard) in total.iter_mut().zip(heard) {
            *total += heard;
        }
        let Some(length_m) = length_m else { return };
        let energy: f32 = energy.iter().sum();
        for (sum, (start_m, end_m)) in sums.legs[time].iter_mut().zip(Self::spans(self.first_m)) {
            *sum += energy * (length_m.min(end_m) - start_m).max(0.0);
        }
    }

    /// Finds what patches see of the air: each point by one sample of each patch, if it `sees` it.
    pub(crate) fn find_volumes(
        &mut self,
        of_patches: &[Vec<SurfaceSample>],
        mut sees: impl FnMut(&SurfaceSample, Vec3) -> bool,
    ) {
        for (number, point) in self.air.iter().enumerate() {
            for (sums, samples) in self.sums.iter_mut().zip(of_patches) {
                let Some(sample) = samples.get(number % samples.len().max(1)) else {
                    continue;
                };
                let offset = point.position - sample.point;
                let distance_m = offset.length();
                let cosine = sample.normal.dot(offset) / distance_m.max(1e-6);
                let mut ends = Self::spans(self.first_m);
                let Some(span) = ends.position(|(_, end_m)| distance_m < end_m) else {
                    continue;
                };
                if cosine > 0.0 && sees(sample, point.position) {
                    let share = cosine / (std::f32::consts::PI * distance_m * distance_m);
                    sums.points_m[span] += share * point.volume_m3;
                    sums.points[span] += 1;
                }
            }
        }
        self.air.clear();
    }

    /// Computes what is heard of a field that decays with `rates` in nepers of energy per time step, after all has been added.
    /// Where samples are even the share of specular legs is that in `leaving`, all that is ever heard of a patch. On open ground most
    /// of that is what flies for long, so there it is the share in what leaves within [`TIMES`].
    pub(crate) fn finish(
        &mut self,
        rates: &BandArray,
        samples: &SurfaceSamples,
        leaving: impl Fn(usize) -> BandArray,
    ) {
        let first_m = self.first_m;
        self.reach.clear();
        let reach = self.sums.iter().enumerate().map(|(patch, sums)| {
            let all = (!samples.has_gaps).then(|| leaving(patch));
            Reach::of(sums, first_m, rates, all)
        });
        self.reach.extend(reach);
        let by_area = samples.all.iter().map(|sample| {
            let patch_m2 = samples.patch_m2.get(usize::from(sample.patch));
            patch_m2.map_or(0.0, |patch_m2| sample.area_m2 / patch_m2)
        });
        self.shares.clear();
        self.shares.extend(by_area);
        if samples.has_gaps {
            self.share_by_energy(mean(rates), samples);
        }
    }

    /// Draws the shares of samples, which are by area, towards the energy that leaves them in a field that decays with a rate.
    fn share_by_energy(&mut self, rate: f32, samples: &SurfaceSamples) {
        let energy_of = |times: &[f32; TIMES]| -> f32 {
            let times = times.iter().enumerate();
            times.map(|(time, sum)| earlier(rate, time) * sum).sum()
        };
        let energies: Vec<f32> = self.of_samples.iter().map(energy_of).collect();
        let mut totals = vec![0.0; samples.patch_m2.len()];
        for (sample, energy) in samples.all.iter().zip(&energies) {
            if let Some(total) = totals.get_mut(usize::from(sample.patch)) {
                *total += energy;
            }
        }
        let own = samples.all.iter().zip(&energies);
        for ((sample, energy), share) in own.zip(&mut self.shares) {
            if let Some(total) = totals.get(usize::from(sample.patch))
                && *total > 0.0
            {
                *share += BY_ENERGY * (energy / total - *share);
            }
        }
    }

    /// Share of a sample in what leaves its patch.
    pub(crate) fn share(&self, sample: usize) -> f32 {
        self.shares[sample]
    }

    /// What is heard of a patch at a distance, relative to Lambert's law. `leg_m` is the mean leg that the energy of specular
    /// legs is relative to.
    pub(crate) fn factor(&self, patch: usize, distance_m: f32, leg_m: f32) -> BandArray {
        let reach = &self.reach[patch];
        // In spans from the middle of the first one.
        let at = (distance_m.max(1e-3) / self.first_m).log2() / RATIO.log2() + 0.5;
        let at = at.clamp(0.0, (SPANS - 1) as f32);
        let span = (at as usize).min(SPANS - 2);
        let rest = at - span as f32;
        let at_distance =
            |values: &[f32; SPANS]| values[span] * (1.0 - rest) + values[span + 1] * rest;
        let along = leg_m * at_distance(&reach.along) - 1.0;
        let open = at_distance(&reach.open) - 1.0;
        std::array::from_fn(|b| 1.0 + reach.share_along[b] * along + reach.share_open[b] * open)
    }
}

/// How much more energy a field had when what leaves at a time began, for one that decays with a rate.
fn earlier(rate: f32, time: usize) -> f32 {
    let steps = (time as f32 + 0.5) * STEPS_PER_TIME;
    (rate * steps).exp()
}

fn mean(values: &BandArray) -> f32 {
    values.iter().sum::<f32>() / BANDS as f32
}

impl Reach {
    fn of(sums: &Sums, first_m: f32, rates: &BandArray, all: Option<BandArray>) -> Self {
        let mut reach = Self::default();
        let (mut legs, mut heard, mut missing) = ([0.0; SPANS], [0.0; BANDS], [0.0; BANDS]);
        let mut leaving = [0.0; BANDS];
        let mean_rate = mean(rates);
        for time in 0..TIMES {
            let more = earlier(mean_rate, time);
            for (sum, legs) in legs.iter_mut().zip(sums.legs[time]) {
                *sum += more * legs;
            }
            for b in 0..BANDS {
                let more = earlier(rates[b], time);
                leaving[b] += more * sums.leaving[time][b];
                heard[b] += more * sums.heard[time][b];
                missing[b] += more * sums.missing[time][b];
            }
        }
        let spans = SpecularLegs::spans(first_m);
        for ((open, rays_m), (start_m, end_m)) in reach.open.iter_mut().zip(sums.rays_m).zip(spans)
        {
            let share = rays_m / (sums.rays * (end_m - start_m)).max(1e-6);
            *open = 1.0 / share.max(1.0 / MOST_OF_MISSING);
        }
        let share = |part: f32, whole: f32| match whole > 0.0 {
            true => (part / whole).min(1.0),
            false => 0.0,
        };
        let leaving = all.unwrap_or(leaving);
        // Of open ground there may be no other share: no specular leg meets anything.
        reach.share_open = std::array::from_fn(|b| share(missing[b], leaving[b]));
        let total_m: f32 = legs.iter().sum();
        if total_m <= 0.0 {
            return reach;
        }
        let mut span = 0;
        while span < SPANS {
            let first = span;
            let (mut legs_m, mut by_law_m, mut points) = (0.0, 0.0, 0);
            if sums.longer[first] >= MIN_RAYS {
                (legs_m, by_law_m) = (legs[first], sums.rays_m[first] / sums.rays);
                span += 1;
            } else {
                while span < SPANS && points < MIN_POINTS {
                    legs_m += legs[span];
                    by_law_m += sums.points_m[span];
                    points += sums.points[span];
                    span += 1;
                }
                if points < MIN_POINTS {
                    // The patch sees nothing so far away.
                    let last = first.checked_sub(1).map(|last| reach.along[last]);
                    let Some(last) = last else { return reach };
                    reach.along[first..].fill(last);
                    break;
                }
            }
            reach.along[first..span].fill(legs_m / (by_law_m * total_m));
        }
        reach.share_along = std::array::from_fn(|b| share(heard[b], leaving[b]));
        reach
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::diffuse::surface_samples::NO_PATCH;

    /// Samples of one patch on open ground.
    fn open_ground(all: Vec<SurfaceSample>) -> SurfaceSamples {
        SurfaceSamples {
            all,
            has_gaps: true,
            patch_m2: vec![2.0],
            ..SurfaceSamples::default()
        }
    }

    fn finish(legs: &mut SpecularLegs, rate: f32, samples: Vec<SurfaceSample>) {
        let unused = |_| unreachable!("of even samples");
        legs.finish(&[rate; BANDS], &open_ground(samples), unused);
    }

    fn at(steps: f32) -> Departure {
        Departure {
            patch: 0,
            sample: None,
            steps,
        }
    }

    /// A patch's specular legs, and its rays by Lambert's law.
    fn legs(lengths_m: &[f32], by_law_m: &[f32]) -> SpecularLegs {
        let mut legs = SpecularLegs::default();
        legs.begin(1, 0, 2.0);
        for _ in 0..MIN_RAYS {
            for length_m in by_law_m {
                legs.add_ray(0, Some(*length_m));
            }
            for length_m in lengths_m {
                legs.add_leg(at(0.0), Some(*length_m), [&[1.0; BANDS]; 2]);
            }
        }
        finish(&mut legs, 0.0, vec![]);
        legs
    }

    #[test]
    fn legs_by_lamberts_law_are_heard_by_it() {
        let lengths_m = [3.0, 5.0, 30.0];
        let legs = legs(&lengths_m, &lengths_m);
        let mean_m = lengths_m.iter().sum::<f32>() / 3.0;
        for distance_m in [0.5, 2.0, 6.0, 14.0] {
            let factor = legs.factor(0, distance_m, mean_m)[0];
            assert!((factor - 1.0).abs() < 1e-3, "{distance_m} m: {factor}");
        }
    }

    #[test]
    fn long_legs_are_heard_far_away() {
        let legs = legs(&[30.0, 30.0, 5.0], &[30.0, 5.0, 5.0]);
        // Where only the long ones are, twice as many of them.
        let [near, far] = [1.0, 14.0].map(|distance_m| legs.factor(0, distance_m, 1.0)[0]);
        assert!((far / near - 2.0).abs() < 0.05, "{near}, {far}");
    }

    /// A long leg late with a tenth of the energy of a short one: in a field that decays by as much until then, half of the energy.
    #[test]
    fn late_legs_count_by_the_energy_of_the_field() {
        let far_share = |rate: f32| {
            let mut legs = SpecularLegs::default();
            legs.begin(1, 0, 2.0);
            for _ in 0..MIN_RAYS {
                legs.add_ray(0, Some(30.0));
                legs.add_leg(at(0.0), Some(5.0), [&[1.0; BANDS]; 2]);
                legs.add_leg(at(48.0), Some(30.0), [&[0.1; BANDS]; 2]);
            }
            finish(&mut legs, rate, vec![]);
            let [near, far] = [0, 5].map(|span| legs.reach[0].along[span]);
            far / near
        };
        let (steady, decaying) = (far_share(0.0), far_share(10f32.ln() / 51.0));
        assert!((steady - 0.1 / 1.1).abs() < 0.03, "{steady}");
        assert!((decaying - 0.5).abs() < 0.1, "{decaying}");
    }

    /// What leaves after the times that are summed once made all that is specular a tenth of a patch's energy in a shelter.
    #[test]
    fn late_energy_does_not_change_the_share_of_specular_legs() {
        let share = |late: bool| {
            let mut legs = SpecularLegs::default();
            legs.begin(1, 0, 2.0);
            for _ in 0..MIN_RAYS {
                legs.add_ray(0, Some(10.0));
                legs.add_leg(at(0.0), Some(10.0), [&[1.0; BANDS]; 2]);
                legs.add_leaving(at(0.0), &[0.5; BANDS]);
                if late {
                    legs.add_leaving(at(STEPS_PER_TIME * TIMES as f32), &[9.0; BANDS]);
                }
            }
            finish(&mut legs, 0.2, vec![]);
            legs.reach[0].share_along[0]
        };
        assert!((share(false) - 2.0 / 3.0).abs() < 1e-4);
        assert_eq!(share(true), share(false));
    }

    /// A sample under a roof, which three quarters of the energy leave, and one beside it.
    #[test]
    fn samples_have_their_share_of_what_leaves() {
        let mut legs = SpecularLegs::default();
        legs.begin(1, 3, 2.0);
        let of = |sample, steps| Departure {
            sample: Some(sample),
            ..at(steps)
        };
        legs.add_leaving(of(0, 0.0), &[1.0; BANDS]);
        legs.add_leaving(of(1, 0.0), &[1.0; BANDS]);
        for _ in 0..2 {
            legs.add_leg(of(0, 0.0), Some(2.0), [&[1.0; BANDS]; 2]);
        }
        let sample = |patch| SurfaceSample {
            patch,
            area_m2: 1.0,
            ..SurfaceSample::default()
        };
        let samples = vec![sample(0), sample(0), sample(NO_PATCH)];
        finish(&mut legs, 0.0, samples);
        assert_eq!(
            [0, 1, 2].map(|index| legs.share(index)),
            [0.625, 0.375, 0.0]
        );
    }

    /// Without specular legs that meet something the share of those that meet nothing was not computed.
    #[test]
    fn open_ground_has_its_share_of_what_leaves_the_scene() {
        let mut legs = SpecularLegs::default();
        legs.begin(1, 0, 2.0);
        legs.add_ray(0, None);
        legs.add_leg(at(0.0), None, [&[0.9; BANDS]; 2]);
        legs.add_leaving(at(0.0), &[0.1; BANDS]);
        finish(&mut legs, 0.0, vec![]);
        assert!((legs.reach[0].share_open[0] - 0.9).abs() < 1e-4);
    }

    #[test]
    fn a_patch_without_specular_legs_is_heard_by_lamberts_law() {
        let mut legs = SpecularLegs::default();
        legs.begin(1, 0, 2.0);
        legs.add_ray(0, None);
        finish(&mut legs, 0.0, vec![]);
        assert_eq!(legs.factor(0, 3.0, 4.0), [1.0; BANDS]);
    }
}
