//! Boxes and rectangles for the laws of geometry, and levels there.

use std::sync::Arc;

use glam::Vec3;

use super::rooms::{self, Probe};
use foresound::acoustics::{BANDS, Material};
use foresound::error::Result;
use foresound::propagation::{Path, PropagationSettings};
use foresound::scene::{Scene, TriangleMesh};

/// Amplitude factor of a level that no path has: −160 dB.
const SILENCE: f64 = 1e-8;

/// A mesh under construction, of one material.
#[derive(Debug, Clone)]
pub(crate) struct Solids {
    pub(crate) mesh: TriangleMesh,
    material: Material,
}

impl Solids {
    /// An empty mesh of a hard material that transmits a share of the energy.
    pub(crate) fn new(transmission: f32) -> Self {
        let mut material = rooms::even("solid", 0.02, 0.0);
        material.transmission = [transmission; BANDS];
        let mut mesh = TriangleMesh::default();
        mesh.material("solid");
        Self { mesh, material }
    }

    /// A parallelogram from a corner along two sides; its front has the normal `a` × `b`.
    pub(crate) fn sheet(&mut self, corner: Vec3, a: Vec3, b: Vec3) {
        let first = self.mesh.vertices.len() as u32;
        let corners = [corner, corner + a, corner + a + b, corner + b];
        self.mesh.vertices.extend(corners);
        self.mesh.triangles.push([first, first + 1, first + 2]);
        self.mesh.triangles.push([first, first + 2, first + 3]);
        self.mesh.triangle_materials.extend([0; 2]);
    }

    /// A box between two corners, wound outwards.
    pub(crate) fn solid(&mut self, low: Vec3, high: Vec3) {
        let size = high - low;
        for axis in 0..3 {
            let side = |k: usize| {
                let mut side = Vec3::ZERO;
                side[(axis + k) % 3] = size[(axis + k) % 3];
                side
            };
            self.sheet(low, side(2), side(1));
            self.sheet(low + side(0), side(1), side(2));
        }
    }

    /// The material of all triangles.
    pub(crate) fn material(&self) -> &Material {
        &self.material
    }

    /// Commits the mesh.
    pub(crate) fn commit(&self) -> Result<Arc<Scene>> {
        rooms::commit(&self.mesh, vec![self.material.clone()])
    }
}

/// Settings for few reflections and all diffraction.
pub(crate) fn settings() -> PropagationSettings {
    PropagationSettings {
        guide_rays: 512,
        source_rays: 16,
        depth: 2,
        ..PropagationSettings::default()
    }
}

/// The paths from a source to a listener.
pub(crate) fn paths(scene: &Arc<Scene>, source: Vec3, listener: Vec3) -> Result<Vec<Path>> {
    let mut probe = Probe::new(scene, source, settings())?;
    probe.update(listener);
    Ok(probe.set.paths.clone())
}

/// Level of the energy of all paths in each band relative to the free field at 1 m, in dB.
pub(crate) fn levels_db(paths: &[Path]) -> [f64; BANDS] {
    std::array::from_fn(|b| {
        let energies = paths.iter().map(|p| f64::from(p.amplitude[b]).powi(2));
        10.0 * (energies.sum::<f64>() + SILENCE * SILENCE).log10()
    })
}
