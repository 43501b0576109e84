//! Reads materials of a TOML file; [`crate::scene::materials`] has the format.
//!
//! Control side.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::toml_file::{PerBand, TomlFile, read_text};
use crate::acoustics::bands::{BANDS, BandArray};
use crate::acoustics::material::Material;
use crate::error::Result;
use crate::scene::materials::{
    DEFAULT_SCATTERING, DEFAULT_TRANSMISSION, MaterialEntry, MaterialTable, transmission_of_loss,
};

/// Tolerance of transmission above absorption: the rounding of a level to two digits.
const TRANSMISSION_SLACK: f32 = 1e-6;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialFile {
    #[serde(default)]
    materials: Materials,
}

/// The `materials` table of a file.
pub(super) type Materials = BTreeMap<String, MaterialFields>;

/// A `[materials.NAME]` table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialFields {
    absorption: PerBand<0, 1>,
    scattering: Option<PerBand<0, 1>>,
    transmission: Option<Spanned<PerBand<0, 1>>>,
    transmission_loss_db: Option<Spanned<PerBand<0, 200>>>,
    #[serde(default)]
    source: String,
}

impl MaterialTable {
    /// Reads a TOML file of `[materials.NAME]` tables, as `materials` describes them.
    ///
    /// # Errors
    /// As [`Self::parse`], and [`Error::File`](crate::Error::File) where the file cannot be read.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(path, &read_text(path)?)
    }

    /// Parses such a file; `path` is for errors.
    ///
    /// # Errors
    /// [`Error::Format`](crate::Error::Format) with line and key for anything but numbers from 0 to 1, one or eight of
    /// them, with transmission not above absorption.
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let file = TomlFile { path, text };
        read_materials(&file, file.read::<MaterialFile>()?.materials)
    }
}

pub(super) fn read_materials(file: &TomlFile, materials: Materials) -> Result<MaterialTable> {
    let entries = materials
        .into_iter()
        .map(|(name, fields)| read_entry(file, name, fields))
        .collect::<Result<_>>()?;
    Ok(MaterialTable::from_entries(entries))
}

fn read_entry(file: &TomlFile, name: String, fields: MaterialFields) -> Result<MaterialEntry> {
    let energy = fields.transmission.as_ref().map(|value| value.get_ref().0);
    let loss = fields
        .transmission_loss_db
        .as_ref()
        .map(|value| value.get_ref().0);
    let span = fields.transmission.as_ref().map(Spanned::span);
    let span = span.or_else(|| fields.transmission_loss_db.as_ref().map(Spanned::span));
    let figures = Figures {
        absorption: fields.absorption.0,
        scattering: fields.scattering.map(|s| s.0),
        transmission: energy,
        transmission_loss_db: loss,
    };
    let material = figures
        .material(name)
        .map_err(|(problem, advice)| file.error(span.unwrap_or_default(), problem, advice))?;
    Ok(MaterialEntry {
        material,
        source: fields.source,
    })
}

/// A material's figures as a file states them, whatever its format.
pub(super) struct Figures {
    pub(super) absorption: BandArray,
    pub(super) scattering: Option<BandArray>,
    /// Energy ratio.
    pub(super) transmission: Option<BandArray>,
    pub(super) transmission_loss_db: Option<BandArray>,
}

impl Figures {
    /// The material, or what is wrong with its transmission and what to do.
    pub(super) fn material(
        self,
        name: String,
    ) -> std::result::Result<Material, (String, &'static str)> {
        let absorption = self.absorption;
        let loss = self.transmission_loss_db;
        if self.transmission.is_some() && loss.is_some() {
            return Err((
                format!("material `{name}` has both `transmission` and `transmission_loss_db`"),
                "keep one of them",
            ));
        }
        let mut transmission = [DEFAULT_TRANSMISSION; BANDS];
        if let Some(ratios) = self
            .transmission
            .or(loss.map(|l| l.map(transmission_of_loss)))
        {
            let excess = (0..BANDS).find(|&b| ratios[b] > absorption[b] + TRANSMISSION_SLACK);
            if let Some(b) = excess {
                return Err((
                    format!(
                        "material `{name}` transmits {:.3} but absorbs {} in band {} of 8",
                        ratios[b],
                        absorption[b],
                        b + 1
                    ),
                    "raise absorption (it counts what passes through) or lower transmission",
                ));
            }
            transmission = std::array::from_fn(|b| ratios[b].min(absorption[b]));
        }
        Ok(Material {
            name,
            absorption,
            scattering: self.scattering.unwrap_or([DEFAULT_SCATTERING; BANDS]),
            transmission,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::materials::MaterialTable;

    fn problem(text: &str) -> String {
        MaterialTable::parse(Path::new("m.toml"), text)
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn losses_become_energy_ratios_and_defaults_hold() {
        let text = "[materials.a]\nabsorption = 0.2\ntransmission_loss_db = 20\n[materials.b]\nabsorption = 1\n";
        let table = MaterialTable::parse(Path::new("m.toml"), text).unwrap();
        let a = &table.get("a").unwrap().material;
        assert!((a.transmission[7] - 0.01).abs() < 1e-8);
        let b = &table.get("b").unwrap().material;
        assert_eq!(b.scattering, [DEFAULT_SCATTERING; BANDS]);
        assert_eq!(b.transmission, [DEFAULT_TRANSMISSION; BANDS]);
    }

    #[test]
    fn errors_name_line_key_and_remedy() {
        for (text, expected) in [
            (
                "[materials.a]\nabsorption = [0.1, 0.2]",
                "m.toml:2: `materials.a.absorption`: 2 numbers instead of 8; give one",
            ),
            (
                "[materials.a]\nabsorption = 1.5",
                "m.toml:2: `materials.a.absorption`: 1.5 is outside 0 to 1; give",
            ),
            (
                "[materials.a]\nabsorption = nan",
                "m.toml:2: `materials.a.absorption`: NaN is outside 0 to 1",
            ),
            (
                "\n[materials.a]\nscattering = 0.1",
                "m.toml:2: `materials.a`: missing field `absorption`",
            ),
            (
                "[materials.a]\nabsorption = 0.1\ntransmission = 0.2",
                "m.toml:3: material `a` transmits 0.200 but absorbs 0.1 in band 1 of 8; raise",
            ),
            (
                "[materials.a]\nabsorption = 0.1\nabsorbtion = 0.2",
                "m.toml:3: `materials.a`: unknown field `absorbtion`, expected one of `absorption`",
            ),
            (
                "[materials.a]\nabsorption = 'x'",
                "m.toml:2: `materials.a.absorption`: invalid type: string",
            ),
            (
                "[materials.a]\nabsorption = 1\ntransmission = 0\ntransmission_loss_db = 3",
                "m.toml:3: material `a` has both",
            ),
            (
                "materials = 3",
                "m.toml:1: `materials`: invalid type: integer `3`",
            ),
            ("[material.a]", "m.toml:1: unknown field `material`"),
            ("[materials.a\n", "m.toml:1: "),
        ] {
            let text = problem(text);
            assert!(text.starts_with(expected), "{text}");
            assert_eq!(text.lines().count(), 1);
        }
    }
}
