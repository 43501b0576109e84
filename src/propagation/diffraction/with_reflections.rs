//! Paths over one edge with a reflection before it, after it, or both.
//!
//! The source is mirrored in the surface before the edge, the listener in the one after it ([`super`] has the rest).
//! Where the direct path is visible it masks most of them: only loud ones with one reflection are searched, which continue
//! that reflection ([`crate::propagation::diffraction::lit_reflection`]).

use std::f64::consts::PI;

use glam::DVec3;

use crate::acoustics::{BandArray, smoothstep};
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffraction::complex::ComplexBands;
use crate::propagation::diffraction::edge_wave::{self, EdgePath, is_unoccluded, local_positions};
use crate::propagation::diffraction::near_list::reflected_share;
use crate::propagation::diffraction::ranked_list::insert_ranked;
use crate::propagation::diffraction::reflection_edges::{
    MAX_REFLECTED_EDGE_PATHS, ReflectionEdges,
};
use crate::propagation::diffraction::wedge_geometry::{WedgeAngles, on_side};
use crate::propagation::diffraction::{MIN_RELATIVE_AMPLITUDE, fade_out};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::image_path::turning_point;
use crate::propagation::image_source::sequence::Interaction;
use crate::propagation::path::{EdgeLimits, Path, ReflectionEdge};
use crate::scene::Scene;
use crate::scene::edges::{Edge, EdgeCrossing, EdgeEnd, MOST_EDGE_MIRRORS};

/// Surfaces around an edge that are combined on both sides of it at once.
const SURFACES_ON_BOTH_SIDES: usize = 3;

/// Most paths tested for visibility, loudest first.
const MAX_TESTED: usize = 24;

/// Band and cosine of incidence of loudness estimates.
const RANKING_BAND: usize = 2;
const RANKING_COSINE: f32 = 0.7;

/// Estimated gain below which no band exceeds [`MIN_RELATIVE_AMPLITUDE`]: no band has more than twice the gain of
/// [`RANKING_BAND`].
const MIN_RANKING_GAIN: f64 = 0.25 * MIN_RELATIVE_AMPLITUDE;

/// The argument x of the transition function is at least this share of the detour's phase.
const LEAST_PHASE_SHARE: f64 = 0.5;

/// Relative error of bounds of gains, far above that of angles and their sines.
const GAIN_ROUNDING: f64 = 1e-6;

/// Estimated gains up to which the visible direct path masks a path, and from which it does not.
const MASKED_GAIN: f64 = 0.1;
const UNMASKED_GAIN: f64 = 0.2;

/// An end point, or its image in a surface.
#[derive(Debug, Clone, Copy)]
struct ImagePoint {
    real: DVec3,
    image: DVec3,
    surface: Option<u32>,
}

impl ImagePoint {
    fn of(scene: &Scene, real: DVec3, surface: Option<u32>) -> Self {
        Self {
            real,
            image: surface.map_or(real, |surface| scene.surface(surface).mirror(real)),
            surface,
        }
    }
}

/// A candidate and its estimated gain relative to the free field over the straight distance.
#[derive(Clone, Copy)]
struct RankedPath {
    gain: f64,
    edge: u32,
    surfaces: [Option<u32>; 2],
}

/// The loudest candidates of a search, loudest first. Most of them are among the loudest for positions nearby: their least gain
/// excludes most others by a bound of theirs.
#[derive(Debug, Clone, Copy, Default)]
pub struct KnownCandidates([Option<ReflectionEdge>; MAX_TESTED]);

impl KnownCandidates {
    /// Gain that the quietest of a full list has now, if all are candidates over one of `edges`; otherwise 0.
    fn least_gain(
        &self,
        scene: &Scene,
        ends: [DVec3; 2],
        edges: &impl Fn(u32) -> bool,
        search: Search,
    ) -> f64 {
        let mut ranked = [None; MAX_TESTED];
        for &ReflectionEdge { edge, surfaces } in self.0.iter().flatten() {
            if !edges(edge) || !are_tried(scene.edge_mirrors(edge).as_slice(), surfaces, search) {
                return 0.0;
            }
            let edge = CandidateEdge::of(scene, edge, search);
            let ends = [0, 1].map(|i| edge.end(scene, ends[i], surfaces[i]));
            edge.rank(scene, [&ends[0], &ends[1]], 0.0, &mut ranked);
        }
        let last: Option<RankedPath> = ranked[MAX_TESTED - 1];
        last.map_or(0.0, |last| last.gain * (1.0 - GAIN_ROUNDING))
    }
}

/// Whether reflections in these surfaces before and after an edge are tried, of which it has some mirrors.
fn are_tried(mirrors: &[u32], surfaces: [Option<u32>; 2], search: Search) -> bool {
    let place = |surface| mirrors.iter().position(|mirror| *mirror == surface);
    match surfaces {
        [Some(before), Some(after)] => {
            let is_tried = |surface| place(surface).is_some_and(|at| at < SURFACES_ON_BOTH_SIDES);
            !search.is_lit && is_tried(before) && is_tried(after)
        }
        [Some(surface), None] | [None, Some(surface)] => place(surface).is_some(),
        [None, None] => false,
    }
}

/// Emits the paths over one of `edges` with two reflections and returns those with one, [`MAX_REFLECTED_EDGE_PATHS`] at
/// most together. `limits` are where the list of edges ends; `None` if the direct path is visible and the edges are its own.
/// Adds the rays cast to `rays`. `known` holds the candidates of an earlier call and is renewed; it shortens the search and does
/// not change the result.
pub fn find(
    scene: &Scene,
    endpoints: &Endpoints,
    edges: impl Iterator<Item = u32> + Clone,
    limits: Option<&EdgeLimits>,
    known: &mut KnownCandidates,
    rays: &mut u64,
    emit: &mut impl FnMut(Path),
) -> ReflectionEdges {
    let (from, to) = local_positions(scene, endpoints);
    let is_lit = limits.is_none();
    let least_gain = match is_lit {
        true => MASKED_GAIN,
        false => MIN_RANKING_GAIN,
    };
    let search = Search {
        least_gain,
        most_detour_m: longest_detour_m(scene, least_gain),
        wavenumber: edge_wave::wavenumbers(scene)[RANKING_BAND],
        free_m: from.distance(to).max(endpoints.min_distance_m),
        is_lit,
    };
    let is_searched = |edge| edges.clone().any(|searched| searched == edge);
    let known_gain = known.least_gain(scene, [from, to], &is_searched, search);
    let mut ranked = [None; MAX_TESTED];
    for index in edges {
        let surfaces = scene.edge_mirrors(index);
        let edge = CandidateEdge::of(scene, index, search);
        let surfaces = surfaces.as_slice();
        let images = [from, to].map(|end| {
            let mut images = [edge.end(scene, end, None); MOST_EDGE_MIRRORS + 1];
            for (image, &surface) in images[1..].iter_mut().zip(surfaces) {
                *image = edge.end(scene, end, Some(surface));
            }
            images
        });
        let is_outside = |side: usize, end: usize| images[side][end].end.is_outside();
        for before in (0..=surfaces.len()).filter(|before| is_outside(0, *before)) {
            for after in 0..=surfaces.len() {
                let both = before > 0 && after > 0;
                let is_masked = both && (is_lit || before.max(after) > SURFACES_ON_BOTH_SIDES);
                if before + after == 0 || is_masked {
                    continue;
                }
                let ends = [&images[0][before], &images[1][after]];
                edge.rank(scene, ends, known_gain, &mut ranked);
            }
        }
    }
    known.0 = ranked.map(|path| {
        path.map(|RankedPath { edge, surfaces, .. }| ReflectionEdge { edge, surfaces })
    });
    let mut result = ReflectionEdges::default();
    ranked
        .iter()
        .flatten()
        .filter_map(|&RankedPath { edge, surfaces, .. }| {
            let path = ReflectedEdgePath::over(scene, edge, surfaces, endpoints)?;
            if !path.is_unoccluded(scene, rays) {
                return None;
            }
            // Where the direct path is visible, most reflections are too, and their paths are not needed.
            let path = match limits {
                None => None,
                Some(limits) => {
                    let share = reflected_share(scene, edge, [from, to], limits);
                    let path = path.path(scene, endpoints, false)?;
                    Some((share > 0.0).then(|| path.scaled(share as f32))?)
                }
            };
            Some((ReflectionEdge { edge, surfaces }, path))
        })
        .take(MAX_REFLECTED_EDGE_PATHS)
        .for_each(|(edge, path)| match (edge.surfaces, path) {
            ([Some(_), Some(_)], Some(path)) => emit(path),
            _ => result.push(edge, path),
        });
    result
}

/// What all candidates of a source share.
#[derive(Clone, Copy)]
struct Search {
    least_gain: f64,
    /// That of a path with the least gain.
    most_detour_m: f64,
    /// In [`RANKING_BAND`].
    wavenumber: f64,
    /// Distance of the free field that gains are relative to.
    free_m: f64,
    /// Whether the direct path is visible.
    is_lit: bool,
}

/// An end that many candidates over an edge share.
#[derive(Clone, Copy)]
struct CandidateEnd {
    point: ImagePoint,
    end: EdgeEnd,
    /// See [`ranking_factor`].
    factor: f64,
}

/// An edge that many candidates share.
struct CandidateEdge {
    index: u32,
    edge: Edge,
    outward: DVec3,
    search: Search,
}

impl CandidateEdge {
    fn of(scene: &Scene, index: u32, search: Search) -> Self {
        let edge = scene.edge(index);
        Self {
            search,
            outward: edge.outward(),
            index,
            edge,
        }
    }

    fn end(&self, scene: &Scene, real: DVec3, surface: Option<u32>) -> CandidateEnd {
        let point = ImagePoint::of(scene, real, surface);
        CandidateEnd {
            end: EdgeEnd::of(&self.edge, point.image),
            factor: ranking_factor(scene, surface),
            point,
        }
    }

    /// Upper bounds of the estimated gain, over an endless edge and over this one, if the crossing is within the edge, its detour is not
    /// too long, and both ends are on the reflecting side of their surfaces: a test that excludes most candidates.
    fn most_gains(&self, scene: &Scene, ends: [&CandidateEnd; 2]) -> Option<(f64, f64)> {
        let crossed_m = ends[0].end.apex_m(&ends[1].end);
        let along_m = self.edge.clamped(crossed_m)?;
        let apex = self.edge.at(along_m);
        let [from, to] = ends.map(|end| end.point.image);
        let length_m = from.distance(apex) + apex.distance(to);
        let detour_m = length_m - from.distance(to);
        if detour_m > self.search.most_detour_m {
            return None;
        }
        let sight_point = edge_wave::sight_point(&self.edge, apex, self.outward);
        let is_reflected = ends.iter().all(|end| {
            end.point.surface.is_none_or(|surface| {
                let plane = scene.surface(surface);
                plane.distance_m(end.point.image) * plane.distance_m(sight_point) < 0.0
            })
        });
        if !is_reflected {
            return None;
        }
        // The wave is that of the endless edge, and little of it is left beyond an end.
        let beyond_m = match along_m == crossed_m {
            true => 0.0,
            false => (length_m - ends[0].end.line_length_m(&ends[1].end)).max(0.0),
        };
        let x = self.search.wavenumber * LEAST_PHASE_SHARE * (detour_m - beyond_m).max(0.0);
        let share = match beyond_m > 0.0 {
            true => wave_size(self.search.wavenumber * beyond_m),
            false => 1.0,
        };
        let endless = wave_size(x) * (self.search.free_m / length_m);
        let endless = endless * ends[0].factor * ends[1].factor * (1.0 + GAIN_ROUNDING);
        Some((endless, endless * share))
    }

    /// Adds the path between two ends to `ranked` if it exists and is among the loudest, of which none has a gain below `known_gain`.
    fn rank(
        &self,
        scene: &Scene,
        ends: [&CandidateEnd; 2],
        known_gain: f64,
        ranked: &mut [Option<RankedPath>; MAX_TESTED],
    ) {
        if !ends.iter().all(|end| end.end.is_outside()) {
            return;
        }
        let Some((most_endless, most_gain)) = self.most_gains(scene, ends) else {
            return;
        };
        let least_gain = self.search.least_gain;
        let last = ranked[MAX_TESTED - 1].map_or(f64::NEG_INFINITY, |last| last.gain);
        if most_endless < least_gain || most_gain < known_gain || last >= most_gain {
            return;
        }
        let Some(crossing) = ends[0].end.crossing(&self.edge, &ends[1].end) else {
            return;
        };
        let factors = ends.map(|end| end.factor);
        let Search {
            wavenumber, free_m, ..
        } = self.search;
        let endless = estimated_gain(&self.edge, &crossing, factors, wavenumber, free_m);
        let gain = endless * share_of_length(wavenumber, &crossing);
        let sight_point = edge_wave::sight_point(&self.edge, crossing.apex, self.outward);
        if endless < least_gain || gain < known_gain || last >= gain {
            return;
        }
        let ends = ends.map(|end| on_surface(scene, end.point, sight_point));
        if reflection_points(scene, &ends, sight_point).is_none() {
            return;
        }
        let new = RankedPath {
            gain,
            edge: self.index,
            surfaces: ends.map(|end| end.surface),
        };
        insert_ranked(ranked, new, |old| old.gain >= gain);
    }
}

/// Upper bound of the detour in metres of paths with an estimated gain.
fn longest_detour_m(scene: &Scene, least_gain: f64) -> f64 {
    let x = ((0.5 / least_gain).powi(2) - 1.0) / PI;
    x / LEAST_PHASE_SHARE / edge_wave::wavenumbers(scene)[RANKING_BAND]
}

/// Estimated gain of a path over an endless edge in [`RANKING_BAND`] relative to the free field over the straight distance; `factors`
/// are those of its ends.
fn estimated_gain(
    edge: &Edge,
    crossing: &EdgeCrossing,
    factors: [f64; 2],
    wavenumber: f64,
    free_m: f64,
) -> f64 {
    let distance_m = edge_wave::spread(crossing).distance_m;
    let x = WedgeAngles::of(edge, crossing).transition_argument(wavenumber, distance_m);
    let gain = wave_size(x) * (free_m / crossing.length_m());
    gain * factors[0] * factors[1]
}

/// Estimated gain of the reflection at an end, 1 without one.
fn ranking_factor(scene: &Scene, surface: Option<u32>) -> f64 {
    surface.map_or(1.0, |surface| {
        let factor = scene.reflectance(surface).factor(RANKING_COSINE)[RANKING_BAND];
        f64::from(factor.abs())
    })
}

/// Size of the transition function, 1 at the boundary and 1/√(πx) far from it, times the ½ that the wave has there.
fn wave_size(x: f64) -> f64 {
    0.5 / (1.0 + PI * x).sqrt()
}

/// Estimated share of an edge's wave within its free ends ([`EdgeCrossing::excess_m`]): ½ at an end, and falling with the
/// phase beyond it.
fn share_of_length(wavenumber: f64, crossing: &EdgeCrossing) -> f64 {
    let beyond_m = crossing.beyond_m();
    if beyond_m > 0.0 {
        return wave_size(wavenumber * beyond_m);
    }
    let to_end_m = crossing.excess_m[0].min(crossing.excess_m[1]);
    1.0 - wave_size(wavenumber * to_end_m)
}

/// A path over one edge with one or two reflections.
#[derive(Debug, Clone, Copy)]
pub struct ReflectedEdgePath {
    ends: [ImagePoint; 2],
    hits: [Option<DVec3>; 2],
    edge: u32,
    crossing: EdgeCrossing,
    /// End of visibility rays to the edge.
    sight_point: DVec3,
    fade: f64,
}

impl ReflectedEdgePath {
    /// The path over an edge with reflections in the surfaces before and after it, if the crossing and the reflection points
    /// lie within edge and surfaces. Occlusion is not tested.
    pub fn over(
        scene: &Scene,
        edge: u32,
        surfaces: [Option<u32>; 2],
        endpoints: &Endpoints,
    ) -> Option<Self> {
        let (from, to) = local_positions(scene, endpoints);
        let ends = [
            ImagePoint::of(scene, from, surfaces[0]),
            ImagePoint::of(scene, to, surfaces[1]),
        ];
        let line = &scene.edge(edge);
        let crossing = line.crossing(ends[0].image, ends[1].image)?;
        let sight_point = edge_wave::sight_point(line, crossing.apex, line.outward());
        let hits = reflection_points(scene, &ends, sight_point)?;
        let fade = fade_out(
            scene,
            crossing.length_m() - ends[0].image.distance(ends[1].image),
        );
        (fade > 0.0).then_some(Self {
            ends,
            hits,
            edge,
            crossing,
            sight_point,
            fade,
        })
    }

    /// The path, if audible ([`edge_wave::is_audible`]). Where the direct path is visible (`is_lit`), it masks a quiet one.
    /// Occlusion is not tested.
    pub fn path(&self, scene: &Scene, endpoints: &Endpoints, is_lit: bool) -> Option<Path> {
        let mut gains = self.gains(scene);
        if is_lit {
            let share = self.unmasked_share(scene, endpoints) as f32;
            gains = gains.map(|gain| gain * share);
        }
        let straight_m = self.ends[0].real.distance(self.ends[1].real);
        let spreading = straight_m.max(endpoints.min_distance_m) / self.crossing.length_m();
        edge_wave::is_audible(&gains, spreading).then(|| self.to_path(scene, endpoints, &gains))
    }

    /// The edge.
    pub(super) fn edge(&self) -> u32 {
        self.edge
    }

    /// [`WedgeAngles::sides`] at the edge.
    pub(super) fn sides(&self, scene: &Scene) -> u32 {
        WedgeAngles::of(&scene.edge(self.edge), &self.crossing).sides()
    }

    /// Length over the edge in metres.
    pub(super) fn length_m(&self) -> f64 {
        self.crossing.length_m()
    }

    /// Length of the straight line between the images of its ends in metres.
    pub(super) fn straight_m(&self) -> f64 {
        self.ends[0].image.distance(self.ends[1].image)
    }

    /// Difference of both lengths in metres.
    pub(super) fn detour_m(&self) -> f64 {
        (self.length_m() - self.straight_m()).max(0.0)
    }

    /// Share of the path that is audible beside the visible direct path.
    pub(super) fn unmasked_share(&self, scene: &Scene, endpoints: &Endpoints) -> f64 {
        let edge = &scene.edge(self.edge);
        let straight_m = self.ends[0].real.distance(self.ends[1].real);
        let free_m = straight_m.max(endpoints.min_distance_m);
        let factors = self.ends.map(|end| ranking_factor(scene, end.surface));
        let wavenumber = edge_wave::wavenumbers(scene)[RANKING_BAND];
        let gain = estimated_gain(edge, &self.crossing, factors, wavenumber, free_m);
        smoothstep((gain - MASKED_GAIN) / (UNMASKED_GAIN - MASKED_GAIN))
    }

    /// The waves of [`edge_wave::diffracted_field`]; `is_lit` is whether the straight path between the images is visible.
    pub(super) fn waves(&self, scene: &Scene, is_lit: bool) -> (ComplexBands, ComplexBands) {
        let edge = &scene.edge(self.edge);
        let spread = edge_wave::spread(&self.crossing);
        // Reflections are not transmitted: a wall removes them completely. With a surface's reflection those of the
        // faces are of second order at least, and fade.
        let crossing = on_side(edge, &self.crossing, is_lit);
        edge_wave::diffracted_field(scene, edge, &crossing, &spread, false, [true; 2])
    }

    /// Signed band gains relative to the free field over its length, in the shadow of the reflection.
    fn gains(&self, scene: &Scene) -> BandArray {
        let (incident, reflected) = self.waves(scene, false);
        let mut gains: [f64; _] =
            std::array::from_fn(|b| edge_wave::real_gain(incident[b] + reflected[b]) * self.fade);
        for end in &self.ends {
            let Some(surface) = end.surface else {
                continue;
            };
            let direction = (end.image - self.crossing.apex).normalize_or_zero();
            let cosine = scene.surface(surface).normal.dot(direction).abs() as f32;
            let factor = scene.reflectance(surface).factor(cosine);
            for (gain, f) in gains.iter_mut().zip(factor) {
                *gain *= f64::from(f);
            }
        }
        gains.map(|gain| gain as f32)
    }

    /// Whether nothing occludes it. Adds the rays cast, four at most, to `rays`.
    pub fn is_unoccluded(&self, scene: &Scene, rays: &mut u64) -> bool {
        let edge = scene.edge(self.edge);
        let angles = [self.crossing.incoming, self.crossing.outgoing];
        let end = self.sight_point;
        (0..2).all(|i| {
            let ImagePoint { real, surface, .. } = self.ends[i];
            match (self.hits[i], surface) {
                (Some(hit), Some(surface)) => {
                    let turn = turning_point(real, hit, end);
                    is_unoccluded(
                        scene,
                        turn,
                        end,
                        [surface, edge.face_beside(angles[i])],
                        rays,
                    ) && is_unoccluded(scene, real, turn, [surface, NO_GROUP], rays)
                }
                _ => is_unoccluded(scene, real, end, edge.faces, rays),
            }
        })
    }

    fn to_path(self, scene: &Scene, endpoints: &Endpoints, gains: &BandArray) -> Path {
        let apex = self.crossing.apex;
        let mut interactions = [Interaction::Edge(self.edge); 3];
        let mut points = [apex; 3];
        let mut count = 0;
        let reflection = |end: usize| {
            let surface = self.ends[end].surface.map(Interaction::Surface);
            surface.zip(self.hits[end])
        };
        let edge = Some((Interaction::Edge(self.edge), apex));
        for (interaction, point) in [reflection(0), edge, reflection(1)].into_iter().flatten() {
            (interactions[count], points[count]) = (interaction, point);
            count += 1;
        }
        let path = EdgePath {
            interactions: &interactions[..count],
            points: &points[..count],
            length_m: self.crossing.length_m(),
            last_point: points[count - 1],
        };
        path.to_path(scene, endpoints, gains)
    }
}

/// An end with that surface of its mirror plane on which the line to an edge is reflected, where joining leaves two.
fn on_surface(scene: &Scene, end: ImagePoint, sight_point: DVec3) -> ImagePoint {
    let other = end.surface.and_then(|surface| scene.continued_by(surface));
    match other {
        Some(other) if reflection_points(scene, &[end; 2], sight_point).is_none() => {
            ImagePoint::of(scene, end.real, Some(other))
        }
        _ => end,
    }
}

/// Reflection points between the ends and an edge; `None` if a line misses its surface.
fn reflection_points(
    scene: &Scene,
    ends: &[ImagePoint; 2],
    sight_point: DVec3,
) -> Option<[Option<DVec3>; 2]> {
    let mut hits = [None; 2];
    for (hit, end) in hits.iter_mut().zip(ends) {
        if let Some(surface) = end.surface {
            let plane = scene.surface(surface);
            let (here, there) = (plane.distance_m(end.image), plane.distance_m(sight_point));
            if here * there >= 0.0 {
                return None;
            }
            let point = end.image + (sight_point - end.image) * (here / (here - there));
            *hit = Some(point).filter(|p| scene.reflects_at(surface, *p));
            (*hit)?;
        }
    }
    Some(hits)
}
