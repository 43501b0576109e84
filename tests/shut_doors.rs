//! Late reverb past a shut door leaf: what passes is what its slits and its material let through, wherever the leaf is.

use std::sync::Arc;

use foresound::PropagationSettings;
use foresound::acoustics::BandArray;
use foresound::paths::{PathSet, Propagator};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, TriangleMesh,
};
use glam::{DAffine3, DVec3, Vec3};

/// Two rooms side by side along x, the first one ends at x = 0, and a doorway in the wall between them.
#[derive(Debug, Clone, Copy)]
struct Rooms {
    lengths_m: [f32; 2],
    height_m: f32,
    depth_m: f32,
    /// Of the wall.
    thickness_m: f32,
}

/// Low and high z of the doorway, and its height.
const DOOR: [f32; 3] = [2.0, 2.9, 2.1];

/// Thickness of the leaf, and how far one before the doorway covers the wall around it.
const LEAF_M: f32 = 0.04;
const OVERLAP_M: f32 = 0.05;

/// Materials.
const WALL: &str = "brick";
const LEAF: &str = "door_wood";

/// Slit around a leaf within the doorway.
const SLIT_M: f32 = 0.003;

/// Bands from 500 Hz on: below, the walls' own transmission counts too.
const FIRST_BAND: usize = 3;

/// Seeds of rotations: what few of them let through depends on which they are.
const SEEDS: [u64; 4] = [1, 2, 3, 4];

/// Scatter of two late estimates, 1 dB each.
const SCATTER_DB: f32 = 2.0;

const ROOMS: [Rooms; 3] = [
    Rooms {
        lengths_m: [8.0, 8.0],
        height_m: 3.0,
        depth_m: 6.0,
        thickness_m: 0.2,
    },
    Rooms {
        lengths_m: [5.0, 3.5],
        height_m: 2.5,
        depth_m: 4.0,
        thickness_m: 0.12,
    },
    Rooms {
        lengths_m: [14.0, 5.0],
        height_m: 4.0,
        depth_m: 9.0,
        thickness_m: 0.3,
    },
];

fn mesh_of(quads: &[[Vec3; 4]], material: &str) -> TriangleMesh {
    let corners: Vec<[f32; 3]> = quads.iter().flatten().map(|c| c.to_array()).collect();
    let indices: Vec<u32> = (0..quads.len() as u32)
        .flat_map(|q| [0, 1, 2, 0, 2, 3].map(|corner| 4 * q + corner))
        .collect();
    let materials = vec![0; 2 * quads.len()];
    TriangleMesh::from_slices(&corners, &indices, &[material], &materials).expect("a mesh")
}

/// A rectangle at `at` on an axis, between two corners.
fn rectangle(axis: usize, at: f32, low: [f32; 3], high: [f32; 3]) -> [Vec3; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| {
        let mut corner = Vec3::ZERO;
        corner[axis] = at;
        corner[u] = [low, high][i][u];
        corner[v] = [low, high][j][v];
        corner
    })
}

fn solid(low: [f32; 3], high: [f32; 3], material: &str) -> TriangleMesh {
    let faces: Vec<_> = (0..6)
        .map(|face| rectangle(face % 3, [low, high][face / 3][face % 3], low, high))
        .collect();
    mesh_of(&faces, material)
}

impl Rooms {
    fn mesh(&self) -> TriangleMesh {
        let (height, depth) = (self.height_m, self.depth_m);
        let [low_z, high_z, door] = DOOR;
        let [low, wall] = [-self.lengths_m[0], self.thickness_m];
        let high = wall + self.lengths_m[1];
        let corners = [[low, 0.0, 0.0], [high, height, depth]];
        let mut quads: Vec<_> = (0..6)
            .map(|face| {
                let at = corners[face / 3][face % 3];
                rectangle(face % 3, at, corners[0], corners[1])
            })
            .collect();
        for x in [0.0, wall] {
            quads.push(rectangle(0, x, [x, 0.0, 0.0], [x, height, low_z]));
            quads.push(rectangle(0, x, [x, 0.0, high_z], [x, height, depth]));
            quads.push(rectangle(0, x, [x, door, low_z], [x, height, high_z]));
        }
        let recess = [[0.0, 0.0, low_z], [wall, door, high_z]];
        quads.push(rectangle(2, low_z, recess[0], recess[1]));
        quads.push(rectangle(2, high_z, recess[0], recess[1]));
        quads.push(rectangle(1, door, recess[0], recess[1]));
        mesh_of(&quads, WALL)
    }

    /// A propagator of the rooms with a leaf.
    fn propagator(&self, leaf: Option<&Leaf>, seed: u64) -> Propagator {
        let mut mesh = self.mesh();
        let scene = match leaf {
            None => commit(&mesh),
            Some(leaf) if leaf.is_static => {
                mesh.append(&leaf.mesh, &DAffine3::IDENTITY).expect("few");
                commit(&mesh)
            }
            Some(leaf) => {
                let mut scene = commit(&mesh);
                let pose = InstancePose::at(InstanceId::default(), DVec3::ZERO);
                let part = Arc::new(commit(&leaf.mesh));
                scene.add_instance(part, &pose).expect("one part");
                scene
            }
        };
        let settings = PropagationSettings {
            seed,
            ..PropagationSettings::default()
        };
        Propagator::new(Arc::new(scene), settings).expect("in range")
    }

    /// Late energy in decibels in the second room of a source in the first one, after some updates.
    fn late_db(&self, propagator: &mut Propagator, updates: u32) -> BandArray {
        let source = Vec3::new(-0.5 * self.lengths_m[0], 1.5, 0.3 * self.depth_m);
        let source = SourcePose::at(SourceId::new(0, 1), source);
        let ear_x = self.thickness_m + 0.4 * self.lengths_m[1];
        let ear = Vec3::new(ear_x, 1.6, 0.2 * self.depth_m);
        let ear = ListenerPose::facing(ear, 0.0);
        let mut set = PathSet::default();
        for update in 0..updates {
            propagator.update(&ear, &[source], f64::from(update), &mut set);
        }
        set.late[0].total().map(|energy| 10.0 * energy.log10())
    }

    /// The mean over bands from [`FIRST_BAND`] on of the steady level.
    fn steady_db(&self, leaf: Option<&Leaf>) -> f32 {
        mean(&self.late_db(&mut self.propagator(leaf, SEEDS[0]), 40))
    }
}

fn commit(mesh: &TriangleMesh) -> Scene {
    Scene::commit(mesh, &MaterialTable::built_in(), &SceneSettings::default()).expect("commits")
}

struct Leaf {
    mesh: TriangleMesh,
    /// Part of the scene's mesh, not an instance.
    is_static: bool,
    /// Area of its slits and of its face in square metres.
    slits_m2: f32,
    face_m2: f32,
}

impl Leaf {
    /// A leaf that covers the doorway from outside, with a slit of `gap_m` before the wall, and one above the floor.
    fn before(gap_m: f32, is_static: bool) -> Self {
        let [low_z, high_z, height] = DOOR;
        let floor_m = gap_m.min(0.01);
        let low = [-gap_m - LEAF_M, floor_m, low_z - OVERLAP_M];
        let high = [-gap_m, height + OVERLAP_M, high_z + OVERLAP_M];
        let (width, height) = (high[2] - low[2], high[1]);
        Self {
            mesh: solid(low, high, LEAF),
            is_static,
            slits_m2: gap_m * (width + 2.0 * height) + floor_m * width,
            face_m2: width * height,
        }
    }

    /// A leaf within the doorway, its face `depth_m` behind the wall's.
    fn within(depth_m: f32, is_static: bool) -> Self {
        let [low_z, high_z, height] = DOOR;
        let low = [depth_m, SLIT_M, low_z + SLIT_M];
        let high = [depth_m + LEAF_M, height - SLIT_M, high_z - SLIT_M];
        Self {
            mesh: solid(low, high, LEAF),
            is_static,
            slits_m2: 2.0 * SLIT_M * (high_z - low_z + height),
            face_m2: (high_z - low_z) * height,
        }
    }

    /// What it takes away at least from the open doorway's level in the second room, in the mean over the bands from
    /// [`FIRST_BAND`] on: statistical theory of two coupled rooms (Kuttruff, Room Acoustics, section 5.8), between which a
    /// doorway or the leaf's slits and material pass energy. Shut, the first room loses less and is louder.
    fn least_loss_db(&self, rooms: &Rooms) -> f32 {
        let doorway_m2 = (DOOR[1] - DOOR[0]) * DOOR[2];
        let table = MaterialTable::built_in();
        let [wall, leaf] = [WALL, LEAF].map(|name| &table.get(name).expect("built in").material);
        mean(&std::array::from_fn(|b| {
            let absorbed_m2 = rooms.lengths_m.map(|length_m| {
                let ends_m2 = rooms.height_m * rooms.depth_m;
                let sides_m2 = length_m * (rooms.height_m + rooms.depth_m);
                2.0 * (ends_m2 + sides_m2) * wall.absorption[b]
            });
            let next_room = |passed_m2: f32| {
                let share = passed_m2 / (absorbed_m2[1] + passed_m2);
                share / (absorbed_m2[0] + absorbed_m2[1] * share)
            };
            let shut_m2 = self.slits_m2 + self.face_m2 * leaf.transmission[b];
            10.0 * (next_room(doorway_m2) / next_room(shut_m2)).log10()
        })) - SCATTER_DB
    }
}

fn move_leaf(propagator: &mut Propagator, z: f64) {
    let leaf = propagator.scene().instance_poses().next();
    let pose = InstancePose::at(leaf.expect("a leaf").id, DVec3::new(0.0, 0.0, z));
    propagator.scene_mut().set_instance_poses(&[pose]);
}

fn mean(levels_db: &BandArray) -> f32 {
    let bands = &levels_db[FIRST_BAND..];
    bands.iter().sum::<f32>() / bands.len() as f32
}

/// No more passes a leaf before the doorway than its slits and its material let through, by their areas. A wider slit lets no
/// less through. So it is of a leaf that is an instance and of one in the scene's mesh.
#[test]
fn a_leaf_before_a_doorway_leaves_its_slits() {
    for rooms in &ROOMS {
        let open_db = rooms.steady_db(None);
        let mut before = [f32::INFINITY; 2];
        for gap_mm in [0, 1, 3, 5, 10, 15, 20, 30, 50] {
            let losses = [false, true].map(|is_static| {
                let leaf = Leaf::before(0.001 * gap_mm as f32, is_static);
                let loss = open_db - rooms.steady_db(Some(&leaf));
                let least = leaf.least_loss_db(rooms);
                let what = format!("{gap_mm} mm before {rooms:?}, static {is_static}");
                assert!(loss >= least, "{what}: {loss} dB, not {least}");
                loss
            });
            for (loss, before) in losses.iter().zip(&mut before) {
                assert!(*loss <= *before + SCATTER_DB, "{gap_mm} mm: {losses:?} dB");
                *before = *loss;
            }
        }
    }
}

/// The same of a leaf in the doorway's recess, wherever the samples of the jambs are.
#[test]
fn a_leaf_within_a_doorway_leaves_its_slits() {
    for rooms in &ROOMS {
        let open_db = rooms.steady_db(None);
        for depth_mm in [5, 10, 20, 40, 60, 80] {
            for is_static in [false, true] {
                let leaf = Leaf::within(0.001 * depth_mm as f32, is_static);
                let loss = open_db - rooms.steady_db(Some(&leaf));
                let least = 15f32.max(leaf.least_loss_db(rooms));
                assert!(
                    loss >= least,
                    "{depth_mm} mm within {rooms:?}, static {is_static}: {loss} dB, not {least}"
                );
            }
        }
    }
}

/// A leaf that shuts: as soon as the field has followed, four updates after the leaf came to rest, the next room is 15 dB below
/// its level in the mean over seeds, although only one of the source's sixteen rotations has been cast since.
#[test]
fn a_leaf_that_shuts_fades_the_next_room() {
    for rooms in &ROOMS {
        let losses_db = SEEDS.map(|seed| {
            let mut propagator = rooms.propagator(Some(&Leaf::before(0.003, false)), seed);
            move_leaf(&mut propagator, -1.2);
            let open_db = mean(&rooms.late_db(&mut propagator, 40));
            move_leaf(&mut propagator, 0.0);
            open_db - mean(&rooms.late_db(&mut propagator, 6))
        });
        let mean_db = losses_db.iter().sum::<f32>() / SEEDS.len() as f32;
        assert!(mean_db > 15.0, "{rooms:?}: {losses_db:?} dB");
    }
}

/// When all rotations have been cast, it has the level of a leaf that was shut from the start. Open again, it soon has the former
/// level but for the scatter of few rotations, and after a round exactly.
#[test]
fn a_leaf_that_has_shut_is_as_one_shut_from_the_start() {
    for rooms in &ROOMS {
        let leaf = Leaf::before(0.003, false);
        let shut_db = rooms.steady_db(Some(&leaf));
        let mut propagator = rooms.propagator(Some(&leaf), SEEDS[0]);
        move_leaf(&mut propagator, -1.2);
        let open_db = mean(&rooms.late_db(&mut propagator, 40));
        move_leaf(&mut propagator, 0.0);
        rooms.late_db(&mut propagator, 6);
        let later_db = mean(&rooms.late_db(&mut propagator, 54));
        assert!(
            (later_db - shut_db).abs() < 0.1,
            "{later_db} dB, not {shut_db}"
        );
        move_leaf(&mut propagator, -1.2);
        let soon_db = mean(&rooms.late_db(&mut propagator, 6));
        assert!(
            (soon_db - open_db).abs() < SCATTER_DB,
            "{open_db} dB, first {soon_db} dB"
        );
        let again_db = mean(&rooms.late_db(&mut propagator, 46));
        assert!(
            (again_db - open_db).abs() < 0.1,
            "{again_db} dB, not {open_db}"
        );
    }
}
