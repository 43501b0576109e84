//! Curved reflectors: regions of facets that approximate a sphere or a cylinder.
//!
//! Control side. A dome, a barrel vault, a bent wall or a round column is a mesh of flat facets, and as a set of flat mirrors
//! each tessellation is another room. Regions of facets whose corners lie on one sphere or cylinder are found by growth from a
//! seed's neighbourhood; they reflect as the smooth surface ([`crate::propagation::curved_reflection`]). Own.

mod fit;

use glam::{DVec3, Vec3};

use super::super::mesh::TriangleMesh;
use super::super::weld::sorted_edges;
use super::{Surface, key};
use crate::binary::stored;
pub use fit::CurvedShape;

/// No neighbour, no curved surface.
const NONE: u32 = u32::MAX;

/// Greatest angle in degrees between neighbouring facets of a smooth surface: a column of twelve facets counts as round, one
/// of eight has edges.
const SMOOTH_DEG: f64 = 31.0;

/// Least angle in degrees between a seed and some neighbour: below it a region is flat.
const LEAST_TURN_DEG: f64 = 0.2;

/// Triangles of a seed's neighbourhood, tried in this order: a large one resolves slight curvature, a small one fits between
/// other surfaces. Where no shape fits the smallest one, the seed is given up: most facets of a terrain are.
const NEIGHBOURHOODS: [usize; 3] = [32, 16, SMALLEST];
const SMALLEST: usize = 8;

/// Least angle in degrees that a curved surface turns by, and least number of different normals across it.
const LEAST_BEND_DEG: f64 = 15.0;
const LEAST_NORMALS: usize = 4;

/// Largest distance of a facet's corner from the shape: a part of the radius, and metres for rounding.
const TOLERANCE: (f64, f64) = (5e-4, 2e-4);

/// Angle in degrees by which a facet's normal may differ from the shape's at its middle beyond half of its width.
const NORMAL_DEG: f64 = 2.0;

/// Part of the fit's largest angle to a cylinder's axis that its members may have: a sphere that continues a vault is no part of it,
/// and the axis of all members, which is slightly another one, still fits them.
const FITTING: f64 = 0.8;

/// Most curved surfaces that are combined with mirror planes, the largest ones, and least part of the scene's area that each
/// has: what reflects less is late energy.
const MOST_COMBINED: usize = 4;
const LEAST_COMBINED: f64 = 0.01;

/// Distance in metres by which a plane may miss the centre or the axis of a shape that it mirrors onto itself.
const PRESERVED_M: f64 = 5e-3;

/// Most curved surfaces of a scene, the largest ones; others stay facets.
const MOST_CURVED: usize = 128;

/// One curved surface, in local coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvedSurface {
    /// Identity across commits: a hash of shape, position and material name.
    pub key: u64,
    /// The smooth shape.
    pub shape: CurvedShape,
    /// Unit vector from the shape's centre or axis towards the middle of the surface.
    pub towards: DVec3,
    /// Half of its extent in metres: around, and along the axis of a cylinder.
    pub half_m: [f64; 2],
    /// Area of its facets in m².
    pub area_m2: f64,
    /// Longest side of a facet in metres.
    pub facet_m: f64,
    /// Largest distance of a facet from the shape in metres.
    pub unevenness_m: f64,
}

impl CurvedSurface {
    /// Whether a plane mirrors the shape onto itself, such as a floor through a dome's centre or a vault's end wall: paths may
    /// meet the surface before and after it.
    pub(crate) fn is_preserved_by(&self, plane: &Surface) -> bool {
        let shape = &self.shape;
        let off_m = |point: DVec3| plane.distance_m(point).abs();
        match shape.axis {
            Some(axis) if plane.normal.dot(axis).abs() > 0.5 => {
                plane.normal.cross(axis).length() * shape.radius_m < PRESERVED_M
            }
            Some(axis) => {
                let end = |side: f64| shape.centre + side * self.half_m[1] * axis;
                off_m(end(1.0)).max(off_m(end(-1.0))) < PRESERVED_M
            }
            None => off_m(shape.centre) < PRESERVED_M,
        }
    }
}

/// The curved surfaces of a mesh, largest first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CurvedSurfaces {
    pub(in crate::scene) list: Vec<CurvedSurface>,
    /// Index of the curved surface of each triangle, or [`NONE`]; empty without curved surfaces.
    of_triangle: Vec<u32>,
    /// Number of curved surfaces that are combined with mirror planes, from the first.
    pub(in crate::scene) combined: u32,
}

impl CurvedSurfaces {
    /// The curved surface of a triangle.
    #[inline]
    pub(in crate::scene) fn of_triangle(&self, triangle: u32) -> Option<u32> {
        let found = self.of_triangle.get(triangle as usize).copied();
        found.filter(|&index| index != NONE)
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.list.as_slice()) + size_of_val(self.of_triangle.as_slice())
    }

    /// Finds the curved surfaces of a clean mesh of at least `min_area_m2`. `centre` is the origin of `vertices`.
    pub(super) fn find(
        mesh: &TriangleMesh,
        centre: DVec3,
        vertices: &[Vec3],
        min_area_m2: f64,
    ) -> Self {
        let facets = Facets::of(mesh, vertices);
        let mut marks = Marks {
            is_taken: vec![false; mesh.triangles.len()],
            is_tried: vec![false; mesh.triangles.len()],
            visited: vec![0; mesh.triangles.len()],
            pass: 0,
        };
        let mut found: Vec<(CurvedSurface, Vec<u32>)> = Vec::new();
        for seed in facets.seeds(mesh) {
            if marks.is_taken[seed as usize] || marks.is_tried[seed as usize] {
                continue;
            }
            let nearest = facets.flood(&mut marks, seed, SMALLEST, |_| true);
            if facets.shape_of(&nearest).is_none() {
                continue;
            }
            let mut regions = NEIGHBOURHOODS.iter();
            let region = regions.find_map(|&most| facets.region(&mut marks, seed, most));
            let Some((shape, members)) = region else {
                continue;
            };
            for &facet in &members {
                marks.is_taken[facet as usize] = true;
            }
            let surface = facets.surface(shape, &members);
            if surface.area_m2 >= min_area_m2 {
                found.push((surface, members));
            }
        }
        for (surface, members) in &mut found {
            let material = mesh.triangle_materials[members[0] as usize] as usize;
            let shape = &surface.shape;
            surface.key = key::key(
                shape.axis.unwrap_or(DVec3::ZERO),
                shape.radius_m,
                shape.centre + centre,
                &mesh.material_names[material],
            );
        }
        found.sort_by(|(a, _), (b, _)| b.area_m2.total_cmp(&a.area_m2).then(a.key.cmp(&b.key)));
        found.truncate(MOST_CURVED);
        let least_m2 = LEAST_COMBINED * facets.areas_m2.iter().sum::<f64>();
        let large = found.iter().take(MOST_COMBINED);
        let combined = large.filter(|(surface, _)| surface.area_m2 >= least_m2);
        let combined = combined.count() as u32;
        let keys: Vec<u64> = found.iter().map(|(surface, _)| surface.key).collect();
        let mut result = Self {
            combined,
            ..Self::default()
        };
        if !found.is_empty() {
            result.of_triangle = vec![NONE; mesh.triangles.len()];
        }
        for ((index, (mut surface, members)), key) in (0..).zip(found).zip(key::distinct(&keys)) {
            surface.key = key;
            result.list.push(surface);
            members
                .iter()
                .for_each(|&t| result.of_triangle[t as usize] = index);
        }
        result
    }
}

stored!(CurvedSurface {
    key: u64,
    shape: CurvedShape,
    towards: DVec3,
    half_m: [f64; 2],
    area_m2: f64,
    facet_m: f64,
    unevenness_m: f64,
});

stored!(CurvedSurfaces {
    list: Vec<CurvedSurface>,
    of_triangle: Vec<u32>,
    combined: u32,
});

impl CurvedSurfaces {
    /// Whether surfaces that were loaded have all that queries rely on, for a mesh of `triangles`.
    pub(super) fn is_consistent(&self, triangles: usize) -> bool {
        let count = self.list.len() as u32;
        let lists = [0, triangles].contains(&self.of_triangle.len());
        let mut shapes = self.list.iter().map(|surface| &surface.shape);
        lists
            && self.combined <= count
            && self
                .of_triangle
                .iter()
                .all(|&index| index < count || index == NONE)
            && shapes.all(|shape| shape.centre.is_finite() && shape.radius_m > 0.0)
            && self.list.iter().all(|surface| surface.towards.is_finite())
    }
}

/// Facets with their neighbours.
struct Facets {
    corners: Vec<[DVec3; 3]>,
    normals: Vec<DVec3>,
    areas_m2: Vec<f64>,
    /// Neighbours of the same material across sides that are smooth.
    neighbours: Vec<[u32; 3]>,
    /// Whether a facet and some neighbour differ in direction.
    bends: Vec<bool>,
}

/// Which facets are taken by a curved surface, or lie on a shape that is none, and the last pass that has visited each.
struct Marks {
    is_taken: Vec<bool>,
    is_tried: Vec<bool>,
    visited: Vec<u32>,
    pass: u32,
}

impl Marks {
    /// Facets of a region that is no curved surface are no seeds: each would find the same region.
    fn reject<T>(&mut self, members: &[u32]) -> Option<T> {
        for &facet in members {
            self.is_tried[facet as usize] = true;
        }
        None
    }
}

impl Facets {
    fn of(mesh: &TriangleMesh, vertices: &[Vec3]) -> Self {
        let count = mesh.triangles.len();
        let position = |v: u32| vertices[v as usize].as_dvec3();
        let corners: Vec<[DVec3; 3]> = mesh.triangles.iter().map(|t| t.map(position)).collect();
        let crosses = corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a));
        let (normals, areas_m2): (Vec<DVec3>, Vec<f64>) = crosses
            .map(|cross| (cross.normalize_or_zero(), 0.5 * cross.length()))
            .unzip();
        let mut facets = Self {
            corners,
            normals,
            areas_m2,
            neighbours: vec![[NONE; 3]; count],
            bends: vec![false; count],
        };
        let [turned, smooth] = [LEAST_TURN_DEG, SMOOTH_DEG].map(|angle| angle.to_radians().cos());
        for same in sorted_edges(&mesh.triangles).chunk_by(|a, b| a.0 == b.0) {
            let [(_, a), (_, b)] = *same else { continue };
            let [s, t] = [a / 3, b / 3].map(|side| side as usize);
            let cosine = facets.normals[s].dot(facets.normals[t]).abs();
            if cosine < smooth || mesh.triangle_materials[s] != mesh.triangle_materials[t] {
                continue;
            }
            facets.neighbours[s][a as usize % 3] = t as u32;
            facets.neighbours[t][b as usize % 3] = s as u32;
            if cosine < turned {
                (facets.bends[s], facets.bends[t]) = (true, true);
            }
        }
        facets
    }

    /// Facets that bend, in an order that depends on geometry alone: a clean mesh's vertices are sorted by position.
    fn seeds(&self, mesh: &TriangleMesh) -> Vec<u32> {
        let mut seeds: Vec<([u32; 3], u32)> = (0..)
            .zip(&mesh.triangles)
            .filter(|(index, _)| self.bends[*index as usize])
            .map(|(index, corners)| {
                let mut corners = *corners;
                corners.sort_unstable();
                (corners, index)
            })
            .collect();
        seeds.sort_unstable();
        seeds.into_iter().map(|(_, index)| index).collect()
    }

    /// The shape around a seed and the facets that lie on it, if it is curved enough.
    fn region(&self, marks: &mut Marks, seed: u32, most: usize) -> Option<(CurvedShape, Vec<u32>)> {
        let near = self.flood(marks, seed, most, |_| true);
        let mut shape = self.shape_of(&near)?;
        let mut members = Vec::new();
        // The shape of the whole region is more accurate than that of the first facets.
        for _ in 0..2 {
            members = self.flood(marks, seed, usize::MAX, |facet| self.lies_on(&shape, facet));
            shape = match self.shape_of(&members) {
                Some(shape) => shape,
                None => return marks.reject(&members),
            };
        }
        match self.is_curved(&shape, &members) {
            true => Some((shape, members)),
            false => marks.reject(&members),
        }
    }

    /// Connected facets from a seed on, nearest first.
    fn flood(
        &self,
        marks: &mut Marks,
        seed: u32,
        most: usize,
        fits: impl Fn(u32) -> bool,
    ) -> Vec<u32> {
        marks.pass += 1;
        let mut members = Vec::new();
        if fits(seed) {
            marks.visited[seed as usize] = marks.pass;
            members.push(seed);
        }
        let mut next = 0;
        while let Some(&facet) = members.get(next) {
            next += 1;
            for other in self.neighbours[facet as usize] {
                if other != NONE
                    && members.len() < most
                    && marks.visited[other as usize] != marks.pass
                    && !marks.is_taken[other as usize]
                    && fits(other)
                {
                    marks.visited[other as usize] = marks.pass;
                    members.push(other);
                }
            }
        }
        members
    }

    /// The cylinder or sphere through all corners of some facets.
    fn shape_of(&self, members: &[u32]) -> Option<CurvedShape> {
        let facets = || members.iter().map(|&t| t as usize);
        let corners = || facets().flat_map(|t| self.corners[t]);
        let areas = facets().map(|t| self.areas_m2[t] * self.normals[t]);
        let shape = fit::fit(corners, areas)?;
        corners()
            .all(|corner| shape.distance_m(corner).abs() <= tolerance_m(&shape))
            .then_some(shape)
    }

    /// Whether a facet approximates a shape: its corners lie on it, and its direction is the shape's at its middle.
    fn lies_on(&self, shape: &CurvedShape, facet: u32) -> bool {
        let corners = &self.corners[facet as usize];
        let near = |corner: &DVec3| shape.distance_m(*corner).abs() <= tolerance_m(shape);
        if !corners.iter().all(near) {
            return false;
        }
        let half_width = (0.5 * longest_side_m(corners) / shape.radius_m)
            .min(1.0)
            .asin();
        let most = half_width.min(SMOOTH_DEG.to_radians()) + NORMAL_DEG.to_radians();
        let middle = corners.iter().copied().sum::<DVec3>() / 3.0;
        let normal = self.normals[facet as usize];
        shape.normal(middle).dot(normal).abs() >= most.cos()
            && shape
                .axis
                .is_none_or(|axis| fit::is_across(normal, axis, FITTING))
    }

    /// Whether facets bend enough, in enough steps.
    fn is_curved(&self, shape: &CurvedShape, members: &[u32]) -> bool {
        let normal = |facet: &u32| {
            let corners = self.corners[*facet as usize];
            let outward = shape.normal(corners.into_iter().sum::<DVec3>() / 3.0);
            let own = self.normals[*facet as usize];
            own * 1f64.copysign(own.dot(outward))
        };
        let first = members.first().map_or(DVec3::ZERO, normal);
        let (x, y) = first.any_orthonormal_pair();
        // Different directions, each by its angles from the first.
        let step = LEAST_TURN_DEG.to_radians();
        let mut directions: Vec<[i64; 3]> = members
            .iter()
            .map(|facet| {
                let n = normal(facet);
                [n.dot(x), n.dot(y), n.dot(first)].map(|c| (c / step).round() as i64)
            })
            .collect();
        directions.sort_unstable();
        directions.dedup();
        let least = members
            .iter()
            .map(|f| normal(f).dot(first))
            .fold(1.0, f64::min);
        // The first may be in the middle.
        directions.len() >= LEAST_NORMALS && least <= (0.5 * LEAST_BEND_DEG).to_radians().cos()
    }

    /// A curved surface of these facets, without its key.
    fn surface(&self, shape: CurvedShape, members: &[u32]) -> CurvedSurface {
        let corners = || members.iter().flat_map(|&t| self.corners[t as usize]);
        let mean = corners().map(|corner| shape.radial(corner)).sum::<DVec3>();
        // Around a whole ring the mean vanishes.
        let mean = mean.normalize_or(shape.normal(self.corners[members[0] as usize][0]));
        let least = corners()
            .map(|corner| shape.normal(corner).dot(mean))
            .fold(1.0, f64::min);
        let around_m = shape.radius_m * least.clamp(-1.0, 1.0).acos();
        let mut shape = shape;
        let along_m = match shape.axis {
            None => around_m,
            Some(axis) => {
                let heights = corners().map(|corner| (corner - shape.centre).dot(axis));
                let (low, high) =
                    heights.fold((f64::MAX, f64::MIN), |(l, h), at| (l.min(at), h.max(at)));
                shape.centre += 0.5 * (low + high) * axis;
                0.5 * (high - low)
            }
        };
        let middles = members.iter().flat_map(|&t| {
            let [a, b, c] = self.corners[t as usize];
            [
                (a + b + c) / 3.0,
                0.5 * (a + b),
                0.5 * (b + c),
                0.5 * (c + a),
            ]
        });
        CurvedSurface {
            key: 0,
            shape,
            towards: mean,
            half_m: [around_m, along_m],
            area_m2: members.iter().map(|&t| self.areas_m2[t as usize]).sum(),
            facet_m: members
                .iter()
                .map(|&t| longest_side_m(&self.corners[t as usize]))
                .fold(0.0, f64::max),
            unevenness_m: middles
                .map(|at| shape.distance_m(at).abs())
                .fold(0.0, f64::max),
        }
    }
}

fn tolerance_m(shape: &CurvedShape) -> f64 {
    TOLERANCE.0 * shape.radius_m + TOLERANCE.1
}

fn longest_side_m([a, b, c]: &[DVec3; 3]) -> f64 {
    a.distance(*b).max(b.distance(*c)).max(c.distance(*a))
}
