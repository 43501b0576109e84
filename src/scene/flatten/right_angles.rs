//! Planes that are parallel or perpendicular as far as their noise can tell become so exactly.
//!
//! Reflections in perpendicular planes commute, and parallel walls of one distance are one surface. From the largest region
//! down, each normal is turned by at most its own uncertainty.

use glam::DVec3;

use super::plane_fit::Plane;
use super::regions::{Region, Regions};

/// Turn of a normal in standard errors of its fit, and at most in radians: a degree.
const ERRORS: f64 = 4.0;
const MOST_RAD: f64 = 0.0175;

/// Directions kept: those of the largest regions.
const MOST_DIRECTIONS: usize = 64;

/// The regions' planes with exact right angles.
pub(super) fn regularised(regions: &Regions) -> Vec<Plane> {
    let mut planes = regions.planes();
    let mut order: Vec<usize> = (0..planes.len()).collect();
    let area = |r: usize| regions.regions[r].moments.area_m2;
    order.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
    let mut directions: Vec<(DVec3, f64)> = Vec::new();
    for index in order {
        let region = &regions.regions[index];
        let error = uncertainty(region);
        let normal = turned(planes[index].normal, error, &directions);
        planes[index] = Plane {
            normal,
            offset_m: normal.dot(region.moments.middle()),
        };
        let is_new = |(known, _): &(DVec3, f64)| known.dot(normal).abs() < 1.0 - 1e-12;
        if directions.len() < MOST_DIRECTIONS && directions.iter().all(is_new) {
            directions.push((normal, error));
        }
    }
    planes
}

/// Standard error of a normal in radians.
fn uncertainty(region: &Region) -> f64 {
    // About half as many independent corners as triangles.
    let corners = (0.5 * region.triangles as f64).max(1.0);
    region.fit.sigma_m / (region.fit.extent_m[0].max(1e-6) * corners.sqrt())
}

/// A normal that is parallel to a known direction, or perpendicular to one or two, if it is nearly so.
fn turned(normal: DVec3, error: f64, directions: &[(DVec3, f64)]) -> DVec3 {
    let reach = |other: f64| (ERRORS * (error + other)).min(MOST_RAD);
    for (known, other) in directions {
        if known.cross(normal).length() < reach(*other) {
            return *known * 1f64.copysign(known.dot(normal));
        }
    }
    let mut turned = normal;
    let mut first: Option<DVec3> = None;
    for (known, other) in directions {
        let is_right = known.dot(normal).abs() < reach(*other);
        let is_free = first.is_none_or(|first| first.dot(*known).abs() < 1e-9);
        if !(is_right && is_free) {
            continue;
        }
        turned = (turned - turned.dot(*known) * *known).normalize_or(turned);
        if first.is_some() {
            break;
        }
        first = Some(*known);
    }
    turned
}
