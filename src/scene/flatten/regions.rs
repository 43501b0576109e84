//! Regions of rough triangles around a common plane, by region growing.
//!
//! A seed's neighbourhood gives a first plane; the region grows over neighbours within a band around it, whose width follows
//! the noise of the members, and the plane is fitted again whenever the region has grown by half. Curved regions are left
//! alone. Source: region growing as in \[RABBANI06\], adapted to noise of the size of the triangles. Own: the band.

use super::facets::{Facets, LEAST_COSINE, NONE};
use super::plane_fit::{Fit, Moments, Plane, TERMS, curved_share};

/// Triangles of a first neighbourhood: most, and least.
const NEIGHBOURHOOD: [usize; 2] = [40, 8];

/// Width of the band around the plane on either side, in standard deviations of the members: of 100,000 normally distributed
/// corners less than one lies outside.
const BAND: f64 = 4.5;

/// The same for a triangle with a neighbour inside the region.
const WIDE_BAND: f64 = 6.0;

/// Added to the band in metres: rounding.
const BAND_M: f64 = 1e-3;

/// Largest standard deviation of a region relative to the tolerance: then nearly all corners are within it.
const SIGMA_SHARE: f64 = 1.0 / 3.0;

/// Standard deviation in metres below which a region is flat already.
pub(super) const FLAT_M: f64 = 2e-5;

/// Least cosine of a triangle's angle to a region that surrounds it: 75 degrees.
const SURROUNDED_COSINE: f64 = 0.26;

/// Largest share of the squared distances that curvature may explain; of noise a polynomial explains its own number of terms
/// in the number of corners.
const CURVED_SHARE: f64 = 0.2;

/// Rounds of exchanging triangles between regions.
const EXCHANGES: usize = 4;

/// Most regions that others are joined with: the largest.
const MOST_COMPARED: usize = 2000;

/// Two regions have one plane if its standard deviation exceeds the greater of theirs by less, relative, and in metres.
const SAME_PLANE: (f64, f64) = (1.05, 3e-4);

/// Least cosine between the normals of two regions of one plane, before their joint fit.
const SAME_NORMAL: f64 = 0.999;

/// A region: its plane, and sums over its triangles.
pub(super) struct Region {
    pub(super) moments: Moments,
    pub(super) fit: Fit,
    pub(super) triangles: usize,
}

/// All regions.
pub(super) struct Regions {
    pub(super) regions: Vec<Region>,
    /// Region of each triangle, or [`NONE`].
    pub(super) of_triangle: Vec<u32>,
}

/// Largest distance and least area of regions.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) tolerance_m: f64,
    pub(super) min_area_m2: f64,
}

impl Limits {
    pub(super) fn band_m(&self, deviations: f64, sigma_m: f64) -> f64 {
        (deviations * sigma_m + BAND_M).min(self.tolerance_m)
    }

    pub(super) fn is_rough(&self, sigma_m: f64) -> bool {
        sigma_m < SIGMA_SHARE * self.tolerance_m
    }
}

/// Scratch memory of a search.
struct Search<'a> {
    facets: &'a Facets,
    limits: Limits,
    of_triangle: Vec<u32>,
    /// The last pass that has visited each triangle.
    visited: Vec<u32>,
    pass: u32,
    members: Vec<u32>,
}

/// Regions of at least the least area. `order` has the triangles in an order that depends on geometry alone.
pub(super) fn find(facets: &Facets, order: &[u32], limits: Limits) -> Regions {
    let mut search = Search {
        facets,
        limits,
        of_triangle: vec![NONE; facets.len()],
        visited: vec![0; facets.len()],
        pass: 0,
        members: Vec::new(),
    };
    let mut regions = 0;
    // Triangles of failed searches are no seeds again.
    let mut is_tried = vec![false; facets.len()];
    for &seed in order {
        let at = seed as usize;
        if !facets.is_rough[at] || is_tried[at] || search.of_triangle[at] != NONE {
            continue;
        }
        if search.grow(seed) {
            for &triangle in &search.members {
                search.of_triangle[triangle as usize] = regions;
            }
            regions += 1;
        } else {
            for &triangle in &search.members {
                is_tried[triangle as usize] = true;
            }
        }
    }
    let mut found = Regions {
        regions: Vec::new(),
        of_triangle: search.of_triangle,
    };
    found.refit(facets, regions as usize);
    for _ in 0..EXCHANGES {
        found.exchange(facets, limits);
        found.refit(facets, regions as usize);
    }
    found.drop_curved(facets, limits);
    found.join(facets);
    found
}

impl Search<'_> {
    /// Collects the region around a seed into `members`. Returns whether it is one.
    fn grow(&mut self, seed: u32) -> bool {
        let Some(mut fit) = self.neighbourhood(seed) else {
            return false;
        };
        let mut refits = true;
        for _ in 0..3 {
            let Some(moments) = self.flood(seed, &mut fit, refits) else {
                return false;
            };
            fit = moments.fit();
            if !self.limits.is_rough(fit.sigma_m) {
                return false;
            }
            refits = false;
        }
        let moments = self.moments();
        self.members.len() >= NEIGHBOURHOOD[1]
            && moments.area_m2 >= self.limits.min_area_m2
            && fit.sigma_m > FLAT_M
            && !is_curved(self.facets, &self.members, &fit, &moments)
    }

    fn moments(&self) -> Moments {
        let mut moments = Moments::NONE;
        for &triangle in &self.members {
            self.add(&mut moments, triangle);
        }
        moments
    }

    fn add(&self, moments: &mut Moments, triangle: u32) {
        let at = triangle as usize;
        moments.add(&self.facets.corners[at], self.facets.areas_m2[at]);
    }

    /// The plane of the nearest triangles around a seed.
    fn neighbourhood(&mut self, seed: u32) -> Option<Fit> {
        let facets = self.facets;
        self.begin(seed);
        let mut next = 0;
        while let Some(&triangle) = self.members.get(next) {
            next += 1;
            for other in facets.neighbours(triangle) {
                let at = other as usize;
                if self.members.len() < NEIGHBOURHOOD[0]
                    && self.visited[at] != self.pass
                    && self.of_triangle[at] == NONE
                    && facets.cosine(triangle, other) > LEAST_COSINE
                {
                    self.visited[at] = self.pass;
                    self.members.push(other);
                }
            }
        }
        let first = self.moments().fit();
        self.members
            .retain(|&t| facets.normals[t as usize].dot(first.plane.normal).abs() > LEAST_COSINE);
        if self.members.len() < NEIGHBOURHOOD[1] {
            return None;
        }
        let fit = self.moments().fit();
        self.limits.is_rough(fit.sigma_m).then_some(fit)
    }

    fn begin(&mut self, seed: u32) {
        self.pass += 1;
        self.members.clear();
        self.members.push(seed);
        self.visited[seed as usize] = self.pass;
    }

    /// Collects the connected triangles of a plane; with `refits` the plane follows them.
    fn flood(&mut self, seed: u32, fit: &mut Fit, refits: bool) -> Option<Moments> {
        let facets = self.facets;
        self.begin(seed);
        let fits = |fit: &Fit, band_m: f64, triangle: u32| {
            let at = triangle as usize;
            let near = |corner: &glam::DVec3| fit.plane.distance_m(*corner).abs() <= band_m;
            facets.normals[at].dot(fit.plane.normal).abs() > LEAST_COSINE
                && facets.corners[at].iter().all(near)
        };
        let mut band_m = self.limits.band_m(BAND, fit.sigma_m);
        if !fits(fit, band_m, seed) {
            return None;
        }
        let mut moments = Moments::NONE;
        self.add(&mut moments, seed);
        let (mut next, mut refit_at) = (0, NEIGHBOURHOOD[0]);
        while let Some(&triangle) = self.members.get(next) {
            next += 1;
            for other in facets.neighbours(triangle) {
                let at = other as usize;
                if self.visited[at] == self.pass
                    || self.of_triangle[at] != NONE
                    || !fits(fit, band_m, other)
                {
                    continue;
                }
                self.visited[at] = self.pass;
                self.members.push(other);
                self.add(&mut moments, other);
            }
            if refits && self.members.len() >= refit_at {
                refit_at = self.members.len() * 3 / 2;
                *fit = moments.fit();
                band_m = self.limits.band_m(BAND, fit.sigma_m);
            }
        }
        Some(moments)
    }
}

/// Whether the distances of triangles from their plane are curvature rather than roughness.
fn is_curved(facets: &Facets, triangles: &[u32], fit: &Fit, moments: &Moments) -> bool {
    let corners = triangles.iter().flat_map(|&triangle| {
        let weight = facets.areas_m2[triangle as usize];
        facets.corners[triangle as usize].map(|corner| (corner, weight))
    });
    // About half as many corners as triangles.
    let independent = 0.5 * triangles.len() as f64;
    let share = curved_share(corners, fit, moments.middle());
    share > CURVED_SHARE + TERMS as f64 / independent
}

impl Regions {
    /// Dissolves regions that have become too rough or curved.
    fn drop_curved(&mut self, facets: &Facets, limits: Limits) {
        let mut members = vec![Vec::new(); self.regions.len()];
        for (triangle, &region) in (0..).zip(&self.of_triangle) {
            if let Some(members) = members.get_mut(region as usize) {
                members.push(triangle);
            }
        }
        for (region, members) in self.regions.iter_mut().zip(&members) {
            let (fit, moments) = (region.fit, region.moments);
            let keeps = limits.is_rough(fit.sigma_m) && !is_curved(facets, members, &fit, &moments);
            if !keeps {
                members
                    .iter()
                    .for_each(|&t| self.of_triangle[t as usize] = NONE);
                region.triangles = 0;
            }
        }
    }

    /// Fits every region's plane to its triangles.
    fn refit(&mut self, facets: &Facets, count: usize) {
        let mut moments = vec![(Moments::NONE, 0); count];
        for (triangle, &region) in self.of_triangle.iter().enumerate() {
            if let Some((moments, triangles)) = moments.get_mut(region as usize) {
                moments.add(&facets.corners[triangle], facets.areas_m2[triangle]);
                *triangles += 1;
            }
        }
        let region = |(moments, triangles): (Moments, usize)| Region {
            fit: moments.fit(),
            moments,
            triangles,
        };
        self.regions = moments.into_iter().map(region).collect();
    }

    fn squares_m2(&self, facets: &Facets, triangle: u32, region: u32) -> f64 {
        let plane = self.regions[region as usize].fit.plane;
        let corners = facets.corners[triangle as usize].iter();
        corners.map(|&c| plane.distance_m(c).powi(2)).sum()
    }

    /// Moves triangles at the border of regions into the neighbouring region that they fit best.
    fn exchange(&mut self, facets: &Facets, limits: Limits) {
        let before = self.of_triangle.clone();
        for triangle in 0..facets.len() as u32 {
            let own = before[triangle as usize];
            let mut best = (f64::INFINITY, NONE);
            if own != NONE {
                best = (self.squares_m2(facets, triangle, own), own);
            }
            let is_inside = |other: &u32| before[*other as usize] != NONE;
            if own == NONE && facets.neighbours(triangle).filter(is_inside).count() < 2 {
                continue;
            }
            for other in facets.neighbours(triangle) {
                let region = before[other as usize];
                if region == NONE || region == best.1 {
                    continue;
                }
                let fit = &self.regions[region as usize].fit;
                let squares_m2 = self.squares_m2(facets, triangle, region);
                let cosine = facets.normals[triangle as usize]
                    .dot(fit.plane.normal)
                    .abs();
                let least = if own == NONE {
                    SURROUNDED_COSINE
                } else {
                    LEAST_COSINE
                };
                let band_m = limits.band_m(WIDE_BAND, fit.sigma_m);
                let near = facets.corners[triangle as usize]
                    .iter()
                    .all(|&corner| fit.plane.distance_m(corner).abs() <= band_m);
                if near && cosine > least && squares_m2 < best.0 {
                    best = (squares_m2, region);
                }
            }
            self.of_triangle[triangle as usize] = best.1;
        }
    }

    /// Joins regions whose common plane fits both as well as their own.
    fn join(&mut self, facets: &Facets) {
        let count = self.regions.len();
        let mut order: Vec<u32> = (0..count as u32)
            .filter(|&region| self.regions[region as usize].triangles > 0)
            .collect();
        let area = |r: &u32| self.regions[*r as usize].moments.area_m2;
        order.sort_by(|a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
        // The joined regions so far, largest first: their sums, least deviations and new numbers.
        let mut joined: Vec<(Moments, f64, u32)> = Vec::new();
        let mut number = vec![NONE; count];
        for region in order {
            let Region { moments, fit, .. } = &self.regions[region as usize];
            let compared = joined.iter_mut().take(MOST_COMPARED);
            let found = compared.into_iter().find(|(other, sigma_m, _)| {
                let own = other.fit();
                if own.plane.normal.dot(fit.plane.normal).abs() < SAME_NORMAL {
                    return false;
                }
                let together = other.join(moments).fit();
                let greater_m = sigma_m.max(fit.sigma_m);
                // Each of them on its own: a small one has no weight in the sum.
                let part_m = moments.variance_about(together.plane).sqrt();
                let bound_m = SAME_PLANE.0 * greater_m + SAME_PLANE.1;
                together.sigma_m < bound_m && part_m < SAME_PLANE.0 * fit.sigma_m + SAME_PLANE.1
            });
            number[region as usize] = match found {
                Some((other, sigma_m, number)) => {
                    *other = other.join(moments);
                    *sigma_m = sigma_m.max(fit.sigma_m);
                    *number
                }
                None => {
                    joined.push((*moments, fit.sigma_m, joined.len() as u32));
                    joined.len() as u32 - 1
                }
            };
        }
        for region in &mut self.of_triangle {
            if let Some(new) = number.get(*region as usize) {
                *region = *new;
            }
        }
        self.refit(facets, joined.len());
    }

    /// The planes of all regions.
    pub(super) fn planes(&self) -> Vec<Plane> {
        self.regions.iter().map(|region| region.fit.plane).collect()
    }
}
