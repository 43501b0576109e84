//! Materials of instances that the fixed scene does not have.

use super::Instances;
use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material};

/// A material with its derived factors.
#[derive(Debug, Clone)]
struct PreparedMaterial {
    material: Material,
    reflectance: Reflectance,
    transmission_factor: BandArray,
}

impl PreparedMaterial {
    fn of(material: &Material) -> Self {
        Self {
            material: material.clone(),
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
    /// The number of a material, which is added if it is new.
    pub(super) fn index(&mut self, material: &Material) -> usize {
        let known = self.entries.iter().position(|e| e.material == *material);
        known.unwrap_or_else(|| {
            self.entries.push(PreparedMaterial::of(material));
            self.entries.len() - 1
        })
    }

    /// Whether a material has this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.entries.iter().any(|entry| entry.material.name == name)
    }

    /// Replaces all materials of a name.
    pub(super) fn replace(&mut self, material: &Material) {
        for entry in &mut self.entries {
            if entry.material.name == material.name {
                *entry = PreparedMaterial::of(material);
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
