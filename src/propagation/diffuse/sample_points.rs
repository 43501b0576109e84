//! Where the samples of the late field are.
//!
//! Own. Points lie at even steps of area over the scene. Where that would put too few of them into a room, as in a house on a terrain, or
//! under a roof on open ground, there are more than are needed, and those from which nothing is hit are left out; where that is not
//! enough, as in a town, they lie closer around listeners and sources: beyond a radius a sample stands for an area in proportion to its
//! squared distance.

use glam::Vec3;

use crate::scene::Scene;

/// Area in square metres up to which samples of the whole scene are close enough.
const COARSEST_M2: f64 = 16.0;

/// Where fewer than one of so many samples are reached, most of a scene is open ground.
const FEW: usize = 4;

/// Points for each sample where most are left out.
const POINTS_PER_SAMPLE: usize = 8;

/// Most area of such a point in square metres: a room's walls have several.
const POINT_M2: f64 = 8.0;

/// Areas in square metres up to which samples are close enough after others have been left out: of the whole scene, which does not
/// depend on where listeners are, and around them, where a room of 200 m² then has fifty.
const EVEN_M2: f64 = 64.0;
const FOCUSED_M2: f64 = 4.0;

/// Radii in metres in which samples may be closest, in the order in which they are tried.
const RADII_M: [f32; 4] = [64.0, 32.0, 16.0, 8.0];

/// Most times that a triangle is halved.
const MAX_HALVINGS: u32 = 40;

/// Places around which samples lie closer.
#[derive(Debug, Clone, Default)]
pub(crate) struct Focus {
    /// Local coordinates. None: all of the scene is alike.
    centres: Vec<Vec3>,
    radius_m: f32,
}

impl Focus {
    /// Area of a sample relative to the least: one within the radius.
    fn coarseness(&self, point: Vec3) -> f32 {
        match self.distance_squared(point) {
            Some(square) => (square / (self.radius_m * self.radius_m)).max(1.0),
            None => 1.0,
        }
    }

    fn distance_squared(&self, point: Vec3) -> Option<f32> {
        let squares = self.centres.iter().map(|c| c.distance_squared(point));
        squares.min_by(f32::total_cmp)
    }

    /// Distance in radii from a point in local coordinates to the nearest centre; none if there are no centres.
    pub(crate) fn radii_to(&self, point: Vec3) -> Option<f32> {
        let square = self.distance_squared(point)?;
        Some(square.sqrt() / self.radius_m)
    }

    /// Whether the density depends on the place.
    pub(crate) fn is_uneven(&self) -> bool {
        !self.centres.is_empty()
    }
}

/// Number and density of points.
#[derive(Debug)]
pub(crate) struct PointDensity {
    pub(crate) focus: Focus,
    pub(crate) count: usize,
}

impl PointDensity {
    /// For about `count` samples and for listeners and sources in local coordinates. Calls a function with densities that
    /// are tried, which returns how many samples of their points are reached.
    pub(crate) fn choose(
        scene: &Scene,
        count: usize,
        occupants: &[Vec3],
        mut count_reached: impl FnMut(&Self) -> usize,
    ) -> Self {
        let mut tried = Self {
            focus: Focus::default(),
            count,
        };
        let total = weight_m2(scene, &tried.focus);
        if !total.is_finite() {
            return tried;
        }
        if total <= COARSEST_M2 * count as f64 {
            let reached = count_reached(&tried);
            if reached > 0 && FEW * reached < count {
                tried.count *= POINTS_PER_SAMPLE;
            }
            return tried;
        }
        let mut is_enough = |tried: &Self, most_m2: f64| {
            let point_m2 = weight_m2(scene, &tried.focus) / count as f64;
            if point_m2 > POINTS_PER_SAMPLE as f64 * POINT_M2 {
                return false;
            }
            let reached = count_reached(tried);
            2 * POINTS_PER_SAMPLE * reached >= count
                && point_m2 * reached as f64 <= most_m2 * count as f64
        };
        if !is_enough(&tried, EVEN_M2) {
            let centres = occupants.iter().filter(|occupant| occupant.is_finite());
            tried.focus.centres = centres.copied().collect();
            for radius_m in RADII_M {
                tried.focus.radius_m = radius_m;
                if is_enough(&tried, FOCUSED_M2) {
                    break;
                }
            }
        }
        Self {
            count: POINTS_PER_SAMPLE * count,
            ..tried
        }
    }
}

/// Area of a scene, that of each part divided by its coarseness.
fn weight_m2(scene: &Scene, focus: &Focus) -> f64 {
    let mut sum = 0.0;
    for_each_piece(scene, focus, |piece| sum += piece.weight_m2());
    sum
}

/// A triangle or a part of it, over which the coarseness is about constant.
struct Piece {
    triangle: u32,
    corners: [Vec3; 3],
    area_m2: f64,
    coarseness: f32,
}

impl Piece {
    fn weight_m2(&self) -> f64 {
        self.area_m2 / f64::from(self.coarseness)
    }

    /// Calls a function with all parts, which are small compared with their distance from the focus.
    fn split(self, focus: &Focus, halvings: u32, take: &mut impl FnMut(Self)) {
        let [a, b, c] = self.corners;
        let edges = [[a, b, c], [b, c, a], [c, a, b]];
        let length = |[a, b, _]: &[Vec3; 3]| a.distance_squared(*b);
        let longest = edges.iter().max_by(|p, q| length(p).total_cmp(&length(q)));
        let [a, b, c] = *longest.unwrap_or(&edges[0]);
        let smallest_m2 = 0.25 * focus.radius_m * focus.radius_m;
        if halvings == 0 || a.distance_squared(b) <= smallest_m2 * self.coarseness {
            return take(self);
        }
        let middle = 0.5 * (a + b);
        for corners in [[a, middle, c], [middle, b, c]] {
            let half = Self {
                triangle: self.triangle,
                corners,
                area_m2: 0.5 * self.area_m2,
                coarseness: focus.coarseness((corners[0] + corners[1] + corners[2]) / 3.0),
            };
            half.split(focus, halvings - 1, take);
        }
    }
}

/// Calls a function with all triangles of a scene; where the density depends on the place, with parts of them.
fn for_each_piece(scene: &Scene, focus: &Focus, mut take: impl FnMut(Piece)) {
    for (area_m2, triangle) in scene.static_areas() {
        let Some(corners) = scene.corners_in_scene(triangle) else {
            continue;
        };
        let whole = Piece {
            triangle,
            corners,
            area_m2,
            coarseness: focus.coarseness((corners[0] + corners[1] + corners[2]) / 3.0),
        };
        match focus.is_uneven() {
            false => take(whole),
            true => whole.split(focus, MAX_HALVINGS, &mut take),
        }
    }
}

/// A point of a surface, and the area in square metres that it stands for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfacePoint {
    pub(crate) triangle: u32,
    pub(crate) point: Vec3,
    pub(crate) area_m2: f32,
}

impl PointDensity {
    /// Points at even steps of area, closer around the focus, and the least area of one in square metres.
    pub(crate) fn points(&self, scene: &Scene) -> (Vec<SurfacePoint>, f32) {
        let total = weight_m2(scene, &self.focus);
        let step = total / self.count as f64;
        let mut points = Vec::new();
        if !(total > 0.0 && total.is_finite()) {
            return (points, step as f32);
        }
        let (mut sum, mut mark) = (0.0, 0.5 * step);
        for_each_piece(scene, &self.focus, |piece| {
            sum += piece.weight_m2();
            while mark < sum && points.len() < self.count {
                points.push(SurfacePoint {
                    triangle: piece.triangle,
                    point: point_within(&piece.corners, points.len() as u64),
                    area_m2: step as f32 * piece.coarseness,
                });
                mark += step;
            }
        });
        (points, step as f32)
    }
}

/// A point of a triangle: an R2 low-discrepancy sequence (\[ROBERTS18\]), folded.
fn point_within([a, b, c]: &[Vec3; 3], number: u64) -> Vec3 {
    let n = number as f64;
    let u = (0.5 + n * 0.754_877_666_246_692_8).fract() as f32;
    let v = (0.5 + n * 0.569_840_290_998_053_3).fract() as f32;
    let (u, v) = if u + v > 1.0 {
        (1.0 - u, 1.0 - v)
    } else {
        (u, v)
    };
    *a + u * (b - a) + v * (c - a)
}
