//! The late energy between two updates.
//!
//! Own. Late energy is a smooth function of the positions of source and listener ([`crate::propagation::diffuse`]). The
//! last updates hold estimates for their listener positions and for positions on the predicted trajectories
//! ([`crate::propagation::PathSet::predicted_positions`]). Late energy is interpolated linearly between two estimates; if
//! updates lag, it is extrapolated by at most the distance between the two. Walls break the smoothness: only estimates at
//! positions visible to the listener are used. The time of the first arrival follows from the positions.
//!
//! Estimates for a moving source are noisy, since every position has new random rays, and are not collinear: the result is a
//! weighted mean of the nearest ones. Decays and directions of the groups are interpolated for the listener's position.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::extrapolation::geometric::FrameInputs;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::{
    LATE_DIRECTIONS, LATE_GROUPS, LATE_SEGMENTS, LateEnergy, LateGroup, PathSet,
};
use crate::scene::{SourceId, SourcePose};

/// Least distance in metres between two estimates that define a line.
const MIN_MOTION_M: f32 = 1e-3;

/// Most estimates used: the nearest ones visible to the listener.
const MAX_VISIBLE: usize = 24;

/// Most visibility tests.
const MAX_TESTS: usize = 30;

/// Most estimates considered, over all updates.
const MAX_ESTIMATES: usize = 96;

/// Least scale in metres of the distance weights for a moving source.
const REACH_M: f32 = 0.35;

/// An update's estimates for one listener position.
#[derive(Clone, Copy)]
struct Estimates<'a> {
    position: Vec3,
    groups: &'a [LateGroup; LATE_GROUPS],
    late: &'a [LateEnergy],
    sources: SourcePositions<'a>,
}

impl<'a> Estimates<'a> {
    /// The estimate of one source.
    fn of(&self, id: SourceId) -> Option<Estimate<'a>> {
        let index = self.late.iter().position(|late| late.source == id)?;
        let from = match self.sources {
            SourcePositions::Poses(poses) => poses.iter().find(|pose| pose.id == id)?.position,
            SourcePositions::Listed(positions) => *positions.get(index)?,
        };
        Some(Estimate {
            at: [from, self.position],
            late: &self.late[index],
        })
    }
}

/// Positions of the sources of [`Estimates`].
#[derive(Clone, Copy)]
enum SourcePositions<'a> {
    /// Poses, found by source.
    Poses(&'a [SourcePose]),
    /// Positions in the order of the estimates.
    Listed(&'a [Vec3]),
}

/// Emits the present late energy of every source of the newest update, and finds the decays; `updates` are the last ones,
/// the newest first. Returns the number of rays cast.
pub(crate) fn extrapolate_late<'a>(
    updates: impl Iterator<Item = &'a PathSet>,
    inputs: &FrameInputs<'_>,
    groups: &mut [LateGroup; LATE_GROUPS],
    mut emit: impl FnMut(LateEnergy),
) -> u64 {
    let mut rays = 0;
    let mut estimates = updates.flat_map(of_update).take(MAX_ESTIMATES);
    let Some(newest) = estimates.next() else {
        return rays;
    };
    let mut all = [newest; MAX_ESTIMATES];
    let mut order = [(0.0f32, 0); MAX_ESTIMATES];
    let mut count = 0;
    for each in std::iter::once(newest).chain(estimates) {
        order[count] = (each.position.distance(inputs.listener.position), count);
        all[count] = each;
        count += 1;
    }
    // For equal distances the newest is first.
    order[..count].sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut visible = [newest; MAX_VISIBLE];
    let mut visible_count = 0;
    for &(_, index) in order[..count].iter().take(MAX_TESTS) {
        if visible_count < MAX_VISIBLE && is_visible(all[index].position, inputs, &mut rays) {
            visible[visible_count] = all[index];
            visible_count += 1;
        }
    }
    let visible = &visible[..visible_count.max(1)];
    *groups = interpolate_groups(visible, inputs.listener.position);
    for late in newest.late {
        emit(interpolate(late, visible, inputs));
    }
    rays
}

/// An update's estimates: at its listener position and on the predicted trajectory.
fn of_update(update: &PathSet) -> impl Iterator<Item = Estimates<'_>> {
    let here = Estimates {
        position: update.listener.position,
        groups: &update.late_groups,
        late: &update.late,
        sources: SourcePositions::Poses(&update.sources),
    };
    let count = update.late.len().max(1);
    let late = update.predicted_late.chunks_exact(count);
    let sources = update.predicted_sources.chunks_exact(count);
    let there = update
        .predicted_positions
        .iter()
        .zip(&update.predicted_groups);
    let each = there.zip(late.zip(sources));
    let predicted = each.map(|((position, groups), (late, sources))| Estimates {
        position: *position,
        groups,
        late,
        sources: SourcePositions::Listed(sources),
    });
    // Without late energy of its own an update has that of another position.
    let has_any = !update.late.is_empty() && !update.scope.skips_late;
    std::iter::once(here)
        .chain(predicted)
        .filter(move |_| has_any)
}

fn is_visible(position: Vec3, inputs: &FrameInputs<'_>, rays: &mut u64) -> bool {
    let listener = inputs.listener.position;
    if position == listener {
        return true;
    }
    *rays += 1;
    let [from, to] = [listener, position].map(|at| inputs.scene.to_local(at).as_vec3());
    !inputs.scene.any_hit(&Ray::between(from, to), [NO_GROUP; 2])
}

/// A source's late energy for one position of source and listener.
#[derive(Clone, Copy)]
struct Estimate<'a> {
    at: [Vec3; 2],
    late: &'a LateEnergy,
}

/// A source's late energy from its estimates.
fn interpolate(
    newest: &LateEnergy,
    visible: &[Estimates<'_>],
    inputs: &FrameInputs<'_>,
) -> LateEnergy {
    let id = newest.source;
    let Some(endpoints) = inputs.endpoints(id) else {
        return *newest;
    };
    let here = [endpoints.from, endpoints.to];
    let estimates = || visible.iter().filter_map(|estimates| estimates.of(id));
    let mut nearest: Option<(f32, Estimate<'_>)> = None;
    for each in estimates() {
        let square = distance_squared(each.at, here);
        if nearest.is_none_or(|(least, _)| square < least) {
            nearest = Some((square, each));
        }
    }
    let mut result = nearest.map_or(*newest, |(_, nearest)| *nearest.late);
    let [from, to] = here.map(|position| inputs.scene.to_local(position));
    result.start_s = (from.distance(to) / inputs.scene.speed_of_sound_m_s()) as f32;
    let Some((_, nearest)) = nearest.filter(|(_, each)| each.late.mean_free_time_s > 0.0) else {
        return result;
    };
    if nearest.at[0] != endpoints.from {
        let near = weighted_mean(estimates(), here);
        result.energy = near.unwrap_or(result.energy);
        return result;
    }
    let others = estimates().filter(|other| other.late.mean_free_time_s > 0.0);
    let lines = others.filter_map(|other| {
        let line = Line::between(nearest.at, other.at, here)?;
        Some((line, other.late))
    });
    if let Some((line, other)) = lines.reduce(|a, b| if b.0.cost < a.0.cost { b } else { a }) {
        mix(&mut result, other, &line);
    }
    result
}

/// Weight of an estimate at a squared distance, for a squared scale of the distances.
fn weight(square: f32, reach: f32) -> f32 {
    (1.0 + square / reach).powi(-4)
}

/// Decays and directions at a position, interpolated as the late energy of a source at rest.
fn interpolate_groups(estimates: &[Estimates<'_>], position: Vec3) -> [LateGroup; LATE_GROUPS] {
    // Groups know no source: all are as if it were at one point.
    let at = |position| [Vec3::ZERO, position];
    let square = |each: &&Estimates<'_>| each.position.distance_squared(position);
    let nearest = estimates
        .iter()
        .reduce(|a, b| if square(&b) < square(&a) { b } else { a });
    let Some(nearest) = nearest else {
        return Default::default();
    };
    let mut groups = *nearest.groups;
    if nearest.position == position {
        return groups;
    }
    let lines = estimates.iter().filter_map(|other| {
        let line = Line::between(at(nearest.position), at(other.position), at(position))?;
        Some((line, other.groups))
    });
    if let Some((line, others)) = lines.reduce(|a, b| if b.0.cost < a.0.cost { b } else { a }) {
        for (group, other) in groups.iter_mut().zip(others) {
            for (to, from) in group.directions.iter_mut().zip(&other.directions) {
                for b in 0..BANDS {
                    to[b] = line.at(to[b], from[b]);
                }
            }
            normalize(&mut group.directions);
            let decays = group.decay_time_s.iter_mut().zip(other.decay_time_s);
            decays.for_each(|(to, from)| *to = line.decay_at(*to, from));
        }
    }
    groups
}

/// Divides shares of directions by their sum in each band: shares extrapolated below zero were raised to it.
fn normalize(directions: &mut [BandArray; LATE_DIRECTIONS]) {
    for b in 0..BANDS {
        let sum: f32 = directions.iter().map(|share| share[b]).sum();
        if sum > 0.0 {
            directions.iter_mut().for_each(|share| share[b] /= sum);
        }
    }
}

/// Mean energies of estimates, weighted by the distance of their positions.
fn weighted_mean<'a>(
    estimates: impl Iterator<Item = Estimate<'a>> + Clone,
    here: [Vec3; 2],
) -> Option<[[BandArray; LATE_SEGMENTS]; LATE_GROUPS]> {
    let estimates = estimates.filter(|each| each.late.mean_free_time_s > 0.0);
    let square = |each: &Estimate<'_>| distance_squared(each.at, here);
    let nearest = estimates.clone().map(|each| square(&each));
    let nearest = nearest.fold(f32::INFINITY, f32::min);
    // Far from all of them the nearest is no better than the others.
    let least = REACH_M * REACH_M;
    let reach = least + nearest * nearest / least;
    let mut weights = 0.0;
    let mut mean = [[[0.0; BANDS]; LATE_SEGMENTS]; LATE_GROUPS];
    for each in estimates {
        let weight = weight(square(&each), reach);
        weights += weight;
        let energies = each.late.energy.as_flattened();
        for (sum, energy) in mean.as_flattened_mut().iter_mut().zip(energies) {
            for b in 0..BANDS {
                sum[b] += weight * energy[b];
            }
        }
    }
    for value in mean.as_flattened_mut().as_flattened_mut() {
        *value /= weights;
    }
    (weights > 0.0).then_some(mean)
}

/// The line from the nearest estimate to another.
struct Line {
    /// Present position along the line: 0 at the nearest, 1 at the other.
    share: f32,
    /// Squared distance of the present position from the line in square metres, plus a share of its squared length.
    cost: f32,
}

impl Line {
    fn between(nearest: [Vec3; 2], other: [Vec3; 2], here: [Vec3; 2]) -> Option<Self> {
        let step = [other[0] - nearest[0], other[1] - nearest[1]];
        let done = [here[0] - nearest[0], here[1] - nearest[1]];
        let length_squared: f32 = step.iter().map(|step| step.length_squared()).sum();
        if length_squared.is_nan() || length_squared < MIN_MOTION_M * MIN_MOTION_M {
            return None;
        }
        let along: f32 = step
            .iter()
            .zip(done)
            .map(|(step, done)| step.dot(done))
            .sum();
        let share = (along / length_squared).clamp(-1.0, 1.0);
        let point = [0, 1].map(|end| nearest[end] + step[end] * share);
        // Extrapolation costs more than interpolation.
        let beyond = if share < 0.0 { share * share } else { 0.0 };
        Some(Self {
            share,
            cost: distance_squared(point, here) + (0.01 + 0.25 * beyond) * length_squared,
        })
    }

    /// Between a value at the nearest estimate and at the other, never below zero.
    fn at(&self, nearest: f32, other: f32) -> f32 {
        (nearest + (other - nearest) * self.share).max(0.0)
    }

    /// Between a decay time at the nearest estimate and at the other, by their ratio: an extrapolated decay stays one, also
    /// where the other is more than twice as long. Silence stays silence.
    fn decay_at(&self, nearest: f32, other: f32) -> f32 {
        let ratio = other / nearest;
        if ratio.is_finite() && ratio > 0.0 {
            nearest * ratio.powf(self.share)
        } else {
            nearest
        }
    }
}

fn distance_squared(a: [Vec3; 2], b: [Vec3; 2]) -> f32 {
    a[0].distance_squared(b[0]) + a[1].distance_squared(b[1])
}

/// Interpolates linearly from `result` to `other`.
fn mix(result: &mut LateEnergy, other: &LateEnergy, line: &Line) {
    let energies = result.energy.as_flattened_mut().iter_mut();
    for (energy, other) in energies.zip(other.energy.as_flattened()) {
        for b in 0..BANDS {
            energy[b] = line.at(energy[b], other[b]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Extrapolates groups from an update behind, over a nearest one, to a position ahead.
    fn extrapolated(nearest: &LateGroup, behind: &LateGroup) -> LateGroup {
        let groups = [nearest, behind].map(|group| [*group; LATE_GROUPS]);
        let at = |x, groups| Estimates {
            position: Vec3::new(x, 0.0, 0.0),
            groups,
            late: &[],
            sources: SourcePositions::Listed(&[]),
        };
        let estimates = [at(1.0, &groups[0]), at(0.0, &groups[1])];
        interpolate_groups(&estimates, Vec3::new(1.75, 0.0, 0.0))[0]
    }

    #[test]
    fn extrapolated_directions_are_shares_of_one() {
        let mut nearest = LateGroup::isotropic([1.0; BANDS]);
        nearest.directions = [[0.0; BANDS]; LATE_DIRECTIONS];
        nearest.directions[0] = [0.8; BANDS];
        nearest.directions[1] = [0.2; BANDS];
        let mut behind = nearest;
        behind.directions.swap(0, 1);
        let directions = extrapolated(&nearest, &behind).directions;
        for b in 0..BANDS {
            let sum: f32 = directions.iter().map(|share| share[b]).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            assert!(directions.iter().all(|share| share[b] >= 0.0));
        }
    }

    #[test]
    fn an_extrapolated_decay_does_not_become_silence() {
        let group = |decay_s| LateGroup::isotropic([decay_s; BANDS]);
        let decay_s = extrapolated(&group(0.4), &group(1.2)).decay_time_s[0];
        assert!(decay_s > 0.15 && decay_s < 0.4, "{decay_s}");
        let silent = extrapolated(&group(0.0), &group(1.2)).decay_time_s[0];
        assert_eq!(silent, 0.0);
    }

    #[test]
    fn near_estimates_decide_and_far_ones_are_averaged() {
        let late = |level| LateEnergy {
            energy: [[[level; BANDS]; LATE_SEGMENTS]; LATE_GROUPS],
            mean_free_time_s: 0.01,
            ..LateEnergy::silent(SourceId::default())
        };
        let (quiet, loud) = (late(1.0), late(3.0));
        let mean = |nearest_m: f32, other_m: f32| {
            let at = |x, late| Estimate {
                at: [Vec3::X * x, Vec3::ZERO],
                late,
            };
            let each = [at(nearest_m, &quiet), at(-other_m, &loud)];
            let found = weighted_mean(each.into_iter(), [Vec3::ZERO; 2]);
            found.expect("an estimate")[0][0][0]
        };
        // Weights relative to the nearest estimate: 1.5e-4 at 1 m, 0.99 at 6 m.
        assert!(mean(0.05, 1.0) < 1.001);
        assert!((mean(5.0, 6.0) - 2.0).abs() < 0.1);
    }
}
