//! Simple bodies: boxes, extrusions, bodies of revolution, lumps. All face outwards.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

use glam::{DVec3, dvec3};

use super::builder::MeshBuilder;
use super::random::Random;

/// A side of a box, by the axis of its normal and its position along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Least x.
    XMin,
    /// Greatest x.
    XMax,
    /// The bottom.
    YMin,
    /// Least z.
    ZMin,
    /// Greatest z.
    ZMax,
}

/// A world axis: the direction of a long object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    /// Along x.
    X,
    /// Upright.
    Y,
    /// Along z.
    Z,
}

impl Axis {
    /// Two directions across and the direction itself, right-handed.
    fn frame(self) -> [DVec3; 3] {
        match self {
            Self::X => [DVec3::Y, DVec3::Z, DVec3::X],
            Self::Y => [DVec3::Z, DVec3::X, DVec3::Y],
            Self::Z => [DVec3::X, DVec3::Y, DVec3::Z],
        }
    }
}

/// Which ends of an extrusion are closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ends {
    /// Neither: both are sunk into other solids.
    Open,
    /// Only the far one: the near one is sunk into another solid.
    Far,
    /// Both.
    Closed,
}

impl MeshBuilder {
    /// A box between two corners; the sides in `without` are left off.
    pub(super) fn cuboid(&mut self, min: DVec3, max: DVec3, without: &[Side]) {
        let at = |x: u8, y: u8, z: u8| {
            dvec3(
                if x == 0 { min.x } else { max.x },
                if y == 0 { min.y } else { max.y },
                if z == 0 { min.z } else { max.z },
            )
        };
        let sides = [
            (
                Some(Side::XMin),
                [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)],
            ),
            (
                Some(Side::XMax),
                [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
            ),
            (
                Some(Side::YMin),
                [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)],
            ),
            (None, [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)]),
            (
                Some(Side::ZMin),
                [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)],
            ),
            (
                Some(Side::ZMax),
                [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
            ),
        ];
        for (side, corners) in sides {
            if side.is_none_or(|side| !without.contains(&side)) {
                self.polygon(&corners.map(|(x, y, z)| at(x, y, z)));
            }
        }
    }

    /// A box on a floor at `min.y`, without a bottom.
    pub(super) fn standing(&mut self, min: DVec3, max: DVec3) {
        self.cuboid(min, max, &[Side::YMin]);
    }

    /// A convex planar outline swept along `sweep`; the outline is counter-clockwise seen from its swept end.
    pub(super) fn extrude(&mut self, outline: &[DVec3], sweep: DVec3, ends: Ends) {
        for (i, &corner) in outline.iter().enumerate() {
            let next = outline[(i + 1) % outline.len()];
            self.polygon(&[corner, next, next + sweep, corner + sweep]);
        }
        if ends != Ends::Open {
            let far: Vec<DVec3> = outline.iter().map(|&corner| corner + sweep).collect();
            self.polygon(&far);
        }
        if ends == Ends::Closed {
            let near: Vec<DVec3> = outline.iter().rev().copied().collect();
            self.polygon(&near);
        }
    }

    /// A box of `size` with the middle of its bottom at `foot`, turned about the vertical: without a bottom on a floor
    /// ([`Ends::Far`]), with one on a smaller object.
    pub(super) fn standing_turned(&mut self, foot: DVec3, size: DVec3, turns: f64, ends: Ends) {
        let (along, across) = heading(turns);
        let (a, b) = (along * (0.5 * size.x), across * (0.5 * size.z));
        let outline = [foot - a - b, foot - a + b, foot + a + b, foot + a - b];
        self.extrude(&outline, DVec3::Y * size.y, ends);
    }

    /// A regular prism (a column, a pipe) from the middle of one end.
    pub(super) fn prism(
        &mut self,
        axis: Axis,
        start: DVec3,
        length: f64,
        radius: f64,
        sides: u32,
        ends: Ends,
    ) {
        let outline: Vec<DVec3> = (0..sides)
            .map(|i| ring_point(axis, start, radius, i, sides))
            .collect();
        self.extrude(&outline, axis.frame()[2] * length, ends);
    }

    /// A body of revolution: rings as (position along the axis, radius), rising. A radius of 0 closes an end in a point,
    /// any other end is left open.
    pub(super) fn revolve(&mut self, axis: Axis, start: DVec3, rings: &[(f64, f64)], sides: u32) {
        let direction = axis.frame()[2];
        for pair in rings.windows(2) {
            let [(low, low_radius), (high, high_radius)] = [pair[0], pair[1]];
            for i in 0..sides {
                let at = |along: f64, radius: f64, side: u32| {
                    ring_point(axis, start + direction * along, radius, side % sides, sides)
                };
                let [a, b] = [at(low, low_radius, i), at(low, low_radius, i + 1)];
                let [c, d] = [at(high, high_radius, i + 1), at(high, high_radius, i)];
                match (low_radius > 0.0, high_radius > 0.0) {
                    (true, true) => self.polygon(&[a, b, c, d]),
                    (true, false) => self.triangle([a, b, c]),
                    (false, _) => self.triangle([a, c, d]),
                }
            }
        }
    }

    /// An uneven ball: each corner of `ball` at `radius` times 1 ± `unevenness`.
    pub(super) fn lump(
        &mut self,
        ball: &Ball,
        middle: DVec3,
        radius: f64,
        unevenness: f64,
        random: &mut Random,
    ) {
        let corners: Vec<DVec3> = ball
            .corners
            .iter()
            .map(|&corner| {
                middle + corner * (radius * random.between(1.0 - unevenness, 1.0 + unevenness))
            })
            .collect();
        for triangle in &ball.triangles {
            self.triangle(triangle.map(|i| corners[i]));
        }
    }
}

/// Unit vectors along and across (to the right, seen from above) of a heading in turns about the vertical; 0 is +x.
pub(super) fn heading(turns: f64) -> (DVec3, DVec3) {
    let (cos, sin) = unit_circle(turns);
    (dvec3(cos, 0.0, -sin), dvec3(sin, 0.0, cos))
}

/// Cosine and sine of a number of turns by their series. The library's functions may differ by a bit from one machine
/// to the next, `+ − × ÷` may not.
fn unit_circle(turns: f64) -> (f64, f64) {
    let quarters = (turns * 4.0).floor();
    let angle = (turns * 4.0 - quarters) * FRAC_PI_2;
    let (mut cos, mut sin, mut term) = (0.0, 0.0, 1.0);
    // (π/2)^24 / 24! is 8e-20: nothing beyond matters in f64.
    for n in 0..24 {
        match n % 4 {
            0 => cos += term,
            1 => sin += term,
            2 => cos -= term,
            _ => sin -= term,
        }
        term *= angle / f64::from(n + 1);
    }
    match (quarters as i64).rem_euclid(4) {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

/// Corner `i` of a regular polygon, turned by half a step: sides, not corners, face along the axes.
fn ring_point(axis: Axis, middle: DVec3, radius: f64, i: u32, sides: u32) -> DVec3 {
    let [u, v, _] = axis.frame();
    let (cos, sin) = unit_circle((f64::from(i) + 0.5) / f64::from(sides));
    middle + u * (radius * cos) + v * (radius * sin)
}

/// A unit ball of triangles of nearly one size.
pub(super) struct Ball {
    corners: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
}

impl Ball {
    /// An icosahedron whose faces are split in four `splits` times: 20 · 4^splits triangles.
    pub(super) fn new(splits: u32) -> Self {
        let golden = (1.0 + 5f64.sqrt()) / 2.0;
        let mut corners = Vec::new();
        for (a, b) in [
            (1.0, golden),
            (-1.0, golden),
            (1.0, -golden),
            (-1.0, -golden),
        ] {
            corners.extend([dvec3(a, b, 0.0), dvec3(0.0, a, b), dvec3(b, 0.0, a)]);
        }
        for corner in &mut corners {
            *corner /= corner.length();
        }
        // Every three corners a shortest edge apart are a face; an outward normal agrees with the middle of the face.
        let near = |a: DVec3, b: DVec3| a.distance_squared(b) < 1.2;
        let mut triangles = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    let [p, q, r] = [corners[a], corners[b], corners[c]];
                    if near(p, q) && near(q, r) && near(p, r) {
                        let outwards = (q - p).cross(r - p).dot(p) > 0.0;
                        triangles.push(if outwards { [a, b, c] } else { [a, c, b] });
                    }
                }
            }
        }
        let mut ball = Self { corners, triangles };
        for _ in 0..splits {
            ball.split();
        }
        ball
    }

    fn split(&mut self) {
        let mut middles = HashMap::new();
        let mut finer = Vec::with_capacity(4 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let middle = self.corners[i] + self.corners[j];
                    self.corners.push(middle / middle.length());
                    self.corners.len() - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        self.triangles = finer;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_agrees_with_the_library() {
        for i in -40..40 {
            let turns = f64::from(i) / 31.0;
            let (cos, sin) = unit_circle(turns);
            let angle = turns * std::f64::consts::TAU;
            // Four decimal digits of rounding in the argument, at most 8 rad.
            assert!((cos - angle.cos()).abs() < 1e-14 && (sin - angle.sin()).abs() < 1e-14);
        }
    }

    #[test]
    fn ball_is_closed_and_faces_outwards() {
        let ball = Ball::new(2);
        assert_eq!(ball.triangles.len(), 320);
        assert_eq!(ball.corners.len(), 162);
        for triangle in &ball.triangles {
            let [a, b, c] = triangle.map(|i| ball.corners[i]);
            assert!((b - a).cross(c - a).dot(a) > 0.0);
        }
    }
}
