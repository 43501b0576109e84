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
    let table = MaterialTable::built_in();
    let scene = Scene::commit(mesh, &table, &SceneSettings::default()).expect("commits");
    let settings = PropagationSettings::default();
    let mut propagator = Propagator::new(Arc::new(scene), settings).expect("in range");
    let source = SourcePose::at(SourceId::new(0, 1), Vec3::new(2.0, 1.5, 2.0));
    let mut set = PathSet::default();
    [4.0, 4.5].map(|z| {
        let ear = ListenerPose::facing(Vec3::new(5.0, 1.6, z), 0.0);
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
