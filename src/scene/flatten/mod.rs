//! Acoustic surfaces of rough meshes: planes, spheres and cylinders fitted to regions of triangles, onto which the triangles are
//! moved.
//!
//! Control side. A scanned wall has no two triangles in one plane, although no wavelength in use resolves its millimetres.
//! Regions of connected triangles that scatter around a plane within a tolerance are found ([`regions`]), their planes are
//! fitted by least squares and made perpendicular where noise permits ([`right_angles`]); of what is left, regions around a sphere or
//! a cylinder are found ([`round_regions`]). Their vertices are moved onto
//! them ([`snap`]), and triangles that a scan lacks are added ([`fill`]). What follows (surfaces, edges, rays) sees flat walls that meet in straight edges. The roughness that is
//! lost becomes scattering by band ([`roughness`]). A mesh without such regions keeps its bits. Own.

mod facets;
mod fill;
mod plane_fit;
mod regions;
mod right_angles;
pub(in crate::scene) mod roughness;
mod round_fit;
mod round_regions;
mod snap;

use glam::{DVec3, Vec3};

use super::mesh::TriangleMesh;
use facets::{Facets, NONE};
use regions::Limits;
use roughness::Roughness;
use round_regions::RoundRegions;
use snap::Shape;

/// A mesh with flat regions.
pub(super) struct Flattened {
    pub(super) mesh: TriangleMesh,
    /// The roughness that each triangle had.
    pub(super) roughness: Vec<Roughness>,
    /// Number of regions.
    pub(super) regions: usize,
}

/// Flattens the rough regions of a clean mesh within a tolerance in metres; none if there is nothing to flatten. Regions of
/// less than `min_area_m2` are left alone.
pub(super) fn flattened(
    mesh: &TriangleMesh,
    centre: DVec3,
    tolerance_m: f64,
    min_area_m2: f64,
) -> Option<Flattened> {
    let facets = Facets::of(mesh, centre);
    if !facets.is_rough.contains(&true) {
        return None;
    }
    let limits = Limits {
        tolerance_m,
        min_area_m2,
    };
    let order = by_position(mesh);
    let regions = regions::find(&facets, &order, limits);
    let round = round_regions::find(
        &facets,
        &mesh.triangles,
        mesh.vertices.len(),
        &regions.of_triangle,
        &order,
        limits,
    );
    if regions.regions.is_empty() && round.shapes.is_empty() {
        return None;
    }
    let planes = right_angles::regularised(&regions);
    let positions = mesh.vertices.iter().map(|v| v.as_dvec3() - centre);
    let positions: Vec<DVec3> = positions.collect();
    let flat = planes.iter().map(|&plane| Shape::Flat(plane));
    let shapes = flat.chain(round.shapes.iter().map(|&shape| Shape::Round(shape)));
    let shapes: Vec<Shape> = shapes.collect();
    let shape_of: Vec<u32> = regions
        .of_triangle
        .iter()
        .zip(&round.of_triangle)
        .map(|(&flat, &round)| match round {
            NONE => flat,
            round => planes.len() as u32 + round,
        })
        .collect();
    let moved = snap::snapped(
        &facets,
        &mesh.triangles,
        &positions,
        (&shape_of, &shapes),
        tolerance_m,
    );
    let mut result = mesh.clone();
    let mut after = positions.clone();
    for ((vertex, at), to) in result.vertices.iter_mut().zip(&mut after).zip(moved) {
        if let Some(to) = to {
            *vertex = (to + centre).as_vec3() + Vec3::ZERO;
            *at = to;
        }
    }
    let round_roughness = round.roughness(&facets);
    let mut roughness: Vec<Roughness> = (0..facets.len())
        .map(|triangle| {
            let area_m2 = facets.areas_m2[triangle];
            if let Some(of) = round_roughness.get(round.of_triangle[triangle] as usize) {
                return of.over(area_m2);
            }
            match regions.of_triangle[triangle] {
                NONE => Roughness::flat(area_m2),
                region => Roughness::of(
                    &facets.corners[triangle],
                    facets.normals[triangle],
                    area_m2,
                    planes[region as usize],
                ),
            }
        })
        .collect();
    for (corners, beside) in fill::closing(&facets, &mesh.triangles, &after, &regions, &planes) {
        result.triangles.push(corners);
        let material = mesh.triangle_materials[beside as usize];
        result.triangle_materials.push(material);
        roughness.push(roughness[beside as usize]);
    }
    Some(Flattened {
        mesh: result,
        roughness,
        regions: shapes.len(),
    })
}

impl RoundRegions {
    /// The roughness of each shape: facets of a curved reflector have one material.
    fn roughness(&self, facets: &Facets) -> Vec<Roughness> {
        let mut sums = vec![Roughness::default(); self.shapes.len()];
        for (triangle, &round) in self.of_triangle.iter().enumerate() {
            let Some(shape) = self.shapes.get(round as usize) else {
                continue;
            };
            let corners = facets.corners[triangle];
            let middle = corners.iter().sum::<DVec3>() / 3.0;
            let cosine = shape.normal(middle).dot(facets.normals[triangle]);
            let heights = corners.map(|corner| shape.distance_m(corner));
            let area_m2 = facets.areas_m2[triangle];
            sums[round as usize].add(&Roughness::of_heights(heights, cosine, area_m2));
        }
        sums
    }
}

/// The triangles by the positions of their corners: a clean mesh's vertices are sorted by position.
fn by_position(mesh: &TriangleMesh) -> Vec<u32> {
    let mut keys: Vec<([u32; 3], u32)> = (0..)
        .zip(&mesh.triangles)
        .map(|(number, corners)| {
            let mut corners = *corners;
            corners.sort_unstable();
            (corners, number)
        })
        .collect();
    keys.sort_unstable();
    keys.into_iter().map(|(_, number)| number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::weld::clean;

    const TOLERANCE_M: f64 = 0.043;

    /// A square of four metres in cells of ten centimetres, with a height at each corner.
    fn plate(height: impl Fn(f32, f32) -> f32) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        let material = mesh.material("wall");
        for i in 0..=40u16 {
            for j in 0..=40u16 {
                let (x, z) = (0.1 * f32::from(i), 0.1 * f32::from(j));
                mesh.vertices.push(Vec3::new(x, height(x, z), z));
            }
        }
        for i in 0..40 {
            for j in 0..40 {
                let a = 41 * i + j;
                mesh.triangles
                    .extend([[a, a + 1, a + 42], [a, a + 42, a + 41]]);
                mesh.triangle_materials.extend([material; 2]);
            }
        }
        clean(&mesh).expect("a mesh").0
    }

    /// Numbers between −1 and 1 without a pattern.
    fn noise(x: f32, z: f32) -> f32 {
        let n = ((10.0 * x).round() * 41.0 + (10.0 * z).round()) as u32;
        (n.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 23) as f32 - 1.0
    }

    fn flatten(mesh: &TriangleMesh) -> Option<Flattened> {
        flattened(mesh, DVec3::ZERO, TOLERANCE_M, 0.5)
    }

    #[test]
    fn a_rough_plate_becomes_flat() {
        let flat = flatten(&plate(|x, z| 0.02 * noise(x, z))).expect("a region");
        assert_eq!(flat.regions, 1);
        let mean = flat.mesh.vertices.iter().map(|v| v.y).sum::<f32>() / 1681.0;
        let slope = |v: &Vec3| (v.y - mean).abs() < 0.002 && mean.abs() < 0.001;
        assert!(flat.mesh.vertices.iter().all(slope));
    }

    #[test]
    fn what_is_flat_or_curved_stays() {
        assert!(flatten(&plate(|_, _| 0.0)).is_none());
        let bowl = |x: f32, z: f32| 0.02 * ((x - 2.0).powi(2) + (z - 2.0).powi(2));
        assert!(flatten(&plate(bowl)).is_none());
        let wave = |x: f32, _: f32| 0.2 * (1.5 * x).sin();
        assert!(flatten(&plate(wave)).is_none());
    }

    #[test]
    fn a_step_larger_than_the_roughness_stays() {
        let step = |x: f32| if x > 2.0 { 0.03 } else { 0.0 };
        let flat = flatten(&plate(|x, z| step(x) + 0.001 * noise(x, z))).expect("regions");
        assert_eq!(flat.regions, 2);
        let off = |v: &Vec3| (v.y - step(v.x)).abs();
        let most = flat.mesh.vertices.iter().map(off).fold(0.0, f32::max);
        assert!(most < 1e-3, "{most}");
    }

    #[test]
    fn the_order_of_triangles_does_not_matter() {
        let mesh = plate(|x, z| 0.02 * noise(x, z));
        let mut other = mesh.clone();
        other.triangles.reverse();
        other.triangles.iter_mut().for_each(|t| t.swap(0, 2));
        let [a, b] = [mesh, other].map(|mesh| flatten(&mesh).expect("a region").mesh.vertices);
        let off = a.iter().zip(&b).map(|(a, b)| a.distance(*b));
        assert!(off.fold(0.0, f32::max) < 1e-6);
    }
}
