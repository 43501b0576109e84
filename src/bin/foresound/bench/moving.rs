//! `bench speed --instances`: an update with moving instances beside one without, on one thread.
//!
//! The listener walks at 1.4 m/s, 20 updates a second; every instance turns and goes to and fro about its place, so all
//! of them move in every update, and moving them is part of its time. The two measurements alternate, update by
//! update, so that whatever else the machine does falls on both alike.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

use std::sync::Arc;
use std::time::Instant;

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourcePose,
    procedural,
};
use foresound::{Error, Result};
use glam::{DVec3, Quat, Vec3};
use serde_json::{Value, json};

use super::sources::sources;
use super::walk::Walk;

/// Seconds between two updates, and metres that the listener walks in them.
const UPDATE_S: f32 = 0.05;
const STEP_M: f32 = 0.07;

/// Fewest updates that a row is made of, however long they take.
const FEWEST: usize = 20;

/// Size of a door, and of the boxes that more than one instance are, in metres.
const DOOR_M: Vec3 = Vec3::new(0.9, 2.1, 0.05);
const BOX_M: Vec3 = Vec3::new(0.8, 0.9, 0.6);

/// Nearest that an instance comes to a source at first, in metres.
const CLEARANCE_M: f32 = 1.5;

/// One row: a scene, a number of sources, a number of instances.
pub(super) fn row(
    name: &str,
    walk: &Walk,
    [source_count, instance_count]: [usize; 2],
    seconds: f64,
) -> Result<Value> {
    let Walk { scene, benchmark } = walk;
    let own: Vec<_> = benchmark.sources.iter().map(|(_, place)| *place).collect();
    let poses = sources(scene, &own, source_count);
    let places = places(scene, &own, &poses, instance_count)?;
    let size = if instance_count == 1 { DOOR_M } else { BOX_M };
    let mesh = procedural::shoebox(size, "wood");
    let part = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    let part = Arc::new(part);
    let settings = PropagationSettings::default();
    let mut without = Propagator::new(Arc::clone(scene), settings)?;
    let mut with = Propagator::new(Arc::clone(scene), settings)?;
    let mut instances = Vec::new();
    for place in places {
        let at = InstancePose::at(InstanceId::default(), place.as_dvec3());
        instances.push((
            with.scene_mut().add_instance(Arc::clone(&part), &at)?,
            place,
        ));
    }
    let length_m = benchmark.walk.from.distance(benchmark.walk.to);
    let ear = |step: usize| {
        let way = (0.5 * length_m + STEP_M * step as f32).rem_euclid(2.0 * length_m);
        let share = 1.0 - (way / length_m - 1.0).abs();
        ListenerPose {
            position: benchmark.walk.from.lerp(benchmark.walk.to, share),
            ..ListenerPose::default()
        }
    };
    without.warm_up(&ear(0), &poses);
    with.warm_up(&ear(0), &poses);
    let (mut times, mut paths) = ([Vec::new(), Vec::new()], [0, 0]);
    let (mut set, mut moved) = (PathSet::default(), Vec::new());
    let started = Instant::now();
    for step in 0.. {
        if step >= FEWEST && started.elapsed().as_secs_f64() > seconds {
            break;
        }
        let ear = ear(step);
        let time = Instant::now();
        without.update(&ear, &poses, 0.0, &mut set);
        times[0].push(1e3 * time.elapsed().as_secs_f64());
        paths[0] += set.paths.len();
        moved.clear();
        let now = instances.iter().zip(0..);
        moved.extend(now.map(|((id, place), n)| pose(*id, *place, n, step as f32 * UPDATE_S)));
        let time = Instant::now();
        with.scene_mut().set_instance_poses(&moved);
        with.update(&ear, &poses, 0.0, &mut set);
        times[1].push(1e3 * time.elapsed().as_secs_f64());
        paths[1] += set.paths.len();
    }
    let updates = times[0].len();
    let at = |share: f64, times: &[f64]| {
        let mut sorted = times.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted[((share * updates as f64) as usize).min(updates - 1)]
    };
    let [fixed, moving] = [0, 1].map(|k| (at(0.1, &times[k]), at(0.5, &times[k])));
    Ok(json!({
        "scene": name,
        "sources": source_count,
        "instances": instance_count,
        "updates": updates,
        "fixed_ms": {"p10": fixed.0, "p50": fixed.1},
        "moving_ms": {"p10": moving.0, "p50": moving.1},
        "ratio_p10": moving.0 / fixed.0,
        "ratio_p50": moving.1 / fixed.1,
        "paths_fixed": paths[0] as f64 / updates as f64,
        "paths_moving": paths[1] as f64 / updates as f64,
    }))
}

/// Open places away from the sources.
fn places(
    scene: &Arc<Scene>,
    own: &[Vec3],
    poses: &[SourcePose],
    count: usize,
) -> Result<Vec<Vec3>> {
    let open = sources(scene, own, 2 * own.len() + 4 * count);
    let clear = |place: &Vec3| {
        let mut away = poses.iter().map(|pose| pose.position.distance(*place));
        away.all(|m| m > CLEARANCE_M)
    };
    let found: Vec<Vec3> = open
        .iter()
        .map(|pose| pose.position)
        .filter(clear)
        .take(count)
        .collect();
    if found.len() < count {
        let problem = format!("{count} do not fit into the scene's open space");
        return Err(Error::setting("--instances", problem, "choose fewer"));
    }
    Ok(found)
}

/// An instance at a time: it turns about the vertical through its corner and slides half a metre to and fro.
fn pose(id: InstanceId, place: Vec3, number: usize, time_s: f32) -> InstancePose {
    let phase = time_s + number as f32;
    InstancePose {
        id,
        position: place.as_dvec3() + DVec3::X * f64::from(0.5 * phase.sin()),
        rotation: Quat::from_rotation_y(0.7 * phase),
    }
}

pub(super) fn print(row: &Value) {
    let number = |key: &str| row.pointer(key).and_then(Value::as_f64).unwrap_or(0.0);
    println!(
        "{:14} {:4} sources, {:4} instances: {:8.2} ms, without {:8.2}; {:.3} x (fast updates {:.3} x), {:4.0} paths, without {:4.0}",
        row["scene"].as_str().unwrap_or_default(),
        row["sources"],
        row["instances"],
        number("/moving_ms/p50"),
        number("/fixed_ms/p50"),
        number("/ratio_p50"),
        number("/ratio_p10"),
        number("/paths_moving"),
        number("/paths_fixed"),
    );
}
