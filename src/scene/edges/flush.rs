//! Edges that lie in other faces: a solid that stands on a floor, a partition that meets a wall.
//!
//! Such a face need not share a vertex with the edge. It takes its part of the air around the edge, along the section in
//! which it lies there: what remains of the exterior wedge may still diffract, or the edge ends there. Overlaps and cracks
//! up to [`FLUSH_M`] count as contact. Own.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::super::surface::SurfaceSet;
use super::edge::{Edge, LEAST_LENGTH_M, LEAST_TURN_DEG};
use super::tree::EdgeTree;

/// Distance in metres of a face from an edge up to which they touch.
pub const FLUSH_M: f64 = 5e-3;

/// Distance from the edge, in metres, at which a face must continue in a direction: twice [`FLUSH_M`], because a face counts
/// up to [`FLUSH_M`] beyond its end.
const PROBE_M: f64 = 2.0 * FLUSH_M;

/// Shortest section of contact in metres: a face that crosses an edge touches it over less.
const LEAST_CONTACT_M: f64 = 4.0 * FLUSH_M;

/// Contacts at this angle from a face of the wedge continue that face, in radians: one degree.
const SAME_FACE: f64 = PI / 180.0;

/// Most comparisons of a triangle with an edge: bounds the time where thousands of triangles overlap.
const MOST_COMPARED: usize = 1 << 22;

/// Most comparisons of a contact with a section of its edge. Edges of more contacts than are left for stay whole.
const MOST_IN_SECTIONS: usize = 1 << 27;

/// A section of an edge along which a half-plane of another face begins.
#[derive(Clone, Copy)]
struct Contact {
    edge: u32,
    /// From and to in metres along the edge.
    span_m: [f64; 2],
    /// Angle of the half-plane around the edge.
    angle: f64,
    surface: u32,
}

/// A triangle in the plane of its surface.
struct Facet {
    corners: [DVec3; 3],
    normal: DVec3,
    surface: u32,
}

/// The edges, cut where other faces touch them; sections without a remaining exterior wedge are dropped.
pub(super) fn cut(
    edges: Vec<Edge>,
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
) -> Vec<Edge> {
    let contacts = contacts(&edges, vertices, triangles, surfaces);
    let mut result = Vec::with_capacity(edges.len());
    let (mut first, mut left) = (0, MOST_IN_SECTIONS);
    for (index, edge) in (0..).zip(&edges) {
        let own = contacts[first..].partition_point(|contact| contact.edge == index);
        let work = own.saturating_mul(2 * own + 1);
        match own {
            0 => result.push(*edge),
            _ if work > left => result.push(*edge),
            _ => {
                left -= work;
                sections(edge, &contacts[first..first + own], &mut result);
            }
        }
        first += own;
    }
    result
}

/// All contacts that narrow an edge's exterior wedge, by edge.
fn contacts(
    edges: &[Edge],
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
) -> Vec<Contact> {
    let tree = EdgeTree::build(edges);
    let mut contacts: Vec<Contact> = Vec::new();
    let mut compared = 0;
    for (triangle, &surface) in triangles.iter().zip(&surfaces.triangle_surface) {
        let facet = Facet {
            corners: triangle.map(|v| vertices[v as usize].as_dvec3()),
            normal: surfaces.surfaces[surface as usize].normal,
            surface,
        };
        let [a, b, c] = facet.corners;
        let low = a.min(b).min(c) - PROBE_M;
        let high = a.max(b).max(c) + PROBE_M;
        tree.walk(|min, max, leaf| {
            let apart = min.cmpgt(high).any() || max.cmplt(low).any();
            if apart || compared >= MOST_COMPARED || !facet.plane_meets(min, max) {
                return false;
            }
            compared += leaf.len();
            for &index in leaf {
                facet.touch(index, &edges[index as usize], &mut contacts);
            }
            true
        });
    }
    let order = |c: &Contact| (c.edge, c.surface);
    contacts.sort_by(|a, b| {
        let spans = a.span_m[0].total_cmp(&b.span_m[0]);
        order(a).cmp(&order(b)).then(spans)
    });
    contacts
}

impl Facet {
    /// Whether the plane passes through a box or within [`FLUSH_M`] of it.
    fn plane_meets(&self, min: DVec3, max: DVec3) -> bool {
        let reach_m = (0.5 * (max - min)).dot(self.normal.abs());
        let height_m = self.normal.dot(0.5 * (min + max) - self.corners[0]);
        height_m.abs() <= reach_m + FLUSH_M
    }

    /// Adds the contacts with an edge, one for each direction in which the triangle continues from it.
    fn touch(&self, index: u32, edge: &Edge, contacts: &mut Vec<Contact>) {
        let across = self.normal.cross(edge.direction);
        let Some(across) = across.try_normalize() else {
            return;
        };
        for direction in [across, -across] {
            let (x, y) = (direction.dot(edge.tangent), direction.dot(edge.normal));
            let angle = y.atan2(x).rem_euclid(2.0 * PI);
            if angle < SAME_FACE || angle > edge.n * PI - SAME_FACE {
                continue;
            }
            if let Some(span_m) = self.span_m(edge, direction) {
                contacts.push(Contact {
                    edge: index,
                    span_m,
                    angle,
                    surface: self.surface,
                });
            }
        }
    }

    /// The section of an edge from which the triangle continues in a direction of its plane.
    fn span_m(&self, edge: &Edge, direction: DVec3) -> Option<[f64; 2]> {
        let mut span_m = [0.0, edge.length_m];
        // The part of the section in which a distance from a plane is at least `least_m`.
        let mut clip = |normal: DVec3, origin: DVec3, least_m: f64| {
            let (start_m, slope) = (normal.dot(origin), normal.dot(edge.direction));
            if slope.abs() < 1e-12 {
                if start_m < least_m {
                    span_m[1] = f64::NEG_INFINITY;
                }
                return;
            }
            let at_m = (least_m - start_m) / slope;
            match slope > 0.0 {
                true => span_m[0] = span_m[0].max(at_m),
                false => span_m[1] = span_m[1].min(at_m),
            }
        };
        let [a, b, c] = self.corners;
        let line = edge.origin - a;
        clip(self.normal, line, -FLUSH_M);
        clip(-self.normal, line, -FLUSH_M);
        let probe = edge.origin + direction * PROBE_M;
        let turn = (b - a).cross(c - a).dot(self.normal).signum();
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let inward = self.normal.cross(to - from).normalize_or_zero() * turn;
            clip(inward, probe - from, -FLUSH_M);
        }
        (span_m[1] - span_m[0] > LEAST_CONTACT_M).then_some(span_m)
    }
}

/// What remains of the exterior wedge: its first and last angle and their surfaces.
type Wedge = [(f64, u32); 2];

/// Adds the sections of an edge that still diffract.
fn sections(edge: &Edge, contacts: &[Contact], result: &mut Vec<Edge>) {
    let mut ends: Vec<f64> = contacts.iter().flat_map(|c| c.span_m).collect();
    ends.extend([0.0, edge.length_m]);
    ends.sort_by(f64::total_cmp);
    let mut open: Option<([f64; 2], Wedge)> = None;
    let mut close = |section: Option<([f64; 2], Wedge)>| {
        let section = section.filter(|([from, to], _)| to - from > LEAST_LENGTH_M);
        result.extend(section.map(|(span_m, wedge)| of_wedge(edge, span_m, wedge)));
    };
    for pair in ends.windows(2) {
        let middle_m = 0.5 * (pair[0] + pair[1]);
        if pair[1] - pair[0] < 1e-9 {
            continue;
        }
        let wedge = remaining(edge, contacts, middle_m);
        match (&mut open, wedge) {
            (Some((span_m, before)), Some(wedge)) if *before == wedge => span_m[1] = pair[1],
            _ => {
                close(open.take());
                open = wedge.map(|wedge| ([pair[0], pair[1]], wedge));
            }
        }
    }
    close(open);
}

/// The widest part of the exterior wedge between contacts at a position along an edge, if it still diffracts.
fn remaining(edge: &Edge, contacts: &[Contact], at_m: f64) -> Option<Wedge> {
    let mut angles: Vec<(f64, u32)> = contacts
        .iter()
        .filter(|contact| contact.span_m[0] <= at_m && at_m <= contact.span_m[1])
        .map(|contact| (contact.angle, contact.surface))
        .collect();
    angles.push((0.0, edge.faces[0]));
    angles.push((edge.n * PI, edge.faces[1]));
    angles.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let gap = |pair: &&[(f64, u32)]| pair[1].0 - pair[0].0;
    let widest = angles
        .windows(2)
        .max_by(|a, b| gap(a).total_cmp(&gap(b)))
        .filter(|pair| gap(pair) >= PI + LEAST_TURN_DEG.to_radians())?;
    Some([widest[0], widest[1]])
}

/// The section of an edge with another exterior wedge.
fn of_wedge(edge: &Edge, [from_m, to_m]: [f64; 2], [first, second]: Wedge) -> Edge {
    let (sin, cos) = first.0.sin_cos();
    let tangent = edge.tangent * cos + edge.normal * sin;
    Edge {
        origin: edge.at(from_m),
        length_m: to_m - from_m,
        tangent,
        normal: edge.direction.cross(tangent),
        n: (second.0 - first.0) / PI,
        faces: [first.1, second.1],
        ..*edge
    }
}
