//! Watertight ray-triangle intersection.
//!
//! Source: [WOOP13], literal: the ray is sheared onto +z, so two triangles that share an edge compute the same edge
//! function up to its sign, and a ray cannot slip between them. Where an edge function is exactly zero it is computed
//! again in `f64`. Both faces count.

use glam::Vec3;

use super::ray::Ray;

/// What of a ray does not depend on the triangle: axis permutation and shear.
#[derive(Debug, Clone, Copy)]
pub struct ShearedRay {
    axis: [usize; 3],
    shear: [f32; 3],
    origin: Vec3,
}

impl ShearedRay {
    /// Of a ray whose direction is finite and not zero.
    #[inline]
    pub fn of(ray: &Ray) -> Self {
        let d = ray.direction;
        let size = d.abs();
        let z = if size.x > size.y {
            if size.x > size.z { 0 } else { 2 }
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        Self {
            axis: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]],
            origin: ray.origin,
        }
    }

    /// Parameter of the intersection with a triangle, if it lies strictly between the bounds.
    #[inline]
    pub fn intersect(&self, corners: &[Vec3; 3], t_min: f32, t_max: f32) -> Option<f32> {
        let [kx, ky, kz] = self.axis;
        let [sx, sy, sz] = self.shear;
        let a = corners[0] - self.origin;
        let b = corners[1] - self.origin;
        let c = corners[2] - self.origin;
        let (ax, ay) = (a[kx] - sx * a[kz], a[ky] - sy * a[kz]);
        let (bx, by) = (b[kx] - sx * b[kz], b[ky] - sy * b[kz]);
        let (cx, cy) = (c[kx] - sx * c[kz], c[ky] - sy * c[kz]);
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        if u == 0.0 || v == 0.0 || w == 0.0 {
            let edge = |px: f32, py: f32, qx: f32, qy: f32| {
                (f64::from(px) * f64::from(qy) - f64::from(py) * f64::from(qx)) as f32
            };
            u = edge(cx, cy, bx, by);
            v = edge(ax, ay, cx, cy);
            w = edge(bx, by, ax, ay);
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let t = (u * (sz * a[kz]) + v * (sz * b[kz]) + w * (sz * c[kz])) / determinant;
        (t > t_min && t < t_max).then_some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_meets_a_triangle_where_it_should() {
        let corners = [
            Vec3::new(0.0, 0.0, 2.0),
            Vec3::new(1.0, 0.0, 2.0),
            Vec3::new(0.0, 1.0, 2.0),
        ];
        let ray = Ray::new(Vec3::new(0.2, 0.2, 0.0), Vec3::Z);
        let sheared = ShearedRay::of(&ray);
        assert_eq!(sheared.intersect(&corners, 0.0, 10.0), Some(2.0));
        assert_eq!(sheared.intersect(&corners, 0.0, 2.0), None);
        assert_eq!(sheared.intersect(&corners, 2.0, 10.0), None);
        let away = ShearedRay::of(&Ray::new(Vec3::new(0.9, 0.9, 0.0), Vec3::Z));
        assert_eq!(away.intersect(&corners, 0.0, 10.0), None);
    }
}
