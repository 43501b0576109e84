//! One rendering of a unit: by the offline renderer, or through the engine on a virtual clock or by this machine's.
//!
//! Through the engine all settings are its defaults, except that quality stays at its highest: the budget would act on
//! this machine's clock.

use std::sync::Arc;
use std::time::{Duration, Instant};

use foresound::extrapolation::PredictorKind;
use foresound::propagation::PathSet;
use foresound::runtime::engine::Statistics;
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, Latency, OfflineRenderer,
    OfflineSettings, Poses, QualityChoice, QualityLevel, Schedule, VirtualClock,
};
use foresound::scene::SourceId;
use foresound::{Error, Result};
use foresound_tools::cells::RendererKind;
use foresound_tools::talk;

use super::motion::Motion;
use super::plan::Unit;
use super::stage::{Props, RATE_HZ, Stage};
use crate::engine_walk::{EngineWalk, LEAD_IN_FRAMES, Observed, add_sources, give_handles};
use crate::processor_shares::processor_s;
use crate::session::median;

/// Sound and cost.
pub(super) struct Rendered {
    pub(super) ears: [Vec<f32>; 2],
    /// Extrapolation level: median and 99th percentile over updates.
    pub(super) level: [f64; 2],
    /// Mean time of a graphics frame's extrapolation in seconds; through the engine the median.
    pub(super) extrapolation_s: f64,
    /// Median time of an update in seconds.
    pub(super) update_s: f64,
    /// Paths of an update, median.
    pub(super) paths: usize,
    /// Rays of each update; by the offline renderer only.
    pub(super) rays: Vec<u64>,
    /// The update in mid-walk; by the offline renderer only.
    pub(super) middle: Option<PathSet>,
}

/// How a unit is rendered.
#[derive(Clone, Copy)]
pub(super) struct How {
    pub(super) schedule: Schedule,
    pub(super) predictor: PredictorKind,
    /// Seed of the rays.
    pub(super) seed: u64,
}

/// Renders a unit.
pub(super) fn render(unit: &Unit, stage: &Stage, props: &Props, how: How) -> Result<Rendered> {
    match unit.renderer {
        RendererKind::Offline => offline(unit, stage, props, how),
        RendererKind::EngineVirtual => virtual_engine(unit, stage, props, how),
        RendererKind::EngineReal if how.schedule == Schedule::Synchronous => {
            virtual_engine(unit, stage, props, how)
        }
        RendererKind::EngineReal => real_engine(unit, stage, props, how),
    }
}

/// Number of graphics frames of a unit.
fn graphics_frames(unit: &Unit) -> u64 {
    (unit.duration_s * unit.pace.graphics_rate_hz).ceil() as u64
}

fn push_block(ears: &mut [Vec<f32>; 2], block: &[f32]) {
    for stereo in block.chunks_exact(2) {
        ears[0].push(stereo[0]);
        ears[1].push(stereo[1]);
    }
}

/// Samples of a source's sound from one on.
fn signal(unit: &Unit, props: &Props, slot: usize, from: u64, samples: &mut [f32]) {
    let clips = &props.sounds[&unit.signal].clips;
    let clip = &clips[slot % clips.len()];
    if unit.signal == "speech" {
        talk::spoken(clip, from, samples);
    } else {
        clip.looped(from as usize, samples);
    }
}

fn offline(unit: &Unit, stage: &Stage, props: &Props, how: How) -> Result<Rendered> {
    let mut settings = OfflineSettings::default();
    settings.graphics_rate_hz = unit.pace.graphics_rate_hz;
    settings.block_frames = 1024;
    settings.schedule = how.schedule;
    settings.predictor = how.predictor;
    settings.propagation.seed = how.seed;
    settings.generation.rate_hz = RATE_HZ;
    settings.generation.max_sources = unit.sources;
    settings.generation.late = unit.late;
    let mut poses = Poses::default();
    let motion = Motion::of(unit, stage);
    let mut renderer =
        OfflineRenderer::new(Arc::clone(&stage.scene), Arc::clone(&props.hrtf), settings)?;
    let frames = graphics_frames(unit);
    let mut ears = [Vec::new(), Vec::new()];
    let mut middle = None;
    let mut sounds =
        |slot: usize, from: u64, samples: &mut [f32]| signal(unit, props, slot, from, samples);
    let mut times = UpdateTimes::default();
    for frame in 0..frames {
        motion.set_poses(renderer.time_s(), &mut poses);
        let before_s = processor_s();
        renderer.next_frame(&poses, &mut sounds, &mut |block| {
            push_block(&mut ears, block);
            Ok(())
        })?;
        let elapsed_s = processor_s() - before_s;
        times.add(frame, elapsed_s, renderer.report().propagation.len() as u64);
        if frame == frames / 2 {
            middle = Some(renderer.paths().clone());
        }
    }
    let report = renderer.report();
    let extrapolation: Duration = report.extrapolation.iter().sum();
    let level = f64::from(how.schedule.extrapolation_level());
    Ok(Rendered {
        ears,
        level: [level; 2],
        extrapolation_s: extrapolation.as_secs_f64() / report.extrapolation.len().max(1) as f64,
        update_s: times.update_s(),
        paths: median(&report.paths),
        rays: report.rays.clone(),
        middle,
    })
}

/// The engine's default settings for a unit.
fn engine_settings(unit: &Unit, props: &Props, how: How) -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation.rate_hz = RATE_HZ;
    settings.generation.max_sources = unit.sources;
    settings.generation.late = unit.late;
    settings.hrtf = Some(Arc::clone(&props.hrtf));
    settings.propagation.seed = how.seed;
    settings.predictor = how.predictor;
    settings.schedule = match how.schedule {
        Schedule::Synchronous => EngineSchedule::Synchronous,
        Schedule::Asynchronous { .. } => EngineSchedule::Asynchronous,
    };
    // Units are rendered side by side.
    settings.tracing_threads = 1;
    settings.affinity = AffinityPolicy::System;
    settings.budget.quality = QualityChoice::Exactly(QualityLevel(0));
    settings
}

/// Gives every source its sound, from the next block on.
fn play(controller: &mut Controller, ids: &[SourceId], unit: &Unit, props: &Props) -> Result<()> {
    let samples = ((unit.duration_s + 1.0) * f64::from(RATE_HZ)) as usize;
    for (slot, id) in ids.iter().enumerate() {
        let mut sound = vec![0.0; samples];
        signal(unit, props, slot, 0, &mut sound);
        controller.play(*id, sound.into(), false)?;
    }
    Ok(())
}

/// The result of an engine's rendering.
fn rendered(
    observed: Observed,
    ears: [Vec<f32>; 2],
    statistics: &Statistics,
    update_s: f64,
) -> Rendered {
    let mut levels = observed.levels;
    levels.sort_by(f64::total_cmp);
    let share = |share: f64| {
        let index = (share * levels.len() as f64) as usize;
        let last = levels.len().saturating_sub(1);
        levels.get(index.min(last)).copied().unwrap_or_default()
    };
    Rendered {
        ears,
        level: [share(0.5), share(0.99)],
        extrapolation_s: statistics.direct.p50_s + statistics.extrapolation.p50_s,
        update_s,
        paths: median(&observed.paths),
        rays: Vec::new(),
        middle: None,
    }
}

/// The engine on a virtual clock.
fn virtual_engine(unit: &Unit, stage: &Stage, props: &Props, how: How) -> Result<Rendered> {
    if matches!(
        how.schedule,
        Schedule::Asynchronous {
            latency: Latency::None,
            ..
        }
    ) {
        let advice = "leave --latency out";
        return Err(Error::setting(
            "--latency",
            "the engine's updates take time",
            advice,
        ));
    }
    let level = how.schedule.extrapolation_level();
    let clock = VirtualClock::at_level(unit.pace.graphics_rate_hz, level);
    let motion = Motion::of(unit, stage);
    let mut poses = Poses::default();
    motion.set_poses(0.0, &mut poses);
    let mut walk = EngineWalk::begin(
        engine_settings(unit, props, how),
        clock,
        &stage.scene,
        &poses,
        |controller, ids| play(controller, ids, unit, props),
    )?;
    let mut ears = [Vec::new(), Vec::new()];
    let mut observed = Observed::default();
    let mut times = UpdateTimes::default();
    for frame in 0..graphics_frames(unit) {
        motion.set_poses(walk.time_s(), &mut poses);
        let before_s = processor_s();
        walk.next_frame(&mut poses, |block| push_block(&mut ears, block))?;
        let elapsed_s = processor_s() - before_s;
        let statistics = walk.statistics();
        let mark = match how.schedule {
            // Every graphics frame has an update.
            Schedule::Synchronous => frame + 1,
            Schedule::Asynchronous { .. } => statistics.rays,
        };
        times.add(frame, elapsed_s, mark);
        observed.add(&statistics);
    }
    let update_s = times.update_s();
    Ok(rendered(observed, ears, &walk.statistics(), update_s))
}

/// Processor times of graphics frames in which an update was computed, and of others.
#[derive(Default)]
struct UpdateTimes {
    with_update: Vec<f64>,
    without: Vec<f64>,
    mark: u64,
}

impl UpdateTimes {
    /// Adds a graphics frame. `mark` is a number that changes with every update.
    fn add(&mut self, frame: u64, elapsed_s: f64, mark: u64) {
        // The first one warms up.
        if frame > 0 && mark != self.mark {
            self.with_update.push(elapsed_s);
        } else if frame > 0 {
            self.without.push(elapsed_s);
        }
        self.mark = mark;
    }

    /// Time of an update: what such a graphics frame takes longer.
    fn update_s(&self) -> f64 {
        (median(&self.with_update) - median(&self.without)).max(0.0)
    }
}

/// The engine with its threads: both halves here, in lockstep as on the virtual clock, propagation on its own thread.
#[expect(
    clippy::disallowed_methods,
    reason = "renders by this machine's clock; nobody else waits for this thread"
)]
fn real_engine(unit: &Unit, stage: &Stage, props: &Props, how: How) -> Result<Rendered> {
    let (mut controller, mut renderer) = Engine::new(engine_settings(unit, props, how))?;
    controller.set_scene(Arc::clone(&stage.scene))?;
    let motion = Motion::of(unit, stage);
    let mut poses = Poses::default();
    motion.set_poses(0.0, &mut poses);
    let ids = add_sources(&mut controller, &poses)?;
    give_handles(&ids, &mut poses);
    let mut block = vec![0.0; 2 * renderer.block_frames()];
    let block_s = renderer.block_frames() as f64 / f64::from(RATE_HZ);
    let frame_s = unit.pace.graphics_rate_hz.recip();
    let mut ears = [Vec::new(), Vec::new()];
    let mut observed = Observed::default();
    let began = Instant::now();
    let wait_until = |time_s: f64| {
        let left_s = time_s - began.elapsed().as_secs_f64();
        if left_s > 0.0 {
            std::thread::sleep(Duration::from_secs_f64(left_s));
        }
    };
    let mut blocks = 0u32;
    // The sounds begin after as many graphics frames as on the virtual clock, so each block begins at the same time of the walk.
    let lead_in = u64::from(LEAD_IN_FRAMES);
    for frame in 0..lead_in + graphics_frames(unit) {
        let time_s = frame as f64 * frame_s;
        wait_until(time_s);
        if let Some(walked) = frame.checked_sub(lead_in) {
            motion.set_poses(walked as f64 * frame_s, &mut poses);
            give_handles(&ids, &mut poses);
        }
        if frame == lead_in {
            play(&mut controller, &ids, unit, props)?;
            observed = Observed::after(controller.statistics().updates);
        }
        controller.tick(poses.listener, &poses.sources)?;
        while f64::from(blocks) * block_s < time_s + frame_s {
            wait_until(f64::from(blocks) * block_s);
            renderer.render(&mut block);
            if frame >= lead_in {
                push_block(&mut ears, &block);
            }
            blocks += 1;
        }
        if frame >= lead_in {
            observed.add(&controller.statistics());
        }
    }
    let statistics = controller.statistics();
    let update_s = statistics.propagation.p50_s;
    Ok(rendered(observed, ears, &statistics, update_s))
}
