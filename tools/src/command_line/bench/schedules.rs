//! The two schedules of the same engine on the same two threads: Tables 3 and 4 of the paper.
//!
//! A graphics frame is some milliseconds of the caller's own work, a tick, then 1/60 s of audio, one after the other on
//! this thread, as fast as possible. In the synchronous schedule both threads trace within the tick; in the asynchronous
//! one the propagation thread runs by itself. Rounds of both alternate, which spreads other load evenly; frames a second
//! are those of the median round. Frames a second of this thread's processor time exclude other programs, but also waits
//! for the helper thread in the baseline.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use foresound::Result;
use foresound::extrapolation::PredictorKind;
use foresound::propagation::PropagationSettings;
use foresound::propagation::rays::directions::mix;
use foresound::runtime::engine::Percentiles;
use foresound::runtime::{
    AffinityPolicy, Budget, Controller, Engine, EngineSchedule, EngineSettings, Renderer, TraceLog,
};
use foresound::scene::layout::Walk;
use foresound::scene::{ListenerPose, Scene, SourcePose};
use serde_json::{Value, json};

use super::share;
use crate::inputs::voice;
use crate::processor_shares::processor_s;

/// Audio frames of a graphics frame: 1/60 s at 44.1 kHz.
const AUDIO_FRAMES: usize = 735;
/// Seconds of a round of one schedule.
const ROUND_S: f64 = 0.25;
/// Graphics frames before the first round: every ray rotation has been seen, every buffer used.
const WARM_UP: usize = 40;
/// Least factor on the paper's rays that is tried.
const LEAST_LOAD: f64 = 1.0 / 32.0;
/// Most engines and rounds of each in a search for a load.
const SEARCHES: usize = 12;
const SEARCH_ROUNDS: usize = 4;
/// Tolerance around the middle of a level's range, in graphics frames.
const NEAR: f64 = 0.15;
/// Most measurements of a cell until one has its level.
const TRIES: usize = 4;
/// Most spans that a thread records in a round.
const SPANS: usize = 1 << 16;

/// The schedule whose updates define the level L: the asynchronous one (one thread, Eq. 1) or the baseline (two threads).
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum LevelOf {
    Asynchronous,
    Synchronous,
}

impl LevelOf {
    /// The level of a row.
    pub(super) fn found(self, row: &Value) -> Option<f64> {
        match self {
            Self::Asynchronous => row["level"]["p50"].as_f64(),
            Self::Synchronous => row["sync_level"].as_f64().map(f64::floor),
        }
    }
}

/// The measured configuration.
pub(super) struct Cell<'a> {
    pub(super) scene: &'a Arc<Scene>,
    pub(super) walk: Walk,
    pub(super) sources: &'a [SourcePose],
    pub(super) predictor: PredictorKind,
    pub(super) budget: Budget,
    pub(super) graphics_ms: f64,
    pub(super) seconds: f64,
    pub(super) trace: bool,
}

/// One schedule's engine and its measurements.
struct Side {
    controller: Controller,
    renderer: Renderer,
    sources: Vec<SourcePose>,
    walk: Walk,
    graphics: Duration,
    frame: u64,
    /// Frames a second of each round.
    fps: Vec<f64>,
    /// Graphics frames of all rounds, and this thread's processor time in them, in seconds.
    frames: f64,
    processor_s: f64,
    levels: Vec<f64>,
    paths: Vec<f64>,
    rays: Vec<f64>,
}

impl Cell<'_> {
    fn side(&self, schedule: EngineSchedule, load: f64) -> Result<Side> {
        let mut settings = EngineSettings::default();
        settings.generation.max_sources = self.sources.len().max(1);
        settings.propagation = loaded(load);
        settings.block_frames = AUDIO_FRAMES;
        settings.schedule = schedule;
        settings.predictor = self.predictor;
        settings.budget = self.budget;
        // A pinned thread can be delayed by another program for a whole round.
        settings.affinity = AffinityPolicy::System;
        settings.trace_spans = if self.trace { SPANS } else { 0 };
        let rate_hz = settings.generation.rate_hz;
        let (mut controller, renderer) = Engine::new(settings)?;
        controller.set_scene(Arc::clone(self.scene))?;
        let mut sources = Vec::new();
        for (number, pose) in self.sources.iter().enumerate() {
            let id = controller.add_source(pose.position)?;
            let clip = voice(number, rate_hz)?;
            controller.play(id, clip.samples.into(), true)?;
            sources.push(SourcePose { id, ..*pose });
        }
        let mut side = Side {
            controller,
            renderer,
            sources,
            walk: self.walk,
            graphics: Duration::from_secs_f64(1e-3 * self.graphics_ms),
            frame: 0,
            fps: Vec::new(),
            frames: 0.0,
            processor_s: 0.0,
            levels: Vec::new(),
            paths: Vec::new(),
            rays: Vec::new(),
        };
        for _ in 0..WARM_UP {
            side.next_frame()?;
        }
        // The asynchronous side has seen forty graphics frames, not forty updates.
        while side.controller.statistics().updates < 20 {
            side.next_frame()?;
        }
        Ok(side)
    }

    /// Measures both schedules at a load and returns the row's keys.
    pub(super) fn measure(&self, load: f64, log: &mut TraceLog) -> Result<Value> {
        let mut synchronous = self.side(EngineSchedule::Synchronous, load)?;
        let mut asynchronous = self.side(EngineSchedule::Asynchronous, load)?;
        let rounds = (self.seconds / (2.0 * ROUND_S)).ceil().max(3.0) as usize;
        for _ in 0..rounds {
            synchronous.round(ROUND_S)?;
            asynchronous.round(ROUND_S)?;
            if self.trace {
                synchronous.controller.collect_spans(log);
                asynchronous.controller.collect_spans(log);
            }
        }
        Ok(row(&synchronous, &asynchronous, load))
    }

    /// Measures both schedules at the load at which one of them has a level L, `most` at most. A measurement with another
    /// median level is repeated with a load in proportion.
    pub(super) fn measure_at(
        &self,
        level: u32,
        of: LevelOf,
        most: f64,
        log: &mut TraceLog,
    ) -> Result<Value> {
        let mut load = match of {
            LevelOf::Asynchronous => self.load_for(level, most)?,
            // Two threads take about half the time.
            LevelOf::Synchronous => self.load_for(2 * level, most)?,
        };
        let mut row = self.measure(load, log)?;
        for _ in 1..TRIES {
            let found = of.found(&row);
            let Some(found) = found.filter(|&found| found != f64::from(level)) else {
                break;
            };
            let factor = (f64::from(level) + 0.5) / (found + 0.5);
            load = (load * factor).clamp(LEAST_LOAD, most);
            row = self.measure(load, log)?;
        }
        Ok(row)
    }

    /// The load at which the asynchronous schedule has a level L, by bisection.
    fn load_for(&self, level: u32, most: f64) -> Result<f64> {
        let (mut low, mut high) = (LEAST_LOAD, most);
        let mut best = (f64::MAX, 1.0);
        for _ in 0..SEARCHES {
            let load = (low * high).sqrt();
            let mut side = self.side(EngineSchedule::Asynchronous, load)?;
            for _ in 0..SEARCH_ROUNDS {
                side.round(ROUND_S)?;
            }
            let found = side.ratio();
            // The middle of the level's range.
            let target = f64::from(level) + 0.5;
            if (found - target).abs() < best.0 {
                best = ((found - target).abs(), load);
            }
            if best.0 < NEAR {
                break;
            }
            if found > target {
                high = load;
            } else {
                low = load;
            }
        }
        Ok(best.1)
    }
}

/// The paper's rays, times a load.
pub(super) fn loaded(load: f64) -> PropagationSettings {
    let settings = PropagationSettings::default();
    let times = |rays: u32| (f64::from(rays) * load).round().clamp(1.0, 65_536.0) as u32;
    PropagationSettings {
        guide_rays: times(settings.guide_rays),
        source_rays: times(settings.source_rays),
        ..settings
    }
}

impl Side {
    fn next_frame(&mut self) -> Result<()> {
        let began = Instant::now();
        let mut value = self.frame;
        while began.elapsed() < self.graphics {
            value = black_box(mix(value));
        }
        let time_s = self.frame as f64 / 60.0;
        let listener = ListenerPose::facing(self.walk.position_at(time_s, 0.0), 0.0);
        self.controller.tick(listener, &self.sources)?;
        let mut block = [0.0; 2 * AUDIO_FRAMES];
        let report = self.renderer.render(&mut block);
        black_box(&block);
        if report.updates > 0 {
            self.levels.push(report.extrapolation_level.into());
        }
        self.frame += 1;
        Ok(())
    }

    fn round(&mut self, seconds: f64) -> Result<()> {
        let began = Instant::now();
        let used_s = processor_s();
        let mut frames = 0;
        let mut passed_s = 0.0;
        while passed_s < seconds {
            self.next_frame()?;
            frames += 1;
            passed_s = began.elapsed().as_secs_f64();
        }
        self.fps.push(f64::from(frames) / passed_s);
        self.frames += f64::from(frames);
        self.processor_s += processor_s() - used_s;
        let statistics = self.controller.statistics();
        self.paths.push(statistics.paths.into());
        self.rays.push(statistics.rays as f64);
        Ok(())
    }

    /// T_SPS / T_g of the middle update and the middle round.
    fn ratio(&self) -> f64 {
        self.controller.statistics().propagation.p50_s * share(&self.fps, 0.5)
    }
}

fn row(synchronous: &Side, asynchronous: &Side, load: f64) -> Value {
    let (baseline, ours) = (
        synchronous.controller.statistics(),
        asynchronous.controller.statistics(),
    );
    let (sync_fps, async_fps) = (share(&synchronous.fps, 0.5), share(&asynchronous.fps, 0.5));
    let by_processor = |side: &Side| match side.processor_s > 0.0 {
        true => json!(side.frames / side.processor_s),
        false => Value::Null,
    };
    json!({
        "load": load,
        "sync_fps_by_processor_time": by_processor(synchronous),
        "async_fps_by_processor_time": by_processor(asynchronous),
        "sync_fps": sync_fps,
        "async_fps": async_fps,
        "speedup": async_fps / sync_fps,
        "sync_best_fps": share(&synchronous.fps, 1.0),
        "async_best_fps": share(&asynchronous.fps, 1.0),
        "sync_level": baseline.propagation.p50_s * async_fps,
        "sps_ms": of(&ours.propagation, 1e3),
        "sync_sps_ms": of(&baseline.propagation, 1e3),
        "eps_us": of(&ours.extrapolation, 1e6),
        "sgs_us": of(&ours.generation, 1e6),
        "direct_us": of(&ours.direct, 1e6),
        "level": {
            "p50": share(&asynchronous.levels, 0.5),
            "p95": share(&asynchronous.levels, 0.95),
        },
        "paths_p50": share(&asynchronous.paths, 0.5),
        "rays_per_update": share(&asynchronous.rays, 0.5),
        "quality_level": ours.quality_level.0,
        "tier": ours.quality_level.0,
    })
}

/// Percentiles in a unit that is so many times a second.
fn of(times: &Percentiles, unit: f64) -> Value {
    json!({
        "p50": unit * times.p50_s,
        "p95": unit * times.p95_s,
        "p999": unit * times.p999_s,
    })
}
