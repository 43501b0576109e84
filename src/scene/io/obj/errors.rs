//! Says where an OBJ file is wrong.
//!
//! Control side. The parser tells broken indices only after it has read all, and numbers are checked after that, so the
//! file is read once more until the line is found. A pipe cannot be, and then the error has no line.

use std::collections::HashMap;
use std::io::BufRead;
use std::path::Path;

use glam::Vec3;

use crate::error::Error;
use crate::scene::io::obj::lines::{ObjLines, Statement, shortened};
use crate::scene::io::obj::{in_range, reopen};
use crate::scene::mesh::LARGEST_COORDINATE_M;

/// The parser's error as ours, with the line.
pub(crate) fn parser_error<R: BufRead>(
    path: &Path,
    lines: &ObjLines<R>,
    error: tobj::LoadError,
) -> Error {
    let here = Some(lines.line);
    if let Some(found) = &lines.problem {
        return Error::format(path, here, &found.problem, found.advice);
    }
    match error {
        tobj::LoadError::ReadError => Error::file(
            path,
            "the file cannot be read to its end",
            "check the disk and the file's permissions",
        ),
        tobj::LoadError::PositionParseError => Error::format(
            path,
            here,
            "a broken `v` statement",
            "write three numbers: v x y z",
        ),
        tobj::LoadError::ScalingByZeroError => Error::format(
            path,
            here,
            "a `v` statement of weight 0",
            "leave the fourth number out or set it to 1",
        ),
        tobj::LoadError::FaceVertexOutOfBounds => index_error(path),
        other => Error::format(path, here, other, "export the model again as plain OBJ"),
    }
}

/// Finds the face that refers to no vertex.
fn index_error(path: &Path) -> Error {
    let mut defined = 0i64;
    // A face may name a vertex that comes after it; one beyond the file's end is worse and is named first.
    let mut ahead: Option<(usize, i64)> = None;
    let mut found = None;
    if let Some(file) = reopen(path) {
        let mut lines = ObjLines::new(file);
        while let Ok(Some(statement)) = lines.statement() {
            match statement {
                Statement::Vertex(_) => defined += 1,
                Statement::Face(corners) => {
                    for corner in corners {
                        if corner < 0 && -corner > defined {
                            found = found.or(Some((lines.line, corner)));
                        }
                        if corner > defined && ahead.is_none_or(|(_, other)| corner > other) {
                            ahead = Some((lines.line, corner));
                        }
                    }
                }
                _ => {}
            }
        }
    }
    let (line, problem) = match found.or(ahead) {
        Some((line, index)) => (
            Some(line),
            format!("a face with vertex index {index}, out of range ({defined} vertices)"),
        ),
        None => (None, "a face with a vertex index out of range".into()),
    };
    Error::format(
        path,
        line,
        problem,
        "refer only to vertices that the file defines before the face",
    )
}

/// Finds the vertex in use that is not finite or too far out.
pub(crate) fn vertex_error(path: &Path, place: &impl Fn([f32; 3]) -> Vec3) -> Error {
    // Vertex number → line and words, for all that are out of range; a face decides which one is in use.
    let mut bad: HashMap<i64, (usize, Vec<String>)> = HashMap::new();
    let mut used: Vec<i64> = Vec::new();
    let mut defined = 0i64;
    if let Some(file) = reopen(path) {
        let mut lines = ObjLines::new(file);
        while let Ok(Some(statement)) = lines.statement() {
            match statement {
                Statement::Vertex(words) => {
                    defined += 1;
                    let numbers: Vec<f32> = words.iter().filter_map(|w| w.parse().ok()).collect();
                    let weight = numbers.get(3).copied().unwrap_or(1.0);
                    if let [x, y, z, ..] = numbers[..]
                        && !in_range(place([x / weight, y / weight, z / weight]))
                    {
                        bad.insert(defined, (lines.line, words));
                    }
                }
                Statement::Face(corners) => used.extend(corners.into_iter().map(|corner| {
                    if corner < 0 {
                        defined + 1 + corner
                    } else {
                        corner
                    }
                })),
                _ => {}
            }
        }
    }
    let culprit = used
        .iter()
        .filter_map(|number| bad.get(number))
        .min_by_key(|(line, _)| *line);
    let Some((line, words)) = culprit else {
        return Error::format(
            path,
            None,
            "a vertex that is not finite or too far out",
            "check the model's units and coordinates",
        );
    };
    let text = shortened(&words.join(" "));
    let finite = words
        .iter()
        .all(|word| word.parse::<f64>().is_ok_and(f64::is_finite));
    if finite {
        Error::format(
            path,
            Some(*line),
            format!("vertex ({text}) lies beyond {LARGEST_COORDINATE_M} m"),
            "check the units: --scale 0.001 reads millimetres; move a map's model to its own origin",
        )
    } else {
        Error::format(
            path,
            Some(*line),
            format!("vertex ({text}) is not finite and a face uses it"),
            "export the model again without NaN and infinite coordinates",
        )
    }
}
