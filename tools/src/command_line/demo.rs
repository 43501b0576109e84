//! `demo`: a walk through the concert hall by both schedules, as sound and pictures.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use foresound::extrapolation::{GeometricSettings, PredictorKind};
use foresound::generation::Hrtf;
use foresound::output::wav::WavSink;
use foresound::runtime::{Latency, OfflineSettings, Schedule};
use foresound::scene::SourceId;
use foresound::{Error, Result};
use foresound_tools::listener_path::ListenerPath;
use foresound_tools::si_snr::si_snr_ears_db;
use foresound_tools::spectrogram_figure::SpectrogramFigure;
use foresound_tools::top_view::{TopView, path_lines};
use serde_json::json;

use crate::inputs::{LoadedScene, SceneArguments, load_scene, print_notes, voice, within};
use crate::session::{Rendered, Session, Sound, median, milliseconds};

/// Sample rate of the speech.
const RATE_HZ: u32 = 44_100;

/// Graphics frames a second and level L: the paper's concert hall with sixteen sources on a workstation.
const GRAPHICS_RATE_HZ: f64 = 74.6;
const LEVEL: u32 = 12;
const PREDICTOR: PredictorKind = PredictorKind::Geometric(GeometricSettings::FULL);

/// Height in metres of the top view's cut: above the last row of seats.
const HALL_CUT_M: f32 = 3.2;

/// Number of speaking sources.
const SOURCES: usize = 4;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Output folder.
    #[arg(long, default_value = "out/demo")]
    out: PathBuf,
    /// Length of the walk in seconds.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

impl Default for Arguments {
    fn default() -> Self {
        Self {
            out: "out/demo".into(),
            seconds: 10.0,
            json: false,
        }
    }
}

/// One schedule's rendering.
struct Walked {
    file: PathBuf,
    rendered: Rendered,
    ears: [Vec<f32>; 2],
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    within("--seconds", arguments.seconds, 1.0..=600.0, " s")?;
    let hall = load_scene(Path::new("concert_hall"), &SceneArguments::default())?;
    print_notes(&hall.notes);
    let layout = hall.layout.as_ref().filter(|l| l.sources.len() >= SOURCES);
    let (Some(layout), Some(walk)) = (layout, hall.walk()) else {
        return Err(Error::file(
            "assets/scenes/concert_hall.toml",
            "has no walk or too few sources",
            "restore it with `foresound scenes`",
        ));
    };
    let mut sounds = Vec::new();
    for (number, source) in layout.sources.iter().take(SOURCES).enumerate() {
        sounds.push(Sound {
            source: source.pose(SourceId::new(number as u16, 0)),
            clip: voice(number, RATE_HZ)?,
            looped: true,
            path: None,
        });
    }
    let hrtf = Arc::new(Hrtf::builtin(RATE_HZ)?);
    let listener = ListenerPath::Walking(walk);
    let walk_once = |name: &'static str, schedule| -> Result<Walked> {
        let session = Session {
            what: name,
            scene: &hall.scene,
            hrtf: &hrtf,
            parts: &[],
            sounds: &sounds,
            listener: &listener,
            duration_s: arguments.seconds,
            settings: settings(schedule),
        };
        let file = arguments.out.join(format!("{name}.wav"));
        let mut sink = WavSink::create(&file, RATE_HZ, 2)?;
        let mut ears = [Vec::new(), Vec::new()];
        let rendered = session.render(&mut |block| {
            for stereo in block.chunks_exact(2) {
                ears[0].push(stereo[0]);
                ears[1].push(stereo[1]);
            }
            sink.write(block)
        })?;
        sink.finish()?;
        Ok(Walked {
            file,
            rendered,
            ears,
        })
    };
    let synchronous = walk_once("synchronous", Schedule::Synchronous)?;
    let late = Schedule::Asynchronous {
        extrapolation_level: LEVEL,
        latency: Latency::Modelled,
    };
    let asynchronous = walk_once("asynchronous", late)?;
    let si_snr_db = si_snr_ears_db(
        [&synchronous.ears[0], &synchronous.ears[1]],
        [&asynchronous.ears[0], &asynchronous.ears[1]],
    );
    let figures = draw(arguments, &hall, &synchronous, &asynchronous, si_snr_db)?;
    print_findings(
        arguments,
        &hall,
        &synchronous,
        &asynchronous,
        si_snr_db,
        &figures,
    );
    Ok(())
}

fn settings(schedule: Schedule) -> OfflineSettings {
    let mut settings = OfflineSettings::default();
    settings.graphics_rate_hz = GRAPHICS_RATE_HZ;
    settings.block_frames = 1024;
    settings.schedule = schedule;
    settings.predictor = PREDICTOR;
    settings.generation.rate_hz = RATE_HZ;
    settings.generation.max_sources = SOURCES;
    settings
}

/// Draws the spectrograms and the top view and returns their files.
fn draw(
    arguments: &Arguments,
    hall: &LoadedScene,
    synchronous: &Walked,
    asynchronous: &Walked,
    si_snr_db: f64,
) -> Result<[PathBuf; 2]> {
    let spectrograms = arguments.out.join("spectrograms.png");
    let predictor = PREDICTOR.name();
    let caption = format!(
        "concert_hall, {SOURCES} sources, L = {LEVEL}, {predictor}: SI-SNR {si_snr_db:.1} dB"
    );
    SpectrogramFigure {
        title: "A walk through the hall by both schedules",
        caption: &caption,
        rate_hz: RATE_HZ,
        reference_label: "synchronous",
        estimate_label: "asynchronous",
        reference: &[&synchronous.ears[0], &synchronous.ears[1]],
        estimate: &[&asynchronous.ears[0], &asynchronous.ears[1]],
    }
    .draw()?
    .save_png(&spectrograms)?;
    let top_view = arguments.out.join("top_view.png");
    let middle = &synchronous.rendered.middle;
    let triangles: Vec<_> = hall.scene.triangles().collect();
    let names = hall
        .layout
        .iter()
        .flat_map(|layout| &layout.sources)
        .take(SOURCES);
    let sources: Vec<_> = names
        .map(|source| (source.position, source.name.clone()))
        .collect();
    let caption = format!(
        "{} paths in the middle of the walk, {} triangles in {} surfaces",
        middle.paths.len(),
        hall.scene.report().triangles,
        hall.scene.surfaces().len()
    );
    TopView {
        title: "concert_hall from above",
        caption: &caption,
        triangles: &triangles,
        sources: &sources,
        walk: hall.walk().map(|walk| [walk.from, walk.to]),
        listener: Some(middle.listener),
        paths: &path_lines(middle),
        cut_height_m: Some(HALL_CUT_M),
    }
    .draw()?
    .save_png(&top_view)?;
    Ok([spectrograms, top_view])
}

fn print_findings(
    arguments: &Arguments,
    hall: &LoadedScene,
    synchronous: &Walked,
    asynchronous: &Walked,
    si_snr_db: f64,
    figures: &[PathBuf],
) {
    let stage_ms = |times| median(&milliseconds(times));
    let reports = [&synchronous.rendered.report, &asynchronous.rendered.report];
    let files: Vec<&PathBuf> = [&synchronous.file, &asynchronous.file]
        .into_iter()
        .chain(figures)
        .collect();
    let triangles = hall.scene.report().triangles;
    let surfaces = hall.scene.surfaces().len();
    if arguments.json {
        let value = json!({
            "triangles": triangles,
            "surfaces": surfaces,
            "rays_per_update": median(&reports[0].rays),
            "paths_p50": median(&reports[0].paths),
            "level": LEVEL,
            "si_snr_db": si_snr_db,
            "sps_ms_p50": stage_ms(&reports[0].propagation),
            "eps_ms_p50": stage_ms(&reports[1].extrapolation),
            "sgs_ms_p50": stage_ms(&reports[0].generation),
            "graphics_rate_hz": GRAPHICS_RATE_HZ,
            "updates": [reports[0].paths.len(), reports[1].paths.len()],
            "dropped_paths": reports[0].dropped_paths + reports[1].dropped_paths,
            "files": files,
        });
        outln!("{value}");
        return;
    }
    outln!(
        "A walk of {:.1} s through concert_hall, {SOURCES} voices",
        arguments.seconds
    );
    outln!("  scene          {triangles} triangles, {surfaces} surfaces");
    outln!(
        "  propagation    {} rays, {} paths an update",
        median(&reports[0].rays),
        median(&reports[0].paths)
    );
    outln!(
        "  synchronous    an update every graphics frame, {} in all",
        reports[0].paths.len()
    );
    outln!(
        "  asynchronous   an update every {} graphics frames (L = {LEVEL}), {} in all",
        LEVEL + 1,
        reports[1].paths.len()
    );
    outln!(
        "  time           propagation {:.2} ms an update; of a graphics frame ({:.1} ms) extrapolation {:.3} ms, generation {:.2} ms",
        stage_ms(&reports[0].propagation),
        1e3 / GRAPHICS_RATE_HZ,
        stage_ms(&reports[1].extrapolation),
        stage_ms(&reports[0].generation)
    );
    let predictor = PREDICTOR.name();
    outln!("  similarity     SI-SNR {si_snr_db:.2} dB between the two, predictor {predictor}");
    for file in files {
        outln!("  written        {}", file.display());
    }
}
