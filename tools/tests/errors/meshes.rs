//! Meshes of an engine's arrays, and moving parts.

use std::sync::Arc;

use foresound::Result;
use foresound::scene::instances::{MOST_IN_A_PART, MOST_INSTANCES};
use foresound::scene::{
    InstanceId, InstancePose, MaterialTable, MeshOptions, Scene, SceneSettings, TriangleMesh,
    load_mesh, procedural,
};
use glam::{DVec3, Mat4, Quat, Vec3};

use crate::Errors;

pub(crate) fn room() -> TriangleMesh {
    procedural::shoebox(Vec3::new(4.0, 3.0, 5.0), "concrete")
}

pub(crate) fn commit(mesh: &TriangleMesh, settings: &SceneSettings) -> Result<Scene> {
    Scene::commit(mesh, &MaterialTable::built_in(), settings)
}

pub(crate) fn committed(mesh: &TriangleMesh) -> Arc<Scene> {
    Arc::new(commit(mesh, &SceneSettings::default()).expect("a scene"))
}

pub(crate) fn make(errors: &mut Errors) {
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let mesh = |indices: &[u32], names: &[&str], materials: &[u32]| {
        TriangleMesh::from_slices(&corners, indices, names, materials)
    };
    errors.of("two indices", mesh(&[0, 1], &[], &[]));
    errors.of("vertex 3 of 3", mesh(&[0, 1, 3], &[], &[]));
    errors.of("material 1 of 1", mesh(&[0, 1, 2], &["a"], &[1]));
    errors.of("two materials", mesh(&[0, 1, 2], &["a"], &[0, 0]));
    let usual = SceneSettings::default();
    let mut far = room();
    far.vertices[0] = Vec3::splat(1e6);
    errors.of("a corner far away", commit(&far, &usual));
    let mut flat = room();
    flat.vertices.fill(Vec3::ONE);
    errors.of("no area", commit(&flat, &usual));
    let mut few = usual;
    few.max_triangles = 3;
    errors.of("more than three triangles", commit(&room(), &few));
    let mut cold = usual;
    cold.medium.temperature_c = -300.0;
    errors.of("no air", commit(&room(), &cold));
    let mut coarse = usual;
    coarse.acoustic_tolerance_m = Some(2.0);
    errors.of("a tolerance of two metres", commit(&room(), &coarse));
    let mut small = usual;
    small.min_panel_m2 = f64::NAN;
    errors.of("panels of no area", commit(&room(), &small));
    let mut finite = usual;
    finite.max_finite_panel_m2 = -1.0;
    errors.of("finite panels below 0 m²", commit(&room(), &finite));
    parts(errors);
    saved(errors);
}

/// Saved scenes.
fn saved(errors: &mut Errors) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.fscene");
    errors.of("a missing file", Scene::load(&path));
    let scene = committed(&room());
    errors.of("a folder that is none", scene.save(&path.join("below")));
    scene.save(&path).expect("is saved");
    errors.of("a saved scene", load_mesh(&path, &MeshOptions::default()));
    let bytes = scene.to_bytes().expect("bytes");
    for (at, value) in [(0, 0), (8, 0), (8, 99), (200, bytes[200] ^ 1)] {
        let mut damaged = bytes.clone();
        damaged[at] = value;
        errors.of("damage", Scene::from_bytes(&damaged));
    }
    let mut whole = (*scene).clone();
    let pose = InstancePose::at(InstanceId::default(), [1.0; 3]);
    whole.add_instance(scene, &pose).expect("a part");
    errors.of("a scene with parts", whole.to_bytes());
}

/// Squares in one plane, cut in two: `triangles` triangles and no diffracting edge.
fn tiles(triangles: usize) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let material = mesh.material("concrete");
    let wide = 512;
    let point = |n: usize| Vec3::new((n % wide) as f32, 0.0, (n / wide) as f32);
    let rows = triangles / (2 * (wide - 1)) + 1;
    mesh.vertices = (0..wide * (rows + 1)).map(point).collect();
    for n in (0..wide * rows).filter(|n| n % wide != wide - 1) {
        let [a, b, c, d] = [n, n + 1, n + wide, n + wide + 1].map(|n| n as u32);
        mesh.triangles.extend([[a, b, c], [b, d, c]]);
    }
    mesh.triangle_materials = vec![material; mesh.triangles.len()];
    mesh
}

fn parts(errors: &mut Errors) {
    let part = committed(&TriangleMesh {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        material_names: vec!["concrete".into()],
        triangle_materials: vec![0],
    });
    let at = InstancePose::at(InstanceId::default(), DVec3::ONE);
    let mut scene = Arc::unwrap_or_clone(committed(&room()));
    let id = scene.add_instance(Arc::clone(&part), &at);
    let id = id.expect("a slot");
    let nested = Arc::new(scene.clone());
    errors.of("a part with parts", scene.add_instance(nested, &at));
    let fine = committed(&tiles(MOST_IN_A_PART + 1));
    errors.of("a fine part", scene.add_instance(fine, &at));
    let scaled = Mat4::from_scale(Vec3::splat(2.0));
    errors.of(
        "a scale",
        InstancePose::from_matrix(id, scaled.to_cols_array_2d()),
    );
    let nowhere = InstancePose::at(id, DVec3::NAN);
    errors.of("not finite", scene.set_instance_pose(&nowhere));
    let turned = InstancePose {
        rotation: Quat::from_xyzw(0.0, 0.0, 0.0, 2.0),
        ..InstancePose::at(id, DVec3::ONE)
    };
    errors.of("no rotation", scene.set_instance_pose(&turned));
    scene.remove_instance(id).expect("it is there");
    errors.of("a part that left", scene.remove_instance(id));
    let joined = scene.add_joined_instance(Arc::clone(&part), &at);
    let id = joined.expect("a slot");
    let elsewhere = InstancePose::at(id, DVec3::ZERO);
    errors.of("a move at rest", scene.set_instance_pose(&elsewhere));
    scene.remove_instance(id).expect("it is there");
    let mut full = 0;
    let refused = loop {
        match scene.add_instance(Arc::clone(&part), &at) {
            Ok(_) => full += 1,
            Err(error) => break error,
        }
    };
    assert_eq!(full, MOST_INSTANCES);
    errors.of::<()>("one part more", Err(refused));
}
