//! Materials of instances that the fixed scene does not have.

use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material};

/// One of them, ready for use.
#[derive(Debug, Clone)]
struct PreparedMaterial {
    material: Material,
    reflectance: Reflectance,
    transmission_factor: BandArray,
}

/// All of them. Every material once, so parts that come and go add none.
#[derive(Debug, Clone, Default)]
pub(super) struct InstanceMaterials {
    entries: Vec<PreparedMaterial>,
}

impl InstanceMaterials {
    /// The number of a material, which is added if it is new.
    pub(super) fn number(&mut self, material: &Material) -> usize {
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

    pub(super) fn material(&self, number: usize) -> Option<&Material> {
        self.entries.get(number).map(|entry| &entry.material)
    }

    pub(super) fn reflectance(&self, number: usize) -> Option<&Reflectance> {
        self.entries.get(number).map(|entry| &entry.reflectance)
    }

    pub(super) fn transmission_factor(&self, number: usize) -> Option<&BandArray> {
        self.entries.get(number).map(|e| &e.transmission_factor)
    }
}
