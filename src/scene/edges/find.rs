//! Finds the diffracting edges of a mesh.
//!
//! The faces at a line of the mesh are sorted by angle. The widest gap between neighbours is the exterior wedge; the line
//! is an edge if the gap exceeds a half-turn (a boundary edge has one face and a gap of 2π). Winding has no effect on solids
//! and sheets; only a room's shell around other parts has no edges behind its faces. A superfluous edge costs time; a missing
//! edge causes a hard shadow.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::super::closed_parts::room_shell;
use super::super::surface::SurfaceSet;
use super::super::surface::key::{distinct, edge_key};
use super::super::surface::panel::DisjointSets;
use super::super::weld::sorted_edges;
use super::edge::{Edge, LEAST_LENGTH_M, LEAST_TURN_DEG};
use super::flush;

/// Largest angle between collinear segments, in degrees.
const SAME_LINE_DEG: f64 = 0.2;

/// Most edges of a scene, the longest ones: 32,768 of them with their tree and graph take 8 MB.
const MOST_EDGES: usize = 1 << 15;

/// Segment of an edge along one side of a triangle.
struct Segment {
    vertices: [u32; 2],
    direction: DVec3,
    tangent: DVec3,
    n: f64,
    faces: [u32; 2],
}

/// The edges of a mesh, sorted by key.
pub(super) fn find(
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
    centre: DVec3,
    length_scale: f64,
) -> Vec<Edge> {
    let sides = sorted_edges(triangles);
    let shell = room_shell(vertices, triangles);
    let position = |v: u32| vertices[v as usize].as_dvec3();
    let mut segments = Vec::new();
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        let surface = |side: u32| surfaces.triangle_surface[(side / 3) as usize];
        let curved = |side: u32| surfaces.curved.of_triangle(side / 3);
        // Neighbours in a plane or in a curved surface.
        let flat = same.len() == 2
            && (surface(same[0].1) == surface(same[1].1)
                || curved(same[0].1).is_some() && curved(same[0].1) == curved(same[1].1));
        if flat || !same.iter().any(|&(_, side)| surfaces.is_panel(side / 3)) {
            continue;
        }
        let ends = [(same[0].0 >> 32) as u32, same[0].0 as u32];
        if let Some(segment) = segment(ends, same, triangles, surfaces, &shell, position) {
            segments.push(segment);
        }
    }
    let mut edges = join(&segments, position);
    for edge in &mut edges {
        edge.length_scale = length_scale;
    }
    edges.retain(|edge| edge.length_m > LEAST_LENGTH_M * length_scale);
    let edges = flush::cut(longest(&edges), vertices, triangles, surfaces);
    let mut edges = longest(&edges);
    for edge in &mut edges {
        let faces = edge.faces.map(|face| surfaces.surfaces[face as usize].key);
        edge.key = edge_key(
            faces,
            [edge.at(0.0), edge.at(edge.length_m)].map(|p| p + centre),
        );
    }
    edges.sort_by_key(|edge| edge.key);
    let keys: Vec<u64> = edges.iter().map(|edge| edge.key).collect();
    for (edge, key) in edges.iter_mut().zip(distinct(&keys)) {
        edge.key = key;
    }
    edges.sort_by_key(|edge| edge.key);
    edges
}

/// The [`MOST_EDGES`] longest edges, longest first; of equal ones the first in the list.
fn longest(edges: &[Edge]) -> Vec<Edge> {
    // Bits of positive numbers sort as the numbers do; inverted, the longest comes first.
    let rank = |(index, edge): (u32, &Edge)| (!edge.length_m.to_bits(), index);
    let mut order: Vec<(u64, u32)> = (0..).zip(edges).map(rank).collect();
    if order.len() > MOST_EDGES {
        order.select_nth_unstable(MOST_EDGES);
        order.truncate(MOST_EDGES);
    }
    order.sort_unstable();
    let of_index = |(_, index)| edges[index as usize];
    order.into_iter().map(of_index).collect()
}

/// One face at an edge.
#[derive(Clone, Copy)]
struct Face {
    /// Angle from the first face.
    angle: f64,
    /// From the edge into the face.
    tangent: DVec3,
    /// Normal by the triangle's winding.
    normal: DVec3,
    surface: u32,
    triangle: u32,
}

fn segment(
    ends: [u32; 2],
    sides: &[(u64, u32)],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
    shell: &[bool],
    position: impl Fn(u32) -> DVec3,
) -> Option<Segment> {
    let along = position(ends[1]) - position(ends[0]);
    let direction = along.try_normalize().map(oriented)?;
    let mut faces: Vec<Face> = Vec::with_capacity(sides.len());
    for &(_, side) in sides {
        let triangle = side / 3;
        let corners = triangles[triangle as usize].map(&position);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let surface = surfaces.triangle_surface[triangle as usize];
        // The surface's plane is more accurate than a small triangle's.
        let across = surfaces.surfaces[surface as usize].normal.cross(direction);
        let third = corners.iter().copied().sum::<DVec3>() / 3.0 - position(ends[0]);
        let tangent = across.try_normalize()? * 1f64.copysign(across.dot(third));
        faces.push(Face {
            angle: 0.0,
            tangent,
            normal,
            surface,
            triangle,
        });
    }
    let (x, y) = (faces[0].tangent, direction.cross(faces[0].tangent));
    for face in &mut faces[1..] {
        face.angle = face
            .tangent
            .dot(y)
            .atan2(face.tangent.dot(x))
            .rem_euclid(2.0 * PI);
    }
    faces.sort_by(|a, b| a.angle.total_cmp(&b.angle).then(a.surface.cmp(&b.surface)));
    let gap = |i: usize| match faces.get(i + 1) {
        Some(next) => next.angle - faces[i].angle,
        None => faces[0].angle + 2.0 * PI - faces[i].angle,
    };
    let widest = (0..faces.len()).max_by(|&a, &b| gap(a).total_cmp(&gap(b)))?;
    let (first, second) = (faces[widest], faces[(widest + 1) % faces.len()]);
    if gap(widest) < PI + LEAST_TURN_DEG.to_radians() {
        return None;
    }
    // One large face suffices for a shadow: the other may be narrow, such as a door jamb.
    let panels = surfaces.is_panel(first.triangle) || surfaces.is_panel(second.triangle);
    // The air's side of the first face is where angles grow, of the second where they fall.
    let first_looks_away = first.normal.dot(direction.cross(first.tangent)) < 0.0;
    let second_looks_away = second.normal.dot(second.tangent.cross(direction)) < 0.0;
    let rock = shell[first.triangle as usize] && first_looks_away && second_looks_away;
    (panels && !rock).then_some(Segment {
        vertices: ends,
        direction,
        tangent: first.tangent,
        n: gap(widest) / PI,
        faces: [first.surface, second.surface],
    })
}

/// The direction or its opposite: the first large component of y, x, z is positive.
fn oriented(direction: DVec3) -> DVec3 {
    let leading = [direction.y, direction.x, direction.z]
        .into_iter()
        .find(|component| component.abs() > 0.1);
    if leading.is_some_and(|component| component < 0.0) {
        -direction
    } else {
        direction
    }
}

/// Joins collinear segments between the same faces that touch.
fn join(segments: &[Segment], position: impl Fn(u32) -> DVec3) -> Vec<Edge> {
    let mut ends: Vec<([u32; 2], u32, u32)> = Vec::with_capacity(2 * segments.len());
    for (index, segment) in segments.iter().enumerate() {
        for vertex in segment.vertices {
            ends.push((segment.faces, vertex, index as u32));
        }
    }
    ends.sort_unstable();
    let mut sets = DisjointSets::new(segments.len());
    let least = SAME_LINE_DEG.to_radians().cos();
    for same in ends.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for (i, &(_, _, a)) in same.iter().enumerate() {
            for &(_, _, b) in &same[..i] {
                let (p, q) = (&segments[a as usize], &segments[b as usize]);
                if p.direction.dot(q.direction) > least && p.tangent.dot(q.tangent) > 0.0 {
                    sets.union(a, b);
                }
            }
        }
    }
    let mut groups: Vec<(u32, u32)> = (0..segments.len() as u32)
        .map(|index| (sets.root(index), index))
        .collect();
    groups.sort_unstable();
    groups
        .chunk_by(|a, b| a.0 == b.0)
        .map(|group| {
            let points = || {
                group
                    .iter()
                    .flat_map(|&(_, index)| segments[index as usize].vertices)
            };
            let along = |v: &u32| position(*v).dot(segments[group[0].0 as usize].direction);
            let order = |a: &u32, b: &u32| along(a).total_cmp(&along(b));
            let (low, high) = (points().min_by(order), points().max_by(order));
            edge(
                &segments[group[0].0 as usize],
                low.map(&position),
                high.map(&position),
            )
        })
        .collect()
}

fn edge(segment: &Segment, low: Option<DVec3>, high: Option<DVec3>) -> Edge {
    let (low, high) = (low.unwrap_or_default(), high.unwrap_or_default());
    let direction = (high - low).normalize_or(segment.direction);
    let tangent = (segment.tangent - segment.tangent.dot(direction) * direction).normalize();
    Edge {
        key: 0,
        origin: low,
        direction,
        length_m: low.distance(high),
        tangent,
        normal: direction.cross(tangent),
        n: segment.n,
        faces: segment.faces,
        free_ends: [true; 2],
        length_scale: 1.0,
    }
}
