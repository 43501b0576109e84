//! Hostile meshes: triangles that overlap, pass through each other, share an edge or a corner, or are slivers. Their commit
//! takes memory in proportion to the mesh.

use std::f32::consts::TAU;
use std::sync::Arc;

use foresound::scene::edges::MOST_EDGES;
use foresound::scene::{
    InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, TriangleMesh,
};
use glam::{DVec3, Vec3};

use super::{TURN, peak_bytes_of};

/// Bytes that the largest set of edges takes ([`MOST_EDGES`] of them).
const EDGE_BYTES: usize = MOST_EDGES << 8;

/// Memory of a commit to that of the mesh's file and of a full set of edges.
const PROPORTION: usize = 4;

/// A number from 0 to 1 (SplitMix64).
fn random(n: u32) -> f32 {
    let mut bits = u64::from(n).wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((bits ^ (bits >> 31)) >> 40) as f32 / (1 << 24) as f32
}

fn point(n: u32) -> Vec3 {
    Vec3::new(random(3 * n), random(3 * n + 1), random(3 * n + 2))
}

/// Triangles with corners of their own.
fn soup(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let material = mesh.material("concrete");
    for corners in triangles {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.triangle_materials.push(material);
    }
    mesh
}

fn heap(count: u32, size: Vec3) -> TriangleMesh {
    soup((0..count).map(|n| [0, 1, 2].map(|k| size * point(3 * n + k))))
}

fn slivers(count: u32) -> TriangleMesh {
    soup((0..count).map(|n| {
        let [a, b] = [0, 1].map(|k| 20.0 * point(2 * n + k));
        [a, b, b + 1e-3 * Vec3::Y]
    }))
}

fn rim(share: f32, radius_m: f32) -> Vec3 {
    let (sin, cos) = (share * TAU).sin_cos();
    Vec3::new(radius_m * cos, 0.0, radius_m * sin)
}

/// The mesh of a name.
fn named(name: &str, count: u32) -> TriangleMesh {
    let share = |n: u32| n as f32 / count as f32;
    match name {
        "coplanar" => heap(count, Vec3::new(50.0, 0.0, 50.0)),
        "crossing" => heap(count, Vec3::splat(50.0)),
        "slivers" => slivers(count),
        "pages of a book" => {
            soup((0..count).map(|n| [Vec3::ZERO, 5.0 * Vec3::Y, rim(share(n), 50.0)]))
        }
        "a star" => {
            let half = 0.5 / count as f32;
            let ray = |n| {
                [
                    Vec3::ZERO,
                    rim(share(n), 500.0),
                    rim(share(n) + half, 500.0),
                ]
            };
            soup((0..count).map(ray))
        }
        "spokes" => {
            let corner = |n| 50.0 * point(n) - 25.0;
            soup((0..count).map(|n| [Vec3::ZERO, corner(2 * n), corner(2 * n + 1)]))
        }
        name => {
            assert_eq!(name, "ordinary ground", "no mesh of this name");
            ground(count)
        }
    }
}

const MESHES: [&str; 7] = [
    "coplanar",
    "crossing",
    "slivers",
    "pages of a book",
    "a star",
    "spokes",
    "ordinary ground",
];

/// Ground with noise of two centimetres.
fn ground(count: u32) -> TriangleMesh {
    let cells = f64::from(count / 2).sqrt() as u32;
    let at = |x: u32, z: u32| {
        let height_m = 0.02 * random(x * 7919 + z);
        Vec3::new(0.2 * x as f32, height_m, 0.2 * z as f32)
    };
    soup((0..cells * cells).flat_map(|n| {
        let (x, z) = (n % cells, n / cells);
        let [a, b] = [at(x, z), at(x + 1, z + 1)];
        [[a, at(x + 1, z), b], [a, b, at(x, z + 1)]]
    }))
}

/// Length of a mesh's OBJ file, in bytes.
fn file_bytes(mesh: &TriangleMesh) -> usize {
    let vertices = mesh.vertices.iter();
    let vertices = vertices.map(|v| format!("v {} {} {}\n", v.x, v.y, v.z).len());
    let faces = mesh.triangles.iter();
    let faces = faces.map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1).len());
    vertices.chain(faces).sum()
}

fn commit(mesh: &TriangleMesh) -> Scene {
    let table = MaterialTable::built_in();
    Scene::commit(mesh, &table, &SceneSettings::default()).expect("commits")
}

#[test]
fn heaps_of_triangles_take_memory_in_proportion() {
    let _turn = TURN.lock();
    for name in MESHES {
        for count in [10_000, 100_000] {
            let mesh = named(name, count);
            let most = PROPORTION * (file_bytes(&mesh) + EDGE_BYTES);
            let (scene, bytes) = peak_bytes_of(|| commit(&mesh));
            drop(scene);
            assert!(bytes <= most, "{bytes} of {most} bytes for {count} {name}");
        }
    }
}

/// Memory that a part takes when it is the first that a scene is joined with: that of the part, and not of a copy of the scene.
#[test]
fn a_part_joins_a_large_scene_without_a_copy_of_it() {
    let _turn = TURN.lock();
    let part = Arc::new(commit(&soup(ground_triangles())));
    let mut taken = [10_000, 100_000].map(|count| {
        let mut world = commit(&heap(count, Vec3::splat(50.0)));
        let here = InstancePose::at(InstanceId::default(), DVec3::ZERO);
        let part = Arc::clone(&part);
        let (added, bytes) = peak_bytes_of(|| world.add_joined_instance(part, &here));
        added.expect("is added");
        bytes
    });
    taken.sort_unstable();
    let [least, most] = taken;
    assert!(most < 2 * least.max(1 << 16), "{least} to {most} bytes");
}

/// A square of ground beside a heap.
fn ground_triangles() -> [[Vec3; 3]; 2] {
    let at = |x: f32, z: f32| Vec3::new(100.0 + x, 0.0, z);
    let [a, b] = [at(0.0, 0.0), at(10.0, 10.0)];
    [[a, at(0.0, 10.0), b], [a, b, at(10.0, 0.0)]]
}
