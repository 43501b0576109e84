//! Spheres and cylinders of least squares through points, in a form that a plane is a case of.
//!
//! A shape is a point of it, its normal there and its curvature, not a centre and a radius: a patch whose curvature noise hides
//! has a bounded solution too. Distances and their derivatives as in \[MARSHALL01\], solved by Gauss and Newton's method.

use glam::{DMat3, DQuat, DVec3};

use super::plane_fit::{Fit, Plane, solve};

/// Unknowns of a step: offset along the normal, tilt about two tangents, curvature, turn of the axis about the normal.
const UNKNOWNS: usize = 5;

/// Weight that holds an unknown which no point decides, relative to that of the points.
const HOLD: f64 = 1e-9;

/// Largest angle in radians, and largest bend over the points' extent, that one step changes.
const MOST_STEP: f64 = 0.3;

/// Steps of a fit, and the change of distances in metres at which it ends.
const STEPS: usize = 12;
const SETTLED_M: f64 = 1e-7;

/// A sphere, or a cylinder where it has an axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Round {
    /// A point of it.
    at: DVec3,
    /// Unit normal at that point.
    normal: DVec3,
    /// Unit vector along a cylinder's axis.
    axis: Option<DVec3>,
    /// Its inverse is the distance of the centre from [`Self::at`] against the normal.
    pub(super) curvature_per_m: f64,
}

/// A point and its weight.
pub(super) type Weighted = (DVec3, f64);

impl Round {
    /// A sphere and a cylinder through points about a plane: of their least squared heights by a polynomial of second order.
    pub(super) fn near_plane(points: &[Weighted], fit: &Fit, middle: DVec3) -> Option<[Self; 2]> {
        let normal = fit.plane.normal;
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        let scale_m = fit.extent_m[1].max(1e-9);
        let (mut system, mut right) = ([[0.0; 6]; 6], [0.0; 6]);
        for &(point, weight) in points {
            let out = (point - middle) / scale_m;
            let (x, y) = (out.dot(u), out.dot(v));
            let terms = [1.0, x, y, x * x, x * y, y * y];
            for row in 0..6 {
                for column in 0..6 {
                    system[row][column] += weight * terms[row] * terms[column];
                }
                right[row] += weight * terms[row] * out.dot(normal);
            }
        }
        let [height, _, _, xx, xy, yy] = solve(system, right)?;
        // Principal curvatures, the one of greater magnitude first.
        let (mean, half) = (xx + yy, xx - yy);
        let apart = half.hypot(xy);
        let (turn, curvatures) = match mean >= 0.0 {
            true => (0.5 * xy.atan2(half), [mean + apart, mean - apart]),
            false => (0.5 * (-xy).atan2(-half), [mean - apart, mean + apart]),
        };
        let (sin, cos) = turn.sin_cos();
        let sphere = Self {
            at: middle + height * scale_m * normal,
            normal,
            axis: None,
            curvature_per_m: -0.5 * (curvatures[0] + curvatures[1]) / scale_m,
        };
        let cylinder = Self {
            axis: Some(cos * v - sin * u),
            curvature_per_m: -curvatures[0] / scale_m,
            ..sphere
        };
        Some([sphere, cylinder])
    }

    pub(super) fn is_sphere(&self) -> bool {
        self.axis.is_none()
    }

    /// Whether a vector is along a cylinder's axis, by the least cosine of the angle between both.
    pub(super) fn is_along(&self, vector: DVec3, cosine: f64) -> bool {
        let axis = self.axis.unwrap_or(DVec3::ZERO);
        vector.dot(axis).abs() > cosine * vector.length()
    }

    /// The vector to a point from [`Self::at`], across the axis.
    fn across(&self, point: DVec3) -> DVec3 {
        let out = point - self.at;
        match self.axis {
            Some(axis) => out - out.dot(axis) * axis,
            None => out,
        }
    }

    /// Distance of a point in metres, positive on the normal's side, and the square root that both it and the normal need.
    fn distance_and_root(&self, across: DVec3) -> (f64, f64) {
        let bent = self.curvature_per_m * across.length_squared() + 2.0 * across.dot(self.normal);
        let root = (1.0 + self.curvature_per_m * bent).max(0.0).sqrt();
        (bent / (1.0 + root), root)
    }

    pub(super) fn distance_m(&self, point: DVec3) -> f64 {
        self.distance_and_root(self.across(point)).0
    }

    /// Unit normal of the shape nearest to a point.
    pub(super) fn normal(&self, point: DVec3) -> DVec3 {
        (self.curvature_per_m * self.across(point) + self.normal).normalize_or(self.normal)
    }

    /// The tangential plane nearest to a point.
    pub(super) fn tangent(&self, point: DVec3) -> Plane {
        let normal = self.normal(point);
        Plane {
            normal,
            offset_m: normal.dot(point) - self.distance_m(point),
        }
    }

    /// The shape of least squared distances near this one, and their standard deviation in metres.
    pub(super) fn fitted(mut self, points: &[Weighted]) -> (Self, f64) {
        let mut best = (self, f64::INFINITY);
        for _ in 0..STEPS {
            let (step, deviation_m, extent_m) = self.step(points);
            // Behind the least deviation a step has gone too far.
            let gained_m = best.1 - deviation_m;
            if gained_m > 0.0 {
                best = (self, deviation_m);
            }
            let Some(step) = step else { break };
            if gained_m < SETTLED_M {
                break;
            }
            self.apply(step, extent_m);
        }
        best
    }

    /// A step towards the least squared distances, the standard deviation of the distances, and the points' extent.
    fn step(&self, points: &[Weighted]) -> (Option<[f64; UNKNOWNS]>, f64, f64) {
        let tangents = self.tangents();
        let (mut system, mut right) = ([[0.0; UNKNOWNS]; UNKNOWNS], [0.0; UNKNOWNS]);
        let (mut weights, mut squares, mut extent) = (0.0, 0.0, 0.0);
        for &(point, weight) in points {
            let out = point - self.at;
            let across = self.across(point);
            let (distance_m, root) = self.distance_and_root(across);
            let normal = self.normal(point);
            let height_m = across.dot(self.normal);
            let turned = |about: DVec3| -normal.dot(about.cross(out));
            let slopes = [
                -normal.dot(self.normal),
                turned(tangents[0]),
                turned(tangents[1]),
                (across.length_squared() - height_m * distance_m) / (1.0 + root),
                self.axis.map_or(0.0, |_| turned(self.normal)),
            ];
            for row in 0..UNKNOWNS {
                for column in 0..UNKNOWNS {
                    system[row][column] += weight * slopes[row] * slopes[column];
                }
                right[row] -= weight * slopes[row] * distance_m;
            }
            weights += weight;
            squares += weight * distance_m * distance_m;
            extent += weight * out.length_squared();
        }
        let extent = extent / weights.max(1e-300);
        let scales = [1.0, extent, extent, extent * extent, extent];
        for (index, scale) in scales.into_iter().enumerate() {
            system[index][index] += HOLD * weights * scale;
        }
        let deviation_m = (squares / weights.max(1e-300)).sqrt();
        (solve(system, right), deviation_m, extent.sqrt())
    }

    fn tangents(&self) -> [DVec3; 2] {
        let u = self
            .axis
            .unwrap_or_else(|| self.normal.any_orthonormal_vector());
        [u, self.normal.cross(u)]
    }

    fn apply(&mut self, [offset_m, tilt, other, bend, turn]: [f64; UNKNOWNS], extent_m: f64) {
        let [u, v] = self.tangents();
        let about = tilt * u + other * v + turn * self.normal;
        let largest = about.length().max(bend.abs() * extent_m);
        let part = (MOST_STEP / largest.max(1e-300)).min(1.0);
        self.at += part * offset_m * self.normal;
        self.curvature_per_m += part * bend;
        let rotation = DMat3::from_quat(DQuat::from_scaled_axis(part * about));
        self.normal = (rotation * self.normal).normalize();
        self.axis = self.axis.map(|axis| {
            let axis = rotation * axis;
            (axis - axis.dot(self.normal) * self.normal).normalize()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::plane_fit::Moments;
    use super::*;

    /// Triangles of a patch in cells of ten centimetres.
    fn patch(at: impl Fn(f64, f64) -> DVec3) -> Vec<[DVec3; 3]> {
        let at = |i: u32, j: u32| at(0.1 * f64::from(i), 0.1 * f64::from(j));
        let mut triangles = Vec::new();
        for i in 0..8 {
            for j in 0..8 {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        triangles
    }

    fn fits(triangles: &[[DVec3; 3]]) -> [(Round, f64); 2] {
        let mut moments = Moments::NONE;
        triangles.iter().for_each(|t| moments.add(t, 0.005));
        let points: Vec<Weighted> = triangles.iter().flatten().map(|p| (*p, 0.005)).collect();
        let near = Round::near_plane(&points, &moments.fit(), moments.middle());
        near.expect("a patch").map(|shape| shape.fitted(&points))
    }

    #[test]
    fn a_sphere_and_a_cylinder_are_found_from_patches() {
        let sphere = patch(|a, b| {
            let (a, b) = (a / 2.0, b / 2.0);
            let out = DVec3::new(a.sin() * b.cos(), b.sin(), a.cos() * b.cos());
            DVec3::new(3.0, -2.0, 7.0) + 2.0 * out
        });
        let [(shape, deviation_m), (_, other_m)] = fits(&sphere);
        assert!(
            deviation_m < 1e-6 && other_m > 1e-3,
            "{deviation_m} {other_m}"
        );
        assert!((shape.curvature_per_m.abs() - 0.5).abs() < 1e-6);
        let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
        let (x, y) = axis.any_orthonormal_pair();
        let cylinder = patch(|a, b| 3.0 * ((a / 3.0).cos() * x + (a / 3.0).sin() * y) + b * axis);
        let [_, (shape, deviation_m)] = fits(&cylinder);
        assert!(deviation_m < 1e-6, "{deviation_m}");
        assert!((shape.curvature_per_m.abs() - 1.0 / 3.0).abs() < 1e-6);
        assert!(shape.axis.is_some_and(|a| a.dot(axis).abs() > 1.0 - 1e-9));
        let aside = 3.2 * x + 0.4 * axis;
        assert!((shape.distance_m(aside).abs() - 0.2).abs() < 1e-6);
        assert!(shape.tangent(aside).distance_m(3.0 * x).abs() < 1e-6);
    }

    #[test]
    fn a_plane_has_no_curvature() {
        for (shape, deviation_m) in fits(&patch(|a, b| DVec3::new(a, b, 0.3 * a))) {
            assert!(deviation_m < 1e-9 && shape.curvature_per_m.abs() < 1e-6);
        }
    }
}
