//! `bench speed`: one propagation update on one thread and on two, beside its own rays cast alone.
//!
//! The listener walks at 1.4 m/s, 20 updates a second. The three measurements alternate, update by update, so that
//! whatever else the machine does falls on all of them alike.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, procedural};
use foresound::{Error, Result};
use serde_json::{Value, json};

use super::own_rays::OwnRays;
use super::share;
use super::sources::sources;

/// Metres between two updates.
const STEP_M: f32 = 0.07;

/// Fewest updates that a row is made of, however long they take.
const FEWEST: usize = 5;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scene by name, or `million` (the three of the paper's kind, if not given).
    #[arg(long)]
    scene: Option<String>,
    /// Numbers of sources.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 4, 8, 16])]
    sources: Vec<usize>,
    /// Seconds that each row takes.
    #[arg(long, default_value_t = 2.0)]
    seconds: f64,
    /// Milliseconds of the caller's own work in a graphics frame; counts for whole frames only.
    #[arg(long, value_name = "MS", default_value_t = 0.0)]
    graphics_ms: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// What one row has measured, in milliseconds.
#[derive(Default)]
struct Times {
    one: Vec<f64>,
    two: Vec<f64>,
    alone: Vec<f64>,
    paths: Vec<f64>,
    rays: Vec<f64>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let scenes = match &arguments.scene {
        Some(scene) => vec![scene.as_str()],
        None => vec!["concert_hall", "bootcamp", "angrybot"],
    };
    let mut rows = Vec::new();
    for name in scenes {
        let benchmark = match name {
            "million" => procedural::million(),
            _ => procedural::by_name(name).ok_or_else(|| {
                let known = procedural::NAMES.join(", ");
                let problem = format!("no benchmark scene is called {name:?}");
                Error::setting("--scene", problem, &format!("choose of: {known}, million"))
            })?,
        };
        let table = MaterialTable::built_in();
        let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default())?;
        let scene = Arc::new(scene);
        for &count in &arguments.sources {
            let times = measure(&scene, &benchmark, count, arguments.seconds)?;
            let row = times.row(name, count, arguments.graphics_ms);
            if !arguments.json {
                print(&row);
            }
            rows.push(row);
        }
    }
    if arguments.json {
        let threads = std::thread::available_parallelism().map_or(0, usize::from);
        let machine = json!({
            "arch": std::env::consts::ARCH,
            "os": std::env::consts::OS,
            "threads": threads,
        });
        println!("{}", json!({ "rows": rows, "machine": machine }));
    }
    Ok(())
}

fn measure(
    scene: &Arc<Scene>,
    benchmark: &procedural::BenchmarkScene,
    count: usize,
    seconds: f64,
) -> Result<Times> {
    let settings = PropagationSettings::default();
    let own: Vec<_> = benchmark.sources.iter().map(|(_, place)| *place).collect();
    let sources = sources(scene, &own, count);
    if sources.len() < count {
        let problem = format!("{count} do not fit into the scene's open space");
        return Err(Error::setting("--sources", problem, "choose fewer"));
    }
    let threads = Threads::start(2)?;
    let mut one = Propagator::new(Arc::clone(scene), settings)?;
    let mut two = Propagator::new(Arc::clone(scene), settings)?;
    let length_m = benchmark.walk.from.distance(benchmark.walk.to);
    let ear = |step: usize| {
        let way = (0.5 * length_m + STEP_M * step as f32).rem_euclid(2.0 * length_m);
        let share = 1.0 - (way / length_m - 1.0).abs();
        ListenerPose {
            position: benchmark.walk.from.lerp(benchmark.walk.to, share),
            ..ListenerPose::default()
        }
    };
    one.warm_up(&ear(0), &sources);
    two.warm_up(&ear(0), &sources);
    let (mut set, mut other) = (PathSet::default(), PathSet::default());
    let mut times = Times::default();
    let started = Instant::now();
    for step in 0.. {
        if step >= FEWEST && started.elapsed().as_secs_f64() > seconds {
            break;
        }
        let ear = ear(step);
        let time = Instant::now();
        one.update(&ear, &sources, 0.0, &mut set);
        times.one.push(ms(time.elapsed()));
        let time = Instant::now();
        two.update_with(&threads, &ear, &sources, 0.0, &mut other);
        times.two.push(ms(time.elapsed()));
        let rays = OwnRays::of(scene, &settings, &set);
        let time = Instant::now();
        std::hint::black_box(rays.cast(scene));
        times.alone.push(ms(time.elapsed()));
        times.paths.push(set.paths.len() as f64);
        times.rays.push(set.rays as f64);
    }
    Ok(times)
}

fn ms(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

impl Times {
    fn row(&self, scene: &str, sources: usize, graphics_ms: f64) -> Value {
        let both = |values: &[f64]| json!({"p50": share(values, 0.5), "p95": share(values, 0.95)});
        // The fastest of each: on a busy machine the middle one tells how often it was put off.
        let (one, alone) = (share(&self.one, 0.0), share(&self.alone, 0.0));
        json!({
            "scene": scene,
            "sources": sources,
            "graphics_ms": graphics_ms,
            "sps_ms": both(&self.one),
            "sps_two_threads_ms": both(&self.two),
            "rays_alone_ms": share(&self.alone, 0.5),
            "sps_best_ms": one,
            "sps_two_threads_best_ms": share(&self.two, 0.0),
            "rays_alone_best_ms": alone,
            "update_to_rays": one / alone,
            "paths_p50": share(&self.paths, 0.5),
            "rays_per_update": share(&self.rays, 0.5),
        })
    }
}

fn print(row: &Value) {
    let number = |key: &str| row.pointer(key).and_then(Value::as_f64).unwrap_or(0.0);
    println!(
        "{:14} {:4} sources: {:8.2} ms (p95 {:8.2}), two threads {:8.2}, rays alone {:8.2} (best {:.2} x), {:6.0} rays, {:5.0} paths",
        row["scene"].as_str().unwrap_or_default(),
        row["sources"],
        number("/sps_ms/p50"),
        number("/sps_ms/p95"),
        number("/sps_two_threads_ms/p50"),
        number("/rays_alone_ms"),
        number("/update_to_rays"),
        number("/rays_per_update"),
        number("/paths_p50"),
    );
}
