//! A path over two edges: its geometry and its wave.
//!
//! Each edge is a separate wedge, and their fields multiply. The distance parameters are \[PIERCE74\]'s: the edge with the
//! greater diffraction angle has the whole rest of the path on its other side, the other edge only the leg between the two;
//! this is reciprocal. Along a face that both edges share the wave and its reflection coincide: each product is halved. Either
//! wave is truncated where its edge ends in the air, by the excess of the whole path over that end.

use glam::DVec3;

use crate::acoustics::{BANDS, smoothstep};
use crate::propagation::diffraction::complex::ComplexBands;
use crate::propagation::diffraction::edge_ends::{IN_FACE, NARROW_M, OwnEnd, PARALLEL, own_ends};
use crate::propagation::diffraction::edge_wave::{self, EdgePath, is_unoccluded, local_positions};
use crate::propagation::diffraction::ranked_list::insert_ranked;
use crate::propagation::diffraction::two_edge_crossings::{
    Crossings, first_guess, least_length_m, minimum_lies_beyond_end, newton, passes_corner,
    within_first_edge,
};
use crate::propagation::diffraction::wedge_geometry::{Spread, WedgeAngles, is_on_face};
use crate::propagation::diffraction::{MAX_DETOUR_M, fade_out};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::Interaction;
use crate::propagation::path::Path;
use crate::scene::Scene;
use crate::scene::edges::{Edge, EdgeCrossing, FACE_REACH_M};

/// Shortest leg between two edges in metres; this and the lengths below are multiplied by [`Edge::length_scale`].
const MIN_LEG_M: f64 = 0.02;

/// Length in metres within which a path over two edges that meet at a corner fades towards the corner.
const CORNER_LEG_M: f64 = 0.25;

/// A path over two edges.
#[derive(Debug, Clone, Copy)]
pub struct TwoEdgePath {
    edges: [u32; 2],
    crossings: [EdgeCrossing; 2],
    /// As [`EdgeCrossing::excess_m`], of the path over common ends of both edges.
    excess_m: [f64; 2],
    /// Whether the edges end together; otherwise each has its own ends.
    has_common_ends: bool,
    length_m: f64,
}

/// Inserts a path into a list of the shortest ones, shortest first.
pub(crate) fn insert_shortest(shortest: &mut [Option<TwoEdgePath>], new: TwoEdgePath) {
    let rank = |path: &TwoEdgePath| (path.length_m, path.edges);
    let _ = insert_ranked(shortest, new, |old| rank(old) < rank(&new));
}

impl TwoEdgePath {
    /// The shortest path over two edges in this order, if both crossings lie within the edges, the path stays in the air
    /// around both and its detour is below [`MAX_DETOUR_M`]. Occlusion is not tested.
    pub fn over(scene: &Scene, edges: [u32; 2], endpoints: &Endpoints) -> Option<Self> {
        let (from, to) = local_positions(scene, endpoints);
        let lines = edges.map(|edge| scene.edge(edge));
        Self::between(edges, [&lines[0], &lines[1]], from, to)
    }

    /// The same over given edges between local positions.
    pub(crate) fn between(
        edges: [u32; 2],
        lines: [&Edge; 2],
        from: DVec3,
        to: DVec3,
    ) -> Option<Self> {
        Self::up_to(f64::INFINITY, edges, lines, from, to)
    }

    /// The same if it is not longer than `most_m`: most of those that are longer are known before they are found.
    pub(crate) fn up_to(
        most_m: f64,
        edges: [u32; 2],
        [a, b]: [&Edge; 2],
        from: DVec3,
        to: DVec3,
    ) -> Option<Self> {
        // The test that leaves out most comes first.
        let guess_m = first_guess([a, b], from, to);
        if least_length_m([a, b], guess_m, from, to) > most_m
            || passes_corner([a, b], from, to)
            || !a.is_outside(from)
            || !b.is_outside(to)
        {
            return None;
        }
        let ends = common_ends([a, b]);
        if ends.is_none()
            && (minimum_lies_beyond_end([a, b], guess_m[0], from, to)
                || minimum_lies_beyond_end([b, a], guess_m[1], to, from))
        {
            return None;
        }
        let [first, second] = match newton([a, b], guess_m, most_m, from, to) {
            Crossings::Found(crossings) => crossings,
            Crossings::TooLong => return None,
            Crossings::NotConverged => within_first_edge([a, b], from, to),
        };
        let leg_m = first.distance(second);
        let shortest_m = from.distance(first) + leg_m + second.distance(to);
        if leg_m < MIN_LEG_M * a.length_scale || shortest_m > most_m {
            return None;
        }
        let mut crossings = [a.crossing(from, second)?, b.crossing(first, to)?];
        if let Some(face) = shared_face([a, b]) {
            // The leg lies in the face except for rounding, on one side of it.
            let air = air_side([a, b], face, [from, to]);
            crossings[0].outgoing = snapped_to_face(a, crossings[0].outgoing, air);
            crossings[1].incoming = snapped_to_face(b, crossings[1].incoming, air);
        }
        let mut beyond_m = crossings.iter().map(EdgeCrossing::beyond_m).sum();
        let mut excess_m = [f64::INFINITY; 2];
        let has_common_ends = ends.is_some();
        if let Some(ends) = ends {
            for (excess, end) in excess_m.iter_mut().zip(ends) {
                let over_end_m = from.distance(end.points[0])
                    + end.points[0].distance(end.points[1])
                    + end.points[1].distance(to);
                let inside = (end.points[0] - first)
                    .dot(end.outward)
                    .min((end.points[1] - second).dot(end.outward));
                *excess = (over_end_m - shortest_m).max(0.0).copysign(inside);
                if inside < 0.0 {
                    (crossings[0].apex, crossings[1].apex) = (end.points[0], end.points[1]);
                }
                if !end.is_free {
                    if inside < 0.0 {
                        return None;
                    }
                    *excess = f64::INFINITY;
                }
            }
        }
        if has_common_ends {
            beyond_m = excess_m.into_iter().fold(0.0, |most: f64, m| most.max(-m));
        }
        let length_m = shortest_m + beyond_m;
        (length_m < from.distance(to) + MAX_DETOUR_M * a.length_scale).then_some(Self {
            edges,
            crossings,
            excess_m,
            has_common_ends,
            length_m,
        })
    }

    /// [`WedgeAngles::sides`] at both edges, four bits each.
    pub(super) fn sides(&self, scene: &Scene) -> u32 {
        let each = self.edges.iter().zip(&self.crossings);
        each.fold(0, |sides, (edge, crossing)| {
            sides << 4 | WedgeAngles::of(&scene.edge(*edge), crossing).sides()
        })
    }

    /// The edges, in the order in which sound crosses them.
    pub(super) fn edges(&self) -> [u32; 2] {
        self.edges
    }

    /// Length in metres.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// The path, if audible ([`edge_wave::is_audible`]), and its energy relative to the free field at the straight distance, of all
    /// bands. Occlusion is not tested.
    pub fn path(&self, scene: &Scene, endpoints: &Endpoints) -> Option<(Path, f64)> {
        let (from, to) = local_positions(scene, endpoints);
        let straight_m = from.distance(to);
        let leg_m = self.crossings[1].before_m;
        let reach_m = FACE_REACH_M * scene.length_scale();
        let fade = fade_out(scene, self.length_m - straight_m)
            * smoothstep(4.0 * (1.0 - leg_m / reach_m))
            * self.corner_fade(scene);
        let waves = self.field(scene, endpoints);
        let gains = waves.map(|wave| (edge_wave::real_gain(wave) * fade) as f32);
        let spreading = straight_m.max(endpoints.min_distance_m) / self.length_m;
        edge_wave::is_audible(&gains, spreading).then(|| {
            // Not of the gains, which are 0 where they change their sign.
            let energies = waves.map(|wave| (wave.abs() * fade * spreading).powi(2));
            let path = EdgePath {
                interactions: &self.edges.map(Interaction::Edge),
                points: &self.crossings.map(|crossing| crossing.apex),
                length_m: self.length_m,
                last_point: self.crossings[1].apex,
            };
            let path = path.to_path(scene, endpoints, &gains);
            (path, energies.iter().sum())
        })
    }

    /// Weight of a path by its leg between two edges that meet at a corner: 0 at the shortest one. At the corner both edges'
    /// own waves end.
    fn corner_fade(&self, scene: &Scene) -> f64 {
        let [a, b] = &self.edges.map(|edge| scene.edge(edge));
        match meet_at_corner([a, b]) {
            true => {
                let [least_m, whole_m] = [MIN_LEG_M, CORNER_LEG_M].map(|m| m * a.length_scale);
                smoothstep((self.crossings[1].before_m - least_m) / whole_m)
            }
            false => 1.0,
        }
    }

    /// Whether nothing occludes it. Adds the rays cast, three at most, to `rays`.
    pub fn is_unoccluded(&self, scene: &Scene, endpoints: &Endpoints, rays: &mut u64) -> bool {
        let (from, to) = local_positions(scene, endpoints);
        let [a, b] = &self.edges.map(|edge| scene.edge(edge));
        let [first, second] = [(a, 0), (b, 1)]
            .map(|(edge, i)| edge_wave::sight_point(edge, self.crossings[i].apex, edge.outward()));
        // The leg between may lie in a face of both, or along one of each.
        let along = || {
            let [first, second] = &self.crossings;
            [
                a.face_beside(first.outgoing),
                b.face_beside(second.incoming),
            ]
        };
        let between = shared_face([a, b]).map_or_else(along, |face| [face; 2]);
        is_unoccluded(scene, second, to, b.faces, rays)
            && is_unoccluded(scene, from, first, a.faces, rays)
            && is_unoccluded(scene, first, second, between, rays)
    }

    /// The field relative to the free field over its length.
    pub fn field(&self, scene: &Scene, endpoints: &Endpoints) -> ComplexBands {
        let edges = &self.edges.map(|edge| scene.edge(edge));
        let crossings = &self.crossings;
        let outer_m = [crossings[0].before_m, crossings[1].after_m];
        let between_m = crossings[1].before_m;
        let whole_m = outer_m[0] + between_m + outer_m[1];
        let sines = crossings.map(|crossing| crossing.sin_edge.powi(2));
        let wide = [0, 1].map(|i| Spread {
            distance_m: outer_m[i] * (whole_m - outer_m[i]) / whole_m * sines[i],
            length_m: whole_m,
        });
        let narrow = [0, 1].map(|i| Spread {
            distance_m: outer_m[i] * between_m / (outer_m[i] + between_m) * sines[i],
            length_m: outer_m[i] + between_m,
        });
        let [first, second] = [0, 1].map(|i| {
            WedgeAngles::of(&edges[i], &crossings[i]).transition_argument(1.0, wide[i].distance_m)
        });
        let first_is_wide = first > second;
        let spreads = match first_is_wide {
            true => [wide[0], narrow[1]],
            false => [narrow[0], wide[1]],
        };
        let transmission = endpoints.source.settings.effects.transmission;
        let shared = shared_face([&edges[0], &edges[1]]);
        // A face too small to reflect continues no reflection, but it carries the wave between its own edges.
        let is_dull = |face| Some(face) != shared && !scene.has_panels(face);
        let (from, to) = local_positions(scene, endpoints);
        let ends = [
            own_ends([&edges[0], &edges[1]], &crossings[0], [from, to], whole_m),
            own_ends([&edges[1], &edges[0]], &crossings[1], [to, from], whole_m),
        ];
        // The field of each edge, beside transmission and without.
        let fields = [0, 1].map(|i| {
            let crossing = EdgeCrossing {
                excess_m: match self.has_common_ends {
                    true if (i == 0) == first_is_wide => self.excess_m,
                    true => [f64::INFINITY; 2],
                    false => ends[i].map(|end| end.excess_m),
                },
                ..crossings[i]
            };
            let dull = edges[i].faces.map(is_dull);
            let fading = edge_wave::finite_panel_faces(scene, &edges[i], crossing.apex);
            let is_shared = |face: usize| Some(edges[i].faces[face]) == shared;
            let (incident, reflected) = edge_wave::field_of_faces(
                scene,
                &edges[i],
                &crossing,
                &spreads[i],
                false,
                |face, wave, along| match dull[face] {
                    true => 0.0,
                    false if is_shared(face) => 1.0,
                    false => edge_wave::continuation_factor(wave, fading[face], along),
                },
            );
            let loss = match transmission {
                true => edge_wave::barrier_loss(scene, &edges[i]),
                false => [1.0; BANDS],
            };
            let beside = |b: usize| incident[b] * f64::from(loss[b]) + reflected[b];
            let alone = |b: usize| incident[b] + reflected[b];
            [
                std::array::from_fn::<_, BANDS, _>(beside),
                std::array::from_fn(alone),
            ]
        });
        // One wall's transmission loss is applied once, at either edge alike.
        let product = |b: usize| match shared {
            Some(_) => {
                (fields[0][0][b] * fields[1][1][b] + fields[0][1][b] * fields[1][0][b]) * 0.5
            }
            None => fields[0][0][b] * fields[1][0][b],
        };
        // Both edges halve the wave along a common face; once is correct.
        let along_face = is_on_face(edges[0].n, crossings[0].outgoing)
            && is_on_face(edges[1].n, crossings[1].incoming);
        // Up to an end at a wall an edge counts as infinite, and half of its wave is left there: what lies beyond is twice
        // as much, which continues it.
        let is_beyond_wall = |end: &&OwnEnd| end.is_at_wall && end.excess_m < 0.0;
        let beyond = match self.has_common_ends {
            true => 0,
            false => ends.iter().flatten().filter(is_beyond_wall).count(),
        };
        let factor = [1.0, 2.0, 4.0][beyond] * if along_face { 2.0 } else { 1.0 };
        std::array::from_fn(|b| product(b) * factor)
    }
}

/// Whether two edges are both sides of a narrow face, such as a door's jamb.
pub(crate) fn bound_narrow_face([a, b]: [&Edge; 2]) -> bool {
    let across = b.origin - a.origin;
    let across = across - across.dot(a.direction) * a.direction;
    let narrow_m = NARROW_M * a.length_scale;
    let is_near = a.direction.dot(b.direction).abs() > PARALLEL
        && across.length_squared() < narrow_m * narrow_m;
    is_near
        && shared_face([a, b]).is_some_and(|face| {
            let into_face = a.face_tangent(usize::from(a.faces[0] != face));
            into_face.dot(across) > 0.0
        })
}

/// Whether two edges nearly meet at a corner.
pub(crate) fn meet_at_corner([a, b]: [&Edge; 2]) -> bool {
    a.direction.dot(b.direction).abs() < PARALLEL && a.distance_m(b) < NARROW_M * a.length_scale
}

/// An end that two edges have in common.
struct CommonEnd {
    points: [DVec3; 2],
    outward: DVec3,
    is_free: bool,
}

/// Both ends of two edges of a narrow face of even width.
fn common_ends([a, b]: [&Edge; 2]) -> Option<[CommonEnd; 2]> {
    if !bound_narrow_face([a, b]) || (a.length_m - b.length_m).abs() > 0.01 * a.length_m {
        return None;
    }
    let cosine = a.direction.dot(b.direction);
    Some([0, 1].map(|end| {
        let other = if cosine > 0.0 { end } else { 1 - end };
        CommonEnd {
            points: [a.at([0.0, a.length_m][end]), b.at([0.0, b.length_m][other])],
            outward: a.direction * [-1.0, 1.0][end],
            is_free: a.free_ends[end] && b.free_ends[other],
        }
    }))
}

fn shared_face([a, b]: [&Edge; 2]) -> Option<u32> {
    a.faces.into_iter().find(|face| b.faces.contains(face))
}

/// Normal of a face that two edges share, on the side of the leg between them. At the rim of a sheet both sides are air: the
/// other edge has the side. Between two rims of one sheet both sides give the same product of fields, but for absorption; it
/// is the side of the end that is farther from the sheet.
fn air_side([a, b]: [&Edge; 2], face: u32, ends: [DVec3; 2]) -> DVec3 {
    let one_sided = |edge: &&Edge| edge.faces[0] != edge.faces[1];
    match [a, b].into_iter().find(one_sided) {
        Some(edge) => edge.face_normal(usize::from(edge.faces[0] != face)),
        None => {
            let heights_m = ends.map(|end| a.normal.dot(end - a.origin));
            a.normal * 1f64.copysign(heights_m[0] + heights_m[1])
        }
    }
}

/// An angle, or that of a face which it is within [`IN_FACE`] of. At the rim of a sheet, whose faces share a plane, the face
/// is that of the side with the normal `air`.
fn snapped_to_face(edge: &Edge, angle: f64, air: DVec3) -> f64 {
    let far = edge.n * std::f64::consts::PI;
    if angle >= IN_FACE && far - angle >= IN_FACE {
        return angle;
    }
    let is_first = match edge.faces[0] == edge.faces[1] {
        true => edge.normal.dot(air) > 0.0,
        false => angle < IN_FACE,
    };
    if is_first { 0.0 } else { far }
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
            free_ends: [false; 2],
            length_scale: 1.0,
        }
    }

    /// Reproducible numbers from -1 to 1.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = crate::propagation::rays::directions::mix(state);
            f64::from(crate::propagation::rays::directions::unit(state)) * 2.0 - 1.0
        }
    }

    /// Length and crossings of the shortest path over two edges, by exhaustive search on finer and finer grids.
    fn by_search([a, b]: [&Edge; 2], from: DVec3, to: DVec3) -> (f64, [DVec3; 2]) {
        let (mut best, mut crossings_m, mut reach_m) = (f64::INFINITY, [2.0; 2], 2.0);
        while reach_m > 1e-7 {
            let [middle_0, middle_1] = crossings_m;
            for (i, j) in (-8..=8).flat_map(|i| (-8..=8).map(move |j| (i, j))) {
                let along = |middle: f64, k: i32| {
                    (middle + reach_m * f64::from(k) / 8.0).clamp(0.0, a.length_m)
                };
                let tried = [along(middle_0, i), along(middle_1, j)];
                let (first, second) = (a.at(tried[0]), b.at(tried[1]));
                let length_m = from.distance(first) + first.distance(second) + second.distance(to);
                if length_m < best {
                    (best, crossings_m) = (length_m, tried);
                }
            }
            reach_m *= 0.6;
        }
        (best, [a.at(crossings_m[0]), b.at(crossings_m[1])])
    }

    #[test]
    fn paths_are_the_shortest_also_around_corners() {
        let mut number = numbers();
        let mut position = |size: f64| size * DVec3::new(number(), number(), number());
        let (mut found, mut through_corner, mut close_bounds) = (0, 0, 0);
        for case in 0..2000 {
            let (corner, apart) = (position(2.0), position(1.0));
            let a = rim(corner, position(1.0).normalize());
            let meets = case % 4 != 0;
            let origin = if meets { corner } else { corner + apart };
            let b = rim(origin, position(1.0).normalize());
            let (from, to) = (position(4.0), position(4.0));
            let (length_m, [first, second]) = by_search([&a, &b], from, to);
            if length_m > from.distance(to) + MAX_DETOUR_M {
                continue;
            }
            let leg_m = first.distance(second);
            let path = TwoEdgePath::between([0, 1], [&a, &b], from, to);
            for crossings_m in [[2.0, 2.0], first_guess([&a, &b], from, to)] {
                let bound_m = least_length_m([&a, &b], crossings_m, from, to);
                assert!(bound_m <= length_m, "case {case}: {bound_m} m");
                close_bounds += usize::from(bound_m > 0.9 * length_m);
            }
            if passes_corner([&a, &b], from, to) {
                assert!(meets && leg_m < 1e-3, "case {case}: leg {leg_m} m");
                through_corner += 1;
            }
            if let Some(path) = path {
                found += 1;
                let more_m = path.length_m - length_m;
                // The search ends at a grid of 1e-8 m, Newton's method within 1e-6 m; the length is flat there.
                assert!(more_m.abs() < 1e-6, "case {case}: {more_m} m longer");
                assert!(leg_m > 0.9 * MIN_LEG_M, "case {case}: leg {leg_m} m");
            }
        }
        assert!(
            found > 150 && through_corner > 150 && close_bounds > 500,
            "{found} {through_corner} {close_bounds}"
        );
    }
}
