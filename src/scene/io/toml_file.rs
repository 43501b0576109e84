//! TOML files with errors that name file, line and key.
//!
//! Control side. One reader for materials and scene layouts; values keep their place in the text, so that a number out
//! of range is reported where it stands.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use glam::Vec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{Error, Result};
use crate::scene::mesh::LARGEST_COORDINATE_M;

/// Largest file in bytes; a thousand materials take less than one.
const LARGEST_FILE: u64 = 1 << 24;

/// The text of a TOML file.
///
/// # Errors
/// [`Error::File`] where it cannot be read, [`Error::Format`] where it is not text.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let advice = "give the path of a readable TOML file";
    let file = File::open(path).map_err(|error| Error::file(path, error, advice))?;
    if file.metadata().is_ok_and(|about| about.is_dir()) {
        return Err(Error::file(path, "is a directory", advice));
    }
    let mut bytes = Vec::new();
    file.take(LARGEST_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Error::file(path, error, advice))?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(Error::file(path, "larger than 16 MiB", advice));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..good]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count();
        Error::format(
            path,
            Some(line),
            "not UTF-8 text",
            "save the file as UTF-8 TOML",
        )
    })
}

/// A text and the file it came from.
#[derive(Clone, Copy)]
pub(crate) struct TomlFile<'a> {
    pub(crate) path: &'a Path,
    pub(crate) text: &'a str,
}

impl<'a> TomlFile<'a> {
    pub(crate) fn parse(&self) -> Result<DeTable<'a>> {
        DeTable::parse(self.text)
            .map(Spanned::into_inner)
            .map_err(|error| {
                let message = error.message().lines().collect::<Vec<_>>().join(", ");
                Error::format(
                    self.path,
                    error.span().map(|span| self.line(&span)),
                    message,
                    "write valid TOML: key = value, [table], [[list of tables]]",
                )
            })
    }

    /// Line of a place in the text, from one.
    fn line(&self, span: &Range<usize>) -> usize {
        let before = span.start.min(self.text.len());
        1 + self.text.as_bytes()[..before]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count()
    }

    pub(crate) fn error(&self, span: Range<usize>, problem: impl ToString, advice: &str) -> Error {
        Error::format(self.path, Some(self.line(&span)), problem, advice)
    }

    /// Refuses keys that nobody reads: a misspelt one would be silently without effect.
    pub(crate) fn known_keys(&self, table: &DeTable<'_>, place: &str, keys: &[&str]) -> Result<()> {
        for key in table.keys() {
            let name = key.get_ref().as_ref();
            if !keys.contains(&name) {
                return Err(self.error(
                    key.span(),
                    format!("unknown key `{}` in {place}", name.escape_debug()),
                    &format!("use {}", keys.join(", ")),
                ));
            }
        }
        Ok(())
    }

    pub(crate) fn table<'v>(
        &self,
        value: &'v Spanned<DeValue<'a>>,
        key: &str,
    ) -> Result<&'v DeTable<'a>> {
        match value.get_ref() {
            DeValue::Table(table) => Ok(table),
            other => Err(self.wrong_type(value.span(), key, other, "a table")),
        }
    }

    pub(crate) fn string(&self, value: &Spanned<DeValue<'_>>, key: &str) -> Result<String> {
        match value.get_ref() {
            DeValue::String(text) => Ok(text.to_string()),
            other => Err(self.wrong_type(value.span(), key, other, "a string")),
        }
    }

    /// A finite number.
    pub(crate) fn number(&self, value: &Spanned<DeValue<'_>>, key: &str) -> Result<f64> {
        let number = match value.get_ref() {
            DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix())
                .ok()
                .map(|n| n as f64),
            DeValue::Float(n) => n.as_str().parse().ok(),
            other => return Err(self.wrong_type(value.span(), key, other, "a number")),
        };
        number.filter(|n| n.is_finite()).ok_or_else(|| {
            self.error(
                value.span(),
                format!("`{key}` is not a finite number"),
                "give an ordinary decimal number",
            )
        })
    }

    /// Numbers with their places; a single number is a list of one.
    pub(crate) fn numbers(
        &self,
        value: &Spanned<DeValue<'_>>,
        key: &str,
    ) -> Result<Vec<(f64, Range<usize>)>> {
        match value.get_ref() {
            DeValue::Array(values) => values
                .iter()
                .map(|v| Ok((self.number(v, key)?, v.span())))
                .collect(),
            _ => Ok(vec![(self.number(value, key)?, value.span())]),
        }
    }

    /// A position in metres.
    pub(crate) fn position(&self, value: &Spanned<DeValue<'_>>, key: &str) -> Result<Vec3> {
        let numbers = self.numbers(value, key)?;
        let [x, y, z] = numbers[..].as_array().ok_or_else(|| {
            self.error(
                value.span(),
                format!("`{key}` has {} numbers instead of 3", numbers.len()),
                "write [x, y, z] in metres",
            )
        })?;
        for (number, span) in [x, y, z] {
            if number.abs() > f64::from(LARGEST_COORDINATE_M) {
                return Err(self.error(
                    span.clone(),
                    format!("`{key}` {number} lies beyond {LARGEST_COORDINATE_M} m"),
                    "give metres in the mesh's coordinates",
                ));
            }
        }
        Ok(Vec3::new(x.0 as f32, y.0 as f32, z.0 as f32))
    }

    fn wrong_type(
        &self,
        span: Range<usize>,
        key: &str,
        found: &DeValue<'_>,
        wanted: &str,
    ) -> Error {
        let found = match found {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "a truth value",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.error(
            span,
            format!("`{key}` is {found} instead of {wanted}"),
            &format!("give {wanted}"),
        )
    }
}
