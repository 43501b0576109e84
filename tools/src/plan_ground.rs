//! The scale of a plan and the ground of a scene below it, for [`super::floor_plan`].

use glam::{Vec2, Vec3, vec2};

/// Cells of the ground grid along the longer side, at most, and their least size in metres: wider than a wall, to find
/// the ground beside a wall under it too.
const GROUND_CELLS: f32 = 256.0;
const GROUND_CELL_M: f32 = 1.0;

/// Scale of a plan: world +x to the right, +z downwards, in fine pixels ([`super::chart::px`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanFrame {
    /// World (x, z) at the upper left corner, in metres.
    pub corner_m: Vec2,
    /// Fine pixels of that corner.
    pub corner_px: Vec2,
    /// Width and height of the plan, in fine pixels.
    pub size_px: Vec2,
    /// Fine pixels a metre.
    pub px_per_m: f32,
}

impl PlanFrame {
    /// Fine pixels of a world position.
    pub fn pixel(&self, at: Vec3) -> Vec2 {
        self.corner_px + (vec2(at.x, at.z) - self.corner_m) * self.px_per_m
    }
}

/// Height of the lowest surface around a position, on a coarse grid.
pub(super) struct Ground {
    corner_m: Vec2,
    cell_m: f32,
    columns: usize,
    rows: usize,
    /// Infinite where there is no ground.
    lowest_m: Vec<f32>,
}

impl Ground {
    /// Of all triangles in a frame.
    pub(super) fn below(frame: &PlanFrame, triangles: &[[Vec3; 3]]) -> Self {
        let size_m = frame.size_px / frame.px_per_m;
        let cell_m = (size_m.max_element() / GROUND_CELLS).max(GROUND_CELL_M);
        let cells = |side_m: f32| (side_m / cell_m).ceil().max(1.0) as usize;
        let (columns, rows) = (cells(size_m.x), cells(size_m.y));
        let mut here = vec![f32::INFINITY; columns * rows];
        let to_cells = |c: Vec3| ((vec2(c.x, c.z) - frame.corner_m) / cell_m).extend(c.y);
        for corners in triangles {
            let corners = corners.map(to_cells);
            // Centres of cells cover the large triangles, corners the small ones.
            rasterise(&corners, columns, rows, |cell, height_m| {
                here[cell] = height_m.min(here[cell]);
            });
            for corner in corners.iter().filter(|c| c.is_finite()) {
                let column = (corner.x.max(0.0) as usize).min(columns - 1);
                let row = (corner.y.max(0.0) as usize).min(rows - 1);
                let cell = row * columns + column;
                here[cell] = corner.z.min(here[cell]);
            }
        }
        let around = |cell: usize| {
            let (column, row) = (cell % columns, cell / columns);
            let rows = row.saturating_sub(1)..(row + 2).min(rows);
            rows.flat_map(|r| {
                (column.saturating_sub(1)..(column + 2).min(columns)).map(move |c| r * columns + c)
            })
            .map(|c| here[c])
            .fold(f32::INFINITY, f32::min)
        };
        Self {
            corner_m: frame.corner_m,
            cell_m,
            columns,
            rows,
            lowest_m: (0..columns * rows).map(around).collect(),
        }
    }

    /// Height at a world (x, z) in metres, interpolated between cell centres; none without ground nearby.
    pub(super) fn at(&self, at_m: Vec2) -> Option<f32> {
        let last = vec2((self.columns - 1) as f32, (self.rows - 1) as f32);
        let cell = ((at_m - self.corner_m) / self.cell_m - 0.5).clamp(Vec2::ZERO, last);
        let (low, share) = (cell.floor(), cell.fract());
        let (mut sum, mut weights) = (0.0, 0.0);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let cell = (low + vec2(dx, dy)).min(last);
            let height_m = self.lowest_m[cell.y as usize * self.columns + cell.x as usize];
            let weight = (1.0 - (share.x - dx).abs()) * (1.0 - (share.y - dy).abs());
            if height_m.is_finite() && weight > 0.0 {
                sum += weight * height_m;
                weights += weight;
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }
}

/// Calls `seen` with index and height of every cell whose centre lies under a triangle. Corners are (column, row,
/// height); a triangle seen edge-on covers no cell.
pub(super) fn rasterise(
    corners: &[Vec3; 3],
    columns: usize,
    rows: usize,
    mut seen: impl FnMut(usize, f32),
) {
    let [a, b, c] = *corners;
    let area = (b - a).truncate().perp_dot((c - a).truncate());
    if !area.is_finite() || area.abs() < 1e-9 || !corners.iter().all(|c| c.is_finite()) {
        return;
    }
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let first = |low: f32| (low - 0.5).ceil().max(0.0) as usize;
    let end =
        |high: f32, side: usize| ((high - 0.5).floor() + 1.0).clamp(0.0, side as f32) as usize;
    for row in first(low.y)..end(high.y, rows) {
        for column in first(low.x)..end(high.x, columns) {
            let at = vec2(column as f32 + 0.5, row as f32 + 0.5);
            let share_b = (at - a.truncate()).perp_dot((c - a).truncate()) / area;
            let share_c = (b - a).truncate().perp_dot(at - a.truncate()) / area;
            // The slack closes the seams between neighbours.
            if share_b >= -1e-5 && share_c >= -1e-5 && share_b + share_c <= 1.0 + 1e-5 {
                let height_m = a.z + share_b * (b.z - a.z) + share_c * (c.z - a.z);
                seen(row * columns + column, height_m);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    const FRAME: PlanFrame = PlanFrame {
        corner_m: Vec2::ZERO,
        corner_px: Vec2::ZERO,
        size_px: vec2(200.0, 100.0),
        px_per_m: 10.0,
    };

    #[test]
    fn the_ground_is_the_lowest_surface_also_under_walls() {
        // A floor with a slit, a wall in the slit that begins above the floor, a ceiling.
        let plate = |height_m: f32, low: f32, high: f32| {
            let at = |x: f32, z: f32| vec3(x, height_m, z);
            [
                [at(low, 0.0), at(high, 0.0), at(high, 10.0)],
                [at(low, 0.0), at(high, 10.0), at(low, 10.0)],
            ]
        };
        let triangles = [
            plate(0.5, 0.0, 7.9),
            plate(0.5, 8.1, 20.0),
            plate(2.8, 7.9, 8.1),
            plate(3.0, 0.0, 20.0),
        ];
        let ground = Ground::below(&FRAME, &triangles.concat());
        for x in [0.0, 3.0, 8.0, 8.05, 19.9, 30.0] {
            assert!((ground.at(vec2(x, 5.0)).unwrap() - 0.5).abs() < 1e-5, "{x}");
        }
    }

    #[test]
    fn an_empty_scene_has_no_ground() {
        assert_eq!(Ground::below(&FRAME, &[]).at(vec2(1.0, 1.0)), None);
    }

    #[test]
    fn heights_are_those_of_the_triangle_s_plane() {
        let corners = [
            vec3(0.0, 0.0, 1.0),
            vec3(40.0, 0.0, 5.0),
            vec3(0.0, 40.0, -3.0),
        ];
        let mut count = 0;
        rasterise(&corners, 30, 30, |i, height| {
            let (x, y) = ((i % 30) as f32 + 0.5, (i / 30) as f32 + 0.5);
            assert!((height - (1.0 + 0.1 * x - 0.1 * y)).abs() < 1e-4);
            count += 1;
        });
        // 900 cells less the triangle of 20 by 20 beyond the hypotenuse, whose centres on the line count as covered.
        assert_eq!(count, 900 - (20 * 20 - 20) / 2);
        rasterise(
            &[Vec3::ZERO, vec3(9.0, 0.0, 3.0), vec3(9.0, 0.0, 0.0)],
            30,
            30,
            |_, _| panic!("edge-on"),
        );
    }
}
