//! Ways that bend once and are reflected before or after it, or both.
//!
//! The source is mirrored in a surface before the edge, the listener in one behind it ([`super`] has the rest). Only
//! asked for in shadow: elsewhere the direct path is louder than all of these.

use glam::DVec3;

use super::bent::{self, Course};
use super::direct::Spot;
use super::{LONGEST_DETOUR_M, WEAKEST, fade_out};
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::path::Path;
use crate::propagation::sequence::Stop;
use crate::scene::Scene;
use crate::scene::edges::Bend;

/// Most paths of one source that bend once and are reflected.
pub const MOST_MIRRORED: usize = 12;

/// Surfaces tried as mirrors at either end.
const MIRRORS: usize = 6;

/// Of these, how many are tried at both ends at once.
const MIRRORS_AT_BOTH: usize = 3;

/// Edges tried for each pair of mirrors, shortest way first.
const EDGES: usize = 6;

/// A point seen directly or in a mirror.
#[derive(Debug, Clone, Copy)]
struct Seen {
    real: DVec3,
    /// Where it seems to be.
    image: DVec3,
    mirror: Option<u32>,
}

impl Seen {
    fn of(scene: &Scene, real: DVec3, mirror: Option<u32>) -> Self {
        Self {
            real,
            image: mirror.map_or(real, |surface| scene.surface(surface).mirror(real)),
            mirror,
        }
    }
}

/// Gives the paths with one bend and one or two reflections, at most [`MOST_MIRRORED`].
pub fn find(scene: &Scene, spot: &Spot, rays: &mut u64, give: &mut impl FnMut(Path)) {
    let (from, to) = (scene.to_local(spot.from), scene.to_local(spot.to));
    let (before, after) = (mirrors(scene, from), mirrors(scene, to));
    let seen = |real: DVec3, mirror: Option<u32>| Seen::of(scene, real, mirror);
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
    let [a, b] = ends.map(|end| end.image);
    let mut count = 0;
    let near = scene.bends(a, b, a.distance(b) + LONGEST_DETOUR_M);
    for found in near.as_slice().iter().take(EDGES) {
        if count == most {
            break;
        }
        let Some(way) = Mirrored::between(scene, ends, found.edge) else {
            continue;
        };
        if let Some(path) = way.path(scene, spot)
            && way.is_clear(scene, rays)
        {
            give(path);
            count += 1;
        }
    }
    count
}

/// A way over one edge with a reflection before it, behind it, or both.
#[derive(Debug, Clone, Copy)]
pub struct Mirrored {
    ends: [Seen; 2],
    hits: [Option<DVec3>; 2],
    edge: u32,
    bend: Bend,
    /// Where sight lines to the bend end.
    stand: DVec3,
}

impl Mirrored {
    /// The way over an edge with a mirror before it and one behind it, if it bends within the edge's ends and meets both
    /// mirrors within theirs.
    pub fn over(scene: &Scene, edge: u32, mirrors: [Option<u32>; 2], spot: &Spot) -> Option<Self> {
        let places = [spot.from, spot.to].map(|place| scene.to_local(place));
        let ends = [0, 1].map(|end| Seen::of(scene, places[end], mirrors[end]));
        Self::between(scene, ends, edge)
    }

    fn between(scene: &Scene, ends: [Seen; 2], edge: u32) -> Option<Self> {
        let line = &scene.edge(edge);
        let bend = line.bend(ends[0].image, ends[1].image)?;
        let stand = bent::stand(line, bend.apex);
        let way = Self {
            hits: ends_seen(scene, &ends, stand)?,
            ends,
            edge,
            bend,
            stand,
        };
        (way.left() > 0.0).then_some(way)
    }

    /// What the length of its detour leaves of it.
    fn left(&self) -> f64 {
        let [a, b] = self.ends.map(|end| end.image);
        fade_out(self.bend.length_m() - a.distance(b))
    }

    /// Its path, if that is above [`WEAKEST`]. Says nothing of what stands in between.
    pub fn path(&self, scene: &Scene, spot: &Spot) -> Option<Path> {
        let gains = self.gains(scene);
        let straight_m = self.ends[0].real.distance(self.ends[1].real);
        let reach = straight_m.max(spot.nearest_m) / self.bend.length_m();
        let audible = gains.iter().any(|g| f64::from(g.abs()) * reach > WEAKEST);
        audible.then(|| self.course(scene, spot, &gains))
    }

    /// Signed band gains relative to the free field over its length.
    fn gains(&self, scene: &Scene) -> BandArray {
        let line = &scene.edge(self.edge);
        let length_m = bent::distance_m(&self.bend);
        // No reflection is followed through walls, so a wall takes all of one away.
        let (incident, reflected) = bent::around(scene, line, &self.bend, length_m, false);
        let left = self.left();
        let mut gains: [f64; BANDS] =
            std::array::from_fn(|b| bent::signed(incident[b] + reflected[b]) * left);
        for end in &self.ends {
            let Some(surface) = end.mirror else {
                continue;
            };
            let way = (end.image - self.bend.apex).normalize_or_zero();
            let cosine = scene.surface(surface).normal.dot(way).abs() as f32;
            let factor = scene.reflectance(surface).factor(cosine);
            for (gain, f) in gains.iter_mut().zip(factor) {
                *gain *= f64::from(f);
            }
        }
        gains.map(|gain| gain as f32)
    }

    /// Whether nothing stands on the way. Adds the rays it cast, four at most, to `rays`.
    pub fn is_clear(&self, scene: &Scene, rays: &mut u64) -> bool {
        let faces = scene.edge(self.edge).faces;
        (0..2).all(|end| {
            let Seen { real, mirror, .. } = self.ends[end];
            match (self.hits[end], mirror) {
                (Some(hit), Some(surface)) => {
                    bent::sees(scene, hit, self.stand, [surface, faces[0]], rays)
                        && bent::sees(scene, real, hit, [surface, NO_GROUP], rays)
                }
                _ => bent::sees(scene, real, self.stand, faces, rays),
            }
        })
    }

    fn course(&self, scene: &Scene, spot: &Spot, gains: &BandArray) -> Path {
        let apex = self.bend.apex;
        let mut stops = [Stop::Edge(self.edge); 3];
        let mut points = [apex; 3];
        let mut count = 0;
        let mut add = |stop, point| {
            (stops[count], points[count]) = (stop, point);
            count += 1;
        };
        let reflection = |end: usize| self.ends[end].mirror.zip(self.hits[end]);
        if let Some((surface, hit)) = reflection(0) {
            add(Stop::Surface(surface), hit);
        }
        add(Stop::Edge(self.edge), apex);
        let mut heard_at = apex;
        if let Some((surface, hit)) = reflection(1) {
            add(Stop::Surface(surface), hit);
            heard_at = hit;
        }
        let course = Course {
            stops: &stops[..count],
            points: &points[..count],
            length_m: self.bend.length_m(),
            heard_at,
        };
        bent::path(scene, spot, &course, gains)
    }
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
