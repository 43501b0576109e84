//! Materials that change while sound runs.

use crate::acoustics::material::Reflectance;
use crate::acoustics::{BANDS, Material};
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::committed::kept_roughness::{mirrored_share, roughened};

impl Scene {
    /// Gives all surfaces of a material's name, those of instances included, another absorption, scattering and transmission:
    /// a window breaks, a curtain closes. Geometry, paths and their identities stay. Scattering by which a rough surface
    /// exceeds the smoothest one of its material stays. An instance that is added later has the materials of its own commit.
    /// Control side; allocates.
    ///
    /// # Errors
    /// [`Error::Setting`] for values outside 0 to 1, a transmission above the absorption, and a name that no surface has; the
    /// materials stay.
    pub fn set_material(&mut self, material: &Material) -> Result<()> {
        check(material)?;
        let has_name = |own: &&Material| own.name == material.name;
        let is_fixed = self.mesh.materials.iter().any(|own| has_name(&own));
        if !is_fixed && !self.instances.has_material(&material.name) {
            let problem = format!("no surface is of `{}`", material.name);
            let advice = "name a material of the scene or of an instance";
            return Err(Error::setting("material", problem, advice));
        }
        let mut materials = self.materials.to_vec();
        for (own, original) in materials.iter_mut().zip(&self.mesh.materials) {
            if has_name(&original) {
                let mirrored = mirrored_share(original, &self.mesh.materials);
                *own = roughened(material, &mirrored);
            }
        }
        self.reflectances = materials.iter().map(Reflectance::of).collect();
        self.transmission_factors = materials
            .iter()
            .map(Material::transmission_factor)
            .collect();
        self.materials = materials.into();
        self.instances.replace_material(material);
        Ok(())
    }
}

fn check(material: &Material) -> Result<()> {
    let Material {
        absorption,
        scattering,
        transmission,
        ..
    } = material;
    let values = [
        ("absorption", absorption),
        ("scattering", scattering),
        ("transmission", transmission),
    ];
    for (name, bands) in values {
        if let Some(value) = bands.iter().find(|value| !(0.0..=1.0).contains(*value)) {
            let problem = format!("{value} is out of range");
            return Err(Error::setting(name, problem, "choose a value from 0 to 1"));
        }
    }
    match (0..BANDS).find(|b| transmission[*b] > absorption[*b]) {
        None => Ok(()),
        Some(b) => Err(Error::setting(
            "transmission",
            format!(
                "{} is more than the absorption {}",
                transmission[b], absorption[b]
            ),
            "raise absorption, which counts what passes through, or lower transmission",
        )),
    }
}
