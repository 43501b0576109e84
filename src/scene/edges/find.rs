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
use super::longest::longest;

/// Largest angle between collinear segments, in degrees.
const SAME_LINE_DEG: f64 = 0.2;

/// Most segments at one vertex between the same faces that one of them is compared with: bounds the time where thousands
/// of triangles share a corner.
const MOST_AT_VERTEX: usize = 256;

/// Segment of an edge along one side of a triangle. Small, because thousands of loose triangles have three each.
struct Segment {
    vertices: [u32; 2],
    /// Triangle of the first face.
    triangle: u32,
    n: f64,
    faces: [u32; 2],
    /// Triangle of the second face.
    second: u32,
}

/// The edges of a mesh.
pub(super) struct FoundEdges {
    /// Those of panels, sorted by key.
    pub(super) of_panels: Vec<Edge>,
    /// Those of border pieces alone, sorted by key, and the piece of each face, or [`NO_PIECE`].
    pub(super) of_border: Vec<Edge>,
    pub(super) pieces: Vec<[u32; 2]>,
}

/// A face that is no border piece.
pub(super) const NO_PIECE: u32 = u32::MAX;

/// Collinear segments as one: the first of them, and the two vertices farthest apart.
struct Line {
    segment: u32,
    ends: [u32; 2],
}

/// The edges of a mesh.
pub(super) fn find(
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
    centre: DVec3,
    length_scale: f64,
) -> FoundEdges {
    let mesh = Mesh {
        vertices,
        triangles,
        surfaces,
    };
    let key = |edge: &Edge| {
        let faces = edge.faces.map(|face| surfaces.surfaces[face as usize].key);
        let ends = [edge.at(0.0), edge.at(edge.length_m)];
        edge_key(faces, ends.map(|end| end + centre))
    };
    let [segments, of_border] = mesh.segments();
    let edges = mesh.edges(&segments, length_scale, |_| 0);
    drop(segments);
    let edges = flush::cut(edges, vertices, triangles, surfaces);
    let mut edges = longest(&edges, |edge| edge.length_m, |edge| *edge);
    for edge in &mut edges {
        edge.key = key(edge);
    }
    edges.sort_by_key(|edge| edge.key);
    let keys: Vec<u64> = edges.iter().map(|edge| edge.key).collect();
    for (edge, key) in edges.iter_mut().zip(distinct(&keys)) {
        edge.key = key;
    }
    edges.sort_by_key(|edge| edge.key);
    // Until their faces are known, the keys hold the pieces.
    let piece = |triangle| surfaces.border().of_triangle(triangle).unwrap_or(NO_PIECE);
    let of_border = mesh.edges(&of_border, length_scale, |segment| {
        u64::from(piece(segment.triangle)) << 32 | u64::from(piece(segment.second))
    });
    let of_border = flush::cut(of_border, vertices, triangles, surfaces);
    let mut border: Vec<([u32; 2], Edge)> = of_border
        .into_iter()
        .map(|edge| {
            let pieces = [(edge.key >> 32) as u32, edge.key as u32];
            let key = key(&edge);
            (pieces, Edge { key, ..edge })
        })
        .collect();
    border.sort_by_key(|(_, edge)| edge.key);
    FoundEdges {
        of_panels: edges,
        of_border: border.iter().map(|(_, edge)| *edge).collect(),
        pieces: border.iter().map(|(pieces, _)| *pieces).collect(),
    }
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

/// The mesh whose edges are searched.
#[derive(Clone, Copy)]
struct Mesh<'a> {
    vertices: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    surfaces: &'a SurfaceSet,
}

impl Mesh<'_> {
    fn position(&self, vertex: u32) -> DVec3 {
        self.vertices[vertex as usize].as_dvec3()
    }

    /// The longest edges without regard to contacts, with a key for each.
    fn edges(
        &self,
        segments: &[Segment],
        length_scale: f64,
        key: impl Fn(&Segment) -> u64,
    ) -> Vec<Edge> {
        let mut lines = self.join(segments);
        let length_m = |line: &Line| {
            let [low, high] = line.ends.map(|end| self.position(end));
            low.distance(high)
        };
        lines.retain(|line| length_m(line) > LEAST_LENGTH_M * length_scale);
        longest(&lines, length_m, |line| {
            let segment = &segments[line.segment as usize];
            Edge {
                key: key(segment),
                length_scale,
                ..self.edge(segment, line.ends)
            }
        })
    }

    /// The segments of edges of panels, and of those of border pieces alone.
    fn segments(&self) -> [Vec<Segment>; 2] {
        let sides = sorted_edges(self.triangles);
        let shell = room_shell(self.vertices, self.triangles);
        let surfaces = self.surfaces;
        let is_flat = |same: &[(u64, u32)]| {
            let surface = |side: u32| surfaces.triangle_surface[(side / 3) as usize];
            let curved = |side: u32| surfaces.curved.of_triangle(side / 3);
            // Neighbours in a plane or in a curved surface.
            same.len() == 2
                && (surface(same[0].1) == surface(same[1].1)
                    || curved(same[0].1).is_some() && curved(same[0].1) == curved(same[1].1))
        };
        let is_panel = |triangle: u32| surfaces.is_panel(triangle);
        let is_border = |triangle: u32| surfaces.border().of_triangle(triangle).is_some();
        let has = |same: &[(u64, u32)], is_large: &dyn Fn(u32) -> bool| {
            same.iter().any(|&(_, side)| is_large(side / 3))
        };
        let found = |is_large: &dyn Fn(u32) -> bool, is_other: &dyn Fn(u32) -> bool| {
            let candidates = || {
                let all = sides.chunk_by(|a, b| a.0 == b.0);
                all.filter(|same| !is_flat(same) && has(same, is_large) && !has(same, is_other))
            };
            let mut segments = Vec::with_capacity(candidates().count());
            segments.extend(candidates().filter_map(|same| {
                let ends = [(same[0].0 >> 32) as u32, same[0].0 as u32];
                self.segment(ends, same, &shell, is_large)
            }));
            segments
        };
        let of_border = match surfaces.border().as_slice().is_empty() {
            true => Vec::new(),
            false => found(&is_border, &is_panel),
        };
        [found(&is_panel, &|_| false), of_border]
    }

    fn direction(&self, [from, to]: [u32; 2]) -> Option<DVec3> {
        let along = self.position(to) - self.position(from);
        along.try_normalize().map(oriented)
    }

    /// From a side of a triangle into it, in the plane of its surface, which is more accurate than a small triangle's.
    fn tangent(&self, triangle: u32, first_end: u32, direction: DVec3) -> Option<DVec3> {
        let corners = self.triangles[triangle as usize].map(|v| self.position(v));
        let surface = self.surfaces.triangle_surface[triangle as usize];
        let normal = self.surfaces.surfaces[surface as usize].normal;
        let across = normal.cross(direction);
        let third = corners.iter().copied().sum::<DVec3>() / 3.0 - self.position(first_end);
        Some(across.try_normalize()? * 1f64.copysign(across.dot(third)))
    }

    /// Direction and tangent of a segment.
    fn frame(&self, segment: &Segment) -> [DVec3; 2] {
        let direction = self.direction(segment.vertices).unwrap_or_default();
        let tangent = self.tangent(segment.triangle, segment.vertices[0], direction);
        [direction, tangent.unwrap_or_default()]
    }

    fn segment(
        &self,
        ends: [u32; 2],
        sides: &[(u64, u32)],
        shell: &[bool],
        is_large: &dyn Fn(u32) -> bool,
    ) -> Option<Segment> {
        let direction = self.direction(ends)?;
        if let [(_, side)] = *sides {
            // A boundary.
            let triangle = side / 3;
            self.tangent(triangle, ends[0], direction)?;
            let surface = self.surfaces.triangle_surface[triangle as usize];
            return is_large(triangle).then_some(Segment {
                vertices: ends,
                triangle,
                second: triangle,
                n: 2.0,
                faces: [surface; 2],
            });
        }
        let mut faces: Vec<Face> = Vec::with_capacity(sides.len());
        for &(_, side) in sides {
            let triangle = side / 3;
            let corners = self.triangles[triangle as usize].map(|v| self.position(v));
            faces.push(Face {
                angle: 0.0,
                tangent: self.tangent(triangle, ends[0], direction)?,
                normal: (corners[1] - corners[0]).cross(corners[2] - corners[0]),
                surface: self.surfaces.triangle_surface[triangle as usize],
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
        let panels = is_large(first.triangle) || is_large(second.triangle);
        // The air's side of the first face is where angles grow, of the second where they fall.
        let first_looks_away = first.normal.dot(direction.cross(first.tangent)) < 0.0;
        let second_looks_away = second.normal.dot(second.tangent.cross(direction)) < 0.0;
        let rock = shell[first.triangle as usize] && first_looks_away && second_looks_away;
        (panels && !rock).then_some(Segment {
            vertices: ends,
            triangle: first.triangle,
            second: second.triangle,
            n: gap(widest) / PI,
            faces: [first.surface, second.surface],
        })
    }

    /// Joins collinear segments between the same faces that touch.
    fn join(&self, segments: &[Segment]) -> Vec<Line> {
        let mut ends: Vec<([u32; 2], u32, u32)> = Vec::with_capacity(2 * segments.len());
        for (index, segment) in segments.iter().enumerate() {
            for vertex in segment.vertices {
                ends.push((segment.faces, vertex, index as u32));
            }
        }
        ends.sort_unstable();
        let mut sets = DisjointSets::new(segments.len());
        let least = SAME_LINE_DEG.to_radians().cos();
        let mut frames: Vec<[DVec3; 2]> = Vec::new();
        for same in ends.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            if same.len() == 1 {
                continue;
            }
            frames.clear();
            frames.extend(same.iter().map(|end| self.frame(&segments[end.2 as usize])));
            for (i, &[direction, tangent]) in frames.iter().enumerate() {
                for k in i.saturating_sub(MOST_AT_VERTEX)..i {
                    let [other_direction, other_tangent] = frames[k];
                    if direction.dot(other_direction) > least && tangent.dot(other_tangent) > 0.0 {
                        sets.union(same[i].2, same[k].2);
                    }
                }
            }
        }
        drop(ends);
        let mut groups: Vec<(u32, u32)> = (0..segments.len() as u32)
            .map(|index| (sets.root(index), index))
            .collect();
        groups.sort_unstable();
        let lines = || groups.chunk_by(|a, b| a.0 == b.0);
        let mut result = Vec::with_capacity(lines().count());
        result.extend(lines().map(|group| {
            let segment = group[0].1;
            let direction = self.direction(segments[segment as usize].vertices);
            let direction = direction.unwrap_or_default();
            let points = || {
                let of_segment = |&(_, index): &(u32, u32)| segments[index as usize].vertices;
                group.iter().flat_map(of_segment)
            };
            let along = |v: &u32| self.position(*v).dot(direction);
            let order = |a: &u32, b: &u32| along(a).total_cmp(&along(b));
            let (low, high) = (points().min_by(order), points().max_by(order));
            Line {
                segment,
                ends: [low, high].map(Option::unwrap_or_default),
            }
        }));
        result
    }

    fn edge(&self, segment: &Segment, ends: [u32; 2]) -> Edge {
        let [low, high] = ends.map(|end| self.position(end));
        let [direction, tangent] = self.frame(segment);
        let direction = (high - low).normalize_or(direction);
        let tangent = (tangent - tangent.dot(direction) * direction).normalize();
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
