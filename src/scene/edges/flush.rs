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
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::scene) struct Contact {
    /// From and to in metres along the edge.
    pub(in crate::scene) span_m: [f64; 2],
    /// Angle of the half-plane around the edge.
    pub(in crate::scene) angle: f64,
    /// Surface of the half-plane.
    pub(in crate::scene) surface: u32,
}

/// A triangle in the plane of its surface.
struct Facet {
    corners: [DVec3; 3],
    /// Unit vectors in the plane across each side, from the corner of the same index, into the triangle.
    inward: [DVec3; 3],
    normal: DVec3,
    surface: u32,
}

/// The contacts of all edges, end to end.
struct Contacts {
    list: Vec<Contact>,
    /// End of each edge's contacts.
    ends: Vec<u32>,
}

/// The edges, cut where other faces touch them; sections without a remaining exterior wedge are dropped.
pub(super) fn cut(
    edges: Vec<Edge>,
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
) -> Vec<Edge> {
    let mut contacts = by_edge(edges.len(), contacts(&edges, vertices, triangles, surfaces));
    let mut result = Vec::with_capacity(edges.len());
    let (mut first, mut left) = (0, MOST_IN_SECTIONS);
    for (edge, &end) in edges.iter().zip(&contacts.ends) {
        let own = joined(&mut contacts.list[first as usize..end as usize]);
        let work = own.len().saturating_mul(2 * own.len() + 1);
        if own.is_empty() || work > left {
            result.push(*edge);
        } else {
            left -= work;
            sections(edge, own, &mut result);
        }
        first = end;
    }
    result
}

/// Adds what is left of one edge with these contacts.
pub(in crate::scene) fn pieces(edge: &Edge, contacts: &mut [Contact], result: &mut Vec<Edge>) {
    let own = joined(contacts);
    match own.is_empty() {
        true => result.push(*edge),
        false => sections(edge, own, result),
    }
}

/// Joins overlapping contacts of one edge with the same half-plane: thousands where triangles of a surface overlap.
fn joined(contacts: &mut [Contact]) -> &[Contact] {
    contacts.sort_unstable_by(|a, b| {
        let angles = a.angle.total_cmp(&b.angle);
        let spans = a.span_m[0].total_cmp(&b.span_m[0]);
        a.surface.cmp(&b.surface).then(angles).then(spans)
    });
    let mut count = 0;
    for index in 0..contacts.len() {
        let contact = contacts[index];
        if let Some(last) = contacts[..count].last_mut()
            && (last.surface, last.angle) == (contact.surface, contact.angle)
            && contact.span_m[0] <= last.span_m[1]
        {
            last.span_m[1] = last.span_m[1].max(contact.span_m[1]);
            continue;
        }
        contacts[count] = contact;
        count += 1;
    }
    &contacts[..count]
}

/// All contacts that narrow an edge's exterior wedge, each with the index of its edge.
pub(in crate::scene) fn contacts(
    edges: &[Edge],
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
) -> Vec<(u32, Contact)> {
    let tree = EdgeTree::build(edges);
    let Some((least, greatest)) = tree.bounds() else {
        return Vec::new();
    };
    let (least, greatest) = (least - 2.0 * PROBE_M, greatest + 2.0 * PROBE_M);
    let mut found: Vec<(u32, Contact)> = Vec::new();
    let mut compared = 0;
    for (triangle, &surface) in triangles.iter().zip(&surfaces.triangle_surface) {
        if compared >= MOST_COMPARED {
            break;
        }
        let corners = triangle.map(|v| vertices[v as usize].as_dvec3());
        let [a, b, c] = corners;
        let low = a.min(b).min(c) - PROBE_M;
        let high = a.max(b).max(c) + PROBE_M;
        // Most triangles of a part are far from the few edges that may touch another one.
        if low.cmpgt(greatest).any() || high.cmplt(least).any() {
            continue;
        }
        let normal = surfaces.surfaces[surface as usize].normal;
        let facet = Facet::new(corners, normal, surface);
        tree.walk(|min, max, leaf| {
            let apart = min.cmpgt(high).any() || max.cmplt(low).any();
            if apart || compared >= MOST_COMPARED || !facet.plane_meets(min, max) {
                return false;
            }
            compared += leaf.len();
            for &index in leaf {
                facet.touch(index, &edges[index as usize], &mut found);
            }
            true
        });
    }
    found
}

/// Contacts by edge. Counted; order within an edge is left to `joined`.
fn by_edge(edges: usize, found: Vec<(u32, Contact)>) -> Contacts {
    let mut next = vec![0u32; edges + 1];
    for (edge, _) in &found {
        next[*edge as usize + 1] += 1;
    }
    for edge in 0..edges {
        next[edge + 1] += next[edge];
    }
    let mut list = vec![Contact::default(); found.len()];
    for (edge, contact) in found {
        let slot = &mut next[edge as usize];
        list[*slot as usize] = contact;
        *slot += 1;
    }
    // Each has moved on to the end of its edge's contacts.
    next.truncate(edges);
    Contacts { list, ends: next }
}

impl Facet {
    fn new(corners: [DVec3; 3], normal: DVec3, surface: u32) -> Self {
        let [a, b, c] = corners;
        let turn = (b - a).cross(c - a).dot(normal).signum();
        Self {
            corners,
            inward: [b - a, c - b, a - c].map(|side| normal.cross(side).normalize_or_zero() * turn),
            normal,
            surface,
        }
    }

    /// Whether the plane passes through a box or within [`FLUSH_M`] of it.
    fn plane_meets(&self, min: DVec3, max: DVec3) -> bool {
        let reach_m = (0.5 * (max - min)).dot(self.normal.abs());
        let height_m = self.normal.dot(0.5 * (min + max) - self.corners[0]);
        height_m.abs() <= reach_m + FLUSH_M
    }

    /// Adds the contacts with an edge, one for each direction in which the triangle continues from it.
    fn touch(&self, index: u32, edge: &Edge, contacts: &mut Vec<(u32, Contact)>) {
        let mut near = Section::whole(edge);
        let line = edge.origin - self.corners[0];
        near.clip(edge, self.normal, line, -FLUSH_M);
        near.clip(edge, -self.normal, line, -FLUSH_M);
        if !near.is_contact() {
            return;
        }
        let across = self.normal.cross(edge.direction);
        let Some(across) = across.try_normalize() else {
            return;
        };
        for direction in [across, -across] {
            // The section of the edge from which the triangle continues in this direction.
            let mut section = near;
            let probe = edge.origin + direction * PROBE_M;
            for (&from, &inward) in self.corners.iter().zip(&self.inward) {
                section.clip(edge, inward, probe - from, -FLUSH_M);
            }
            if !section.is_contact() {
                continue;
            }
            let (x, y) = (direction.dot(edge.tangent), direction.dot(edge.normal));
            let angle = y.atan2(x).rem_euclid(2.0 * PI);
            if angle >= SAME_FACE && angle <= edge.n * PI - SAME_FACE {
                let contact = Contact {
                    span_m: section.span_m,
                    angle,
                    surface: self.surface,
                };
                contacts.push((index, contact));
            }
        }
    }
}

/// A section of an edge, from and to in metres along it.
#[derive(Clone, Copy)]
struct Section {
    span_m: [f64; 2],
}

impl Section {
    fn whole(edge: &Edge) -> Self {
        Self {
            span_m: [0.0, edge.length_m],
        }
    }

    /// Leaves the part in which a distance along `normal` is at least `least_m`; `origin` is the edge's beginning from a
    /// point at distance 0.
    fn clip(&mut self, edge: &Edge, normal: DVec3, origin: DVec3, least_m: f64) {
        let (start_m, slope) = (normal.dot(origin), normal.dot(edge.direction));
        if slope.abs() < 1e-12 {
            if start_m < least_m {
                self.span_m[1] = f64::NEG_INFINITY;
            }
            return;
        }
        let at_m = (least_m - start_m) / slope;
        match slope > 0.0 {
            true => self.span_m[0] = self.span_m[0].max(at_m),
            false => self.span_m[1] = self.span_m[1].min(at_m),
        }
    }

    fn is_contact(&self) -> bool {
        self.span_m[1] - self.span_m[0] > LEAST_CONTACT_M
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
        let section =
            section.filter(|([from, to], _)| to - from > LEAST_LENGTH_M * edge.length_scale);
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
