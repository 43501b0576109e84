//! Random rooms of eight kinds, for what the rooms of the laws do not show. A number is always the same room.

use glam::DVec3;

use foresound::acoustics::Material;

use super::late_particles::BALL_M;
use super::late_rooms::{Panel, Room, box_faces, panel, plain, wall_with_door};

/// Names of the kinds; numbers take turns.
pub(super) const KINDS: [&str; 8] = [
    "furnished room",
    "two rooms",
    "office with screens",
    "roof",
    "yard",
    "hall with a balcony",
    "bent corridor",
    "flat",
];

/// Legs of the particles of a room.
const LEGS: u64 = 48_000_000;

/// Scattering of the rooms; furniture scatters half as much again.
const SCATTERING: [f64; 5] = [0.05, 0.1, 0.2, 0.3, 0.5];

const WALL: usize = 0;
const FLOOR: usize = 1;
const CEILING: usize = 2;
const FURNITURE: usize = 3;
/// Surfaces of the second room, if there is one.
const OTHER: usize = 4;

/// Faces of a closed room: x, y, z, lower and upper.
const CLOSED: [Option<usize>; 6] = [
    Some(WALL),
    Some(WALL),
    Some(FLOOR),
    Some(CEILING),
    Some(WALL),
    Some(WALL),
];

/// A linear congruential generator whose output is mixed.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let mixed = (self.0 ^ (self.0 >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        ((mixed ^ (mixed >> 33)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A position between two values of x and of z.
    fn place(&mut self, [left, right]: [f64; 2], y: f64, [front, back]: [f64; 2]) -> [f64; 3] {
        [self.within(left, right), y, self.within(front, back)]
    }

    /// Absorption between two values.
    fn absorption(&mut self, low: f64, high: f64) -> f32 {
        self.within(low, high) as f32
    }
}

/// Surfaces, source and listener of a room.
struct Layout {
    panels: Vec<Panel>,
    source: [f64; 3],
    listener: [f64; 3],
}

impl Layout {
    /// Whether no surface cuts the ball at the listener in which particles are counted: it would hold what is behind the surface.
    fn is_clear(&self) -> bool {
        let listener = DVec3::from(self.listener);
        let away_m = |panel: &Panel| {
            let [mut low, mut high] = panel.corners;
            (low[panel.axis], high[panel.axis]) = (panel.at, panel.at);
            listener.distance(listener.clamp(low.min(high), low.max(high)))
        };
        self.panels.iter().all(|panel| away_m(panel) >= BALL_M)
    }
}

/// Room number `number`, of the kind `number % 8`.
pub(super) fn room(number: u64) -> Room {
    let random = &mut Random(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 77);
    (0..8).for_each(|_| {
        random.unit();
    });
    let scattering = SCATTERING[(random.unit() * 5.0) as usize % 5];
    let material =
        |name, absorption, times: f64| plain(name, absorption, (scattering * times) as f32, None);
    let common = [
        material("wall", random.absorption(0.03, 0.15), 1.0),
        material("floor", random.absorption(0.03, 0.3), 1.0),
        material("ceiling", random.absorption(0.05, 0.8), 1.0),
        material("furniture", random.absorption(0.1, 0.5), 1.5),
    ];
    let kind = (number % 8) as usize;
    let turn = number / 8;
    let (layout, materials) = loop {
        let mut materials = common.to_vec();
        let layout = match kind {
            0 => furnished(random),
            1 => two_rooms(random, turn, &mut materials),
            2 => office(random),
            3 => roof(random, turn),
            4 => yard(random, turn),
            5 => balcony(random, turn),
            6 => bent_corridor(random),
            _ => flat(random, turn, &mut materials),
        };
        if layout.is_clear() {
            break (layout, materials);
        }
    };
    let Layout {
        panels,
        source,
        listener,
    } = layout;
    Room {
        name: KINDS[kind],
        panels,
        triangles: Vec::new(),
        materials,
        source: DVec3::from(source).as_vec3(),
        listener: DVec3::from(listener).as_vec3(),
        legs: LEGS,
    }
}

/// Four boxes on the floor, which may overlap; source and listener above them.
fn furnished(random: &mut Random) -> Layout {
    let size @ [width, _, depth] = [
        random.within(4.0, 9.0),
        random.within(2.5, 3.4),
        random.within(4.0, 8.0),
    ];
    let mut panels = box_faces([0.0; 3], size, CLOSED);
    let mut faces = [Some(FURNITURE); 6];
    faces[2] = None;
    for _ in 0..4 {
        let (x, z) = (
            random.within(0.3, width - 2.0),
            random.within(0.3, depth - 2.0),
        );
        let height = random.within(0.5, 2.0);
        let high = [
            x + random.within(0.5, 1.6),
            height,
            z + random.within(0.5, 1.6),
        ];
        panels.extend(box_faces([x, 0.0, z], high, faces));
    }
    let mut place = |y| random.place([0.5, width - 0.5], y, [0.5, depth - 0.5]);
    let (source, listener) = (place(2.2), place(2.1));
    Layout {
        panels,
        source,
        listener,
    }
}

/// Two rooms with a door; by turns from one to the other, back, and within each.
fn two_rooms(random: &mut Random, turn: u64, materials: &mut Vec<Material>) -> Layout {
    let (height, depth) = (random.within(2.5, 3.5), random.within(4.0, 7.0));
    let (first, second) = (random.within(4.0, 8.0), random.within(3.0, 7.0));
    materials.push(plain("other", random.absorption(0.1, 0.6), 0.3, None));
    let [wall, other] = [Some(WALL), Some(OTHER)];
    let mut panels = box_faces(
        [0.0; 3],
        [first, height, depth],
        [wall, None, Some(FLOOR), wall, wall, wall],
    );
    panels.extend(box_faces(
        [first, 0.0, 0.0],
        [first + second, height, depth],
        [None, other, other, Some(CEILING), other, other],
    ));
    let door = random.within(0.5, depth - 1.6);
    panels.extend(wall_with_door(
        first,
        [height, depth],
        [door, door + 0.9, 2.1],
        WALL,
    ));
    let mut place = |from: f64, width: f64, y: f64| {
        [
            from + random.within(0.7, width - 0.7),
            y,
            random.within(0.7, depth - 0.7),
        ]
    };
    let (here, there) = (place(0.0, first, 1.5), place(first, second, 1.6));
    let (beside, beyond) = (place(0.0, first, 1.6), place(first, second, 1.7));
    let (source, listener) = match turn % 4 {
        0 => (here, there),
        1 => (there, here),
        2 => (here, beside),
        _ => (there, beyond),
    };
    Layout {
        panels,
        source,
        listener,
    }
}

/// Three rows of screens with an aisle through their middle.
fn office(random: &mut Random) -> Layout {
    let size @ [width, _, depth] = [
        random.within(9.0, 18.0),
        random.within(2.6, 3.2),
        random.within(7.0, 12.0),
    ];
    let mut panels = box_faces([0.0; 3], size, CLOSED);
    let height = random.within(1.2, 1.9);
    for row in 1..4 {
        let x = width * f64::from(row) / 4.0;
        let mut screen =
            |from, to| panels.push(panel(0, x, [x, 0.0, from], [x, height, to], FURNITURE));
        screen(0.0, depth * 0.42);
        screen(depth * 0.58, depth);
    }
    let source = random.place([0.5, width * 0.2], 1.2, [0.5, depth - 0.5]);
    let listener = [
        width - random.within(0.5, width * 0.6),
        1.3,
        random.within(0.5, depth - 0.5),
    ];
    Layout {
        panels,
        source,
        listener,
    }
}

/// A roof on open ground with one to three walls; by turns the listener is under it and before it.
fn roof(random: &mut Random, turn: u64) -> Layout {
    let [width, depth, height] = [
        random.within(3.0, 9.0),
        random.within(2.0, 6.0),
        random.within(2.2, 3.5),
    ];
    let mut panels = vec![
        panel(1, 0.0, [-20.0, 0.0, -20.0], [28.0, 0.0, 24.0], FLOOR),
        panel(1, height, [0.0, height, 0.0], [width, height, depth], WALL),
        panel(2, depth, [0.0, 0.0, depth], [width, height, depth], WALL),
    ];
    for x in [0.0, width] {
        if random.unit() < 0.7 {
            panels.push(panel(0, x, [x, 0.0, 0.0], [x, height, depth], WALL));
        }
    }
    let source = random.place([0.5, width - 0.5], 1.5, [0.5, depth - 0.5]);
    let listener = match turn % 2 {
        0 => random.place([0.5, width - 0.5], 1.6, [0.4, depth - 0.4]),
        _ => [random.within(0.0, width), 1.6, -random.within(1.0, 5.0)],
    };
    Layout {
        panels,
        source,
        listener,
    }
}

/// Four walls without a roof and a gate; by turns the listener is within and before the gate.
fn yard(random: &mut Random, turn: u64) -> Layout {
    let [width, depth, height] = [
        random.within(8.0, 20.0),
        random.within(8.0, 20.0),
        random.within(3.0, 10.0),
    ];
    let ground = [width + 20.0, 0.0, depth + 20.0];
    let mut panels = vec![
        panel(1, 0.0, [-20.0, 0.0, -20.0], ground, FLOOR),
        panel(2, 0.0, [0.0; 3], [width, height, 0.0], WALL),
        panel(2, depth, [0.0, 0.0, depth], [width, height, depth], WALL),
        panel(0, 0.0, [0.0; 3], [0.0, height, depth], WALL),
    ];
    let gate = random.within(1.0, depth - 4.0);
    panels.extend(wall_with_door(
        width,
        [height, depth],
        [gate, gate + 3.0, 2.8],
        WALL,
    ));
    let source = random.place([0.5, width - 0.5], 1.5, [0.5, depth - 0.5]);
    let listener = match turn % 2 {
        0 => random.place([0.5, width - 0.5], 1.6, [0.4, depth - 0.4]),
        _ => [
            width + random.within(1.0, 5.0),
            1.6,
            gate + random.within(-1.0, 4.0),
        ],
    };
    Layout {
        panels,
        source,
        listener,
    }
}

/// A hall; by turns the listener is under its balcony and on it.
fn balcony(random: &mut Random, turn: u64) -> Layout {
    let size @ [width, _, depth] = [
        random.within(14.0, 26.0),
        random.within(6.0, 11.0),
        random.within(9.0, 16.0),
    ];
    let mut panels = box_faces([0.0; 3], size, CLOSED);
    let (x, y) = (width * random.within(0.6, 0.75), random.within(2.6, 3.5));
    panels.push(panel(1, y, [x, y, 0.0], [width, y, depth], FURNITURE));
    panels.push(panel(0, x, [x, y, 0.0], [x, y + 1.0, depth], FURNITURE));
    let source = random.place([1.0, 4.0], 1.5, [1.0, depth - 1.0]);
    let above = if turn.is_multiple_of(2) { 0.0 } else { y };
    let listener = [
        width - random.within(0.7, 3.0),
        above + 1.4,
        random.within(1.0, depth - 1.0),
    ];
    Layout {
        panels,
        source,
        listener,
    }
}

/// Two corridors at a right angle.
fn bent_corridor(random: &mut Random) -> Layout {
    let [first, second, width, height] = [
        random.within(8.0, 16.0),
        random.within(6.0, 14.0),
        random.within(1.6, 2.6),
        random.within(2.4, 3.2),
    ];
    let [wall, floor, ceiling] = [Some(WALL), Some(FLOOR), Some(CEILING)];
    let corner = first - width;
    let mut panels = box_faces(
        [0.0; 3],
        [first, height, width],
        [wall, None, floor, ceiling, wall, None],
    );
    panels.push(panel(
        2,
        width,
        [0.0, 0.0, width],
        [corner, height, width],
        WALL,
    ));
    panels.extend(box_faces(
        [corner, 0.0, width],
        [first, height, width + second],
        [wall, wall, floor, ceiling, None, wall],
    ));
    panels.push(panel(
        0,
        first,
        [first, 0.0, 0.0],
        [first, height, width],
        WALL,
    ));
    let source = random.place([0.7, first * 0.5], 1.5, [0.4, width - 0.4]);
    let listener = [
        first - random.within(0.4, width - 0.4),
        1.6,
        width + random.within(1.0, second - 0.7),
    ];
    Layout {
        panels,
        source,
        listener,
    }
}

/// Two rooms on either side of a corridor, with two doors; by turns through the corridor, back, and into it.
fn flat(random: &mut Random, turn: u64, materials: &mut Vec<Material>) -> Layout {
    let [first, corridor, last, height, depth] = [
        random.within(3.5, 6.0),
        random.within(1.2, 2.0),
        random.within(3.0, 5.5),
        random.within(2.4, 2.9),
        random.within(3.5, 6.0),
    ];
    materials.push(plain("other", random.absorption(0.15, 0.4), 0.3, None));
    let [wall, floor, other] = [Some(WALL), Some(FLOOR), Some(OTHER)];
    let (to, end) = (first + corridor, first + corridor + last);
    let mut panels = box_faces(
        [0.0; 3],
        [first, height, depth],
        [wall, None, floor, wall, wall, wall],
    );
    panels.extend(box_faces(
        [first, 0.0, 0.0],
        [to, height, depth],
        [None, None, floor, wall, wall, wall],
    ));
    panels.extend(box_faces(
        [to, 0.0, 0.0],
        [end, height, depth],
        [None, wall, other, wall, other, wall],
    ));
    let doors = [
        random.within(0.3, depth - 1.3),
        random.within(0.3, depth - 1.3),
    ];
    for (x, door) in [first, to].into_iter().zip(doors) {
        panels.extend(wall_with_door(
            x,
            [height, depth],
            [door, door + 0.9, 2.1],
            WALL,
        ));
    }
    let here = random.place([0.6, first - 0.6], 1.5, [0.6, depth - 0.6]);
    let between = [first + corridor * 0.5, 1.5, random.within(0.6, depth - 0.6)];
    let there = [
        to + random.within(0.6, last - 0.6),
        1.6,
        random.within(0.6, depth - 0.6),
    ];
    let (source, listener) = match turn % 3 {
        0 => (here, there),
        1 => (there, here),
        _ => (here, between),
    };
    Layout {
        panels,
        source,
        listener,
    }
}
