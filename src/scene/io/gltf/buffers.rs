//! Bytes of a glTF file's buffers: the binary chunk of a GLB, files beside, and base64 within the document.
//!
//! Control side. Only ranges that geometry is in are read: pictures stay on the disk.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::document::{Buffer, Document};
use crate::error::{Error, Result};
use crate::scene::io::mesh_file::{Position, shortened};

/// The bytes of one buffer.
enum Content {
    /// A file, and the first byte of the buffer in it.
    File {
        path: PathBuf,
        file: BufReader<File>,
        start: u64,
    },
    /// What a document holds itself.
    Bytes(Vec<u8>),
}

/// All buffers of a document, opened when they are first used.
pub(super) struct Buffers<'a> {
    position: Position<'a>,
    document: &'a Document,
    contents: Vec<Option<Content>>,
}

impl<'a> Buffers<'a> {
    /// Buffers of a document; `binary` is the file of a GLB and the position of its binary chunk.
    pub(super) fn new(
        position: Position<'a>,
        document: &'a Document,
        binary: Option<(BufReader<File>, u64)>,
    ) -> Self {
        let mut contents: Vec<_> = document.buffers.iter().map(|_| None).collect();
        let first = contents.first_mut().zip(document.buffers.first());
        if let (Some((content, Buffer { uri: None, .. })), Some((file, start))) = (first, binary) {
            let path = position.path.to_owned();
            *content = Some(Content::File { path, file, start });
        }
        Self {
            position,
            document,
            contents,
        }
    }

    /// A range of a buffer view.
    pub(super) fn view(&mut self, view: usize, offset: u64, length: u64) -> Result<Vec<u8>> {
        let position = self.position;
        let views = &self.document.buffer_views;
        let found = views
            .get(view)
            .ok_or_else(|| missing(position, "buffer view", view, views.len()))?;
        let buffers = &self.document.buffers;
        let buffer = buffers
            .get(found.buffer)
            .ok_or_else(|| missing(position, "buffer", found.buffer, buffers.len()))?;
        let is_within = |end: Option<u64>, length| end.is_some_and(|end| end <= length);
        let start = found.byte_offset.checked_add(offset);
        let end = start.and_then(|start| start.checked_add(length));
        let (Some(start), true, true) = (
            start,
            is_within(offset.checked_add(length), found.byte_length),
            is_within(end, buffer.byte_length),
        ) else {
            let problem = format!("glTF data that reaches beyond its buffer view {view}");
            return Err(position.error(problem, super::ADVICE));
        };
        self.range(found.buffer, start, length)
    }

    fn range(&mut self, buffer: usize, start: u64, length: u64) -> Result<Vec<u8>> {
        if self.contents[buffer].is_none() {
            self.contents[buffer] = Some(self.open(&self.document.buffers[buffer])?);
        }
        let cut_off = |path: &Path| {
            Position { path, line: None }.error(
                "the file is shorter than it says",
                "copy or export the file again",
            )
        };
        match &mut self.contents[buffer] {
            Some(Content::File {
                path,
                file,
                start: first,
            }) => {
                let mut bytes = Vec::new();
                let place = first.saturating_add(start);
                let read = file.seek(SeekFrom::Start(place));
                let read = read.and_then(|_| file.take(length).read_to_end(&mut bytes));
                match read {
                    Ok(_) if bytes.len() as u64 == length => Ok(bytes),
                    Ok(_) => Err(cut_off(path)),
                    Err(error) if error.kind() == ErrorKind::UnexpectedEof => Err(cut_off(path)),
                    Err(_) => Err(crate::scene::io::unreadable(path)),
                }
            }
            Some(Content::Bytes(bytes)) => {
                let found = bytes.get(start as usize..start.saturating_add(length) as usize);
                found
                    .map(<[u8]>::to_vec)
                    .ok_or_else(|| cut_off(self.position.path))
            }
            None => Ok(Vec::new()),
        }
    }

    fn open(&self, buffer: &Buffer) -> Result<Content> {
        let Some(uri) = &buffer.uri else {
            return Err(self
                .position
                .error("a glTF buffer without data", super::ADVICE));
        };
        if let Some(data) = uri.strip_prefix("data:") {
            let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
            let bytes = encoded.and_then(|encoded| STANDARD.decode(encoded.trim_end()).ok());
            return bytes.map(Content::Bytes).ok_or_else(|| {
                self.position
                    .error("a glTF buffer of broken base64", super::ADVICE)
            });
        }
        if uri.contains(':') || uri.starts_with('/') {
            let problem = format!(
                "a glTF buffer at `{}`, which is no file beside it",
                shortened(uri)
            );
            return Err(self.position.error(problem, super::FILE_ADVICE));
        }
        let folder = self.position.path.parent().unwrap_or(Path::new(""));
        let path = folder.join(decoded(uri));
        let file = crate::scene::io::open(&path, super::FILE_ADVICE)?;
        Ok(Content::File {
            path,
            file: BufReader::new(file),
            start: 0,
        })
    }
}

/// The error of an index beyond a list.
pub(super) fn missing(position: Position, what: &str, index: usize, count: usize) -> Error {
    let problem = format!("glTF refers to {what} {index} of {count}");
    position.error(problem, super::ADVICE)
}

/// A URI's path with its `%20` and the like as characters.
fn decoded(uri: &str) -> String {
    let uri = uri.as_bytes();
    let mut bytes = Vec::new();
    let mut at = 0;
    while let Some(&byte) = uri.get(at) {
        let digits = uri.get(at + 1..at + 3).filter(|_| byte == b'%');
        let digits = digits.and_then(|digits| std::str::from_utf8(digits).ok());
        let value = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(value.unwrap_or(byte));
        at += if value.is_some() { 3 } else { 1 };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_name_files_with_blanks() {
        assert_eq!(decoded("Old%20Hall%2e.bin"), "Old Hall..bin");
        assert_eq!(decoded("50%.bin%2"), "50%.bin%2");
    }
}
