//! Edges that lie in other faces: a solid that stands on a floor, a partition that meets a wall.
//!
//! Such a face need not share a vertex with the edge. It takes its part of the air around the edge, along the section in
//! which it lies there: what remains of the exterior wedge may still diffract, or the edge ends there. Overlaps and cracks
//! up to [`super::FLUSH_M`] count as contact. Own.

use std::f64::consts::PI;

use glam::Vec3;

use super::super::surface::SurfaceSet;
use super::contacts::{Contact, by_half_plane, contacts, join, least_gap};
use super::edge::{Edge, LEAST_LENGTH_M};
use super::longest::{MOST_EDGES, longest};

/// Most comparisons of a contact with a section of its edge. Edges of more contacts than are left for stay whole.
const MOST_IN_SECTIONS: usize = 1 << 27;

/// Most pieces of all edges in memory. Only the longest edges are kept in the end.
const MOST_PIECES: usize = MOST_EDGES + MOST_EDGES / 2;

/// The edges, cut where other faces touch them; sections without a remaining exterior wedge are dropped.
pub(super) fn cut(
    edges: Vec<Edge>,
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    surfaces: &SurfaceSet,
) -> Vec<Edge> {
    let all = 0..triangles.len() as u32;
    let found = contacts(&edges, vertices, triangles, surfaces, |_, _| all);
    let mut by_edge = found.chunk_by(|a, b| a.0 == b.0).peekable();
    let mut result = Vec::with_capacity(edges.len());
    let mut left = MOST_IN_SECTIONS;
    let mut own: Vec<Contact> = Vec::new();
    for (index, edge) in (0..).zip(&edges) {
        own.clear();
        if let Some(found) = by_edge.next_if(|found| found[0].0 == index) {
            own.extend(found.iter().map(|(_, contact)| *contact));
        }
        let work = own.len().saturating_mul(2 * own.len() + 1);
        if own.is_empty() || work > left {
            result.push(*edge);
        } else {
            left -= work;
            sections(edge, &own, &mut result);
        }
        if result.len() > MOST_PIECES {
            result = longest(&result, |edge| edge.length_m, |edge| *edge);
        }
    }
    result
}

/// Adds what is left of one edge with these contacts.
pub(in crate::scene) fn pieces(edge: &Edge, contacts: &mut Vec<Contact>, result: &mut Vec<Edge>) {
    contacts.sort_unstable_by(by_half_plane);
    contacts.dedup_by(|next, last| join(last, next, true));
    match contacts.is_empty() {
        true => result.push(*edge),
        false => sections(edge, contacts, result),
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
        .filter(|pair| gap(pair) >= least_gap())?;
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
