//! Reads Wavefront OBJ files.
//!
//! Control side. Takes a path, gives a [`TriangleMesh`] with the names of `usemtl` statements; material libraries are
//! not read for anything but a warning, because they describe light. The file streams through a buffer and is read a
//! second time only to find the line of an error. Nothing is welded or dropped here: that is [`crate::scene::weld`]'s.

mod errors;
mod lines;
mod polygon;

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use glam::{DVec3, Vec3};

use crate::error::{Error, Result};
use crate::scene::io::obj::errors::{parser_error, vertex_error};
use crate::scene::io::obj::lines::{ObjLines, shortened};
use crate::scene::io::obj::polygon::{MOST_EAR_CORNERS, triangulate};
use crate::scene::mesh::{LARGEST_COORDINATE_M, MOST_TRIANGLES, TriangleMesh};

/// Material name of faces before the first `usemtl`.
pub const UNNAMED_MATERIAL: &str = "default";

/// Bytes of a material library that are searched for a material.
const LIBRARY_LIMIT: u64 = 1 << 24;

/// Which axis of a file points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UpAxis {
    /// +y, as in this crate.
    #[default]
    Y,
    /// +z: (x, y, z) becomes (x, z, −y).
    Z,
}

/// How to read an OBJ file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjOptions {
    /// Metres a unit of the file, above zero.
    pub scale: f32,
    /// The file's upward axis.
    pub up: UpAxis,
    /// Most triangles that are read, polygons cut up; three times as many vertices. A file with more is refused where it
    /// exceeds that, so reading takes no more than some 200 bytes for each.
    pub most_triangles: usize,
}

impl Default for ObjOptions {
    /// Metres, +y up, as many triangles as a scene takes by default.
    fn default() -> Self {
        Self {
            scale: 1.0,
            up: UpAxis::Y,
            most_triangles: MOST_TRIANGLES,
        }
    }
}

/// What an OBJ file gave.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjFile {
    /// The triangles, in metres, +y up, with at least one among them.
    pub mesh: TriangleMesh,
    /// What was passed over, one line each.
    pub warnings: Vec<String>,
}

/// Reads an OBJ file.
///
/// Polygons of any number of corners are cut into triangles, concave ones too. Faces before the first `usemtl` have
/// the material [`UNNAMED_MATERIAL`]. A missing or empty material library is a warning.
///
/// # Errors
/// [`Error::Setting`] for a scale that is not above zero; [`Error::File`] where the file cannot be read;
/// [`Error::Format`] with the line for a broken statement, a face that refers to no vertex, a vertex in use that is not
/// finite or farther out than [`LARGEST_COORDINATE_M`], or more of anything than [`ObjOptions::most_triangles`] allows,
/// and without a line for a file without faces.
pub fn load_obj(path: &Path, options: &ObjOptions) -> Result<ObjFile> {
    if !(options.scale.is_finite() && options.scale > 0.0) {
        return Err(Error::setting(
            "scale",
            format!("{} is not a positive number", options.scale),
            "give metres a unit: 1 for metres, 0.01 for centimetres, 0.001 for millimetres",
        ));
    }
    let mut lines = ObjLines::new(open(path)?).within(options.most_triangles);
    let parser_options = tobj::LoadOptions {
        single_index: true,
        triangulate: false,
        ignore_points: true,
        ignore_lines: true,
    };
    let (models, _) = tobj::load_obj_buf(&mut lines, &parser_options, |library| {
        let name = library.to_string_lossy().into_owned();
        let material = tobj::Material {
            name: name.clone(),
            ..Default::default()
        };
        Ok((vec![material], HashMap::from([(name, 0)])))
    })
    .map_err(|error| parser_error(path, &lines, error))?;

    let mut warnings = library_warnings(path, &lines.libraries);
    if let Some((count, line)) = lines.unused {
        warnings.push(format!(
            "{}:{line}: {count} lines, points or curves are left out; only faces reflect",
            path.display()
        ));
    }
    let mut mesh = TriangleMesh::default();
    let place = |[x, y, z]: [f32; 3]| {
        let [x, y, z] = [x, y, z].map(|value| value * options.scale);
        // Adding zero turns −0 into 0, which some ray tests mistake for a miss.
        match options.up {
            UpAxis::Y => Vec3::new(x, y, z) + Vec3::ZERO,
            UpAxis::Z => Vec3::new(x, z, -y) + Vec3::ZERO,
        }
    };
    let mut materials: HashMap<&str, u32> = HashMap::new();
    let mut fanned = 0usize;
    for model in models {
        let source = model.mesh;
        if source.indices.is_empty() {
            continue;
        }
        let number = source.material_id.filter(|&n| n < lines.names.len());
        let name = number.map_or(UNNAMED_MATERIAL, |n| &lines.names[n]);
        let material = *materials.entry(name).or_insert_with(|| {
            mesh.material_names.push(name.to_owned());
            mesh.material_names.len() as u32 - 1
        });
        let base = mesh.vertices.len() as u32;
        let (corners, _) = source.positions.as_chunks::<3>();
        for &corner in corners {
            let vertex = place(corner);
            if !in_range(vertex) {
                return Err(vertex_error(path, &place));
            }
            mesh.vertices.push(vertex);
        }
        let mut rest = source.indices.as_slice();
        let mut arities = source.face_arities.iter();
        let mut outline: Vec<DVec3> = Vec::new();
        while !rest.is_empty() {
            let arity = arities.next().map_or(3, |&n| n as usize).min(rest.len());
            let (face, tail) = rest.split_at(arity);
            rest = tail;
            outline.clear();
            outline.extend(
                face.iter()
                    .map(|&i| mesh.vertices[(base + i) as usize].as_dvec3()),
            );
            fanned += usize::from(arity > MOST_EAR_CORNERS);
            for triangle in triangulate(&outline) {
                mesh.triangles.push(triangle.map(|c| base + face[c]));
                mesh.triangle_materials.push(material);
            }
        }
    }
    if mesh.triangles.is_empty() {
        return Err(Error::format(
            path,
            None,
            "empty mesh: the file has no faces",
            "export the model with its faces (`f` statements)",
        ));
    }
    if fanned > 0 {
        warnings.push(format!(
            "{}: {fanned} faces of more than {MOST_EAR_CORNERS} corners are taken as convex; export triangles if they are not",
            path.display()
        ));
    }
    Ok(ObjFile { mesh, warnings })
}

fn in_range(vertex: Vec3) -> bool {
    // False for NaN too.
    vertex.abs().max_element() <= LARGEST_COORDINATE_M && vertex.is_finite()
}

/// Opens a file that was read before; what is no file, as a pipe, would wait for somebody to write it again.
fn reopen(path: &Path) -> Option<BufReader<File>> {
    let again = std::fs::metadata(path).is_ok_and(|about| about.is_file());
    again.then(|| open(path).ok()).flatten()
}

fn open(path: &Path) -> Result<BufReader<File>> {
    let advice = "give the path of a readable OBJ file";
    let file = File::open(path).map_err(|error| Error::file(path, error, advice))?;
    match file.metadata() {
        Ok(about) if about.is_dir() => Err(Error::file(path, "is a directory", advice)),
        Ok(_) => Ok(BufReader::with_capacity(1 << 16, file)),
        Err(error) => Err(Error::file(path, error, advice)),
    }
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
    use super::*;

    fn read(text: &str, options: &ObjOptions) -> Result<ObjFile> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.obj");
        std::fs::write(&path, text).unwrap();
        load_obj(&path, options)
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\n";

    #[test]
    fn names_survive_a_missing_library() {
        let text = format!(
            "mtllib gone.mtl\n{SQUARE}f 1 2 3\nusemtl Brick Wall\nf 1 3 4\nusemtl glass\nf 1 2 4\nusemtl Brick Wall\nf 2 3 4\n"
        );
        let file = read(&text, &ObjOptions::default()).unwrap();
        assert_eq!(file.mesh.material_names, ["default", "Brick Wall", "glass"]);
        assert_eq!(file.mesh.triangle_materials, [0, 1, 2, 1]);
        assert_eq!(file.warnings.len(), 1);
        assert!(file.warnings[0].contains(":1: material library gone.mtl is missing"));
    }

    #[test]
    fn z_up_and_scale_place_the_corners() {
        let options = ObjOptions {
            scale: 0.5,
            up: UpAxis::Z,
            ..ObjOptions::default()
        };
        let file = read("v 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 -1\n", &options).unwrap();
        assert_eq!(file.mesh.vertices[0], Vec3::new(0.5, 1.5, -1.0));
        assert_eq!(file.mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn polygons_and_textured_corners_work() {
        let text =
            format!("{SQUARE}v -1 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4//1 5\nf 4 3 2 1\n");
        let file = read(&text, &ObjOptions::default()).unwrap();
        assert_eq!(file.mesh.triangles.len(), 3 + 2);
    }

    #[test]
    fn a_byte_order_mark_hides_no_vertex() {
        let text = format!("\u{feff}{SQUARE}f 1 2 3 4\n");
        let file = read(&text, &ObjOptions::default()).unwrap();
        assert_eq!(file.mesh.vertices.len(), 4);
    }

    #[test]
    fn scale_must_be_positive() {
        for scale in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let options = ObjOptions {
                scale,
                ..ObjOptions::default()
            };
            let error = read(SQUARE, &options).unwrap_err();
            assert!(error.to_string().starts_with("scale:"), "{error}");
        }
    }
}
