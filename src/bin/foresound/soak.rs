//! `soak`: the engine in real time into a null device, while everything about it changes at random.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use foresound::generation::GeneratorSettings;
use foresound::propagation::sampling::{mix, unit};
use foresound::runtime::engine::Percentiles;
use foresound::runtime::{
    Budget, Engine, EngineSettings, NullDevice, NullDeviceReport, Renderer, Statistics, TraceLog,
    thread_processor_time,
};
use foresound::{Error, Result};
use serde_json::json;

use crate::counting;
use crate::inputs::{SceneArguments, load_scene};
use crate::processor_shares::ProcessorShares;
use crate::restless::Restless;
use crate::traces::write_trace;

/// The app's graphics frame.
const GRAPHICS_FRAME: Duration = Duration::from_micros(16_667);
/// Seconds until memory has settled: every scene, source and ring has been used once.
const SETTLED_S: f64 = 5.0;
/// Slots of the generator: more sources than that share them.
const SLOTS: usize = 16;
/// Scenes that are swapped.
const SCENES: [&str; 2] = ["concert_hall", "doorway"];

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Length in minutes.
    #[arg(long, default_value_t = 1.0)]
    minutes: f64,
    /// Most sources at a time, 1 to 256; beyond sixteen they share slots.
    #[arg(long, default_value_t = 16)]
    sources: usize,
    /// Threads that compete for the cores.
    #[arg(long, default_value_t = 0)]
    load_threads: usize,
    /// Audio frames a block.
    #[arg(long, default_value_t = 256)]
    block: usize,
    /// Longest propagation update in milliseconds, kept by giving up detail.
    #[arg(long, value_name = "MS")]
    update_ms: Option<f64>,
    /// Share of a core that propagation and sound may take.
    #[arg(long, value_name = "SHARE")]
    core_share: Option<f64>,
    /// Write what every thread did when, for Perfetto.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Threads that do nothing as hard as they can.
struct Load {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Load {
    fn start(threads: usize) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let spin = |stop: Arc<AtomicBool>| {
            thread::spawn(move || {
                let mut value = 1u64;
                while !stop.load(Ordering::Relaxed) {
                    value = black_box(mix(value));
                }
            })
        };
        let threads = (0..threads).map(|_| spin(Arc::clone(&stop))).collect();
        Self { stop, threads }
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ended = thread.join();
        }
    }
}

/// Runs in real time; gives resident memory when it had settled and at the end.
#[expect(clippy::disallowed_methods, reason = "a soak runs by the clock")]
fn keep_going(
    restless: &mut Restless,
    seconds: f64,
    mut log: Option<&mut TraceLog>,
) -> Result<[f64; 2]> {
    let began = Instant::now();
    let mut start_mb = resident_mb();
    let mut due = began;
    let settled_s = SETTLED_S.min(seconds / 4.0);
    let mut settled = false;
    while began.elapsed().as_secs_f64() < seconds {
        let time_s = began.elapsed().as_secs_f64();
        restless.frame(time_s)?;
        if let Some(log) = &mut log {
            restless.controller.collect_spans(log);
        }
        if !settled && time_s > settled_s {
            start_mb = resident_mb();
            settled = true;
        }
        due += GRAPHICS_FRAME;
        let rest = due.saturating_duration_since(Instant::now());
        if rest.is_zero() {
            due = Instant::now();
        }
        thread::sleep(rest);
    }
    Ok([start_mb, resident_mb()])
}

/// Memory in use in MB; 0 where the system does not say.
pub(crate) fn resident_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}

fn device(
    mut renderer: Renderer,
    settings: &EngineSettings,
    operations: &Arc<AtomicU64>,
    shares: &Arc<ProcessorShares>,
) -> Result<NullDevice> {
    let (counted, shares) = (Arc::clone(operations), Arc::clone(shares));
    let rate_hz = settings.generation.rate_hz;
    let mut placed = false;
    NullDevice::start(
        rate_hz,
        settings.block_frames,
        settings.affinity,
        move |block| {
            if !placed {
                renderer.place_thread();
                placed = true;
            }
            let (before, worked) = (counting::operations(), thread_processor_time());
            renderer.render(block);
            if let (Some(before), Some(after)) = (worked, thread_processor_time()) {
                shares.record(after.saturating_sub(before));
            }
            counted.fetch_add(counting::operations() - before, Ordering::Relaxed);
        },
    )
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if !(0.01..=10_000.0).contains(&arguments.minutes) {
        let problem = format!("{} is no length", arguments.minutes);
        return Err(Error::setting("--minutes", problem, "give 0.01 to 10000"));
    }
    let settings = EngineSettings {
        generation: GeneratorSettings {
            max_sources: arguments.sources.min(SLOTS),
            ..EngineSettings::default().generation
        },
        most_sources: Some(arguments.sources),
        budget: Budget {
            update_s: arguments.update_ms.map(|ms| 1e-3 * ms),
            core_share: arguments.core_share,
            ..Budget::default()
        },
        trace_spans: if arguments.trace.is_some() {
            1 << 14
        } else {
            0
        },
        block_frames: arguments.block,
        ..EngineSettings::default()
    };
    let (controller, renderer) = Engine::new(settings.clone())?;
    let scenes = SCENES
        .iter()
        .map(|name| load_scene(Path::new(name), &SceneArguments::default()))
        .collect::<Result<Vec<_>>>()?;
    let noise = (0..44_100).map(|n| 0.2 * unit(mix(n)) - 0.1);
    let mut restless = Restless {
        controller,
        clip: noise.collect(),
        here: Vec::new(),
        most: arguments.sources,
        scene: 0,
        swaps: 0,
        added: 0,
        state: 1,
        scenes,
    };
    let first = Arc::clone(&restless.scenes[0].scene);
    restless.controller.set_scene(first)?;
    let operations = Arc::new(AtomicU64::new(0));
    let load = Load::start(arguments.load_threads);
    let rate_hz = f64::from(settings.generation.rate_hz);
    let shares = Arc::new(ProcessorShares::new(arguments.block as f64 / rate_hz));
    let device = device(renderer, &settings, &operations, &shares)?;
    let mut log = TraceLog::default();
    let traced = arguments.trace.is_some().then_some(&mut log);
    let rss_mb = keep_going(&mut restless, 60.0 * arguments.minutes, traced)?;
    let heard = device.stop();
    drop(load);
    let statistics = restless.controller.statistics();
    let operations = operations.load(Ordering::Relaxed);
    tell(
        arguments,
        &restless,
        &heard,
        &statistics,
        (operations, &shares),
        rss_mb,
    );
    match &arguments.trace {
        Some(file) => write_trace(file, &log),
        None => Ok(()),
    }
}

fn tell(
    arguments: &Arguments,
    restless: &Restless,
    heard: &NullDeviceReport,
    statistics: &Statistics,
    (operations, shares): (u64, &ProcessorShares),
    rss_mb: [f64; 2],
) {
    let generation = &restless.controller.settings().generation;
    let period_s = arguments.block as f64 / f64::from(generation.rate_hz);
    let share = |time_s: f64| time_s / period_s;
    let block = &statistics.block;
    let microseconds = |times: &Percentiles| json!({"p50": 1e6 * times.p50_s, "p95": 1e6 * times.p95_s, "p999": 1e6 * times.p999_s});
    let milliseconds = |time_s: f64| 1e3 * time_s;
    let result = json!({
        "blocks": heard.blocks,
        "missed": heard.missed,
        "p50_share": share(block.p50_s),
        "p999_share": share(block.p999_s),
        "worst_share": share(block.worst_s),
        "processor_p50_share": shares.percentile(0.5),
        "processor_p999_share": shares.percentile(0.999),
        "processor_worst_share": shares.percentile(1.0),
        "allocations": operations,
        "swaps": restless.swaps,
        "sources_added": restless.added,
        "rss_mb_start": rss_mb[0],
        "rss_mb_end": rss_mb[1],
        "updates": statistics.updates,
        "paths": statistics.paths,
        "level": statistics.level,
        "sps_ms": {
            "p50": milliseconds(statistics.propagation.p50_s),
            "p95": milliseconds(statistics.propagation.p95_s),
        },
        "direct_us": microseconds(&statistics.direct),
        "eps_us": microseconds(&statistics.extrapolation),
        "sgs_us": microseconds(&statistics.generation),
        "tier": statistics.tier.0,
        "unheard_sources": statistics.unheard_sources,
        "starved_samples": statistics.starved_samples,
        "graphics_frame_ms": milliseconds(statistics.graphics_frame_s),
        "dropped_paths": statistics.dropped_paths,
        "cores": format!("{:#b}", heard.placement.cores),
        "pinned": heard.placement.pinned,
        "realtime_priority": heard.placement.realtime_priority,
        "nice": heard.placement.nice,
    });
    if arguments.json {
        println!("{result}");
        return;
    }
    println!(
        "{} blocks, {} missed; a block took {:.1} % of its period at the median, {:.1} % at p99.9, {:.1} % at worst",
        heard.blocks,
        heard.missed,
        100.0 * share(block.p50_s),
        100.0 * share(block.p999_s),
        100.0 * share(block.worst_s),
    );
    if let (Some(p50), Some(p999), Some(worst)) = (
        shares.percentile(0.5),
        shares.percentile(0.999),
        shares.percentile(1.0),
    ) {
        println!(
            "of its own processor time, without what the machine did besides: {:.1} %, {:.1} %, {:.1} %",
            100.0 * p50,
            100.0 * p999,
            100.0 * worst,
        );
    }
    println!(
        "{operations} allocations and frees on the audio side; {} scene swaps, {} sources added; {:.1} MB, then {:.1} MB",
        restless.swaps, restless.added, rss_mb[0], rss_mb[1],
    );
}
