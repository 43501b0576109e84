//! Synthetic scenes, drawn. With FORESOUND_FIGURES set to a folder the pictures are written there for inspection.

use super::*;
use glam::vec3;

/// A reproducible number in 0 … 1.
struct Dice(u32);

impl Dice {
    fn throw(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 24) as f32
    }
}

fn keep(canvas: &Picture, name: &str) {
    if let Some(folder) = std::env::var_os("FORESOUND_FIGURES") {
        canvas
            .save_png(std::path::Path::new(&folder).join(name))
            .unwrap();
    }
}

/// A box of six faces, each cut into `cuts` by `cuts` squares.
fn push_box(triangles: &mut Vec<[Vec3; 3]>, low: Vec3, high: Vec3, cuts: usize) {
    for axis in 0..3 {
        for end in [low, high] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let corner = |i: usize, k: usize| {
                let mut at = end;
                at[u] = low[u] + (high[u] - low[u]) * i as f32 / cuts as f32;
                at[v] = low[v] + (high[v] - low[v]) * k as f32 / cuts as f32;
                at
            };
            for (i, k) in (0..cuts * cuts).map(|c| (c % cuts, c / cuts)) {
                let (a, b, c, d) = (
                    corner(i, k),
                    corner(i + 1, k),
                    corner(i + 1, k + 1),
                    corner(i, k + 1),
                );
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
}

/// Three by two rooms of 8 by 7 m with doors (with lintels), furniture and a ceiling.
fn rooms() -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    let mut dice = Dice(3);
    push_box(
        &mut triangles,
        vec3(-0.2, -0.3, -0.2),
        vec3(24.2, 0.0, 14.2),
        8,
    );
    push_box(
        &mut triangles,
        vec3(-0.2, 3.0, -0.2),
        vec3(24.2, 3.3, 14.2),
        8,
    );
    let mut wall = |from: Vec2, to: Vec2, door: Option<f32>| {
        let along = (to - from).normalize();
        let side = along.perp() * 0.1;
        let mut part = |a: f32, b: f32, low: f32, high: f32| {
            let corners = [from + along * a + side, from + along * b - side];
            let (x, z) = (corners[0].min(corners[1]), corners[0].max(corners[1]));
            push_box(&mut triangles, vec3(x.x, low, x.y), vec3(z.x, high, z.y), 6);
        };
        let length = from.distance(to);
        match door {
            None => part(0.0, length, 0.0, 3.0),
            Some(at) => {
                part(0.0, at, 0.0, 3.0);
                part(at, at + 1.0, 2.1, 3.0);
                part(at + 1.0, length, 0.0, 3.0);
            }
        }
    };
    for x in 0..4 {
        for z in 0..2 {
            let (x, z) = (x as f32 * 8.0, z as f32 * 7.0);
            wall(
                vec2(x, z),
                vec2(x, z + 7.0),
                (x > 0.0 && x < 24.0).then_some(2.5),
            );
        }
    }
    for z in 0..3 {
        for x in 0..3 {
            wall(
                vec2(x as f32 * 8.0, z as f32 * 7.0),
                vec2(x as f32 * 8.0 + 8.0, z as f32 * 7.0),
                (z == 1).then_some(4.0),
            );
        }
    }
    for _ in 0..60 {
        let at = vec3(1.0 + 21.0 * dice.throw(), 0.0, 1.0 + 11.0 * dice.throw());
        let size = vec3(
            0.4 + 1.2 * dice.throw(),
            0.4 + 0.8 * dice.throw(),
            0.4 + 0.8 * dice.throw(),
        );
        push_box(&mut triangles, at, at + size, 4);
    }
    triangles
}

fn hill_m(x: f32, z: f32) -> f32 {
    3.0 * (x / 19.0).sin() * (z / 23.0).cos() + 1.2 * (x / 7.0 + z / 9.0).sin()
}

/// Hills of 120 by 80 m with huts, walls and trees.
fn terrain() -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    let mut dice = Dice(11);
    for (i, k) in (0..240 * 160).map(|c| ((c % 240) as f32 / 2.0, (c / 240) as f32 / 2.0)) {
        let at = |x: f32, z: f32| vec3(x, hill_m(x, z), z);
        let (a, b, c, d) = (
            at(i, k),
            at(i + 0.5, k),
            at(i + 0.5, k + 0.5),
            at(i, k + 0.5),
        );
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    for n in 0..160 {
        let (x, z) = (4.0 + 108.0 * dice.throw(), 4.0 + 68.0 * dice.throw());
        let ground = vec3(x, hill_m(x, z), z);
        if n < 24 {
            let size = vec3(4.0 + 4.0 * dice.throw(), 2.8, 3.0 + 2.0 * dice.throw());
            push_box(&mut triangles, ground - Vec3::Y, ground + size, 12);
        } else if n < 40 {
            let long = if dice.throw() < 0.5 {
                vec3(9.0, 1.4, 0.3)
            } else {
                vec3(0.3, 1.4, 9.0)
            };
            push_box(&mut triangles, ground - Vec3::Y, ground + long, 4);
        } else {
            push_box(
                &mut triangles,
                ground - 0.15,
                ground + vec3(0.15, 2.5, 0.15),
                3,
            );
            push_box(
                &mut triangles,
                ground + vec3(-1.0, 2.2, -1.0),
                ground + vec3(1.0, 5.0, 1.0),
                6,
            );
        }
    }
    triangles
}

/// Synthetic paths: lines over points on the bounds of a box.
fn lines(
    sources: &[(Vec3, String)],
    listener: Vec3,
    low: Vec3,
    high: Vec3,
    per_order: usize,
) -> Vec<PathLine> {
    let mut dice = Dice(5);
    let mut lines = Vec::new();
    for (source, _) in sources {
        for order in 0..=MAX_ORDER {
            for _ in 0..if order == 0 { 1 } else { per_order } {
                let mut points = vec![*source];
                for _ in 0..order {
                    let mut at =
                        low + (high - low) * vec3(dice.throw(), dice.throw(), dice.throw());
                    let axis = if dice.throw() < 0.5 { 0 } else { 2 };
                    at[axis] = if dice.throw() < 0.5 {
                        low[axis]
                    } else {
                        high[axis]
                    };
                    points.push(at);
                }
                points.push(listener);
                lines.push(PathLine {
                    points,
                    order: order as u8,
                    diffraction_order: 0,
                });
            }
        }
    }
    lines
}

#[test]
fn rooms_are_cut_open_below_the_lintels() {
    let triangles = rooms();
    let listener = ListenerPose::facing(vec3(12.0, 1.6, 3.2), -1.2);
    let sources: Vec<(Vec3, String)> = [(2.0, 2.0), (20.0, 3.0), (13.5, 11.0), (13.9, 11.4)]
        .iter()
        .enumerate()
        .map(|(k, &(x, z))| (vec3(x, 1.5, z), format!("source {}", k + 1)))
        .collect();
    let view = TopView {
        title: "Doorway: synchronous, update 12",
        caption: "4 sources, 1,024 guide rays, depth 4; 26 K triangles",
        triangles: &triangles,
        sources: &sources,
        walk: Some([vec3(9.0, 1.6, 3.2), vec3(15.0, 1.6, 3.2)]),
        listener: Some(listener),
        paths: &lines(
            &sources,
            listener.position,
            vec3(8.1, 0.0, 0.1),
            vec3(15.9, 3.0, 6.9),
            5,
        ),
        cut_height_m: None,
    };
    let canvas = view.draw().unwrap();
    keep(&canvas, "top_rooms.png");
    let frame = view.plan().unwrap();
    let canvas = TopView { paths: &[], ..view }.draw().unwrap();
    let light = |x: f32, z: f32| {
        let at = frame.pixel(vec3(x, 0.0, z)) / FINENESS as f32;
        canvas.pixel(at.x as usize, at.y as usize).0
    };
    // The wall of the last room beside its door has a dark face; the doorway is as light as the floor.
    let across = |z: f32| {
        (-20..20)
            .map(|k| light(16.0 + k as f32 * 0.02, z))
            .min()
            .unwrap()
    };
    assert!(across(0.6) < 100, "{}", across(0.6));
    assert!(across(3.0) > 150, "{}", across(3.0));
}

#[test]
fn hills_and_many_paths_are_drawn() {
    let triangles = terrain();
    assert!(triangles.len() > 100_000);
    let mut dice = Dice(8);
    let ears = |x: f32, z: f32| vec3(x, hill_m(x, z) + 1.6, z);
    let sources: Vec<(Vec3, String)> = (0..16)
        .map(|k| {
            (
                ears(30.0 + 60.0 * dice.throw(), 15.0 + 50.0 * dice.throw()),
                format!("S{}", k + 1),
            )
        })
        .collect();
    let listener = ListenerPose::facing(ears(60.0, 40.0), 0.4);
    let view = TopView {
        title: "Bootcamp: 16 sources",
        caption: "dynamic; level 2, 124.8 FPS",
        triangles: &triangles,
        sources: &sources,
        walk: Some([ears(54.0, 40.0), ears(66.0, 40.0)]),
        listener: Some(listener),
        paths: &lines(
            &sources,
            listener.position,
            vec3(35.0, 0.0, 20.0),
            vec3(85.0, 3.0, 60.0),
            12,
        ),
        cut_height_m: None,
    };
    keep(&view.draw().unwrap(), "top_terrain.png");
    let plain = TopView {
        paths: &[],
        sources: &[],
        walk: None,
        listener: None,
        ..view
    };
    keep(&plain.draw().unwrap(), "top_terrain_plain.png");
}

#[test]
fn deep_scenes_and_single_marks_are_drawn() {
    let mut corridor = Vec::new();
    push_box(&mut corridor, vec3(0.0, -0.1, 0.0), vec3(3.0, 0.0, 60.0), 2);
    push_box(&mut corridor, vec3(1.0, 0.0, 20.0), vec3(2.0, 3.0, 21.0), 2);
    let view = TopView {
        title: "Corridor",
        triangles: &corridor,
        listener: Some(ListenerPose::facing(vec3(1.5, 1.6, 30.0), 0.0)),
        ..TopView::default()
    };
    let canvas = view.draw().unwrap();
    keep(&canvas, "top_corridor.png");
    assert_eq!(canvas.size().0, 1000);
    let sources = [(vec3(5.0, 1.0, 5.0), "alone".to_owned())];
    let lone = TopView {
        triangles: &[],
        listener: None,
        sources: &sources,
        ..view
    };
    assert!(lone.draw().is_ok());
    assert!(TopView::default().draw().is_err());
}

#[test]
fn scale_is_the_same_across_and_down() {
    let triangles = rooms();
    let view = TopView {
        triangles: &triangles,
        ..TopView::default()
    };
    let frame = view.plan().unwrap();
    let [origin, right, down] = [Vec3::ZERO, Vec3::X, Vec3::Z].map(|p| frame.pixel(p));
    assert!(((right.x - origin.x) - (down.y - origin.y)).abs() < 1e-3);
    assert!(right.x > origin.x && down.y > origin.y);
}

#[test]
fn labels_avoid_marks_and_each_other() {
    let frame = PlanFrame {
        corner_m: Vec2::ZERO,
        corner_px: Vec2::ZERO,
        size_px: vec2(400.0, 400.0),
        px_per_m: 10.0,
    };
    let (half, mark) = (vec2(30.0, 9.0), vec2(200.0, 200.0));
    let mut taken = vec![[mark - 9.0, mark + 9.0]];
    for _ in 0..4 {
        let centre = label_centre(mark, half, &frame, &taken);
        let (from, to) = (centre - half, centre + half);
        assert!(
            !taken
                .iter()
                .any(|[a, b]| from.cmplt(*b).all() && to.cmpgt(*a).all())
        );
        taken.push([from, to]);
    }
    let at_edge = label_centre(vec2(390.0, 200.0), half, &frame, &[]);
    assert!(at_edge.x < 390.0);
}

#[test]
fn diffracted_paths_are_counted_apart_from_direct_ones() {
    let line = |order, diffraction_order| PathLine {
        points: vec![Vec3::ZERO, Vec3::X],
        order,
        diffraction_order,
    };
    let view = TopView {
        paths: &[line(0, 0), line(0, 1), line(2, 1), line(2, 0)],
        ..TopView::default()
    };
    let counts: Vec<usize> = (0..KINDS).map(|kind| view.count(kind)).collect();
    assert_eq!(counts, [1, 0, 1, 0, 0, 2]);
}
