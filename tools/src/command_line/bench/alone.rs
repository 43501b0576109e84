//! Of `bench speed`: one propagation update on one thread and on two, beside its own rays cast alone.
//!
//! The listener walks at 1.4 m/s, 20 updates a second. Sources rest, so that their rays of a rotation are cast once and
//! remembered; beside that the same with sources that leap in every update, so that all rays are cast anew. Rays alone are
//! those of the latter, in their order: another propagator computes the same updates in a scene whose rays are recorded, and
//! the tree traces them again. The measurements alternate, update by update: other load of the machine affects all alike.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
#![expect(clippy::disallowed_types, reason = "a record of rays locks")]

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use foresound::Result;
use foresound::geometry::bvh::RayObserver;
use foresound::geometry::{Bvh, Ray};
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::scene::SourcePose;
use serde_json::{Value, json};

use super::share;
use super::walk::Walk;

/// Fewest updates that a row is made of, however long they take.
const FEWEST: usize = 5;

/// What one row has measured, in milliseconds.
#[derive(Default)]
pub(super) struct Times {
    one: Vec<f64>,
    two: Vec<f64>,
    /// The same with moving sources.
    moving: [Vec<f64>; 2],
    alone: Vec<f64>,
    paths: Vec<f64>,
    rays: Vec<f64>,
    resting_rays: Vec<f64>,
}

/// A ray that a tree has traced.
#[derive(Debug)]
struct TracedRay {
    ray: Ray,
    ignored: [u32; 2],
    any: bool,
}

impl TracedRay {
    /// Traces the ray again; whether it hits something.
    #[inline(always)]
    fn repeat(&self, tree: &Bvh) -> bool {
        match self.any {
            true => tree.any_hit(&self.ray, self.ignored),
            false => tree.closest_hit(&self.ray, self.ignored).is_some(),
        }
    }
}

/// The rays that a tree has traced, in order.
#[derive(Debug, Default)]
struct Record(Mutex<Vec<TracedRay>>);

impl Record {
    /// The rays since the last call.
    fn take(&self) -> Vec<TracedRay> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl RayObserver for Record {
    fn on_ray(&self, ray: &Ray, ignored: [u32; 2], any: bool) {
        let ray = *ray;
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.push(TracedRay { ray, ignored, any });
    }
}

pub(super) fn measure(
    walk: &Walk,
    sources: &[SourcePose],
    settings: PropagationSettings,
    seconds: f64,
) -> Result<Times> {
    let scene = &walk.scene;
    let threads = Threads::start(2)?;
    let mut one = Propagator::new(Arc::clone(scene), settings)?;
    let mut two = Propagator::new(Arc::clone(scene), settings)?;
    let mut one_moving = Propagator::new(Arc::clone(scene), settings)?;
    let mut two_moving = Propagator::new(Arc::clone(scene), settings)?;
    let record = Arc::new(Record::default());
    let recorded = scene.with_observer(record.clone());
    let mut recording = Propagator::new(Arc::new(recorded), settings)?;
    for propagator in [
        &mut one,
        &mut two,
        &mut one_moving,
        &mut two_moving,
        &mut recording,
    ] {
        propagator.warm_up(&walk.ear(0), sources);
    }
    let mut moved = sources.to_vec();
    let (mut set, mut other) = (PathSet::default(), PathSet::default());
    let mut times = Times::default();
    let started = Instant::now();
    for step in 0.. {
        if step >= FEWEST && started.elapsed().as_secs_f64() > seconds {
            break;
        }
        let ear = walk.ear(step);
        let time = Instant::now();
        one.update(&ear, sources, 0.0, &mut set);
        times.one.push(ms(time.elapsed()));
        let time = Instant::now();
        two.update_with(&threads, &ear, sources, 0.0, &mut other);
        times.two.push(ms(time.elapsed()));
        times.paths.push(set.paths.len() as f64);
        times.resting_rays.push(set.rays as f64);
        step_aside(&mut moved, sources, step);
        let time = Instant::now();
        one_moving.update(&ear, &moved, 0.0, &mut set);
        times.moving[0].push(ms(time.elapsed()));
        let time = Instant::now();
        two_moving.update_with(&threads, &ear, &moved, 0.0, &mut other);
        times.moving[1].push(ms(time.elapsed()));
        record.take();
        recording.update(&ear, &moved, 0.0, &mut set);
        let rays = record.take();
        let time = Instant::now();
        let hits = rays.iter().filter(|traced| traced.repeat(scene.bvh()));
        std::hint::black_box(hits.count());
        times.alone.push(ms(time.elapsed()));
        times.rays.push(rays.len() as f64);
    }
    Ok(times)
}

/// Sources of an update, each farther from where it was in the last, and sixteen updates before, than the cells are wide
/// that rays are remembered in: so all rays are cast.
pub(super) fn step_aside(moved: &mut [SourcePose], sources: &[SourcePose], step: usize) {
    for (moved, source) in moved.iter_mut().zip(sources) {
        moved.position.x = source.position.x + 0.6 * (1 + step % 3) as f32;
    }
}

fn ms(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

impl Times {
    /// The fastest update on one thread.
    pub(super) fn best_ms(&self) -> f64 {
        share(&self.one, 0.0)
    }

    pub(super) fn row(&self, scene: &str, sources: usize, graphics_ms: f64) -> Value {
        let both = |values: &[f64]| json!({"p50": share(values, 0.5), "p95": share(values, 0.95)});
        // The fastest of each: on a busy machine the middle one tells how often it was put off.
        let (one, alone) = (share(&self.one, 0.0), share(&self.alone, 0.0));
        let [moving, moving_two] = [0, 1].map(|k| share(&self.moving[k], 0.0));
        json!({
            "scene": scene,
            "sources": sources,
            "graphics_ms": graphics_ms,
            "sps_ms": both(&self.one),
            "sps_two_threads_ms": both(&self.two),
            "rays_alone_ms": share(&self.alone, 0.5),
            "sps_best_ms": one,
            "sps_two_threads_best_ms": share(&self.two, 0.0),
            "moving_sources_ms": both(&self.moving[0]),
            "moving_sources_two_threads_ms": both(&self.moving[1]),
            "moving_sources_best_ms": moving,
            "moving_sources_two_threads_best_ms": moving_two,
            "rays_alone_best_ms": alone,
            "update_to_rays": moving / alone,
            "two_threads_speedup": one / share(&self.two, 0.0),
            "paths_p50": share(&self.paths, 0.5),
            "rays_per_update": share(&self.rays, 0.5),
            "rays_per_update_sources_at_rest": share(&self.resting_rays, 0.5),
        })
    }
}
