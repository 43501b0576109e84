//! Values of a PLY file, one after another, in any of its encodings.

use std::io::{BufRead, ErrorKind};

use super::super::mesh_file::{Position, shortened};
use super::super::unreadable;
use super::header::{Encoding, Number};
use crate::error::{Error, Result};

/// Bytes of the longest number of a text.
const LONGEST_WORD: usize = 64;

/// A reader of values.
pub(super) struct Values<'a, R> {
    pub(super) position: Position<'a>,
    input: R,
    encoding: Encoding,
}

impl<'a, R: BufRead> Values<'a, R> {
    /// A reader behind a header of `line_count` lines.
    pub(super) fn new(
        mut position: Position<'a>,
        input: R,
        encoding: Encoding,
        line_count: usize,
    ) -> Self {
        position.line = (encoding == Encoding::Text).then_some(line_count + 1);
        Self {
            position,
            input,
            encoding,
        }
    }

    /// The next value. All types are exact in `f64`.
    pub(super) fn next(&mut self, number: Number) -> Result<f64> {
        if self.encoding == Encoding::Text {
            return self.word();
        }
        let mut bytes = [0; 8];
        let bytes = &mut bytes[..number.size()];
        self.input
            .read_exact(bytes)
            .map_err(|error| match error.kind() {
                ErrorKind::UnexpectedEof => self.cut_off(),
                _ => unreadable(self.position.path),
            })?;
        if self.encoding == Encoding::BigEndian {
            bytes.reverse();
        }
        // `bytes` has the type's size.
        Ok(match (number, &*bytes) {
            (Number::I8, &[a]) => i8::from_le_bytes([a]).into(),
            (Number::U8, &[a]) => a.into(),
            (Number::I16, &[a, b]) => i16::from_le_bytes([a, b]).into(),
            (Number::U16, &[a, b]) => u16::from_le_bytes([a, b]).into(),
            (Number::I32, &[a, b, c, d]) => i32::from_le_bytes([a, b, c, d]).into(),
            (Number::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]).into(),
            (Number::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]).into(),
            (_, bytes) => bytes.try_into().map_or(f64::NAN, f64::from_le_bytes),
        })
    }

    /// The next number of a text.
    fn word(&mut self) -> Result<f64> {
        let mut word = [0; LONGEST_WORD];
        let mut length = 0;
        loop {
            let start = match self.input.fill_buf() {
                Ok(start) => start,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(_) => return Err(unreadable(self.position.path)),
            };
            let Some(&byte) = start.first() else {
                break;
            };
            if byte.is_ascii_whitespace() && length > 0 {
                break;
            }
            self.input.consume(1);
            if byte.is_ascii_whitespace() {
                if byte == b'\n' {
                    self.position.line = self.position.line.map(|line| line + 1);
                }
                continue;
            }
            let Some(target) = word.get_mut(length) else {
                break;
            };
            *target = byte;
            length += 1;
        }
        if length == 0 {
            return Err(self.cut_off());
        }
        let text = String::from_utf8_lossy(&word[..length]);
        // Programs in C write `-nan(ind)` and its like.
        if text.trim_start_matches(['-', '+']).starts_with("nan") {
            return Ok(f64::NAN);
        }
        text.parse().map_err(|_| {
            let problem = format!("`{}` is no number", shortened(&text));
            self.position
                .error(problem, "export the model again as PLY 1.0")
        })
    }

    fn cut_off(&self) -> Error {
        self.position.error(
            "the file ends before the last value that its header announces",
            "copy or export the file again",
        )
    }
}
