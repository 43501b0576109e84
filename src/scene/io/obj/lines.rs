//! Feeds an OBJ file to the parser one statement at a time and knows which line is being read.
//!
//! Control side; holds one line of text, whatever the size of the file. It passes on only what a sound needs: corner
//! positions, faces without their texture and normal indices, and material changes. A material's name becomes its
//! number in [`ObjLines::names`], announced by a `mtllib` line of its own: the parser forgets names that no library
//! defines, so every name gets a library.

use std::collections::HashMap;
use std::io::{self, BufRead, Read};

/// Longest line in bytes. A polygon of 50,000 corners fits; a binary file without line ends stops here.
const LONGEST_LINE: u64 = 1 << 20;

/// Material libraries that are looked at.
const MOST_LIBRARIES: usize = 64;

/// What may stand before the first line of UTF-8 text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// A problem that the reader itself finds, with what to do about it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LineProblem {
    /// What is wrong.
    pub(crate) problem: String,
    /// What to do.
    pub(crate) advice: &'static str,
}

/// One statement of an OBJ file that matters to sound.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Statement {
    /// `v`: the words of a position, three or four.
    Vertex(Vec<String>),
    /// `f`: the position index of each corner, as written.
    Face(Vec<i64>),
    /// `usemtl`: a name, empty if none was given.
    Material(String),
    /// `mtllib`: the rest of the line.
    Library(String),
    /// `l`, `p`, curves and free-form surfaces: nothing that could reflect.
    Unused,
    /// Anything else: comments, groups, normals, texture coordinates.
    Other,
}

/// Reader of statements, and of the parser's food made from them.
pub(crate) struct ObjLines<R> {
    input: R,
    raw: Vec<u8>,
    /// Lines read so far.
    lines: usize,
    /// Line on which the present statement began, from one.
    pub(crate) line: usize,
    food: Vec<u8>,
    eaten: usize,
    numbers: HashMap<String, usize>,
    /// Material names by number, in the order of first use.
    pub(crate) names: Vec<String>,
    /// `mtllib` statements with their lines.
    pub(crate) libraries: Vec<(usize, String)>,
    /// Number of lines, points and curves left out, and the first one's line.
    pub(crate) unused: Option<(usize, usize)>,
    /// What stopped the reading, if this reader did.
    pub(crate) problem: Option<LineProblem>,
    most_triangles: usize,
    /// Triangles and vertices so far.
    triangles: usize,
    vertices: usize,
}

impl<R: BufRead> ObjLines<R> {
    pub(crate) fn new(input: R) -> Self {
        Self {
            input,
            raw: Vec::new(),
            lines: 0,
            line: 0,
            food: Vec::new(),
            eaten: 0,
            numbers: HashMap::new(),
            names: Vec::new(),
            libraries: Vec::new(),
            unused: None,
            problem: None,
            most_triangles: usize::MAX,
            triangles: 0,
            vertices: 0,
        }
    }

    /// Stops where there are more triangles than this, three times as many vertices, or as many materials.
    pub(crate) fn within(self, most_triangles: usize) -> Self {
        Self {
            most_triangles,
            ..self
        }
    }

    fn more_than(&mut self, most: usize, what: &str) -> io::Error {
        self.stop(
            format!("more than {most} {what}"),
            "simplify the model; sound needs walls, not ornaments",
        )
    }

    /// The next statement, `None` at the end of the file.
    pub(crate) fn statement(&mut self) -> io::Result<Option<Statement>> {
        self.line = self.lines + 1;
        let mut text = String::new();
        loop {
            self.raw.clear();
            let limit = LONGEST_LINE.saturating_sub(text.len() as u64);
            let count = self
                .input
                .by_ref()
                .take(limit)
                .read_until(b'\n', &mut self.raw)?;
            if count == 0 && text.is_empty() && limit > 0 {
                return Ok(None);
            }
            self.lines += 1;
            if self.raw.contains(&0) {
                return Err(self.stop(
                    "binary data, not OBJ text".into(),
                    "give a Wavefront OBJ text file",
                ));
            }
            if count as u64 == limit && self.raw.last() != Some(&b'\n') {
                return Err(self.stop(
                    format!("a line longer than {LONGEST_LINE} bytes"),
                    "give a Wavefront OBJ text file with one statement a line",
                ));
            }
            // Editors of one system begin a file with a mark of its encoding.
            if self.lines == 1 && self.raw.starts_with(BYTE_ORDER_MARK) {
                self.raw.drain(..BYTE_ORDER_MARK.len());
            }
            text.push_str(&String::from_utf8_lossy(&self.raw));
            let kept = text.trim_end_matches(['\r', '\n']).len();
            text.truncate(kept);
            // A backslash at the end of a line carries the statement on to the next.
            if count > 0 && text.ends_with('\\') {
                text.pop();
                text.push(' ');
            } else {
                break;
            }
        }
        self.classify(&text).map(Some)
    }

    fn classify(&mut self, text: &str) -> io::Result<Statement> {
        let text = text.trim();
        let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        let words = rest
            .split_whitespace()
            .take_while(|word| !word.starts_with('#'));
        match keyword {
            "v" => {
                self.vertices += 1;
                let most = self.most_triangles.saturating_mul(3);
                if self.vertices > most {
                    return Err(self.more_than(most, "vertices"));
                }
                let words: Vec<String> = words.map(str::to_owned).collect();
                // Three coordinates, or four with a weight; more are a colour.
                let kept = if words.len() == 4 { 4 } else { 3 };
                Ok(Statement::Vertex(words.into_iter().take(kept).collect()))
            }
            "f" => {
                let corners = words
                    .map(|word| self.corner(word))
                    .collect::<io::Result<Vec<i64>>>()?;
                if corners.len() < 3 {
                    return Err(self.stop(
                        format!("a face of {} corners", corners.len()),
                        "give every face three corners or more",
                    ));
                }
                self.triangles += corners.len() - 2;
                if self.triangles > self.most_triangles {
                    return Err(self.more_than(self.most_triangles, "triangles"));
                }
                Ok(Statement::Face(corners))
            }
            "usemtl" => {
                if self.names.len() > self.most_triangles {
                    return Err(self.more_than(self.most_triangles, "materials"));
                }
                Ok(Statement::Material(rest.to_owned()))
            }
            "mtllib" => Ok(Statement::Library(rest.to_owned())),
            "l" | "p" | "curv" | "curv2" | "surf" => Ok(Statement::Unused),
            _ => Ok(Statement::Other),
        }
    }

    /// The position index of a face corner `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, word: &str) -> io::Result<i64> {
        let position = word.split('/').next().unwrap_or_default();
        match position.parse::<i64>() {
            Ok(0) => Err(self.stop(
                "a face with vertex index 0".into(),
                "count vertices from 1, or backwards from -1",
            )),
            // The parser adds the vertex count to a negative index; this bound keeps the sum in range everywhere.
            Ok(index) if index.unsigned_abs() <= i32::MAX as u64 => Ok(index),
            Ok(index) => Err(self.stop(
                format!("a face with vertex index {index}, out of range"),
                "refer only to vertices that the file defines",
            )),
            Err(_) => Err(self.stop(
                format!("a face corner `{}` that is not a number", shortened(word)),
                "write corners as v, v/vt, v//vn or v/vt/vn",
            )),
        }
    }

    fn stop(&mut self, problem: String, advice: &'static str) -> io::Error {
        let error = io::Error::new(io::ErrorKind::InvalidData, problem.clone());
        self.problem = Some(LineProblem { problem, advice });
        error
    }

    fn cook(&mut self, statement: Statement) {
        self.food.clear();
        self.eaten = 0;
        let mut text = String::new();
        match statement {
            Statement::Vertex(words) => text = format!("v {}\n", words.join(" ")),
            Statement::Face(corners) => {
                text.push('f');
                for corner in corners {
                    text.push_str(&format!(" {corner}"));
                }
                text.push('\n');
            }
            Statement::Material(name) => {
                let name = if name.is_empty() {
                    crate::scene::io::obj::UNNAMED_MATERIAL.to_owned()
                } else {
                    name
                };
                if let Some(number) = self.numbers.get(&name) {
                    text = format!("usemtl {number}\n");
                } else {
                    let number = self.names.len();
                    self.numbers.insert(name.clone(), number);
                    self.names.push(name);
                    text = format!("mtllib {number}\nusemtl {number}\n");
                }
            }
            Statement::Library(file) => {
                if self.libraries.len() < MOST_LIBRARIES {
                    self.libraries.push((self.line, file));
                }
            }
            Statement::Unused => {
                let (count, first) = self.unused.unwrap_or((0, self.line));
                self.unused = Some((count + 1, first));
            }
            Statement::Other => {}
        }
        self.food.extend_from_slice(text.as_bytes());
    }
}

impl<R: BufRead> Read for ObjLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(buffer.len());
        buffer[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for ObjLines<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.eaten >= self.food.len() {
            match self.statement()? {
                Some(statement) => self.cook(statement),
                None => return Ok(&[]),
            }
        }
        Ok(&self.food[self.eaten..])
    }

    fn consume(&mut self, amount: usize) {
        self.eaten = (self.eaten + amount).min(self.food.len());
    }
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

    fn fed(text: &str) -> (String, Vec<String>) {
        let mut lines = ObjLines::new(text.as_bytes());
        let mut food = String::new();
        lines.read_to_string(&mut food).unwrap();
        (food, lines.names)
    }

    #[test]
    fn only_positions_faces_and_numbered_materials_pass() {
        let (food, names) = fed("# c\nmtllib x.mtl\no room\nv 1 2 3 0.5 0.5 0.5\r\nvt 0 0\n\
             usemtl\tOld Wall\nf 1/1/1 2//2 -1 # end\nusemtl b\nusemtl Old Wall\nl 1 2");
        assert_eq!(
            food,
            "v 1 2 3\nmtllib 0\nusemtl 0\nf 1 2 -1\nmtllib 1\nusemtl 1\nusemtl 0\n"
        );
        assert_eq!(names, ["Old Wall", "b"]);
    }

    #[test]
    fn backslash_carries_a_face_on_and_lines_still_count() {
        let mut lines = ObjLines::new("f 1 2 \\\n3 4\nf 0 1 2\n".as_bytes());
        let face = lines.statement().unwrap();
        assert_eq!(face, Some(Statement::Face(vec![1, 2, 3, 4])));
        assert!(lines.statement().is_err());
        assert_eq!(lines.line, 3);
    }
}
