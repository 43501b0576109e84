//! Laws of the motions: speeds, repeatability, room.

use super::*;
use crate::open_space::{clear_m, hits};
use foresound::scene::{MaterialTable, SceneSettings, procedural};

const DURATION_S: f64 = 10.0;

/// Steps a second in which tracks are followed.
const STEPS_HZ: f64 = 149.2;

struct Stage {
    name: &'static str,
    scene: Scene,
    floor: ReachableFloor,
    walk: Walk,
    sources: Vec<Vec3>,
}

fn stages() -> Vec<Stage> {
    let stage = |name| {
        let benchmark = procedural::by_name(name).unwrap();
        let settings = SceneSettings::default();
        let scene = Scene::commit(&benchmark.mesh, &MaterialTable::built_in(), &settings).unwrap();
        let [from, to] = [benchmark.walk.from, benchmark.walk.to];
        let walk = Walk {
            from,
            to,
            speed_m_s: 1.4,
            standing: from.midpoint(to),
        };
        Stage {
            name,
            floor: ReachableFloor::around(&scene, walk.standing).unwrap(),
            scene,
            walk,
            sources: benchmark.sources.iter().take(4).map(|s| s.1).collect(),
        }
    };
    procedural::NAMES.map(stage).into()
}

impl Stage {
    fn moves(&self, condition: Condition, seed: u64) -> Moves {
        let place = Place {
            scene: &self.scene,
            floor: &self.floor,
            walk: &self.walk,
            sources: &self.sources,
        };
        Moves::of(condition, &place, 2.0, DURATION_S, seed).unwrap()
    }
}

/// Largest speed of a track in m/s and of its yaw in rad/s, without its jumps, and the length of its way in metres.
fn speeds(track: &Track, jumps_s: &[f64]) -> [f64; 3] {
    let mut most = [0.0f64; 3];
    let steps = (DURATION_S * STEPS_HZ) as u32;
    for step in 1..=steps {
        let [before, now] = [step - 1, step].map(|step| f64::from(step) / STEPS_HZ);
        let jumps = jumps_s.iter().any(|at| (before..=now).contains(at));
        if jumps {
            continue;
        }
        let moved = track.position_at(before).distance(track.position_at(now));
        let turned = (track.yaw_at(now) - track.yaw_at(before)).abs();
        most[0] = most[0].max(f64::from(moved) * STEPS_HZ);
        most[1] = most[1].max(f64::from(turned) * STEPS_HZ);
        most[2] += f64::from(moved);
    }
    most
}

/// Follows a track through its scene.
fn assert_is_in_open_space(stage: &Stage, track: &Track, jumps_s: &[f64], what: &str) {
    let steps = (DURATION_S * STEPS_HZ) as u32;
    for step in 1..=steps {
        let [before, now] = [step - 1, step].map(|step| f64::from(step) / STEPS_HZ);
        let [from, to] = [before, now].map(|time_s| track.position_at(time_s));
        let jumps = jumps_s.iter().any(|at| (before..=now).contains(at));
        assert!(
            jumps || from == to || !hits(&stage.scene, from, to),
            "{} {what}: a surface between {from} and {to} at {now} s",
            stage.name
        );
    }
}

/// Rounding of single precision at these coordinates, as a factor on speeds over one step.
const SLACK: f64 = 1.01;

#[test]
fn motions_keep_to_open_space_and_to_their_speeds() {
    for stage in stages() {
        for seed in 1..=3 {
            for condition in Condition::UNPREDICTED {
                let moves = stage.moves(condition, seed);
                assert_eq!(moves, stage.moves(condition, seed), "the same seed");
                assert_ne!(moves, stage.moves(condition, seed + 10), "another seed");
                let name = condition.name();
                let uphill = f64::from(1.0 + reachable_floor::STEEPEST.powi(2)).sqrt();
                let [most_m_s, least_way_m] = match condition {
                    Condition::Restless => [1.8 * uphill, 3.0],
                    Condition::Dash => [5.0, 30.0],
                    Condition::Irregular => [2.0, 1.0],
                    Condition::Teleport => [1.4 * uphill, 3.0],
                    _ => [0.0, 0.0],
                };
                let tracks = moves.listener.iter().chain(&moves.sources);
                for (index, track) in tracks.enumerate() {
                    let [speed, yaw, way] = speeds(track, &moves.jumps_s);
                    let what = format!("{} {name} {seed}, track {index}", stage.name);
                    assert!(speed <= SLACK * most_m_s, "{what}: {speed} m/s");
                    assert!(yaw <= SLACK * std::f64::consts::PI, "{what}: {yaw} rad/s");
                    assert!(way >= least_way_m, "{what}: {way} m");
                    assert_is_in_open_space(&stage, track, &moves.jumps_s, &what);
                }
            }
        }
    }
}

#[test]
fn jumps_come_in_time_and_lead_elsewhere() {
    for stage in stages() {
        for (condition, every_s) in [
            (Condition::Teleport, jumps::TELEPORT_S),
            (Condition::Jump, jumps::JUMP_S),
        ] {
            let moves = stage.moves(condition, 5);
            let expected = (1..).map(|n| f64::from(n) * every_s);
            let expected: Vec<f64> = expected.take_while(|at| *at < DURATION_S).collect();
            assert_eq!(moves.jumps_s, expected);
            let tracks: Vec<&Track> = moves.listener.iter().chain(&moves.sources).collect();
            for &at in &moves.jumps_s {
                let far = |track: &&&Track| {
                    let before = track.position_at(at - 1e-6);
                    before.distance(track.position_at(at)) > 2.9
                };
                let count = tracks.iter().filter(far).count();
                assert_eq!(count, 1, "{} {} at {at} s", stage.name, condition.name());
            }
        }
    }
}

#[test]
fn a_dash_leaves_what_it_sees() {
    // Out of sight of where it started, in the scenes with walls.
    for stage in stages() {
        let moves = stage.moves(Condition::Dash, 1);
        let track = moves.listener.unwrap();
        let start = track.position_at(0.0);
        let hidden =
            (0..100).filter(|k| hits(&stage.scene, start, track.position_at(0.1 * f64::from(*k))));
        let count = hidden.count();
        assert!(
            stage.name == "concert_hall" || count > 10,
            "{}: {count}",
            stage.name
        );
    }
}

#[test]
fn restless_listeners_stop_and_turn() {
    for stage in stages() {
        let track = stage.moves(Condition::Restless, 1).listener.unwrap();
        let rests = (1..1000)
            .map(|k| 0.01 * f64::from(k))
            .filter(|at| track.position_at(at - 0.01) == track.position_at(*at))
            .count();
        assert!((50..900).contains(&rests), "{}: {rests}", stage.name);
        let turned: f32 = (1..1000)
            .map(|k| 0.01 * f64::from(k))
            .map(|at| (track.yaw_at(at) - track.yaw_at(at - 0.01)).abs())
            .sum();
        assert!(turned > 5.0, "{turned} rad");
    }
}

#[test]
fn irregular_sources_have_room() {
    for stage in stages() {
        for track in stage.moves(Condition::Irregular, 1).sources {
            let ranged = (0..1000).map(|k| {
                let at = track.position_at(0.01 * f64::from(k));
                [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z]
                    .map(|side| clear_m(&stage.scene, at, side))
                    .into_iter()
                    .fold(f32::MAX, f32::min)
            });
            let nearest = ranged.fold(f32::MAX, f32::min);
            assert!(nearest > 0.05, "{}: {nearest} m", stage.name);
        }
    }
}
