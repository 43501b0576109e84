//! Splits an OBJ file into statements and counts its lines.
//!
//! Control side. Holds one line of text, whatever the size of the file.

use std::io::{BufRead, Read};
use std::path::Path;

use crate::error::{Error, Result};

/// Longest line in bytes. A polygon of 50,000 corners fits; a binary file without line ends stops here.
const LONGEST_LINE: u64 = 1 << 20;

/// Optional first bytes of a UTF-8 file.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The statements of a file.
pub(super) struct Statements<'a, R> {
    path: &'a Path,
    input: R,
    raw: Vec<u8>,
    /// Lines read so far.
    line_count: usize,
    /// First line of the current statement, from one.
    pub(super) line: usize,
}

impl<'a, R: BufRead> Statements<'a, R> {
    pub(super) fn new(path: &'a Path, input: R) -> Self {
        Self {
            path,
            input,
            raw: Vec::new(),
            line_count: 0,
            line: 0,
        }
    }

    /// An error in the current statement.
    pub(super) fn error(&self, problem: impl ToString, advice: &str) -> Error {
        Error::format(self.path, Some(self.line), problem, advice)
    }

    /// The next statement, `None` at the end of the file. A backslash at the end of a line continues it.
    pub(super) fn next(&mut self) -> Result<Option<String>> {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backslash_continues_a_statement_and_lines_still_count() {
        let text = "f 1 2 \\\n3 4\r\nf 0 1 2\n";
        let mut statements = Statements::new(Path::new("x.obj"), text.as_bytes());
        assert_eq!(statements.next().unwrap().unwrap(), "f 1 2  3 4");
        assert_eq!(statements.next().unwrap().unwrap(), "f 0 1 2");
        assert_eq!(statements.line, 3);
        assert_eq!(statements.next().unwrap(), None);
    }
}
