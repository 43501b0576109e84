//! Planes of least squares through triangles, and whether what they leave is curvature.

use glam::{DMat3, DVec3};

/// A plane: `normal · p = offset_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plane {
    pub(super) normal: DVec3,
    pub(super) offset_m: f64,
}

impl Plane {
    pub(super) fn distance_m(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset_m
    }
}

/// Sums over the corners of triangles, each with a third of its triangle's area as weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments {
    pub(super) area_m2: f64,
    first: DVec3,
    second: DMat3,
}

/// A fitted plane and the standard deviation of the corners from it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    pub(super) plane: Plane,
    pub(super) sigma_m: f64,
    /// Standard deviations of the corners along the plane's two main directions, the lesser one first.
    pub(super) extent_m: [f64; 2],
}

impl Moments {
    pub(super) const NONE: Self = Self {
        area_m2: 0.0,
        first: DVec3::ZERO,
        second: DMat3::ZERO,
    };

    pub(super) fn add(&mut self, corners: &[DVec3; 3], area_m2: f64) {
        let weight = area_m2 / 3.0;
        self.area_m2 += area_m2;
        for corner in corners {
            self.first += weight * *corner;
            self.second += weight * outer(*corner);
        }
    }

    pub(super) fn join(&self, other: &Self) -> Self {
        Self {
            area_m2: self.area_m2 + other.area_m2,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }

    pub(super) fn middle(&self) -> DVec3 {
        self.first / self.area_m2
    }

    /// The covariance of the corners.
    fn covariance(&self) -> DMat3 {
        let middle = self.middle();
        self.second * (1.0 / self.area_m2) - outer(middle)
    }

    /// Mean square distance of the corners from a plane.
    pub(super) fn variance_about(&self, plane: Plane) -> f64 {
        let off_m = plane.distance_m(self.middle());
        let spread = plane.normal.dot(self.covariance() * plane.normal);
        (spread + off_m * off_m).max(0.0)
    }

    /// The plane of least squares.
    pub(super) fn fit(&self) -> Fit {
        let (values, vectors) = eigen(self.covariance());
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let normal = vectors.col(order[0]).normalize();
        let deviation = |index: usize| values[order[index]].max(0.0).sqrt();
        Fit {
            plane: Plane {
                normal,
                offset_m: normal.dot(self.middle()),
            },
            sigma_m: deviation(0),
            extent_m: [deviation(1), deviation(2)],
        }
    }
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix, by Jacobi's rotations.
fn eigen(mut a: DMat3) -> (DVec3, DMat3) {
    let mut vectors = DMat3::IDENTITY;
    for _ in 0..16 {
        let off = [(0, 1), (0, 2), (1, 2)];
        let largest = off
            .into_iter()
            .max_by(|p, q| a.col(p.1)[p.0].abs().total_cmp(&a.col(q.1)[q.0].abs()))
            .unwrap_or((0, 1));
        let (p, q) = largest;
        let value = a.col(q)[p];
        if value.abs() <= 1e-18 * (a.col(p)[p].abs() + a.col(q)[q].abs()) {
            break;
        }
        let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * value);
        let t = 1f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
        let c = 1.0 / (t * t + 1.0).sqrt();
        let s = t * c;
        let mut rotation = DMat3::IDENTITY;
        rotation.col_mut(p)[p] = c;
        rotation.col_mut(q)[q] = c;
        rotation.col_mut(q)[p] = s;
        rotation.col_mut(p)[q] = -s;
        a = rotation.transpose() * a * rotation;
        vectors *= rotation;
    }
    let values = DVec3::new(a.col(0).x, a.col(1).y, a.col(2).z);
    (values, vectors)
}

/// Coefficients of a polynomial of third order in two variables.
pub(super) const TERMS: usize = 10;

/// Share of the squared distances from a plane that a surface of third order explains, 0 to 1: near 1 for a curved surface,
/// a few hundredths for noise.
pub(super) fn curved_share(
    points: impl Iterator<Item = (DVec3, f64)>,
    fit: &Fit,
    middle: DVec3,
) -> f64 {
    let u = fit.plane.normal.any_orthonormal_vector();
    let v = fit.plane.normal.cross(u);
    let scale = 1.0 / fit.extent_m[1].max(1e-9);
    let (mut system, mut right) = ([[0.0; TERMS]; TERMS], [0.0; TERMS]);
    let mut squares = 0.0;
    for (point, weight) in points {
        let out = (point - middle) * scale;
        let (x, y) = (out.dot(u), out.dot(v));
        let height = out.dot(fit.plane.normal);
        let (xx, xy, yy) = (x * x, x * y, y * y);
        let cubic = [xx * x, xx * y, x * yy, yy * y];
        let [a, b, c, d] = cubic;
        let terms = [1.0, x, y, xx, xy, yy, a, b, c, d];
        for row in 0..TERMS {
            for (column, term) in terms.iter().enumerate() {
                system[row][column] += weight * terms[row] * term;
            }
            right[row] += weight * terms[row] * height;
        }
        squares += weight * height * height;
    }
    let Some(solution) = solve(system, right) else {
        return 0.0;
    };
    let explained: f64 = solution.iter().zip(right).map(|(x, b)| x * b).sum();
    explained / squares.max(1e-300)
}

/// Gauss' elimination with pivots.
pub(super) fn solve<const N: usize>(mut a: [[f64; N]; N], mut right: [f64; N]) -> Option<[f64; N]> {
    for step in 0..N {
        let pivot = (step..N).max_by(|&p, &q| a[p][step].abs().total_cmp(&a[q][step].abs()))?;
        a.swap(step, pivot);
        right.swap(step, pivot);
        if a[step][step].abs() < 1e-12 {
            return None;
        }
        for row in step + 1..N {
            let factor = a[row][step] / a[step][step];
            for column in step..N {
                a[row][column] -= factor * a[step][column];
            }
            right[row] -= factor * right[step];
        }
    }
    let mut x = [0.0; N];
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|column| a[row][column] * x[column]).sum();
        x[row] = (right[row] - known) / a[row][row];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles a metre: heights by a function of the position.
    fn sheet(height: impl Fn(f64, f64) -> f64) -> Vec<[DVec3; 3]> {
        let at = |i: u32, j: u32| {
            let (x, y) = (f64::from(i) * 0.1, f64::from(j) * 0.1);
            DVec3::new(3.0 + x, 5.0 + y, height(x, y) + 0.25 * x - 0.5 * y)
        };
        let mut triangles = Vec::new();
        for i in 0..20 {
            for j in 0..20 {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        triangles
    }

    fn moments(triangles: &[[DVec3; 3]]) -> Moments {
        let mut moments = Moments::NONE;
        for corners in triangles {
            moments.add(corners, 0.005);
        }
        moments
    }

    #[test]
    fn a_tilted_plane_is_found_again() {
        let fit = moments(&sheet(|_, _| 0.0)).fit();
        let normal = DVec3::new(-0.25, 0.5, 1.0).normalize();
        assert!(fit.plane.normal.dot(normal).abs() > 1.0 - 1e-12);
        assert!(fit.sigma_m < 1e-6 && fit.extent_m[0] > 0.5, "{fit:?}");
    }

    #[test]
    fn a_bowl_is_curved_and_noise_is_not() {
        let share = |height: &dyn Fn(f64, f64) -> f64| {
            let triangles = sheet(height);
            let moments = moments(&triangles);
            let points = triangles.iter().flatten().map(|p| (*p, 1.0));
            curved_share(points, &moments.fit(), moments.middle())
        };
        assert!(share(&|x, y| 0.01 * ((x - 1.0).powi(2) + y * x)) > 0.95);
        let noise = |x: f64, y: f64| 0.01 * (1e3 * (x + 31.0 * y)).sin();
        assert!(share(&noise) < 0.1);
    }
}
