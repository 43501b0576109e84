//! Header of a PLY file: the encoding, and what each element has in which order.

use std::io::{BufRead, Read};

use super::super::mesh_file::{Position, shortened};
use super::super::unreadable;
use crate::error::Result;

/// Bytes of the longest header.
const LONGEST_HEADER: u64 = 1 << 20;

const ADVICE: &str = "export the model again as PLY 1.0";

/// How values are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a binary value.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// What an element has at one position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    /// Type of the count of a list; `None` for a single value.
    pub(super) count: Option<Number>,
    pub(super) value: Number,
}

/// A table of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Index of a property.
    pub(super) fn property(&self, names: &[&str]) -> Option<usize> {
        let is_named = |property: &Property| names.contains(&&*property.name);
        self.properties.iter().position(is_named)
    }
}

/// A header and the number of its lines.
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) line_count: usize,
}

/// Reads a header to the end of its last line.
pub(super) fn read(position: &mut Position, input: &mut impl BufRead) -> Result<Header> {
    let mut limited = input.take(LONGEST_HEADER);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut line_count = 0;
    loop {
        let mut line = Vec::new();
        limited
            .read_until(b'\n', &mut line)
            .map_err(|_| unreadable(position.path))?;
        line_count += 1;
        position.line = Some(line_count);
        if !line.ends_with(b"\n") {
            return Err(position.error("a PLY header without `end_header`", ADVICE));
        }
        let line = String::from_utf8_lossy(&line);
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", name, "1.0"] => {
                encoding = Some(match name {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(unknown(position, &line)),
                });
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return Err(unknown(position, &line));
                };
                elements.push(Element {
                    name: name.to_owned(),
                    count,
                    properties: Vec::new(),
                });
            }
            ["property", ref types @ .., name] => {
                let numbers = match *types {
                    [value] => Number::named(value).map(|value| (None, value)),
                    ["list", count, value] => {
                        let is_integer = |n: &Number| !matches!(n, Number::F32 | Number::F64);
                        let count = Number::named(count).filter(is_integer);
                        count.zip(Number::named(value)).map(|(c, v)| (Some(c), v))
                    }
                    _ => None,
                };
                let (Some((count, value)), Some(element)) = (numbers, elements.last_mut()) else {
                    return Err(unknown(position, &line));
                };
                element.properties.push(Property {
                    name: name.to_owned(),
                    count,
                    value,
                });
            }
            ["end_header"] => break,
            ["ply"] if line_count == 1 => {}
            ["comment" | "obj_info", ..] | [] => {}
            _ => return Err(unknown(position, &line)),
        }
    }
    let Some(encoding) = encoding else {
        return Err(position.error("a PLY header without `format`", ADVICE));
    };
    Ok(Header {
        encoding,
        elements,
        line_count,
    })
}

fn unknown(position: &Position, line: &str) -> crate::error::Error {
    let line = shortened(line.trim_end());
    position.error(format!("a PLY header with `{line}`"), ADVICE)
}
