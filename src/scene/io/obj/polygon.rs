//! Cuts polygons into triangles.
//!
//! Control side. Convex polygons become fans; others lose one ear after another (\[EBERLY15\], adapted: a corner counts as
//! an ear when no other corner lies strictly inside it). A polygon that has no ear left, because it crosses itself,
//! ends as a fan. Bounded by [`MOST_EAR_CORNERS`] cubed.

use glam::DVec3;

/// Polygons of more corners are fanned: cutting ears costs up to the cube of their number.
pub(crate) const MOST_EAR_CORNERS: usize = 400;

/// Triangles of a polygon, as positions in its list of corners, in the polygon's winding.
pub(crate) fn triangulate(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let count = corners.len();
    let fan = || (2..count).map(|i| [0, i - 1, i]).collect();
    if count <= 3 || count > MOST_EAR_CORNERS {
        return fan();
    }
    let normal = newell_normal(corners);
    let turn = |a: usize, b: usize, c: usize| {
        (corners[b] - corners[a])
            .cross(corners[c] - corners[b])
            .dot(normal)
    };
    if (0..count).all(|i| turn(i, (i + 1) % count, (i + 2) % count) >= 0.0) && !winds_twice(corners)
    {
        return fan();
    }
    let mut left: Vec<usize> = (0..count).collect();
    let mut triangles = Vec::with_capacity(count - 2);
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).find(|&i| {
            let (a, b, c) = (left[(i + n - 1) % n], left[i], left[(i + 1) % n]);
            turn(a, b, c) > 0.0
                && !left.iter().any(|&p| {
                    p != a
                        && p != b
                        && p != c
                        && turn(a, b, p) > 0.0
                        && turn(b, c, p) > 0.0
                        && turn(c, a, p) > 0.0
                })
        });
        // Without an ear the rest is straight or crosses itself; taking any corner keeps the outline and ends.
        let i = ear.unwrap_or(1);
        triangles.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]]);
        left.remove(i);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// Normal of a polygon by Newell's method: its length is twice the enclosed area.
fn newell_normal(corners: &[DVec3]) -> DVec3 {
    let origin = corners[0];
    (1..corners.len() - 1)
        .map(|i| (corners[i] - origin).cross(corners[i + 1] - origin))
        .sum()
}

/// Whether the fan from the first corner folds back on itself, as in a pentagram whose turns all have one sign.
fn winds_twice(corners: &[DVec3]) -> bool {
    let normal = newell_normal(corners);
    (1..corners.len() - 1).any(|i| {
        (corners[i] - corners[0])
            .cross(corners[i + 1] - corners[0])
            .dot(normal)
            < 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3]) -> f64 {
        triangulate(corners)
            .iter()
            .map(|t| {
                (corners[t[1]] - corners[t[0]])
                    .cross(corners[t[2]] - corners[t[0]])
                    .length()
                    / 2.0
            })
            .sum()
    }

    fn plan(outline: &[(f64, f64)]) -> Vec<DVec3> {
        outline
            .iter()
            .map(|&(x, z)| DVec3::new(x, 1.0, z))
            .collect()
    }

    #[test]
    fn every_start_of_a_concave_outline_covers_its_area_once() {
        let mut l_shape = plan(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 1.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (0.0, 3.0),
        ]);
        for _ in 0..6 {
            // A fan from most of these corners covers more than 6 m².
            assert!((area(&l_shape) - 6.0).abs() < 1e-12);
            l_shape.rotate_left(1);
        }
        l_shape.reverse();
        assert!((area(&l_shape) - 6.0).abs() < 1e-12);
    }

    #[test]
    fn crossing_and_flat_outlines_end() {
        for outline in [
            plan(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]),
            plan(&[(0.0, 0.0); 7]),
            plan(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (1.5, 0.0)]),
        ] {
            assert_eq!(triangulate(&outline).len(), outline.len() - 2);
        }
    }
}
