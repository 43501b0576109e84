//! Ways that bend twice: around both edges of a thick wall, out of one doorway and into the next.
//!
//! Each bend is a wedge on its own and their factors multiply. The distance parameters are \[PIERCE74\]'s: the bend that
//! turns more sees the whole rest of the way on its other side, the lesser one only the leg between the two, which is
//! the same when source and listener change places. Along a face that both edges share the wave and its reflection
//! are one, hence half of each product.

use std::f64::consts::PI;

use glam::DVec3;

use crate::acoustics::BANDS;
use crate::propagation::diffraction::edge_wave;
use crate::propagation::diffraction::edge_wave::Course;
use crate::propagation::diffraction::utd::{Spread, WedgeAngles};
use crate::propagation::diffraction::{LONGEST_DETOUR_M, WEAKEST, fade_out, moving_edge_pairs};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::Interaction;
use crate::propagation::path::Path;
use crate::scene::Scene;
use crate::scene::edges::{DiffractingEdges, Edge, EdgeCrossing};

/// Most paths with two bends from one source.
pub const MOST_DOUBLE: usize = 4;

/// Ways whose sight lines are tried, shortest first.
const MOST_TRIED: usize = 16;

/// Rounds in which the two bends find their places, and the step in metres at which they have.
const MOST_ROUNDS: usize = 12;
const SETTLED_M: f64 = 1e-6;

/// Rounds that find them where those do not: a part in 10¹² of an edge.
const MOST_PARTINGS: usize = 40;

/// Slope of a length that rounding cannot make of none.
const LEAST_SLOPE: f64 = 1e-6;

/// Ends of edges within so many metres of each other are one corner.
const MEET_M: f64 = 1e-6;

/// Most times that a round's step is halved before it is taken.
const MOST_HALVINGS: usize = 6;

/// Shortest leg between two bends in metres.
const LEAST_LEG_M: f64 = 0.02;

/// A leg between edges of one face lies in it to this angle, in radians: 2 mm of a surface's own unevenness over 0.2 m.
const IN_FACE: f64 = 1e-2;

/// A way over two edges.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    edges: [u32; 2],
    diffraction_order: [EdgeCrossing; 2],
    length_m: f64,
}

/// Gives the loudest paths that bend around two edges, the first of them one of `near` or either of something that moves
/// ([`joined`]), at most [`MOST_DOUBLE`].
pub fn find(
    scene: &Scene,
    spot: &Endpoints,
    near: &DiffractingEdges,
    rays: &mut u64,
    give: &mut impl FnMut(Path),
) {
    let (from, to) = (scene.to_local(spot.from), scene.to_local(spot.to));
    let most_m = from.distance(to) + LONGEST_DETOUR_M;
    let mut tried: [Option<Way>; MOST_TRIED] = [None; MOST_TRIED];
    for found in near.as_slice() {
        // No way over an edge is shorter than the one that bends there alone.
        let longest_m = tried[MOST_TRIED - 1].map_or(most_m, |way| way.length_m);
        if found.length_m > longest_m {
            break;
        }
        for second in scene.edge_neighbours(found.edge) {
            let other = scene.edge(second);
            let alone = other.at(other.apex_m(from, to).clamp(0.0, other.length_m));
            if from.distance(alone) + alone.distance(to) < longest_m
                && other.is_outside(to)
                && let Some(way) = Way::over(scene, [found.edge, second], spot)
            {
                insert(&mut tried, way);
            }
        }
    }
    let moving = scene
        .has_instances()
        .then(|| moving_edge_pairs::shortest(scene, spot));
    let moving = moving.iter().flatten().flatten();
    let mut loudest: [Option<(f32, Path)>; MOST_DOUBLE] = [None; MOST_DOUBLE];
    for way in tried.iter().flatten().chain(moving) {
        if way.is_clear(scene, spot, rays)
            && let Some(path) = way.path(scene, spot)
        {
            let energy = path.amplitude.iter().map(|a| a * a).sum::<f32>();
            let place = loudest.partition_point(|old| old.is_some_and(|old| old.0 >= energy));
            if place < MOST_DOUBLE {
                loudest[place..].rotate_right(1);
                loudest[place] = Some((energy, path));
            }
        }
    }
    loudest
        .into_iter()
        .flatten()
        .for_each(|(_, path)| give(path));
}

/// Keeps the shortest ways, shortest first.
pub(crate) fn insert(tried: &mut [Option<Way>], new: Way) {
    let rank = |way: &Way| (way.length_m, way.edges);
    let place = tried.partition_point(|old| old.is_some_and(|old| rank(&old) < rank(&new)));
    if place < tried.len() {
        tried[place..].rotate_right(1);
        tried[place] = Some(new);
    }
}

impl Way {
    /// The shortest way over two edges in this order, if it bends within their ends, stays in the air of both and is not
    /// too long.
    pub fn over(scene: &Scene, edges: [u32; 2], spot: &Endpoints) -> Option<Self> {
        let (from, to) = (scene.to_local(spot.from), scene.to_local(spot.to));
        let lines = edges.map(|edge| scene.edge(edge));
        Self::between(edges, [&lines[0], &lines[1]], from, to)
    }

    /// The same over edges as they stand, between places in local coordinates.
    pub(crate) fn between(
        edges: [u32; 2],
        [a, b]: [&Edge; 2],
        from: DVec3,
        to: DVec3,
    ) -> Option<Self> {
        if runs_through_corner([a, b], from, to) {
            return None;
        }
        if !a.is_outside(from) || !b.is_outside(to) {
            return None;
        }
        let guess_m = first_guess([a, b], from, to);
        if leaves([a, b], guess_m[0], from, to) || leaves([b, a], guess_m[1], to, from) {
            return None;
        }
        let [first, second] = shortest([a, b], guess_m, from, to);
        if first.distance(second) < LEAST_LEG_M {
            return None;
        }
        let mut diffraction_order = [a.crossing(from, second)?, b.crossing(first, to)?];
        if share_face([a, b]) {
            // The leg between lies in the face but for rounding.
            diffraction_order[0].outgoing = on_face(a, diffraction_order[0].outgoing);
            diffraction_order[1].incoming = on_face(b, diffraction_order[1].incoming);
        }
        let length_m =
            diffraction_order[0].before_m + first.distance(second) + diffraction_order[1].after_m;
        (length_m < from.distance(to) + LONGEST_DETOUR_M).then_some(Self {
            edges,
            diffraction_order,
            length_m,
        })
    }

    /// Its length in metres.
    pub(crate) fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Its path, if that is above [`WEAKEST`]. Says nothing of what stands in between.
    pub fn path(&self, scene: &Scene, spot: &Endpoints) -> Option<Path> {
        let straight_m = scene.to_local(spot.from).distance(scene.to_local(spot.to));
        let left = fade_out(self.length_m - straight_m);
        let gains = gains(scene, spot, self).map(|gain| (gain * left) as f32);
        let reach = straight_m.max(spot.min_distance_m) / self.length_m;
        let audible = gains.iter().any(|g| f64::from(g.abs()) * reach > WEAKEST);
        audible.then(|| {
            let course = Course {
                stops: &self.edges.map(Interaction::Edge),
                points: &self.diffraction_order.map(|crossing| crossing.apex),
                length_m: self.length_m,
                heard_at: self.diffraction_order[1].apex,
            };
            edge_wave::path(scene, spot, &course, &gains)
        })
    }

    /// Whether nothing stands on the way. Adds the rays it cast, three at most, to `rays`.
    pub fn is_clear(&self, scene: &Scene, spot: &Endpoints, rays: &mut u64) -> bool {
        let (from, to) = (scene.to_local(spot.from), scene.to_local(spot.to));
        let lines = self.edges.map(|edge| scene.edge(edge));
        let [a, b] = &lines;
        let (first, second) = (
            edge_wave::stand(a, self.diffraction_order[0].apex),
            edge_wave::stand(b, self.diffraction_order[1].apex),
        );
        // The leg between may run along a face that both have.
        let shared = a.faces.into_iter().find(|face| b.faces.contains(face));
        let along = shared.map_or([a.faces[0], b.faces[0]], |face| [face; 2]);
        edge_wave::sees(scene, second, to, b.faces, rays)
            && edge_wave::sees(scene, from, first, a.faces, rays)
            && edge_wave::sees(scene, first, second, along, rays)
    }
}

/// Whether two edges meet at a corner through which the shortest way over their lines runs, so that no leg is between.
///
/// There the length has a tip, and is least at it if some vector no longer than 1 balances both ends: along each edge it goes
/// as far as the way to the corner does, and the way from it. The shortest such vector lies in the edges' plane.
fn runs_through_corner([a, b]: [&Edge; 2], from: DVec3, to: DVec3) -> bool {
    let ends = |edge: &Edge| [edge.origin, edge.at(edge.length_m)];
    let (of_a, of_b) = (ends(a), ends(b));
    let is_met = |end: &&DVec3| {
        let meets = |other: &DVec3| end.distance_squared(*other) < MEET_M * MEET_M;
        of_b.iter().any(meets)
    };
    let Some(&corner) = of_a.iter().find(is_met) else {
        return false;
    };
    let along_a = (corner - from).normalize_or_zero().dot(a.direction);
    let along_b = (to - corner).normalize_or_zero().dot(b.direction);
    let cosine = a.direction.dot(b.direction);
    let square = along_a * along_a - 2.0 * cosine * along_a * along_b + along_b * along_b;
    square <= 1.0 - cosine * cosine
}

/// About where the shortest way over two edges crosses their lines, in metres from their beginnings.
fn first_guess([a, b]: [&Edge; 2], from: DVec3, to: DVec3) -> [f64; 2] {
    let of_b_m = b.apex_m(from, to);
    [a.apex_m(from, b.at(of_b_m)), of_b_m]
}

/// Whether the shortest way over two edges' lines passes the first beyond its ends, as far as a look at the end tells that
/// `guess_m` lies behind. For each place on it there is a best one on the other; over both the length is convex, so where it
/// falls beyond an end, its least is there.
fn leaves([a, b]: [&Edge; 2], guess_m: f64, from: DVec3, to: DVec3) -> bool {
    let slope = |first_m: f64| {
        let first = a.at(first_m);
        let second = b.at(b.apex_m(first, to));
        ((first - from).normalize_or_zero() - (second - first).normalize_or_zero()).dot(a.direction)
    };
    guess_m < 0.0 && slope(0.0) > LEAST_SLOPE
        || guess_m > a.length_m && slope(a.length_m) < -LEAST_SLOPE
}

/// Where the shortest way over two edges crosses their lines; anywhere outside one's ends if not within them.
fn shortest(lines: [&Edge; 2], guess_m: [f64; 2], from: DVec3, to: DVec3) -> [DVec3; 2] {
    by_steps(lines, guess_m, from, to).unwrap_or_else(|| by_parting(lines, from, to))
}

/// By Newton's steps on the length, which is convex in both places. They may not settle where the lines all but meet: there the
/// length bends sharply.
fn by_steps(
    [a, b]: [&Edge; 2],
    [mut first_m, mut second_m]: [f64; 2],
    from: DVec3,
    to: DVec3,
) -> Option<[DVec3; 2]> {
    for _ in 0..MOST_ROUNDS {
        let (first, second) = (a.at(first_m), b.at(second_m));
        let legs = [first - from, second - first, to - second];
        let lengths = legs.map(|leg| leg.length().max(1e-9));
        let cosine = |edge: &Edge, leg: usize| legs[leg].dot(edge.direction) / lengths[leg];
        let (a0, a1, b1, b2) = (cosine(a, 0), cosine(a, 1), cosine(b, 1), cosine(b, 2));
        let slope = [a0 - a1, b1 - b2];
        let across = |c: f64, leg: usize| (1.0 - c * c) / lengths[leg];
        let curve = [across(a0, 0) + across(a1, 1), across(b1, 1) + across(b2, 2)];
        let both = -(a.direction.dot(b.direction) - a1 * b1) / lengths[1];
        let determinant = curve[0] * curve[1] - both * both;
        if determinant <= 1e-12 * curve[0] * curve[1] {
            return None;
        }
        let steps = [
            (curve[1] * slope[0] - both * slope[1]) / determinant,
            (curve[0] * slope[1] - both * slope[0]) / determinant,
        ];
        let length_m: f64 = lengths.iter().sum();
        let mut share = 1.0;
        for _ in 0..MOST_HALVINGS {
            let places = [
                a.at(first_m - share * steps[0]),
                b.at(second_m - share * steps[1]),
            ];
            let next_m =
                from.distance(places[0]) + places[0].distance(places[1]) + places[1].distance(to);
            if next_m <= length_m + 1e-12 {
                break;
            }
            share *= 0.5;
        }
        first_m -= share * steps[0];
        second_m -= share * steps[1];
        if steps.iter().all(|step| step.abs() < SETTLED_M) {
            return Some([a.at(first_m), b.at(second_m)]);
        }
    }
    None
}

/// By parting the first edge: each place on it has its best one on the second, and the length over both is convex.
fn by_parting([a, b]: [&Edge; 2], from: DVec3, to: DVec3) -> [DVec3; 2] {
    let second_of = |first: DVec3| b.at(b.apex_m(first, to));
    let (mut low_m, mut high_m) = (0.0, a.length_m);
    for _ in 0..MOST_PARTINGS {
        let middle_m = 0.5 * (low_m + high_m);
        let first = a.at(middle_m);
        let turn =
            (first - from).normalize_or_zero() - (second_of(first) - first).normalize_or_zero();
        if turn.dot(a.direction) > 0.0 {
            high_m = middle_m;
        } else {
            low_m = middle_m;
        }
    }
    let first = a.at(0.5 * (low_m + high_m));
    [first, second_of(first)]
}

/// Signed band gains of a way relative to the free field over its length.
fn gains(scene: &Scene, spot: &Endpoints, way: &Way) -> [f64; BANDS] {
    let edges = &way.edges.map(|edge| scene.edge(edge));
    let [before_m, between_m, after_m] = [
        way.diffraction_order[0].before_m,
        way.diffraction_order[1].before_m,
        way.diffraction_order[1].after_m,
    ];
    let whole_m = before_m + between_m + after_m;
    let sines = way
        .diffraction_order
        .map(|crossing| crossing.sin_edge.powi(2));
    let outer = [before_m, after_m];
    let wide = [0, 1].map(|i| Spread {
        distance_m: outer[i] * (whole_m - outer[i]) / whole_m * sines[i],
        length_m: whole_m,
    });
    let narrow = [0, 1].map(|i| Spread {
        distance_m: outer[i] * between_m / (outer[i] + between_m) * sines[i],
        length_m: outer[i] + between_m,
    });
    let turn = |i: usize| {
        let angles = WedgeAngles {
            n: edges[i].n,
            incoming: way.diffraction_order[i].incoming,
            outgoing: way.diffraction_order[i].outgoing,
        };
        angles.crossing(1.0, wide[i].distance_m)
    };
    let spreads = if turn(0) > turn(1) {
        [wide[0], narrow[1]]
    } else {
        [narrow[0], wide[1]]
    };
    // Of one wall's share that is heard through it there is nothing to take away twice.
    let through = spot.source.settings.effects.transmission;
    let beside_transmission = [through, through && !share_face([&edges[0], &edges[1]])];
    let [first, second] = [0, 1].map(|i| {
        let (incident, reflected) = edge_wave::around(
            scene,
            &edges[i],
            &way.diffraction_order[i],
            &spreads[i],
            beside_transmission[i],
            [false; 2],
        );
        std::array::from_fn::<_, BANDS, _>(|b| incident[b] + reflected[b])
    });
    // A wedge already halves a wave that comes or goes along a face, once at each edge; what leaves the first along the
    // face arrives whole at the second.
    let along = runs_along(&edges[0], way.diffraction_order[0].outgoing)
        && runs_along(&edges[1], way.diffraction_order[1].incoming);
    let share = if along { 2.0 } else { 1.0 };
    std::array::from_fn(|b| edge_wave::signed(first[b] * second[b] * share))
}

fn share_face([a, b]: [&Edge; 2]) -> bool {
    a.faces.iter().any(|face| b.faces.contains(face))
}

/// An angle, or that of a face which it all but is.
fn on_face(edge: &Edge, angle: f64) -> f64 {
    let far = edge.n * PI;
    if angle < IN_FACE {
        0.0
    } else if far - angle < IN_FACE {
        far
    } else {
        angle
    }
}

/// Whether a way leaves along one of an edge's faces.
fn runs_along(edge: &Edge, angle: f64) -> bool {
    angle < 1e-6 || edge.n * PI - angle < 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rim of a sheet.
    fn rim(origin: DVec3, direction: DVec3) -> Edge {
        let (tangent, normal) = direction.any_orthonormal_pair();
        Edge {
            key: 1,
            origin,
            direction,
            length_m: 4.0,
            tangent,
            normal,
            n: 2.0,
            faces: [0; 2],
        }
    }

    /// Numbers from -1 to 1, the same in every run.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = crate::propagation::rays::directions::mix(state);
            f64::from(crate::propagation::rays::directions::unit(state)) * 2.0 - 1.0
        }
    }

    /// Where the shortest way crosses two edges and how long it is, by trying places closer and closer together.
    fn by_trying([a, b]: [&Edge; 2], from: DVec3, to: DVec3) -> (f64, [DVec3; 2]) {
        let (mut best, mut places, mut reach_m) = (f64::INFINITY, [2.0; 2], 2.0);
        while reach_m > 1e-7 {
            let [middle_0, middle_1] = places;
            for (i, j) in (-8..=8).flat_map(|i| (-8..=8).map(move |j| (i, j))) {
                let along = |middle: f64, k: i32| {
                    (middle + reach_m * f64::from(k) / 8.0).clamp(0.0, a.length_m)
                };
                let tried = [along(middle_0, i), along(middle_1, j)];
                let (first, second) = (a.at(tried[0]), b.at(tried[1]));
                let length_m = from.distance(first) + first.distance(second) + second.distance(to);
                if length_m < best {
                    (best, places) = (length_m, tried);
                }
            }
            reach_m *= 0.6;
        }
        (best, [a.at(places[0]), b.at(places[1])])
    }

    #[test]
    fn ways_are_the_shortest_also_around_corners() {
        let mut number = numbers();
        let mut place = |size: f64| size * DVec3::new(number(), number(), number());
        let (mut found, mut through_corner) = (0, 0);
        for case in 0..2000 {
            let (corner, apart) = (place(2.0), place(1.0));
            let a = rim(corner, place(1.0).normalize());
            let meets = case % 4 != 0;
            let origin = if meets { corner } else { corner + apart };
            let b = rim(origin, place(1.0).normalize());
            let (from, to) = (place(4.0), place(4.0));
            let (length_m, [first, second]) = by_trying([&a, &b], from, to);
            if length_m > from.distance(to) + LONGEST_DETOUR_M {
                continue;
            }
            let leg_m = first.distance(second);
            let way = Way::between([0, 1], [&a, &b], from, to);
            if runs_through_corner([&a, &b], from, to) {
                assert!(meets && leg_m < 1e-3, "case {case}: leg {leg_m} m");
                through_corner += 1;
            }
            if let Some(way) = way {
                found += 1;
                let more_m = way.length_m - length_m;
                assert!(more_m.abs() < 1e-6, "case {case}: {more_m} m longer");
                assert!(leg_m > 0.9 * LEAST_LEG_M, "case {case}: leg {leg_m} m");
            }
        }
        assert!(
            found > 150 && through_corner > 150,
            "{found} {through_corner}"
        );
    }
}
