//! Rooms of the late field's laws: rectangles across the axes, and triangles.

use glam::{DVec3, Vec3};

use foresound::acoustics::{BANDS, Material};
use foresound::error::Result;
use foresound::scene::{Scene, TriangleMesh};
use std::sync::Arc;

use super::rooms;

/// A rectangle across an axis: material, position along the axis, and its two corners in the two other axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panel {
    pub(super) axis: usize,
    pub(super) at: f64,
    /// Lower and upper corner; the coordinate of the axis has no meaning.
    pub(super) corners: [DVec3; 2],
    pub(super) material: usize,
}

/// A triangle that need not be across an axis, its corners counter-clockwise from within the room, and its material.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    pub(super) corners: [DVec3; 3],
    pub(super) material: usize,
}

/// One room of the laws.
#[derive(Debug, Clone)]
pub(super) struct Room {
    pub(super) name: &'static str,
    pub(super) panels: Vec<Panel>,
    pub(super) triangles: Vec<Triangle>,
    pub(super) materials: Vec<Material>,
    pub(super) source: Vec3,
    pub(super) listener: Vec3,
    /// Legs of the particles that its law is measured by.
    pub(super) legs: u64,
}

/// Legs of the particles of a room: the scatter over seeds is below a fifth of the laws' bounds.
const LEGS: u64 = 150_000_000;

/// Legs where few particles pass both doors early: with 100 million C80 is 0.2 to 0.5 dB from that with 1.2 billion.
const LEGS_BEHIND_TWO_DOORS: u64 = 4 * LEGS;

/// Legs where a tenth of the particles has the same scatter: every one passes the listener often. Tests let them all fly again.
const LEGS_IN_A_CUBE: u64 = LEGS / 10;

/// The room in which law *late/direction* does not hold, and is not asked for.
pub(super) const OUT_OF_A_CONTAINER: &str = "out of a container";

/// A material whose absorption is the same in all bands.
pub(super) fn plain(
    name: &str,
    absorption: f32,
    scattering: f32,
    loss_db: Option<f32>,
) -> Material {
    Material {
        name: name.to_owned(),
        absorption: [absorption; BANDS],
        scattering: [scattering; BANDS],
        transmission: [loss_db.map_or(0.0, |loss| 10f32.powf(-0.1 * loss)); BANDS],
    }
}

/// The six faces of a box; `materials` of x = low, x = high, y = low, …; `None` leaves a face open.
pub(super) fn box_faces(
    low: [f64; 3],
    high: [f64; 3],
    materials: [Option<usize>; 6],
) -> Vec<Panel> {
    let corners = [DVec3::from(low), DVec3::from(high)];
    let face = |(number, material): (usize, Option<usize>)| {
        let axis = number / 2;
        material.map(|material| Panel {
            axis,
            at: corners[number % 2][axis],
            corners,
            material,
        })
    };
    materials.into_iter().enumerate().filter_map(face).collect()
}

/// A wall across the x axis with a door from the floor: three panels.
pub(super) fn wall_with_door(
    x: f64,
    size: [f64; 2],
    door: [f64; 3],
    material: usize,
) -> Vec<Panel> {
    let [height, depth] = size;
    let [door_low, door_high, door_height] = door;
    let panel = |y: [f64; 2], z: [f64; 2]| Panel {
        axis: 0,
        at: x,
        corners: [DVec3::new(x, y[0], z[0]), DVec3::new(x, y[1], z[1])],
        material,
    };
    vec![
        panel([0.0, height], [0.0, door_low]),
        panel([0.0, height], [door_high, depth]),
        panel([door_height, height], [door_low, door_high]),
    ]
}

fn single(
    name: &'static str,
    size: [f64; 3],
    materials: Vec<Material>,
    faces: [Option<usize>; 6],
    [source, listener]: [[f32; 3]; 2],
) -> Room {
    Room {
        name,
        panels: box_faces([0.0; 3], size, faces),
        triangles: Vec::new(),
        materials,
        source: source.into(),
        listener: listener.into(),
        legs: LEGS,
    }
}

/// Live and dead room with a door of 0.9 m × 2.1 m between them.
fn coupled(name: &'static str, source: [f32; 3], listener: [f32; 3]) -> Room {
    let live = box_faces(
        [0.0; 3],
        [8.0, 3.5, 6.0],
        [Some(0), None, Some(0), Some(0), Some(0), Some(0)],
    );
    let dead = box_faces(
        [8.0, 0.0, 0.0],
        [12.0, 3.5, 6.0],
        [None, Some(1), Some(1), Some(1), Some(1), Some(1)],
    );
    let mut panels = live;
    panels.extend(dead);
    panels.extend(wall_with_door(8.0, [3.5, 6.0], [2.0, 2.9, 2.1], 2));
    Room {
        name,
        panels,
        triangles: Vec::new(),
        materials: vec![
            plain("live", 0.04, 0.3, None),
            plain("dead", 0.6, 0.3, None),
            plain("between", 0.1, 0.3, None),
        ],
        source: source.into(),
        listener: listener.into(),
        legs: LEGS,
    }
}

/// A live, a dead and a live room in a row, with a door of 0.9 m × 2.1 m from one to the next.
fn row(name: &'static str, source: [f32; 3], listener: [f32; 3]) -> Room {
    let [live, dead] = [Some(0), Some(1)];
    let mut panels = box_faces(
        [0.0; 3],
        [8.0, 3.2, 6.0],
        [live, None, live, live, live, live],
    );
    panels.extend(box_faces(
        [8.0, 0.0, 0.0],
        [12.0, 3.2, 6.0],
        [None, None, dead, dead, dead, dead],
    ));
    panels.extend(box_faces(
        [12.0, 0.0, 0.0],
        [19.0, 3.2, 6.0],
        [None, live, live, live, live, live],
    ));
    panels.extend(wall_with_door(8.0, [3.2, 6.0], [2.0, 2.9, 2.1], 2));
    panels.extend(wall_with_door(12.0, [3.2, 6.0], [3.5, 4.4, 2.1], 2));
    Room {
        name,
        panels,
        triangles: Vec::new(),
        materials: vec![
            plain("live", 0.05, 0.3, None),
            plain("dead", 0.5, 0.3, None),
            plain("between", 0.1, 0.3, None),
        ],
        source: source.into(),
        listener: listener.into(),
        legs: LEGS,
    }
}

/// Two rooms of 5 m × 4 m × 3 m beside each other, with a partition and no opening.
fn partition(name: &'static str, loss_db: f32) -> Room {
    let mut panels = box_faces([0.0; 3], [10.0, 3.0, 4.0], [Some(0); 6]);
    panels.push(Panel {
        axis: 0,
        at: 5.0,
        corners: [DVec3::new(5.0, 0.0, 0.0), DVec3::new(5.0, 3.0, 4.0)],
        material: 1,
    });
    Room {
        name,
        panels,
        triangles: Vec::new(),
        materials: vec![
            plain("wall", 0.15, 0.4, None),
            plain("partition", 0.15, 0.4, Some(loss_db)),
        ],
        source: Vec3::new(1.3, 1.4, 1.6),
        listener: Vec3::new(7.9, 1.5, 2.3),
        legs: LEGS,
    }
}

/// A shaft of bare walls with three landings that leave half of it open.
fn stairwell() -> Room {
    let landing = |y: f64, x: [f64; 2]| Panel {
        axis: 1,
        at: y,
        corners: [DVec3::new(x[0], y, 0.0), DVec3::new(x[1], y, 3.0)],
        material: 1,
    };
    let mut panels = box_faces([0.0; 3], [3.0, 12.0, 3.0], [Some(0); 6]);
    panels.extend([
        landing(3.0, [0.0, 1.3]),
        landing(6.0, [1.7, 3.0]),
        landing(9.0, [0.0, 1.3]),
    ]);
    Room {
        name: "stairwell",
        panels,
        triangles: Vec::new(),
        materials: vec![
            plain("wall", 0.03, 0.1, None),
            plain("landing", 0.05, 0.3, None),
        ],
        source: Vec3::new(1.0, 1.5, 1.2),
        listener: Vec3::new(1.6, 10.6, 1.3),
        legs: LEGS,
    }
}

/// Two wings of 10 m × 4 m and 5 m × 4 m with bare walls and an absorbing ceiling: source and listener do not see each other.
fn l_shaped_room() -> Room {
    let [wall, floor, ceiling] = [Some(0), Some(1), Some(2)];
    let mut panels = box_faces(
        [0.0; 3],
        [10.0, 3.0, 4.0],
        [wall, wall, floor, ceiling, wall, None],
    );
    panels.extend(box_faces(
        [0.0, 0.0, 4.0],
        [5.0, 3.0, 8.0],
        [wall, wall, floor, ceiling, None, wall],
    ));
    panels.extend(box_faces(
        [5.0, 0.0, 0.0],
        [10.0, 3.0, 4.0],
        [None, None, None, None, None, wall],
    ));
    Room {
        name: "L-shaped room",
        panels,
        triangles: Vec::new(),
        materials: vec![
            plain("wall", 0.05, 0.2, None),
            plain("floor", 0.3, 0.2, None),
            plain("ceiling", 0.6, 0.1, None),
        ],
        source: Vec3::new(8.8, 1.5, 1.2),
        listener: Vec3::new(1.5, 1.6, 6.8),
        legs: LEGS,
    }
}

/// A room with twelve desks and an absorbing ceiling, in which little is scattered: what is left late flies level.
fn classroom() -> Room {
    let mut panels = box_faces(
        [0.0; 3],
        [9.0, 3.0, 7.0],
        [Some(0), Some(0), Some(0), Some(1), Some(0), Some(0)],
    );
    for x in [2.5, 4.2, 5.9, 7.6] {
        panels.extend([0.8, 3.0, 5.2].map(|z| Panel {
            axis: 1,
            at: 0.74,
            corners: [DVec3::new(x, 0.74, z), DVec3::new(x + 0.6, 0.74, z + 1.3)],
            material: 2,
        }));
    }
    Room {
        name: "classroom",
        panels,
        triangles: Vec::new(),
        materials: vec![
            plain("wall", 0.06, 0.1, None),
            plain("ceiling", 0.75, 0.1, None),
            plain("desk", 0.1, 0.1, None),
        ],
        source: Vec3::new(1.2, 1.6, 3.5),
        listener: Vec3::new(6.6, 1.2, 5.6),
        legs: LEGS,
    }
}

/// A rectangle across an axis between two corners.
pub(super) fn panel(axis: usize, at: f64, low: [f64; 3], high: [f64; 3], material: usize) -> Panel {
    Panel {
        axis,
        at,
        corners: [DVec3::from(low), DVec3::from(high)],
        material,
    }
}

/// A container with an open half of its door on wide open ground: most rays from the ground meet nothing.
fn container() -> Room {
    let panels = vec![
        panel(1, 0.0, [-14.0, 0.0, -14.0], [26.0, 0.0, 17.0], 1),
        panel(1, 0.05, [0.0; 3], [6.0, 0.05, 2.4], 2),
        panel(1, 2.4, [0.0; 3], [6.0, 2.4, 2.4], 0),
        panel(0, 0.0, [0.0, 0.05, 0.0], [0.0, 2.4, 2.4], 0),
        panel(2, 0.0, [0.0, 0.05, 0.0], [6.0, 2.4, 0.0], 0),
        panel(2, 2.4, [0.0, 0.05, 0.0], [6.0, 2.4, 2.4], 0),
        panel(0, 6.0, [6.0, 0.05, 1.2], [6.0, 2.4, 2.4], 0),
    ];
    Room {
        name: OUT_OF_A_CONTAINER,
        panels,
        triangles: Vec::new(),
        materials: vec![
            plain("steel", 0.04, 0.1, None),
            plain("asphalt", 0.05, 0.1, None),
            plain("plywood", 0.1, 0.1, None),
        ],
        source: Vec3::new(1.2, 1.4, 1.0),
        listener: Vec3::new(9.5, 1.6, 0.8),
        legs: LEGS,
    }
}

/// A corner of a cube, cut off 6 m from its corner, of plaster: after a tenth of a second almost all energy is still specular.
fn tetrahedron() -> Room {
    let corner = |x, y, z| DVec3::new(x, y, z);
    let [o, x, y, z] = [
        corner(0.0, 0.0, 0.0),
        corner(6.0, 0.0, 0.0),
        corner(0.0, 6.0, 0.0),
        corner(0.0, 0.0, 6.0),
    ];
    let faces = [[o, x, y], [o, y, z], [o, z, x], [x, z, y]];
    Room {
        name: "tetrahedron of plaster",
        panels: Vec::new(),
        triangles: faces
            .map(|corners| Triangle {
                corners,
                material: 0,
            })
            .to_vec(),
        materials: vec![plain("wall", 0.02, 0.02, None)],
        source: Vec3::new(1.0, 1.0, 1.0),
        listener: Vec3::new(1.5, 1.0, 1.0),
        legs: LEGS,
    }
}

/// All rooms.
pub(super) fn all() -> Vec<Room> {
    let walls = |absorption, scattering| vec![plain("wall", absorption, scattering, None)];
    let ceiling = |scattering| {
        vec![
            plain("wall", 0.1, scattering, None),
            plain("ceiling", 0.8, scattering, None),
        ]
    };
    let below = [Some(0), Some(0), Some(0), Some(1), Some(0), Some(0)];
    let open = [Some(0), Some(0), Some(0), None, Some(0), Some(0)];
    let street = [None, None, Some(0), None, Some(0), Some(0)];
    let closed = [Some(0); 6];
    vec![
        Room {
            legs: LEGS_IN_A_CUBE,
            ..single(
                "cube",
                [5.0; 3],
                walls(0.2, 0.3),
                closed,
                [[1.2, 1.5, 1.7], [3.6, 1.6, 3.1]],
            )
        },
        single(
            "flat room",
            [20.0, 2.8, 16.0],
            ceiling(0.2),
            below,
            [[5.0, 1.5, 4.5], [13.5, 1.6, 10.5]],
        ),
        single(
            "office",
            [7.0, 2.8, 5.0],
            ceiling(0.1),
            below,
            [[1.6, 1.2, 1.5], [5.2, 1.2, 3.6]],
        ),
        single(
            "corridor",
            [30.0, 2.8, 2.4],
            walls(0.1, 0.3),
            closed,
            [[4.0, 1.5, 1.1], [19.0, 1.6, 1.3]],
        ),
        single(
            "courtyard",
            [15.0, 10.0, 12.0],
            walls(0.06, 0.4),
            open,
            [[4.0, 1.5, 4.0], [10.5, 1.6, 8.0]],
        ),
        single(
            "street",
            [60.0, 12.0, 10.0],
            walls(0.06, 0.4),
            street,
            [[20.0, 1.5, 4.0], [38.0, 1.6, 6.0]],
        ),
        single(
            "hall",
            [30.0, 12.0, 20.0],
            vec![
                plain("wall", 0.1, 0.6, None),
                plain("seats", 0.7, 0.6, None),
            ],
            [Some(0), Some(0), Some(1), Some(0), Some(0), Some(0)],
            [[6.0, 1.8, 9.0], [21.0, 1.4, 12.0]],
        ),
        coupled(
            "source live, listener live",
            [2.0, 1.5, 2.0],
            [5.5, 1.6, 4.4],
        ),
        coupled(
            "source live, listener dead",
            [2.0, 1.5, 2.0],
            [10.2, 1.6, 4.1],
        ),
        coupled(
            "source dead, listener live",
            [10.2, 1.5, 4.1],
            [2.0, 1.6, 2.0],
        ),
        coupled(
            "source dead, listener dead",
            [9.3, 1.5, 1.2],
            [10.8, 1.6, 4.6],
        ),
        row("first of three rooms", [2.5, 1.5, 2.0], [6.0, 1.6, 4.6]),
        Room {
            legs: LEGS_BEHIND_TWO_DOORS,
            ..row("first to third room", [2.5, 1.5, 2.0], [15.5, 1.6, 1.7])
        },
        row("second to third room", [10.0, 1.5, 1.0], [15.5, 1.6, 1.7]),
        row("third to first room", [15.5, 1.5, 1.7], [2.5, 1.6, 2.0]),
        partition("partition of 20 dB", 20.0),
        partition("partition of 35 dB", 35.0),
        tetrahedron(),
        stairwell(),
        l_shaped_room(),
        classroom(),
        container(),
    ]
}

impl Room {
    /// The room as a scene.
    pub(super) fn scene(&self) -> Result<Arc<Scene>> {
        let mut mesh = TriangleMesh {
            material_names: self.materials.iter().map(|m| m.name.clone()).collect(),
            ..TriangleMesh::default()
        };
        for panel in &self.panels {
            let first = mesh.vertices.len() as u32;
            let (u, v) = ((panel.axis + 1) % 3, (panel.axis + 2) % 3);
            for (a, b) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let mut corner = DVec3::ZERO;
                corner[panel.axis] = panel.at;
                corner[u] = panel.corners[a][u];
                corner[v] = panel.corners[b][v];
                mesh.vertices.push(corner.as_vec3());
            }
            for triangle in [[0, 1, 2], [0, 2, 3]] {
                mesh.triangles.push(triangle.map(|k: u32| first + k));
                mesh.triangle_materials.push(panel.material as u32);
            }
        }
        for triangle in &self.triangles {
            let first = mesh.vertices.len() as u32;
            let corners = triangle.corners.map(|corner| corner.as_vec3());
            mesh.vertices.extend(corners);
            mesh.triangles.push([first, first + 1, first + 2]);
            mesh.triangle_materials.push(triangle.material as u32);
        }
        rooms::commit(&mesh, self.materials.clone())
    }
}
