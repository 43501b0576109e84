//! Surface materials by name: the built-in table, extended by a user's.
//!
//! Control side. With the feature `files` a TOML file extends the table:
//!
//! ```toml
//! [materials.my_wall]
//! absorption = [0.02, 0.02, 0.02, 0.03, 0.03, 0.04, 0.05, 0.05]  # energy, random incidence, 63 Hz to 8 kHz
//! scattering = 0.1                 # one number, or one per band; 0.1 if absent
//! transmission_loss_db = 40        # or transmission = energy ratio; nothing passes if both are absent
//! source = "measured in March"     # origin of the numbers; optional
//! ```
//!
//! Absorption includes transmitted energy: transmission is never above it.

mod built_in;

use crate::acoustics::bands::BANDS;
use crate::acoustics::material::Material;

/// Material of names missing from the table.
pub const GENERIC_MATERIAL: &str = "generic";

/// Scattering of a material that states none: smooth building surfaces have 0.05 to 0.2 (\[VORLANDER08\] appendix).
pub const DEFAULT_SCATTERING: f32 = 0.1;

/// Transmission of a material that states none.
pub const DEFAULT_TRANSMISSION: f32 = 0.0;

/// Transmission coefficient of a transmission loss in dB.
pub(super) fn transmission_of_loss(loss_db: f32) -> f32 {
    10f32.powf(-loss_db / 10.0)
}

/// A material and the origin of its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialEntry {
    /// The material under its name in the table.
    pub material: Material,
    /// Origin of the numbers; may be empty.
    pub source: String,
}

/// Materials by name.
///
/// # Examples
/// ```
/// use foresound::{BANDS, Material, MaterialTable};
///
/// let mut table = MaterialTable::built_in();
/// table.extend(MaterialTable::from_materials(vec![Material {
///     name: "hedge".into(),
///     absorption: [0.6; BANDS],
///     scattering: [0.7; BANDS],
///     transmission: [0.2; BANDS],
/// }]));
/// assert!(table.get("hedge").is_some() && table.get("concrete").is_some());
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MaterialTable {
    entries: Vec<MaterialEntry>,
}

/// Materials for a list of names.
#[derive(Debug, Clone, PartialEq)]
pub struct Resolved {
    /// One material a name, in the order of the names and under them.
    pub materials: Vec<Material>,
    /// Names missing from the table; their material is [`GENERIC_MATERIAL`].
    pub defaulted: Vec<String>,
}

impl MaterialTable {
    /// The built-in materials.
    pub fn built_in() -> Self {
        Self::from_entries(built_in::entries())
    }

    /// A table of given materials.
    pub fn from_materials(materials: Vec<Material>) -> Self {
        let entry = |material| MaterialEntry {
            material,
            source: String::new(),
        };
        Self::from_entries(materials.into_iter().map(entry).collect())
    }

    pub(super) fn from_entries(entries: Vec<MaterialEntry>) -> Self {
        Self { entries }
    }

    /// Adds the materials of another table; they replace materials of the same names.
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

    /// Materials for a mesh's names. Unknown names get `GENERIC_MATERIAL` and are listed.
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

    /// The table's generic material, or a default for a table without one.
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
    fn built_in_table_has_every_promised_name_and_valid_numbers() {
        let table = MaterialTable::built_in();
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
            let material = &entry.material;
            assert!(!entry.source.is_empty(), "{}", material.name);
            let ratios = [
                material.absorption,
                material.scattering,
                material.transmission,
            ];
            assert!(ratios.iter().flatten().all(|r| (0.0..=1.0).contains(r)));
        }
    }

    #[test]
    fn names_match_exactly_first_then_in_any_case() {
        let mut table = MaterialTable::built_in();
        let own = [("Concrete", 0.5), ("glass", 0.25)].map(|(name, absorption)| Material {
            name: name.to_owned(),
            absorption: [absorption; BANDS],
            scattering: [DEFAULT_SCATTERING; BANDS],
            transmission: [DEFAULT_TRANSMISSION; BANDS],
        });
        table.extend(MaterialTable::from_materials(own.into()));
        let names = ["concrete", "Concrete", "CONCRETE", "GLASS", "Granite.001"];
        let resolved = table.resolve(&names.map(String::from));
        let first_band: Vec<f32> = resolved.materials.iter().map(|m| m.absorption[0]).collect();
        assert_eq!(first_band[1..], [0.5, 0.5, 0.25, 0.1]);
        assert!(first_band[0] < 0.1);
        assert_eq!(resolved.materials[4].name, "Granite.001");
        assert_eq!(resolved.defaulted, ["Granite.001"]);
    }
}
