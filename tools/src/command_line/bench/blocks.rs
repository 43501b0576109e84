//! `bench blocks`: generation's share of a core, block by block.
//!
//! The paths of a walking listener, extrapolated at the paper's rate and level, are computed first; then the walk is
//! generated several times. Each block counts with the fastest of its times, which the machine's other load disturbs
//! least. The time of a block that takes a graphics frame includes taking it, which is printed besides.

#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use foresound::extrapolation::{FramePaths, GeometricSettings, PredictorKind};
use foresound::generation::{Generator, GeneratorSettings, Hrtf, Layout};
use foresound::runtime::engine::ramp_frames;
use foresound::runtime::{Latency, OfflineRenderer, OfflineSettings, Poses, Schedule};
use foresound::scene::{ListenerPose, SourceId, SourcePose};
use foresound::{Error, Result};
use foresound_tools::cells::Platform;
use foresound_tools::clip::Clip;
use foresound_tools::paper::pace;
use serde_json::{Value, json};

use super::share;
use crate::inputs::{LoadedScene, SceneArguments, load_scene, voice, within};
use crate::printed;

/// Voices that speak in turn.
const VOICES: usize = 16;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scene by name.
    #[arg(long, default_value = "concert_hall")]
    scene: String,
    /// Number of sources, up to the scene's own.
    #[arg(long, default_value_t = 16)]
    sources: usize,
    /// Audio frames of a block, 32 to 4096.
    #[arg(long, default_value_t = 256)]
    block: usize,
    /// Sample rate in Hz: 44100 or 48000.
    #[arg(long, default_value_t = 44_100)]
    rate: u32,
    /// Layouts to compare, in turn in one run; the first is the measure of the others.
    #[arg(long, value_delimiter = ',', default_value = "binaural")]
    layout: Vec<String>,
    /// Seconds of the walk.
    #[arg(long, default_value_t = 4.0)]
    seconds: f64,
    /// How often the walk is generated.
    #[arg(long, default_value_t = 7)]
    rounds: usize,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A walk ready to be generated.
struct Walked {
    settings: GeneratorSettings,
    graphics_rate_hz: f64,
    level: u32,
    frames: Vec<FramePaths>,
    /// Each source's sound from the walk's beginning, as long as the walk.
    sounds: Vec<Vec<f32>>,
}

/// Microseconds of every block, and of taking every graphics frame, which is part of a block.
#[derive(Debug, Default, Clone)]
struct Times {
    blocks: Vec<f64>,
    frames: Vec<f64>,
}

impl Times {
    /// Keeps the lesser time of each block and frame.
    fn keep_least(&mut self, other: Self) {
        if self.blocks.is_empty() {
            *self = other;
            return;
        }
        let blocks = self.blocks.iter_mut().zip(other.blocks);
        for (best, us) in blocks.chain(self.frames.iter_mut().zip(other.frames)) {
            *best = best.min(us);
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    check(arguments)?;
    let hrtf = Arc::new(Hrtf::builtin(arguments.rate)?);
    let layouts = arguments.layout.iter().map(|name| name.parse());
    let layouts = layouts.collect::<Result<Vec<Layout>>>()?;
    let walked = walk(arguments, &hrtf)?;
    let mut best: Vec<Times> = vec![Times::default(); layouts.len()];
    let mut most_voices = 0;
    for _ in 0..arguments.rounds {
        for (layout, best) in layouts.iter().zip(&mut best) {
            let settings = GeneratorSettings {
                layout: *layout,
                ..walked.settings.clone()
            };
            let mut generator = Generator::new(settings, Arc::clone(&hrtf))?;
            let (times, voices) = walked.generate(&mut generator, arguments.block);
            most_voices = most_voices.max(voices);
            best.keep_least(times);
        }
    }
    let mut rows: Vec<Value> = Vec::new();
    for (layout, best) in layouts.iter().zip(&best) {
        let mut row = row(arguments, &walked, best, most_voices);
        let mean_us = |row: &Value| row["us"]["mean"].as_f64().unwrap_or(0.0);
        let first_us = mean_us(rows.first().unwrap_or(&row));
        row["layout"] = layout.name().into();
        row["to_first"] = (mean_us(&row) / first_us).into();
        rows.push(row);
    }
    printed::rows(&rows, arguments.json);
    Ok(())
}

fn check(arguments: &Arguments) -> Result<()> {
    within(
        "--block",
        arguments.block as f64,
        32.0..=4096.0,
        " audio frames",
    )?;
    within("--seconds", arguments.seconds, 0.5..=60.0, " s")?;
    within("--rounds", arguments.rounds as f64, 1.0..=1e6, "")
}

/// Walks through the scene once and keeps every graphics frame's paths.
fn walk(arguments: &Arguments, hrtf: &Arc<Hrtf>) -> Result<Walked> {
    let LoadedScene { scene, layout, .. } =
        load_scene(Path::new(&arguments.scene), &SceneArguments::default())?;
    let layout = layout.filter(|layout| layout.sources.len() >= arguments.sources);
    let (Some(layout), 1..) = (layout, arguments.sources) else {
        let problem = format!("{} of {}", arguments.sources, arguments.scene);
        let advice = "choose 1 to as many as the scene's .toml file lists";
        return Err(Error::setting("--sources", problem, advice));
    };
    let Some(path) = layout.listener else {
        let problem = format!("{} has no walk", arguments.scene);
        return Err(Error::setting(
            "--scene",
            problem,
            "choose a benchmark scene",
        ));
    };
    let pace = pace(Platform::Workstation, &arguments.scene, arguments.sources);
    let clips = (0..arguments.sources.min(VOICES))
        .map(|n| voice(n, arguments.rate))
        .collect::<Result<Vec<Clip>>>()?;
    let settings = GeneratorSettings {
        rate_hz: arguments.rate,
        max_sources: arguments.sources,
        ..GeneratorSettings::default()
    };
    let mut renderer = OfflineRenderer::new(scene, Arc::clone(hrtf), {
        let mut these = OfflineSettings::default();
        these.graphics_rate_hz = pace.graphics_rate_hz;
        these.block_frames = 1024;
        these.schedule = Schedule::Asynchronous {
            extrapolation_level: pace.level,
            latency: Latency::Modelled,
        };
        these.predictor = PredictorKind::Geometric(GeometricSettings::default());
        these.generation = settings.clone();
        these
    })?;
    let mut poses = Poses::default();
    for (slot, source) in layout.sources.iter().take(arguments.sources).enumerate() {
        let id = SourceId::new(slot as u16, 0);
        poses.sources.push(SourcePose::at(id, source.position));
    }
    let mut signal = |_: usize, _: u64, samples: &mut [f32]| samples.fill(0.0);
    let count = (arguments.seconds * pace.graphics_rate_hz).ceil() as usize;
    let mut frames = Vec::with_capacity(count);
    for _ in 0..count {
        let position = path.position_at(renderer.time_s(), 0.0);
        poses.listener = ListenerPose::facing(position, 0.0);
        renderer.next_frame(&poses, &mut signal, &mut |_| Ok(()))?;
        frames.push(renderer.frame_paths().clone());
    }
    let length = (arguments.seconds * f64::from(arguments.rate)) as usize;
    let sounds = (0..arguments.sources)
        .map(|slot| {
            let mut sound = vec![0.0; length];
            clips[slot % clips.len()].looped(0, &mut sound);
            sound
        })
        .collect();
    Ok(Walked {
        settings,
        graphics_rate_hz: pace.graphics_rate_hz,
        level: pace.level,
        frames,
        sounds,
    })
}

impl Walked {
    /// Times, and the most voices at once.
    ///
    /// Not inlined: `callgrind --toggle-collect` counts it by name.
    #[inline(never)]
    fn generate(&self, generator: &mut Generator, block: usize) -> (Times, u32) {
        let frame_frames = f64::from(self.settings.rate_hz) / self.graphics_rate_hz;
        // As in the engine.
        let ramp = ramp_frames(1.0 / self.graphics_rate_hz, self.settings.rate_hz, block);
        let blocks = self.sounds.first().map_or(0, Vec::len) / block;
        let mut output = vec![0.0; generator.channels() * block];
        let mut times = Times {
            blocks: Vec::with_capacity(blocks),
            frames: Vec::with_capacity(self.frames.len()),
        };
        let (mut taken, mut most_voices) = (None, 0);
        for start in (0..blocks).map(|n| n * block) {
            let inputs: Vec<&[f32]> = self
                .sounds
                .iter()
                .map(|sound| &sound[start..start + block])
                .collect();
            // The newest graphics frame, as in the engine.
            let newest = ((start as f64 / frame_frames) as usize).min(self.frames.len() - 1);
            let time = Instant::now();
            if taken != Some(newest) {
                generator.set_frame(&self.frames[newest], ramp);
                taken = Some(newest);
                times.frames.push(1e6 * time.elapsed().as_secs_f64());
            }
            let report = generator.render(&inputs, &mut output);
            times.blocks.push(1e6 * time.elapsed().as_secs_f64());
            most_voices = most_voices.max(report.voices);
        }
        (times, most_voices)
    }
}

fn row(arguments: &Arguments, walked: &Walked, times: &Times, most_voices: u32) -> Value {
    // The first blocks have new paths only.
    let [us, frame_us] = [&times.blocks, &times.frames].map(|us| &us[us.len().min(4)..]);
    let period_us = 1e6 * arguments.block as f64 / f64::from(arguments.rate);
    let paths: Vec<f64> = walked.frames.iter().map(|f| f.paths.len() as f64).collect();
    let p50 = share(us, 0.5);
    let worst = share(us, 1.0);
    let mean = us.iter().sum::<f64>() / us.len().max(1) as f64;
    json!({
        "scene": arguments.scene,
        "sources": arguments.sources,
        "block": arguments.block,
        "rate_hz": arguments.rate,
        "graphics_rate_hz": walked.graphics_rate_hz,
        "level": walked.level,
        "paths_p50": share(&paths, 0.5),
        "paths_most": share(&paths, 1.0),
        "voices_most": most_voices,
        "blocks": us.len(),
        "us": {"p50": p50, "p95": share(us, 0.95), "p99": share(us, 0.99), "worst": worst, "mean": mean},
        "frame_us": {"p50": share(frame_us, 0.5), "worst": share(frame_us, 1.0)},
        "core_share": mean / period_us,
        "core_share_p50": p50 / period_us,
        "worst_to_median": worst / p50,
    })
}
