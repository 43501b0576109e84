//! Late reverb of a room in a large scene: what is far away takes nothing from it.

use std::sync::Arc;

use foresound::PropagationSettings;
use foresound::acoustics::BandArray;
use foresound::paths::{PathSet, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
};
use glam::{DAffine3, DVec3, Vec3};

/// Inner size of a house, thickness of its walls, and low and high z and height of its doorway.
const SIZE: [f32; 3] = [8.0, 3.0, 6.0];
const WALL_M: f32 = 0.2;
const DOOR: [f32; 3] = [2.0, 2.9, 2.1];

/// Distance of the houses of a town.
const STREET_M: f32 = 20.0;

/// Scatter of two late estimates, 1 dB each.
const SCATTER_DB: f32 = 2.0;

fn mesh_of(corners: &[[f32; 3]], material: &str) -> TriangleMesh {
    let quads = corners.len() as u32 / 4;
    let indices = (0..quads).flat_map(|q| [0, 1, 2, 0, 2, 3].map(|corner| 4 * q + corner));
    let indices: Vec<u32> = indices.collect();
    let materials = vec![0; 2 * quads as usize];
    TriangleMesh::from_slices(corners, &indices, &[material], &materials).expect("a mesh")
}

fn block(low: [f32; 3], high: [f32; 3]) -> TriangleMesh {
    let [a, b] = [low, high];
    let corners: Vec<[f32; 3]> = (0..6)
        .flat_map(|face| {
            let axis = face % 3;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| {
                let mut corner = [0.0; 3];
                corner[axis] = [a, b][face / 3][axis];
                corner[u] = [a, b][i][u];
                corner[v] = [a, b][j][v];
                corner
            })
        })
        .collect();
    mesh_of(&corners, "plaster")
}

/// A house with a doorway in its wall at x = 0.
fn house(mesh: &mut TriangleMesh, at: [f32; 2]) {
    let ([x, y, z], t) = (SIZE, WALL_M);
    let [low_z, high_z, door] = DOOR;
    let place = DAffine3::from_translation(DVec3::new(f64::from(at[0]), 0.0, f64::from(at[1])));
    for (low, high) in [
        ([-t, 0.0, -t], [0.0, y, low_z]),
        ([-t, 0.0, high_z], [0.0, y, z + t]),
        ([-t, door, low_z], [0.0, y, high_z]),
        ([x, 0.0, -t], [x + t, y, z + t]),
        ([0.0, 0.0, -t], [x, y, 0.0]),
        ([0.0, 0.0, z], [x, y, z + t]),
        ([-t, y, -t], [x + t, y + t, z + t]),
    ] {
        mesh.append(&block(low, high), &place).expect("few");
    }
}

/// Houses in a square on a plane of concrete that reaches `far_m` in all four directions.
fn town(houses: [i32; 2], far_m: f32) -> Arc<Scene> {
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    let corners = corners.map(|[x, z]| [x * far_m, 0.0, z * far_m]);
    let mut mesh = mesh_of(&corners, "concrete");
    for x in houses[0]..houses[1] {
        for z in houses[0]..houses[1] {
            house(&mut mesh, [x, z].map(|number| STREET_M * number as f32));
        }
    }
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
    Arc::new(scene.expect("commits"))
}

/// Late energy in decibels in a house, of a source in it, after some updates.
fn late_db(propagator: &mut Propagator, at: [f32; 2], updates: u32) -> BandArray {
    let house = Vec3::new(at[0], 0.0, at[1]);
    let source = SourcePose::at(SourceId::new(0, 1), house + Vec3::new(2.0, 1.5, 2.0));
    let ear = ListenerPose::facing(house + Vec3::new(6.0, 1.6, 4.0), 0.0);
    let mut set = PathSet::default();
    for update in 0..updates {
        propagator.update(&ear, &[source], f64::from(update), &mut set);
    }
    set.late[0].total().map(|energy| 10.0 * energy.log10())
}

fn propagator(scene: &Arc<Scene>) -> Propagator {
    Propagator::new(scene.clone(), PropagationSettings::default()).expect("in range")
}

fn assert_alike(found_db: &BandArray, expected_db: &BandArray, what: &str) {
    for (found, expected) in found_db.iter().zip(expected_db) {
        assert!(
            (found - expected).abs() < SCATTER_DB,
            "{what}: {found_db:?}, not {expected_db:?} dB"
        );
    }
}

/// A house has the same late reverb on a small plot of land, on one of 4 km², and in a town of a hundred.
#[test]
fn a_house_rings_alike_on_any_terrain() {
    let alone_db = late_db(&mut propagator(&town([0, 1], 15.0)), [0.0; 2], 40);
    for (houses, far_m) in [([0, 1], 200.0), ([0, 1], 1000.0), ([-5, 5], 110.0)] {
        let found_db = late_db(&mut propagator(&town(houses, far_m)), [0.0; 2], 40);
        assert_alike(&found_db, &alone_db, &format!("{houses:?}, {far_m} m"));
    }
}

/// Who comes from a house to another one, 85 m away, soon has the late reverb there that it has from the start.
#[test]
fn a_house_rings_soon_after_a_jump_into_it() {
    let scene = town([-5, 5], 110.0);
    let there = [60.0, 60.0];
    let expected_db = late_db(&mut propagator(&scene), there, 40);
    let mut propagator = propagator(&scene);
    late_db(&mut propagator, [0.0; 2], 40);
    let soon_db = late_db(&mut propagator, there, 8);
    assert_alike(&soon_db, &expected_db, "after eight updates");
}

/// Who jumps on while the field is being made for another place does not wait for that one.
#[test]
fn a_house_rings_soon_after_two_jumps() {
    let scene = town([-5, 5], 110.0);
    let there = [60.0, 60.0];
    let expected_db = late_db(&mut propagator(&scene), there, 40);
    let mut propagator = propagator(&scene);
    late_db(&mut propagator, [0.0; 2], 40);
    late_db(&mut propagator, [-80.0, 60.0], 2);
    let soon_db = late_db(&mut propagator, there, 8);
    assert_alike(&soon_db, &expected_db, "after eight updates");
}
