//! `bench speed`: the engine's two schedules ([`super::schedules`]), and one propagation update on one thread and on two,
//! beside its own rays cast alone.
//!
//! Of the updates alone:
//! The listener walks at 1.4 m/s, 20 updates a second. The three measurements alternate, update by update, so that
//! whatever else the machine does falls on all of them alike.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use foresound::evaluation::cells::{Platform, SCENES, SOURCE_COUNTS, pace};
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::{Budget, Threads, Tier, TierChoice, TraceLog};
use foresound::scene::layout::Walk;
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourcePose, procedural};
use foresound::{Error, Result};
use serde_json::{Value, json};

use super::own_rays::OwnRays;
use super::schedules::{Cell, loaded};
use super::share;
use super::sources::sources;
use crate::inputs::predictor_named;
use crate::traces::write_trace;

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
    /// Milliseconds of the caller's own work in a graphics frame.
    #[arg(long, value_name = "MS", default_value_t = 0.0)]
    graphics_ms: f64,
    /// Factor on the paper's ray counts, 0.01 to 64.
    #[arg(
        long,
        value_name = "K",
        default_value_t = 1.0,
        conflicts_with = "level"
    )]
    load: f64,
    /// Chooses the load that gives this level L: a number, or `workstation` or `mobile` for the paper's of each cell.
    #[arg(long, value_name = "L")]
    level: Option<String>,
    /// Predictor of the asynchronous schedule: hold, linear or best.
    #[arg(long, default_value = "linear")]
    predictor: String,
    /// Tier of detail, 0 (everything) to 5.
    #[arg(long, default_value_t = 0)]
    tier: u8,
    /// Leave propagation updates by themselves out.
    #[arg(long)]
    schedules_only: bool,
    /// Write what every thread did when, for Perfetto.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
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
    let mut log = TraceLog::default();
    let predictor = predictor_named(&arguments.predictor)?;
    if !(0.01..=64.0).contains(&arguments.load) {
        let problem = format!("{} is outside 0.01 to 64", arguments.load);
        return Err(Error::setting(
            "--load",
            problem,
            "choose a factor in that range",
        ));
    }
    if !(0.0..=1000.0).contains(&arguments.graphics_ms) {
        let problem = format!("{} is outside 0 to 1000", arguments.graphics_ms);
        return Err(Error::setting(
            "--graphics-ms",
            problem,
            "choose a time in that range",
        ));
    }
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
            let places = places(&scene, &benchmark, count)?;
            let cell = Cell {
                scene: &scene,
                walk: Walk {
                    from: benchmark.walk.from,
                    to: benchmark.walk.to,
                    speed_m_s: benchmark.walk.speed_m_s.into(),
                    standing: benchmark.walk.standing,
                },
                sources: &places,
                predictor,
                budget: Budget {
                    tiers: TierChoice::Exactly(Tier(arguments.tier)),
                    ..Budget::default()
                },
                graphics_ms: arguments.graphics_ms,
                seconds: arguments.seconds,
                trace: arguments.trace.is_some(),
            };
            let load = match wanted_level(arguments, name, count)? {
                Some(level) => cell.load_for(level, 64.0)?,
                None => arguments.load,
            };
            let engine = cell.measure(load, &mut log)?;
            let mut row = match arguments.schedules_only {
                true => {
                    json!({"scene": name, "sources": count, "graphics_ms": arguments.graphics_ms})
                }
                false => measure(&scene, &benchmark, &places, loaded(load), arguments.seconds)?
                    .row(name, count, arguments.graphics_ms),
            };
            if let Some(row) = row.as_object_mut() {
                row.extend(engine);
            }
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
    match &arguments.trace {
        Some(file) => write_trace(file, &log),
        None => Ok(()),
    }
}

/// The level asked for in a cell.
fn wanted_level(arguments: &Arguments, scene: &str, sources: usize) -> Result<Option<u32>> {
    let Some(text) = &arguments.level else {
        return Ok(None);
    };
    let platform = match text.as_str() {
        "workstation" => Platform::Workstation,
        "mobile" => Platform::Mobile,
        number => {
            let level = number.parse().ok().filter(|level| *level <= 1000);
            let advice = "give a number to 1000, workstation or mobile";
            let problem = format!("{number:?} is no level");
            return level
                .map(Some)
                .ok_or_else(|| Error::setting("--level", problem, advice));
        }
    };
    if SCENES.contains(&scene) && SOURCE_COUNTS.contains(&sources) {
        return Ok(Some(pace(platform, scene, sources).level));
    }
    let problem = format!("the paper has no {scene} with {sources} sources");
    Err(Error::setting("--level", problem, "give a number"))
}

fn places(
    scene: &Scene,
    benchmark: &procedural::BenchmarkScene,
    count: usize,
) -> Result<Vec<SourcePose>> {
    let own: Vec<_> = benchmark.sources.iter().map(|(_, place)| *place).collect();
    let places = sources(scene, &own, count);
    if places.len() < count {
        let problem = format!("{count} do not fit into the scene's open space");
        return Err(Error::setting("--sources", problem, "choose fewer"));
    }
    Ok(places)
}

fn measure(
    scene: &Arc<Scene>,
    benchmark: &procedural::BenchmarkScene,
    sources: &[SourcePose],
    settings: PropagationSettings,
    seconds: f64,
) -> Result<Times> {
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
    one.warm_up(&ear(0), sources);
    two.warm_up(&ear(0), sources);
    let (mut set, mut other) = (PathSet::default(), PathSet::default());
    let mut times = Times::default();
    let started = Instant::now();
    for step in 0.. {
        if step >= FEWEST && started.elapsed().as_secs_f64() > seconds {
            break;
        }
        let ear = ear(step);
        let time = Instant::now();
        one.update(&ear, sources, 0.0, &mut set);
        times.one.push(ms(time.elapsed()));
        let time = Instant::now();
        two.update_with(&threads, &ear, sources, 0.0, &mut other);
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
        "{:14} {:4} sources: {:8.1} FPS synchronous, {:8.1} asynchronous ({:5.2} x), L {:3.0}, T_SPS {:8.2} ms (p95 {:8.2}), {:6.0} rays, {:5.0} paths; a frame: direct {:.0}, EPS {:.0}, SGS {:.0} us",
        row["scene"].as_str().unwrap_or_default(),
        row["sources"],
        number("/sync_fps"),
        number("/async_fps"),
        number("/speedup"),
        number("/level/p50"),
        number("/sps_ms/p50"),
        number("/sps_ms/p95"),
        number("/rays_per_update"),
        number("/paths_p50"),
        number("/direct_us/p50"),
        number("/eps_us/p50"),
        number("/sgs_us/p50"),
    );
    if row["sync_fps_by_processor_time"].is_number() {
        println!(
            "{:28}by processor time: {:.1} FPS synchronous, {:.1} asynchronous",
            "",
            number("/sync_fps_by_processor_time"),
            number("/async_fps_by_processor_time"),
        );
    }
    if row.get("rays_alone_ms").is_some() {
        println!(
            "{:28}an update alone: one thread {:.2} ms at best, two {:.2}, its rays {:.2} ({:.2} x)",
            "",
            number("/sps_best_ms"),
            number("/sps_two_threads_best_ms"),
            number("/rays_alone_best_ms"),
            number("/update_to_rays"),
        );
    }
}
