//! Rooms of the law *recall*: an L, two rooms with a door, a room with boxes, a corridor.

use std::sync::Arc;

use glam::Vec3;

use super::rooms::{Probe, commit, even};
use foresound::acoustics::Material;
use foresound::error::Result;
use foresound::propagation::PropagationSettings;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::scene::{Scene, TriangleMesh};

/// Minimum distance of sources and listeners from a wall, in metres.
const CLEARANCE_M: f32 = 0.2;

/// Energy that every wall absorbs.
pub(super) const ABSORPTION: f32 = 0.1;

/// A room and its bounds of recall.
pub(super) struct RecallRoom {
    pub(super) name: &'static str,
    pub(super) scene: Arc<Scene>,
    /// Boxes of air.
    pub(super) air: Vec<[Vec3; 2]>,
    /// Solid boxes.
    pub(super) solid: Vec<[Vec3; 2]>,
    /// Recall in per cent after one update and after sixteen.
    pub(super) bounds: [f64; 2],
}

impl RecallRoom {
    /// A probe that others may be beside.
    pub(super) fn probe(&self) -> Result<Probe> {
        let [source, listener] = [0, 1].map(|number| self.position(number));
        let mut probe = Probe::new(&self.scene, source, PropagationSettings::default())?;
        probe.update(listener);
        Ok(probe)
    }

    /// A position for a source or listener, a different one for each number.
    pub(super) fn position(&self, number: u64) -> Vec3 {
        for attempt in 0u64.. {
            let draw = |k: u64| unit(mix(number << 20 | attempt << 4 | k));
            let which = (draw(0) * self.air.len() as f32) as usize;
            let [low, high] = self.air[which].map(Vec3::from);
            let (low, high) = (low + CLEARANCE_M, high - CLEARANCE_M);
            let position = low + Vec3::new(draw(1), draw(2), draw(3)) * (high - low);
            if self.is_free(position) {
                return position;
            }
        }
        Vec3::ZERO
    }

    /// Whether a position is in the air and clear of boxes.
    pub(super) fn is_free(&self, at: Vec3) -> bool {
        let within = |[low, high]: &[Vec3; 2], margin: f32| {
            at.cmpgt(*low - margin).all() && at.cmplt(*high + margin).all()
        };
        self.air.iter().any(|air| within(air, -0.9 * CLEARANCE_M))
            && !self.solid.iter().any(|solid| within(solid, CLEARANCE_M))
    }
}

/// All rooms of the law.
pub(super) fn all() -> Result<Vec<RecallRoom>> {
    Ok(vec![l_room()?, two_rooms()?, boxes()?, corridor()?])
}

/// Collects rectangles perpendicular to an axis.
#[derive(Default)]
pub(super) struct Rectangles {
    pub(super) mesh: TriangleMesh,
}

impl Rectangles {
    /// The rectangle between two corners that agree along one axis.
    pub(super) fn add(&mut self, low: [f32; 3], high: [f32; 3]) {
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let axis = (high - low).abs().min_position();
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let material = self.mesh.material("wall");
        let first = self.mesh.vertices.len() as u32;
        for [far_u, far_v] in [[false, false], [true, false], [true, true], [false, true]] {
            let mut corner = low;
            corner[u] = if far_u { high[u] } else { low[u] };
            corner[v] = if far_v { high[v] } else { low[v] };
            self.mesh.vertices.push(corner);
        }
        for [b, c] in [[1, 2], [2, 3]] {
            self.mesh.triangles.push([first, first + b, first + c]);
            self.mesh.triangle_materials.push(material);
        }
    }

    /// The sides and top of a box, and its bottom.
    fn add_box(&mut self, [low, high]: [Vec3; 2], bottom: bool) {
        for axis in 0..3 {
            let (mut near, mut far) = (low, high);
            near[axis] = high[axis];
            self.add(near.into(), high.into());
            far[axis] = low[axis];
            if axis != 1 || bottom {
                self.add(low.into(), far.into());
            }
        }
    }

    fn commit(&self) -> Result<Arc<Scene>> {
        commit(&self.mesh, vec![even("wall", ABSORPTION, 0.0)])
    }
}

fn l_room() -> Result<RecallRoom> {
    l_room_of(even("wall", ABSORPTION, 0.0))
}

/// An L-shaped room, all walls of one material.
pub(super) fn l_room_of(wall: Material) -> Result<RecallRoom> {
    let mut b = Rectangles::default();
    for y in [0.0, 3.0] {
        b.add([0.0, y, 0.0], [10.0, y, 4.0]);
        b.add([0.0, y, 4.0], [4.0, y, 9.0]);
    }
    b.add([0.0, 0.0, 0.0], [10.0, 3.0, 0.0]);
    b.add([10.0, 0.0, 0.0], [10.0, 3.0, 4.0]);
    b.add([4.0, 0.0, 4.0], [10.0, 3.0, 4.0]);
    b.add([4.0, 0.0, 4.0], [4.0, 3.0, 9.0]);
    b.add([0.0, 0.0, 9.0], [4.0, 3.0, 9.0]);
    b.add([0.0, 0.0, 0.0], [0.0, 3.0, 9.0]);
    Ok(RecallRoom {
        name: "L-shaped room",
        scene: commit(&b.mesh, vec![wall])?,
        air: vec![
            [Vec3::ZERO, Vec3::new(10.0, 3.0, 4.0)],
            [Vec3::ZERO, Vec3::new(4.0, 3.0, 9.0)],
        ],
        solid: Vec::new(),
        bounds: [99.5, 99.5],
    })
}

fn two_rooms() -> Result<RecallRoom> {
    let mut b = Rectangles::default();
    for [near, far] in [[0.0, 8.0], [8.2, 16.2]] {
        b.add([near, 0.0, 0.0], [far, 0.0, 6.0]);
        b.add([near, 3.0, 0.0], [far, 3.0, 6.0]);
        b.add([near, 0.0, 0.0], [far, 3.0, 0.0]);
        b.add([near, 0.0, 6.0], [far, 3.0, 6.0]);
    }
    for x in [0.0, 16.2] {
        b.add([x, 0.0, 0.0], [x, 3.0, 6.0]);
    }
    for x in [8.0, 8.2] {
        b.add([x, 0.0, 0.0], [x, 3.0, 3.1]);
        b.add([x, 0.0, 4.05], [x, 3.0, 6.0]);
        b.add([x, 2.1, 3.1], [x, 3.0, 4.05]);
    }
    for z in [3.1, 4.05] {
        b.add([8.0, 0.0, z], [8.2, 2.1, z]);
    }
    b.add([8.0, 2.1, 3.1], [8.2, 2.1, 4.05]);
    b.add([8.0, 0.0, 3.1], [8.2, 0.0, 4.05]);
    Ok(RecallRoom {
        name: "two rooms with a door",
        scene: b.commit()?,
        air: vec![
            [Vec3::ZERO, Vec3::new(8.0, 3.0, 6.0)],
            [Vec3::new(8.2, 0.0, 0.0), Vec3::new(16.2, 3.0, 6.0)],
        ],
        solid: Vec::new(),
        bounds: [97.0, 99.0],
    })
}

fn boxes() -> Result<RecallRoom> {
    let room = [Vec3::ZERO, Vec3::new(12.0, 4.0, 9.0)];
    let solid = vec![
        [Vec3::new(2.0, 0.0, 1.5), Vec3::new(3.6, 1.3, 2.9)],
        [Vec3::new(7.1, 0.0, 1.0), Vec3::new(8.3, 2.0, 3.2)],
        [Vec3::new(1.4, 0.0, 5.6), Vec3::new(2.8, 0.9, 7.7)],
        [Vec3::new(8.8, 0.0, 5.9), Vec3::new(10.7, 1.6, 7.2)],
    ];
    let mut b = Rectangles::default();
    b.add_box(room, true);
    for solid in &solid {
        b.add_box(*solid, false);
    }
    Ok(RecallRoom {
        name: "room with boxes",
        scene: b.commit()?,
        air: vec![room],
        solid,
        bounds: [97.5, 99.8],
    })
}

fn corridor() -> Result<RecallRoom> {
    let room = [Vec3::ZERO, Vec3::new(40.0, 3.0, 3.0)];
    let mut b = Rectangles::default();
    b.add_box(room, true);
    Ok(RecallRoom {
        name: "corridor",
        scene: b.commit()?,
        air: vec![room],
        solid: Vec::new(),
        bounds: [75.0, 97.0],
    })
}
