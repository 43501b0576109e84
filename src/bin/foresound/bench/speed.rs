//! `bench speed`: one propagation update on one thread and on two, beside its own rays cast alone.
//!
//! Growth stands in the rows: a row's fastest update over that of its scene's first row, as a share of what as many times
//! the sources would cost (1 is linear), and over that of the first scene with as many sources.
//!
//! The listener walks at 1.4 m/s, 20 updates a second. The three measurements alternate, update by update, so that
//! whatever else the machine does falls on all of them alike.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use foresound::Result;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use serde_json::{Value, json};

use super::moving;
use super::own_rays::OwnRays;
use super::walk::Walk;

/// Fewest updates that a row is made of, however long they take.
const FEWEST: usize = 5;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scenes by name, or `million` (the three of the paper's kind, if not given).
    #[arg(long, value_delimiter = ',')]
    scene: Vec<String>,
    /// Numbers of sources.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 4, 8, 16])]
    sources: Vec<usize>,
    /// Seconds that each row takes.
    #[arg(long, default_value_t = 2.0)]
    seconds: f64,
    /// Milliseconds of the caller's own work in a graphics frame; counts for whole frames only.
    #[arg(long, value_name = "MS", default_value_t = 0.0)]
    graphics_ms: f64,
    /// Numbers of moving instances: rows of updates with them beside updates without, instead.
    #[arg(long, value_name = "N", value_delimiter = ',')]
    instances: Vec<usize>,
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

/// The fastest update of a row, for what grows out of it.
struct Fastest {
    sources: usize,
    ms: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let scenes: Vec<&str> = match arguments.scene.is_empty() {
        false => arguments.scene.iter().map(String::as_str).collect(),
        true => vec!["concert_hall", "bootcamp", "angrybot"],
    };
    let mut rows = Vec::new();
    let mut first_scene: Vec<Fastest> = Vec::new();
    for (number, name) in scenes.into_iter().enumerate() {
        let walk = Walk::through(name)?;
        for (&count, &moving) in arguments.sources.iter().flat_map(|count| {
            let instances = arguments.instances.iter();
            instances.map(move |instances| (count, instances))
        }) {
            let row = moving::row(name, &walk, [count, moving], arguments.seconds)?;
            if !arguments.json {
                moving::print(&row);
            }
            rows.push(row);
        }
        let mut fewest: Option<Fastest> = None;
        let fixed = arguments.sources.iter();
        for &count in fixed.filter(|_| arguments.instances.is_empty()) {
            let times = measure(&walk, count, arguments.seconds)?;
            let mut row = times.row(name, count, arguments.graphics_ms);
            let ms = share(&times.one, 0.0);
            let fewest = fewest.get_or_insert(Fastest { sources: count, ms });
            let linear = fewest.ms * count as f64 / fewest.sources as f64;
            row["triangles"] = json!(walk.scene.bvh().triangle_count());
            row["to_linear_in_sources"] = json!(ms / linear);
            if number == 0 {
                first_scene.push(Fastest { sources: count, ms });
            }
            let same = first_scene.iter().find(|first| first.sources == count);
            row["to_first_scene"] = json!(same.map(|first| ms / first.ms));
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

fn measure(walk: &Walk, count: usize, seconds: f64) -> Result<Times> {
    let settings = PropagationSettings::default();
    let scene = &walk.scene;
    let sources = walk.sources(count)?;
    let threads = Threads::start(2)?;
    let mut one = Propagator::new(Arc::clone(scene), settings)?;
    let mut two = Propagator::new(Arc::clone(scene), settings)?;
    one.warm_up(&walk.ear(0), &sources);
    two.warm_up(&walk.ear(0), &sources);
    let (mut set, mut other) = (PathSet::default(), PathSet::default());
    let mut times = Times::default();
    let started = Instant::now();
    for step in 0.. {
        if step >= FEWEST && started.elapsed().as_secs_f64() > seconds {
            break;
        }
        let ear = walk.ear(step);
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
            "two_threads_speedup": one / share(&self.two, 0.0),
            "paths_p50": share(&self.paths, 0.5),
            "rays_per_update": share(&self.rays, 0.5),
        })
    }
}

/// The value that a share of the others does not exceed.
fn share(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = (share * sorted.len() as f64) as usize;
    sorted.get(place).or(sorted.last()).copied().unwrap_or(0.0)
}

fn print(row: &Value) {
    let number = |key: &str| row.pointer(key).and_then(Value::as_f64).unwrap_or(0.0);
    println!(
        "{:14} {:4} sources: {:8.2} ms (p95 {:8.2}), two threads {:8.2} (best {:.2} x faster), rays alone {:8.2} (best {:.2} x), {:6.0} rays, {:5.0} paths, {:.2} of linear growth, {:.2} of the first scene",
        row["scene"].as_str().unwrap_or_default(),
        row["sources"],
        number("/sps_ms/p50"),
        number("/sps_ms/p95"),
        number("/sps_two_threads_ms/p50"),
        number("/two_threads_speedup"),
        number("/rays_alone_ms"),
        number("/update_to_rays"),
        number("/rays_per_update"),
        number("/paths_p50"),
        number("/to_linear_in_sources"),
        number("/to_first_scene"),
    );
}
