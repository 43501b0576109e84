//! The floor plan of a scene: cut a little above the ears, surfaces below shaded by height, walls outlined where the
//! cut intersects them.
//!
//! The cut follows the ground, which keeps hills whole. Where all surfaces are above the cut, as on a knoll, the lowest
//! is shown. The cost is one pass over all triangles.

use glam::{Vec2, Vec3, vec2};
use plotters::prelude::*;

use super::chart::{Area, Drawn, INK, mixed, px};
use super::plan_ground::{Ground, PlanFrame, rasterise};

/// Height range shown, at least, in metres: a floor's unevenness stays pale.
const LEAST_RANGE_M: f32 = 2.5;
/// A step between neighbouring fine pixels from which an edge is drawn, in metres.
const EDGE_STEP_M: f32 = 0.12;
/// Surfaces steeper than this (cosine between normal and up) are outlined where the cut intersects them.
const WALL_COSINE: f32 = 0.5;
/// Width of that outline in pixels.
const WALL_PX: f32 = 1.8;
/// Direction of the light: top left, as on maps.
const LIGHT: Vec3 = Vec3::new(-0.45, 0.78, -0.43);

const LOW_COLOUR: RGBColor = RGBColor(240, 242, 245);
const HIGH_COLOUR: RGBColor = RGBColor(184, 188, 194);
const EDGE_COLOUR: RGBColor = RGBColor(104, 110, 122);
const WALL_COLOUR: RGBColor = RGBColor(52, 58, 70);

/// Draws the plan. `cut` is a position and the height in metres of the cut there; without it nothing is cut away.
/// Triangles with a coordinate that is not finite are left out.
///
/// # Errors
/// Those of drawing.
pub fn draw_plan(
    area: &Area<'_>,
    frame: &PlanFrame,
    triangles: &[[Vec3; 3]],
    cut: Option<(Vec3, f32)>,
) -> Drawn {
    let ground = Ground::below(frame, triangles);
    let clearance_m = cut.map_or(f32::INFINITY, |(at, height_m)| {
        height_m - ground.at(vec2(at.x, at.z)).unwrap_or(at.y)
    });
    let cut_at = |at: Vec2| ground.at(at).map_or(f32::INFINITY, |g| g + clearance_m);
    Surface::of(frame, triangles, cut_at).draw(area, frame)?;
    let wall = WALL_COLOUR.stroke_width(px(WALL_PX) as u32);
    for corners in triangles.iter().filter(|t| t.iter().all(|c| c.is_finite())) {
        let is_steep = normal(corners).is_some_and(|n| n.y.abs() < WALL_COSINE);
        let above_m = corners.map(|c| c.y - cut_at(vec2(c.x, c.z)));
        if let Some(ends) = section(corners, above_m).filter(|_| is_steep) {
            let ends = ends.map(|end| frame.pixel(end).round().as_ivec2().into());
            area.draw(&PathElement::new(ends, wall))?;
        }
    }
    Ok(())
}

/// The visible surfaces, for each fine pixel: height in metres (NaN where there is none) and brightness.
struct Surface {
    columns: usize,
    heights_m: Vec<f32>,
    light: Vec<f32>,
}

impl Surface {
    fn of(frame: &PlanFrame, triangles: &[[Vec3; 3]], cut_at: impl Fn(Vec2) -> f32) -> Self {
        let scale = frame.px_per_m;
        let (columns, rows) = (frame.size_px.x as usize, frame.size_px.y as usize);
        let cuts_m: Vec<f32> = (0..columns * rows)
            .map(|i| vec2((i % columns) as f32 + 0.5, (i / columns) as f32 + 0.5))
            .map(|at| cut_at(frame.corner_m + at / scale))
            .collect();
        let mut heights_m = vec![f32::NAN; columns * rows];
        let mut light = vec![1.0; columns * rows];
        let to_pixels = |c: Vec3| ((vec2(c.x, c.z) - frame.corner_m) * scale).extend(c.y);
        for corners in triangles {
            let brightness = normal(corners).map_or(1.0, |n| {
                let up = if n.y < 0.0 { -n } else { n };
                1.0 + 0.25 * (up.dot(LIGHT) - LIGHT.y)
            });
            rasterise(&corners.map(to_pixels), columns, rows, |i, height_m| {
                let (seen_m, cut_m) = (heights_m[i], cuts_m[i]);
                let wins = seen_m.is_nan()
                    || match (height_m <= cut_m, seen_m <= cut_m) {
                        (true, true) => height_m > seen_m,
                        (false, false) => height_m < seen_m,
                        (is_below, _) => is_below,
                    };
                if wins {
                    heights_m[i] = height_m;
                    light[i] = brightness;
                }
            });
        }
        Self {
            columns,
            heights_m,
            light,
        }
    }

    fn draw(&self, area: &Area<'_>, frame: &PlanFrame) -> Drawn {
        let (low_m, range_m) = self.height_range_m();
        for (i, (height_m, light)) in self.heights_m.iter().zip(&self.light).enumerate() {
            let (x, y) = (i % self.columns, i / self.columns);
            let step_m = self.step_m(x, y);
            let mut colour = WHITE;
            if height_m.is_finite() {
                let flat = mixed(LOW_COLOUR, HIGH_COLOUR, (height_m - low_m) / range_m);
                let towards = if *light < 1.0 { INK } else { WHITE };
                colour = mixed(flat, towards, (light - 1.0).abs());
            }
            // A slope of 60 degrees is no edge.
            if step_m > EDGE_STEP_M.max(1.8 / frame.px_per_m) {
                colour = mixed(colour, EDGE_COLOUR, (0.35 + 0.25 * step_m).min(0.8));
            }
            let at = frame.corner_px.as_ivec2();
            area.draw_pixel((at.x + x as i32, at.y + y as i32), &colour)?;
        }
        Ok(())
    }

    /// Largest step in height to the right and lower neighbours; where a surface ends, a metre.
    fn step_m(&self, x: usize, y: usize) -> f32 {
        let here = y * self.columns + x;
        let right = (x + 1 < self.columns).then_some(here + 1);
        let below = Some(here + self.columns).filter(|&i| i < self.heights_m.len());
        let step = |other: usize| match (self.heights_m[here], self.heights_m[other]) {
            (a, b) if a.is_nan() && b.is_nan() => 0.0,
            (a, b) if a.is_nan() || b.is_nan() => 1.0,
            (a, b) => (a - b).abs(),
        };
        [right, below]
            .into_iter()
            .flatten()
            .map(step)
            .fold(0.0, f32::max)
    }

    /// Low end and width of the range that holds 96 of 100 fine pixels.
    fn height_range_m(&self) -> (f32, f32) {
        let mut heights_m: Vec<f32> = self
            .heights_m
            .iter()
            .copied()
            .filter(|h| h.is_finite())
            .collect();
        if heights_m.is_empty() {
            return (0.0, LEAST_RANGE_M);
        }
        heights_m.sort_by(f32::total_cmp);
        let at = |percent: usize| heights_m[(heights_m.len() - 1) * percent / 100];
        (at(2), (at(98) - at(2)).max(LEAST_RANGE_M))
    }
}

fn normal(corners: &[Vec3; 3]) -> Option<Vec3> {
    (corners[1] - corners[0])
        .cross(corners[2] - corners[0])
        .try_normalize()
}

/// The segment in which a triangle intersects the cut, from its corners' heights above the cut.
fn section(corners: &[Vec3; 3], above_m: [f32; 3]) -> Option<[Vec3; 2]> {
    let mut ends = (0..3).filter_map(|k| {
        let next = (k + 1) % 3;
        let (from, to) = (above_m[k], above_m[next]);
        ((from <= 0.0) != (to <= 0.0)).then(|| corners[k].lerp(corners[next], from / (from - to)))
    });
    Some([ends.next()?, ends.next()?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Picture;
    use glam::vec3;

    const FRAME: PlanFrame = PlanFrame {
        corner_m: Vec2::ZERO,
        corner_px: Vec2::ZERO,
        size_px: vec2(100.0, 100.0),
        px_per_m: 10.0,
    };

    fn plate(height_m: f32, low: Vec2, high: Vec2) -> [[Vec3; 3]; 2] {
        let at = |x: f32, z: f32| vec3(x, height_m, z);
        [
            [at(low.x, low.y), at(high.x, low.y), at(high.x, high.y)],
            [at(low.x, low.y), at(high.x, high.y), at(low.x, high.y)],
        ]
    }

    fn seen(triangles: &[[Vec3; 3]], cut_m: f32) -> Surface {
        Surface::of(&FRAME, triangles, |_| cut_m)
    }

    #[test]
    fn the_highest_surface_below_the_cut_is_visible() {
        let all = vec2(10.0, 10.0);
        let (floor, table, ceiling) = (
            plate(0.0, Vec2::ZERO, all),
            plate(0.8, Vec2::ZERO, all),
            plate(3.0, Vec2::ZERO, all),
        );
        for order in [
            [floor, table, ceiling],
            [ceiling, table, floor],
            [table, ceiling, floor],
        ] {
            assert!(
                seen(&order.concat(), 2.0)
                    .heights_m
                    .iter()
                    .all(|&h| h == 0.8)
            );
            assert!(
                seen(&order.concat(), f32::INFINITY)
                    .heights_m
                    .iter()
                    .all(|&h| h == 3.0)
            );
            assert!(
                seen(&order.concat(), -1.0)
                    .heights_m
                    .iter()
                    .all(|&h| h == 0.0)
            );
        }
    }

    #[test]
    fn plates_cover_their_area_without_seams() {
        let surface = seen(&plate(1.0, vec2(2.0, 3.0), vec2(7.0, 5.0)), 9.0);
        let covered = surface.heights_m.iter().filter(|h| !h.is_nan()).count();
        // 50 by 20 pixels.
        assert_eq!(covered, 1000);
    }

    #[test]
    fn the_cut_follows_the_ground() {
        // A slope from 0 to 10 m, with a roof 3 m above it: cut 2 m above the ground, the slope is visible.
        let sloped = |t: [Vec3; 3], rise_m: f32| t.map(|c| vec3(c.x, c.x + rise_m, c.z));
        let plates = plate(0.0, Vec2::ZERO, vec2(10.0, 10.0));
        let triangles = [
            sloped(plates[0], 0.0),
            sloped(plates[1], 0.0),
            sloped(plates[0], 3.0),
            sloped(plates[1], 3.0),
        ];
        let ground = Ground::below(&FRAME, &triangles);
        let surface = Surface::of(&FRAME, &triangles, |at| ground.at(at).unwrap() + 2.0);
        for (i, height_m) in surface.heights_m.iter().enumerate() {
            let x_m = ((i % surface.columns) as f32 + 0.5) / 10.0;
            assert!((height_m - x_m).abs() < 1e-3);
        }
    }

    #[test]
    fn a_section_is_the_intersection_of_wall_and_level() {
        let wall = [
            vec3(1.0, 0.0, 2.0),
            vec3(5.0, 0.0, 2.0),
            vec3(5.0, 4.0, 2.0),
        ];
        let cut = |height_m: f32| section(&wall, wall.map(|c| c.y - height_m));
        let [a, b] = cut(1.0).unwrap();
        let (left, right) = if a.x < b.x { (a, b) } else { (b, a) };
        assert!(
            left.distance(vec3(2.0, 1.0, 2.0)) < 1e-6 && right.distance(vec3(5.0, 1.0, 2.0)) < 1e-6
        );
        assert!(cut(4.5).is_none() && cut(-0.5).is_none());
    }

    #[test]
    fn non_finite_triangles_are_left_out() {
        let broken = [
            [Vec3::NAN; 3],
            [Vec3::ONE; 3],
            [Vec3::INFINITY, Vec3::ZERO, Vec3::ONE],
        ];
        let cut = Some((Vec3::ONE, 2.0));
        let drawn = Picture::draw(100, 100, |area| draw_plan(area, &FRAME, &broken, cut));
        assert_eq!(drawn, Picture::draw(100, 100, |_| Ok(())));
    }
}
