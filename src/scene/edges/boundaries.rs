//! Free boundaries of each surface, and the distance of a point from them.
//!
//! A boundary is free on the side on which nothing continues the surface. At a concave edge the other surface continues
//! a reflected wave, and so does a wall that touches or passes through without common vertices.

use glam::DVec3;

use super::super::surface::finite_panel::is_free;
use super::super::surface::{Surface, SurfaceSet};
use crate::binary::{are_starts, stored};
use crate::geometry::Bvh;
use crate::scene::edges::edge::Edge;
use crate::scene::edges::search_budget;

/// Length in metres of the pieces of an edge that are tested for continuations, and the greatest number of pieces of an edge.
const PIECE_M: f64 = 0.5;
const MOST_PIECES: usize = 32;

/// Rays of a piece: two on each side of each face.
const RAYS_A_PIECE: f64 = 8.0;

/// A free boundary, stored by surface.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct FreeBoundary {
    pub(in crate::scene) surface: u32,
    pub(in crate::scene) origin: DVec3,
    pub(in crate::scene) direction: DVec3,
    pub(in crate::scene) length_m: f64,
    /// Whether it is free on the side of the surface's normal and on the other.
    pub(in crate::scene) free: [bool; 2],
}

impl FreeBoundary {
    /// Adds its pieces that are still free by `is_free`, which is asked with a point and a side.
    pub(in crate::scene) fn add_rest(
        &self,
        rest: &mut Vec<Self>,
        mut is_free: impl FnMut(DVec3, usize) -> bool,
    ) {
        let pieces = (self.length_m / PIECE_M)
            .ceil()
            .clamp(1.0, MOST_PIECES as f64);
        let piece_m = self.length_m / pieces;
        let mut open: Option<Self> = None;
        for piece in 0..pieces as u32 {
            let start_m = piece_m * f64::from(piece);
            let middle = self.origin + self.direction * (start_m + 0.5 * piece_m);
            let free = [0, 1].map(|side| self.free[side] && is_free(middle, side));
            match &mut open {
                Some(open) if open.free == free => open.length_m += piece_m,
                _ => {
                    rest.extend(open.filter(|piece| piece.free != [false; 2]));
                    open = Some(Self {
                        origin: self.origin + self.direction * start_m,
                        length_m: piece_m,
                        free,
                        ..*self
                    });
                }
            }
        }
        rest.extend(open.filter(|piece| piece.free != [false; 2]));
    }
}

/// Distance in metres of a point from the nearest of these boundaries that is free on a side, if that is below `within_m`.
pub(in crate::scene) fn nearest_m(
    boundaries: &[FreeBoundary],
    point: DVec3,
    in_front: bool,
    within_m: f64,
) -> Option<f64> {
    let mut nearest = within_m * within_m;
    let side = usize::from(!in_front);
    for boundary in boundaries.iter().filter(|b| b.free[side]) {
        let out = point - boundary.origin;
        let along = out.dot(boundary.direction);
        let beyond = along - along.clamp(0.0, boundary.length_m);
        let across = out.length_squared() - along * along;
        nearest = nearest.min(across.max(0.0) + beyond * beyond);
    }
    (nearest < within_m * within_m).then(|| nearest.sqrt())
}

/// The free boundaries of every surface of a mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct SurfaceBoundaries {
    boundaries: Vec<FreeBoundary>,
    /// Start of each surface's boundaries, and the end of the list.
    first: Vec<u32>,
}

impl SurfaceBoundaries {
    pub(crate) fn build(edges: &[Edge], set: &SurfaceSet, bvh: &Bvh) -> Self {
        let mut boundaries = Vec::new();
        let most_pieces = most_pieces(edges.len(), bvh);
        for edge in edges {
            add_of_edge(&mut boundaries, edge, set, bvh, most_pieces);
        }
        boundaries.sort_by_key(|boundary| boundary.surface);
        let surfaces = set.surfaces.len();
        let mut first = vec![0u32; surfaces + 1];
        for boundary in &boundaries {
            first[boundary.surface as usize + 1] += 1;
        }
        for surface in 0..surfaces {
            first[surface + 1] += first[surface];
        }
        Self { boundaries, first }
    }

    pub(super) fn all(&self) -> &[FreeBoundary] {
        &self.boundaries
    }

    pub(super) fn of(&self, surface: u32) -> &[FreeBoundary] {
        let bound = |index: u32| self.first.get(index as usize).map(|&first| first as usize);
        match (bound(surface), bound(surface.saturating_add(1))) {
            (Some(first), Some(end)) => &self.boundaries[first..end],
            _ => &[],
        }
    }

    /// Distance in metres from a point of a surface to its nearest boundary that is free on the normal's side (`in_front`)
    /// or on the other, if that is below `within_m`.
    pub(crate) fn distance_m(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
        within_m: f64,
    ) -> Option<f64> {
        nearest_m(self.of(surface), point, in_front, within_m)
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.boundaries.as_slice()) + size_of_val(self.first.as_slice())
    }
}

/// Most pieces of each of so many edges that are tested.
pub(super) fn most_pieces(edges: usize, bvh: &Bvh) -> usize {
    search_budget::pieces(edges, RAYS_A_PIECE, bvh.crossed_boxes())
}

/// Adds the free boundaries of an edge's faces.
pub(super) fn add_of_edge(
    boundaries: &mut Vec<FreeBoundary>,
    edge: &Edge,
    set: &SurfaceSet,
    bvh: &Bvh,
    most_pieces: usize,
) {
    for (surface, inward, may_be_free) in faces(edge, &set.surfaces) {
        let normal = set.surfaces[surface as usize].normal;
        let is_free = |at: DVec3, side: usize| {
            let up = [normal, -normal][side];
            // Where a single ray is too much work, nothing counts as continued.
            let is_untested = most_pieces == 0;
            may_be_free[side]
                && (is_untested || is_free(bvh, at.as_vec3(), -inward.as_vec3(), up.as_vec3()))
        };
        let most = most_pieces.clamp(1, MOST_PIECES);
        add_pieces(boundaries, surface, edge, most, is_free);
    }
}

/// The surfaces that end at an edge, each with the direction from the edge into it, and whether the edge's air is on its
/// normal's side and on the other.
fn faces(edge: &Edge, surfaces: &[Surface]) -> impl Iterator<Item = (u32, DVec3, [bool; 2])> {
    let is_rim = edge.faces[0] == edge.faces[1];
    let face = move |index: usize| {
        let surface = edge.faces[index];
        let in_front = surfaces[surface as usize]
            .normal
            .dot(edge.face_normal(index))
            > 0.0;
        let may_be_free = [is_rim || in_front, is_rim || !in_front];
        (surface, edge.face_tangent(index), may_be_free)
    };
    (0..if is_rim { 1 } else { 2 }).map(face)
}

/// Adds the free pieces of an edge of a surface; pieces that are free on the same sides are joined.
fn add_pieces(
    boundaries: &mut Vec<FreeBoundary>,
    surface: u32,
    edge: &Edge,
    most_pieces: usize,
    is_free: impl Fn(DVec3, usize) -> bool,
) {
    let pieces = (edge.length_m / PIECE_M)
        .ceil()
        .clamp(1.0, most_pieces as f64);
    let piece_m = edge.length_m / pieces;
    let from = boundaries.len();
    for piece in 0..pieces as u32 {
        let start_m = piece_m * f64::from(piece);
        let middle = edge.at(start_m + 0.5 * piece_m);
        let free = [0, 1].map(|side| is_free(middle, side));
        let origin = edge.at(start_m);
        match boundaries[from..].last_mut() {
            Some(last) if last.free == free => last.length_m += piece_m,
            _ => boundaries.push(FreeBoundary {
                surface,
                origin,
                direction: edge.direction,
                length_m: piece_m,
                free,
            }),
        }
    }
    let mut kept = from;
    for index in from..boundaries.len() {
        if boundaries[index].free != [false; 2] {
            boundaries.swap(kept, index);
            kept += 1;
        }
    }
    boundaries.truncate(kept);
}

stored!(FreeBoundary {
    surface: u32,
    origin: DVec3,
    direction: DVec3,
    length_m: f64,
    free: [bool; 2],
});

stored!(SurfaceBoundaries { boundaries: Vec<FreeBoundary>, first: Vec<u32> });

impl SurfaceBoundaries {
    /// Whether boundaries that were loaded belong to a set of `surfaces`.
    pub(super) fn is_consistent(&self, surfaces: usize) -> bool {
        let is_good = |b: &FreeBoundary| (b.surface as usize) < surfaces && b.length_m >= 0.0;
        are_starts(&self.first, surfaces, self.boundaries.len())
            && self.boundaries.iter().all(is_good)
    }
}
