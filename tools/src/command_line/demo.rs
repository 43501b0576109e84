//! `demo`: a walk through the concert hall or any other scene by both schedules, through the engine on a virtual clock, as sound
//! and pictures.

use std::path::PathBuf;
use std::sync::Arc;

use foresound::Result;
use foresound::output::wav::WavSink;
use foresound::propagation::{PathSet, Propagator};
use foresound::runtime::engine::Statistics;
use foresound::runtime::{Controller, EngineSchedule, EngineSettings, Poses, VirtualClock};
use foresound::scene::layout::{NamedSource, Walk};
use foresound::scene::{ListenerPose, SourceId, SourcePose};
use foresound_tools::clip::Clip;
use foresound_tools::si_snr::si_snr_ears_db;
use foresound_tools::spectrogram_figure::SpectrogramFigure;
use foresound_tools::top_view::{TopView, path_lines};
use serde_json::json;

use crate::engine_walk::{EngineWalk, Observed};
use crate::inputs::{LoadedScene, SceneArguments, counted, load_scene, print_notes, voice, within};
use crate::laid_out::{LaidOut, laid_out, scene_label};
use crate::progress::Progress;
use crate::session::median;

/// Sample rate of the speech.
const RATE_HZ: u32 = 44_100;

/// Graphics frames a second and level L: the paper's concert hall with sixteen sources on a workstation.
const GRAPHICS_RATE_HZ: f64 = 74.6;
const LEVEL: u32 = 12;

/// The scene without `--scene`, and the height in metres of its top view's cut: above the last row of seats.
const HALL: &str = "concert_hall";
const HALL_CUT_M: f32 = 3.2;

/// Most speaking sources.
const SOURCES: usize = 4;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Output folder.
    #[arg(long, default_value = "out/demo")]
    out: PathBuf,
    /// A scene instead of the concert hall: a name, or a mesh file. Without a layout beside it (FILE.toml), sources and a walk are put
    /// in open space.
    #[arg(long, value_name = "FILE|NAME", default_value = HALL)]
    scene: PathBuf,
    #[command(flatten)]
    intake: SceneArguments,
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
            scene: HALL.into(),
            intake: SceneArguments::default(),
            seconds: 10.0,
            json: false,
        }
    }
}

/// What is heard, and where.
struct Performance<'a> {
    /// The scene's name in texts.
    named: String,
    loaded: &'a LoadedScene,
    walk: Walk,
    sources: Vec<NamedSource>,
    poses: Vec<SourcePose>,
    voices: Vec<Clip>,
    seconds: f64,
}

/// One schedule's rendering.
struct Walked {
    file: PathBuf,
    ears: [Vec<f32>; 2],
    observed: Observed,
    /// Updates while the voices sound.
    updates: u64,
    statistics: Statistics,
    blocks_per_graphics_frame: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    within("--seconds", arguments.seconds, 1.0..=600.0, " s")?;
    let loaded = load_scene(&arguments.scene, &arguments.intake)?;
    print_notes(&loaded.notes);
    let named = arguments.scene.display().to_string();
    let LaidOut { sources, walk } = laid_out(&named, &loaded, SOURCES)?;
    let poses = sources.iter().enumerate();
    let poses = poses.map(|(number, source)| source.pose(SourceId::new(number as u16, 0)));
    let performance = Performance {
        named: scene_label(&named),
        loaded: &loaded,
        walk,
        poses: poses.collect(),
        voices: (0..sources.len())
            .map(|number| voice(number, RATE_HZ))
            .collect::<Result<_>>()?,
        sources,
        seconds: arguments.seconds,
    };
    let file = |name: &str| arguments.out.join(format!("{name}.wav"));
    let synchronous = performance.render(EngineSchedule::Synchronous, file("synchronous"))?;
    let asynchronous = performance.render(EngineSchedule::Asynchronous, file("asynchronous"))?;
    let si_snr_db = si_snr_ears_db(
        [&synchronous.ears[0], &synchronous.ears[1]],
        [&asynchronous.ears[0], &asynchronous.ears[1]],
    );
    let both = [&synchronous, &asynchronous];
    let figures = draw(arguments, &performance, both, si_snr_db)?;
    print_findings(arguments, &performance, both, si_snr_db, &figures);
    Ok(())
}

impl Performance<'_> {
    fn poses_at(&self, time_s: f64) -> Poses {
        Poses {
            listener: ListenerPose::facing(self.walk.position_at(time_s, 0.0), 0.0),
            sources: self.poses.clone(),
        }
    }

    fn play(&self, controller: &mut Controller, ids: &[SourceId]) -> Result<()> {
        for (id, voice) in ids.iter().zip(&self.voices) {
            controller.play(*id, voice.samples.clone().into(), true)?;
        }
        Ok(())
    }

    /// Renders one schedule into a WAV file.
    fn render(&self, schedule: EngineSchedule, file: PathBuf) -> Result<Walked> {
        let mut settings = EngineSettings::default();
        settings.generation.rate_hz = RATE_HZ;
        settings.generation.max_sources = self.poses.len();
        settings.schedule = schedule;
        let clock = VirtualClock::at_level(GRAPHICS_RATE_HZ, LEVEL);
        let mut sink = WavSink::create(&file, RATE_HZ, 2)?;
        let first = self.poses_at(0.0);
        let scene = &self.loaded.scene;
        let mut walk = EngineWalk::begin(settings, clock, scene, &first, |controller, ids| {
            self.play(controller, ids)
        })?;
        let before = walk.statistics().updates;
        let mut observed = Observed::after(before);
        let mut sound = Vec::new();
        let frames = (self.seconds * GRAPHICS_RATE_HZ).ceil() as u64;
        let what = match schedule {
            EngineSchedule::Synchronous => "synchronous",
            EngineSchedule::Asynchronous => "asynchronous",
        };
        let mut progress = Progress::new(what, frames);
        for _ in 0..frames {
            let mut poses = self.poses_at(walk.time_s());
            walk.next_frame(&mut poses, |block| sound.extend_from_slice(block))?;
            observed.add(&walk.statistics());
            progress.step();
        }
        sink.write(&sound)?;
        sink.finish()?;
        let ear = |ear: usize| sound.iter().copied().skip(ear).step_by(2).collect();
        let audio_frames = f64::from(RATE_HZ) / GRAPHICS_RATE_HZ;
        Ok(Walked {
            file,
            ears: [ear(0), ear(1)],
            updates: observed.updates - before,
            observed,
            statistics: walk.statistics(),
            blocks_per_graphics_frame: audio_frames / walk.block_frames() as f64,
        })
    }

    /// The paths in the middle of the walk.
    fn middle(&self) -> Result<PathSet> {
        let scene = Arc::clone(&self.loaded.scene);
        let settings = EngineSettings::default().propagation;
        let mut propagator = Propagator::new(scene, settings)?;
        let poses = self.poses_at(0.5 * self.seconds);
        let mut middle = PathSet::default();
        propagator.warm_up(&poses.listener, &poses.sources);
        propagator.update(&poses.listener, &poses.sources, 0.0, &mut middle);
        Ok(middle)
    }
}

/// The engine's predictor.
fn predictor() -> &'static str {
    EngineSettings::default().predictor.name()
}

/// Draws the spectrograms and the top view and returns their files.
fn draw(
    arguments: &Arguments,
    performance: &Performance<'_>,
    [synchronous, asynchronous]: [&Walked; 2],
    si_snr_db: f64,
) -> Result<[PathBuf; 2]> {
    let scene = &performance.loaded.scene;
    let named = &performance.named;
    let count = counted(performance.sources.len(), "source");
    let spectrograms = arguments.out.join("spectrograms.png");
    let predictor = predictor();
    let caption = format!("{named}, {count}, L = {LEVEL}, {predictor}: SI-SNR {si_snr_db:.1} dB");
    SpectrogramFigure {
        title: &format!("A walk through {named} by both schedules"),
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
    let middle = performance.middle()?;
    let triangles: Vec<_> = scene.triangles().collect();
    let sources: Vec<_> = performance
        .sources
        .iter()
        .map(|source| (source.position, source.name.clone()))
        .collect();
    let caption = format!(
        "{} paths in the middle of the walk, {} triangles in {} surfaces",
        middle.paths.len(),
        scene.report().triangles,
        scene.surfaces().len()
    );
    TopView {
        title: &format!("{named} from above"),
        caption: &caption,
        triangles: &triangles,
        sources: &sources,
        walk: Some([performance.walk.from, performance.walk.to]),
        listener: Some(middle.listener),
        paths: &path_lines(&middle),
        cut_height_m: (named == HALL).then_some(HALL_CUT_M),
    }
    .draw()?
    .save_png(&top_view)?;
    Ok([spectrograms, top_view])
}

fn print_findings(
    arguments: &Arguments,
    performance: &Performance<'_>,
    [synchronous, asynchronous]: [&Walked; 2],
    si_snr_db: f64,
    figures: &[PathBuf],
) {
    let files: Vec<&PathBuf> = [&synchronous.file, &asynchronous.file]
        .into_iter()
        .chain(figures)
        .collect();
    let scene = &performance.loaded.scene;
    let triangles = scene.report().triangles;
    let surfaces = scene.surfaces().len();
    let rays = median(&synchronous.observed.rays);
    let paths = median(&synchronous.observed.paths);
    let level = median(&asynchronous.observed.levels);
    let update_ms = 1e3 * synchronous.statistics.propagation.p50_s;
    let of_frame = &asynchronous.statistics;
    let extrapolation_ms = 1e3 * (of_frame.direct.p50_s + of_frame.extrapolation.p50_s);
    let generation_ms = 1e3 * of_frame.generation.p50_s * asynchronous.blocks_per_graphics_frame;
    let predictor = predictor();
    if arguments.json {
        let dropped = [synchronous, asynchronous].map(|walked| walked.statistics.dropped_paths);
        let value = json!({
            "scene": performance.named,
            "triangles": triangles,
            "surfaces": surfaces,
            "rays_per_update": rays,
            "paths_p50": paths,
            "predictor": predictor,
            "level": level,
            "si_snr_db": si_snr_db,
            "sps_ms_p50": update_ms,
            "eps_ms_p50": extrapolation_ms,
            "sgs_ms_p50": generation_ms,
            "graphics_rate_hz": GRAPHICS_RATE_HZ,
            "updates": [synchronous.updates, asynchronous.updates],
            "dropped_paths": dropped.iter().sum::<u64>(),
            "files": files,
        });
        outln!("{value}");
        return;
    }
    outln!(
        "A walk of {:.1} s through {}, {}, through the engine on a virtual clock",
        arguments.seconds,
        performance.named,
        counted(performance.voices.len(), "voice")
    );
    outln!("  scene          {triangles} triangles, {surfaces} surfaces");
    outln!("  propagation    {rays} rays, {paths} paths an update");
    outln!(
        "  synchronous    an update every graphics frame, {} in all",
        synchronous.updates
    );
    outln!(
        "  asynchronous   an update every {} graphics frames (L = {level}), {} in all",
        level + 1.0,
        asynchronous.updates
    );
    outln!(
        "  time           propagation {update_ms:.2} ms an update; of a graphics frame ({:.1} ms) extrapolation {extrapolation_ms:.3} ms, generation {generation_ms:.2} ms",
        1e3 / GRAPHICS_RATE_HZ
    );
    outln!("  similarity     SI-SNR {si_snr_db:.2} dB between the two, predictor {predictor}");
    for file in files {
        outln!("  written        {}", file.display());
    }
}
