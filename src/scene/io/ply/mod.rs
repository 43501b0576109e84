//! Reads PLY files (\[TURK94\]), the usual format of scans: text and binary in both byte orders.
//!
//! Control side. Only positions and faces count; colours, normals and all other values are skipped. The file is read once,
//! as a stream, and may end only behind the last value that its header announces.

mod header;
mod values;

use std::io::BufRead;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::mesh_file::{MeshFile, MeshOptions, Position, UNNAMED_MATERIAL, crossing_warning};
use super::polygon::triangulate;
use crate::error::Result;
use crate::scene::mesh::TriangleMesh;
use header::Element;
use values::Values;

/// Names of a face's list of corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Faces as the file has them.
#[derive(Default)]
struct Faces {
    /// Vertex indices of one face after another.
    corners: Vec<u32>,
    /// End of each face in [`Self::corners`].
    ends: Vec<usize>,
    /// Triangles that they make.
    triangle_count: u64,
}

/// Reads a PLY file.
///
/// # Errors
/// As [`load_mesh`](super::formats::load_mesh), with the line in a text.
pub(super) fn read(
    path: &Path,
    mut input: impl BufRead,
    options: &MeshOptions,
) -> Result<MeshFile> {
    let mut position = Position { path, line: None };
    let header = header::read(&mut position, &mut input)?;
    let mut values = Values::new(position, input, header.encoding, header.line_count);
    let mut vertices = Vec::new();
    let mut faces = Faces::default();
    for element in &header.elements {
        match &*element.name {
            "vertex" if vertices.is_empty() => {
                let most = options.max_triangles.saturating_mul(3);
                position.check_count(element.count, most, "vertices")?;
                vertices = read_vertices(&mut values, element, options)?;
            }
            "face" if element.property(&CORNERS).is_some() => {
                read_faces(&mut values, element, options, &mut faces)?;
            }
            _ => skip(&mut values, element)?,
        }
    }
    let position = Position { path, line: None };
    if faces.ends.is_empty() {
        let has_strips = header.elements.iter().any(|e| e.name == "tristrips");
        return Err(if has_strips {
            position.error("the faces are triangle strips", "export them as polygons")
        } else {
            position.error(
                "a cloud of points: the file has no faces",
                "make a mesh of the points first, in the scanner's own program or one for meshes",
            )
        });
    }
    build(position, &vertices, &faces)
}

fn skip<R: BufRead>(values: &mut Values<R>, element: &Element) -> Result<()> {
    // Elements without properties have no bytes, whatever their number.
    if !element.properties.is_empty() {
        for _ in 0..element.count {
            each_value(values, element, |_, _, _| Ok(()))?;
        }
    }
    Ok(())
}

/// Reads one item of an element; `take` gets the property's index and each of its values.
fn each_value<R: BufRead>(
    values: &mut Values<R>,
    element: &Element,
    mut take: impl FnMut(Position, usize, f64) -> Result<()>,
) -> Result<()> {
    for (index, property) in element.properties.iter().enumerate() {
        let count = property.count.map(|count| values.next(count)).transpose()?;
        let count = count.unwrap_or(1.0);
        if !(count >= 0.0 && count == count.trunc() && count <= f64::from(u32::MAX)) {
            let problem = format!("a list of {count} values");
            return Err(values
                .position
                .error(problem, "export the model again as PLY 1.0"));
        }
        for _ in 0..count as u32 {
            let value = values.next(property.value)?;
            take(values.position, index, value)?;
        }
    }
    Ok(())
}

fn read_vertices<R: BufRead>(
    values: &mut Values<R>,
    element: &Element,
    options: &MeshOptions,
) -> Result<Vec<Vec3>> {
    let axes = ["x", "y", "z"].map(|name| element.property(&[name]));
    let [Some(x), Some(y), Some(z)] = axes else {
        let advice = "export positions as the properties x, y and z";
        let position = Position {
            line: None,
            ..values.position
        };
        return Err(position.error("vertices without a position", advice));
    };
    let mut vertices = Vec::new();
    for _ in 0..element.count {
        let mut place = [f32::NAN; 3];
        each_value(values, element, |_, index, value| {
            if let Some(axis) = [x, y, z].iter().position(|&axis| axis == index) {
                place[axis] = value as f32;
            }
            Ok(())
        })?;
        vertices.push(options.vertex(place));
    }
    Ok(vertices)
}

fn read_faces<R: BufRead>(
    values: &mut Values<R>,
    element: &Element,
    options: &MeshOptions,
    faces: &mut Faces,
) -> Result<()> {
    let list = element.property(&CORNERS);
    for _ in 0..element.count {
        let start = faces.corners.len();
        each_value(values, element, |position, index, value| {
            if Some(index) == list {
                if !(value >= 0.0 && value <= f64::from(u32::MAX) && value == value.trunc()) {
                    return Err(index_error(position, value));
                }
                let count = (faces.corners.len() - start) as u64;
                let most = options.max_triangles;
                position.check_count(
                    (faces.triangle_count + count).saturating_sub(1),
                    most,
                    "triangles",
                )?;
                faces.corners.push(value as u32);
            }
            Ok(())
        })?;
        let corner_count = faces.corners.len() - start;
        if corner_count < 3 {
            let problem = format!("a face of {corner_count} corners");
            let advice = "give every face three corners or more";
            return Err(values.position.error(problem, advice));
        }
        faces.triangle_count += corner_count as u64 - 2;
        faces.ends.push(faces.corners.len());
    }
    Ok(())
}

fn index_error(position: Position, index: f64) -> crate::error::Error {
    let problem = format!("a face with vertex index {index}, which no vertex has");
    position.error(
        problem,
        "count vertices from 0, and write all that faces use",
    )
}

/// Cuts faces into triangles; vertices in no face are left out.
fn build(position: Position, vertices: &[Vec3], faces: &Faces) -> Result<MeshFile> {
    let mut mesh = TriangleMesh {
        material_names: vec![UNNAMED_MATERIAL.to_owned()],
        ..Default::default()
    };
    if let Some(&index) = faces
        .corners
        .iter()
        .find(|&&i| i as usize >= vertices.len())
    {
        return Err(index_error(position, index.into()));
    }
    const UNUSED: u32 = u32::MAX;
    let mut index_of = vec![UNUSED; vertices.len()];
    let mut crossing_count = 0;
    let mut start = 0;
    for &end in &faces.ends {
        let corners: Vec<u32> = faces.corners[start..end]
            .iter()
            .map(|&corner| {
                let index = &mut index_of[corner as usize];
                if *index == UNUSED {
                    *index = mesh.vertices.len() as u32;
                    mesh.vertices.push(vertices[corner as usize]);
                }
                *index
            })
            .collect();
        start = end;
        if let [a, b, c] = corners[..] {
            mesh.triangles.push([a, b, c]);
            continue;
        }
        let outline: Vec<DVec3> = corners
            .iter()
            .map(|&c| mesh.vertices[c as usize].as_dvec3())
            .collect();
        let face = triangulate(&outline);
        crossing_count += usize::from(!face.is_exact);
        mesh.triangles
            .extend(face.triangles.iter().map(|t| t.map(|c| corners[c])));
    }
    position.check_vertices(&mesh.vertices)?;
    mesh.triangle_materials = vec![0; mesh.triangles.len()];
    Ok(MeshFile::of(
        mesh,
        crossing_warning(position.path, crossing_count)
            .into_iter()
            .collect(),
    ))
}
