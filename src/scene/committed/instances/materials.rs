//! Materials of instances that the fixed scene does not have.

use super::Instances;
use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material};
use crate::scene::committed::kept_roughness::{mirrored_share, roughened};

/// A material with its derived factors.
#[derive(Debug, Clone)]
struct PreparedMaterial {
    material: Material,
    /// See [`mirrored_share`].
    mirrored: BandArray,
    reflectance: Reflectance,
    transmission_factor: BandArray,
}

impl PreparedMaterial {
    fn of(material: &Material, mirrored: BandArray) -> Self {
        Self {
            material: material.clone(),
            mirrored,
            reflectance: Reflectance::of(material),
            transmission_factor: material.transmission_factor(),
        }
    }
}

impl Instances {
    /// Those of all materials, by number.
    pub(in crate::scene::committed) fn reflectances(&self) -> impl Iterator<Item = &Reflectance> {
        self.materials
            .entries
            .iter()
            .map(|entry| &entry.reflectance)
    }
}

/// Each distinct material once: repeated parts do not grow the list.
#[derive(Debug, Clone, Default)]
pub(super) struct InstanceMaterials {
    entries: Vec<PreparedMaterial>,
}

impl InstanceMaterials {
    /// The number of a material, which is added if it is new; `of_part` are all of its part.
    pub(super) fn index(&mut self, material: &Material, of_part: &[Material]) -> usize {
        let mirrored = mirrored_share(material, of_part);
        let is_it = |e: &PreparedMaterial| e.material == *material && e.mirrored == mirrored;
        let known = self.entries.iter().position(is_it);
        known.unwrap_or_else(|| {
            self.entries.push(PreparedMaterial::of(material, mirrored));
            self.entries.len() - 1
        })
    }

    /// Whether a material has this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.entries.iter().any(|entry| entry.material.name == name)
    }

    /// Replaces all materials of a name; rough surfaces stay as rough.
    pub(super) fn replace(&mut self, material: &Material) {
        for entry in &mut self.entries {
            if entry.material.name == material.name {
                let mirrored = entry.mirrored;
                *entry = PreparedMaterial::of(&roughened(material, &mirrored), mirrored);
            }
        }
    }

    pub(super) fn material(&self, index: usize) -> Option<&Material> {
        self.entries.get(index).map(|entry| &entry.material)
    }

    pub(super) fn reflectance(&self, index: usize) -> Option<&Reflectance> {
        self.entries.get(index).map(|entry| &entry.reflectance)
    }

    pub(super) fn transmission_factor(&self, index: usize) -> Option<&BandArray> {
        self.entries.get(index).map(|e| &e.transmission_factor)
    }
}
