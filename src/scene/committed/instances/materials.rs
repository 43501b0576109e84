//! Materials of instances that the fixed scene does not have.

use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material};

/// A material with its derived factors.
#[derive(Debug, Clone)]
struct PreparedMaterial {
    material: Material,
    reflectance: Reflectance,
    transmission_factor: BandArray,
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
            self.entries.push(PreparedMaterial {
                material: material.clone(),
                reflectance: Reflectance::of(material),
                transmission_factor: material.transmission_factor(),
            });
            self.entries.len() - 1
        })
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
