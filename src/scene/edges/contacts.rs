//! The search for contacts: sections of edges that lie in other faces.
//!
//! Contacts with the same half-plane are joined, and sections without remaining air are dropped, while the search runs: of
//! thousands of overlapping triangles a few contacts an edge are left. Own.

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

/// Cosine between an edge and a face's normal from which the edge is within [`FLUSH_M`] of the plane over less than
/// [`LEAST_CONTACT_M`]: one half, and a margin for rounding.
const STEEP: f64 = 2.0 * FLUSH_M / LEAST_CONTACT_M + 1e-6;

/// Contacts at this angle from a face of the wedge continue that face, in radians: one degree.
const SAME_FACE: f64 = PI / 180.0;

/// Most comparisons of a triangle with an edge: bounds the time where thousands of triangles overlap.
const MOST_COMPARED: usize = 1 << 22;

/// Contacts after which those of one half-plane are joined, and most of them before they are joined: 10 MB. More than half as many
/// joined ones end the search, which happens only where thousands of triangles pass through each other.
const FEW_CONTACTS: usize = 1 << 14;
const MOST_CONTACTS: usize = 1 << 18;

/// A section of an edge along which a half-plane of another face begins.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::scene) struct Contact {
    /// From and to in metres along the edge.
    pub(in crate::scene) span_m: [f64; 2],
    /// Angle of the half-plane around the edge.
    pub(in crate::scene) angle: f64,
    /// Surface of the half-plane.
    pub(in crate::scene) surface: u32,
}

impl Contact {
    /// Whether it leaves no exterior wedge of an edge.
    fn closes(&self, edge: &Edge) -> bool {
        self.angle.max(edge.n * PI - self.angle) < least_gap()
    }
}

/// Smallest angle of an exterior wedge.
pub(super) fn least_gap() -> f64 {
    PI + LEAST_TURN_DEG.to_radians()
}

/// A triangle in the plane of its surface.
struct Facet {
    corners: [DVec3; 3],
    /// Unit vectors in the plane across each side, from the corner of the same index, into the triangle.
    inward: [DVec3; 3],
    normal: DVec3,
    surface: u32,
}

/// All contacts that narrow an edge's exterior wedge, each with the index of its edge, in the order of [`rank`]. Where
/// one leaves no wedge, there may be fewer. `candidates` returns the triangles in a box, and may return more.
pub(in crate::scene) fn contacts<I: Iterator<Item = u32>>(
    edges: &[Edge],
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
    candidates: impl FnOnce(DVec3, DVec3) -> I,
) -> Vec<(u32, Contact)> {
    let mut search = Search::new(edges);
    let Some((least, greatest)) = search.tree.bounds() else {
        return Vec::new();
    };
    let (least, greatest) = (least - 2.0 * PROBE_M, greatest + 2.0 * PROBE_M);
    let corners = |number: u32| {
        let triangle = triangles[number as usize];
        triangle.map(|v| vertices[v as usize].as_dvec3())
    };
    let bounds = |[a, b, c]: [DVec3; 3]| {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        (low - PROBE_M, high + PROBE_M)
    };
    // Most triangles of a part are far from the few edges that may touch another one.
    let is_near = |number: u32| {
        let [a, b, c] = triangles[number as usize].map(|v| vertices[v as usize]);
        let (low, high) = (a.min(b).min(c).as_dvec3(), a.max(b).max(c).as_dvec3());
        (low - PROBE_M).cmple(greatest).all() && (high + PROBE_M).cmpge(least).all()
    };
    let rank = |number: u32| {
        let [a, b, c] = corners(number);
        // Bits of positive numbers sort as the numbers do; inverted, the largest comes first.
        (!((b - a).cross(c - a).length() as f32).to_bits(), number)
    };
    let near = candidates(least, greatest).filter(|&number| is_near(number));
    let mut order: Vec<(u32, u32)> = near.map(rank).collect();
    order.sort_unstable();
    for (_, number) in order {
        let corners = corners(number);
        let (low, high) = bounds(corners);
        let surface = surfaces.triangle_surface[number as usize];
        let normal = surfaces.surfaces[surface as usize].normal;
        search.compare(&Facet::new(corners, normal, surface), low, high);
        if search.is_exhausted() {
            break;
        }
    }
    search.join();
    search.found
}

/// Contacts of edges, by triangles one after the other. Facets are compared with open sections of edges: where one contact
/// leaves no air, another one changes nothing. The largest facets come first, since they close most.
struct Search<'a> {
    edges: &'a [Edge],
    /// The edge of each section in the tree.
    sections: Vec<u32>,
    tree: EdgeTree,
    /// Length of all sections in the tree, in metres.
    in_tree_m: f64,
    found: Vec<(u32, Contact)>,
    /// Number of contacts at which they are joined.
    join_at: usize,
    compared: usize,
}

impl<'a> Search<'a> {
    fn new(edges: &'a [Edge]) -> Self {
        let whole = (0..).zip(edges).map(|(index, edge)| OpenSection {
            edge: index,
            span_m: [0.0, edge.length_m],
        });
        let mut search = Self {
            edges,
            sections: Vec::new(),
            tree: EdgeTree::default(),
            in_tree_m: 0.0,
            found: Vec::new(),
            join_at: FEW_CONTACTS,
            compared: 0,
        };
        search.plant(&whole.collect::<Vec<_>>());
        search
    }

    /// Builds the tree over these sections.
    fn plant(&mut self, open: &[OpenSection]) {
        let ends = |section: &OpenSection| {
            let edge = &self.edges[section.edge as usize];
            section.span_m.map(|at_m| edge.at(at_m))
        };
        self.tree = EdgeTree::of_ends(&open.iter().map(ends).collect::<Vec<_>>());
        self.sections.clear();
        self.sections
            .extend(open.iter().map(|section| section.edge));
        self.in_tree_m = open.iter().map(OpenSection::length_m).sum();
    }

    fn is_exhausted(&self) -> bool {
        self.compared >= MOST_COMPARED || self.join_at > MOST_CONTACTS
    }

    /// Compares a facet with the sections in its box.
    fn compare(&mut self, facet: &Facet, low: DVec3, high: DVec3) {
        let Self {
            edges,
            sections,
            found,
            compared,
            ..
        } = self;
        self.tree.walk(|min, max, leaf| {
            let apart = min.cmpgt(high).any() || max.cmplt(low).any();
            if apart || *compared >= MOST_COMPARED || !facet.plane_meets(min, max) {
                return false;
            }
            *compared += leaf.len();
            for &section in leaf {
                let index = sections[section as usize];
                let touched = facet.touch(&edges[index as usize]).into_iter().flatten();
                found.extend(touched.map(|contact| (index, contact)));
            }
            true
        });
        if self.found.len() >= self.join_at {
            self.join();
            self.drop_closed();
            self.join_at = FEW_CONTACTS.max(2 * self.found.len());
        }
    }

    /// Builds the tree without closed sections, if they are a quarter of its length.
    fn drop_closed(&mut self) {
        let mut by_edge = self.found.chunk_by(|a, b| a.0 == b.0).peekable();
        let mut open = Vec::new();
        for (index, edge) in (0..).zip(self.edges) {
            let own = by_edge.next_if(|own| own[0].0 == index).unwrap_or(&[]);
            OpenSection::add(index, edge, own, &mut open);
        }
        let open_m: f64 = open.iter().map(OpenSection::length_m).sum();
        if open_m < 0.75 * self.in_tree_m {
            self.plant(&open);
        }
    }

    /// Joins contacts of one edge with the same half-plane.
    fn join(&mut self) {
        self.found.sort_by(rank);
        self.found
            .dedup_by(|next, last| join(&mut last.1, &next.1, last.0 == next.0));
    }
}

/// A section of an edge in which no contact leaves no air.
struct OpenSection {
    edge: u32,
    /// From and to in metres along the edge.
    span_m: [f64; 2],
}

impl OpenSection {
    fn length_m(&self) -> f64 {
        self.span_m[1] - self.span_m[0]
    }

    /// Adds the open sections of an edge that are long enough to diffract.
    fn add(index: u32, edge: &Edge, contacts: &[(u32, Contact)], open: &mut Vec<Self>) {
        let closing = contacts.iter().filter(|(_, contact)| contact.closes(edge));
        let mut spans: Vec<[f64; 2]> = closing.map(|(_, contact)| contact.span_m).collect();
        spans.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        spans.push([edge.length_m; 2]);
        let mut from_m = 0.0;
        for [closed_m, end_m] in spans {
            let section = Self {
                edge: index,
                span_m: [from_m, closed_m],
            };
            if section.length_m() > LEAST_LENGTH_M * edge.length_scale {
                open.push(section);
            }
            from_m = end_m.max(from_m);
        }
    }
}

/// Order of contacts: by edge, surface, angle and beginning.
fn rank(a: &(u32, Contact), b: &(u32, Contact)) -> std::cmp::Ordering {
    a.0.cmp(&b.0).then_with(|| by_half_plane(&a.1, &b.1))
}

/// Order of one edge's contacts: by surface, angle and beginning.
pub(super) fn by_half_plane(a: &Contact, b: &Contact) -> std::cmp::Ordering {
    let angles = a.angle.total_cmp(&b.angle);
    let spans = a.span_m[0].total_cmp(&b.span_m[0]);
    a.surface.cmp(&b.surface).then(angles).then(spans)
}

/// Extends a contact by the next one in order, if both are of one edge and half-plane and overlap.
pub(super) fn join(last: &mut Contact, next: &Contact, of_one_edge: bool) -> bool {
    let overlaps = of_one_edge
        && (last.surface, last.angle) == (next.surface, next.angle)
        && next.span_m[0] <= last.span_m[1];
    if overlaps {
        last.span_m[1] = last.span_m[1].max(next.span_m[1]);
    }
    overlaps
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

    /// The contacts with an edge, one for each direction in which the triangle continues from it.
    fn touch(&self, edge: &Edge) -> [Option<Contact>; 2] {
        let slope = self.normal.dot(edge.direction);
        if slope.abs() > STEEP {
            return [None; 2];
        }
        let mut near = Section::whole(edge);
        let line = edge.origin - self.corners[0];
        near.clip(edge, self.normal, line, -FLUSH_M);
        near.clip(edge, -self.normal, line, -FLUSH_M);
        if !near.is_contact() {
            return [None; 2];
        }
        let across = self.normal.cross(edge.direction);
        let Some(across) = across.try_normalize() else {
            return [None; 2];
        };
        // Beyond an acute corner a point may be near to both sides and far from the triangle.
        let corners = self.corners.map(|corner| corner - edge.origin);
        let along = corners.map(|corner| corner.dot(edge.direction));
        near.span_m = [
            near.span_m[0].max(least(along) - FLUSH_M),
            near.span_m[1].min(-least(along.map(|m| -m)) + FLUSH_M),
        ];
        [across, -across].map(|direction| {
            // The section of the edge from which the triangle continues in this direction.
            let reach_m = -least(corners.map(|corner| -corner.dot(direction)));
            if reach_m < PROBE_M - FLUSH_M {
                return None;
            }
            let mut section = near;
            let probe = edge.origin + direction * PROBE_M;
            for (&from, &inward) in self.corners.iter().zip(&self.inward) {
                section.clip(edge, inward, probe - from, -FLUSH_M);
            }
            if !section.is_contact() {
                return None;
            }
            let (x, y) = (direction.dot(edge.tangent), direction.dot(edge.normal));
            let angle = y.atan2(x).rem_euclid(2.0 * PI);
            let is_between = angle >= SAME_FACE && angle <= edge.n * PI - SAME_FACE;
            is_between.then_some(Contact {
                span_m: section.span_m,
                angle,
                surface: self.surface,
            })
        })
    }
}

/// The least of three.
fn least([a, b, c]: [f64; 3]) -> f64 {
    a.min(b).min(c)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::edges::NO_EDGE;

    #[test]
    fn an_acute_corner_touches_no_more_of_an_edge_than_a_blunt_one() {
        let edge = Edge {
            origin: DVec3::ZERO,
            direction: DVec3::Y,
            length_m: 0.9,
            tangent: DVec3::Z,
            normal: DVec3::X,
            n: 1.5,
            ..NO_EDGE
        };
        // Both begin at the edge's end and lie on the face's own side of it.
        let of = |tip: DVec3, a: [f64; 2], b: [f64; 2]| {
            let [a, b] = [a, b].map(|[y, z]| tip + DVec3::new(0.0, y, z));
            Facet::new([tip, a, b], DVec3::X, 0).touch(&edge)
        };
        let end = edge.at(edge.length_m);
        assert_eq!(of(end, [0.52, 0.15], [0.9, 0.22]), [None; 2]);
        assert_eq!(of(end, [0.52, 0.15], [0.0, 0.45]), [None; 2]);
        // One that goes on at the other side of the edge touches it.
        let below = edge.at(0.5);
        let found = of(below, [0.3, 0.0], [0.3, -0.4]);
        assert_eq!(found.iter().flatten().count(), 1);
    }
}
