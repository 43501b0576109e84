//! A town in one commit: corners of low blocks diffract although roofs are longer.

use foresound::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh, procedural};
use glam::Vec3;

/// Blocks along each side of the town, their size and their distance in metres.
const BLOCKS: u32 = 60;
const SIZE_M: Vec3 = Vec3::new(34.0, 9.0, 28.0);
const PITCH_M: f32 = 50.0;

fn town() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let wall = mesh.material("concrete");
    for (x, z) in (0..BLOCKS).flat_map(|x| (0..BLOCKS).map(move |z| (x, z))) {
        let block = procedural::shoebox(SIZE_M, "concrete");
        let first = mesh.vertices.len() as u32;
        let corner = PITCH_M * Vec3::new(x as f32, 0.0, z as f32);
        mesh.vertices
            .extend(block.vertices.iter().map(|vertex| corner + *vertex));
        let triangles = block.triangles.iter();
        mesh.triangles
            .extend(triangles.map(|corners| corners.map(|c| first + c)));
        let count = block.triangles.len();
        mesh.triangle_materials.extend(vec![wall; count]);
    }
    mesh
}

#[test]
fn every_corner_of_a_large_town_is_an_edge() {
    let scene = Scene::commit(
        &town(),
        &MaterialTable::built_in(),
        &SceneSettings::default(),
    );
    let scene = scene.expect("commits");
    let edges = scene.edges().as_slice();
    let is_upright = |edge: &&foresound::scene::edges::Edge| edge.at(1.0).y > edge.at(0.0).y + 0.9;
    let upright = edges.iter().filter(is_upright).count();
    assert_eq!(upright, 4 * (BLOCKS * BLOCKS) as usize);
    assert_eq!(edges.len(), 12 * (BLOCKS * BLOCKS) as usize);
}
