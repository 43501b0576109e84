//! The late field of rooms with solids in them: what nobody can be in has no part in it.

use std::sync::Arc;

use foresound::PropagationSettings;
use foresound::acoustics::BandArray;
use foresound::paths::{PathSet, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
    procedural,
};
use glam::Vec3;

/// Late energy in dB per band at two places of a room, of one source.
fn late_db(mesh: &TriangleMesh) -> [BandArray; 2] {
    let ears = [4.0, 4.5].map(|z| Vec3::new(5.0, 1.6, z));
    late_db_at(mesh, Vec3::new(2.0, 1.5, 2.0), ears)
}

/// Late energy in dB per band of one source at two places.
fn late_db_at(mesh: &TriangleMesh, source: Vec3, ears: [Vec3; 2]) -> [BandArray; 2] {
    let table = MaterialTable::built_in();
    let scene = Scene::commit(mesh, &table, &SceneSettings::default()).expect("commits");
    let settings = PropagationSettings::default();
    let mut propagator = Propagator::new(Arc::new(scene), settings).expect("in range");
    let source = SourcePose::at(SourceId::new(0, 1), source);
    let mut set = PathSet::default();
    ears.map(|ear| {
        let ear = ListenerPose::facing(ear, 0.0);
        for update in 0..40 {
            propagator.update(&ear, &[source], f64::from(update), &mut set);
        }
        set.late[0].total().map(|energy| 10.0 * energy.log10())
    })
}

/// A slab of 0.1 m, 0.1 m above the floor of a panelled room: its inside and the gap under it have mean free paths of 0.2 m.
/// Its top takes the floor's place, so the room stays what it was but for the gap's openings of 2.7 m². The room's 180 m²
/// absorb 5 % at least, 9 m²: if nothing came back from the gap the level would fall by 1.2 dB. The estimate's own scatter
/// is 1 dB.
#[test]
fn a_slab_above_the_floor_leaves_the_late_field_as_it_is() {
    let room = procedural::shoebox(Vec3::new(8.0, 3.0, 6.0), "wood_panel");
    let bare = late_db(&room);
    for is_inward in [false, true] {
        let slab = procedural::shoebox(Vec3::new(7.8, 0.1, 5.8), "wood_panel");
        let mut mesh = room.clone();
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(slab.vertices.iter().map(|v| *v + 0.1));
        for triangle in &slab.triangles {
            let [a, b, c] = triangle.map(|corner| corner + first);
            mesh.triangles
                .push(if is_inward { [a, c, b] } else { [a, b, c] });
            mesh.triangle_materials.push(0);
        }
        for (with, without) in late_db(&mesh).iter().zip(&bare) {
            for (with, without) in with.iter().zip(without) {
                let off_db = with - without;
                assert!(
                    (-2.2..1.0).contains(&off_db),
                    "{off_db} dB, inward {is_inward}"
                );
            }
        }
    }
}

/// A wall of 80 m by 12 m on a plane, as a solid and as a sheet. Rays inside the solid go 0.6 m in the mean, so it is no cavity,
/// but nothing reaches it except through concrete. So the late field behind is that of the sheet, but for the scatter of both
/// estimates, 1 dB each, and a decibel for what passes over a top of another shape. With faces of both sides of a
/// wall taken for each other the inside was heard outdoors: the late field lay 10 dB higher and rang for 30 s.
#[test]
fn the_inside_of_a_wall_is_not_heard_outdoors() {
    let slab = |size: Vec3, low: Vec3| {
        let mut mesh = procedural::shoebox(size, "concrete");
        mesh.vertices.iter_mut().for_each(|v| *v += low);
        mesh
    };
    let with_ground = |wall: &TriangleMesh| {
        let ground = [
            [-200.0, -200.0],
            [-200.0, 200.0],
            [200.0, 200.0],
            [200.0, -200.0],
        ];
        let corners = ground.map(|[x, z]| [x, 0.0, z]);
        let indices = [0, 1, 2, 0, 2, 3];
        let mut mesh =
            TriangleMesh::from_slices(&corners, &indices, &["concrete"], &[0, 0]).expect("a mesh");
        mesh.vertices.extend(&wall.vertices);
        let moved = wall.triangles.iter().map(|t| t.map(|corner| corner + 4));
        mesh.triangles.extend(moved);
        mesh.triangle_materials.resize(mesh.triangles.len(), 0);
        mesh
    };
    let solid = slab(Vec3::new(0.3, 12.0, 80.0), Vec3::new(-0.15, 0.0, -40.0));
    let corners = [[-40.0, 0.0], [40.0, 0.0], [40.0, 12.0], [-40.0, 12.0]];
    let corners = corners.map(|[z, y]| [0.0, y, z]);
    let indices = [0, 1, 2, 0, 2, 3];
    let sheet = TriangleMesh::from_slices(&corners, &indices, &["concrete"], &[0, 0]);
    let source = Vec3::new(-6.0, 1.5, 0.0);
    let ears = [2.0, 3.0].map(|z| Vec3::new(8.0, 1.6, z));
    let behind = |wall: &TriangleMesh| late_db_at(&with_ground(wall), source, ears);
    for (solid, sheet) in behind(&solid).iter().zip(&behind(&sheet.expect("a mesh"))) {
        for (solid, sheet) in solid.iter().zip(sheet) {
            assert!(
                (solid - sheet).abs() < 3.0,
                "{solid} dB, a sheet {sheet} dB"
            );
        }
    }
}
