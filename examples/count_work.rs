//! Fixed amounts of tracing and propagation, for tools that count instructions. No clock, no threads.
//!
//! `count_work rays FOLDER SCENE SET PASSES` traces the rays written by `bench rays --dump FOLDER`, `PASSES` times;
//! `count_work update SCENE SOURCES UPDATES [LISTENERS]` runs propagation updates for a listener walking at 1.4 m/s, or for several
//! beside each other; with `walking` or `moving` instead of `update` its sources walk too, or stand metres elsewhere in every update,
//! as in `bench update`; with `standing` nothing moves; `count_work sound SCENE SOURCES UPDATES LISTENERS` runs the whole engine instead;
//! `count_work direct SCENE SOURCES UPDATES` computes the direct field of twelve graphics frames after each of so many updates, as the
//! default predictor does, and `count_work edges` only those updates; the scene
//! `shoebox` has no edges. The difference of two runs with different counts excludes start-up (`benches/count-aarch64.sh`).

use std::fs;
use std::sync::Arc;

use foresound::extrapolation::{Extrapolator, FramePaths, PredictorKind};
use foresound::geometry::bvh::NO_GROUP;
use foresound::geometry::{Bvh, Ray};
use foresound::glam::Vec3;
use foresound::paths::{PathSet, Propagator};
use foresound::scene::procedural;
use foresound::{
    Engine, EngineSchedule, EngineSettings, FrameTime, ListenerPose, MaterialTable,
    PropagationSettings, Scene, SceneSettings, SourceId, SourcePose,
};

/// Metres between two updates, at twenty a second.
const STEP_M: f32 = 0.07;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        ["rays", folder, scene, set, passes] => rays(folder, scene, set, passes.parse()?),
        [motion @ ("update" | "standing" | "walking" | "moving"), scene, sources, updates] => {
            let ends = (sources.parse()?, updates.parse()?);
            update(scene, ends, 1, motion)
        }
        ["update", scene, sources, updates, listeners] => {
            let ends = (sources.parse()?, updates.parse()?);
            update(scene, ends, listeners.parse()?, "update")
        }
        ["sound", scene, sources, updates, listeners] => {
            sound(scene, sources.parse()?, updates.parse()?, listeners.parse()?)
        }
        ["direct", scene, sources, updates] => direct(scene, sources.parse()?, updates.parse()?, 12),
        ["edges", scene, sources, updates] => direct(scene, sources.parse()?, updates.parse()?, 0),
        _ => Err("arguments: rays FOLDER SCENE SET PASSES | update SCENE SOURCES UPDATES [LISTENERS] | standing SCENE SOURCES UPDATES | walking SCENE SOURCES UPDATES | moving SCENE SOURCES UPDATES | sound SCENE SOURCES UPDATES LISTENERS | direct SCENE SOURCES UPDATES | edges SCENE SOURCES UPDATES".into()),
    }
}

fn rays(
    folder: &str,
    scene: &str,
    set: &str,
    passes: u32,
) -> Result<(), Box<dyn std::error::Error>> {
    let floats = |name: &str| -> std::io::Result<Vec<f32>> {
        let bytes = fs::read(format!("{folder}/{scene}-{name}.f32"))?;
        let (values, _) = bytes.as_chunks::<4>();
        Ok(values.iter().map(|b| f32::from_le_bytes(*b)).collect())
    };
    let corners = floats("triangles")?;
    let (corners, _) = corners.as_chunks::<3>();
    let vertices: Vec<Vec3> = corners.iter().map(|c| Vec3::from_array(*c)).collect();
    let triangles: Vec<[u32; 3]> = (0..vertices.len() as u32 / 3)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    let tree = Bvh::build(&vertices, &triangles, &vec![0; triangles.len()]);
    let values = floats(set)?;
    let (values, _) = values.as_chunks::<7>();
    let rays: Vec<Ray> = values
        .iter()
        .map(|&[ox, oy, oz, dx, dy, dz, t_max]| Ray {
            t_max,
            ..Ray::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz))
        })
        .collect();
    let any = set == "visibility";
    let hits = |ray: &&Ray| match any {
        true => tree.any_hit(ray, [NO_GROUP; 2]),
        false => tree.closest_hit(ray, [NO_GROUP; 2]).is_some(),
    };
    let hits: usize = (0..passes).map(|_| rays.iter().filter(hits).count()).sum();
    eprintln!("{} rays, {hits} hits", rays.len());
    Ok(())
}

/// Metres between two listeners.
const APART_M: f32 = 2.0;

/// A walk of several listeners beside each other.
fn ear(walk: &procedural::Walk, step: u32, listener: usize) -> ListenerPose {
    let length_m = walk.from.distance(walk.to);
    let along = (walk.to - walk.from) / length_m;
    let aside = Vec3::new(-along.z, 0.0, along.x) * APART_M * listener as f32;
    let share = (0.5 + STEP_M * step as f32 / length_m).min(1.0);
    ListenerPose {
        position: walk.from.lerp(walk.to, share) + aside,
        ..ListenerPose::default()
    }
}

/// The engine with propagation in every graphics frame, at twenty a second: propagation, extrapolation and generation.
fn sound(
    name: &str,
    count: usize,
    updates: u32,
    listeners: usize,
) -> Result<(), Box<dyn std::error::Error>> {
    let benchmark = procedural::by_name(name).ok_or("no such scene")?;
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default())?;
    let mut settings = EngineSettings::default();
    settings.schedule = EngineSchedule::Synchronous;
    settings.tracing_threads = 1;
    settings.frame_time = FrameTime::Fixed(0.05);
    settings.generation.listeners = listeners;
    let (mut controller, mut renderer) = Engine::new(settings)?;
    controller.set_scene(Arc::new(scene))?;
    for (n, (_, position)) in benchmark.sources.iter().take(count).enumerate() {
        let id = controller.add_source(*position)?;
        let noise = (0..44_100u32)
            .map(|k| (k.wrapping_mul(2_654_435_761 + n as u32) >> 16) as f32 / 65_536.0 - 0.5);
        controller.play(id, noise.collect(), true)?;
    }
    let frames = 44_100 / 20;
    let mut output = vec![0.0; 2 * listeners * frames];
    for step in 0..updates {
        for listener in 1..listeners {
            controller.set_listener(listener, ear(&benchmark.walk, step, listener))?;
        }
        controller.tick(ear(&benchmark.walk, step, 0), &[])?;
        renderer.render_listeners(&mut output);
    }
    eprintln!(
        "{listeners} listeners, {} paths of the first",
        controller.statistics().paths
    );
    Ok(())
}

/// How far the sources have moved.
fn aside_m(motion: &str, step: u32) -> f32 {
    match motion {
        "walking" => STEP_M * step.saturating_sub(2) as f32,
        "moving" if step.is_multiple_of(2) => 1.1,
        "moving" => -1.1,
        _ => 0.0,
    }
}

fn update(
    name: &str,
    (count, updates): (usize, u32),
    listeners: usize,
    motion: &str,
) -> Result<(), Box<dyn std::error::Error>> {
    let benchmark = procedural::by_name(name).ok_or("no such scene")?;
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default())?;
    let mut propagator = Propagator::new(Arc::new(scene), PropagationSettings::default())?;
    let sources: Vec<SourcePose> = (0..)
        .zip(benchmark.sources.iter().take(count))
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot, 0), *position))
        .collect();
    let walk = &benchmark.walk;
    let mut set = PathSet::default();
    propagator.set_listener_count(listeners);
    for listener in 0..listeners {
        propagator.select_listener(listener);
        propagator.warm_up(&ear(walk, 0, listener), &sources);
    }
    let mut moved = sources.clone();
    for step in 0..updates {
        // What is at rest needs no time.
        let time_s = match motion {
            "update" => 0.0,
            _ => 0.05 * f64::from(step),
        };
        for (moved, source) in moved.iter_mut().zip(&sources) {
            moved.position.x = source.position.x + aside_m(motion, step);
        }
        for listener in 0..listeners {
            propagator.select_listener(listener);
            let step = if motion == "standing" { 0 } else { step };
            propagator.update(&ear(walk, step, listener), &moved, time_s, &mut set);
        }
    }
    eprintln!("{} sources, {} paths", sources.len(), set.paths.len());
    Ok(())
}

/// The sources and the walk of the hall in a room without edges.
fn without_edges() -> procedural::BenchmarkScene {
    let size = Vec3::new(40.0, 20.0, 60.0);
    let mut benchmark = procedural::concert_hall();
    let middle = benchmark.walk.from.midpoint(benchmark.walk.to);
    let mut mesh = procedural::shoebox(size, "concrete");
    for vertex in &mut mesh.vertices {
        *vertex += middle - 0.5 * size;
    }
    benchmark.mesh = mesh;
    benchmark
}

/// The direct field of graphics frames by itself: each update is stored without its paths and late energy.
fn direct(
    name: &str,
    count: usize,
    updates: u32,
    frames: u32,
) -> Result<(), Box<dyn std::error::Error>> {
    let benchmark = match name {
        "shoebox" => without_edges(),
        _ => procedural::by_name(name).ok_or("no such scene")?,
    };
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default())?;
    let scene = Arc::new(scene);
    let settings = PropagationSettings {
        guide_rays: 1,
        source_rays: 1,
        ..PropagationSettings::default()
    };
    let min_distance_m = settings.min_distance_m;
    let mut propagator = Propagator::new(Arc::clone(&scene), settings)?;
    let sources: Vec<SourcePose> = (0..)
        .zip(benchmark.sources.iter().take(count))
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot, 0), *position))
        .collect();
    let walk = &benchmark.walk;
    let mut extrapolator = Extrapolator::new(scene, PredictorKind::default(), min_distance_m);
    let (mut frame, mut digest, mut edges) = (FramePaths::default(), 0u64, 0);
    for step in 0..updates {
        let mut set = PathSet::default();
        propagator.update(&ear(walk, step, 0), &sources, 0.0, &mut set);
        set.paths.clear();
        set.late.clear();
        edges += set.direct_edges.len();
        extrapolator.store_update(set, 12);
        for part in 0..frames {
            let [from, to] = [0, 1].map(|next| ear(walk, step + next, 0));
            let share = part as f32 / frames as f32;
            let listener = ListenerPose {
                position: from.position.lerp(to.position, share),
                ..from
            };
            extrapolator.frame(&listener, &sources, &mut frame);
            let bits = frame.paths.iter().flat_map(|path| path.amplitude);
            for value in bits {
                digest = (digest.rotate_left(5) ^ u64::from(value.to_bits()))
                    .wrapping_mul(0x9e37_79b9_7f4a_7c15);
            }
        }
    }
    let edges = edges as f64 / f64::from(updates) / sources.len() as f64;
    eprintln!("{edges:.2} edges a source, digest {digest:016x}");
    Ok(())
}
