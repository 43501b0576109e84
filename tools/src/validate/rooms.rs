//! Rooms of the laws, and a propagator with one source.

use std::sync::Arc;

use glam::Vec3;

use foresound::acoustics::{BANDS, Material};
use foresound::error::Result;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
    procedural,
};

/// A material of even absorption and scattering, without transmission.
pub fn even(name: &str, absorption: f32, scattering: f32) -> Material {
    Material {
        name: name.to_owned(),
        absorption: [absorption; BANDS],
        scattering: [scattering; BANDS],
        transmission: [0.0; BANDS],
    }
}

/// A scene of a mesh and its materials, with default settings.
pub fn commit(mesh: &TriangleMesh, materials: Vec<Material>) -> Result<Arc<Scene>> {
    let table = MaterialTable::from_materials(materials);
    Scene::commit(mesh, &table, &SceneSettings::default()).map(Arc::new)
}

/// A propagator with one source, and the result of its last update.
pub struct Probe {
    propagator: Propagator,
    source: SourcePose,
    /// The last update's result.
    pub set: PathSet,
}

impl Probe {
    /// A source in a scene.
    pub fn new(scene: &Arc<Scene>, source: Vec3, settings: PropagationSettings) -> Result<Self> {
        Ok(Self {
            propagator: Propagator::new(Arc::clone(scene), settings)?,
            source: SourcePose::at(SourceId::new(0, 0), source),
            set: PathSet::default(),
        })
    }

    /// Another one in the same scene, cold but for the late field, which is the scene's: this one has had an update.
    pub fn beside(&self, source: Vec3) -> Result<Self> {
        let scene = self.propagator.scene();
        let mut other = Self::new(scene, source, *self.propagator.settings())?;
        other.propagator.share_field(&self.propagator);
        Ok(other)
    }

    /// Updates the paths to a listener.
    pub fn update(&mut self, listener: Vec3) {
        let ear = ListenerPose::facing(listener, 0.0);
        self.propagator
            .update(&ear, &[self.source], 0.0, &mut self.set);
    }
}

/// A closed rectangular room from the origin to `size`, all walls alike in all bands.
pub fn uniform(size: Vec3, absorption: f32, scattering: f32) -> Result<Arc<Scene>> {
    let mesh = procedural::shoebox(size, "wall");
    commit(&mesh, vec![even("wall", absorption, scattering)])
}

/// A closed rectangular room whose six walls (x = 0, x = L, y = 0, …) have a material each.
pub fn six_walls(size: Vec3, walls: [Material; 6]) -> Result<Arc<Scene>> {
    let mut mesh: TriangleMesh = procedural::shoebox(size, "wall");
    let corners: Vec<[Vec3; 3]> = mesh
        .triangles
        .iter()
        .map(|t| t.map(|v| mesh.vertices[v as usize]))
        .collect();
    mesh.material_names = walls.iter().map(|m| m.name.clone()).collect();
    for (triangle, [a, b, c]) in corners.into_iter().enumerate() {
        for axis in 0..3 {
            if a[axis] == b[axis] && b[axis] == c[axis] {
                let far = u32::from(a[axis] > 0.5 * size[axis]);
                mesh.triangle_materials[triangle] = 2 * axis as u32 + far;
            }
        }
    }
    commit(&mesh, walls.to_vec())
}

/// Energy of a decay between two times after emission in seconds: `energy_per_s` at emission, reverberation time in seconds.
pub fn decayed(energy_per_s: f64, decay_time_s: f32, from_s: f64, to_s: f64) -> f64 {
    let nepers_per_s = 6.0 * std::f64::consts::LN_10 / f64::from(decay_time_s);
    let left = |t: f64| (-nepers_per_s * t).exp() / nepers_per_s;
    (energy_per_s * (left(from_s) - left(to_s))).max(0.0)
}
