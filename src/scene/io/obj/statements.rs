//! Reads the statements of an OBJ file for the parser.
//!
//! Control side. Holds one line of text, whatever the size of the file. It counts lines, checks what the parser does not
//! report with a line, and passes on positions, position indices of faces, and materials: the parser forgets material
//! names that no library defines but starts a model at every `o`, so the first face of another material follows `o NAME`.

use std::collections::{HashMap, HashSet};
use std::io::{self, BufRead, Read};
use std::path::Path;

use crate::error::{Error, Result};
use crate::scene::io::mesh_file::{MeshOptions, Position, UNNAMED_MATERIAL, shortened};
use crate::scene::mesh::LARGEST_COORDINATE_M;

/// Longest line in bytes. A polygon of 50,000 corners fits; a binary file without line ends stops here.
const LONGEST_LINE: u64 = 1 << 20;

/// Optional first bytes of a UTF-8 file.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Material libraries that are checked.
const MOST_LIBRARIES: usize = 64;

/// A vertex that no face may use.
struct VertexOutOfRange {
    line: usize,
    text: String,
    finite: bool,
}

/// The statements of a file, as a reader of those that the parser gets.
pub(super) struct Statements<'a, R> {
    path: &'a Path,
    options: &'a MeshOptions,
    input: R,
    raw: Vec<u8>,
    /// Lines read so far.
    line_count: usize,
    /// First line of the current statement, from one.
    line: usize,
    /// Current statement for the parser.
    output: Vec<u8>,
    /// Bytes of it that the parser has read.
    consumed: usize,
    vertex_count: usize,
    triangle_count: usize,
    /// By vertex index from zero, as [`Self::ahead`].
    vertices_out_of_range: HashMap<u32, VertexOutOfRange>,
    /// Vertices that faces use but no statement defines yet, with the line of a face.
    ahead: HashMap<u32, usize>,
    material_names: HashSet<String>,
    /// Material of the next face.
    material: String,
    /// Material of the parser's model.
    model: String,
    /// `mtllib` statements with their lines.
    pub(super) libraries: Vec<(usize, String)>,
    /// Number of lines, points and curves, and the line of the first.
    pub(super) unused: Option<(usize, usize)>,
    /// Error that ended the reading.
    failure: Option<Error>,
}

impl<'a, R: BufRead> Statements<'a, R> {
    pub(super) fn new(path: &'a Path, options: &'a MeshOptions, input: R) -> Self {
        Self {
            path,
            options,
            input,
            raw: Vec::new(),
            line_count: 0,
            line: 0,
            output: Vec::new(),
            consumed: 0,
            vertex_count: 0,
            triangle_count: 0,
            vertices_out_of_range: HashMap::new(),
            ahead: HashMap::new(),
            material_names: HashSet::new(),
            material: UNNAMED_MATERIAL.to_owned(),
            model: String::new(),
            libraries: Vec::new(),
            unused: None,
            failure: None,
        }
    }

    /// The error that ended the parsing, in the current statement.
    pub(super) fn parser_error(&mut self, error: tobj::LoadError) -> Error {
        match (self.failure.take(), error) {
            (Some(failure), _) => failure,
            (None, tobj::LoadError::ScalingByZeroError) => self.error(
                "a `v` statement of weight 0",
                "leave the fourth number out or set it to 1",
            ),
            // Coordinates are the only words that are passed on as they are.
            (None, _) => self.error("a broken `v` statement", "write three numbers: v x y z"),
        }
    }

    /// The current statement.
    fn position(&self) -> Position<'a> {
        Position {
            path: self.path,
            line: Some(self.line),
        }
    }

    /// An error in the current statement.
    fn error(&self, problem: impl ToString, advice: &str) -> Error {
        self.position().error(problem, advice)
    }

    /// The next statement, `None` at the end of the file. A backslash at the end of a line continues it.
    fn next(&mut self) -> Result<Option<String>> {
        self.line = self.line_count + 1;
        let mut text = String::new();
        loop {
            self.raw.clear();
            let limit = LONGEST_LINE.saturating_sub(text.len() as u64);
            let mut limited = self.input.by_ref().take(limit);
            let count = limited.read_until(b'\n', &mut self.raw).map_err(|_| {
                Error::file(
                    self.path,
                    "the file cannot be read to its end",
                    "check the disk and the file's permissions",
                )
            })?;
            if count == 0 && text.is_empty() && limit > 0 {
                return Ok(None);
            }
            self.line_count += 1;
            if self.raw.contains(&0) {
                return Err(self.error(
                    "binary data, not OBJ text",
                    "give a Wavefront OBJ text file",
                ));
            }
            if count as u64 == limit && self.raw.last() != Some(&b'\n') {
                return Err(self.error(
                    format!("a line longer than {LONGEST_LINE} bytes"),
                    "give a Wavefront OBJ text file with one statement a line",
                ));
            }
            if self.line_count == 1 && self.raw.starts_with(BYTE_ORDER_MARK) {
                self.raw.drain(..BYTE_ORDER_MARK.len());
            }
            text.push_str(&String::from_utf8_lossy(&self.raw));
            text.truncate(text.trim_end_matches(['\r', '\n']).len());
            if count == 0 || !text.ends_with('\\') {
                return Ok(Some(text));
            }
            text.pop();
            text.push(' ');
        }
    }

    /// Checks a statement and writes what the parser needs of it.
    fn pass_on(&mut self, statement: &str) -> Result<()> {
        let text = statement.trim();
        let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        let words = rest
            .split_whitespace()
            .take_while(|word| !word.starts_with('#'));
        match keyword {
            "v" => self.pass_vertex(&words.collect::<Vec<_>>()),
            "f" => self.pass_face(words),
            "usemtl" if rest.is_empty() => self.pass_material(UNNAMED_MATERIAL),
            "usemtl" => self.pass_material(rest),
            "mtllib" => {
                if self.libraries.len() < MOST_LIBRARIES {
                    self.libraries.push((self.line, rest.to_owned()));
                }
                Ok(())
            }
            "l" | "p" | "curv" | "curv2" | "surf" => {
                let (count, first) = self.unused.unwrap_or((0, self.line));
                self.unused = Some((count + 1, first));
                Ok(())
            }
            // Comments, groups, normals, texture coordinates.
            _ => Ok(()),
        }
    }

    fn check_count(&self, count: usize, most: usize, what: &str) -> Result<()> {
        self.position().check_count(count as u64, most, what)
    }

    /// Three coordinates; a fourth number is a weight, six are a position and a colour.
    fn pass_vertex(&mut self, words: &[&str]) -> Result<()> {
        let index = self.vertex_count as u32;
        self.vertex_count += 1;
        let most = self.options.max_triangles.saturating_mul(3);
        self.check_count(self.vertex_count, most, "vertices")?;
        let words = &words[..words.len().min(if words.len() == 4 { 4 } else { 3 })];
        let text = words.join(" ");
        self.output.extend(format!("v {text}\n").bytes());
        let is_ahead = self.ahead.remove(&index).is_some();
        let numbers: Vec<f32> = words.iter().filter_map(|word| word.parse().ok()).collect();
        let weight = numbers.get(3).copied().unwrap_or(1.0);
        let [x, y, z, ..] = numbers[..] else {
            return Ok(());
        };
        let vertex = self.options.vertex([x, y, z].map(|value| value / weight));
        // False for NaN too.
        let in_range = vertex.abs().max_element() <= LARGEST_COORDINATE_M && vertex.is_finite();
        if in_range || weight == 0.0 {
            return Ok(());
        }
        let finite = |word: &&str| word.parse::<f64>().is_ok_and(f64::is_finite);
        let found = VertexOutOfRange {
            line: self.line,
            text: shortened(&text),
            finite: words.iter().all(finite),
        };
        if is_ahead {
            return Err(self.vertex_error(&found));
        }
        self.vertices_out_of_range.insert(index, found);
        Ok(())
    }

    fn vertex_error(&self, vertex: &VertexOutOfRange) -> Error {
        let position = Position {
            path: self.path,
            line: Some(vertex.line),
        };
        position.vertex_error(&vertex.text, vertex.finite)
    }

    fn pass_face<'w>(&mut self, words: impl Iterator<Item = &'w str>) -> Result<()> {
        if self.model != self.material {
            self.check_ahead()?;
            self.model.clone_from(&self.material);
            self.output.extend(format!("o {}\n", self.model).bytes());
        }
        let mut corner_count = 0;
        self.output.push(b'f');
        for word in words {
            let corner = self.corner(word)?;
            if let Some(vertex) = self.vertices_out_of_range.get(&corner) {
                return Err(self.vertex_error(vertex));
            }
            if corner as usize >= self.vertex_count {
                self.ahead.entry(corner).or_insert(self.line);
            }
            self.output.extend(format!(" {}", corner + 1).bytes());
            corner_count += 1;
        }
        self.output.push(b'\n');
        if corner_count < 3 {
            return Err(self.error(
                format!("a face of {corner_count} corners"),
                "give every face three corners or more",
            ));
        }
        self.triangle_count += corner_count - 2;
        self.check_count(self.triangle_count, self.options.max_triangles, "triangles")
    }

    /// The vertex index of a face corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, from zero.
    fn corner(&self, word: &str) -> Result<u32> {
        let position = word.split('/').next().unwrap_or_default();
        let count = self.vertex_count as i64;
        match position.parse::<i64>() {
            Ok(0) => Err(self.error(
                "a face with vertex index 0",
                "count vertices from 1, or backwards from -1",
            )),
            // The parser reads indices as `isize`.
            Ok(index) if index.unsigned_abs() > i32::MAX as u64 => Err(self.error(
                format!("a face with vertex index {index}, out of range"),
                "refer only to vertices that the file defines",
            )),
            Ok(index) if index > 0 => Ok((index - 1) as u32),
            Ok(index) if count + index >= 0 => Ok((count + index) as u32),
            Ok(index) => Err(self.index_error(self.line, index)),
            Err(_) => Err(self.error(
                format!("a face corner `{}` that is not a number", shortened(word)),
                "write corners as v, v/vt, v//vn or v/vt/vn",
            )),
        }
    }

    fn index_error(&self, line: usize, index: i64) -> Error {
        let count = self.vertex_count;
        Error::format(
            self.path,
            Some(line),
            format!("a face with vertex index {index}, out of range ({count} vertices)"),
            "refer only to vertices that the file defines before the face",
        )
    }

    /// Checks that the faces of a model refer to vertices: the parser looks them up at the end of each model.
    fn check_ahead(&self) -> Result<()> {
        match self.ahead.iter().max() {
            Some((&vertex, &line)) => Err(self.index_error(line, i64::from(vertex) + 1)),
            None => Ok(()),
        }
    }

    fn pass_material(&mut self, name: &str) -> Result<()> {
        name.clone_into(&mut self.material);
        if self.material_names.insert(name.to_owned()) {
            let count = self.material_names.len();
            self.check_count(count, self.options.max_triangles, "materials")?;
        }
        Ok(())
    }
}

impl<R: BufRead> Read for Statements<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Statements<'_, R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.consumed == self.output.len() {
            self.output.clear();
            self.consumed = 0;
            let passed = match self.next() {
                Ok(Some(statement)) => self.pass_on(&statement),
                Ok(None) if self.ahead.is_empty() => break,
                Ok(None) => self.check_ahead(),
                Err(error) => Err(error),
            };
            if let Err(error) = passed {
                self.failure = Some(error);
                return Err(io::ErrorKind::InvalidData.into());
            }
        }
        Ok(&self.output[self.consumed..])
    }

    fn consume(&mut self, count: usize) {
        self.consumed += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_positions_faces_and_materials_pass() {
        let text = "\u{feff}# c\nmtllib x.mtl\no room\nv 1 2 3 0.5 0.5 0.5\r\nvt 0 0\nf 1/1/1 2//2 \\\n-1 # end\n\
             v 0 0 1\nusemtl b\nusemtl\tOld Wall\nf 1 1 1\nusemtl Old Wall\nf 1 2 1\nusemtl\nf 1 1 2\nf 0 1 2\n";
        let options = MeshOptions::default();
        let mut statements = Statements::new(Path::new("x.obj"), &options, text.as_bytes());
        let mut output = String::new();
        assert!(statements.read_to_string(&mut output).is_err());
        assert_eq!(
            output,
            "v 1 2 3\no default\nf 1 2 1\nv 0 0 1\no Old Wall\nf 1 1 1\nf 1 2 1\no default\nf 1 1 2\n"
        );
        assert_eq!(statements.line, 16);
    }
}
