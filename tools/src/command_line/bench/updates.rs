//! Part of `bench speed`: propagation updates by themselves, on one thread and on two, beside their own rays, and with
//! moving instances beside none.
//!
//! The listener walks at 1.4 m/s, 20 updates a second. Resting sources have the rays of a rotation cast once and
//! cached; walking ones leave a cell of that cache now and then; sources that move farther than the cells have all rays cast in
//! every update. Compared configurations alternate update by update, which spreads the machine's other load evenly. Updates for
//! a predictor that asks for closed paths nearby have them, and late energy along the way to the next update, as in the engine.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

use std::sync::Arc;
use std::time::Instant;

use foresound::Result;
use foresound::extrapolation::PredictorKind;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::scene::SourcePose;
use serde_json::{Value, json};

use super::boxes::Boxes;
use super::look_ahead::LookAhead;
use super::recorded_rays::Record;
use super::share;
use super::walk::{STEP_M, Walk, time_s};

/// Fewest updates of a row, at any duration.
const FEWEST: usize = 20;

/// One propagator and its updates.
struct Runner {
    propagator: Propagator,
    boxes: Boxes,
    threads: Threads,
    look_ahead: LookAhead,
    set: PathSet,
    times_ms: Vec<f64>,
    paths: Vec<f64>,
    rays: Vec<f64>,
}

impl Runner {
    /// With moving instances, at the walk's start.
    fn new(
        walk: &Walk,
        sources: &[SourcePose],
        settings: PropagationSettings,
        [threads, instances]: [usize; 2],
        predictor: PredictorKind,
    ) -> Result<Self> {
        let mut propagator = Propagator::new(Arc::clone(&walk.scene), settings)?;
        let boxes = Boxes::add(&mut propagator, walk, sources, instances)?;
        propagator.warm_up(&walk.ear(0), sources);
        Ok(Self {
            propagator,
            boxes,
            threads: Threads::start(threads)?,
            look_ahead: LookAhead::new(predictor),
            set: PathSet::default(),
            times_ms: Vec::new(),
            paths: Vec::new(),
            rays: Vec::new(),
        })
    }

    fn update(&mut self, walk: &Walk, sources: &[SourcePose], step: usize) {
        let ear = walk.ear(step);
        self.look_ahead.ask(&mut self.propagator, &ear, sources);
        let (threads, set) = (&self.threads, &mut self.set);
        let time = Instant::now();
        self.boxes.move_on(&mut self.propagator, step);
        self.propagator
            .update_with(threads, &ear, sources, time_s(step), set);
        self.times_ms.push(1e3 * time.elapsed().as_secs_f64());
        self.paths.push(self.set.paths.len() as f64);
        self.rays.push(self.set.rays as f64);
    }

    /// The fastest update, which a busy machine disturbs least.
    fn best_ms(&self) -> f64 {
        share(&self.times_ms, 0.0)
    }

    fn times<const N: usize>(&self, shares: [(&str, f64); N]) -> Value {
        let times = shares.map(|(name, at)| (name.to_owned(), json!(share(&self.times_ms, at))));
        Value::Object(times.into_iter().collect())
    }
}

/// Calls `step` with growing numbers for so many seconds.
fn repeat(seconds: f64, mut step: impl FnMut(usize)) {
    let started = Instant::now();
    for number in 0.. {
        if number >= FEWEST && started.elapsed().as_secs_f64() > seconds {
            break;
        }
        step(number);
    }
}

/// One row: updates on one thread and on two, with resting, walking and moving sources, and the rays of the last alone.
///
/// The rays alone are those of the updates with moving sources: another propagator computes the same updates in a scene
/// that records its rays, and the tree traces the recorded rays again.
pub(super) fn alone(
    walk: &Walk,
    sources: &[SourcePose],
    settings: PropagationSettings,
    predictor: PredictorKind,
    seconds: f64,
) -> Result<Value> {
    let runner = |threads| Runner::new(walk, sources, settings, [threads, 0], predictor);
    let (mut one, mut two) = (runner(1)?, runner(2)?);
    let (mut one_moving, mut two_moving) = (runner(1)?, runner(2)?);
    let (mut one_walking, mut two_walking) = (runner(1)?, runner(2)?);
    let record = Arc::new(Record::default());
    let recorded = walk.scene.with_observer(record.clone());
    let mut recording = Propagator::new(Arc::new(recorded), settings)?;
    let mut look_ahead = LookAhead::new(predictor);
    recording.warm_up(&walk.ear(0), sources);
    let (mut alone_ms, mut rays_cast) = (Vec::new(), Vec::new());
    let (mut moved, mut set) = (sources.to_vec(), PathSet::default());
    let mut walked = sources.to_vec();
    repeat(seconds, |step| {
        one.update(walk, sources, step);
        two.update(walk, sources, step);
        stroll(&mut walked, sources, step);
        one_walking.update(walk, &walked, step);
        two_walking.update(walk, &walked, step);
        step_aside(&mut moved, sources, step);
        one_moving.update(walk, &moved, step);
        two_moving.update(walk, &moved, step);
        look_ahead.ask(&mut recording, &walk.ear(step), &moved);
        record.take();
        recording.update(&walk.ear(step), &moved, time_s(step), &mut set);
        let rays = record.take();
        let time = Instant::now();
        let hits = rays.iter().filter(|ray| ray.repeat(walk.scene.bvh()));
        std::hint::black_box(hits.count());
        alone_ms.push(1e3 * time.elapsed().as_secs_f64());
        rays_cast.push(rays.len() as f64);
    });
    let percentiles = [("p50", 0.5), ("p95", 0.95)];
    let alone_best_ms = share(&alone_ms, 0.0);
    Ok(json!({
        "sps_ms": one.times(percentiles),
        "sps_two_threads_ms": two.times(percentiles),
        "rays_alone_ms": share(&alone_ms, 0.5),
        "sps_best_ms": one.best_ms(),
        "sps_two_threads_best_ms": two.best_ms(),
        "moving_sources_ms": one_moving.times(percentiles),
        "moving_sources_two_threads_ms": two_moving.times(percentiles),
        "moving_sources_best_ms": one_moving.best_ms(),
        "moving_sources_two_threads_best_ms": two_moving.best_ms(),
        "walking_sources_ms": one_walking.times(percentiles),
        "walking_sources_two_threads_ms": two_walking.times(percentiles),
        "walking_sources_best_ms": one_walking.best_ms(),
        "walking_sources_two_threads_best_ms": two_walking.best_ms(),
        "rays_alone_best_ms": alone_best_ms,
        "update_to_rays": one_moving.best_ms() / alone_best_ms,
        "two_threads_speedup": one.best_ms() / two.best_ms(),
        "paths_p50": share(&one.paths, 0.5),
        "rays_per_update": share(&rays_cast, 0.5),
        "rays_per_update_sources_at_rest": share(&one.rays, 0.5),
        "rays_per_update_walking_sources": share(&one_walking.rays, 0.5),
    }))
}

/// One row: updates with moving instances beside updates without, on one thread. Moving them is part of the time.
pub(super) fn with_instances(
    scene: &str,
    walk: &Walk,
    [source_count, instance_count]: [usize; 2],
    seconds: f64,
) -> Result<Value> {
    let sources = walk.sources(source_count)?;
    let settings = PropagationSettings::default();
    let hold = PredictorKind::Hold;
    let runner = |count| Runner::new(walk, &sources, settings, [1, count], hold);
    let mut resting = [runner(0)?, runner(instance_count)?];
    let mut moving = [runner(0)?, runner(instance_count)?];
    let mut moved = sources.clone();
    repeat(seconds, |step| {
        step_aside(&mut moved, &sources, step);
        resting
            .iter_mut()
            .for_each(|runner| runner.update(walk, &sources, step));
        moving
            .iter_mut()
            .for_each(|runner| runner.update(walk, &moved, step));
    });
    let times = |[fixed, moving]: &[Runner; 2]| {
        let ratio = |at| share(&moving.times_ms, at) / share(&fixed.times_ms, at);
        let percentiles = [("p10", 0.1), ("p50", 0.5)];
        json!({
            "fixed_ms": fixed.times(percentiles),
            "moving_ms": moving.times(percentiles),
            "ratio_p10": ratio(0.1),
            "ratio_p50": ratio(0.5),
        })
    };
    let updates = resting[0].paths.len();
    let paths = |runner: &Runner| runner.paths.iter().sum::<f64>() / updates as f64;
    let mut row = json!({
        "scene": scene,
        "sources": source_count,
        "instances": instance_count,
        "updates": updates,
        "paths_fixed": paths(&resting[0]),
        "paths_moving": paths(&resting[1]),
        "moving_sources": times(&moving),
    });
    if let (Value::Object(row), Value::Object(times)) = (&mut row, times(&resting)) {
        row.extend(times);
    }
    Ok(row)
}

/// Moves each source to and fro, farther than the cells of the ray cache are wide: all rays are cast again.
pub(super) fn step_aside(moved: &mut [SourcePose], sources: &[SourcePose], step: usize) {
    for (moved, source) in moved.iter_mut().zip(sources) {
        moved.position.x = source.position.x + if step.is_multiple_of(2) { 1.1 } else { -1.1 };
    }
}

/// Moves each source by a step of the walk, three metres to and fro, after three updates at rest.
pub(super) fn stroll(moved: &mut [SourcePose], sources: &[SourcePose], step: usize) {
    const TURN: usize = 40;
    let steps = TURN.abs_diff(step.saturating_sub(2) % (2 * TURN));
    for (moved, source) in moved.iter_mut().zip(sources) {
        moved.position.x = source.position.x + STEP_M * (TURN - steps) as f32;
    }
}
