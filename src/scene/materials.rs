//! The table of surface materials: built in, and extended by a user's file.
//!
//! Control side. Both are TOML and go through the same code:
//!
//! ```toml
//! [materials.my_wall]
//! absorption = [0.02, 0.02, 0.02, 0.03, 0.03, 0.04, 0.05, 0.05]  # energy, random incidence, 63 Hz to 8 kHz
//! scattering = 0.1                 # one number, or one a band; 0.1 if absent
//! transmission_loss_db = 40        # or transmission = energy ratio; nothing passes if both are absent
//! source = "measured in March"     # where the numbers come from; optional
//! ```
//!
//! Absorption counts what passes through, so transmission is never above it.

use std::path::Path;
use std::sync::OnceLock;

use toml::Spanned;
use toml::de::DeValue;

use crate::acoustics::bands::BANDS;
use crate::acoustics::material::Material;
use crate::error::Result;
use crate::scene::io::material_entry::read_entry;
use crate::scene::io::toml_file::{TomlFile, read_text};

/// Name of the material that unknown names get.
pub const GENERIC_MATERIAL: &str = "generic";

/// Scattering of a material that states none: smooth building surfaces have 0.05 to 0.2 (\[VORLANDER08\] appendix).
pub const DEFAULT_SCATTERING: f32 = 0.1;

/// Transmission of a material that states none.
pub const DEFAULT_TRANSMISSION: f32 = 0.0;

/// A material and where its numbers come from.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialEntry {
    /// The material under its name in the table.
    pub material: Material,
    /// The source its file states, empty if none.
    pub source: String,
}

/// Materials by name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MaterialTable {
    entries: Vec<MaterialEntry>,
}

/// Materials for a list of names.
#[derive(Debug, Clone, PartialEq)]
pub struct Resolved {
    /// One material a name, in the order asked, under the name asked.
    pub materials: Vec<Material>,
    /// Names that the table does not know and that got [`GENERIC_MATERIAL`].
    pub defaulted: Vec<String>,
}

impl MaterialTable {
    /// The materials that come with the crate.
    pub fn built_in() -> Self {
        static TABLE: OnceLock<MaterialTable> = OnceLock::new();
        // A test parses the included text, so the empty table stands for nothing that ships.
        TABLE
            .get_or_init(|| {
                let text = include_str!("materials.toml");
                Self::parse(Path::new("built-in materials.toml"), text).unwrap_or_default()
            })
            .clone()
    }

    /// A table of given materials.
    pub fn from_materials(materials: Vec<Material>) -> Self {
        let entry = |material| MaterialEntry {
            material,
            source: String::new(),
        };
        Self {
            entries: materials.into_iter().map(entry).collect(),
        }
    }

    /// Reads a file of `[materials.NAME]` tables.
    ///
    /// # Errors
    /// As [`Self::parse`], and [`crate::Error::File`] where the file cannot be read.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(path, &read_text(path)?)
    }

    /// Reads the text of such a file; `path` is for errors.
    ///
    /// # Errors
    /// [`crate::Error::Format`] with line and key for anything but numbers from 0 to 1, one or eight of them, with
    /// transmission not above absorption.
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let file = TomlFile { path, text };
        let root = file.parse()?;
        file.known_keys(&root, "the file", &["materials"])?;
        match root.get("materials") {
            Some(value) => Self::from_toml(file, value),
            None => Ok(Self::default()),
        }
    }

    /// From the value of a `materials` key.
    pub(super) fn from_toml<'a>(file: TomlFile<'a>, value: &Spanned<DeValue<'a>>) -> Result<Self> {
        let mut table = Self::default();
        for (name, value) in file.table(value, "materials")? {
            let name_text = name.get_ref().as_ref();
            let fields = file.table(value, name_text)?;
            let entry = read_entry(file, name, fields)?;
            table.entries.push(entry);
        }
        Ok(table)
    }

    /// Adds the materials of another table; they win over those already here.
    pub fn extend(&mut self, other: Self) {
        for entry in other.entries {
            self.entries
                .retain(|old| old.material.name != entry.material.name);
            self.entries.push(entry);
        }
    }

    /// Finds a material: by its exact name, else by its name in any ASCII case, the last one added if several fit.
    pub fn get(&self, name: &str) -> Option<&MaterialEntry> {
        let named = |entry: &&MaterialEntry| entry.material.name == name;
        let like = |entry: &&MaterialEntry| entry.material.name.eq_ignore_ascii_case(name);
        self.entries
            .iter()
            .find(named)
            .or_else(|| self.entries.iter().rev().find(like))
    }

    /// All materials.
    pub fn entries(&self) -> &[MaterialEntry] {
        &self.entries
    }

    /// Materials for a mesh's names. Unknown names get [`GENERIC_MATERIAL`] and are listed.
    pub fn resolve(&self, names: &[String]) -> Resolved {
        let mut resolved = Resolved {
            materials: Vec::with_capacity(names.len()),
            defaulted: Vec::new(),
        };
        for name in names {
            let found = self.get(name).map(|entry| entry.material.clone());
            let mut material = found.unwrap_or_else(|| {
                resolved.defaulted.push(name.clone());
                self.generic()
            });
            material.name.clone_from(name);
            resolved.materials.push(material);
        }
        resolved
    }

    /// What unknown names get: the table's own entry, else the built-in numbers for a table without one.
    fn generic(&self) -> Material {
        self.get(GENERIC_MATERIAL).map_or_else(
            || Material {
                name: GENERIC_MATERIAL.into(),
                absorption: [0.1; BANDS],
                scattering: [DEFAULT_SCATTERING; BANDS],
                transmission: [DEFAULT_TRANSMISSION; BANDS],
            },
            |entry| entry.material.clone(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_table_parses_and_has_every_promised_name() {
        let text = include_str!("materials.toml");
        let table = MaterialTable::parse(Path::new("materials.toml"), text).unwrap();
        assert_eq!(table, MaterialTable::built_in());
        for name in [
            "concrete",
            "plaster",
            "brick",
            "wood_panel",
            "wood_floor",
            "parquet_on_concrete",
            "glass",
            "steel",
            "carpet",
            "upholstered_seat",
            "curtain",
            "acoustic_ceiling",
            "door_wood",
            "gypsum_board",
            "grass",
            "gravel",
            "soil",
            "foliage",
            "asphalt",
            "marble",
            "sandbag",
            GENERIC_MATERIAL,
        ] {
            assert!(table.get(name).is_some(), "{name}");
        }
        for entry in table.entries() {
            assert!(!entry.source.is_empty(), "{}", entry.material.name);
        }
    }

    #[test]
    fn names_match_exactly_first_then_in_any_case() {
        let mut table = MaterialTable::built_in();
        let own = "[materials.Concrete]\nabsorption = 0.5\n[materials.glass]\nabsorption = 0.25\n";
        table.extend(MaterialTable::parse(Path::new("m.toml"), own).unwrap());
        let names = ["concrete", "Concrete", "CONCRETE", "GLASS", "Granite.001"];
        let resolved = table.resolve(&names.map(String::from));
        let first_band: Vec<f32> = resolved.materials.iter().map(|m| m.absorption[0]).collect();
        assert_eq!(first_band[1..], [0.5, 0.5, 0.25, 0.1]);
        assert!(first_band[0] < 0.1);
        assert_eq!(resolved.materials[4].name, "Granite.001");
        assert_eq!(resolved.defaulted, ["Granite.001"]);
    }
}
