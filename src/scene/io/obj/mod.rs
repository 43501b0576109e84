//! Reads Wavefront OBJ files.
//!
//! Control side. Takes an open file, returns a [`TriangleMesh`] with the names of `usemtl` statements. Material libraries
//! describe light; they are opened only for a warning. The file is read once, as a stream. Nothing is welded or dropped
//! here: [`crate::scene::weld`] does that.

mod statements;

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use glam::DVec3;

use super::mesh_file::{MeshFile, MeshOptions, crossing_warning, shortened};
use super::polygon::triangulate;
use crate::error::{Error, Result};
use crate::scene::mesh::TriangleMesh;
use statements::Statements;

/// Bytes of a material library that are searched for a material.
const LIBRARY_LIMIT: u64 = 1 << 24;

/// Reads an OBJ file.
///
/// Polygons of any number of corners are cut into triangles, concave ones too. Faces before the first `usemtl` have
/// the material `UNNAMED_MATERIAL`. A missing or empty material library is a warning.
///
/// # Errors
/// As [`load_mesh`](super::formats::load_mesh), with the line for all but a file without faces.
pub(super) fn read(path: &Path, input: impl BufRead, options: &MeshOptions) -> Result<MeshFile> {
    let mut statements = Statements::new(path, options, input);
    let parser_options = tobj::LoadOptions {
        single_index: true,
        ..Default::default()
    };
    // The parser reads no material library: see `statements`.
    let parsed = tobj::load_obj_buf(&mut statements, &parser_options, |_| Ok(Default::default()));
    let (models, _) = parsed.map_err(|error| statements.parser_error(error))?;

    let mut warnings = library_warnings(path, &statements.libraries);
    if let Some((count, line)) = statements.unused {
        warnings.push(format!(
            "{}:{line}: {count} lines, points or curves are left out; only faces reflect",
            path.display()
        ));
    }
    let (mesh, crossing_count) = build_mesh(models, options);
    if mesh.triangles.is_empty() {
        return Err(Error::format(
            path,
            None,
            "empty mesh: the file has no faces",
            "export the model with its faces (`f` statements)",
        ));
    }
    warnings.extend(crossing_warning(path, crossing_count));
    Ok(MeshFile::of(mesh, warnings))
}

/// Joins models that are named by their material; returns the number of faces whose outline crosses itself too.
fn build_mesh(models: Vec<tobj::Model>, options: &MeshOptions) -> (TriangleMesh, usize) {
    let mut mesh = TriangleMesh::default();
    let mut materials: HashMap<String, u32> = HashMap::new();
    let mut crossing_count = 0;
    for tobj::Model { mesh: model, name } in models {
        if model.indices.is_empty() {
            continue;
        }
        let material = *materials.entry(name).or_insert_with_key(|name| {
            mesh.material_names.push(name.clone());
            mesh.material_names.len() as u32 - 1
        });
        let base = mesh.vertices.len() as u32;
        let (positions, _) = model.positions.as_chunks::<3>();
        #[expect(clippy::unnecessary_cast, reason = "`use_f64` of the parser")]
        mesh.vertices.extend(
            positions
                .iter()
                .map(|&position| options.vertex(position.map(|value| value as f32))),
        );
        let mut corners = model.indices.as_slice();
        // Empty for a model of triangles.
        let mut corner_counts = model.face_arities.iter();
        while !corners.is_empty() {
            let corner_count = corner_counts.next().map_or(3, |&count| count as usize);
            let (face, rest) = corners.split_at(corner_count);
            corners = rest;
            let outline: Vec<DVec3> = face
                .iter()
                .map(|&corner| mesh.vertices[(base + corner) as usize].as_dvec3())
                .collect();
            let face_triangles = triangulate(&outline);
            crossing_count += usize::from(!face_triangles.is_exact);
            for triangle in face_triangles.triangles {
                mesh.triangles
                    .push(triangle.map(|corner| base + face[corner]));
                mesh.triangle_materials.push(material);
            }
        }
    }
    (mesh, crossing_count)
}

/// One line for each material library that is missing or holds no material.
fn library_warnings(path: &Path, libraries: &[(usize, String)]) -> Vec<String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut warnings = Vec::new();
    for (line, names) in libraries {
        // A name may hold blanks, and one statement may name several files.
        let files: Vec<&str> = if folder.join(names).is_file() {
            vec![names]
        } else {
            names.split_whitespace().collect()
        };
        for file in files {
            let library = folder.join(file);
            let problem = if !library.is_file() {
                "is missing"
            } else if !defines_material(&library) {
                "defines no material"
            } else {
                continue;
            };
            warnings.push(format!(
                "{}:{line}: material library {} {problem}; names come from `usemtl`",
                path.display(),
                shortened(file)
            ));
        }
    }
    warnings
}

fn defines_material(library: &Path) -> bool {
    let Ok(file) = File::open(library) else {
        return false;
    };
    BufReader::new(file.take(LIBRARY_LIMIT))
        .split(b'\n')
        .map_while(std::result::Result::ok)
        .any(|line| line.trim_ascii_start().starts_with(b"newmtl"))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::io::mesh_file::UpAxis;

    fn read(text: &str, options: &MeshOptions) -> Result<MeshFile> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.obj");
        std::fs::write(&path, text).unwrap();
        options.check()?;
        super::read(&path, BufReader::new(File::open(&path).unwrap()), options)
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\n";

    #[test]
    fn names_survive_a_missing_library() {
        let text = format!(
            "mtllib gone.mtl\n{SQUARE}f 1 2 3\nusemtl Brick Wall\nf 1 3 4\nusemtl glass\nf 1 2 4\nusemtl Brick Wall\nf 2 3 4\n"
        );
        let file = read(&text, &MeshOptions::default()).unwrap();
        assert_eq!(file.mesh.material_names, ["default", "Brick Wall", "glass"]);
        assert_eq!(file.mesh.triangle_materials, [0, 1, 2, 1]);
        assert_eq!(file.warnings.len(), 1);
        assert!(file.warnings[0].contains(":1: material library gone.mtl is missing"));
    }

    #[test]
    fn z_up_and_scale_place_the_corners() {
        let options = MeshOptions::default().with_scale(0.5).with_up(UpAxis::Z);
        let file = read("v 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 -1\n", &options).unwrap();
        assert_eq!(file.mesh.vertices[0], Vec3::new(0.5, 1.5, -1.0));
        assert_eq!(file.mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn materials_keep_the_order_of_their_faces_and_colours_are_ignored() {
        let text = "# c\no room\nv 1 2 3 0.5 0.5 0.5\r\nvt 0 0\nv 2 4 6 2\nv 0 0 1\nusemtl\tb\n\
             usemtl Old Wall\nf 1/1/1 2//2 -1 # end\nusemtl b\nf 1 2 3\nl 1 2";
        let file = read(text, &MeshOptions::default()).unwrap();
        assert_eq!(file.mesh.material_names, ["Old Wall", "b"]);
        assert_eq!(file.mesh.vertices[..2], [Vec3::new(1.0, 2.0, 3.0); 2]);
        assert_eq!(file.mesh.triangle_materials, [0, 1]);
        assert!(file.warnings[0].contains(":12: 1 lines, points or curves"));
    }

    #[test]
    fn polygons_and_textured_corners_work() {
        let text =
            format!("{SQUARE}v -1 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4//1 5\nf 4 3 2 1\n");
        let file = read(&text, &MeshOptions::default()).unwrap();
        assert_eq!(file.mesh.triangles.len(), 3 + 2);
    }

    #[test]
    fn a_byte_order_mark_hides_no_vertex() {
        let text = format!("\u{feff}{SQUARE}f 1 2 3 4\n");
        let file = read(&text, &MeshOptions::default()).unwrap();
        assert_eq!(file.mesh.vertices.len(), 4);
    }

    #[test]
    fn scale_must_be_positive() {
        for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let options = MeshOptions::default().with_scale(scale);
            let error = read(SQUARE, &options).unwrap_err();
            assert!(error.to_string().starts_with("scale:"), "{error}");
        }
    }
}
