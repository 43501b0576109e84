//! Spreading of a wave that a sphere or cylinder reflects twice from inside, by band.
//!
//! Rays of a thin tube are followed by the mirror equation, in the plane of the path's projection and across it: the tube's
//! width per angle of departure, B, is s behind the source, and a mirror of focal length f turns its slope by -B/f, where f is
//! R cos θ / 2 in the plane of incidence and R / (2 cos θ) across (\[DESCHAMPS72\]). The amplitude is 1/√|B B'|. At caustics it is
//! bounded as after one reflection ([`super::spreading`]), with the path up to the other reflection as the incident wave.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::circle::Circle;
use super::spreading::active_bound;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::angle::{atan2, unit_vector};
use crate::scene::surface::curved::CurvedSurface;

/// Displacement for the higher derivatives of the length, relative to the shortest of radius and legs.
const DISPLACED: f64 = 0.1;

/// Amplitude by band relative to the free field at 1 m, without absorption.
pub(super) fn amplitude(
    surface: &CurvedSurface,
    [from, to]: [DVec3; 2],
    [first, last]: [DVec3; 2],
    wavenumbers: &[f64; BANDS],
) -> BandArray {
    let radius_m = surface.shape.radius_m;
    let length_m = from.distance(first) + first.distance(last) + last.distance(to);
    // Either reflection may limit the part in phase: the same path both ways.
    let ways = [
        Way::new(surface, [from, to], [first, last]),
        Way::new(surface, [to, from], [last, first]),
    ];
    let [there, _] = &ways;
    let rise = there.legs_m.iter().sum::<f64>() / length_m;
    let reach_m = surface.half_m[0].min(0.5 * PI * radius_m);
    let width_m = |tube: fn(&Way) -> &Tube, k: f64| {
        let bounds = ways.each_ref().map(|way| {
            let tube = tube(way);
            tube.bound_m(active_bound(k, tube.higher, reach_m))
        });
        tube(there).at_end_m.hypot(bounds[0].max(bounds[1]))
    };
    wavenumbers.map(|k| {
        let square = match surface.shape.axis {
            // The tube widens along a cylinder as it does in the open.
            Some(_) => width_m(|way| &way.in_plane, k * rise) * length_m / rise,
            None => width_m(|way| &way.in_plane, k) * width_m(|way| &way.aside, k),
        };
        square.max(f64::MIN_POSITIVE).sqrt().recip() as f32
    })
}

/// A path in one of both directions.
struct Way {
    /// Lengths in the plane of the path or its projection.
    legs_m: [f64; 3],
    in_plane: Tube,
    aside: Tube,
}

impl Way {
    fn new(surface: &CurvedSurface, [from, to]: [DVec3; 2], [first, last]: [DVec3; 2]) -> Self {
        let shape = &surface.shape;
        let across = |leg: DVec3| shape.axis.map_or(leg, |axis| leg - leg.dot(axis) * axis);
        let legs_m = [first - from, last - first, to - last].map(|leg| across(leg).length());
        let radius_m = shape.radius_m;
        // Of an isosceles triangle with the centre: the same at both reflections.
        let cosine = (0.5 * legs_m[1] / radius_m).clamp(1e-3, 1.0);
        let mut in_plane = Tube::behind(legs_m, 2.0 / (radius_m * cosine));
        let mut aside = Tube::behind(legs_m, 2.0 * cosine / radius_m);
        in_plane.per_curvature_m2 /= cosine.powi(2);
        let lengths = Lengths::new(surface, [from, to], [first, last]);
        let step_m = DISPLACED * legs_m.iter().copied().fold(radius_m, f64::min);
        in_plane.higher = higher(|t| lengths.along(t * step_m / radius_m), step_m);
        aside.higher = higher(|t| lengths.aside(t * step_m / radius_m), step_m);
        Self {
            legs_m,
            in_plane,
            aside,
        }
    }
}

/// A tube of rays: widths per angle of departure, in metres.
struct Tube {
    /// At the listener.
    at_end_m: f64,
    /// The same for a curvature of the length over the last reflection.
    per_curvature_m2: f64,
    /// Third and fourth derivative of that length.
    higher: [f64; 2],
}

impl Tube {
    /// After two reflections with lengths before, between and after them, at mirrors of a power in 1/m.
    fn behind([before_m, between_m, after_m]: [f64; 3], power: f64) -> Self {
        let slope = 1.0 - before_m * power;
        let at_last_m = before_m + between_m * slope;
        let slope = slope - at_last_m * power;
        Self {
            at_end_m: at_last_m + after_m * slope,
            per_curvature_m2: at_last_m * after_m,
            higher: [0.0; 2],
        }
    }

    /// Its least width at the listener where the curvature of the length has a bound.
    fn bound_m(&self, bound: f64) -> f64 {
        (self.per_curvature_m2 * bound).abs()
    }
}

/// The length of the stationary path as a function of the last reflection.
struct Lengths {
    radius_m: f64,
    /// Distances from the centre of source and listener, in the plane of the path or its projection.
    centre_m: [f64; 2],
    /// Angles from the source and from the listener to the last reflection, and from the source to the first.
    source: f64,
    listener: f64,
    first: f64,
}

impl Lengths {
    fn new(surface: &CurvedSurface, ends: [DVec3; 2], [first, last]: [DVec3; 2]) -> Self {
        let shape = &surface.shape;
        let [from, to] = ends.map(|end| shape.radial(end));
        let [first, x] = [first, last].map(|point| shape.normal(point));
        let aside = || {
            first
                .cross(x)
                .try_normalize()
                .or(from.cross(x).try_normalize())
        };
        let normal = shape.axis.or_else(aside);
        let y = normal.unwrap_or(x.any_orthonormal_vector()).cross(x);
        let angle = |radial: DVec3| atan2(radial.dot(y), radial.dot(x));
        let source = angle(from);
        Self {
            radius_m: shape.radius_m,
            centre_m: [from.length(), to.length()],
            source: -source,
            listener: angle(to),
            first: angle(first) - source,
        }
    }

    /// The last reflection moved within the plane by an angle.
    fn along(&self, by: f64) -> Option<f64> {
        self.length_m(self.source + by, self.listener - by)
    }

    /// The last reflection moved across the plane by an angle.
    fn aside(&self, by: f64) -> Option<f64> {
        // Of right-angled spherical triangles.
        let by = unit_vector(by).x;
        let moved = |angle: f64| (unit_vector(angle).x * by).clamp(-1.0, 1.0).acos();
        self.length_m(
            moved(self.source).copysign(self.source),
            moved(self.listener),
        )
    }

    fn length_m(&self, source: f64, listener: f64) -> Option<f64> {
        let last = self.radius_m * unit_vector(source);
        let circle = Circle {
            radius_m: self.radius_m,
            from: DVec2::new(self.centre_m[0], 0.0),
            to: last,
            is_twice: false,
        };
        let first = circle.near(self.first + source - self.source)?;
        let first = self.radius_m * unit_vector(first);
        let to = self.centre_m[1] * unit_vector(source + listener);
        Some(circle.from.distance(first) + first.distance(last) + last.distance(to))
    }
}

/// Third and fourth derivative of a length along the surface by differences; none next to the focus of the first reflection.
fn higher(length_m: impl Fn(f64) -> Option<f64>, step_m: f64) -> [f64; 2] {
    let [far, near, here, next, last] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(length_m);
    let derivatives = || {
        let (far, near, here, next, last) = (far?, near?, here?, next?, last?);
        Some([
            (last - 2.0 * next + 2.0 * near - far) / (2.0 * step_m.powi(3)),
            (last - 4.0 * next + 6.0 * here - 4.0 * near + far) / step_m.powi(4),
        ])
    };
    derivatives().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::rays::directions::{mix, unit};
    use crate::scene::surface::curved::CurvedShape;

    const RADIUS_M: f64 = 5.0;

    fn surface(axis: Option<DVec3>) -> CurvedSurface {
        CurvedSurface {
            key: 0,
            shape: CurvedShape {
                centre: DVec3::new(0.3, -0.2, 0.1),
                axis,
                radius_m: RADIUS_M,
            },
            towards: DVec3::X,
            half_m: [0.5 * PI * RADIUS_M, 100.0],
            area_m2: 1.0,
            facet_m: 0.1,
            unevenness_m: 0.0,
        }
    }

    /// Both reflections of a ray inside a shape, and its direction afterwards.
    fn traced(shape: &CurvedShape, from: DVec3, direction: DVec3) -> ([DVec3; 2], DVec3) {
        let (mut at, mut direction) = (from, direction);
        let points = [0, 1].map(|_| {
            let [radial, rise] = [shape.radial(at), shape.radial(shape.centre + direction)];
            let (a, b) = (rise.length_squared(), radial.dot(rise));
            let c = radial.length_squared() - shape.radius_m.powi(2);
            at += (-b + (b * b - a * c).max(0.0).sqrt()) / a * direction;
            let normal = shape.normal(at);
            direction -= 2.0 * direction.dot(normal) * normal;
            at
        });
        (points, direction)
    }

    #[test]
    fn a_tube_of_traced_rays_has_the_same_width() {
        // High in frequency: the bound at caustics does not act, but where a tube is narrow.
        let wavenumbers = [1e7; BANDS];
        let mut most_db = 0.0f64;
        for axis in [None, Some(DVec3::new(0.48, 0.6, 0.64))] {
            let surface = surface(axis);
            let mut compared = 0;
            for number in 0..400u64 {
                let random = |k: u64| f64::from(unit(mix(number << 3 | k))) * 2.0 - 1.0;
                let from = surface.shape.centre + 2.5 * DVec3::new(random(0), random(1), random(2));
                let ray = DVec3::new(random(3), random(4), random(5)).normalize();
                let (points, leaving) = traced(&surface.shape, from, ray);
                let to = points[1] + 4.0 * (1.2 + random(6)) * leaving;
                let legs = [points[0] - from, points[1] - points[0], to - points[1]];
                let [s, l, after_m] = legs.map(DVec3::length);
                let (u, v) = ray.any_orthonormal_pair();
                let apart = 1e-6;
                let end = |aside: DVec3| {
                    let (points, leaving) =
                        traced(&surface.shape, from, (ray + apart * aside).normalize());
                    let [a, b] = [points[0].distance(from), points[1].distance(points[0])];
                    points[1] + (s + l + after_m - a - b) * leaving
                };
                let [a, b] = [u, v].map(|aside| (end(aside) - end(-aside)) / (2.0 * apart));
                let area = a.cross(b).length();
                // Away from caustics, where differences and bounds are exact.
                if area < 0.5 {
                    continue;
                }
                compared += 1;
                let found = amplitude(&surface, [from, to], points, &wavenumbers)[0];
                let off_db = 20.0 * (f64::from(found) * area.sqrt()).log10();
                most_db = most_db.max(off_db.abs());
                assert!(
                    off_db.abs() < 0.05,
                    "{axis:?} {number}: {off_db} dB, {area}"
                );
            }
            assert!(compared > 300, "{compared}");
        }
        assert!(most_db > 0.0);
    }

    #[test]
    fn a_focus_is_finite() {
        // From near the centre back to it: the whole shape acts in phase, the same as after one reflection.
        let surface = surface(None);
        let centre = surface.shape.centre;
        let (points, _) = traced(&surface.shape, centre, DVec3::X);
        let k = 18.3;
        let found = f64::from(amplitude(&surface, [centre, centre], points, &[k; BANDS])[0]);
        let level_db = 20.0 * (found / k).log10();
        assert!(level_db.abs() < 4.0, "{level_db}");
    }
}
