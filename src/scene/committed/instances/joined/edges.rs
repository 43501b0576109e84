//! Edges of a joined part where other parts touch them.
//!
//! What a face of another part does to an edge is what a face of its own part would do ([`crate::scene::edges::contacts`]):
//! it takes its part of the air around the edge. The rim of a floor that goes on in the next chunk is no edge, a wall of one
//! chunk on the floor of another is a wedge. The same wedge is found from both parts; the fixed part or that of the lower slot
//! keeps it. An edge keeps its number and its visible neighbours; further pieces have numbers beyond those of the part.

use glam::DVec3;

use super::Neighbours;
use crate::geometry::Ray;
use crate::scene::committed::instances::Instances;
use crate::scene::committed::instances::joint::Outcome;
use crate::scene::committed::instances::numbering::FIXED;
use crate::scene::committed::instances::placed::PlacedInstance;
use crate::scene::edges::{Contact, Edge, FLUSH_M, LEAST_LENGTH_M, contacts, pieces};
use crate::scene::surface::key::edge_key;

/// Least cosine between two edges of one line, and between the middles of equal wedges.
const SAME_LINE: f64 = 0.9999;
const SAME_WEDGE: f64 = 0.97;

/// Largest difference of the indices of equal wedges, in units of π.
const SAME_INDEX: f64 = 0.1;

/// Gap in metres that an edge bridges between two parts, and distance of a surface that closes its end.
const GAP_M: f64 = 0.03;

/// Distance of the test for such a surface from the edge, in metres.
const CLEARANCE_M: f64 = 5e-3;

/// Edges of a part in another part's bounds, sorted.
pub(super) fn edges_near(part: &PlacedInstance, other: &PlacedInstance) -> Vec<u32> {
    let mut found = Vec::new();
    let (low, high) = part.local_box(&other.bounds, GAP_M);
    part.visit_edges(low, high, |edge| found.push(edge));
    found.sort_unstable();
    found
}

/// Contacts of some edges of a part with the faces of another one; their surfaces have the scene's numbers.
pub(super) fn contacts_with(
    part: &PlacedInstance,
    edges: &[u32],
    other: &PlacedInstance,
) -> Vec<(u32, Contact)> {
    let moved: Vec<Edge> = edges
        .iter()
        .map(|&edge| other.to_local(&part.committed_edge(edge)))
        .collect();
    let mesh = &other.part.mesh;
    // The fixed part may be a hundred times as large as what lies beside these edges.
    let (low, high) = other.local_box(&part.bounds, GAP_M);
    let blocks = other.part.blocks.near(low, high);
    let near = |low, high| other.part.blocks.triangles_near(&blocks, low, high);
    let found = contacts(
        &moved,
        &mesh.vertices,
        &mesh.triangles,
        &mesh.surfaces,
        near,
    );
    let named = found.into_iter().map(|(edge, contact)| {
        let surface = other.surface_number(contact.surface);
        (edges[edge as usize], Contact { surface, ..contact })
    });
    named.collect()
}

/// What contacts leave of an edge, in the scene's coordinates.
fn rest(placed: &PlacedInstance, edge: u32) -> Vec<Edge> {
    let whole = placed.committed_edge(edge);
    let mut own: Vec<Contact> = match &placed.joint {
        Some(joint) => joint.edges.contacts_of(edge).collect(),
        None => Vec::new(),
    };
    let mut result = Vec::new();
    pieces(&whole, &mut own, &mut result);
    result
}

/// What is left of an edge beside all neighbours, in the part's coordinates.
pub(super) fn resolve(
    instances: &Instances,
    slot: usize,
    edge: u32,
    neighbours: &Neighbours,
    centre: DVec3,
) -> Outcome {
    let Some(placed) = instances.at(slot) else {
        return Outcome::Unchanged;
    };
    if !placed.is_edge(edge) {
        return Outcome::Changed(Vec::new());
    }
    let whole = placed.committed_edge(edge);
    let near = rests_near(instances, &whole, neighbours);
    let mut left = Vec::new();
    for piece in rest(placed, edge) {
        without_equals(piece, slot, &near, &mut left);
    }
    for piece in &mut left {
        piece.free_ends = [0, 1].map(|end| {
            let at_m = [0.0, piece.length_m][end];
            let point = piece.at(at_m);
            let committed = [whole.origin, whole.at(whole.length_m)][end];
            let was_free = point.distance(committed) > 1e-9 || whole.free_ends[end];
            let is_closed = || {
                let [before, behind] =
                    [-GAP_M, GAP_M].map(|m| piece.at(at_m + m) + CLEARANCE_M * piece.outward());
                let ray = Ray::between(before.as_vec3(), behind.as_vec3());
                let others = neighbours.at(point, GAP_M).chain([slot]);
                others.filter_map(|other| instances.at(other)).any(|other| {
                    let ignored = instances.part_groups(other, piece.faces);
                    other.part.bvh().any_hit(&other.ray(&ray), ignored)
                })
            };
            let goes_on = || {
                let mut others = near.iter();
                others.any(|(other, next)| {
                    let with_fixed = slot == FIXED || *other == FIXED;
                    *other != slot && continues(piece, point, next, with_fixed)
                })
            };
            was_free && !goes_on() && !is_closed()
        });
    }
    if let [piece] = left.as_slice()
        && piece.length_m == whole.length_m
        && (piece.n, piece.faces) == (whole.n, whole.faces)
    {
        let is_own = edge < placed.edge_counts()[0];
        return match is_own && piece.free_ends == whole.free_ends {
            true => Outcome::Unchanged,
            false => Outcome::Changed(vec![placed.to_local(piece)]),
        };
    }
    for piece in &mut left {
        let keys = piece
            .faces
            .map(|face| instances.surface(face).map_or(0, |surface| surface.key));
        let ends = [piece.at(0.0), piece.at(piece.length_m)];
        piece.key = edge_key(keys, ends.map(|end| end + centre));
    }
    Outcome::Changed(left.iter().map(|piece| placed.to_local(piece)).collect())
}

/// What contacts leave of the neighbours' edges near an edge, each with its slot.
fn rests_near(instances: &Instances, edge: &Edge, neighbours: &Neighbours) -> Vec<(usize, Edge)> {
    let (a, b) = (edge.origin, edge.at(edge.length_m));
    let mut near = Vec::new();
    for slot in neighbours.within(a.min(b), a.max(b), GAP_M) {
        let Some(other) = instances.at(slot) else {
            continue;
        };
        let (low, high) = other.local_bounds_of([a, b], GAP_M);
        other.visit_edges(low, high, |index| {
            let line = other.committed_edge(index);
            if line.direction.dot(edge.direction).abs() > SAME_LINE {
                near.extend(rest(other, index).into_iter().map(|piece| (slot, piece)));
            }
        });
    }
    near
}

/// Adds the parts of a piece that no lower slot has as well.
fn without_equals(piece: Edge, slot: usize, near: &[(usize, Edge)], left: &mut Vec<Edge>) {
    let mut spans = vec![[0.0, piece.length_m]];
    for (_, other) in near
        .iter()
        .filter(|(of, other)| keeps(*of, slot) && is_same_wedge(&piece, other))
    {
        let ends = [other.origin, other.at(other.length_m)];
        let [a, b] = ends.map(|end| (end - piece.origin).dot(piece.direction));
        let (from, to) = (a.min(b), a.max(b));
        spans = spans
            .into_iter()
            .flat_map(|[start, end]| [[start, end.min(from)], [start.max(to), end]])
            .filter(|[start, end]| end > start)
            .collect();
    }
    let least_m = LEAST_LENGTH_M * piece.length_scale;
    let long = |span: &[f64; 2]| span[1] - span[0] > least_m || *span == [0.0, piece.length_m];
    left.extend(spans.into_iter().filter(long).map(|[from, to]| Edge {
        origin: piece.at(from),
        length_m: to - from,
        ..piece
    }));
}

/// Whether the part of a slot keeps an edge that it has in common with another one's.
fn keeps(slot: usize, other: usize) -> bool {
    slot == FIXED || slot < other && other != FIXED
}

/// Whether two edges lie on one line and have the same exterior wedge.
fn is_same_wedge(a: &Edge, b: &Edge) -> bool {
    a.direction.dot(b.direction).abs() > SAME_LINE
        && a.line_distance_m(b.origin) <= FLUSH_M
        && a.line_distance_m(b.at(b.length_m)) <= FLUSH_M
        && (a.n - b.n).abs() <= SAME_INDEX
        && a.outward().dot(b.outward()) > SAME_WEDGE
}

/// Whether another edge between the same surfaces begins where a piece ends. Those of the fixed part have other numbers.
fn continues(piece: &Edge, end: DVec3, next: &Edge, with_fixed: bool) -> bool {
    let along = (end - next.origin).dot(next.direction);
    let has_same_faces =
        next.faces == piece.faces || next.faces == [piece.faces[1], piece.faces[0]];
    (has_same_faces || with_fixed)
        && (-GAP_M..=next.length_m + GAP_M).contains(&along)
        && is_same_wedge(piece, next)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::edges::NO_EDGE;

    #[test]
    fn a_span_of_a_lower_slot_is_taken_out() {
        let edge = |from: f64, to: f64| Edge {
            origin: DVec3::X * from,
            direction: DVec3::X,
            length_m: to - from,
            tangent: DVec3::Z,
            normal: DVec3::NEG_Y,
            n: 1.5,
            ..NO_EDGE
        };
        let near = [(0, edge(2.0, 3.0)), (7, edge(0.0, 10.0))];
        let mut left = Vec::new();
        without_equals(edge(0.0, 8.0), 4, &near, &mut left);
        let spans: Vec<[f64; 2]> = left
            .iter()
            .map(|e| [e.origin.x, e.origin.x + e.length_m])
            .collect();
        assert_eq!(spans, [[0.0, 2.0], [3.0, 8.0]]);
    }
}
