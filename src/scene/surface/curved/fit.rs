//! Spheres and cylinders through the corners of facets, by least squares.

use glam::{DMat3, DVec3};

use crate::binary::{Reader, Stored, Writer};

/// Cosine of normals to an axis below which they are perpendicular to it: a degree.
const ACROSS: f64 = 0.0175;

/// Least sine of the angle between two normals that give an axis.
const LEAST_TURN: f64 = 3e-3;

/// Radii in metres: smaller ones are ornaments, larger ones flat.
const RADII_M: [f64; 2] = [0.1, 500.0];

/// Rows of the equations are independent if their determinant exceeds this relative to the trace's cube.
const INDEPENDENT: f64 = 1e-12;

/// A sphere, or a cylinder where it has an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvedShape {
    /// Its centre; of a cylinder the middle of its axis.
    pub centre: DVec3,
    /// Unit vector along the axis of a cylinder.
    pub axis: Option<DVec3>,
    /// Radius in metres.
    pub radius_m: f64,
}

impl CurvedShape {
    /// The vector to a point from the centre or from the nearest point of the axis.
    #[inline]
    pub fn radial(&self, point: DVec3) -> DVec3 {
        let out = point - self.centre;
        match self.axis {
            Some(axis) => out - out.dot(axis) * axis,
            None => out,
        }
    }

    /// Distance of a point from the shape in metres, positive outside.
    pub fn distance_m(&self, point: DVec3) -> f64 {
        self.radial(point).length() - self.radius_m
    }

    /// Unit normal outwards at a point.
    #[inline]
    pub fn normal(&self, point: DVec3) -> DVec3 {
        self.radial(point).normalize_or(DVec3::Y)
    }
}

impl Stored for CurvedShape {
    const LEAST_BYTES: usize = 2 * DVec3::LEAST_BYTES + f64::LEAST_BYTES;

    fn store(&self, to: &mut Writer) {
        self.centre.store(to);
        self.axis.unwrap_or(DVec3::ZERO).store(to);
        self.radius_m.store(to);
    }

    fn load(from: &mut Reader<'_>) -> Self {
        Self {
            centre: DVec3::load(from),
            axis: Some(DVec3::load(from)).filter(|axis| *axis != DVec3::ZERO),
            radius_m: f64::load(from),
        }
    }
}

/// The cylinder through corners of facets if their normals lie in one plane, otherwise the sphere. `areas` are the facets' normals,
/// as long as the facets are large.
pub(super) fn fit<I: Iterator<Item = DVec3>>(
    corners: impl Fn() -> I,
    areas: impl Iterator<Item = DVec3> + Clone,
) -> Option<CurvedShape> {
    let normals = areas.clone().map(DVec3::normalize_or_zero);
    let first = normals.clone().next()?;
    let turned = |n: &DVec3| first.cross(*n).length_squared();
    let other = normals
        .clone()
        .max_by(|a, b| turned(a).total_cmp(&turned(b)))?;
    let axis = first.cross(other);
    if axis.length() < LEAST_TURN {
        return None;
    }
    let axis = most_across(axis.normalize(), areas);
    let is_cylinder = normals.clone().all(|n| is_across(n, axis, 1.0));
    let axis = is_cylinder.then(|| canonical(axis));
    let across = |p: DVec3| match axis {
        Some(axis) => p - p.dot(axis) * axis,
        None => p,
    };
    let count = corners().count() as f64;
    let middle = corners().map(across).sum::<DVec3>() / count;
    let square = corners()
        .map(|p| (across(p) - middle).length_squared())
        .sum::<f64>()
        / count;
    // |q|² = 2 c·q + R² − |c|² for points q about the middle.
    let (mut matrix, mut vector) = (DMat3::ZERO, DVec3::ZERO);
    for corner in corners() {
        let q = across(corner) - middle;
        matrix += DMat3::from_cols(q * q.x, q * q.y, q * q.z);
        vector += 0.5 * (q.length_squared() - square) * q;
    }
    let trace = matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z;
    if let Some(axis) = axis {
        // Nothing is known along the axis.
        let along = axis * trace;
        matrix += DMat3::from_cols(along * axis.x, along * axis.y, along * axis.z);
    }
    if matrix.determinant().abs() <= INDEPENDENT * trace.powi(3) {
        return None;
    }
    let offset = matrix.inverse() * vector;
    let radius_m = (offset.length_squared() + square).sqrt();
    (RADII_M[0]..RADII_M[1])
        .contains(&radius_m)
        .then_some(CurvedShape {
            centre: middle + offset,
            axis,
            radius_m,
        })
}

/// The axis near another one to which all facets together are the most perpendicular, by least squares: the two that gave the other
/// one may be small facets of a neighbour.
fn most_across(near: DVec3, areas: impl Iterator<Item = DVec3>) -> DVec3 {
    let (mut matrix, mut vector) = (DMat3::ZERO, DVec3::ZERO);
    for area in areas {
        let along = area.dot(near);
        let across = area - along * near;
        matrix += DMat3::from_cols(across * across.x, across * across.y, across * across.z);
        vector += along * across;
    }
    // Nothing is known along the axis.
    let along = near * (matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z);
    matrix += DMat3::from_cols(along * near.x, along * near.y, along * near.z);
    let turned = near - matrix.inverse() * vector;
    turned.try_normalize().unwrap_or(near)
}

/// Whether a normal is perpendicular to an axis, within a part of the fit's tolerance.
pub(super) fn is_across(normal: DVec3, axis: DVec3, part: f64) -> bool {
    normal.dot(axis).abs() < part * ACROSS
}

/// An axis or its opposite: the first large component of y, x, z is positive.
fn canonical(axis: DVec3) -> DVec3 {
    let leading = [axis.y, axis.x, axis.z].into_iter().find(|c| c.abs() > 0.1);
    match leading.is_some_and(|component| component < 0.0) {
        true => -axis,
        false => axis,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_and_a_cylinder_are_found_from_a_part_of_them() {
        let centre = DVec3::new(3.0, -2.0, 7.0);
        let mut sphere = Vec::new();
        let mut cylinder = Vec::new();
        let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
        let (x, y) = axis.any_orthonormal_pair();
        for i in 0..6 {
            for j in 0..4 {
                let (a, b) = (0.1 * f64::from(i), 0.08 * f64::from(j));
                let out = DVec3::new(a.sin() * b.cos(), b.sin(), a.cos() * b.cos());
                sphere.push(centre + 5.0 * out);
                cylinder.push(centre + 3.0 * (a.cos() * x + a.sin() * y) + b * 10.0 * axis);
            }
        }
        let radial = |p: &DVec3| (*p - centre).normalize();
        let found = fit(|| sphere.iter().copied(), sphere.iter().map(radial)).expect("a sphere");
        assert!(found.axis.is_none() && (found.radius_m - 5.0).abs() < 1e-9);
        assert!(found.centre.distance(centre) < 1e-9);
        let across = |p: &DVec3| {
            let out = *p - centre;
            (out - out.dot(axis) * axis).normalize()
        };
        let normals = cylinder.iter().map(across);
        let found = fit(|| cylinder.iter().copied(), normals).expect("a cylinder");
        assert!(found.axis.is_some_and(|a| a.dot(axis).abs() > 1.0 - 1e-12));
        assert!((found.radius_m - 3.0).abs() < 1e-9);
        assert!(found.radial(centre).length() < 1e-9);
    }
}
