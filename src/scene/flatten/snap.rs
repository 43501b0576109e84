//! Moves vertices onto the planes and round shapes of their triangles' regions: onto one of them, the line of two, the corner of
//! three.

use glam::{DMat3, DVec3};

use super::facets::{Facets, NONE};
use super::plane_fit::Plane;
use super::round_fit::Round;

/// Weight of a vertex's own position against that of a plane: only directions that no plane decides are left to it.
const STAY: f64 = 1e-7;

/// Two planes count as one where their normals differ by less: a degree. Their line would be far away.
const SAME_COSINE: f64 = 0.9998;

/// A vertex moves by at most as many tolerances; one at the line of two slanted planes by more than the noise.
const MOST_TOLERANCES: f64 = 2.0;

/// Steps to the intersection of shapes that are not flat.
const ROUND_STEPS: usize = 4;

/// What a vertex is moved onto.
#[derive(Clone, Copy)]
pub(super) enum Shape {
    Flat(Plane),
    Round(Round),
}

impl Shape {
    /// Its plane near a point.
    fn plane(&self, point: DVec3) -> Plane {
        match self {
            Self::Flat(plane) => *plane,
            Self::Round(round) => round.tangent(point),
        }
    }
}

/// New positions, relative to the centre; equal to the old ones where no region has a part.
pub(super) fn snapped(
    facets: &Facets,
    triangles: &[[u32; 3]],
    positions: &[DVec3],
    (of_triangle, shapes): (&[u32], &[Shape]),
    tolerance_m: f64,
) -> Vec<Option<DVec3>> {
    // The shapes at each vertex: regions, and flat triangles at the border of a region.
    let mut around: Vec<(u32, u32)> = Vec::new();
    let mut in_region = vec![false; positions.len()];
    for (triangle, corners) in triangles.iter().enumerate() {
        let region = of_triangle[triangle];
        for &vertex in corners {
            if region != NONE {
                in_region[vertex as usize] = true;
                around.push((vertex, region));
            } else if !facets.is_rough[triangle] {
                around.push((vertex, (shapes.len() + triangle) as u32));
            }
        }
    }
    around.retain(|(vertex, _)| in_region[*vertex as usize]);
    around.sort_unstable();
    around.dedup();
    let shape_of = |index: u32| match shapes.get(index as usize) {
        Some(shape) => *shape,
        None => {
            let triangle = index as usize - shapes.len();
            let normal = facets.normals[triangle];
            Shape::Flat(Plane {
                normal,
                offset_m: normal.dot(facets.corners[triangle][0]),
            })
        }
    };
    let mut moved = vec![None; positions.len()];
    for group in around.chunk_by(|a, b| a.0 == b.0) {
        let vertex = group[0].0 as usize;
        let from = positions[vertex];
        let mut kept: Vec<(Plane, Shape)> = Vec::new();
        for (_, index) in group {
            let shape = shape_of(*index);
            let plane = shape.plane(from);
            let is_same =
                |(other, _): &(Plane, Shape)| other.normal.dot(plane.normal).abs() > SAME_COSINE;
            if !kept.iter().any(is_same) {
                kept.push((plane, shape));
            }
        }
        let is_round = kept
            .iter()
            .any(|(_, shape)| matches!(shape, Shape::Round(_)));
        let mut to = from;
        for _ in 0..if is_round { ROUND_STEPS } else { 1 } {
            let planes: Vec<Plane> = kept.iter().map(|(_, shape)| shape.plane(to)).collect();
            to = nearest(to, &planes);
        }
        if to.distance(from) <= MOST_TOLERANCES * tolerance_m {
            moved[vertex] = Some(to);
        }
    }
    moved
}

/// The point of least squared distances from planes, nearest to a point.
fn nearest(from: DVec3, planes: &[Plane]) -> DVec3 {
    if let [plane] = planes {
        return from - plane.distance_m(from) * plane.normal;
    }
    let mut to = from;
    // The second step removes what the first one's own weight has left.
    for _ in 0..2 {
        let mut system = DMat3::from_diagonal(DVec3::splat(STAY));
        let mut right = DVec3::ZERO;
        for plane in planes {
            let n = plane.normal;
            system += DMat3::from_cols(n * n.x, n * n.y, n * n.z);
            right -= plane.distance_m(to) * n;
        }
        to += system.inverse() * right;
    }
    to
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_goes_to_the_line_and_the_corner_of_planes() {
        let plane = |normal: DVec3, offset_m: f64| Plane { normal, offset_m };
        let from = DVec3::new(0.01, -0.02, 3.0);
        let planes = [plane(DVec3::X, 0.0), plane(DVec3::Y, 0.0)];
        assert!(nearest(from, &planes).distance(DVec3::new(0.0, 0.0, 3.0)) < 1e-9);
        let slanted = DVec3::new(0.2, 0.0, 1.0).normalize();
        let corner = nearest(from, &[planes[0], planes[1], plane(slanted, 2.9)]);
        assert!((slanted.dot(corner) - 2.9).abs() < 1e-9 && corner.x.abs() < 1e-9);
    }
}
