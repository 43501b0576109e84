//! The late field of rooms with solids in them: spaces that no listener can enter have no part in it.

use std::sync::Arc;

use foresound::PropagationSettings;
use foresound::acoustics::{BANDS, BandArray, Material};
use foresound::paths::{PathSet, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
    procedural,
};
use glam::Vec3;

/// Late energy in dB per band at two places of a room, of one source.
fn late_db(mesh: &TriangleMesh) -> [BandArray; 2] {
    let ears = [4.0, 4.5].map(|z| Vec3::new(5.0, 1.6, z));
    late_at(mesh, Vec3::new(2.0, 1.5, 2.0), ears).map(|late| late.levels_db)
}

/// What is heard at one place.
struct Late {
    /// Late energy in dB per band.
    levels_db: BandArray,
    /// Longest decay time in seconds per band.
    decay_s: BandArray,
    /// The first group's.
    slow_s: BandArray,
}

/// Late energy of one source at two places.
fn late_at(mesh: &TriangleMesh, source: Vec3, ears: [Vec3; 2]) -> [Late; 2] {
    let table = MaterialTable::built_in();
    let scene = Scene::commit(mesh, &table, &SceneSettings::default()).expect("commits");
    late_in(scene, source, ears)
}

/// The same in a scene.
fn late_in(scene: Scene, source: Vec3, ears: [Vec3; 2]) -> [Late; 2] {
    let settings = PropagationSettings::default();
    let mut propagator = Propagator::new(Arc::new(scene), settings).expect("in range");
    let source = SourcePose::at(SourceId::new(0, 1), source);
    let mut set = PathSet::default();
    ears.map(|ear| {
        let ear = ListenerPose::facing(ear, 0.0);
        for update in 0..40 {
            propagator.update(&ear, &[source], f64::from(update), &mut set);
        }
        let longest = |b: usize| {
            let times = set.late_groups.iter().map(|group| group.decay_time_s[b]);
            times.fold(0.0, f32::max)
        };
        Late {
            levels_db: set.late[0].total().map(|energy| 10.0 * energy.log10()),
            decay_s: std::array::from_fn(longest),
            slow_s: set.late_groups[0].decay_time_s,
        }
    })
}

/// A solid box.
fn block(size: Vec3, low: Vec3) -> TriangleMesh {
    let mut mesh = procedural::shoebox(size, "concrete");
    mesh.vertices.iter_mut().for_each(|v| *v += low);
    mesh
}

/// Meshes on a concrete plane.
fn outdoors<'a>(things: impl IntoIterator<Item = &'a TriangleMesh>) -> TriangleMesh {
    let far_m = 200.0;
    let ground = [
        [-far_m, -far_m],
        [-far_m, far_m],
        [far_m, far_m],
        [far_m, -far_m],
    ];
    let corners = ground.map(|[x, z]| [x, 0.0, z]);
    let indices = [0, 1, 2, 0, 2, 3];
    let mut mesh =
        TriangleMesh::from_slices(&corners, &indices, &["concrete"], &[0, 0]).expect("a mesh");
    for thing in things {
        mesh.append(thing, &glam::DAffine3::IDENTITY).expect("few");
    }
    mesh
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

/// Thickness in metres of walls and stones: rays inside them go twice as far in the mean, which is no less than in a small
/// room.
const THICKNESS_M: [f32; 3] = [0.3, 0.4, 1.2];

/// Late energy in decibels, relative to the source's at a metre, that is not heard.
const SILENT_DB: f32 = -50.0;

/// A wall of 80 m by 12 m on a plane, as a solid and as a sheet. Behind it there is silence, but for what goes around its edges: by
/// particles (three million of three seeds each, absorption 0.02, scattering 0.1, no transmission) the scattered sound there is
/// −90 dB for the sheet and for 0.3 m, −92 dB for 1.2 m.
/// How slowly silence decays is not asked. With the inside as a part of the field it was heard, and rang for 30 s.
#[test]
fn the_inside_of_a_wall_is_not_heard_outdoors() {
    let corners = [[-40.0, 0.0], [40.0, 0.0], [40.0, 12.0], [-40.0, 12.0]];
    let corners = corners.map(|[z, y]| [0.0, y, z]);
    let indices = [0, 1, 2, 0, 2, 3];
    let sheet = TriangleMesh::from_slices(&corners, &indices, &["concrete"], &[0, 0]);
    let source = Vec3::new(-6.0, 1.5, 0.0);
    let ears = [2.0, 3.0].map(|z| Vec3::new(8.0, 1.6, z));
    let behind = |wall: &TriangleMesh| late_at(&outdoors([wall]), source, ears);
    for late in behind(&sheet.expect("a mesh")) {
        let levels_db = late.levels_db;
        assert!(
            levels_db.iter().all(|db| *db < SILENT_DB),
            "{levels_db:?} dB"
        );
    }
    for thickness_m in THICKNESS_M {
        let size = Vec3::new(thickness_m, 12.0, 80.0);
        let solid = block(size, Vec3::new(-0.5 * thickness_m, 0.0, -40.0));
        for solid in behind(&solid) {
            let levels_db = solid.levels_db;
            assert!(
                levels_db.iter().all(|db| *db < SILENT_DB),
                "{thickness_m} m: {levels_db:?} dB"
            );
        }
    }
}

/// Decay time in seconds within the ring of stones: particles that are reflected by 16 panels of 2 m by 4 m and the ground,
/// absorption 0.02, decay with 1.4 s (scattering 0.1) to 1.7 s (0.02) from 200 to 500 ms, where sound flies level from stone to stone.
const RING_S: f32 = 1.7;

/// Slowest of a field's decays relative to that of half a second of it. The inside of the stones rang for 30 s.
const SLOWEST: f32 = 2.0;

/// Stones in a ring of 16 m on a plane, each 2 m wide and 4 m high: how thick they are is not heard within the ring. What
/// differs is their outer and narrow sides, which face away, and both estimates' scatter, 1 dB each.
#[test]
fn the_inside_of_stones_is_not_heard_within_their_ring() {
    let ring = |thickness_m: f32| {
        let stones: Vec<TriangleMesh> = (0..16)
            .map(|number| {
                let angle = number as f32 * std::f32::consts::TAU / 16.0;
                let turn = glam::Quat::from_rotation_y(angle);
                let mut stone = block(Vec3::new(thickness_m, 4.0, 2.0), Vec3::new(8.0, 0.0, -1.0));
                stone.vertices.iter_mut().for_each(|v| *v = turn * *v);
                stone
            })
            .collect();
        let ears = [1.0, 2.0].map(|z| Vec3::new(-3.0, 1.6, z));
        late_at(&outdoors(&stones), Vec3::new(2.0, 1.5, 0.0), ears)
    };
    // Rays in stones of 0.1 m are so short that they were never part of the field.
    let thin = ring(0.1);
    for thickness_m in THICKNESS_M {
        for (thick, thin) in ring(thickness_m).iter().zip(&thin) {
            for b in 0..thin.levels_db.len() {
                let off_db = thick.levels_db[b] - thin.levels_db[b];
                assert!(off_db.abs() < 2.0, "{thickness_m} m: {off_db} dB");
                let decay_s = thick.decay_s[b];
                assert!(decay_s < SLOWEST * RING_S, "{thickness_m} m: {decay_s} s");
            }
        }
    }
}

/// A listener and a source enter a closed room that was empty at first. After the updates that a camera inside a wall is waited
/// for, and those in which the field is made anew, they hear what they would have heard there from the start.
#[test]
fn a_room_has_its_late_field_when_it_is_entered() {
    let mut mesh = procedural::shoebox(Vec3::new(8.0, 3.0, 6.0), "wood_panel");
    let mut other = procedural::shoebox(Vec3::new(5.0, 2.5, 4.0), "plaster");
    other.vertices.iter_mut().for_each(|v| v.x += 20.0);
    mesh.append(&other, &glam::DAffine3::IDENTITY).expect("few");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
    let scene = Arc::new(scene.expect("commits"));
    let propagator =
        || Propagator::new(Arc::clone(&scene), PropagationSettings::default()).expect("in range");
    let mut set = PathSet::default();
    let mut run = |propagator: &mut Propagator, x: f32, updates: u32| {
        let source = SourcePose::at(SourceId::new(0, 1), Vec3::new(x + 1.5, 1.5, 1.2));
        let ear = ListenerPose::facing(Vec3::new(x + 3.5, 1.6, 2.5), 0.0);
        for update in 0..updates {
            propagator.update(&ear, &[source], f64::from(update), &mut set);
        }
        set.late[0].total().map(|energy| 10.0 * energy.log10())
    };
    let mut walking = propagator();
    let first = run(&mut walking, 0.0, 20);
    let there = run(&mut propagator(), 20.0, 40);
    let came = run(&mut walking, 20.0, 100);
    for (came, there) in came.iter().zip(&there) {
        assert!((came - there).abs() < 0.5, "{came} dB, {there} dB");
    }
    let back = run(&mut walking, 0.0, 100);
    for (back, first) in back.iter().zip(&first) {
        assert!((back - first).abs() < 0.5, "{back} dB, {first} dB");
    }
}

/// A tetrahedron of a corner of a cube and a cuboid, of hard walls. The first group's decay is Eyring's (\[KUTTRUFF\]) within 10 %, the law late/slopes'
/// bound, although the field's responses end when sound has decayed by a decibel or less. It was a line through that: infinite for
/// the tetrahedron, whose energy arrives in bursts. In the cuboid, scattering has to keep sound from flying level for long.
#[test]
fn rooms_of_hard_walls_ring_by_eyrings_formula() {
    let corners = [[0.0; 3], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 6.0]];
    let faces = [0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2];
    let tetrahedron = TriangleMesh::from_slices(&corners, &faces, &["wall"], &[0; 4]);
    let oblique_m2 = 0.25 * 3f32.sqrt() * 72.0;
    let rooms = [
        (tetrahedron.expect("a mesh"), 36.0, 54.0 + oblique_m2, 0.02),
        (
            procedural::shoebox(Vec3::new(5.0, 3.0, 4.0), "wall"),
            60.0,
            94.0,
            0.3,
        ),
    ];
    for (mesh, volume_m3, area_m2, scattering) in rooms {
        for absorption in [0.005, 0.01, 0.02, 0.05] {
            let table = MaterialTable::from_materials(vec![Material {
                name: "wall".to_owned(),
                absorption: [absorption; BANDS],
                scattering: [scattering; BANDS],
                transmission: [0.0; BANDS],
            }]);
            let scene = Scene::commit(&mesh, &table, &SceneSettings::default());
            let late = late_in(
                scene.expect("commits"),
                Vec3::ONE,
                [Vec3::new(1.5, 1.0, 1.0); 2],
            );
            // At 63 Hz the air absorbs less than a hundredth of what the walls do.
            let expected_s = 0.161 * volume_m3 / (-area_m2 * (1.0 - absorption).ln());
            let off = late[0].slow_s[0] / expected_s - 1.0;
            assert!(
                off.abs() < 0.1,
                "{absorption}: {} s, {expected_s} s",
                late[0].slow_s[0]
            );
        }
    }
}

/// A room that a cloth divides which absorbs nothing that it does not pass on: all of it, or nine tenths without any scattering. The room
/// keeps its energy, of which discrete paths carry less than without the cloth, as they are not reflected behind it. When bounces of
/// source rays were chosen by what is reflected alone, what such a cloth passes on of a source's energy was lost: up to 2 dB.
#[test]
fn what_a_cloth_passes_on_is_late_energy_behind_it() {
    let material = |name: &str, absorption: f32, scattering: f32, transmission: f32| Material {
        name: name.into(),
        absorption: [absorption; BANDS],
        scattering: [scattering; BANDS],
        transmission: [transmission; BANDS],
    };
    let late = |cloth: Option<Material>| {
        let mut mesh = procedural::shoebox(Vec3::new(8.0, 3.0, 6.0), "wall");
        let mut table = vec![material("wall", 0.02, 0.5, 0.0)];
        if let Some(cloth) = cloth {
            let corners = [[0.0, 0.0], [3.0, 0.0], [3.0, 6.0], [0.0, 6.0]];
            let corners = corners.map(|[y, z]| [4.0, y, z]);
            let indices = [0, 1, 2, 0, 2, 3];
            let sheet = TriangleMesh::from_slices(&corners, &indices, &["cloth"], &[0, 0]);
            mesh.append(&sheet.expect("a mesh"), &glam::DAffine3::IDENTITY)
                .expect("few");
            table.push(cloth);
        }
        let table = MaterialTable::from_materials(table);
        let scene = || Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits");
        let ear = Vec3::new(6.0, 1.5, 4.0);
        // On the other side of the cloth, and on the listener's.
        [2.0, 5.0].map(|x| late_in(scene(), Vec3::new(x, 1.2, 1.5), [ear; 2])[0].levels_db)
    };
    let without = late(None);
    for cloth in [
        material("cloth", 1.0, 0.0, 1.0),
        material("cloth", 0.9, 0.0, 0.9),
    ] {
        for (with, without) in late(Some(cloth.clone())).iter().zip(&without) {
            for (with, without) in with.iter().zip(without) {
                // The estimate's own scatter.
                assert!(with - without > -0.6, "{with} of {without} dB: {cloth:?}");
            }
        }
    }
}

/// The laws and tests of many pairs in one scene share a field, and find what each would find alone.
#[test]
fn a_shared_field_changes_no_bit() {
    let mesh = procedural::doorway().mesh;
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits");
    let scene = Arc::new(scene);
    let new = || {
        let settings = PropagationSettings::default();
        Propagator::new(Arc::clone(&scene), settings).expect("in range")
    };
    let update = |propagator: &mut Propagator, source: Vec3, ear: Vec3| {
        let mut set = PathSet::default();
        for _ in 0..2 {
            let source = SourcePose::at(SourceId::new(0, 1), source);
            propagator.update(&ListenerPose::facing(ear, 0.0), &[source], 0.0, &mut set);
        }
        // The rays of making the field count.
        PathSet { rays: 0, ..set }
    };
    let [a, b, c, d] = [
        Vec3::new(2.0, 1.5, 2.0),
        Vec3::new(5.0, 1.6, 4.5),
        Vec3::new(11.0, 1.2, 2.6),
        Vec3::new(6.0, 1.5, 1.0),
    ];
    let mut first = new();
    update(&mut first, a, b);
    let mut second = new();
    second.share_field(&first);
    let (shared, own) = (update(&mut second, c, d), update(&mut new(), c, d));
    assert!(own.late[0].total().iter().all(|energy| *energy > 0.0));
    assert_eq!(shared, own);
}
