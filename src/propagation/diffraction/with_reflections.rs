//! Ways that bend once and are reflected before or after it, or both.
//!
//! The source is mirrored in a surface before the edge, the listener in one behind it ([`super`] has the rest). Only
//! asked for in shadow: elsewhere the direct path is louder than all of these.

use glam::DVec3;

use crate::acoustics::{BANDS, BandArray};
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffraction::edge_wave;
use crate::propagation::diffraction::edge_wave::Course;
use crate::propagation::diffraction::{ROUGH_BAND, WEAKEST, fade_out};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::Interaction;
use crate::propagation::path::Path;
use crate::scene::Scene;
use crate::scene::edges::{DiffractingEdges, Edge, EdgeCrossing, MOST_EDGE_MIRRORS};

/// Most paths of one source that bend once and are reflected.
pub const MOST_MIRRORED: usize = 12;

/// Of the surfaces around an edge, how many are tried on both sides of it at once.
const MIRRORS_AT_BOTH: usize = 3;

/// Ways whose sight lines are looked along, loudest first.
const MOST_TRIED: usize = 24;

/// Cosine of incidence at which mirrors are compared.
const ROUGH_COSINE: f32 = 0.7;

/// Rough gain below which none of a way's bands is above [`WEAKEST`], since no band is more than twice as loud as the
/// one that the estimate is for.
const LEAST_ROUGH_GAIN: f64 = 0.25 * WEAKEST;

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

/// A way worth a look, and how loud it may be.
#[derive(Clone, Copy, Default)]
struct Likely {
    rough_gain: f64,
    edge: u32,
    mirrors: [Option<u32>; 2],
}

/// Gives the paths with one bend around an edge of `near` and one or two reflections, at most [`MOST_MIRRORED`].
pub fn find(
    scene: &Scene,
    spot: &Endpoints,
    near: &DiffractingEdges,
    rays: &mut u64,
    give: &mut impl FnMut(Path),
) {
    let places = [spot.from, spot.to].map(|place| scene.to_local(place));
    let mut likely = [Likely::default(); MOST_TRIED];
    for found in near.as_slice() {
        let mirrors = scene.edge_mirrors(found.edge);
        let around = Around::of(scene, found.edge);
        let mirrors = mirrors.as_slice();
        let mut images = [[Seen::of(scene, places[0], None); MOST_EDGE_MIRRORS + 1]; 2];
        for (end, seen) in images.iter_mut().enumerate() {
            seen[0] = Seen::of(scene, places[end], None);
            for (seen, &mirror) in seen[1..].iter_mut().zip(mirrors) {
                *seen = Seen::of(scene, places[end], Some(mirror));
            }
        }
        let count = mirrors.len() + 1;
        for before in 0..count {
            for after in 0..count {
                let both = before > 0 && after > 0;
                if before + after == 0 || both && before.max(after) > MIRRORS_AT_BOTH {
                    continue;
                }
                let ends = [images[0][before], images[1][after]];
                look(scene, ends, &around, spot, &mut likely);
            }
        }
    }
    let mut count = 0;
    for way in likely.iter().take_while(|way| way.rough_gain > 0.0) {
        if count == MOST_MIRRORED {
            break;
        }
        let ends = [0, 1].map(|end| Seen::of(scene, places[end], way.mirrors[end]));
        if let Some(way) = Mirrored::between(scene, ends, way.edge)
            && way.is_clear(scene, rays)
            && let Some(path) = way.path(scene, spot)
        {
            give(path);
            count += 1;
        }
    }
}

/// An edge that many ways are tried over.
struct Around {
    number: u32,
    line: Edge,
    outward: DVec3,
}

impl Around {
    fn of(scene: &Scene, number: u32) -> Self {
        let line = scene.edge(number);
        Self {
            outward: line.outward(),
            number,
            line,
        }
    }

    /// Whether both ends look at their mirrors from the side on which a way between them bends, if that is within the edge's
    /// ends: sooner known than its angles, and most do not.
    fn may_bend(&self, scene: &Scene, ends: &[Seen; 2]) -> bool {
        let along_m = self.line.apex_m(ends[0].image, ends[1].image);
        if !(0.0..=self.line.length_m).contains(&along_m) {
            return false;
        }
        let stand = edge_wave::stand_outward(self.line.at(along_m), self.outward);
        ends.iter().all(|end| {
            end.mirror.is_none_or(|surface| {
                let plane = scene.surface(surface);
                plane.distance_m(end.image) * plane.distance_m(stand) < 0.0
            })
        })
    }
}

/// Adds the way over an edge between two ends to the likely ones, if it is there and among the loudest.
fn look(
    scene: &Scene,
    ends: [Seen; 2],
    around: &Around,
    spot: &Endpoints,
    likely: &mut [Likely; MOST_TRIED],
) {
    if !around.may_bend(scene, &ends) {
        return;
    }
    let (edge, line) = (around.number, &around.line);
    let Some(crossing) = line.crossing(ends[0].image, ends[1].image) else {
        return;
    };
    let straight_m = ends[0].real.distance(ends[1].real).max(spot.min_distance_m);
    let mut rough_gain = crate::propagation::diffraction::rough_gain(scene, edge, &crossing)
        * straight_m
        / crossing.length_m();
    for surface in ends.iter().filter_map(|end| end.mirror) {
        rough_gain *= f64::from(scene.reflectance(surface).factor(ROUGH_COSINE)[ROUGH_BAND].abs());
    }
    let place = likely.partition_point(|way| way.rough_gain >= rough_gain);
    if rough_gain < LEAST_ROUGH_GAIN
        || place == MOST_TRIED
        || ends_seen(scene, &ends, edge_wave::stand(line, crossing.apex)).is_none()
    {
        return;
    }
    likely[place..].rotate_right(1);
    likely[place] = Likely {
        rough_gain,
        edge,
        mirrors: ends.map(|end| end.mirror),
    };
}

/// A way over one edge with a reflection before it, behind it, or both.
#[derive(Debug, Clone, Copy)]
pub struct Mirrored {
    ends: [Seen; 2],
    hits: [Option<DVec3>; 2],
    edge: u32,
    crossing: EdgeCrossing,
    /// Where sight lines to the bend end.
    stand: DVec3,
}

impl Mirrored {
    /// The way over an edge with a mirror before it and one behind it, if it bends within the edge's ends and meets both
    /// mirrors within theirs.
    pub fn over(
        scene: &Scene,
        edge: u32,
        mirrors: [Option<u32>; 2],
        spot: &Endpoints,
    ) -> Option<Self> {
        let places = [spot.from, spot.to].map(|place| scene.to_local(place));
        let ends = [0, 1].map(|end| Seen::of(scene, places[end], mirrors[end]));
        Self::between(scene, ends, edge)
    }

    fn between(scene: &Scene, ends: [Seen; 2], edge: u32) -> Option<Self> {
        let line = &scene.edge(edge);
        let crossing = line.crossing(ends[0].image, ends[1].image)?;
        let stand = edge_wave::stand(line, crossing.apex);
        let way = Self {
            hits: ends_seen(scene, &ends, stand)?,
            ends,
            edge,
            crossing,
            stand,
        };
        (way.left() > 0.0).then_some(way)
    }

    /// What the length of its detour leaves of it.
    fn left(&self) -> f64 {
        let [a, b] = self.ends.map(|end| end.image);
        fade_out(self.crossing.length_m() - a.distance(b))
    }

    /// Its path, if that is above [`WEAKEST`]. Says nothing of what stands in between.
    pub fn path(&self, scene: &Scene, spot: &Endpoints) -> Option<Path> {
        let gains = self.gains(scene);
        let straight_m = self.ends[0].real.distance(self.ends[1].real);
        let reach = straight_m.max(spot.min_distance_m) / self.crossing.length_m();
        let audible = gains.iter().any(|g| f64::from(g.abs()) * reach > WEAKEST);
        audible.then(|| self.course(scene, spot, &gains))
    }

    /// Signed band gains relative to the free field over its length.
    fn gains(&self, scene: &Scene) -> BandArray {
        let line = &scene.edge(self.edge);
        let spread = edge_wave::spread(&self.crossing);
        // No reflection is followed through walls, so a wall takes all of one away. With a mirror's those of the faces are
        // of second order at least, and fade.
        let (incident, reflected) =
            edge_wave::around(scene, line, &self.crossing, &spread, false, [true; 2]);
        let left = self.left();
        let mut gains: [f64; BANDS] =
            std::array::from_fn(|b| edge_wave::signed(incident[b] + reflected[b]) * left);
        for end in &self.ends {
            let Some(surface) = end.mirror else {
                continue;
            };
            let way = (end.image - self.crossing.apex).normalize_or_zero();
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
                    edge_wave::sees(scene, hit, self.stand, [surface, faces[0]], rays)
                        && edge_wave::sees(scene, real, hit, [surface, NO_GROUP], rays)
                }
                _ => edge_wave::sees(scene, real, self.stand, faces, rays),
            }
        })
    }

    fn course(&self, scene: &Scene, spot: &Endpoints, gains: &BandArray) -> Path {
        let apex = self.crossing.apex;
        let mut stops = [Interaction::Edge(self.edge); 3];
        let mut points = [apex; 3];
        let mut count = 0;
        let mut add = |stop, point| {
            (stops[count], points[count]) = (stop, point);
            count += 1;
        };
        let reflection = |end: usize| self.ends[end].mirror.zip(self.hits[end]);
        if let Some((surface, hit)) = reflection(0) {
            add(Interaction::Surface(surface), hit);
        }
        add(Interaction::Edge(self.edge), apex);
        let mut heard_at = apex;
        if let Some((surface, hit)) = reflection(1) {
            add(Interaction::Surface(surface), hit);
            heard_at = hit;
        }
        let course = Course {
            stops: &stops[..count],
            points: &points[..count],
            length_m: self.crossing.length_m(),
            heard_at,
        };
        edge_wave::path(scene, spot, &course, gains)
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
