//! A scene from above as an architect draws it: cut open a little above the ears, what lies below shaded by height,
//! what is cut outlined.
//!
//! The cut follows the ground, so that a hill is not cut off. Where all is above the cut, as on a knoll, the lowest
//! surface is shown. The cost is that of one look at every triangle, so 130,000 are as readable as ten.

use glam::{Vec2, Vec3, vec2};

use super::canvas::{Canvas, line_cover};
use super::colormap::Colour;
use super::plan_ground::{Ground, rasterise};

/// Sub-pixels a pixel side.
const FINENESS: usize = 2;
/// Height range shown, at least, in metres: a floor's unevenness stays pale.
const LEAST_RANGE_M: f32 = 2.5;
/// A step between neighbouring sub-pixels from which an edge is drawn, in metres.
const EDGE_STEP_M: f32 = 0.12;
/// Surfaces steeper than this (cosine between normal and up) are outlined where the cut meets them.
const WALL_COSINE: f32 = 0.5;
/// Width of that outline in pixels.
const WALL_PX: f32 = 1.8;
/// Where the light comes from: top left, as maps have it.
const LIGHT: Vec3 = Vec3::new(-0.45, 0.78, -0.43);

const LOW_COLOUR: Colour = Colour(240, 242, 245);
const HIGH_COLOUR: Colour = Colour(184, 188, 194);
const EDGE_COLOUR: Colour = Colour(104, 110, 122);
const WALL_COLOUR: Colour = Colour(52, 58, 70);

/// Where world places lie in the picture: +x to the right, +z downwards, one scale for both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanFrame {
    /// World (x, z) at the upper left corner, in metres.
    pub corner_m: Vec2,
    /// Pixels of that corner.
    pub corner_px: Vec2,
    /// Width and height of the plan, in pixels.
    pub size_px: Vec2,
    /// Scale in pixels a metre.
    pub px_per_m: f32,
}

impl PlanFrame {
    /// The pixel above which a place lies.
    pub fn place(&self, at: Vec3) -> Vec2 {
        self.corner_px + (vec2(at.x, at.z) - self.corner_m) * self.px_per_m
    }
}

/// Draws the plan. With a cut, `cut_height_m` is the height in metres that it has at `cut_place`; without, all is
/// seen from above. Triangles with a coordinate that is no number are left out.
pub fn draw_plan(
    canvas: &mut Canvas,
    frame: &PlanFrame,
    triangles: &[[Vec3; 3]],
    cut: Option<(Vec3, f32)>,
) {
    let ground = Ground::below(frame, triangles);
    let clearance_m = cut.map_or(f32::INFINITY, |(place, height_m)| {
        height_m - ground.at(vec2(place.x, place.z)).unwrap_or(place.y)
    });
    let cut_at = |at: Vec2| ground.at(at).map_or(f32::INFINITY, |g| g + clearance_m);
    let surface = Surface::of(frame, triangles, cut_at);
    surface.paint(canvas, frame);
    draw_sections(canvas, frame, triangles, cut_at);
}

/// Outlines what the cut goes through. Neighbouring pieces of a wall share their ends, so coverage is collected
/// first and drawn once.
fn draw_sections(
    canvas: &mut Canvas,
    frame: &PlanFrame,
    triangles: &[[Vec3; 3]],
    cut_at: impl Fn(Vec2) -> f32,
) {
    let size = (canvas.width(), canvas.height());
    let mut covers = vec![0.0f32; size.0 * size.1];
    for corners in triangles.iter().filter(|t| t.iter().all(|c| c.is_finite())) {
        let is_steep = normal(corners).is_some_and(|n| n.y.abs() < WALL_COSINE);
        if !is_steep {
            continue;
        }
        let above_m = corners.map(|c| c.y - cut_at(vec2(c.x, c.z)));
        if let Some([a, b]) = section(corners, above_m) {
            line_cover(
                size,
                frame.place(a),
                frame.place(b),
                WALL_PX,
                |x, y, cover| {
                    let pixel = &mut covers[y * size.0 + x];
                    *pixel = pixel.max(cover);
                },
            );
        }
    }
    for (i, cover) in covers.into_iter().enumerate() {
        canvas.blend((i % size.0) as i64, (i / size.0) as i64, WALL_COLOUR, cover);
    }
}

/// What is seen from above, a sub-pixel each: height in metres (NaN where nothing is) and brightness.
struct Surface {
    columns: usize,
    heights_m: Vec<f32>,
    light: Vec<f32>,
}

impl Surface {
    fn of(frame: &PlanFrame, triangles: &[[Vec3; 3]], cut_at: impl Fn(Vec2) -> f32) -> Self {
        let scale = frame.px_per_m * FINENESS as f32;
        let columns = frame.size_px.x as usize * FINENESS;
        let rows = frame.size_px.y as usize * FINENESS;
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

    fn paint(&self, canvas: &mut Canvas, frame: &PlanFrame) {
        let (low_m, range_m) = self.height_range_m();
        let sub_pixel_m = 1.0 / (frame.px_per_m * FINENESS as f32);
        let share = 1.0 / (FINENESS * FINENESS) as f32;
        let colour = |x: usize, y: usize| -> Colour {
            let i = y * self.columns + x;
            let height_m = self.heights_m[i];
            let step_m = self.step_m(x, y);
            let ground = if height_m.is_nan() {
                Colour::WHITE
            } else {
                let level = ((height_m - low_m) / range_m).clamp(0.0, 1.0);
                let flat = LOW_COLOUR.mixed(HIGH_COLOUR, level);
                let light = self.light[i];
                flat.mixed(
                    if light < 1.0 {
                        Colour::INK
                    } else {
                        Colour::WHITE
                    },
                    (light - 1.0).abs(),
                )
            };
            // A slope of 60 degrees is no edge.
            if step_m > EDGE_STEP_M.max(1.8 * sub_pixel_m) {
                ground.mixed(EDGE_COLOUR, (0.35 + 0.25 * step_m).min(0.8))
            } else {
                ground
            }
        };
        for y in 0..frame.size_px.y as usize {
            for x in 0..frame.size_px.x as usize {
                let mut sum = [0.0f32; 3];
                for (dx, dy) in (0..FINENESS * FINENESS).map(|k| (k % FINENESS, k / FINENESS)) {
                    let Colour(r, g, b) = colour(x * FINENESS + dx, y * FINENESS + dy);
                    sum = [
                        sum[0] + f32::from(r),
                        sum[1] + f32::from(g),
                        sum[2] + f32::from(b),
                    ];
                }
                let [r, g, b] = sum.map(|c| (c * share).round() as u8);
                let corner = frame.corner_px;
                canvas.blend(
                    corner.x as i64 + x as i64,
                    corner.y as i64 + y as i64,
                    Colour(r, g, b),
                    1.0,
                );
            }
        }
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

    /// Low end and width of the range that holds 96 of 100 sub-pixels.
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

/// Where a triangle meets the cut, from its corners' heights above the cut.
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
    fn the_highest_surface_below_the_cut_is_seen() {
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
        assert_eq!(covered, 1000 * FINENESS * FINENESS);
    }

    #[test]
    fn the_cut_follows_the_ground() {
        // A slope from 0 to 10 m, with a roof 3 m above it: cut 2 m above the ground it is the slope that is seen.
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
            let x_m = ((i % surface.columns) as f32 + 0.5) / 20.0;
            assert!((height_m - x_m).abs() < 1e-3);
        }
    }

    #[test]
    fn a_section_is_where_wall_and_level_meet() {
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
    fn broken_triangles_are_left_out() {
        let mut canvas = Canvas::new(100, 100).unwrap();
        let broken = [
            [Vec3::NAN; 3],
            [Vec3::ONE; 3],
            [Vec3::INFINITY, Vec3::ZERO, Vec3::ONE],
        ];
        draw_plan(&mut canvas, &FRAME, &broken, Some((Vec3::ONE, 2.0)));
        assert_eq!(canvas, Canvas::new(100, 100).unwrap());
    }
}
