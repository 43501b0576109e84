//! Regions of rough triangles around a common sphere or cylinder, by region growing.
//!
//! As [`super::regions`] for planes, of the triangles that no plane has: a dome, a vault or a column whose noise hides its facets'
//! directions. Positions are fitted, not normals. What is left has to be noise: distances from the shape that follow a pattern are
//! those of another shape, such as a column with few sides. Shapes without noise are left to [`super::super::surface::curved`]. Own.

use super::facets::{Facets, LEAST_COSINE, NONE};
use super::plane_fit::{Fit, Moments};
use super::regions::{FLAT_M, Limits};
use super::round_fit::{Round, Weighted};

/// Triangles of a first neighbourhood: most, and least.
const NEIGHBOURHOOD: [usize; 2] = [40, 8];

/// Width of the band around the shape on either side, in standard deviations of the members.
const BAND: f64 = 4.5;

/// Greatest tolerance relative to the radius: noise on a thin column is its shape.
const MOST_OF_RADIUS: f64 = 0.1;

/// Radii in metres: smaller ones are ornaments, larger ones flat.
const RADII_M: [f64; 2] = [0.1, 500.0];

/// Greatest angle in degrees of the shape between neighbouring triangles, as between facets of a smooth surface.
const SMOOTH_DEG: f64 = 31.0;

/// Least angle in degrees that a shape turns by.
const LEAST_BEND_DEG: f64 = 15.0;

/// Least standard deviation from a plane, in those from the shape.
const BETTER_THAN_PLANE: f64 = 2.0;

/// Most of the squared distances in those of the distances from their neighbours' mean, which is 1 for noise.
const PATTERN: f64 = 2.0;

/// Most correlation of the distances of neighbours along an axis, and least cosine of the angle between such neighbours and the
/// axis: between the edges of a column with few sides, each of few triangles, distances alternate around it.
const ALONG: f64 = 0.5;
const ALONG_COSINE: f64 = 0.9;

/// Least median of the distances from a shape in their standard deviations: of a normal distribution it is 0.67.
const LEAST_MEDIAN: f64 = 0.33;

/// Largest part of a region's outline behind which the surface goes on smoothly in no shape: a hill fits a sphere in places.
const MOST_LOOSE: f64 = 0.3;

/// Least cosine between a triangle and the shape that goes on in it.
const LOOSE_COSINE: f64 = 0.8;

/// Rounds of collecting a region with a fixed shape.
const ROUNDS: usize = 2;

/// Shapes with their triangles.
pub(super) struct RoundRegions {
    pub(super) shapes: Vec<Round>,
    /// Shape of each triangle, or [`NONE`].
    pub(super) of_triangle: Vec<u32>,
}

struct Search<'a> {
    facets: &'a Facets,
    triangles: &'a [[u32; 3]],
    limits: Limits,
    /// Triangles of planes and of earlier shapes.
    is_taken: Vec<bool>,
    /// The last pass that has visited each triangle.
    visited: Vec<u32>,
    pass: u32,
    /// By vertex: its distance from a shape, the sum of its neighbours', and their number.
    distances: Vec<(f64, f64, u32)>,
    /// By vertex: the last list that has it, and its place there.
    places: Vec<(u32, u32)>,
    lists: u32,
}

/// A shape, its triangles, and the standard deviation of their corners.
struct Region {
    shape: Round,
    members: Vec<u32>,
    area_m2: f64,
    sigma_m: f64,
}

/// Regions of at least the least area among triangles that are in no plane. `order` has the triangles in an order that depends on
/// geometry alone.
pub(super) fn find(
    facets: &Facets,
    triangles: &[[u32; 3]],
    vertices: usize,
    in_plane: &[u32],
    order: &[u32],
    limits: Limits,
) -> RoundRegions {
    let mut search = Search {
        facets,
        triangles,
        limits,
        is_taken: in_plane.iter().map(|&region| region != NONE).collect(),
        visited: vec![0; facets.len()],
        pass: 0,
        distances: vec![(0.0, 0.0, 0); vertices],
        places: vec![(0, 0); vertices],
        lists: 0,
    };
    let mut found = RoundRegions {
        shapes: Vec::new(),
        of_triangle: vec![NONE; facets.len()],
    };
    let mut is_tried = vec![false; facets.len()];
    for &seed in order {
        let at = seed as usize;
        if !facets.is_rough[at] || is_tried[at] || search.is_taken[at] {
            continue;
        }
        let near = search.neighbourhood(seed);
        let regions = search.grown(seed, &near);
        // Triangles of failed searches are no seeds again.
        let tried = regions.iter().map(|region| &region.members).chain([&near]);
        tried.flatten().for_each(|&t| is_tried[t as usize] = true);
        let accepted = regions.into_iter().filter(|r| search.is_round(r));
        let Some(region) = accepted.max_by(|a, b| a.area_m2.total_cmp(&b.area_m2)) else {
            continue;
        };
        for &member in &region.members {
            search.is_taken[member as usize] = true;
            found.of_triangle[member as usize] = found.shapes.len() as u32;
        }
        found.shapes.push(region.shape);
    }
    found.drop_loose(facets, in_plane);
    found
}

impl RoundRegions {
    /// Dissolves shapes that end where the surface goes on, until there is none.
    fn drop_loose(&mut self, facets: &Facets, in_plane: &[u32]) {
        let mut is_kept = vec![true; self.shapes.len()];
        loop {
            // Loose sides and all sides of each outline.
            let mut sides = vec![[0u32; 2]; self.shapes.len()];
            for (triangle, &own) in (0..).zip(&self.of_triangle) {
                let Some(shape) = self.shapes.get(own as usize) else {
                    continue;
                };
                for side in 3 * triangle..3 * triangle + 3 {
                    let other = facets.beside(side);
                    if self.of_triangle[other as usize] == own && !facets.is_boundary(side) {
                        continue;
                    }
                    let is_free = |at: usize| self.of_triangle[at] == NONE && in_plane[at] == NONE;
                    let goes_on = shape.normal(facets.middle(other));
                    let cosine = goes_on.dot(facets.normals[other as usize]).abs();
                    let is_loose = is_free(other as usize) && cosine > LOOSE_COSINE;
                    let [loose, all] = &mut sides[own as usize];
                    *loose += u32::from(is_loose);
                    *all += 1;
                }
            }
            let is_loose = |[loose, all]: [u32; 2]| f64::from(loose) > MOST_LOOSE * f64::from(all);
            let mut is_changed = false;
            for (kept, sides) in is_kept.iter_mut().zip(sides) {
                is_changed |= is_loose(sides);
                *kept &= !is_loose(sides);
            }
            if !is_changed {
                break;
            }
            for own in &mut self.of_triangle {
                if *own != NONE && !is_kept[*own as usize] {
                    *own = NONE;
                }
            }
        }
        let mut number = 0;
        let numbers: Vec<u32> = is_kept
            .iter()
            .map(|&kept| {
                number += u32::from(kept);
                number.wrapping_sub(1)
            })
            .collect();
        for own in self.of_triangle.iter_mut().filter(|own| **own != NONE) {
            *own = numbers[*own as usize];
        }
        let mut flags = is_kept.iter();
        self.shapes.retain(|_| flags.next() == Some(&true));
    }
}

impl Search<'_> {
    /// The vertices of triangles, each with a third of the area of those that have it.
    fn points(&mut self, members: &[u32]) -> Vec<Weighted> {
        self.lists += 1;
        let mut points: Vec<Weighted> = Vec::new();
        for &triangle in members {
            let at = triangle as usize;
            let weight = self.facets.areas_m2[at] / 3.0;
            for (corner, vertex) in self.facets.corners[at].iter().zip(self.triangles[at]) {
                let place = &mut self.places[vertex as usize];
                if place.0 != self.lists {
                    *place = (self.lists, points.len() as u32);
                    points.push((*corner, 0.0));
                }
                points[place.1 as usize].1 += weight;
            }
        }
        points
    }

    fn moments(&self, members: &[u32]) -> Moments {
        let mut moments = Moments::NONE;
        for &triangle in members {
            let at = triangle as usize;
            moments.add(&self.facets.corners[at], self.facets.areas_m2[at]);
        }
        moments
    }

    /// The nearest triangles around a seed.
    fn neighbourhood(&mut self, seed: u32) -> Vec<u32> {
        let facets = self.facets;
        self.pass += 1;
        self.visited[seed as usize] = self.pass;
        let mut members = vec![seed];
        let mut next = 0;
        while let Some(&triangle) = members.get(next) {
            next += 1;
            for other in facets.neighbours(triangle) {
                let at = other as usize;
                if members.len() < NEIGHBOURHOOD[0]
                    && self.visited[at] != self.pass
                    && !self.is_taken[at]
                    && facets.cosine(triangle, other) > LEAST_COSINE
                {
                    self.visited[at] = self.pass;
                    members.push(other);
                }
            }
        }
        members
    }

    /// The regions of a sphere and of a cylinder around a seed.
    fn grown(&mut self, seed: u32, near: &[u32]) -> Vec<Region> {
        if near.len() < NEIGHBOURHOOD[1] {
            return Vec::new();
        }
        let points = self.points(near);
        let shapes = self.shapes_of(near, &points);
        // A shape without noise is exact, and then any other one is wrong.
        if shapes.iter().any(|(_, sigma_m)| *sigma_m <= FLAT_M) {
            return Vec::new();
        }
        let rough = shapes
            .into_iter()
            .filter(|(s, sigma_m)| self.is_rough(s, *sigma_m));
        let rough: Vec<_> = rough.collect();
        let grown = rough
            .into_iter()
            .map(|(s, sigma_m)| self.grow(seed, s, sigma_m));
        grown.flatten().collect()
    }

    /// The sphere and the cylinder through some triangles, with the corners' standard deviations.
    fn shapes_of(&self, members: &[u32], points: &[Weighted]) -> Vec<(Round, f64)> {
        let moments = self.moments(members);
        let near = Round::near_plane(points, &moments.fit(), moments.middle());
        let shapes = near.into_iter().flatten();
        shapes.map(|shape| shape.fitted(points)).collect()
    }

    fn tolerance_m(&self, shape: &Round) -> f64 {
        let radius_m = 1.0 / shape.curvature_per_m.abs().max(1e-9);
        self.limits.tolerance_m.min(MOST_OF_RADIUS * radius_m)
    }

    fn is_rough(&self, shape: &Round, sigma_m: f64) -> bool {
        let limits = Limits {
            tolerance_m: self.tolerance_m(shape),
            ..self.limits
        };
        sigma_m > FLAT_M && limits.is_rough(sigma_m)
    }

    fn band_m(&self, shape: &Round, sigma_m: f64) -> f64 {
        let limits = Limits {
            tolerance_m: self.tolerance_m(shape),
            ..self.limits
        };
        limits.band_m(BAND, sigma_m)
    }

    fn grow(&mut self, seed: u32, shape: Round, sigma_m: f64) -> Option<Region> {
        let (mut shape, mut sigma_m) = (shape, sigma_m);
        let mut members = self.flood(seed, &mut shape, &mut sigma_m, true)?;
        for _ in 0..ROUNDS {
            (shape, sigma_m) = shape.fitted(&self.points(&members));
            if !self.is_rough(&shape, sigma_m) {
                break;
            }
            members = self.flood(seed, &mut shape, &mut sigma_m, false)?;
        }
        let (shape, sigma_m) = shape.fitted(&self.points(&members));
        let area_m2 = members.iter().map(|&t| self.facets.areas_m2[t as usize]);
        Some(Region {
            area_m2: area_m2.sum(),
            shape,
            members,
            sigma_m,
        })
    }

    fn lies_on(&self, shape: &Round, band_m: f64, triangle: u32) -> bool {
        let at = triangle as usize;
        let near = |corner: &glam::DVec3| shape.distance_m(*corner).abs() <= band_m;
        self.facets.corners[at].iter().all(near)
            && self.facets.normals[at]
                .dot(shape.normal(self.facets.middle(triangle)))
                .abs()
                > LEAST_COSINE
    }

    /// Collects the connected triangles of a shape; with `refits` the shape follows them.
    fn flood(
        &mut self,
        seed: u32,
        shape: &mut Round,
        sigma_m: &mut f64,
        refits: bool,
    ) -> Option<Vec<u32>> {
        let facets = self.facets;
        let smooth = SMOOTH_DEG.to_radians().cos();
        let mut band_m = self.band_m(shape, *sigma_m);
        if !self.lies_on(shape, band_m, seed) {
            return None;
        }
        self.pass += 1;
        self.visited[seed as usize] = self.pass;
        let mut members = vec![seed];
        let (mut next, mut refit_at) = (0, NEIGHBOURHOOD[0]);
        while let Some(&triangle) = members.get(next) {
            next += 1;
            let normal = shape.normal(self.facets.middle(triangle));
            for other in facets.neighbours(triangle) {
                let at = other as usize;
                if self.visited[at] == self.pass
                    || self.is_taken[at]
                    || !self.lies_on(shape, band_m, other)
                    || shape.normal(self.facets.middle(other)).dot(normal) < smooth
                {
                    continue;
                }
                self.visited[at] = self.pass;
                members.push(other);
            }
            if refits && members.len() >= refit_at {
                refit_at = members.len() * 3 / 2;
                let (followed, deviation_m) = self.followed(shape, &members);
                if !self.is_rough(&followed, deviation_m) {
                    return None;
                }
                (*shape, *sigma_m) = (followed, deviation_m);
                band_m = self.band_m(shape, *sigma_m);
            }
        }
        Some(members)
    }

    /// The shape of more triangles. While they are nearly flat its axis may have been that of noise.
    fn followed(&mut self, shape: &Round, members: &[u32]) -> (Round, f64) {
        let points = self.points(members);
        let own = shape.fitted(&points);
        let anew = self.shapes_of(members, &points).into_iter();
        let alike = anew.filter(|(other, _)| other.is_sphere() == shape.is_sphere());
        alike.fold(
            own,
            |best, other| if other.1 < best.1 { other } else { best },
        )
    }

    fn is_round(&mut self, region: &Region) -> bool {
        let Region {
            shape,
            members,
            area_m2,
            sigma_m,
        } = region;
        let radius_m = 1.0 / shape.curvature_per_m.abs().max(1e-9);
        let plane: Fit = self.moments(members).fit();
        members.len() >= NEIGHBOURHOOD[1]
            && *area_m2 >= self.limits.min_area_m2
            && (RADII_M[0]..RADII_M[1]).contains(&radius_m)
            && self.is_rough(shape, *sigma_m)
            && plane.sigma_m > BETTER_THAN_PLANE * sigma_m
            && self.bends(shape, members)
            && self.is_everywhere(shape, *sigma_m, members)
            && self.is_noise(shape, members)
    }

    fn bends(&self, shape: &Round, members: &[u32]) -> bool {
        let normal = |triangle: u32| shape.normal(self.facets.middle(triangle));
        let first = normal(members[0]);
        let cosines = members.iter().map(|&t| normal(t).dot(first));
        // The first may be in the middle.
        cosines.fold(1.0, f64::min) <= (0.5 * LEAST_BEND_DEG).to_radians().cos()
    }

    /// Whether the deviation from a shape is that of most corners: of an exact shape with a part of its neighbour it is not.
    fn is_everywhere(&self, shape: &Round, sigma_m: f64, members: &[u32]) -> bool {
        let corners = members
            .iter()
            .flat_map(|&t| self.facets.corners[t as usize]);
        let mut off_m: Vec<f64> = corners.map(|at| shape.distance_m(at).abs()).collect();
        let middle = off_m.len() / 2;
        let (_, median_m, _) = off_m.select_nth_unstable_by(middle, f64::total_cmp);
        *median_m > LEAST_MEDIAN * sigma_m
    }

    /// Whether the corners' distances from a shape have no pattern: those of neighbours do not depend on each other.
    fn is_noise(&mut self, shape: &Round, members: &[u32]) -> bool {
        let corners = || {
            members
                .iter()
                .map(|&t| (t as usize, self.triangles[t as usize]))
        };
        for (triangle, vertices) in corners() {
            for (corner, vertex) in self.facets.corners[triangle].iter().zip(vertices) {
                self.distances[vertex as usize] = (shape.distance_m(*corner), 0.0, 0);
            }
        }
        for (_, [a, b, c]) in corners() {
            for (of, other) in [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)] {
                let other_m = self.distances[other as usize].0;
                let (_, sum, count) = &mut self.distances[of as usize];
                *sum += other_m;
                *count += 1;
            }
        }
        let (mut along, mut along_squares) = (0.0, 0.0);
        for (triangle, vertices) in corners() {
            for side in 0..3 {
                let ends = [side, (side + 1) % 3];
                let [from, to] = ends.map(|end| self.facets.corners[triangle][end]);
                if shape.is_along(to - from, ALONG_COSINE) {
                    let [a, b] = ends.map(|end| self.distances[vertices[end] as usize].0);
                    along += a * b;
                    along_squares += 0.5 * (a * a + b * b);
                }
            }
        }
        if along > ALONG * along_squares {
            return false;
        }
        let (mut squares, mut noise) = (0.0, 0.0);
        for (_, vertices) in corners() {
            for vertex in vertices {
                // Each neighbour has been counted twice, by the triangles on both sides.
                let (distance_m, sum, count) = self.distances[vertex as usize];
                let [count, neighbours] = [1.0, 0.5].map(|part| part * f64::from(count));
                squares += distance_m * distance_m;
                noise += (distance_m - sum / count).powi(2) / (1.0 + 1.0 / neighbours);
            }
        }
        squares < PATTERN * noise
    }
}
