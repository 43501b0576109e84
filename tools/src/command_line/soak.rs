//! `soak`: the engine in real time into a null device, while its sources, scene and settings change at random.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use foresound::Result;
use foresound::generation::{Hrtf, Layout};
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::engine::Percentiles;
use foresound::runtime::{
    Engine, EngineSettings, NullDevice, NullDeviceReport, Renderer, Statistics, TraceLog,
    thread_processor_time,
};
use foresound_tools::clicks::{ClickDetector, smooth_loop};
use serde_json::{Value, json};

use crate::assets;
use crate::counting;
use crate::inputs::{SceneArguments, load_scene, predictor_named, within};
use crate::memory_use::Memory;
use crate::printed;
use crate::processor_shares::ProcessorShares;
use crate::restless::{Change, Outputs, Restless};
use crate::traces::write_trace;

/// The app's graphics frame.
const GRAPHICS_FRAME: Duration = Duration::from_micros(16_667);
/// Seconds until memory has settled: by then every scene, source and ring has been used.
const SETTLED_S: f64 = 60.0;
/// Slots of the generator: more sources share them.
const SLOTS: usize = 16;
/// Most sources.
const MOST_SOURCES: f64 = 256.0;
/// Scenes that are swapped.
const SCENES: [&str; 2] = ["concert_hall", "doorway"];

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Length in minutes.
    #[arg(long, default_value_t = 1.0)]
    minutes: f64,
    /// Most sources at a time, 1 to 256; more than sixteen share slots.
    #[arg(long, default_value_t = 16)]
    sources: usize,
    /// Number of threads that compete for the cores.
    #[arg(long, default_value_t = 0)]
    load_threads: usize,
    /// Audio frames a block.
    #[arg(long, default_value_t = 256)]
    block: usize,
    /// Longest propagation update in milliseconds; detail is reduced to keep it.
    #[arg(long, value_name = "MS")]
    update_ms: Option<f64>,
    /// Share of a core that propagation and sound may take.
    #[arg(long, value_name = "SHARE")]
    core_share: Option<f64>,
    /// Play a smooth sound and detect clicks and direct current in the output.
    #[arg(long)]
    detect: bool,
    /// Change layout and HRTF set at random too, in an output of sixteen channels, and detect clicks in all of them.
    #[arg(long)]
    switch_outputs: bool,
    /// Kinds of changes besides movement; all if none is given.
    #[arg(long, value_delimiter = ',')]
    changes: Vec<Change>,
    /// Predictor at the start: hold, linear or best.
    #[arg(long, default_value = "best", value_name = "NAME")]
    predictor: String,
    /// Write a trace of all threads' work for Perfetto.
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Threads that only consume processor time.
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

/// Analyses the output on the device's thread and sends the result when the device stops.
struct Ear {
    detector: ClickDetector,
    to: Sender<ClickDetector>,
}

impl Drop for Ear {
    fn drop(&mut self) {
        let _receiver_gone = self.to.send(self.detector.clone());
    }
}

/// Runs in real time and returns memory use after [`SETTLED_S`].
#[expect(clippy::disallowed_methods, reason = "a soak runs by the clock")]
fn keep_going(
    restless: &mut Restless,
    seconds: f64,
    mut log: Option<&mut TraceLog>,
) -> Result<Memory> {
    let began = Instant::now();
    let mut memory = Memory::default();
    let mut due = began;
    let settled_s = SETTLED_S.min(seconds / 4.0);
    let mut next_s = settled_s;
    while began.elapsed().as_secs_f64() < seconds {
        let time_s = began.elapsed().as_secs_f64();
        restless.frame(time_s)?;
        if let Some(log) = &mut log {
            restless.controller.collect_spans(log);
        }
        if time_s > next_s {
            memory.sample(time_s);
            next_s += 1.0;
        }
        due += GRAPHICS_FRAME;
        let rest = due.saturating_duration_since(Instant::now());
        if rest.is_zero() {
            due = Instant::now();
        }
        thread::sleep(rest);
    }
    Ok(memory)
}

fn device(
    mut renderer: Renderer,
    settings: &EngineSettings,
    operations: &Arc<AtomicU64>,
    shares: &Arc<ProcessorShares>,
    mut ear: Option<Ear>,
) -> Result<NullDevice> {
    let (counted, shares) = (Arc::clone(operations), Arc::clone(shares));
    let rate_hz = settings.generation.rate_hz;
    let mut placed = false;
    // The device is stereo; an output of more channels is only listened to.
    let channels = renderer.channels();
    let mut many = vec![0.0; channels * settings.block_frames];
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
            let block = match channels {
                2 => block,
                _ => &mut many[..channels * (block.len() / 2)],
            };
            renderer.render(block);
            if let (Some(before), Some(after)) = (worked, thread_processor_time()) {
                shares.record(after.saturating_sub(before));
            }
            counted.fetch_add(counting::operations() - before, Ordering::Relaxed);
            if let Some(ear) = &mut ear {
                ear.detector.push(block);
            }
        },
    )
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    within("--minutes", arguments.minutes, 0.01..=10_000.0, "")?;
    within(
        "--sources",
        arguments.sources as f64,
        1.0..=MOST_SOURCES,
        "",
    )?;
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = arguments.sources.min(SLOTS);
    settings.max_sources = Some(arguments.sources);
    settings.budget.update_s = arguments.update_ms.map(|ms| 1e-3 * ms);
    settings.budget.core_share = arguments.core_share;
    settings.trace_spans = if arguments.trace.is_some() {
        1 << 14
    } else {
        0
    };
    settings.block_frames = arguments.block;
    settings.predictor = predictor_named(&arguments.predictor)?;
    let rate_hz = settings.generation.rate_hz;
    let outputs = match arguments.switch_outputs {
        false => None,
        true => {
            settings.generation.channels = Some(Layout::Ambisonics3.channels());
            let sets = [
                Hrtf::builtin(rate_hz)?,
                Hrtf::omnidirectional(rate_hz)?,
                Hrtf::from_sofa(assets::KEMAR, "MIT_KEMAR_normal_pinna.sofa", rate_hz)?,
            ];
            Some(Outputs {
                hrtfs: sets.into_iter().map(Arc::new).collect(),
                layout_changes: 0,
                hrtf_changes: 0,
            })
        }
    };
    let detects = arguments.detect || arguments.switch_outputs;
    let (controller, renderer) = Engine::new(settings.clone())?;
    let scenes = SCENES
        .iter()
        .map(|name| load_scene(Path::new(name), &SceneArguments::default()))
        .collect::<Result<Vec<_>>>()?;
    let clip: Arc<[f32]> = if detects {
        smooth_loop(rate_hz).into()
    } else {
        (0..44_100).map(|n| 0.2 * unit(mix(n)) - 0.1).collect()
    };
    let mut restless = Restless {
        controller,
        clip,
        sources: Vec::new(),
        most: arguments.sources,
        changes: match arguments.changes.as_slice() {
            [] => Change::value_variants().to_vec(),
            some => some.to_vec(),
        },
        scene: 0,
        swaps: 0,
        added: 0,
        outputs,
        state: 1,
        scenes,
    };
    let first = Arc::clone(&restless.scenes[0].scene);
    restless.controller.set_scene(first)?;
    let operations = Arc::new(AtomicU64::new(0));
    let load = Load::start(arguments.load_threads);
    let period_s = arguments.block as f64 / f64::from(rate_hz);
    let shares = Arc::new(ProcessorShares::new(period_s));
    let (to, listened) = mpsc::channel();
    let channels = settings.generation.output_channels();
    let detector = ClickDetector::with_channels(rate_hz, channels);
    let ear = detects.then_some(Ear { detector, to });
    let device = device(renderer, &settings, &operations, &shares, ear)?;
    let mut log = TraceLog::default();
    let traced = arguments.trace.is_some().then_some(&mut log);
    let memory = keep_going(&mut restless, 60.0 * arguments.minutes, traced)?;
    let heard = device.stop();
    drop(load);
    let statistics = restless.controller.statistics();
    let operations = operations.load(Ordering::Relaxed);
    print_findings(
        arguments,
        &restless,
        &heard,
        &statistics,
        (operations, &shares),
        &memory,
        listened.try_recv().ok(),
    );
    match &arguments.trace {
        Some(file) => write_trace(file, &log),
        None => Ok(()),
    }
}

fn print_findings(
    arguments: &Arguments,
    restless: &Restless,
    heard: &NullDeviceReport,
    statistics: &Statistics,
    (operations, shares): (u64, &ProcessorShares),
    memory: &Memory,
    listened: Option<ClickDetector>,
) {
    let generation = &restless.controller.settings().generation;
    let period_s = arguments.block as f64 / f64::from(generation.rate_hz);
    let share = |time_s: f64| time_s / period_s;
    let block = &statistics.block;
    let (rss_mb, live_mb) = (memory.most(1), memory.most(2));
    let microseconds = |times: &Percentiles| json!({"p50": 1e6 * times.p50_s, "p95": 1e6 * times.p95_s, "p999": 1e6 * times.p999_s});
    let milliseconds = |time_s: f64| 1e3 * time_s;
    let mut result = json!({
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
        "rss_mb_a_minute": memory.growth(1),
        "live_mb_start": live_mb[0],
        "live_mb_end": live_mb[1],
        "live_mb_a_minute": memory.growth(2),
        "updates": statistics.updates,
        "paths": statistics.paths,
        "level": statistics.extrapolation_level,
        "sps_ms": {
            "p50": milliseconds(statistics.propagation.p50_s),
            "p95": milliseconds(statistics.propagation.p95_s),
        },
        "direct_us": microseconds(&statistics.direct),
        "eps_us": microseconds(&statistics.extrapolation),
        "sgs_us": microseconds(&statistics.generation),
        "quality_level": statistics.quality_level.0,
        "tier": statistics.quality_level.0,
        "unheard_sources": statistics.unheard_sources,
        "starved_samples": statistics.underrun_samples,
        "graphics_frame_ms": milliseconds(statistics.graphics_frame_s),
        "dropped_paths": statistics.dropped_paths,
        "cores": format!("{:#b}", heard.placement.cores),
        "pinned": heard.placement.pinned,
        "realtime_priority": heard.placement.realtime_priority,
        "nice": heard.placement.nice,
    });
    if let (Some(outputs), Value::Object(keys)) = (&restless.outputs, &mut result) {
        let changes = [outputs.layout_changes, outputs.hrtf_changes];
        let names = ["layout_changes", "hrtf_changes"];
        let found = names.into_iter().zip(changes.map(Value::from));
        keys.extend(found.map(|(key, value)| (key.to_owned(), value)));
    }
    if let (Some(detector), Value::Object(keys)) = (&listened, &mut result) {
        let found = [
            ("clicks", json!(detector.clicks())),
            ("first_click_s", json!(detector.first_click_s())),
            ("worst_step", json!(detector.worst())),
            ("dc", json!(detector.dc())),
            ("dc_worst_second", json!(detector.worst_second())),
            ("peak", json!(detector.peak())),
        ];
        keys.extend(found.map(|(key, value)| (key.to_owned(), value)));
    }
    if arguments.json {
        outln!("{result}");
    } else {
        printed::row(&result);
    }
}
