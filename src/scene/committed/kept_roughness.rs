//! Roughness of surfaces whose material changes.
//!
//! Control side. A rough surface has a material of its own, of the same name as the smooth surfaces' but with more scattering
//! ([`crate::scene::flatten`]). Another material leaves the surface as rough. Own.

use crate::acoustics::{BANDS, BandArray, Material};

/// Share of the specular energy of a material's smoothest surface that the surface of `own` reflects as well; `all` are the materials of
/// its scene.
pub(super) fn mirrored_share<'a>(
    own: &Material,
    all: impl IntoIterator<Item = &'a Material>,
) -> BandArray {
    let mut smooth = own.scattering;
    for other in all.into_iter().filter(|other| other.name == own.name) {
        for (least, scattering) in smooth.iter_mut().zip(other.scattering) {
            *least = least.min(scattering);
        }
    }
    std::array::from_fn(|b| match own.scattering[b] > smooth[b] {
        true => (1.0 - own.scattering[b]) / (1.0 - smooth[b]),
        // One that scatters everything may scatter less from now on.
        false => 1.0,
    })
}

/// A material on a surface of which this share is left of the specular energy.
pub(super) fn roughened(material: &Material, mirrored: &BandArray) -> Material {
    let mut rough = material.clone();
    for b in 0..BANDS {
        if mirrored[b] < 1.0 {
            rough.scattering[b] = 1.0 - (1.0 - rough.scattering[b]) * mirrored[b];
        }
    }
    rough
}
