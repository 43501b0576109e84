//! Groups triangles into surfaces.
//!
//! Triangles are visited from the largest to the smallest. Each one without a surface seeds a plane, which grows over
//! edge neighbours that lie in it; then coinciding planes that do not touch are merged. Every test is against the seed's
//! plane, not a neighbour's: a chain of slightly turned facets does not drift. A surface's plane is the mean of its
//! triangles' planes unless a corner would then exceed [`SAME_PLANE_DISTANCE_M`]: shingles tilted alike have a mean normal
//! that a long row of them does not follow. Corner positions break ties: the order of the mesh has no effect.

use glam::DVec3;

use super::super::mesh::TriangleMesh;
use super::super::spatial_hash::{SpatialHash, cell_of};
use super::super::weld::sorted_edges;

/// Largest angle between the planes of one surface, in degrees.
pub const SAME_PLANE_ANGLE_DEG: f64 = 0.5;

/// Largest distance of a surface's corners from the plane of its largest triangle, in metres.
pub const SAME_PLANE_DISTANCE_M: f64 = 2e-3;

/// Components of a normal smaller than this do not decide its sign.
const SIGN_THRESHOLD: f64 = 1e-6;

/// Edge of a search cell for components of normals, several times [`SAME_PLANE_ANGLE_DEG`] (0.0087).
const NORMAL_CELL: f64 = 0.03;

/// Edge of a search cell for offsets in metres, several times [`SAME_PLANE_DISTANCE_M`].
const OFFSET_CELL_M: f64 = 8e-3;

/// Most planes compared with one: bounds the time on rough ground, where the planes of neighbouring facets nearly
/// coincide.
const MOST_COMPARISONS: usize = 500;

/// Most triangles at one edge that are compared with one of them: bounds the time where thousands meet.
const MOST_AROUND: usize = 256;

const UNASSIGNED: u32 = u32::MAX;

/// A surface in the file's coordinates.
pub(super) struct FoundSurface {
    pub(super) normal: DVec3,
    pub(super) offset_m: f64,
    pub(super) material: u32,
    pub(super) area_m2: f64,
    corner: DVec3,
}

impl FoundSurface {
    pub(super) fn key(&self, material: &str) -> u64 {
        super::key::key(self.normal, self.offset_m, self.corner, material)
    }
}

/// Surfaces in an order that depends on geometry alone, and the surface of each triangle.
pub(super) struct Groups {
    pub(super) surfaces: Vec<FoundSurface>,
    pub(super) triangle_surface: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Plane {
    normal: DVec3,
    offset_m: f64,
}

struct Facet {
    /// Indices of the corners, least position first: equal triangles have equal bits.
    corners: [u32; 3],
    plane: Plane,
    area_m2: f64,
}

/// Surfaces of a clean mesh. Offsets are compared at `centre`, where a tilt has the least effect.
pub(super) fn group(mesh: &TriangleMesh, centre: DVec3) -> Groups {
    let position = |i: u32| mesh.vertices[i as usize].as_dvec3() - centre;
    let facets: Vec<Facet> = mesh
        .triangles
        .iter()
        .map(|&corners| facet(corners, position))
        .collect();
    let mut order: Vec<(u64, [u32; 3], u32)> = facets
        .iter()
        .enumerate()
        // Bits of positive numbers sort as the numbers do; inverted, the largest comes first.
        .map(|(number, f)| (!f.area_m2.to_bits(), f.corners, number as u32))
        .collect();
    order.sort_unstable();
    let order: Vec<u32> = order.into_iter().map(|(_, _, number)| number).collect();

    let fits = |plane: Plane, number: u32| {
        let facet = &facets[number as usize];
        is_parallel(plane.normal, facet.plane.normal)
            && facet
                .corners
                .iter()
                .all(|&i| distance_m(plane, position(i)) <= SAME_PLANE_DISTANCE_M)
    };
    let direction = |number: u32| facets[number as usize].plane.normal.to_array();
    let patches = grow(mesh, &order, direction, |seed, number| {
        fits(facets[seed as usize].plane, number)
    });
    let roots = union(mesh, &facets, &patches, fits);

    // Sums are from the largest triangle down: their rounding depends on geometry alone.
    let mut surfaces: Vec<FoundSurface> = roots
        .seeds
        .iter()
        .map(|&seed| FoundSurface {
            normal: DVec3::ZERO,
            offset_m: 0.0,
            material: mesh.triangle_materials[seed as usize],
            area_m2: 0.0,
            corner: DVec3::INFINITY,
        })
        .collect();
    let triangle_surface: Vec<u32> = patches
        .of_triangle
        .iter()
        .map(|&patch| roots.of_patch[patch as usize])
        .collect();
    for &number in &order {
        let facet = &facets[number as usize];
        let surface = triangle_surface[number as usize] as usize;
        let seed = facets[roots.seeds[surface] as usize].plane.normal;
        let found = &mut surfaces[surface];
        let sign = 1f64.copysign(facet.plane.normal.dot(seed));
        found.normal += sign * facet.area_m2 * facet.plane.normal;
        found.area_m2 += facet.area_m2;
        for i in facet.corners {
            found.corner = found.corner.min(mesh.vertices[i as usize].as_dvec3());
        }
    }
    for found in &mut surfaces {
        found.normal = canonical(found.normal.normalize());
    }
    for &number in &order {
        let facet = &facets[number as usize];
        let found = &mut surfaces[triangle_surface[number as usize] as usize];
        let middle = facet.corners.map(position).into_iter().sum::<DVec3>() / 3.0;
        found.offset_m += facet.area_m2 / found.area_m2 * found.normal.dot(middle);
    }
    let mut deviates = vec![false; surfaces.len()];
    for (facet, &surface) in facets.iter().zip(&triangle_surface) {
        let found = &surfaces[surface as usize];
        let mean = Plane {
            normal: found.normal,
            offset_m: found.offset_m,
        };
        let near = |i| distance_m(mean, position(i)) <= SAME_PLANE_DISTANCE_M;
        deviates[surface as usize] |= !facet.corners.into_iter().all(near);
    }
    for ((found, deviates), &seed) in surfaces.iter_mut().zip(deviates).zip(&roots.seeds) {
        if deviates {
            let plane = facets[seed as usize].plane;
            (found.normal, found.offset_m) = (plane.normal, plane.offset_m);
        }
        found.offset_m += found.normal.dot(centre);
    }
    Groups {
        surfaces,
        triangle_surface,
    }
}

fn facet(mut corners: [u32; 3], position: impl Fn(u32) -> DVec3) -> Facet {
    // A clean mesh's vertices are sorted by position, so their indices are too.
    corners.sort_unstable();
    let [a, b, c] = corners.map(position);
    let cross = (b - a).cross(c - a);
    let normal = canonical(cross.normalize());
    Facet {
        corners,
        plane: Plane {
            normal,
            offset_m: normal.dot((a + b + c) / 3.0),
        },
        area_m2: 0.5 * cross.length(),
    }
}

/// The normal or its opposite: the first component of y, x, z beyond the threshold is positive.
pub(in crate::scene) fn canonical(normal: DVec3) -> DVec3 {
    let leading = [normal.y, normal.x, normal.z]
        .into_iter()
        .find(|component| component.abs() > SIGN_THRESHOLD);
    // Adding zero turns −0 into 0.
    (if leading.is_some_and(|component| component < 0.0) {
        -normal
    } else {
        normal
    }) + DVec3::ZERO
}

/// Whether two unit normals, or opposite ones, differ by [`SAME_PLANE_ANGLE_DEG`] at most.
pub(in crate::scene) fn is_parallel(a: DVec3, b: DVec3) -> bool {
    a.dot(b).abs() >= SAME_PLANE_ANGLE_DEG.to_radians().cos()
}

fn distance_m(plane: Plane, point: DVec3) -> f64 {
    (plane.normal.dot(point) - plane.offset_m).abs()
}

/// Connected triangles of one plane and material.
struct Patches {
    of_triangle: Vec<u32>,
    /// The largest triangle of each patch, largest first.
    seeds: Vec<u32>,
    /// Triangles by patch.
    members: Vec<u32>,
    first_member: Vec<u32>,
}

fn grow(
    mesh: &TriangleMesh,
    order: &[u32],
    direction: impl Fn(u32) -> [f64; 3],
    fits: impl Fn(u32, u32) -> bool,
) -> Patches {
    // `ring[3 t + e]` is the next triangle side along the same edge, cyclically.
    let mut ring = vec![0u32; 3 * mesh.triangles.len()];
    let mut around: Vec<([f64; 3], u32)> = Vec::new();
    for same in sorted_edges(&mesh.triangles).chunk_by(|a, b| a.0 == b.0) {
        around.clear();
        around.extend(same.iter().map(|&(_, side)| ([0.0; 3], side)));
        if around.len() > MOST_AROUND {
            // Most of those of nearly one plane are then near each other.
            for (normal, side) in &mut around {
                *normal = direction(*side / 3);
            }
            around.sort_unstable_by(|a, b| {
                let mut axes = a.0.iter().zip(&b.0).map(|(a, b)| a.total_cmp(b));
                let first = axes.find(|order| order.is_ne());
                first.unwrap_or_else(|| a.1.cmp(&b.1))
            });
        }
        for (i, &(_, side)) in around.iter().enumerate() {
            ring[side as usize] = around[(i + 1) % around.len()].1;
        }
    }
    let mut patches = Patches {
        of_triangle: vec![UNASSIGNED; mesh.triangles.len()],
        seeds: Vec::new(),
        members: Vec::with_capacity(mesh.triangles.len()),
        first_member: Vec::new(),
    };
    for &seed in order {
        if patches.of_triangle[seed as usize] != UNASSIGNED {
            continue;
        }
        let patch = patches.seeds.len() as u32;
        let material = mesh.triangle_materials[seed as usize];
        patches.seeds.push(seed);
        let mut next = patches.members.len();
        patches.first_member.push(next as u32);
        patches.of_triangle[seed as usize] = patch;
        patches.members.push(seed);
        while let Some(&number) = patches.members.get(next) {
            next += 1;
            for side in 3 * number..3 * number + 3 {
                let mut other = ring[side as usize];
                let mut looked_at = 1;
                while other != side && looked_at < MOST_AROUND {
                    looked_at += 1;
                    let neighbour = other / 3;
                    if patches.of_triangle[neighbour as usize] == UNASSIGNED
                        && mesh.triangle_materials[neighbour as usize] == material
                        && fits(seed, neighbour)
                    {
                        patches.of_triangle[neighbour as usize] = patch;
                        patches.members.push(neighbour);
                    }
                    other = ring[other as usize];
                }
            }
        }
    }
    patches.first_member.push(patches.members.len() as u32);
    patches
}

/// Patches that lie in one plane.
struct Roots {
    of_patch: Vec<u32>,
    seeds: Vec<u32>,
}

fn union(
    mesh: &TriangleMesh,
    facets: &[Facet],
    patches: &Patches,
    fits: impl Fn(Plane, u32) -> bool,
) -> Roots {
    let mut index = SpatialHash::new(patches.seeds.len());
    let mut roots = Roots {
        of_patch: Vec::with_capacity(patches.seeds.len()),
        seeds: Vec::new(),
    };
    let reach = SAME_PLANE_ANGLE_DEG.to_radians();
    for (patch, &seed) in patches.seeds.iter().enumerate() {
        let plane = facets[seed as usize].plane;
        let material = mesh.triangle_materials[seed as usize];
        let members = &patches.members
            [patches.first_member[patch] as usize..patches.first_member[patch + 1] as usize];
        let mut found = UNASSIGNED;
        let mut comparisons = 0;
        // A plane near the sign threshold may be stored with the opposite normal.
        for sign in [1.0, -1.0] {
            let at = |shift: f64| {
                let n = sign * plane.normal + DVec3::splat(shift * reach);
                let offset_m = sign * plane.offset_m + shift * SAME_PLANE_DISTANCE_M;
                cells(n, offset_m)
            };
            index.visit(at(-1.0), at(1.0), |root| {
                comparisons += 1;
                if root >= found {
                    return comparisons < MOST_COMPARISONS;
                }
                let other_seed = roots.seeds[root as usize];
                let other = facets[other_seed as usize].plane;
                let side = 1f64.copysign(plane.normal.dot(other.normal));
                if mesh.triangle_materials[other_seed as usize] == material
                    && (other.offset_m - side * plane.offset_m).abs() <= SAME_PLANE_DISTANCE_M
                    && members.iter().all(|&number| fits(other, number))
                {
                    found = root;
                }
                comparisons < MOST_COMPARISONS
            });
        }
        if found == UNASSIGNED {
            found = index.insert(cells(plane.normal, plane.offset_m));
            roots.seeds.push(seed);
        }
        roots.of_patch.push(found);
    }
    roots
}

fn cells(normal: DVec3, offset_m: f64) -> [i64; 4] {
    let [x, y, z] = normal.to_array().map(|value| cell_of(value, NORMAL_CELL));
    [x, y, z, cell_of(offset_m, OFFSET_CELL_M)]
}
