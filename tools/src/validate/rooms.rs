//! Rooms that laws are measured in.

use std::sync::Arc;

use glam::Vec3;

use foresound::acoustics::{BANDS, Material};
use foresound::error::Result;
use foresound::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh, procedural};

/// A material of even absorption and scattering that lets nothing through.
pub fn even(name: &str, absorption: f32, scattering: f32) -> Material {
    Material {
        name: name.to_owned(),
        absorption: [absorption; BANDS],
        scattering: [scattering; BANDS],
        transmission: [0.0; BANDS],
    }
}

/// A closed rectangular room from the origin to `size`, all walls alike in all bands.
pub fn uniform(size: Vec3, absorption: f32, scattering: f32) -> Result<Arc<Scene>> {
    let table = MaterialTable::from_materials(vec![even("wall", absorption, scattering)]);
    let mesh = procedural::shoebox(size, "wall");
    Ok(Arc::new(Scene::commit(
        &mesh,
        &table,
        &SceneSettings::default(),
    )?))
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
    let table = MaterialTable::from_materials(walls.to_vec());
    Ok(Arc::new(Scene::commit(
        &mesh,
        &table,
        &SceneSettings::default(),
    )?))
}
