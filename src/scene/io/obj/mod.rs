//! Reads Wavefront OBJ files.
//!
//! Control side. Takes a path, returns a [`TriangleMesh`] with the names of `usemtl` statements. Material libraries
//! describe light; they are opened only for a warning. The file is read once, as a stream. Nothing is welded or dropped
//! here: [`crate::scene::weld`] does that.

mod polygon;
mod statements;

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use glam::{DVec3, Vec3};

use crate::error::{Error, Result};
use crate::scene::mesh::{LARGEST_COORDINATE_M, MOST_TRIANGLES, TriangleMesh};
use polygon::{MOST_EAR_CORNERS, triangulate};
use statements::Statements;

/// Material name of faces before the first `usemtl`.
pub const UNNAMED_MATERIAL: &str = "default";

/// Bytes of a material library that are searched for a material.
const LIBRARY_LIMIT: u64 = 1 << 24;

/// Material libraries that are checked.
const MOST_LIBRARIES: usize = 64;

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
#[non_exhaustive]
pub struct ObjOptions {
    /// Metres a unit of the file, above zero.
    pub scale: f32,
    /// The file's upward axis.
    pub up: UpAxis,
    /// Most triangles that are read, polygons cut up; three times as many vertices. A file with more is an error at the
    /// line that exceeds the limit, so reading takes no more than some 200 bytes a triangle.
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

impl ObjOptions {
    /// Sets [`Self::scale`].
    pub fn with_scale(self, scale: f32) -> Self {
        Self { scale, ..self }
    }

    /// Sets [`Self::up`].
    pub fn with_up(self, up: UpAxis) -> Self {
        Self { up, ..self }
    }

    /// Sets [`Self::most_triangles`].
    pub fn with_most_triangles(self, most_triangles: usize) -> Self {
        Self {
            most_triangles,
            ..self
        }
    }
}

/// Content of an OBJ file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ObjFile {
    /// The triangles, in metres, +y up; at least one.
    pub mesh: TriangleMesh,
    /// What was ignored, one line each.
    pub warnings: Vec<String>,
}

/// Reads an OBJ file.
///
/// Polygons of any number of corners are cut into triangles, concave ones too. Faces before the first `usemtl` have
/// the material `UNNAMED_MATERIAL`. A missing or empty material library is a warning.
///
/// # Errors
/// [`Error::Setting`] for a scale that is not above zero; [`Error::File`] where the file cannot be read;
/// [`Error::Format`] with the line for a broken statement, a face that refers to no vertex, a vertex in use that is not
/// finite or farther out than `LARGEST_COORDINATE_M`, or more of anything than [`ObjOptions::most_triangles`] allows,
/// and without a line for a file without faces.
///
/// # Examples
/// ```
/// use foresound::scene::{ObjOptions, load_obj};
///
/// let path = std::env::temp_dir().join("foresound_load_obj_example.obj");
/// std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 0 1\nusemtl wood_floor\nf 1 2 3\n")?;
/// let file = load_obj(&path, &ObjOptions::default())?;
/// assert_eq!(file.mesh.material_names, ["wood_floor"]);
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn load_obj(path: &Path, options: &ObjOptions) -> Result<ObjFile> {
    if !(options.scale.is_finite() && options.scale > 0.0) {
        return Err(Error::setting(
            "scale",
            format!("{} is not a positive number", options.scale),
            "give metres a unit: 1 for metres, 0.01 for centimetres, 0.001 for millimetres",
        ));
    }
    let file = super::open(path, "give the path of a readable OBJ file")?;
    let input = BufReader::with_capacity(1 << 16, file);
    let mut reader = ObjReader {
        path,
        options,
        statements: Statements::new(path, input),
        vertices: Vec::new(),
        vertices_out_of_range: HashMap::new(),
        corners: Vec::new(),
        faces: Vec::new(),
        triangle_count: 0,
        material_names: vec![UNNAMED_MATERIAL.to_owned()],
        material_indices: HashMap::from([(UNNAMED_MATERIAL.to_owned(), 0)]),
        material: 0,
        libraries: Vec::new(),
        unused: None,
    };
    while let Some(statement) = reader.statements.next()? {
        reader.read(&statement)?;
    }
    reader.finish()
}

/// One `f` statement.
struct Face {
    corner_count: u32,
    /// Index into [`ObjReader::material_names`].
    material: u32,
    line: usize,
}

/// A vertex that no face may use.
struct VertexOutOfRange {
    line: usize,
    text: String,
    finite: bool,
}

struct ObjReader<'a> {
    path: &'a Path,
    options: &'a ObjOptions,
    statements: Statements<'a, BufReader<File>>,
    vertices: Vec<Vec3>,
    vertices_out_of_range: HashMap<u32, VertexOutOfRange>,
    /// Vertex indices of all faces, one face after the other. A face may come before its vertices.
    corners: Vec<u32>,
    faces: Vec<Face>,
    triangle_count: usize,
    material_names: Vec<String>,
    material_indices: HashMap<String, u32>,
    /// Material of the next face.
    material: u32,
    /// `mtllib` statements with their lines.
    libraries: Vec<(usize, String)>,
    /// Number of lines, points and curves, and the line of the first.
    unused: Option<(usize, usize)>,
}

impl ObjReader<'_> {
    fn read(&mut self, statement: &str) -> Result<()> {
        let text = statement.trim();
        let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        let words = rest
            .split_whitespace()
            .take_while(|word| !word.starts_with('#'));
        match keyword {
            "v" => self.read_vertex(&words.collect::<Vec<_>>()),
            "f" => self.read_face(words),
            "usemtl" => self.read_material(if rest.is_empty() {
                UNNAMED_MATERIAL
            } else {
                rest
            }),
            "mtllib" => {
                if self.libraries.len() < MOST_LIBRARIES {
                    self.libraries.push((self.statements.line, rest.to_owned()));
                }
                Ok(())
            }
            "l" | "p" | "curv" | "curv2" | "surf" => {
                let (count, first) = self.unused.unwrap_or((0, self.statements.line));
                self.unused = Some((count + 1, first));
                Ok(())
            }
            // Comments, groups, normals, texture coordinates.
            _ => Ok(()),
        }
    }

    fn check_count(&self, count: usize, most: usize, what: &str) -> Result<()> {
        if count <= most {
            return Ok(());
        }
        Err(self.statements.error(
            format!("more than {most} {what}"),
            "simplify the model; sound needs walls, not ornaments",
        ))
    }

    /// Three coordinates; a fourth number is a weight, six are a position and a colour.
    fn read_vertex(&mut self, words: &[&str]) -> Result<()> {
        let most = self.options.most_triangles.saturating_mul(3);
        self.check_count(self.vertices.len() + 1, most, "vertices")?;
        let words = &words[..words.len().min(if words.len() == 4 { 4 } else { 3 })];
        let numbers: Vec<f32> = words.iter().filter_map(|word| word.parse().ok()).collect();
        let weight = match (words.len() == numbers.len(), numbers.len()) {
            (true, 3) => 1.0,
            (true, 4) => numbers[3],
            _ => {
                return Err(self
                    .statements
                    .error("a broken `v` statement", "write three numbers: v x y z"));
            }
        };
        if weight == 0.0 {
            return Err(self.statements.error(
                "a `v` statement of weight 0",
                "leave the fourth number out or set it to 1",
            ));
        }
        let [x, y, z] = [0, 1, 2].map(|axis| numbers[axis] / weight * self.options.scale);
        // Adding zero turns −0 into 0, which some ray tests mistake for a miss.
        let vertex = Vec3::ZERO
            + match self.options.up {
                UpAxis::Y => Vec3::new(x, y, z),
                UpAxis::Z => Vec3::new(x, z, -y),
            };
        // False for NaN too.
        let in_range = vertex.abs().max_element() <= LARGEST_COORDINATE_M && vertex.is_finite();
        if !in_range {
            let finite = |word: &&str| word.parse::<f64>().is_ok_and(f64::is_finite);
            let found = VertexOutOfRange {
                line: self.statements.line,
                text: shortened(&words.join(" ")),
                finite: words.iter().all(finite),
            };
            self.vertices_out_of_range
                .insert(self.vertices.len() as u32, found);
        }
        self.vertices.push(vertex);
        Ok(())
    }

    fn read_face<'w>(&mut self, words: impl Iterator<Item = &'w str>) -> Result<()> {
        let first = self.corners.len();
        for word in words {
            let corner = self.corner(word)?;
            self.corners.push(corner);
        }
        let corner_count = self.corners.len() - first;
        if corner_count < 3 {
            return Err(self.statements.error(
                format!("a face of {corner_count} corners"),
                "give every face three corners or more",
            ));
        }
        self.triangle_count += corner_count - 2;
        self.check_count(
            self.triangle_count,
            self.options.most_triangles,
            "triangles",
        )?;
        self.faces.push(Face {
            corner_count: corner_count as u32,
            material: self.material,
            line: self.statements.line,
        });
        Ok(())
    }

    /// The vertex index of a face corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, from zero.
    fn corner(&self, word: &str) -> Result<u32> {
        let position = word.split('/').next().unwrap_or_default();
        let count = self.vertices.len() as i64;
        match position.parse::<i64>() {
            Ok(0) => Err(self.statements.error(
                "a face with vertex index 0",
                "count vertices from 1, or backwards from -1",
            )),
            Ok(index) if index.unsigned_abs() > u64::from(u32::MAX) => Err(self.statements.error(
                format!("a face with vertex index {index}, out of range"),
                "refer only to vertices that the file defines",
            )),
            Ok(index) if index > 0 => Ok((index - 1) as u32),
            Ok(index) if count + index >= 0 => Ok((count + index) as u32),
            Ok(index) => Err(self.index_error(self.statements.line, index)),
            Err(_) => Err(self.statements.error(
                format!("a face corner `{}` that is not a number", shortened(word)),
                "write corners as v, v/vt, v//vn or v/vt/vn",
            )),
        }
    }

    fn index_error(&self, line: usize, index: i64) -> Error {
        let count = self.vertices.len();
        Error::format(
            self.path,
            Some(line),
            format!("a face with vertex index {index}, out of range ({count} vertices)"),
            "refer only to vertices that the file defines before the face",
        )
    }

    fn read_material(&mut self, name: &str) -> Result<()> {
        if let Some(&material) = self.material_indices.get(name) {
            self.material = material;
            return Ok(());
        }
        let count = self.material_names.len();
        self.check_count(count, self.options.most_triangles, "materials")?;
        self.material = count as u32;
        self.material_names.push(name.to_owned());
        self.material_indices.insert(name.to_owned(), self.material);
        Ok(())
    }

    fn finish(self) -> Result<ObjFile> {
        self.check_corners()?;
        let mut warnings = library_warnings(self.path, &self.libraries);
        if let Some((count, line)) = self.unused {
            warnings.push(format!(
                "{}:{line}: {count} lines, points or curves are left out; only faces reflect",
                self.path.display()
            ));
        }
        let mut mesh = TriangleMesh::default();
        let mut mesh_materials: Vec<Option<u32>> = vec![None; self.material_names.len()];
        let mut fan_count = 0usize;
        let mut corners = self.corners.as_slice();
        for run in self.faces.chunk_by(|a, b| a.material == b.material) {
            let name = run[0].material as usize;
            let material = *mesh_materials[name].get_or_insert_with(|| {
                mesh.material_names.push(self.material_names[name].clone());
                mesh.material_names.len() as u32 - 1
            });
            // A mesh vertex for each vertex that the run uses, in the order of use.
            let mut mesh_vertices: HashMap<u32, u32> = HashMap::new();
            for face in run {
                let (outline, rest) = corners.split_at(face.corner_count as usize);
                corners = rest;
                let outline: Vec<u32> = outline
                    .iter()
                    .map(|&vertex| {
                        *mesh_vertices.entry(vertex).or_insert_with(|| {
                            mesh.vertices.push(self.vertices[vertex as usize]);
                            mesh.vertices.len() as u32 - 1
                        })
                    })
                    .collect();
                fan_count += usize::from(outline.len() > MOST_EAR_CORNERS);
                let positions: Vec<DVec3> = outline
                    .iter()
                    .map(|&vertex| mesh.vertices[vertex as usize].as_dvec3())
                    .collect();
                for triangle in triangulate(&positions) {
                    mesh.triangles.push(triangle.map(|corner| outline[corner]));
                    mesh.triangle_materials.push(material);
                }
            }
        }
        if mesh.triangles.is_empty() {
            return Err(Error::format(
                self.path,
                None,
                "empty mesh: the file has no faces",
                "export the model with its faces (`f` statements)",
            ));
        }
        if fan_count > 0 {
            warnings.push(format!(
                "{}: {fan_count} faces of more than {MOST_EAR_CORNERS} corners are taken as convex; export triangles if they are not",
                self.path.display()
            ));
        }
        Ok(ObjFile { mesh, warnings })
    }

    /// Checks that every corner refers to a vertex in range.
    fn check_corners(&self) -> Result<()> {
        let mut beyond: Option<(u32, usize)> = None;
        let mut unusable: Option<&VertexOutOfRange> = None;
        let mut corners = self.corners.iter();
        for face in &self.faces {
            for corner in corners.by_ref().take(face.corner_count as usize) {
                if *corner as usize >= self.vertices.len()
                    && beyond.is_none_or(|(other, _)| *corner > other)
                {
                    beyond = Some((*corner, face.line));
                }
                let found = self.vertices_out_of_range.get(corner);
                unusable = [unusable, found]
                    .into_iter()
                    .flatten()
                    .min_by_key(|vertex| vertex.line);
            }
        }
        if let Some((corner, line)) = beyond {
            return Err(self.index_error(line, i64::from(corner) + 1));
        }
        let Some(VertexOutOfRange { line, text, finite }) = unusable else {
            return Ok(());
        };
        let (problem, advice) = if *finite {
            (
                format!("vertex ({text}) lies beyond {LARGEST_COORDINATE_M} m"),
                "check the units: --scale 0.001 reads millimetres; move a map's model to its own origin",
            )
        } else {
            (
                format!("vertex ({text}) is not finite and a face uses it"),
                "export the model again without NaN and infinite coordinates",
            )
        };
        Err(Error::format(self.path, Some(*line), problem, advice))
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

/// At most 24 characters of a text, without control characters, for an error of one line.
pub(crate) fn shortened(text: &str) -> String {
    let mut short: String = text
        .chars()
        .take(24)
        .map(|c| if c.is_control() { '?' } else { c })
        .collect();
    if text.chars().nth(24).is_some() {
        short.push('…');
    }
    short
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
        let options = ObjOptions::default().with_scale(0.5).with_up(UpAxis::Z);
        let file = read("v 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 -1\n", &options).unwrap();
        assert_eq!(file.mesh.vertices[0], Vec3::new(0.5, 1.5, -1.0));
        assert_eq!(file.mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn materials_keep_the_order_of_their_faces_and_colours_are_ignored() {
        let text = "# c\no room\nv 1 2 3 0.5 0.5 0.5\r\nvt 0 0\nv 2 4 6 2\nv 0 0 1\nusemtl\tb\n\
             usemtl Old Wall\nf 1/1/1 2//2 -1 # end\nusemtl b\nf 1 2 3\nl 1 2";
        let file = read(text, &ObjOptions::default()).unwrap();
        assert_eq!(file.mesh.material_names, ["Old Wall", "b"]);
        assert_eq!(file.mesh.vertices[..2], [Vec3::new(1.0, 2.0, 3.0); 2]);
        assert_eq!(file.mesh.triangle_materials, [0, 1]);
        assert!(file.warnings[0].contains(":12: 1 lines, points or curves"));
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
            let options = ObjOptions::default().with_scale(scale);
            let error = read(SQUARE, &options).unwrap_err();
            assert!(error.to_string().starts_with("scale:"), "{error}");
        }
    }
}
