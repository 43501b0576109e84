//! Spreading of a wave that a curved surface reflects, by band.
//!
//! By the method of stationary phase, as geometrical optics has it \[DESCHAMPS72\]: the amplitude is cos θ / (s l √|det H|), where s and l are the lengths before
//! and after the reflection and H the curvature of the path's length over the surface, with the surface's two principal
//! curvatures in it. In a plane it is 1 / (s + l). At a caustic an eigenvalue of H vanishes; the part of the surface that then
//! acts in phase ends where the surface does, or where higher terms of the length turn the phase by a radian. That bounds the
//! amplitude. The phase advance of a wave behind a caustic is left out.

use std::f64::consts::PI;

use glam::DVec3;

use crate::acoustics::{BANDS, BandArray};
use crate::geometry::angle::{atan2, sin_cos};
use crate::scene::surface::curved::{CurvedShape, CurvedSurface};

/// Displacement for the higher derivatives of the length, relative to the shortest of radius and both lengths.
const DISPLACED: f64 = 0.1;

/// A reflection at a point of a curved surface, between a source and a listener (or their images), local coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct CurvedPoint<'a> {
    pub(super) surface: &'a CurvedSurface,
    pub(super) point: DVec3,
    /// Unit normal on the air's side.
    pub(super) normal: DVec3,
    pub(super) from: DVec3,
    pub(super) to: DVec3,
}

impl CurvedPoint<'_> {
    /// Cosine of the angle of incidence.
    pub(super) fn cosine(&self) -> f64 {
        (self.from - self.point)
            .normalize_or_zero()
            .dot(self.normal)
    }

    /// Amplitude by band relative to the free field at 1 m, without absorption.
    pub(super) fn amplitude(&self, wavenumbers: &[f64; BANDS]) -> BandArray {
        let CurvedSurface { shape, half_m, .. } = self.surface;
        let [before_m, after_m] = [self.from, self.to].map(|end| end.distance(self.point));
        let cosine = self.cosine();
        let ray = (self.point - self.from) / before_m;
        let across = ray - ray.dot(self.normal) * self.normal;
        let along = across
            .try_normalize()
            .unwrap_or(self.normal.any_orthonormal_vector());
        let basis = [along, self.normal.cross(along)];
        // Convex towards the air: positive.
        let outward = shape.normal(self.point);
        let curvature = self.normal.dot(outward).signum() / shape.radius_m;
        // The direction in which the surface is curved; a sphere is in both.
        let around = shape.axis.map(|axis| axis.cross(outward));
        let curved = |a: DVec3, b: DVec3| match around {
            Some(around) => curvature * around.dot(a) * around.dot(b),
            None => curvature * a.dot(b),
        };
        let spherical = 1.0 / before_m + 1.0 / after_m;
        let [a, b] = basis;
        let h11 = cosine * cosine * spherical + 2.0 * cosine * curved(a, a);
        let h12 = 2.0 * cosine * curved(a, b);
        let h22 = spherical + 2.0 * cosine * curved(b, b);
        let (mean, half) = (0.5 * (h11 + h22), 0.5 * (h11 - h22));
        let apart = half.hypot(h12);
        let (sin, cos) = sin_cos(0.5 * atan2(h12, half));
        let principal = [
            (mean + apart, cos * a + sin * b),
            (mean - apart, cos * b - sin * a),
        ];
        let least_m = before_m.min(after_m).min(shape.radius_m);
        let step_m = DISPLACED * least_m;
        let terms = principal.map(|(second, direction)| {
            let length = |t: f64| {
                let at = displaced(shape, self.point, direction, t * step_m);
                at.distance(self.from) + at.distance(self.to)
            };
            let [far, near, here, next, last] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(length);
            let third = (last - 2.0 * next + 2.0 * near - far) / (2.0 * step_m.powi(3));
            let fourth = (last - 4.0 * next + 6.0 * here - 4.0 * near + far) / step_m.powi(4);
            // The surface's extent in this direction; what lies behind the horizon does not act.
            let share = around.map_or(1.0, |around| around.dot(direction).powi(2));
            let round_m = half_m[0].min(0.5 * PI * shape.radius_m);
            let reach_m = (share / round_m.powi(2) + (1.0 - share) / half_m[1].powi(2)).sqrt();
            (second, third, fourth, 1.0 / reach_m)
        });
        wavenumbers.map(|k| {
            let spread = terms.map(|(second, third, fourth, reach_m)| {
                let bound = active_bound(k, [third, fourth], reach_m);
                (second * second + bound * bound).powf(-0.25)
            });
            (cosine / (before_m * after_m) * spread[0] * spread[1]) as f32
        })
    }
}

/// The least curvature of a path's length over a surface that acts at a wavenumber: of the integral over the part in phase,
/// which takes the Fresnel zone's place near a caustic. The part ends with the surface, or where the third or fourth derivative
/// of the length turns the phase by a radian.
pub(super) fn active_bound(k: f64, [third, fourth]: [f64; 2], reach_m: f64) -> f64 {
    let cubic_m = (6.0 / (k * third.abs()).max(1e-12)).cbrt();
    let quartic_m = (24.0 / (k * fourth.abs()).max(1e-12)).sqrt().sqrt();
    let active_m = reach_m.min(cubic_m).min(quartic_m);
    0.5 * PI / (k * active_m * active_m)
}

/// The point of a shape at a distance along the surface in a tangential direction.
fn displaced(shape: &CurvedShape, point: DVec3, direction: DVec3, by_m: f64) -> DVec3 {
    let radial = shape.radial(point);
    let base = point - radial;
    let along = shape
        .axis
        .map_or(DVec3::ZERO, |axis| direction.dot(axis) * axis);
    let around = direction - along;
    let (sin, cos) = sin_cos(around.length() * by_m / shape.radius_m);
    base + along * by_m + radial * cos + around.normalize_or_zero() * (sin * shape.radius_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sphere(radius_m: f64) -> CurvedSurface {
        CurvedSurface {
            key: 0,
            shape: CurvedShape {
                centre: DVec3::ZERO,
                axis: None,
                radius_m,
            },
            towards: DVec3::X,
            half_m: [radius_m; 2],
            area_m2: 1.0,
            facet_m: 0.1,
            unevenness_m: 0.0,
        }
    }

    fn on_axis(surface: &CurvedSurface, from_m: f64, to_m: f64, side: f64) -> BandArray {
        let point = DVec3::X * surface.shape.radius_m;
        let at = CurvedPoint {
            surface,
            point,
            normal: side * DVec3::X,
            from: point + side * from_m * DVec3::X,
            to: point + side * to_m * DVec3::X,
        };
        at.amplitude(&[1e4; BANDS])
    }

    #[test]
    fn a_sphere_spreads_as_its_mirror_equation_says() {
        let surface = sphere(4.0);
        for (from_m, to_m) in [(1.0, 1.5), (3.0, 1.0), (6.0, 7.0)] {
            // Image distance b by 1/a + 1/b = ±2/R, spreading b / (a (l ± b)) for both directions alike.
            for side in [1.0, -1.0] {
                let image_m: f64 = 1.0 / (1.0 / from_m + side * 2.0 / 4.0);
                let expected = (image_m / (from_m * (to_m + image_m))).abs();
                let found = f64::from(on_axis(&surface, from_m, to_m, side)[0]);
                assert!(
                    (found / expected - 1.0).abs() < 1e-3,
                    "{from_m} {to_m} {side}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn the_focus_of_a_dome_is_finite() {
        // Source and listener in the centre: the whole hemisphere acts in phase, area / (λ R²) = 2π / λ.
        let surface = CurvedSurface {
            towards: DVec3::X,
            half_m: [0.5 * PI * 4.0; 2],
            ..sphere(4.0)
        };
        let point = DVec3::X * 4.0;
        let at = CurvedPoint {
            surface: &surface,
            point,
            normal: DVec3::NEG_X,
            from: DVec3::ZERO,
            to: DVec3::ZERO,
        };
        let k = 18.3;
        let found = f64::from(at.amplitude(&[k; BANDS])[0]);
        // A square instead of a circle of the same half-width: within 4 dB.
        let level_db = 20.0 * (found / k).log10();
        assert!(level_db.abs() < 4.0, "{level_db}");
    }
}
