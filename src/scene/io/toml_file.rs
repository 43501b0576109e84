//! TOML files with errors that name file, line and key.
//!
//! Control side. The types of this module check values while `serde` reads them: errors then have the value's line.
//! Messages have the form `problem; advice`.

use std::io::Read;
use std::ops::Range;
use std::path::Path;

use glam::Vec3;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::de::{DeTable, Deserializer};

use crate::acoustics::{BANDS, BandArray};
use crate::error::{Error, Result};
use crate::scene::mesh::LARGEST_COORDINATE_M;

/// Largest file in bytes; a thousand materials take less than a megabyte.
const LARGEST_FILE: u64 = 1 << 24;

/// The text of a TOML file.
///
/// # Errors
/// [`Error::File`] where it cannot be read, [`Error::Format`] where it is not text.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let advice = "give the path of a readable TOML file";
    let mut bytes = Vec::new();
    super::open(path, advice)?
        .take(LARGEST_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Error::file(path, error, advice))?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(Error::file(path, "larger than 16 MiB", advice));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        Error::format(
            path,
            Some(line_at(error.as_bytes(), valid)),
            "not UTF-8 text",
            "save the file as UTF-8 TOML",
        )
    })
}

/// Line of a byte of a text, from one.
fn line_at(text: &[u8], offset: usize) -> usize {
    let before = &text[..offset.min(text.len())];
    1 + before.iter().filter(|&&byte| byte == b'\n').count()
}

/// A text and the file it came from.
#[derive(Clone, Copy)]
pub(super) struct TomlFile<'a> {
    pub(super) path: &'a Path,
    pub(super) text: &'a str,
}

impl TomlFile<'_> {
    /// The content of the file.
    pub(super) fn read<T: DeserializeOwned>(&self) -> Result<T> {
        let table = DeTable::parse(self.text).map_err(|error| {
            let advice = "write valid TOML: key = value, [table], [[list of tables]]";
            self.error(error.span().unwrap_or_default(), error.message(), advice)
        })?;
        T::deserialize(Deserializer::from(table)).map_err(|error| {
            let (problem, advice) = error
                .message()
                .split_once("; ")
                .unwrap_or((error.message(), "correct the key or its value"));
            // The text of the error is its message and, in a line of its own, the path of the key.
            let text = error.to_string();
            let key = text.trim_end().rsplit_once("\nin ").map(|(_, key)| key);
            let problem = match key {
                Some(key) => format!("{key}: {problem}"),
                None => problem.to_owned(),
            };
            self.error(error.span().unwrap_or_default(), problem, advice)
        })
    }

    /// An error at a span of the text.
    pub(super) fn error(&self, span: Range<usize>, problem: impl ToString, advice: &str) -> Error {
        let line = line_at(self.text.as_bytes(), span.start);
        let problem = problem.to_string().replace(char::is_control, " ");
        Error::format(self.path, Some(line), problem, advice)
    }
}

/// A number from `LOW` to `HIGH`; with `ABOVE` not `LOW` itself.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "f64")]
pub(super) struct Within<const LOW: i32, const HIGH: i32, const ABOVE: bool = false>(
    pub(super) f64,
);

impl<const LOW: i32, const HIGH: i32, const ABOVE: bool> TryFrom<f64> for Within<LOW, HIGH, ABOVE> {
    type Error = String;

    fn try_from(number: f64) -> std::result::Result<Self, String> {
        if (f64::from(LOW)..=f64::from(HIGH)).contains(&number)
            && !(ABOVE && number == f64::from(LOW))
        {
            return Ok(Self(number));
        }
        let low = if ABOVE { "above " } else { "" };
        Err(format!(
            "{number} is outside {low}{LOW} to {HIGH}; give a number in that range"
        ))
    }
}

/// One number for all bands or one per band, each from `LOW` to `HIGH`.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "toml::Value")]
pub(super) struct PerBand<const LOW: i32, const HIGH: i32>(pub(super) BandArray);

impl<const LOW: i32, const HIGH: i32> TryFrom<toml::Value> for PerBand<LOW, HIGH> {
    type Error = String;

    fn try_from(value: toml::Value) -> std::result::Result<Self, String> {
        let values = match value {
            toml::Value::Array(values) => values,
            single => vec![single],
        };
        let numbers = values
            .into_iter()
            .map(|value| value.try_into::<Within<LOW, HIGH>>().map(|n| n.0 as f32))
            .collect::<std::result::Result<Vec<f32>, _>>()
            .map_err(|error| error.message().to_owned())?;
        match numbers[..] {
            [single] => Ok(Self([single; BANDS])),
            _ => BandArray::try_from(numbers).map(Self).map_err(|numbers| {
                format!(
                    "{} numbers instead of {BANDS}; give one for each octave from 63 Hz to 8 kHz, or a single number for all",
                    numbers.len()
                )
            }),
        }
    }
}

/// Largest absolute coordinate in metres.
const FARTHEST_M: i32 = LARGEST_COORDINATE_M as i32;

/// A position in metres.
#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Vec<Within<{ -FARTHEST_M }, FARTHEST_M>>")]
pub(super) struct Position(pub(super) Vec3);

impl TryFrom<Vec<Within<{ -FARTHEST_M }, FARTHEST_M>>> for Position {
    type Error = String;

    fn try_from(
        numbers: Vec<Within<{ -FARTHEST_M }, FARTHEST_M>>,
    ) -> std::result::Result<Self, String> {
        match numbers[..] {
            [x, y, z] => Ok(Self(Vec3::new(x.0 as f32, y.0 as f32, z.0 as f32))),
            _ => Err(format!(
                "{} numbers instead of 3; write [x, y, z] in metres",
                numbers.len()
            )),
        }
    }
}
