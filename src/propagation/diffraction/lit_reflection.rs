//! A single reflection beside edges: where an edge occludes it, the edge's wave continues it, as it continues the direct path.
//!
//! On the lit side of the boundary the wave is part of the reflection, in the shadow it is a path of its own, and the sum is
//! continuous. On the lit side the wave's part with a longer detour is left out: it has less than a hundredth of the
//! reflection's energy.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffraction::complex::Complex;
use crate::propagation::diffraction::edge_wave;
use crate::propagation::diffraction::first_order::{face_share, merged_share};
use crate::propagation::diffraction::with_reflections::ReflectedEdgePath;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::path::{Path, ReflectionEdge};
use crate::scene::Scene;

/// Amplitude factor of a visible reflection in a surface by the waves of the edges beside it; `None` means 1.
///
/// # Real-time
/// Allocates nothing, casts no rays; one wave for each edge of the surface.
pub fn reflection_gain(
    scene: &Scene,
    endpoints: &Endpoints,
    surface: u32,
    edges: impl Iterator<Item = ReflectionEdge>,
) -> Option<BandArray> {
    let mut gain = None;
    for near in edges.filter(|near| near.is_beside(scene, surface)) {
        let path = ReflectedEdgePath::over(scene, near.edge, near.surfaces, endpoints);
        let Some(path) = path else {
            continue;
        };
        let weight = path.unmasked_share(scene, endpoints);
        if weight == 0.0 {
            continue;
        }
        let gain = gain.get_or_insert([Complex::ONE; BANDS]);
        let (incident, reflected) = path.waves(scene, true);
        let (detour_m, ratio) = (path.detour_m(), path.straight_m() / path.length_m());
        let wavenumbers = edge_wave::wavenumbers(scene);
        let later = edge_wave::delays(&wavenumbers, detour_m);
        for (b, &wavenumber) in wavenumbers.iter().enumerate() {
            let share = merged_share(wavenumber * detour_m);
            let faces = face_share(incident[b], reflected[b]);
            let wave = (incident[b] + reflected[b] * faces) * (share * weight);
            gain[b] += wave * later[b] * ratio;
        }
    }
    gain.map(|gain| gain.map(|gain| gain.abs().min(1.0) as f32))
}

/// The path of [`crate::propagation::diffraction::ReflectionEdges`] that replaces a reflection which is not valid.
pub fn path_in_shadow(
    scene: &Scene,
    endpoints: &Endpoints,
    (near, path): &(ReflectionEdge, Option<Path>),
) -> Option<Path> {
    path.or_else(|| {
        let path = ReflectedEdgePath::over(scene, near.edge, near.surfaces, endpoints)?;
        path.path(scene, endpoints, true)
    })
}
