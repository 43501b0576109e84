//! What all readers of meshes share: options, result, limits and errors.
//!
//! Control side.

use std::path::Path;

use glam::Vec3;

use crate::error::{Error, Result};
use crate::scene::materials::MaterialTable;
use crate::scene::mesh::{LARGEST_COORDINATE_M, MOST_TRIANGLES, TriangleMesh};

/// Material name of faces to which a file gives none.
pub const UNNAMED_MATERIAL: &str = "default";

/// What to do about a vertex that is not finite.
const NOT_FINITE_ADVICE: &str = "export the model again without NaN and infinite coordinates";

/// Which axis of a file points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UpAxis {
    /// +y, as in this crate and in glTF.
    #[default]
    Y,
    /// +z: (x, y, z) becomes (x, z, −y).
    Z,
}

/// How to read a mesh file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MeshOptions {
    /// Metres a unit of the file, above zero.
    pub scale: f32,
    /// The file's upward axis.
    pub up: UpAxis,
    /// Most triangles that are read, polygons cut up and instances counted; three times as many vertices. A file with more
    /// is an error, so reading takes no more than some 200 bytes a triangle.
    pub max_triangles: usize,
}

impl Default for MeshOptions {
    /// Metres, +y up, as many triangles as a scene takes by default.
    fn default() -> Self {
        Self {
            scale: 1.0,
            up: UpAxis::Y,
            max_triangles: MOST_TRIANGLES,
        }
    }
}

impl MeshOptions {
    /// Sets [`Self::scale`].
    pub fn with_scale(self, scale: f32) -> Self {
        Self { scale, ..self }
    }

    /// Sets [`Self::up`].
    pub fn with_up(self, up: UpAxis) -> Self {
        Self { up, ..self }
    }

    /// Sets [`Self::max_triangles`].
    pub fn with_max_triangles(self, max_triangles: usize) -> Self {
        Self {
            max_triangles,
            ..self
        }
    }

    /// Checks the scale.
    pub(super) fn check(&self) -> Result<()> {
        if self.scale.is_finite() && self.scale > 0.0 {
            return Ok(());
        }
        Err(Error::setting(
            "scale",
            format!("{} is not a positive number", self.scale),
            "give metres a unit: 1 for metres, 0.01 for centimetres, 0.001 for millimetres",
        ))
    }

    /// A position of the file in metres, +y up.
    pub(super) fn vertex(&self, position: [f32; 3]) -> Vec3 {
        let [x, y, z] = position.map(|value| value * self.scale);
        // Adding zero turns −0 into 0, which some ray tests mistake for a miss.
        Vec3::ZERO
            + match self.up {
                UpAxis::Y => Vec3::new(x, y, z),
                UpAxis::Z => Vec3::new(x, z, -y),
            }
    }
}

/// Content of a mesh file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MeshFile {
    /// The triangles, in metres, +y up; at least one.
    pub mesh: TriangleMesh,
    /// Materials that the file itself defines: `acoustic_absorption` and its like in glTF. Empty for other formats.
    pub materials: MaterialTable,
    /// What was ignored, one line each.
    pub warnings: Vec<String>,
}

impl MeshFile {
    /// A file that defines no material.
    pub(super) fn of(mesh: TriangleMesh, warnings: Vec<String>) -> Self {
        Self {
            mesh,
            materials: MaterialTable::default(),
            warnings,
        }
    }
}

/// A position of the file and of a reader in it, for errors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Position<'a> {
    pub(super) path: &'a Path,
    /// The line, counted from 1, of a text.
    pub(super) line: Option<usize>,
}

impl Position<'_> {
    /// [`Error::Format`] here.
    pub(super) fn error(&self, problem: impl ToString, advice: &str) -> Error {
        Error::format(self.path, self.line, problem, advice)
    }

    /// Refuses more of something than the options allow.
    pub(super) fn check_count(&self, count: u64, most: usize, what: &str) -> Result<()> {
        if count <= most as u64 {
            return Ok(());
        }
        let advice = "simplify the model; sound needs walls, not ornaments";
        Err(self.error(format!("more than {most} {what}"), advice))
    }

    /// The error of a vertex that is not finite or too far out; `text` are its coordinates.
    pub(super) fn vertex_error(&self, text: &str, is_finite: bool) -> Error {
        if is_finite {
            return self.error(
                format!("vertex ({text}) lies beyond {LARGEST_COORDINATE_M} m"),
                "check the units: --scale 0.001 reads millimetres; move a map's model to its own origin",
            );
        }
        let problem = format!("vertex ({text}) is not finite and a face uses it");
        self.error(problem, NOT_FINITE_ADVICE)
    }

    /// Checks vertices in metres, all of which are in use.
    pub(super) fn check_vertices(&self, vertices: &[Vec3]) -> Result<()> {
        // False for NaN too.
        let is_bad = |v: &&Vec3| !(v.abs().max_element() <= LARGEST_COORDINATE_M && v.is_finite());
        match vertices.iter().find(is_bad) {
            None => Ok(()),
            Some(v) => {
                let text = shortened(&format!("{} {} {}", v.x, v.y, v.z));
                Err(self.vertex_error(&text, v.is_finite()))
            }
        }
    }
}

/// The warning about faces whose outline crosses itself, if there are any.
pub(super) fn crossing_warning(path: &Path, count: usize) -> Option<String> {
    (count > 0).then(|| {
        let (faces, their) = match count {
            1 => ("face", "its"),
            _ => ("faces", "their"),
        };
        format!(
            "{}: the outline of {count} {faces} crosses itself, so {their} triangles overlap; export triangles",
            path.display()
        )
    })
}

/// At most 24 characters of a text, without control characters, for an error of one line.
pub(super) fn shortened(text: &str) -> String {
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
