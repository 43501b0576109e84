//! The late field between two updates.
//!
//! Own. An estimate is a smooth function of where source and listener are ([`crate::propagation::diffuse`]), and the last
//! updates have made some: for the place that each was computed for and for those on the way there
//! ([`crate::propagation::PathSet::way`]). Between two of them a tail lies on the line between theirs; where updates lag
//! behind, the line goes on, by its own length at most. A wall ends what is smooth: only estimates for places count that
//! the listener sees. When the first sound can be there follows from the places themselves.
//!
//! Of a source that moves estimates are noisy, since its rays start anew from place to place, and lie on no line: those near
//! by tell its tail together. How that decays and how fast it thickens is told by the source's rays alone, wherever the
//! listener is, so there only the source's places count.

use glam::Vec3;

use crate::acoustics::BANDS;
use crate::extrapolation::geometric::Now;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::{LateEnergy, PathSet};
use crate::scene::{SourceId, SourcePose};

/// Motion between two estimates in metres from which they lie on a line.
const LEAST_MOTION_M: f32 = 1e-3;

/// Estimates that a source's tail is looked for among: the nearest that the listener sees. Of places that are asked
/// whether the listener sees them so many are at most.
const CHOICE: usize = 8;
const MOST_ASKED: usize = 12;

/// Most estimates of all updates that are looked at.
const MOST_ESTIMATES: usize = 96;

/// Within how far estimates for a moving source count alike, in metres, unless all are farther.
const REACH_M: f32 = 0.35;

/// An update's estimates for one place.
#[derive(Clone, Copy)]
struct Estimates<'a> {
    place: Vec3,
    late: &'a [LateEnergy],
    sources: Whereabouts<'a>,
}

impl<'a> Estimates<'a> {
    /// A source's.
    fn of(&self, id: SourceId) -> Option<Known<'a>> {
        let number = self.late.iter().position(|late| late.source == id)?;
        let from = match self.sources {
            Whereabouts::Of(poses) => source_in(poses, id)?,
            Whereabouts::At(places) => *places.get(number)?,
        };
        Some(Known {
            at: [from, self.place],
            late: &self.late[number],
        })
    }
}

/// Where an estimate's sources are.
#[derive(Clone, Copy)]
enum Whereabouts<'a> {
    /// By source.
    Of(&'a [SourcePose]),
    /// In the order of the estimates.
    At(&'a [Vec3]),
}

/// Gives every source of the newest update, with its late field as it is now; `updates` are the last ones, the newest
/// first. Gives the number of rays cast.
pub(crate) fn late_now<'a>(
    updates: impl Iterator<Item = &'a PathSet>,
    now: &Now<'_>,
    mut give: impl FnMut(LateEnergy),
) -> u64 {
    let mut rays = 0;
    let mut estimates = updates.flat_map(of_update).take(MOST_ESTIMATES);
    let Some(newest) = estimates.next() else {
        return rays;
    };
    let mut all = [newest; MOST_ESTIMATES];
    let mut order = [(0.0f32, 0); MOST_ESTIMATES];
    let mut count = 0;
    for each in std::iter::once(newest).chain(estimates) {
        order[count] = (each.place.distance(now.listener.position), count);
        all[count] = each;
        count += 1;
    }
    // Of one place the newest comes first.
    order[..count].sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut seen = [newest; CHOICE];
    let mut seen_count = 0;
    for &(_, number) in order[..count].iter().take(MOST_ASKED) {
        if seen_count < CHOICE && is_in_sight(all[number].place, now, &mut rays) {
            seen[seen_count] = all[number];
            seen_count += 1;
        }
    }
    let seen = &seen[..seen_count.max(1)];
    for late in newest.late {
        give(among(late, seen, &all[..count], now));
    }
    rays
}

/// What an update has estimated: for where its listener is, and for the places on the way there.
fn of_update(update: &PathSet) -> impl Iterator<Item = Estimates<'_>> {
    let here = Estimates {
        place: update.listener.position,
        late: &update.late,
        sources: Whereabouts::Of(&update.sources),
    };
    let count = update.late.len().max(1);
    let late = update.predicted_late.chunks_exact(count);
    let sources = update.predicted_sources.chunks_exact(count);
    let each = update.way.iter().zip(late.zip(sources));
    let way = each.map(|(place, (late, sources))| Estimates {
        place: *place,
        late,
        sources: Whereabouts::At(sources),
    });
    let has_any = !update.late.is_empty();
    std::iter::once(here).chain(way).filter(move |_| has_any)
}

fn is_in_sight(place: Vec3, now: &Now<'_>, rays: &mut u64) -> bool {
    if place == now.listener.position {
        return true;
    }
    *rays += 1;
    let [from, to] = [now.listener.position, place].map(|at| now.scene.to_local(at).as_vec3());
    !now.scene.any_hit(&Ray::between(from, to), [NO_GROUP; 2])
}

/// A source's estimate at one place of source and listener.
#[derive(Clone, Copy)]
struct Known<'a> {
    at: [Vec3; 2],
    late: &'a LateEnergy,
}

/// A source's late field on the line between two of the estimates.
fn among(
    newest: &LateEnergy,
    seen: &[Estimates<'_>],
    all: &[Estimates<'_>],
    now: &Now<'_>,
) -> LateEnergy {
    let id = newest.source;
    let Some(spot) = now.spot(id) else {
        return *newest;
    };
    let here = [spot.from, spot.to];
    let known = || seen.iter().filter_map(|estimates| estimates.of(id));
    let mut nearest: Option<(f32, Known<'_>)> = None;
    for each in known() {
        let square = square_between(each.at, here);
        if nearest.is_none_or(|(least, _)| square < least) {
            nearest = Some((square, each));
        }
    }
    let mut result = nearest.map_or(*newest, |(_, nearest)| *nearest.late);
    let [from, to] = here.map(|place| now.scene.to_local(place));
    result.start_s = (from.distance(to) / now.scene.speed_of_sound_m_s()) as f32;
    let Some((_, nearest)) = nearest.filter(|(_, each)| each.late.mean_free_time_s > 0.0) else {
        return result;
    };
    if nearest.at[0] != spot.from {
        let all = all.iter().filter_map(|estimates| estimates.of(id));
        let near = together(known(), |known| square_between(known.at, here));
        let own = together(all, |known| known.at[0].distance_squared(spot.from));
        result.energy = near.map_or(result.energy, |near| near.energy);
        if let Some(own) = own {
            (result.mean_free_time_s, result.decay_time_s) =
                (own.mean_free_time_s, own.decay_time_s);
        }
        return result;
    }
    let others = known().filter(|other| other.late.mean_free_time_s > 0.0);
    let lines = others.filter_map(|other| Line::between(&nearest, &other, here));
    let best = lines.reduce(|a, b| if b.cost < a.cost { b } else { a });
    if let Some(line) = best {
        mix(&mut result, line.other, line.share);
    }
    result
}

/// What estimates say together, each by the square of its distance in square metres.
fn together<'a>(
    known: impl Iterator<Item = Known<'a>> + Clone,
    square: impl Fn(&Known<'a>) -> f32,
) -> Option<LateEnergy> {
    let known = known.filter(|known| known.late.mean_free_time_s > 0.0);
    let nearest = known.clone().map(|each| square(&each));
    let nearest = nearest.fold(f32::INFINITY, f32::min);
    let reach = nearest.max(REACH_M * REACH_M);
    let mut weights = 0.0;
    let mut sum: Option<LateEnergy> = None;
    for each in known {
        let weight = (1.0 + square(&each) / reach).powi(-4);
        weights += weight;
        let sum = sum.get_or_insert(LateEnergy::silent(each.late.source));
        sum.mean_free_time_s += weight * each.late.mean_free_time_s;
        for b in 0..BANDS {
            sum.decay_time_s[b] += weight * each.late.decay_time_s[b];
            for (energy, own) in sum.energy.iter_mut().zip(&each.late.energy) {
                energy[b] += weight * own[b];
            }
        }
    }
    let mut mean = sum?;
    mean.mean_free_time_s /= weights;
    for values in mean.energy.iter_mut().chain([&mut mean.decay_time_s]) {
        for value in values {
            *value /= weights;
        }
    }
    (weights > 0.0).then_some(mean)
}

/// The line from the nearest estimate to another, and how far along it the present lies.
struct Line<'a> {
    other: &'a LateEnergy,
    share: f32,
    /// How far from it the present is, in square metres, and a little for its length.
    cost: f32,
}

impl<'a> Line<'a> {
    fn between(nearest: &Known<'_>, other: &Known<'a>, here: [Vec3; 2]) -> Option<Self> {
        let way = [other.at[0] - nearest.at[0], other.at[1] - nearest.at[1]];
        let done = [here[0] - nearest.at[0], here[1] - nearest.at[1]];
        let length_squared: f32 = way.iter().map(|step| step.length_squared()).sum();
        if length_squared.is_nan() || length_squared < LEAST_MOTION_M * LEAST_MOTION_M {
            return None;
        }
        let along: f32 = way.iter().zip(done).map(|(way, done)| way.dot(done)).sum();
        let share = (along / length_squared).clamp(-1.0, 1.0);
        let point = [0, 1].map(|end| nearest.at[end] + way[end] * share);
        // Going on beyond an estimate is worse than going from one to the next.
        let beyond = if share < 0.0 { share * share } else { 0.0 };
        Some(Self {
            other: other.late,
            share,
            cost: square_between(point, here) + (0.01 + 0.25 * beyond) * length_squared,
        })
    }
}

fn square_between(a: [Vec3; 2], b: [Vec3; 2]) -> f32 {
    a[0].distance_squared(b[0]) + a[1].distance_squared(b[1])
}

/// Goes a share of the way from an estimate to another.
fn mix(result: &mut LateEnergy, other: &LateEnergy, share: f32) {
    let at = |a: f32, b: f32| (a + (b - a) * share).max(0.0);
    for (energy, other) in result.energy.iter_mut().zip(other.energy) {
        for b in 0..BANDS {
            energy[b] = at(energy[b], other[b]);
        }
    }
    for b in 0..BANDS {
        result.decay_time_s[b] = at(result.decay_time_s[b], other.decay_time_s[b]);
    }
    result.mean_free_time_s = at(result.mean_free_time_s, other.mean_free_time_s);
}

fn source_in(sources: &[SourcePose], id: SourceId) -> Option<Vec3> {
    let pose = sources.iter().find(|pose| pose.id == id);
    pose.map(|pose| pose.position)
}
