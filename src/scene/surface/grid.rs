//! Tests whether a point lies on a panel of a surface.
//!
//! Each surface is projected along its normal's main axis. Up to [`FEW_TRIANGLES`] triangles are tested in sequence; more
//! have a uniform grid over their bounds, with all grids in the same flat lists. A cell that triangles cover completely
//! needs no test.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};

use super::Surface;
use crate::binary::{are_below, stored};

/// Distance outside a triangle up to which a point counts as inside, in metres: above the rounding of `f32` corners 100 m from
/// the centre, below anything audible. In the plane it is up to √3 times larger.
pub const INSIDE_TOLERANCE_M: f64 = 1e-5;

/// A surface of no more triangles has no grid.
const FEW_TRIANGLES: u32 = 4;

/// Most entries of a grid per triangle; beyond it the grid is coarsened, since long thin triangles cross many cells.
const MOST_ENTRIES_A_TRIANGLE: usize = 24;

/// Cells per triangle: many on small surfaces, where most points then fall into covered or empty cells.
const CELLS_A_TRIANGLE: f64 = 16.0;

/// The same on surfaces of more triangles than [`FINE_CELLS`] / [`CELLS_A_TRIANGLE`], where memory counts.
const LEAST_CELLS_A_TRIANGLE: f64 = 2.0;

/// Number of cells up to which a grid is fine.
const FINE_CELLS: f64 = 4096.0;

/// Height of a triangle below which it covers no cell, in metres: rounding may flip a sliver.
const SLIVER_M: f64 = 1e-4;

/// Bit of a completely covered cell.
const WHOLE: u32 = 1 << 31;

/// State of a cell: no triangle, covered by triangles, or its entries decide.
const EMPTY: u64 = 0;
const WHOLLY: u64 = 1;
const PARTLY: u64 = 2;

/// Number of cell states in one word.
const KINDS_A_WORD: usize = 32;

/// Most cells along an axis.
const MOST_CELLS: f64 = 4096.0;

const NO_GRID: u32 = u32::MAX;

/// Instead of a grid: two triangles that form a rectangle along the axes; their bounds suffice.
const RECTANGLE: u32 = u32::MAX - 1;

/// A triangle in two dimensions, counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FlatTriangle {
    corners: [[f32; 2]; 3],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Grid {
    origin: DVec2,
    cells_a_metre: DVec2,
    columns: u32,
    rows: u32,
    first_cell: u32,
}

/// The grids of all surfaces.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Grids {
    /// One per slot of [`super::SurfaceSet::triangles`].
    flat: Vec<FlatTriangle>,
    /// One per surface, or [`NO_GRID`] or [`RECTANGLE`].
    grid_of: Vec<u32>,
    grids: Vec<Grid>,
    /// Start of each cell's entries, and [`WHOLE`]; the end of each grid's entries is last.
    cells: Vec<u32>,
    /// [`EMPTY`], [`WHOLLY`] or [`PARTLY`] of each cell, two bits each: small enough to stay in the cache.
    kinds: Vec<u64>,
    /// Slots of the triangles that touch a cell.
    entries: Vec<u32>,
}

impl Grids {
    pub(super) fn build(
        surfaces: &[Surface],
        slots: &[u32],
        triangles: &[[u32; 3]],
        vertices: &[Vec3],
    ) -> Self {
        let mut result = Self {
            flat: Vec::with_capacity(slots.len()),
            grid_of: Vec::with_capacity(surfaces.len()),
            ..Self::default()
        };
        for surface in surfaces {
            let axis = main_axis(surface.normal);
            let first = surface.first_triangle;
            let slots_of = first as usize..(first + surface.triangle_count) as usize;
            let panels_end = (first + surface.panel_triangle_count) as usize;
            result.flat.extend(slots[slots_of].iter().map(|&index| {
                let corners = triangles[index as usize].map(|i| vertices[i as usize]);
                FlatTriangle::new(corners.map(|v| flat(v.as_dvec3(), axis)))
            }));
            let grid = if surface.panel_triangle_count > FEW_TRIANGLES {
                let low = flat(surface.bounds_min.as_dvec3(), axis);
                let high = flat(surface.bounds_max.as_dvec3(), axis);
                result.add_grid(first as usize..panels_end, low, high)
            } else if is_rectangle(&result.flat[first as usize..panels_end]) {
                RECTANGLE
            } else {
                NO_GRID
            };
            result.grid_of.push(grid);
        }
        result.kinds = vec![0; result.cells.len().div_ceil(KINDS_A_WORD)];
        for (cell, ends) in result.cells.windows(2).enumerate() {
            let kind = match ends[0] & WHOLE != 0 {
                true => WHOLLY,
                false if ends[0] == ends[1] & !WHOLE => EMPTY,
                false => PARTLY,
            };
            result.kinds[cell / KINDS_A_WORD] |= kind << (2 * (cell % KINDS_A_WORD));
        }
        result
    }

    /// Grid over some of the flat triangles.
    fn add_grid(&mut self, slots: Range<usize>, low: DVec2, high: DVec2) -> u32 {
        let members = &self.flat[slots.clone()];
        let margin = DVec2::splat(2.0 * INSIDE_TOLERANCE_M);
        let origin = low - margin;
        let size = high + margin - origin;
        let triangles = members.len() as f64;
        let count = (CELLS_A_TRIANGLE * triangles)
            .min(FINE_CELLS)
            .max(LEAST_CELLS_A_TRIANGLE * triangles);
        let mut columns = (count * size.x / size.y)
            .sqrt()
            .ceil()
            .clamp(1.0, MOST_CELLS);
        let mut rows = (count / columns).ceil().clamp(1.0, MOST_CELLS);
        let mut counts: Vec<u32>;
        let mut whole: Vec<bool>;
        let mut grid;
        loop {
            grid = Grid {
                origin,
                cells_a_metre: DVec2::new(columns, rows) / size,
                columns: columns as u32,
                rows: rows as u32,
                first_cell: self.cells.len() as u32,
            };
            counts = vec![0; (grid.columns * grid.rows) as usize];
            whole = vec![false; counts.len()];
            let mut total = 0usize;
            for triangle in members {
                // Counting stops once the grid is too fine.
                if counts.len() > 1 && total > MOST_ENTRIES_A_TRIANGLE * members.len() {
                    break;
                }
                grid.cover(triangle, |cell| {
                    counts[cell as usize] += 1;
                    total += 1;
                    let whole = &mut whole[cell as usize];
                    *whole = *whole || grid.corners(cell).iter().all(|&p| triangle.spans(p));
                });
            }
            if counts.len() == 1 || total <= MOST_ENTRIES_A_TRIANGLE * members.len() {
                break;
            }
            columns = (columns / 2.0).ceil();
            rows = (rows / 2.0).ceil();
        }
        grid.cover_together(members, &mut whole);
        let mut next = self.entries.len() as u32;
        for (count, &whole) in counts.iter_mut().zip(&whole) {
            let begin = next;
            if whole {
                self.cells.push(begin | WHOLE);
            } else {
                self.cells.push(begin);
                next += *count;
            }
            *count = begin;
        }
        self.cells.push(next);
        self.entries.resize(next as usize, 0);
        for (slot, triangle) in (slots.start as u32..).zip(members) {
            let entries = &mut self.entries;
            grid.cover(triangle, |cell| {
                if !whole[cell as usize] {
                    let next = &mut counts[cell as usize];
                    entries[*next as usize] = slot;
                    *next += 1;
                }
            });
        }
        self.grids.push(grid);
        self.grids.len() as u32 - 1
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.flat.as_slice())
            + size_of_val(self.grid_of.as_slice())
            + size_of_val(self.grids.as_slice())
            + size_of_val(self.cells.as_slice())
            + size_of_val(self.kinds.as_slice())
            + size_of_val(self.entries.as_slice())
    }

    /// Whether the triangle of a slot holds a point, as [`Self::contains`] tests it.
    pub(super) fn triangle_holds(&self, slot: u32, normal: DVec3, point: DVec3) -> bool {
        self.flat[slot as usize].holds(flat(point, main_axis(normal)))
    }

    #[inline]
    pub(super) fn contains(&self, index: u32, surface: &Surface, point: DVec3) -> bool {
        let position = flat(point, main_axis(surface.normal));
        let grid = self.grid_of[index as usize];
        let first = surface.first_triangle as usize;
        if grid == RECTANGLE {
            return self.flat[first].bounds_hold(position);
        }
        if grid == NO_GRID {
            let members = &self.flat[first..first + surface.panel_triangle_count as usize];
            return members.iter().any(|triangle| triangle.holds(position));
        }
        let grid = &self.grids[grid as usize];
        let Some(cell) = grid.cell(position) else {
            return false;
        };
        let cell = (grid.first_cell + cell) as usize;
        let kind = self.kinds[cell / KINDS_A_WORD] >> (2 * (cell % KINDS_A_WORD)) & 3;
        if kind != PARTLY {
            return kind == WHOLLY;
        }
        let end = self.cells[cell + 1] & !WHOLE;
        self.entries[self.cells[cell] as usize..end as usize]
            .iter()
            .any(|&slot| self.flat[slot as usize].holds(position))
    }
}

/// Whether two triangles are the halves of their bounds on both sides of a diagonal.
fn is_rectangle(members: &[FlatTriangle]) -> bool {
    let [one, other] = members else {
        return false;
    };
    let (low, high) = one.bounds();
    let at_corner = |p: DVec2| (p.x == low.x || p.x == high.x) && (p.y == low.y || p.y == high.y);
    let is_half = |triangle: &FlatTriangle| {
        let corners = [0, 1, 2].map(|i| triangle.corner(i));
        let [a, b, c] = corners;
        corners.into_iter().all(at_corner) && a != b && b != c && c != a
    };
    let opposite = |p: DVec2| {
        let other = |value: f64, low: f64, high: f64| if value == low { high } else { low };
        DVec2::new(other(p.x, low.x, high.x), other(p.y, low.y, high.y))
    };
    // Their right angles are at opposite corners of the rectangle.
    let square_corner = |triangle: &FlatTriangle| {
        let corners = [0, 1, 2].map(|i| triangle.corner(i));
        corners
            .into_iter()
            .find(|&p| !corners.contains(&opposite(p)))
    };
    is_half(one)
        && is_half(other)
        && low.x < high.x
        && low.y < high.y
        && square_corner(one).map(opposite) == square_corner(other)
}

impl FlatTriangle {
    fn new([a, b, c]: [DVec2; 3]) -> Self {
        let turned = (b - a).perp_dot(c - a) < 0.0;
        let corners = if turned { [a, c, b] } else { [a, b, c] };
        Self {
            corners: corners.map(|corner| corner.as_vec2().to_array()),
        }
    }

    fn corner(&self, i: usize) -> DVec2 {
        let [x, y] = self.corners[i];
        DVec2::new(f64::from(x), f64::from(y))
    }

    fn bounds(&self) -> (DVec2, DVec2) {
        let [a, b, c] = [self.corner(0), self.corner(1), self.corner(2)];
        (a.min(b).min(c), a.max(b).max(c))
    }

    /// Start and end of each edge, as bits that are equal for equal positions.
    fn edges(&self) -> [[u32; 4]; 3] {
        // −0 and 0 are equal.
        let [a, b, c] = self
            .corners
            .map(|corner| corner.map(|x| (x + 0.0).to_bits()));
        [[a, b], [b, c], [c, a]].map(|[from, to]| [from[0], from[1], to[0], to[1]])
    }

    /// Whether it is lower than [`SLIVER_M`], or may be.
    fn is_sliver(&self) -> bool {
        let [a, b, c] = [self.corner(0), self.corner(1), self.corner(2)];
        let longest_m = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let twice_m2 = (b - a).perp_dot(c - a);
        twice_m2 <= SLIVER_M * longest_m
    }

    /// Whether a point is inside the bounds or within the tolerance of them.
    #[inline]
    fn bounds_hold(&self, point: DVec2) -> bool {
        let (low, high) = self.bounds();
        let margin = DVec2::splat(INSIDE_TOLERANCE_M);
        let (low, high) = (low - margin, high + margin);
        (point.x >= low.x) & (point.y >= low.y) & (point.x <= high.x) & (point.y <= high.y)
    }

    /// Whether a point is inside, without tolerance.
    fn spans(&self, point: DVec2) -> bool {
        (0..3).all(|i| {
            let a = self.corner(i);
            (self.corner((i + 1) % 3) - a).perp_dot(point - a) >= 0.0
        })
    }

    /// Whether a point is inside or within the tolerance of each edge's line. The bounds cut off the far tips that the
    /// tolerance adds to slivers. Branch-free: the failing test differs from point to point.
    #[inline]
    fn holds(&self, point: DVec2) -> bool {
        let [a, b, c] = [self.corner(0), self.corner(1), self.corner(2)];
        let margin = DVec2::splat(INSIDE_TOLERANCE_M);
        let low = a.min(b).min(c) - margin;
        let high = a.max(b).max(c) + margin;
        let near =
            (point.x >= low.x) & (point.y >= low.y) & (point.x <= high.x) & (point.y <= high.y);
        let left_of = |from: DVec2, to: DVec2| {
            let edge = to - from;
            // Distance from the edge's line times its length, compared in squares to save the root.
            let area = edge.perp_dot(point - from);
            let most = INSIDE_TOLERANCE_M * INSIDE_TOLERANCE_M * edge.length_squared();
            (area >= 0.0) | (area * area <= most)
        };
        near & left_of(a, b) & left_of(b, c) & left_of(c, a)
    }
}

impl Grid {
    #[inline]
    fn cell(&self, position: DVec2) -> Option<u32> {
        let at = (position - self.origin) * self.cells_a_metre;
        let inside = at.x >= 0.0
            && at.y >= 0.0
            && at.x < f64::from(self.columns)
            && at.y < f64::from(self.rows);
        inside.then(|| at.y as u32 * self.columns + at.x as u32)
    }

    fn corners(&self, cell: u32) -> [DVec2; 4] {
        let low = DVec2::new(
            f64::from(cell % self.columns),
            f64::from(cell / self.columns),
        );
        [low, low + DVec2::X, low + DVec2::Y, low + DVec2::ONE]
            .map(|position| self.origin + position / self.cells_a_metre)
    }

    fn column(&self, x: f64) -> u32 {
        let at = (x - self.origin.x) * self.cells_a_metre.x;
        (at.max(0.0) as u32).min(self.columns - 1)
    }

    fn row(&self, y: f64) -> u32 {
        let at = (y - self.origin.y) * self.cells_a_metre.y;
        (at.max(0.0) as u32).min(self.rows - 1)
    }

    /// Marks cells that several triangles cover together. Where two triangles share every edge in a cell, the cell is covered
    /// or empty; its middle decides.
    fn cover_together(&self, members: &[FlatTriangle], whole: &mut [bool]) {
        // One number is compared faster than four.
        let packed = |edge: &[u32; 4]| edge.iter().fold(0, |sum, &n| sum << 32 | u128::from(n));
        let all = members.iter().flat_map(FlatTriangle::edges);
        let mut edges: Vec<u128> = all.map(|edge| packed(&edge)).collect();
        edges.sort_unstable();
        let count = |edge: &[u32; 4]| {
            let edge = packed(edge);
            let from = edges.partition_point(|other| *other < edge);
            let same = edges[from..].iter();
            same.take_while(|other| **other == edge).count()
        };
        let mut ends = vec![false; whole.len()];
        for triangle in members {
            let is_sliver = triangle.is_sliver();
            for (side, edge) in triangle.edges().iter().enumerate() {
                let [ax, ay, bx, by] = *edge;
                if is_sliver || count(edge) != 1 || count(&[bx, by, ax, ay]) != 1 {
                    let corners = [side, (side + 1) % 3, side].map(|i| triangle.corners[i]);
                    self.cover(&FlatTriangle { corners }, |cell| ends[cell as usize] = true);
                }
            }
        }
        for triangle in members {
            self.cover(triangle, |cell| {
                let [low, .., high] = self.corners(cell);
                let cell = cell as usize;
                whole[cell] |= !ends[cell] && triangle.spans(0.5 * (low + high));
            });
        }
    }

    /// Visits the cells that a triangle, grown by twice the tolerance, touches: row by row, from the leftmost to the
    /// rightmost point of its part in the row.
    fn cover(&self, triangle: &FlatTriangle, mut visit: impl FnMut(u32)) {
        let margin = 2.0 * INSIDE_TOLERANCE_M;
        let (low, high) = triangle.bounds();
        for row in self.row(low.y - margin)..=self.row(high.y + margin) {
            let bottom = self.origin.y + f64::from(row) / self.cells_a_metre.y - margin;
            let top = self.origin.y + f64::from(row + 1) / self.cells_a_metre.y + margin;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut reach = |x: f64| {
                left = left.min(x);
                right = right.max(x);
            };
            for i in 0..3 {
                let (a, b) = (triangle.corner(i), triangle.corner((i + 1) % 3));
                if a.y >= bottom && a.y <= top {
                    reach(a.x);
                }
                for line in [bottom, top] {
                    if (a.y < line) != (b.y < line) {
                        reach(a.x + (b.x - a.x) * (line - a.y) / (b.y - a.y));
                    }
                }
            }
            if left <= right {
                for column in self.column(left - margin)..=self.column(right + margin) {
                    visit(row * self.columns + column);
                }
            }
        }
    }
}

/// Index of the largest component. Branch-free like [`flat`], since it varies from surface to surface.
#[inline]
fn main_axis(normal: DVec3) -> usize {
    let n = normal.abs();
    let is_x = (n.x >= n.y) & (n.x >= n.z);
    let other = 2 - usize::from(n.y >= n.z);
    if is_x { 0 } else { other }
}

/// A point projected along an axis.
#[inline]
fn flat(point: DVec3, axis: usize) -> DVec2 {
    let [x, y, z] = point.to_array();
    // The two axes after it, cyclically.
    let turn = [x, y, z, x, y];
    DVec2::new(turn[axis + 1], turn[axis + 2])
}

stored!(FlatTriangle {
    corners: [[f32; 2]; 3]
});

stored!(Grid {
    origin: DVec2,
    cells_a_metre: DVec2,
    columns: u32,
    rows: u32,
    first_cell: u32,
});

stored!(Grids {
    flat: Vec<FlatTriangle>,
    grid_of: Vec<u32>,
    grids: Vec<Grid>,
    cells: Vec<u32>,
    kinds: Vec<u64>,
    entries: Vec<u32>,
});

impl Grids {
    /// Whether grids that were loaded have all that [`Self::contains`] relies on.
    pub(super) fn is_consistent(&self, surfaces: &[Surface], triangles: usize) -> bool {
        let starts = |cell: &u32| cell & !WHOLE;
        let count = self.grids.len();
        let has_cells = |grid: &Grid| {
            let cells = u64::from(grid.columns) * u64::from(grid.rows);
            u64::from(grid.first_cell) + cells < self.cells.len() as u64
        };
        let is_placed = |(&grid, surface): (&u32, &Surface)| match grid {
            NO_GRID => true,
            RECTANGLE => surface.triangle_count > 0,
            grid => (grid as usize) < count,
        };
        self.flat.len() == triangles
            && self.grid_of.len() == surfaces.len()
            && self.grid_of.iter().zip(surfaces).all(is_placed)
            && self.grids.iter().all(has_cells)
            && self.cells.iter().map(starts).is_sorted()
            && self.cells.last().map_or(0, starts) as usize == self.entries.len()
            && self.kinds.len() == self.cells.len().div_ceil(KINDS_A_WORD)
            && are_below(&self.entries, triangles)
    }
}
