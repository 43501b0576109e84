//! `bench speed --instances`: an update with moving instances beside one without, on one thread.
//!
//! The listener walks at 1.4 m/s, 20 updates a second; all instances move in every update, and moving them is part of its
//! time. Sources rest, so that without instances their rays are remembered; beside that the same with sources that
//! move, so that either has all rays to cast. The measurements alternate, update by update, so that whatever else the
//! machine does falls on all alike.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

use std::sync::Arc;
use std::time::Instant;

use foresound::Result;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::SourcePose;
use serde_json::{Value, json};

use super::alone::step_aside;
use super::boxes::Boxes;
use super::share;
use super::walk::Walk;

/// Fewest updates that a row is made of, however long they take.
const FEWEST: usize = 20;

/// One of the things that are compared.
struct Runner {
    propagator: Propagator,
    boxes: Boxes,
    times_ms: Vec<f64>,
    paths: usize,
}

impl Runner {
    /// With `count` instances, at the walk's first place.
    fn new(walk: &Walk, sources: &[SourcePose], count: usize) -> Result<Self> {
        let settings = PropagationSettings::default();
        let mut propagator = Propagator::new(Arc::clone(&walk.scene), settings)?;
        let boxes = Boxes::add(&mut propagator, walk, sources, count)?;
        propagator.warm_up(&walk.ear(0), sources);
        Ok(Self {
            propagator,
            boxes,
            times_ms: Vec::new(),
            paths: 0,
        })
    }

    fn update(&mut self, walk: &Walk, sources: &[SourcePose], step: usize, set: &mut PathSet) {
        let ear = walk.ear(step);
        let time = Instant::now();
        self.boxes.go_on(&mut self.propagator, step);
        self.propagator.update(&ear, sources, 0.0, set);
        self.times_ms.push(1e3 * time.elapsed().as_secs_f64());
        self.paths += set.paths.len();
    }

    fn quantile_ms(&self, at: f64) -> f64 {
        share(&self.times_ms, at)
    }

    /// Fast and typical updates.
    fn times(&self) -> Value {
        json!({"p10": self.quantile_ms(0.1), "p50": self.quantile_ms(0.5)})
    }

    /// Times as long as another's.
    fn ratio(&self, other: &Self, at: f64) -> f64 {
        self.quantile_ms(at) / other.quantile_ms(at)
    }
}

/// One row: a scene, a number of sources, a number of instances.
pub(super) fn row(
    name: &str,
    walk: &Walk,
    [source_count, instance_count]: [usize; 2],
    seconds: f64,
) -> Result<Value> {
    let sources = walk.sources(source_count)?;
    let runner = |count| Runner::new(walk, &sources, count);
    let (mut fixed, mut moving) = (runner(0)?, runner(instance_count)?);
    let (mut fixed_aside, mut moving_aside) = (runner(0)?, runner(instance_count)?);
    let mut set = PathSet::default();
    let mut aside = sources.clone();
    let started = Instant::now();
    for step in 0.. {
        if step >= FEWEST && started.elapsed().as_secs_f64() > seconds {
            break;
        }
        step_aside(&mut aside, &sources, step);
        fixed.update(walk, &sources, step, &mut set);
        moving.update(walk, &sources, step, &mut set);
        fixed_aside.update(walk, &aside, step, &mut set);
        moving_aside.update(walk, &aside, step, &mut set);
    }
    let updates = fixed.times_ms.len();
    Ok(json!({
        "scene": name,
        "sources": source_count,
        "instances": instance_count,
        "updates": updates,
        "fixed_ms": fixed.times(),
        "moving_ms": moving.times(),
        "ratio_p10": moving.ratio(&fixed, 0.1),
        "ratio_p50": moving.ratio(&fixed, 0.5),
        "paths_fixed": fixed.paths as f64 / updates as f64,
        "paths_moving": moving.paths as f64 / updates as f64,
        "moving_sources": {
            "fixed_ms": fixed_aside.times(),
            "moving_ms": moving_aside.times(),
            "ratio_p10": moving_aside.ratio(&fixed_aside, 0.1),
            "ratio_p50": moving_aside.ratio(&fixed_aside, 0.5),
        },
    }))
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
    println!(
        "{:14} {:4} sources that move:     {:8.2} ms, without {:8.2}; {:.3} x (fast updates {:.3} x)",
        "",
        row["sources"],
        number("/moving_sources/moving_ms/p50"),
        number("/moving_sources/fixed_ms/p50"),
        number("/moving_sources/ratio_p50"),
        number("/moving_sources/ratio_p10"),
    );
}
