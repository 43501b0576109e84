//! The paper's Table 4 on this machine, as a standalone program: for `adb shell` (see android/README.md) and others.
//!
//! `table_four [SECONDS [SCENE...]]`: seconds per schedule and cell (default 2), scenes (default all three). Each cell is
//! measured with threads placed by the system and on the fastest cores. A graphics frame is a tick and 1/60 s of sound, as
//! fast as possible. Prints one line per cell to standard error and one JSON object to standard output.
#![expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
#![expect(clippy::print_stdout, reason = "the result")]

use std::sync::Arc;
use std::time::Instant;

use foresound::diagnostics::Statistics;
use foresound::glam::Vec3;
use foresound::scene::layout::Walk;
use foresound::scene::procedural;
use foresound::{
    AffinityPolicy, Engine, EngineSchedule, EngineSettings, Error, ListenerPose, MaterialTable,
    Result, Scene, SceneSettings,
};

/// The paper's figures: scene, sources, frames per second of the synchronous and the asynchronous schedule.
const PAPER: &str = include_str!("../assets/paper/paper_table_4.csv");
const RATE_HZ: u32 = 48_000;
/// Audio frames of a graphics frame: 1/60 s.
const FRAMES: usize = 800;
/// Graphics frames before the clock starts.
const WARM_UP: u64 = 40;

/// One row of the paper's table.
struct Cell {
    scene: &'static str,
    sources: usize,
    paper_fps: [f64; 2],
}

fn cells() -> impl Iterator<Item = Cell> {
    PAPER.lines().skip(1).filter_map(|line| {
        let mut words = line.split(',');
        Some(Cell {
            scene: words.next()?,
            sources: words.next()?.parse().ok()?,
            paper_fps: [words.next()?.parse().ok()?, words.next()?.parse().ok()?],
        })
    })
}

/// A scene with its sources and walk.
struct Stage {
    scene: Arc<Scene>,
    positions: Vec<Vec3>,
    walk: Walk,
}

fn stage(name: &str) -> Result<Stage> {
    let benchmark = procedural::by_name(name).ok_or_else(|| {
        let advice = "name concert_hall, bootcamp or angrybot";
        Error::setting("scene", format!("{name} is none"), advice)
    })?;
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default())?;
    let walk = &benchmark.walk;
    Ok(Stage {
        scene: Arc::new(scene),
        positions: benchmark
            .sources
            .iter()
            .map(|(_, position)| *position)
            .collect(),
        walk: Walk {
            from: walk.from,
            to: walk.to,
            speed_m_s: walk.speed_m_s.into(),
            standing: walk.standing,
        },
    })
}

/// A speech-like signal: bursts of deterministic noise.
fn signal(number: u32) -> Arc<[f32]> {
    let mut state = 12_345 + number;
    let mut sample = |n: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = ((state >> 16) as i32 - 32_768) as f32 / 262_144.0;
        if n % 12_000 < 8_000 { noise } else { 0.0 }
    };
    (0..2 * RATE_HZ).map(&mut sample).collect()
}

/// Result of one schedule in a cell.
struct Measured {
    fps: f64,
    statistics: Statistics,
}

fn measure(
    stage: &Stage,
    sources: usize,
    schedule: EngineSchedule,
    affinity: AffinityPolicy,
    seconds: f64,
) -> Result<Measured> {
    let mut settings = EngineSettings::default();
    settings.schedule = schedule;
    settings.affinity = affinity;
    settings.block_frames = FRAMES;
    settings.generation.rate_hz = RATE_HZ;
    settings.generation.max_sources = sources;
    let (mut controller, mut renderer) = Engine::new(settings)?;
    controller.set_scene(Arc::clone(&stage.scene))?;
    for (number, position) in (0..).zip(stage.positions.iter().take(sources)) {
        let id = controller.add_source(*position)?;
        controller.play(id, signal(number), true)?;
    }
    // This thread renders the sound, so it gets sound's core and priority until it ends.
    renderer.place_thread();
    let mut block = vec![0.0; 2 * FRAMES];
    let mut frame = 0u64;
    let mut next_frame = || -> Result<u64> {
        let at = stage.walk.position_at(frame as f64 / 60.0, 0.0);
        controller.tick(ListenerPose::facing(at, 0.0), &[])?;
        renderer.render(&mut block);
        frame += 1;
        Ok(controller.statistics().updates)
    };
    let mut warm = 0;
    while next_frame()? < 20 || warm < WARM_UP {
        warm += 1;
    }
    let (began, mut frames) = (Instant::now(), 0u32);
    let mut passed_s = 0.0;
    while passed_s < seconds {
        next_frame()?;
        frames += 1;
        passed_s = began.elapsed().as_secs_f64();
    }
    Ok(Measured {
        fps: f64::from(frames) / passed_s,
        statistics: controller.statistics(),
    })
}

/// A row of JSON; numbers only, so nothing needs escaping.
fn row(cell: &Cell, pinned: bool, [baseline, ours]: &[Measured; 2]) -> String {
    let now = &ours.statistics;
    let heat = now.device_hints.reading;
    format!(
        "{{\"scene\":\"{}\",\"sources\":{},\"pinned\":{pinned},\"synchronous_fps\":{:.2},\"asynchronous_fps\":{:.2},\
         \"speedup\":{:.3},\"paper_synchronous_fps\":{},\"paper_asynchronous_fps\":{},\"update_p50_ms\":{:.3},\
         \"update_p95_ms\":{:.3},\"level\":{},\"tier\":{},\"paths\":{},\"block_p50_ms\":{:.3},\"block_worst_ms\":{:.3},\
         \"propagation_cores\":{},\"sound_cores\":{},\"thermal_headroom\":{},\"thermal_status\":{}}}",
        cell.scene,
        cell.sources,
        baseline.fps,
        ours.fps,
        ours.fps / baseline.fps,
        cell.paper_fps[0],
        cell.paper_fps[1],
        1e3 * now.propagation.p50_s,
        1e3 * now.propagation.p95_s,
        now.extrapolation_level,
        now.quality_level.0,
        now.paths,
        1e3 * now.block.p50_s,
        1e3 * now.block.worst_s,
        now.propagation_placement.cores,
        now.sound_placement.cores,
        heat.headroom.map_or("null".into(), |h| h.to_string()),
        heat.status.map_or("null".into(), |s| s.to_string()),
    )
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let seconds = arguments.next().unwrap_or_else(|| "2".into());
    let seconds = seconds.parse().ok().filter(|s| (0.01..=600.0).contains(s));
    let seconds = seconds.ok_or_else(|| {
        let advice = "give 0.01 to 600, then scenes";
        Error::setting("seconds", "that is no such number", advice)
    })?;
    let chosen: Vec<String> = arguments.collect();
    let mut rows = Vec::new();
    let mut last: Option<(&str, Stage)> = None;
    for name in &chosen {
        stage(name)?;
    }
    let is_chosen = |cell: &Cell| chosen.is_empty() || chosen.iter().any(|name| name == cell.scene);
    for cell in cells().filter(is_chosen) {
        if last.as_ref().is_none_or(|(name, _)| *name != cell.scene) {
            last = Some((cell.scene, stage(cell.scene)?));
        }
        let Some((_, stage)) = &last else { continue };
        let sources = cell.sources;
        for (affinity, pinned) in [
            (AffinityPolicy::System, false),
            (AffinityPolicy::Fastest, true),
        ] {
            // On a new thread, because core and priority cannot be reset.
            let both = std::thread::scope(|scope| {
                [EngineSchedule::Synchronous, EngineSchedule::Asynchronous].map(|schedule| {
                    let run = move || measure(stage, sources, schedule, affinity, seconds);
                    scope.spawn(run).join().unwrap_or_else(|_| {
                        let advice = "report this with the output above";
                        Err(Error::engine("the measurement panicked", advice))
                    })
                })
            });
            let [baseline, ours] = both;
            let both = [baseline?, ours?];
            eprintln!(
                "{:14} {:2} sources, pinned {pinned}: {:7.1} FPS synchronous, {:7.1} asynchronous ({:.2} x; paper {} and {}), T_SPS {:.2} ms, L {}",
                cell.scene,
                cell.sources,
                both[0].fps,
                both[1].fps,
                both[1].fps / both[0].fps,
                cell.paper_fps[0],
                cell.paper_fps[1],
                1e3 * both[1].statistics.propagation.p50_s,
                both[1].statistics.extrapolation_level,
            );
            rows.push(row(&cell, pinned, &both));
        }
    }
    println!(
        "{{\"benchmark\":\"table 4\",\"seconds\":{seconds},\"arch\":\"{}\",\"os\":\"{}\",\"cores\":{},\"rows\":[{}]}}",
        std::env::consts::ARCH,
        std::env::consts::OS,
        std::thread::available_parallelism().map_or(0, usize::from),
        rows.join(",")
    );
    Ok(())
}
