//! Ways that bend once and are reflected before or after it, or both.
//!
//! The source is mirrored in a surface before the edge, the listener in one behind it ([`super`] has the rest). Only
//! asked for in shadow: elsewhere the direct path is louder than all of these.

use glam::DVec3;

use super::bent::{self, Course};
use super::direct::Spot;
use super::{LONGEST_DETOUR_M, WEAKEST, fade_out};
use crate::acoustics::BANDS;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::path::Path;
use crate::propagation::sequence::Stop;
use crate::scene::Scene;

/// Most paths of one source that bend once and are reflected.
pub const MOST_MIRRORED: usize = 12;

/// Surfaces tried as mirrors at either end.
const MIRRORS: usize = 6;

/// Of these, how many are tried at both ends at once.
const MIRRORS_AT_BOTH: usize = 3;

/// Edges tried for each pair of mirrors, shortest way first.
const EDGES: usize = 6;

/// A point seen directly or in a mirror.
#[derive(Clone, Copy)]
struct Seen {
    real: DVec3,
    /// Where it seems to be.
    image: DVec3,
    mirror: Option<u32>,
}

/// Gives the paths with one bend and one or two reflections, at most [`MOST_MIRRORED`].
pub fn find(scene: &Scene, spot: &Spot, rays: &mut u64, give: &mut impl FnMut(Path)) {
    let (from, to) = (scene.to_local(spot.from), scene.to_local(spot.to));
    let (before, after) = (mirrors(scene, from), mirrors(scene, to));
    let seen = |real: DVec3, mirror: Option<u32>| Seen {
        real,
        image: mirror.map_or(real, |surface| scene.surface(surface).mirror(real)),
        mirror,
    };
    let mut left = MOST_MIRRORED;
    let mut try_pair = |a: Seen, b: Seen| {
        if left > 0 {
            left -= pair(scene, spot, [a, b], left, rays, give);
        }
    };
    for surface in before.iter().flatten() {
        try_pair(seen(from, Some(*surface)), seen(to, None));
    }
    for surface in after.iter().flatten() {
        try_pair(seen(from, None), seen(to, Some(*surface)));
    }
    for a in before.iter().flatten().take(MIRRORS_AT_BOTH) {
        for b in after.iter().flatten().take(MIRRORS_AT_BOTH) {
            try_pair(seen(from, Some(*a)), seen(to, Some(*b)));
        }
    }
}

/// The surfaces in which a point's image is nearest.
fn mirrors(scene: &Scene, point: DVec3) -> [Option<u32>; MIRRORS] {
    let mut best: [(f64, Option<u32>); MIRRORS] = [(f64::INFINITY, None); MIRRORS];
    for surface in scene.mirrors() {
        let plane = scene.surface(surface);
        let foot = point.clamp(plane.bounds_min.as_dvec3(), plane.bounds_max.as_dvec3());
        let away_m = point.distance(foot);
        let place = best.partition_point(|b| b.0 <= away_m);
        if place < MIRRORS {
            best[place..].rotate_right(1);
            best[place] = (away_m, Some(surface));
        }
    }
    best.map(|(_, surface)| surface)
}

/// Paths between two ends seen in their mirrors; gives how many.
fn pair(
    scene: &Scene,
    spot: &Spot,
    ends: [Seen; 2],
    most: usize,
    rays: &mut u64,
    give: &mut impl FnMut(Path),
) -> usize {
    let [a, b] = ends;
    let (straight_m, longest_m) = (
        a.real.distance(b.real),
        a.image.distance(b.image) + LONGEST_DETOUR_M,
    );
    let mut count = 0;
    let near = scene.bends(a.image, b.image, longest_m);
    for found in near.as_slice().iter().take(EDGES) {
        if count == most {
            break;
        }
        let edge = &scene.edge(found.edge);
        let Some(bend) = edge.bend(a.image, b.image) else {
            continue;
        };
        let stand = bent::stand(edge, bend.apex);
        let Some(hits) = ends_seen(scene, &ends, stand) else {
            continue;
        };
        let left = fade_out(found.length_m - a.image.distance(b.image));
        if left <= 0.0 {
            continue;
        }
        let (incident, reflected) = bent::around(scene, edge, &bend, bent::distance_m(&bend));
        let mut gains: [f64; BANDS] =
            std::array::from_fn(|k| bent::signed(incident[k] + reflected[k]) * left);
        for end in &ends {
            if let Some(surface) = end.mirror {
                let plane = scene.surface(surface);
                let way = (end.image - bend.apex).normalize_or_zero();
                let cosine = plane.normal.dot(way).abs() as f32;
                let factor = scene.reflectance(surface).factor(cosine);
                for (gain, f) in gains.iter_mut().zip(factor) {
                    *gain *= f64::from(f);
                }
            }
        }
        let reach = straight_m.max(spot.nearest_m) / found.length_m;
        if !gains.iter().any(|g| g.abs() * reach > WEAKEST) {
            continue;
        }
        let clear = (0..2).all(|end| match (hits[end], ends[end].mirror) {
            (Some(hit), Some(surface)) => {
                bent::sees(scene, hit, stand, [surface, edge.faces[0]], rays)
                    && bent::sees(scene, ends[end].real, hit, [surface, NO_GROUP], rays)
            }
            _ => bent::sees(scene, ends[end].real, stand, edge.faces, rays),
        });
        if clear {
            let gains = gains.map(|g| g as f32);
            give(course(
                scene,
                spot,
                &ends,
                &hits,
                found.edge,
                bend.apex,
                found.length_m,
                &gains,
            ));
            count += 1;
        }
    }
    count
}

/// Reflection points between each end and a bend; none at all if a mirror does not reach there.
fn ends_seen(scene: &Scene, ends: &[Seen; 2], stand: DVec3) -> Option<[Option<DVec3>; 2]> {
    let mut hits = [None; 2];
    for (hit, end) in hits.iter_mut().zip(ends) {
        if let Some(surface) = end.mirror {
            let plane = scene.surface(surface);
            let (here, there) = (plane.distance_m(end.image), plane.distance_m(stand));
            if here * there >= 0.0 {
                return None;
            }
            let point = end.image + (stand - end.image) * (here / (here - there));
            *hit = Some(point).filter(|p| scene.reflects_at(surface, *p));
            (*hit)?;
        }
    }
    Some(hits)
}

#[expect(clippy::too_many_arguments, reason = "the parts of one path")]
fn course(
    scene: &Scene,
    spot: &Spot,
    ends: &[Seen; 2],
    hits: &[Option<DVec3>; 2],
    edge: u32,
    apex: DVec3,
    length_m: f64,
    gains: &[f32; BANDS],
) -> Path {
    let mut stops = [Stop::Edge(edge); 3];
    let mut points = [apex; 3];
    let mut count = 0;
    let mut add = |stop, point| {
        (stops[count], points[count]) = (stop, point);
        count += 1;
    };
    if let (Some(surface), Some(hit)) = (ends[0].mirror, hits[0]) {
        add(Stop::Surface(surface), hit);
    }
    add(Stop::Edge(edge), apex);
    let mut heard_at = apex;
    if let (Some(surface), Some(hit)) = (ends[1].mirror, hits[1]) {
        add(Stop::Surface(surface), hit);
        heard_at = hit;
    }
    let course = Course {
        stops: &stops[..count],
        points: &points[..count],
        length_m,
        heard_at,
    };
    bent::path(scene, spot, &course, gains)
}
