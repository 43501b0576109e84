//! Cleans a mesh: welds vertices and drops triangles without area.
//!
//! Control side; time and memory grow with the mesh. The result has no unused or duplicate vertices. Its vertices are sorted
//! by x, y and z: later steps do not depend on the order of a file. Non-finite and zero-area triangles are dropped; a
//! coordinate out of range is an error. The [`IntakeReport`] counts both.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::mesh::{LARGEST_COORDINATE_M, TriangleMesh};
use super::spatial_hash::{SpatialHash, cell_of};
use crate::binary::stored;
use crate::error::{Error, Result};

/// Vertices closer than this become one, in metres. Below any modeller's intent and above `f32` noise within 1 km.
pub const WELD_DISTANCE_M: f64 = 1e-4;

/// A triangle whose smallest height is below this has no area, in metres: a tenth of [`WELD_DISTANCE_M`], and about
/// the noise of `f32` corners 100 m away, which makes its normal arbitrary.
const SMALLEST_HEIGHT_M: f64 = 1e-5;

/// The same relative to its longest edge.
const SMALLEST_HEIGHT_RATIO: f64 = 1e-6;

/// Edge of a search cell in metres: large enough that most searches visit one cell only.
const CELL_M: f64 = 16.0 * WELD_DISTANCE_M;

/// Most triangles of a mesh: lists of several entries per triangle stay within 31 bits.
const MOST_TRIANGLES: usize = 1 << 26;

/// Counts of what the intake of a mesh found and dropped.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct IntakeReport {
    /// Triangles of the input.
    pub triangles_in: usize,
    /// Triangles of the result.
    pub triangles: usize,
    /// Triangles dropped for a NaN or infinite corner.
    pub dropped_non_finite: usize,
    /// Triangles dropped because they have no area after welding.
    pub dropped_degenerate: usize,
    /// Triangles dropped because an earlier one has the same corners, in either winding.
    pub dropped_duplicate: usize,
    /// Those of [`Self::dropped_duplicate`] with another material than the one kept.
    pub duplicate_of_other_material: usize,
    /// Used vertices that were merged into another.
    pub vertices_welded: usize,
    /// Edges, each counted once however many triangles share it.
    pub edges: usize,
    /// Boundary edges: edges of one triangle only.
    pub boundary_edges: usize,
    /// Edges of three triangles or more.
    pub non_manifold_edges: usize,
    /// Whether the mesh has no boundary edge.
    pub watertight: bool,
    /// Least coordinates in metres.
    pub bounds_min: Vec3,
    /// Greatest coordinates in metres.
    pub bounds_max: Vec3,
}

/// Cleans a mesh. Of triangles with the same corners the first is kept. Materials without triangles are removed.
///
/// # Errors
/// [`Error::Mesh`] for lists that do not fit together ([`TriangleMesh::check_indices`]), for a corner farther out than
/// [`LARGEST_COORDINATE_M`], and where no triangle is left.
pub fn clean(mesh: &TriangleMesh) -> Result<(TriangleMesh, IntakeReport)> {
    clean_with_sources(mesh).map(|(clean, report, _)| (clean, report))
}

/// [`clean`], with the index of each kept triangle in the input.
pub(super) fn clean_with_sources(
    mesh: &TriangleMesh,
) -> Result<(TriangleMesh, IntakeReport, Vec<u32>)> {
    mesh.check_indices()?;
    if mesh.triangles.len() > MOST_TRIANGLES {
        return Err(Error::mesh(
            format!(
                "{} triangles, more than {MOST_TRIANGLES}",
                mesh.triangles.len()
            ),
            "simplify the model; sound needs walls, not ornaments",
        ));
    }
    let mut report = IntakeReport {
        triangles_in: mesh.triangles.len(),
        ..IntakeReport::default()
    };
    let finite = |t: &[u32; 3]| t.iter().all(|&i| mesh.vertices[i as usize].is_finite());
    let mut used = vec![false; mesh.vertices.len()];
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        if !finite(triangle) {
            report.dropped_non_finite += 1;
            continue;
        }
        for &i in triangle {
            let vertex = mesh.vertices[i as usize];
            if vertex.abs().max_element() > LARGEST_COORDINATE_M {
                return Err(Error::mesh(
                    format!(
                        "triangle {number} has a corner at ({}, {}, {}), beyond {LARGEST_COORDINATE_M} m",
                        vertex.x, vertex.y, vertex.z
                    ),
                    "check the units (metres) and move the model to its own origin",
                ));
            }
            used[i as usize] = true;
        }
    }
    let (positions, welded) = weld(&mesh.vertices, &used);
    let used_count = used.iter().filter(|&&u| u).count();
    report.vertices_welded = used_count - positions.len();

    let mut kept: Vec<([u32; 3], u32)> = Vec::with_capacity(mesh.triangles.len());
    let mut sources: Vec<u32> = Vec::with_capacity(mesh.triangles.len());
    let triangles = mesh.triangles.iter().zip(&mesh.triangle_materials);
    for (source, (triangle, &material)) in (0..).zip(triangles) {
        if !finite(triangle) {
            continue;
        }
        let corners = triangle.map(|i| welded[i as usize]);
        if has_area(corners.map(|i| positions[i as usize].as_dvec3())) {
            kept.push((corners, material));
            sources.push(source);
        } else {
            report.dropped_degenerate += 1;
        }
    }
    drop_duplicates(&mut kept, &mut sources, &mesh.material_names, &mut report);
    if kept.is_empty() {
        return Err(Error::mesh(
            format!(
                "empty: none of {} triangles stays ({} not finite, {} without area)",
                report.triangles_in, report.dropped_non_finite, report.dropped_degenerate
            ),
            "give at least one triangle larger than a millimetre; check the scale",
        ));
    }
    let clean = compact(&kept, &positions, &mesh.material_names);
    report.triangles = clean.triangles.len();
    count_edges(&clean.triangles, &mut report);
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &vertex in &clean.vertices {
        low = low.min(vertex);
        high = high.max(vertex);
    }
    (report.bounds_min, report.bounds_max) = (low, high);
    Ok((clean, report, sources))
}

/// Welds vertices in use. Returns the sorted positions and, for each vertex, the index of its position.
fn weld(vertices: &[Vec3], used: &[bool]) -> (Vec<Vec3>, Vec<u32>) {
    let mut sorted: Vec<(u64, u64)> = Vec::with_capacity(vertices.len());
    for (i, (vertex, _)) in vertices.iter().zip(used).enumerate().filter(|(_, v)| *v.1) {
        let [x, y, z] = vertex
            .to_array()
            .map(|value| u64::from(ordered_bits(value)));
        sorted.push((x << 32 | y, z << 32 | i as u64));
    }
    // Sorted by position: the result does not depend on the order of the file.
    sorted.sort_unstable();
    let mut positions: Vec<Vec3> = Vec::new();
    let mut welded = vec![u32::MAX; vertices.len()];
    let mut index = SpatialHash::new(sorted.len());
    for (_, low) in sorted {
        let i = (low & 0xffff_ffff) as usize;
        // Adding zero turns −0 into 0; some ray tests miss at −0.
        let vertex = vertices[i] + Vec3::ZERO;
        let position = vertex.as_dvec3();
        let cells = |shift: f64| {
            (position + DVec3::splat(shift))
                .to_array()
                .map(|value| cell_of(value, CELL_M))
        };
        let mut first = u32::MAX;
        index.visit(cells(-WELD_DISTANCE_M), cells(WELD_DISTANCE_M), |other| {
            let near = positions[other as usize].as_dvec3();
            if other < first && near.distance_squared(position) <= WELD_DISTANCE_M * WELD_DISTANCE_M
            {
                first = other;
            }
            true
        });
        if first == u32::MAX {
            first = index.insert(cells(0.0));
            positions.push(vertex);
        }
        welded[i] = first;
    }
    (positions, welded)
}

/// Bits in the order of the numbers; −0 and 0 are the same.
fn ordered_bits(value: f32) -> u32 {
    let bits = (value + 0.0).to_bits();
    if bits >> 31 == 1 {
        !bits
    } else {
        bits | 1 << 31
    }
}

/// Whether a triangle's smallest height is more than rounding.
pub(super) fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let doubled_area = (b - a).cross(c - a).length();
    let least = SMALLEST_HEIGHT_M.max(SMALLEST_HEIGHT_RATIO * longest);
    doubled_area > least * longest
}

/// Keeps the first of triangles with the same corners.
fn drop_duplicates(
    kept: &mut Vec<([u32; 3], u32)>,
    sources: &mut Vec<u32>,
    names: &[String],
    report: &mut IntakeReport,
) {
    let mut sorted: Vec<([u32; 3], u32)> = kept
        .iter()
        .enumerate()
        .map(|(number, (corners, _))| {
            let mut key = *corners;
            key.sort_unstable();
            (key, number as u32)
        })
        .collect();
    sorted.sort_unstable();
    let mut doubled = vec![false; kept.len()];
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        let name = |number: u32| &names[kept[number as usize].1 as usize];
        for &(_, number) in &same[1..] {
            doubled[number as usize] = true;
            report.dropped_duplicate += 1;
            if name(number) != name(same[0].1) {
                report.duplicate_of_other_material += 1;
            }
        }
    }
    let mut flags = doubled.iter();
    kept.retain(|_| flags.next() != Some(&true));
    flags = doubled.iter();
    sources.retain(|_| flags.next() != Some(&true));
}

/// A mesh of the given triangles, without unused vertices and materials.
fn compact(kept: &[([u32; 3], u32)], positions: &[Vec3], names: &[String]) -> TriangleMesh {
    let mut number = vec![u32::MAX; positions.len()];
    for &i in kept.iter().flat_map(|(corners, _)| corners) {
        number[i as usize] = 0;
    }
    let mut mesh = TriangleMesh::default();
    for (slot, &position) in number.iter_mut().zip(positions) {
        if *slot == 0 {
            *slot = mesh.vertices.len() as u32;
            mesh.vertices.push(position);
        }
    }
    let mut numbers: Vec<Option<u32>> = vec![None; names.len()];
    let mut by_name: HashMap<&str, u32> = HashMap::new();
    for &(corners, material) in kept {
        let material = material as usize;
        let new = *numbers[material].get_or_insert_with(|| {
            // By name: a name listed twice is one material.
            *by_name.entry(&names[material]).or_insert_with(|| {
                mesh.material_names.push(names[material].clone());
                mesh.material_names.len() as u32 - 1
            })
        });
        mesh.triangles.push(corners.map(|i| number[i as usize]));
        mesh.triangle_materials.push(new);
    }
    mesh
}

/// All triangle edges, sorted: the two vertices as one number, and triangle × 3 + edge. Vertices have indices below some
/// multiple of the number of triangles.
pub(super) fn sorted_edges(triangles: &[[u32; 3]]) -> Vec<(u64, u32)> {
    let sides = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)].map(|(p, q)| (p.min(q), p.max(q)));
    // Counted by the lower vertex; few edges have the same.
    let vertices = triangles
        .iter()
        .flatten()
        .max()
        .map_or(0, |&v| v as usize + 1);
    let mut next = vec![0u32; vertices + 1];
    for (low, _) in triangles.iter().flat_map(sides) {
        next[low as usize + 1] += 1;
    }
    for vertex in 0..vertices {
        next[vertex + 1] += next[vertex];
    }
    let mut edges = vec![(0u64, 0u32); 3 * triangles.len()];
    for (number, (low, high)) in (0..).zip(triangles.iter().flat_map(sides)) {
        let slot = &mut next[low as usize];
        edges[*slot as usize] = (u64::from(low) << 32 | u64::from(high), number);
        *slot += 1;
    }
    let mut rest = edges.as_mut_slice();
    let mut first = 0;
    // `next` has moved on to the end of each vertex's edges.
    for &end in &next[..vertices] {
        let (own, others) = rest.split_at_mut((end - first) as usize);
        own.sort_unstable();
        (rest, first) = (others, end);
    }
    edges
}

fn count_edges(triangles: &[[u32; 3]], report: &mut IntakeReport) {
    for same in sorted_edges(triangles).chunk_by(|a, b| a.0 == b.0) {
        report.edges += 1;
        match same.len() {
            1 => report.boundary_edges += 1,
            2 => {}
            _ => report.non_manifold_edges += 1,
        }
    }
    report.watertight = report.boundary_edges == 0;
}

stored!(IntakeReport {
    triangles_in: usize,
    triangles: usize,
    dropped_non_finite: usize,
    dropped_degenerate: usize,
    dropped_duplicate: usize,
    duplicate_of_other_material: usize,
    vertices_welded: usize,
    edges: usize,
    boundary_edges: usize,
    non_manifold_edges: usize,
    watertight: bool,
    bounds_min: Vec3,
    bounds_max: Vec3,
});

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: &[[f32; 3]], indices: &[u32]) -> TriangleMesh {
        TriangleMesh::from_slices(positions, indices, &[], &[]).unwrap()
    }

    #[test]
    fn near_vertices_become_one_and_far_ones_do_not() {
        // Two triangles with corners of their own along a shared edge, 0.05 mm and 0.2 mm apart at its ends.
        let two = mesh(
            &[
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.000_05, 1.0, 0.0],
                [1.000_2, 0.0, 0.0],
                [1.0, 1.0, 0.0],
            ],
            &[0, 1, 2, 3, 4, 5],
        );
        let (clean, report) = clean(&two).unwrap();
        assert_eq!(clean.vertices.len(), 5);
        assert_eq!(report.vertices_welded, 1);
        assert_eq!(report.boundary_edges, 6);
        assert!(!report.watertight);
    }

    #[test]
    fn welding_reaches_across_search_cells() {
        let edge = CELL_M as f32;
        for offset in [-4e-5f32, 4e-5] {
            let two = mesh(
                &[
                    [edge, edge, edge],
                    [1.0, 0.0, 0.0],
                    [0.0, 1.0, 0.0],
                    [edge + offset, edge - offset, edge + offset],
                    [1.0, 0.0, 0.0],
                    [0.0, 0.0, 1.0],
                ],
                &[0, 1, 2, 3, 4, 5],
            );
            assert_eq!(clean(&two).unwrap().1.vertices_welded, 2);
        }
    }

    #[test]
    fn everything_dropped_is_counted() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [2.0, 0.0, 0.0],
            [f32::NAN, 0.0, 0.0],
        ];
        let indices = [
            0, 1, 2, // stays
            2, 1, 0, // the same, other winding and material
            1, 2, 0, // the same
            0, 1, 3, // on a line
            0, 0, 2, // two corners the same
            0, 1, 4, // not finite
        ];
        let names = ["a", "b"];
        let soup =
            TriangleMesh::from_slices(&positions, &indices, &names, &[0, 1, 0, 0, 0, 0]).unwrap();
        let (clean, report) = clean(&soup).unwrap();
        assert_eq!(clean.triangles.len(), 1);
        assert_eq!(clean.material_names, ["a"]);
        assert_eq!(report.triangles_in, 6);
        assert_eq!(report.dropped_duplicate, 2);
        assert_eq!(report.duplicate_of_other_material, 1);
        assert_eq!(report.dropped_degenerate, 2);
        assert_eq!(report.dropped_non_finite, 1);
    }

    #[test]
    fn hopeless_meshes_are_refused() {
        let far = mesh(&[[0.0; 3], [1e9, 0.0, 0.0], [0.0, 1.0, 0.0]], &[0, 1, 2]);
        let flat = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], &[0, 1, 2]);
        let wrong = TriangleMesh {
            triangles: vec![[0, 1, 7]],
            triangle_materials: vec![0],
            ..far.clone()
        };
        for (bad, expected) in [
            (far, "beyond 100000 m"),
            (flat, "empty: none of 1 triangles"),
            (TriangleMesh::default(), "empty"),
            (wrong, "vertex 7 of 3"),
        ] {
            let text = clean(&bad).unwrap_err().to_string();
            assert!(text.contains(expected), "{text}");
        }
    }
}
