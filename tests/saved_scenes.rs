//! Saved scenes: what is loaded is what was saved, to the bit; what is no saved scene is refused.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a helper's failure is the test's"
)]

use std::sync::Arc;

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::committed::saved::{MAGIC, is_saved};
use foresound::scene::instances::InstancePose;
use foresound::scene::{
    InstanceId, ListenerPose, MaterialTable, MeshOptions, Scene, SceneSettings, SourceId,
    SourcePose, TriangleMesh, load_mesh, procedural,
};
use glam::Vec3;

fn commit(mesh: &TriangleMesh) -> Scene {
    Scene::commit(mesh, &MaterialTable::built_in(), &SceneSettings::default()).unwrap()
}

/// Two updates of a scene; the second finds more by what it remembers.
fn updates(scene: Scene, [source, listener]: [Vec3; 2]) -> PathSet {
    let settings = PropagationSettings {
        guide_rays: 256,
        ..Default::default()
    };
    let mut propagator = Propagator::new(Arc::new(scene), settings).unwrap();
    let mut set = PathSet::default();
    let source = SourcePose::at(SourceId::new(0, 0), source);
    for _ in 0..2 {
        let listener = ListenerPose::facing(listener, 0.0);
        propagator.update(&listener, &[source], 0.0, &mut set);
    }
    set
}

/// A scan: every corner moved by millimetres.
fn noisy_room() -> TriangleMesh {
    let random = |n: u32| (n.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32 - 0.5;
    let mut mesh = procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "concrete");
    for _ in 0..4 {
        let triangles = std::mem::take(&mut mesh.triangles);
        mesh.triangle_materials.clear();
        for [a, b, c] in triangles {
            let middle = |a: u32, b: u32| {
                let [a, b] = [a, b].map(|v| mesh.vertices[v as usize]);
                (a + b) / 2.0
            };
            let middles = [middle(a, b), middle(b, c), middle(c, a)];
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(middles);
            let [d, e, f] = [first, first + 1, first + 2];
            for triangle in [[a, d, f], [d, b, e], [f, e, c], [d, e, f]] {
                mesh.triangles.push(triangle);
                mesh.triangle_materials.push(0);
            }
        }
    }
    for vertex in &mut mesh.vertices {
        let seed = (vertex.x * 1000.0) as u32 * 7 + (vertex.y * 1000.0) as u32 * 31;
        let seed = seed + (vertex.z * 1000.0) as u32 * 101;
        *vertex += 0.01 * Vec3::new(random(seed), random(seed + 1), random(seed + 2));
    }
    mesh
}

#[test]
fn a_loaded_scene_is_the_saved_one_to_the_bit() {
    let mut scenes: Vec<(TriangleMesh, [Vec3; 2])> = ["doorway", "angrybot"]
        .into_iter()
        .map(|name| {
            let scene = procedural::by_name(name).unwrap();
            let places = [scene.sources[0].1, scene.walk.from];
            (scene.mesh, places)
        })
        .collect();
    scenes.push((
        noisy_room(),
        [Vec3::new(2.0, 1.5, 1.0), Vec3::new(4.0, 1.7, 3.5)],
    ));
    for (mesh, places) in scenes {
        let saved = commit(&mesh);
        let bytes = saved.to_bytes().unwrap();
        let loaded = Scene::from_bytes(&bytes).unwrap();
        assert!(loaded.to_bytes().unwrap() == bytes);
        assert_eq!(loaded.surfaces(), saved.surfaces());
        assert_eq!(loaded.materials(), saved.materials());
        assert_eq!(loaded.report(), saved.report());
        assert_eq!(loaded.memory_bytes(), saved.memory_bytes());
        assert_eq!(loaded.flattened_regions(), saved.flattened_regions());
        assert_eq!(loaded.edges().as_slice(), saved.edges().as_slice());
        let expected = updates(saved, places);
        assert!(expected.paths.len() > 10);
        let found = updates(loaded, places);
        assert_eq!(found.paths, expected.paths);
        assert_eq!(format!("{:?}", found.late), format!("{:?}", expected.late));
    }
}

#[test]
fn files_are_written_and_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.fscene");
    let scene = commit(&procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "concrete"));
    scene.save(&path).unwrap();
    assert!(Scene::load(&path).unwrap().to_bytes() == scene.to_bytes());
    let error = |path: &std::path::Path| Scene::load(path).unwrap_err().to_string();
    let mesh = load_mesh(&path, &MeshOptions::default())
        .unwrap_err()
        .to_string();
    assert!(mesh.contains("is a saved scene, which is not read; load it by Scene::load"));
    assert!(is_saved(&path) && !is_saved(folder.path()));
    assert!(error(folder.path()).contains("; give the path of a saved scene"));
    assert!(error(std::path::Path::new("/dev/zero")).contains("is no saved scene"));
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
    assert!(error(&path).contains("room.fscene: the saved scene is damaged or cut off"));
    std::fs::write(&path, [&bytes[..], b"\n"].concat()).unwrap();
    assert!(error(&path).contains("damaged or cut off"));
}

#[test]
fn damage_is_found_everywhere() {
    let scene = commit(&procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "concrete"));
    let bytes = scene.to_bytes().unwrap();
    let problem = |bytes: &[u8]| {
        Scene::from_bytes(bytes)
            .expect_err("is refused")
            .to_string()
    };
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        let text = problem(&damaged);
        assert!(
            text.starts_with("saved scene: ") && text.lines().count() == 1,
            "{text}"
        );
    }
    for end in 0..bytes.len() {
        problem(&bytes[..end]);
    }
    assert!(problem(b"v 0 0 0\n").contains("is no saved scene; give"));
    let with_version = |version: u8| {
        let mut bytes = bytes.clone();
        bytes[MAGIC.len()] = version;
        problem(&bytes)
    };
    assert!(with_version(200).contains("by a newer version of Foresound; save"));
    assert!(with_version(0).contains("by an older version of Foresound; save"));
}

#[test]
fn parts_are_saved_by_themselves() {
    let part = Arc::new(commit(&procedural::shoebox(Vec3::ONE, "wood_panel")));
    let mut scene = commit(&procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "concrete"));
    let pose = InstancePose::at(InstanceId::default(), [3.0, 0.5, 2.0]);
    scene.add_instance(part, &pose).unwrap();
    let error = scene.to_bytes().unwrap_err().to_string();
    assert!(
        error.contains("it has instances, which are not saved; save the fixed scene"),
        "{error}"
    );
}
