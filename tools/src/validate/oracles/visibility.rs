//! Oracle: every triangle against every ray, in `f64`, by Möller and Trumbore's test.

use glam::{DVec3, Vec3};

/// Parameter of the first triangle that a ray hits.
pub fn brute_force_closest(
    triangles: &[[Vec3; 3]],
    origin: DVec3,
    direction: DVec3,
) -> Option<f64> {
    triangles
        .iter()
        .filter_map(|triangle| intersect(triangle, origin, direction))
        .filter(|t| *t > 0.0)
        .min_by(f64::total_cmp)
}

/// Whether no triangle lies strictly between two points; triangles in `skip` do not count.
pub fn is_visible(
    triangles: &[[Vec3; 3]],
    from: DVec3,
    to: DVec3,
    skip: impl Fn(usize) -> bool,
) -> bool {
    triangles.iter().enumerate().all(|(i, triangle)| {
        skip(i) || !intersect(triangle, from, to - from).is_some_and(|t| t > 0.0 && t < 1.0)
    })
}

fn intersect(triangle: &[Vec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    let [a, b, c] = triangle.map(|p| p.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s = origin - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(e1);
    let v = direction.dot(q) / determinant;
    // A margin beyond the edges: rounding leaves no gap between neighbours.
    let slack = 1e-12;
    (u >= -slack && v >= -slack && u + v <= 1.0 + slack).then(|| e2.dot(q) / determinant)
}

#[test]
fn the_oracle_finds_a_blocking_triangle() {
    let wall = [
        Vec3::new(1.0, -1.0, -1.0),
        Vec3::new(1.0, 3.0, -1.0),
        Vec3::new(1.0, -1.0, 3.0),
    ];
    assert_eq!(
        brute_force_closest(&[wall], DVec3::ZERO, DVec3::X),
        Some(1.0)
    );
    assert_eq!(
        brute_force_closest(&[wall], DVec3::ZERO, DVec3::NEG_X),
        None
    );
    assert!(!is_visible(&[wall], DVec3::ZERO, DVec3::X * 2.0, |_| false));
    assert!(is_visible(&[wall], DVec3::ZERO, DVec3::X * 2.0, |i| i == 0));
}
