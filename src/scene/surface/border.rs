//! Border pieces: connected plane pieces of a mesh that end at its bounds and are too small for a panel.
//!
//! A wall that is cut into chunks leaves such pieces at the cuts, where they have open sides; those of a tile reach from one end
//! of it to the other. Alone they mirror nothing. Together with what they touch in other parts they may be large enough
//! (`committed/instances/joined/pieces`). Control side to build; queries are wait-free.

use glam::Vec3;

use super::SurfaceSet;
use crate::binary::{are_below, stored};
use crate::scene::weld::sorted_edges;

/// Distance in metres from the bounds of a mesh within which a piece reaches them.
const AT_BOUNDS_M: f32 = 5e-3;

/// A connected piece of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct BorderPiece {
    pub(in crate::scene) surface: u32,
    pub(in crate::scene) area_m2: f64,
    /// Its bounds.
    pub(in crate::scene) low: Vec3,
    pub(in crate::scene) high: Vec3,
    /// Its first and its next piece's first entry of [`BorderPieces::slots`], and of [`BorderPieces::outline`].
    slots: [u32; 2],
    outline: [u32; 2],
}

/// All border pieces of a mesh, by surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::scene) struct BorderPieces {
    pieces: Vec<BorderPiece>,
    /// Slots of [`SurfaceSet::triangles`], by piece.
    slots: Vec<u32>,
    /// Sides of triangles that no other triangle of the piece has, by piece.
    outline: Vec<[Vec3; 2]>,
    /// Triangles of pieces with their pieces, sorted.
    of_triangle: Vec<[u32; 2]>,
    /// Least area in m² of a panel.
    least_m2: f64,
}

impl BorderPieces {
    /// Of a mesh whose surfaces and panels are known. `sides` are all sides of its triangles, sorted; `roots` has each triangle's
    /// connected piece.
    pub(super) fn build(
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        set: &SurfaceSet,
        (sides, roots): (&[(u64, u32)], &[u32]),
        least_m2: f64,
    ) -> Self {
        let corners = |t: u32| triangles[t as usize].map(|v| vertices[v as usize]);
        let all = || triangles.iter().flatten().map(|&v| vertices[v as usize]);
        let low = all().fold(Vec3::INFINITY, Vec3::min) + AT_BOUNDS_M;
        let high = all().fold(Vec3::NEG_INFINITY, Vec3::max) - AT_BOUNDS_M;
        // A bit for each plane of the bounds that a corner is at: the lower ones, the upper ones.
        let planes_at =
            |corner: Vec3| corner.cmplt(low).bitmask() | corner.cmpgt(high).bitmask() << 3;
        let is_small = |t: u32| !set.is_panel(t) && set.curved.of_triangle(t).is_none();
        let mut planes = vec![0u8; triangles.len()];
        for t in (0..triangles.len() as u32).filter(|&t| is_small(t)) {
            let of_piece = &mut planes[roots[t as usize] as usize];
            *of_piece |= corners(t).into_iter().map(planes_at).fold(0, |a, b| a | b) as u8;
        }
        let mut reaches: Vec<bool> = planes.iter().map(|own| own & own >> 3 != 0).collect();
        for same in sides.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, side)] = *same
                && is_small(side / 3)
            {
                let corners = corners(side / 3).map(planes_at);
                let of_side = corners[(side % 3) as usize] & corners[((side + 1) % 3) as usize];
                reaches[roots[(side / 3) as usize] as usize] |= of_side != 0;
            }
        }
        // The slots of a surface follow each other.
        let mut members: Vec<(u32, u32, u32)> = (0..)
            .zip(&set.triangles)
            .filter(|&(_, &t)| reaches[roots[t as usize] as usize] && is_small(t))
            .map(|(slot, &t)| (set.triangle_surface[t as usize], roots[t as usize], slot))
            .collect();
        members.sort_unstable();
        let mut result = Self {
            least_m2,
            ..Self::default()
        };
        for same in members.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let own: Vec<u32> = same.iter().map(|m| set.triangles[m.2 as usize]).collect();
            let index = result.pieces.len() as u32;
            let first = [result.slots.len(), result.outline.len()].map(|len| len as u32);
            result.slots.extend(same.iter().map(|member| member.2));
            result.of_triangle.extend(own.iter().map(|&t| [t, index]));
            let indices: Vec<[u32; 3]> = own.iter().map(|&t| triangles[t as usize]).collect();
            for sides in sorted_edges(&indices).chunk_by(|a, b| a.0 == b.0) {
                if let [(_, side)] = *sides {
                    let [a, b, c] = corners(own[(side / 3) as usize]);
                    result
                        .outline
                        .push([[a, b], [b, c], [c, a]][(side % 3) as usize]);
                }
            }
            let points = || own.iter().flat_map(|&t| corners(t));
            let area_m2 = |&t: &u32| {
                let [a, b, c] = corners(t).map(|corner| corner.as_dvec3());
                0.5 * (b - a).cross(c - a).length()
            };
            result.pieces.push(BorderPiece {
                surface: same[0].0,
                area_m2: own.iter().map(area_m2).sum(),
                low: points().fold(Vec3::INFINITY, Vec3::min),
                high: points().fold(Vec3::NEG_INFINITY, Vec3::max),
                slots: [first[0], result.slots.len() as u32],
                outline: [first[1], result.outline.len() as u32],
            });
        }
        result.of_triangle.sort_unstable();
        result
    }

    /// All pieces, by surface.
    pub(in crate::scene) fn as_slice(&self) -> &[BorderPiece] {
        &self.pieces
    }

    /// Least area in m² of a panel.
    pub(in crate::scene) fn least_m2(&self) -> f64 {
        self.least_m2
    }

    /// The piece that a triangle belongs to.
    #[inline]
    pub(in crate::scene) fn of_triangle(&self, triangle: u32) -> Option<u32> {
        let found = self
            .of_triangle
            .binary_search_by_key(&triangle, |entry| entry[0]);
        found.ok().map(|index| self.of_triangle[index][1])
    }

    /// The pieces of a surface.
    pub(in crate::scene) fn of_surface(&self, surface: u32) -> std::ops::Range<u32> {
        let bound = |of: u32| self.pieces.partition_point(|piece| piece.surface < of) as u32;
        bound(surface)..bound(surface.saturating_add(1))
    }

    /// Sides of a piece's triangles at which it ends.
    pub(in crate::scene) fn outline_of(&self, piece: u32) -> &[[Vec3; 2]] {
        let [first, end] = self.pieces[piece as usize].outline;
        &self.outline[first as usize..end as usize]
    }

    /// Slots of a piece's triangles in [`SurfaceSet::triangles`].
    pub(super) fn slots_of(&self, piece: u32) -> &[u32] {
        let [first, end] = self.pieces[piece as usize].slots;
        &self.slots[first as usize..end as usize]
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.pieces.as_slice())
            + size_of_val(self.slots.as_slice())
            + size_of_val(self.outline.as_slice())
            + size_of_val(self.of_triangle.as_slice())
    }

    /// Whether pieces that were loaded belong to so many surfaces and triangles.
    pub(super) fn is_consistent(&self, surfaces: usize, triangles: usize) -> bool {
        let [slots, outline] = [self.slots.len(), self.outline.len()];
        let is_range = |[from, to]: [u32; 2], len: usize| from <= to && (to as usize) <= len;
        let is_good = |piece: &BorderPiece| {
            (piece.surface as usize) < surfaces
                && is_range(piece.slots, slots)
                && is_range(piece.outline, outline)
        };
        let is_known = |entry: &[u32; 2]| (entry[1] as usize) < self.pieces.len();
        self.pieces.iter().all(is_good)
            && are_below(&self.slots, triangles)
            && self.of_triangle.iter().all(is_known)
    }
}

stored!(BorderPiece {
    surface: u32,
    area_m2: f64,
    low: Vec3,
    high: Vec3,
    slots: [u32; 2],
    outline: [u32; 2],
});

stored!(BorderPieces {
    pieces: Vec<BorderPiece>,
    slots: Vec<u32>,
    outline: Vec<[Vec3; 2]>,
    of_triangle: Vec<[u32; 2]>,
    least_m2: f64,
});
