//! Cuts polygons into triangles.
//!
//! Control side. Convex polygons become fans; others lose one ear after another (\[EBERLY15\], \[HELD01\], adapted). All
//! corners are kept: without those on straight sides, the seam to a neighbouring face would open. A hole may be a part of
//! the outline that bridges lead to and back from. The remaining corners are in a tree, so a polygon of n corners takes
//! about n log n steps.
//!
//! Triangles that are all wound as the polygon have its area in sum, and cover a polygon that does not cross itself exactly
//! once. So their winding is what is checked at the end.

mod corner_tree;

use std::collections::BinaryHeap;

use glam::{DVec2, DVec3};

use corner_tree::CornerTree;

/// Searches for ears among all corners. One suffices for polygons that do not cross themselves; each later one costs as
/// much as the first.
const MOST_SEARCHES: usize = 8;

/// Triangles of a polygon.
#[derive(Debug)]
pub(crate) struct Triangulation {
    /// Positions in the list of corners, in the polygon's winding; two less than corners.
    pub(crate) triangles: Vec<[usize; 3]>,
    /// Whether they cover the polygon once. Otherwise its outline crosses itself.
    pub(crate) is_exact: bool,
}

/// Cuts a polygon of three corners or more.
pub(crate) fn triangulate(corners: &[DVec3]) -> Triangulation {
    let count = corners.len();
    let normal = newell_normal(corners);
    let fan = |is_exact| Triangulation {
        triangles: (2..count).map(|i| [0, i - 1, i]).collect(),
        is_exact,
    };
    if count <= 3 {
        return fan(true);
    }
    if normal == DVec3::ZERO {
        let is_flat = |p: &[DVec3]| (p[0] - corners[0]).cross(p[1] - corners[0]) == DVec3::ZERO;
        return fan(corners[1..].windows(2).all(is_flat));
    }
    let plan = projected(corners, normal);
    if is_fan(&plan) {
        return fan(true);
    }
    let mut clipper = Clipper::new(&plan);
    clipper.clip();
    let is_exact = clipper.triangles.iter().all(|t| {
        let [a, b, c] = t.map(|i| plan[i]);
        turn(a, b, c) >= 0.0
    });
    Triangulation {
        triangles: clipper.triangles,
        is_exact,
    }
}

/// Normal of a polygon by Newell's method: its length is twice the enclosed area.
fn newell_normal(corners: &[DVec3]) -> DVec3 {
    let origin = corners[0];
    (1..corners.len() - 1)
        .map(|i| (corners[i] - origin).cross(corners[i + 1] - origin))
        .sum()
}

/// The corners without the coordinate along which the normal is longest, counterclockwise. Other projections would round:
/// from these, [`turn`] has the right sign.
fn projected(corners: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let size = normal.abs();
    let (along, plane): (f64, fn(&DVec3) -> DVec2) = if size.z >= size.x.max(size.y) {
        (normal.z, |p| DVec2::new(p.x, p.y))
    } else if size.y >= size.x {
        (normal.y, |p| DVec2::new(p.z, p.x))
    } else {
        (normal.x, |p| DVec2::new(p.y, p.z))
    };
    let mirror = DVec2::new(1f64.copysign(along), 1.0);
    corners.iter().map(|p| mirror * plane(p)).collect()
}

/// Twice the area of a triangle, positive if it is counterclockwise. Coordinates are `f32` numbers, so differences and
/// products are exact unless magnitudes differ by more than five digits.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Whether a polygon is convex and a fan from its first corner leaves no corner out.
fn is_fan(plan: &[DVec2]) -> bool {
    let n = plan.len();
    let at = |i: usize| plan[i % n];
    (0..n).all(|i| turn(at(i), at(i + 1), at(i + 2)) >= 0.0)
        // Where all turns have one sign, the outline may still wind twice, as a pentagram.
        && (1..n - 1).all(|i| turn(plan[0], plan[i], plan[i + 1]) > 0.0)
}

/// A corner that can be cut off, the best-shaped one first.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Ear {
    /// Bits of the ratio of height to longest side: positive numbers sort as their bits do.
    shape: u64,
    corner: std::cmp::Reverse<u32>,
    /// Changes of the corner's neighbours so far; an ear of earlier neighbours is void.
    version: u32,
}

/// A polygon that loses its ears.
struct Clipper<'a> {
    plan: &'a [DVec2],
    /// Neighbours on the remaining outline.
    before: Vec<u32>,
    after: Vec<u32>,
    version: Vec<u32>,
    /// Whether a corner remains.
    remains: Vec<bool>,
    /// Whether the interior angle is a half-turn or more: only such corners can lie in an ear.
    is_reflex: Vec<bool>,
    tree: CornerTree,
    ears: BinaryHeap<Ear>,
    triangles: Vec<[usize; 3]>,
}

impl<'a> Clipper<'a> {
    fn new(plan: &'a [DVec2]) -> Self {
        let n = plan.len() as u32;
        Self {
            plan,
            before: (0..n).map(|i| (i + n - 1) % n).collect(),
            after: (0..n).map(|i| (i + 1) % n).collect(),
            version: vec![0; plan.len()],
            remains: vec![true; plan.len()],
            is_reflex: vec![false; plan.len()],
            tree: CornerTree::new(plan),
            ears: BinaryHeap::new(),
            triangles: Vec::with_capacity(plan.len() - 2),
        }
    }

    fn at(&self, corner: u32) -> DVec2 {
        self.plan[corner as usize]
    }

    /// A corner between its neighbours.
    fn triangle(&self, corner: u32) -> [u32; 3] {
        let i = corner as usize;
        [self.before[i], corner, self.after[i]]
    }

    fn turn(&self, corner: u32) -> f64 {
        let [a, b, c] = self.triangle(corner).map(|i| self.at(i));
        turn(a, b, c)
    }

    fn clip(&mut self) {
        let mut start = 0;
        for _ in 0..MOST_SEARCHES {
            self.search(start);
            while self.triangles.len() + 3 < self.plan.len() {
                let Some(ear) = self.ears.pop() else { break };
                let corner = ear.corner.0;
                if self.remains[corner as usize] && ear.version == self.version[corner as usize] {
                    start = self.cut(corner);
                }
            }
            if self.triangles.len() + 3 == self.plan.len() {
                break;
            }
            // All that remains is straight, or the outline crosses itself. A corner without area leaves nothing uncovered.
            let straight = self
                .outline(start)
                .into_iter()
                .find(|&i| self.turn(i) == 0.0);
            let Some(straight) = straight else { break };
            start = self.cut(straight);
        }
        let rest = self.outline(start).into_iter().map(|i| i as usize);
        let rest: Vec<usize> = rest.collect();
        let fan = rest[1..].windows(2).map(|pair| [rest[0], pair[0], pair[1]]);
        self.triangles.extend(fan);
    }

    /// The remaining corners in order.
    fn outline(&self, start: u32) -> Vec<u32> {
        let mut outline = vec![start];
        let mut next = self.after[start as usize];
        while next != start {
            outline.push(next);
            next = self.after[next as usize];
        }
        outline
    }

    /// Finds all ears.
    fn search(&mut self, start: u32) {
        let outline = self.outline(start);
        for &corner in &outline {
            self.is_reflex[corner as usize] = self.turn(corner) <= 0.0;
        }
        for corner in outline {
            self.update(corner);
        }
    }

    /// Cuts off a corner; returns the one before it.
    fn cut(&mut self, corner: u32) -> u32 {
        let [before, _, after] = self.triangle(corner);
        self.triangles
            .push([before, corner, after].map(|i| i as usize));
        self.remains[corner as usize] = false;
        self.after[before as usize] = after;
        self.before[after as usize] = before;
        for neighbour in [before, after] {
            self.is_reflex[neighbour as usize] = self.turn(neighbour) <= 0.0;
        }
        for neighbour in [before, after] {
            self.update(neighbour);
        }
        before
    }

    /// Tests a corner whose neighbours are new.
    fn update(&mut self, corner: u32) {
        self.version[corner as usize] += 1;
        if self.is_reflex[corner as usize] || self.is_blocked(corner) {
            return;
        }
        let [a, b, c] = self.triangle(corner).map(|i| self.at(i));
        let longest = a
            .distance_squared(b)
            .max(b.distance_squared(c))
            .max(c.distance_squared(a));
        self.ears.push(Ear {
            shape: (turn(a, b, c) / longest).to_bits(),
            corner: std::cmp::Reverse(corner),
            version: self.version[corner as usize],
        });
    }

    /// Whether the outline enters the triangle of a corner and its neighbours, or touches it elsewhere than at its corners.
    fn is_blocked(&mut self, corner: u32) -> bool {
        let triangle = self.triangle(corner);
        let [a, b, c] = triangle.map(|i| self.at(i));
        let (plan, before, after) = (self.plan, &self.before, &self.after);
        let (remains, is_reflex) = (&self.remains, &self.is_reflex);
        self.tree.any_within([a, b, c], |other| {
            let i = other as usize;
            if !remains[i] || !is_reflex[i] || triangle.contains(&other) {
                return false;
            }
            let point = plan[i];
            if point == b {
                // Where a bridge ends, the outline may lead into the triangle and leave it through its third side.
                let enters = |q: u32| {
                    let q = plan[q as usize];
                    turn(a, b, q) > 0.0 && turn(b, c, q) > 0.0
                };
                return enters(before[i]) || enters(after[i]);
            }
            point != a
                && point != c
                && turn(a, b, point) >= 0.0
                && turn(b, c, point) >= 0.0
                && turn(c, a, point) >= 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(outline: &[(f64, f64)]) -> Vec<DVec3> {
        outline
            .iter()
            .map(|&(x, z)| DVec3::new(x, 1.0, z))
            .collect()
    }

    #[test]
    fn crossing_and_flat_outlines_end() {
        for (outline, is_exact) in [
            (
                plan(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]),
                false,
            ),
            (plan(&[(0.0, 0.0); 7]), true),
            (
                plan(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (1.5, 0.0)]),
                true,
            ),
        ] {
            let found = triangulate(&outline);
            assert_eq!(found.triangles.len(), outline.len() - 2);
            assert_eq!(found.is_exact, is_exact, "{outline:?}");
        }
    }

    #[test]
    fn corners_on_straight_sides_are_used() {
        // A square with a corner in the middle of each side, from each of its eight corners.
        let mut square = [
            (0.0, 0.0),
            (1.0, 0.0),
            (2.0, 0.0),
            (2.0, 1.0),
            (2.0, 2.0),
            (1.0, 2.0),
            (0.0, 2.0),
            (0.0, 1.0),
        ];
        for _ in 0..8 {
            square.rotate_left(1);
            let corners = plan(&square);
            for [a, b, c] in triangulate(&corners).triangles {
                let area = (corners[b] - corners[a]).cross(corners[c] - corners[a]);
                assert!(area.length() > 0.0, "{square:?}");
            }
        }
    }

    /// A star, a comb, a spiral and a saw around a circle.
    fn concave(count: usize) -> [Vec<DVec2>; 4] {
        let half = count / 2;
        let polar = |angle: f64, r: f64| DVec2::new(angle.cos(), angle.sin()) * r;
        let rounded = |p: DVec2| p.as_vec2().as_dvec2();
        let around = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
        let star = (0..count).map(|i| polar(around(i), [40.0, 0.5][i % 2]));
        let saw = (0..count).map(|i| polar(around(i), [40.0, 39.0][i % 2]));
        let comb = (0..count - 2)
            .map(|i| DVec2::new(i as f64, [0.0, 30.0][i % 2]))
            .chain([DVec2::new(count as f64, 40.0), DVec2::new(-1.0, 40.0)]);
        let out = (0..half).map(|i| (i, 0.0));
        let back = (0..half).rev().map(|i| (i, 0.4));
        let spiral = out.chain(back).map(|(i, inner)| {
            let angle = 0.1 * i as f64;
            polar(angle, 2.0 + angle - inner)
        });
        [
            star.map(rounded).collect(),
            saw.map(rounded).collect(),
            comb.collect(),
            spiral.map(rounded).collect(),
        ]
    }

    #[test]
    fn work_grows_little_faster_than_the_number_of_corners() {
        for count in [400, 1600, 6400, 25_600] {
            for (shape, plan) in concave(count).into_iter().enumerate() {
                let mut clipper = Clipper::new(&plan);
                clipper.clip();
                let all_wound_alike = clipper.triangles.iter().all(|t| {
                    let [a, b, c] = t.map(|i| plan[i]);
                    turn(a, b, c) >= 0.0
                });
                assert!(all_wound_alike, "shape {shape} of {count}");
                // Three searches a corner, each down one or two branches of the tree.
                let visits = clipper.tree.visits as f64 / count as f64;
                assert!(
                    visits < 10.0 * (count as f64).log2(),
                    "shape {shape} of {count}: {visits} a corner"
                );
            }
        }
    }
}
