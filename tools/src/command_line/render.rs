//! `render`: renders a scene, sounds and a listener to a WAV file, binaural or in another layout.

use std::path::{Path, PathBuf};

use foresound::generation::Layout;
use foresound::output::wav::WavSink;
use foresound::runtime::{Latency, OfflineSettings, Schedule};
use foresound::scene::Scene;
use foresound::{Error, Result};
use foresound_tools::listener_path::ListenerPath;
use serde_json::json;

use crate::hrtf_file::load_hrtf;
use crate::inputs::{
    SceneArguments, SourceArgument, SourcePosition, check_wav_name, counted, keep_inputs,
    load_scene, load_sound, parse_source, predictor_named, print_notes,
};
use crate::placement::{Place, notes};
use crate::session::{MovingPart, Session, Sound, median, milliseconds};

/// Seconds of reverb after the last sound ends.
const TAIL_S: f64 = 1.5;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// OBJ, PLY, glTF or GLB file, or the name of a benchmark scene.
    #[arg(long, value_name = "FILE")]
    scene: PathBuf,
    #[command(flatten)]
    intake: SceneArguments,
    /// Position in metres (+y up) or name in the scene's TOML file, and sound of a source; may be given many times.
    #[arg(
        long = "source",
        value_name = "x,y,z|NAME=voice.wav",
        required = true,
        allow_hyphen_values = true
    )]
    sources: Vec<String>,
    /// Path of a source, by its name or its number from 1: a CSV file as for the listener; may be given many times.
    /// Without angles the source keeps its own direction.
    #[arg(long = "source-path", value_name = "NAME|N=PATH.csv")]
    source_paths: Vec<String>,
    /// Position of the listener, or a CSV file with the columns t,x,y,z and optionally yaw and pitch in degrees. Two rows of
    /// one time are a jump.
    #[arg(long, value_name = "PATH.csv|x,y,z", allow_hyphen_values = true)]
    listener: String,
    /// A moving part: a mesh file in its own coordinates, and the path of its origin as for the listener; may be given
    /// many times.
    #[arg(
        long = "part",
        value_name = "PART.obj=PATH.csv|x,y,z",
        allow_hyphen_values = true
    )]
    parts: Vec<String>,
    /// Layout of the channels: binaural, stereo, mono, 5.1, 7.1, 7.1.4, or ambix1 to ambix3 (Ambisonics in AmbiX form).
    #[arg(long, default_value = "binaural", value_name = "NAME")]
    layout: String,
    /// HRTF set of binaural sound, a SOFA file or a baked one; without it the built-in set.
    #[arg(long, value_name = "FILE")]
    hrtf: Option<PathBuf>,
    /// The WAV file to write: 32-bit float, the layout's channels.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// synchronous or asynchronous.
    #[arg(long, default_value = "asynchronous")]
    schedule: String,
    /// Extrapolation between updates: hold, linear or best.
    #[arg(long, default_value = "best")]
    predictor: String,
    /// Extrapolation level L of the asynchronous schedule.
    #[arg(long, default_value_t = 4)]
    level: u32,
    /// Use each result at once instead of L + 1 graphics frames later.
    #[arg(long)]
    no_latency: bool,
    /// Sample rate in Hz: 44100 or 48000.
    #[arg(long, default_value_t = 44_100, value_name = "HZ")]
    rate: u32,
    /// Graphics frames a second.
    #[arg(long, default_value_t = 60.0, value_name = "HZ")]
    graphics_rate: f64,
    /// Length in seconds; by default to the end of the longest path, or else of the last sound.
    #[arg(long)]
    seconds: Option<f64>,
    /// Repeat sounds that are shorter than the rendering.
    #[arg(long = "loop")]
    looped: bool,
    /// Seed of the rays.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    fn schedule(&self) -> Result<Schedule> {
        let latency = if self.no_latency {
            Latency::None
        } else {
            Latency::Modelled
        };
        match self.schedule.as_str() {
            "synchronous" | "sync" => Ok(Schedule::Synchronous),
            "asynchronous" | "async" => Ok(Schedule::Asynchronous {
                extrapolation_level: self.level,
                latency,
            }),
            other => Err(Error::setting(
                "--schedule",
                format!("{other:?} is no schedule"),
                "give synchronous or asynchronous",
            )),
        }
    }

    fn duration_s(&self, sounds: &[Sound], listener: &ListenerPath) -> Result<f64> {
        let longest = sounds
            .iter()
            .map(|s| s.clip.duration_s() + TAIL_S)
            .fold(0.0, f64::max);
        let paths = sounds.iter().filter_map(|sound| sound.path.as_ref());
        let paths = paths.chain([listener]).filter_map(ListenerPath::duration_s);
        let path_s = paths.reduce(f64::max);
        let duration_s = self.seconds.or(path_s).unwrap_or(longest);
        if duration_s.is_finite() && duration_s > 0.0 && duration_s <= 36_000.0 {
            return Ok(duration_s);
        }
        let problem = format!("{duration_s} s is no length");
        Err(Error::setting(
            "--seconds",
            problem,
            "give a number above 0 and up to 36000",
        ))
    }
}

/// `NAME=walk.csv` or `2=walk.csv`, as the index of the source and its path.
fn source_path(text: &str, sources: &[SourceArgument]) -> Result<(usize, ListenerPath)> {
    let wrong = |problem: String, advice: &str| Error::setting("--source-path", problem, advice);
    let Some((name, file)) = text.split_once('=') else {
        let problem = format!("{text:?} has no path");
        return Err(wrong(problem, "write NAME=walk.csv, or 1=walk.csv"));
    };
    let is_named = |source: &SourceArgument| match &source.position {
        SourcePosition::Named(other) => other == name,
        SourcePosition::At(_) => false,
    };
    let number = name.parse().ok().and_then(|n: usize| n.checked_sub(1));
    let index = sources.iter().position(is_named).or(number);
    let Some(index) = index.filter(|index| *index < sources.len()) else {
        let problem = format!("no --source is called {name:?}");
        return Err(wrong(problem, "give the name of one, or its number from 1"));
    };
    Ok((index, ListenerPath::parse(file)?))
}

/// Files that the command reads.
fn inputs(arguments: &Arguments, sources: &[SourceArgument]) -> Vec<PathBuf> {
    let mut files = arguments.intake.files(&arguments.scene);
    files.extend(sources.iter().map(|source| source.file.clone()));
    files.push(PathBuf::from(&arguments.listener));
    files.extend(arguments.hrtf.clone());
    let pairs = arguments.parts.iter().chain(&arguments.source_paths);
    let both = pairs.filter_map(|text| text.split_once('='));
    files.extend(both.flat_map(|(first, second)| [first.into(), second.into()]));
    files
}

/// `door.obj=door.csv`.
fn load_part(text: &str, intake: &SceneArguments) -> Result<MovingPart> {
    let Some((file, path)) = text.split_once('=') else {
        let problem = format!("{text:?} has no place");
        return Err(Error::setting("--part", problem, "write part.obj=path.csv"));
    };
    let path = ListenerPath::parse(path)?;
    let loaded = load_scene(Path::new(file), intake)?;
    print_notes(&loaded.notes);
    Ok(MovingPart {
        part: loaded.scene,
        path,
    })
}

/// Peak and clipping of what is written.
#[derive(Default)]
struct Levels {
    peak: f32,
    clipped: u64,
    /// Sum of squares of what counts as the layout's energy.
    energy: f64,
    frames: u64,
}

impl Levels {
    fn add(&mut self, block: &[f32], layout: Layout) {
        let channels = layout.channels();
        // The omnidirectional channel of Ambisonics stands for all.
        let counted = layout.ambisonics_order().map_or(channels, |_| 1);
        for frame in block.chunks_exact(channels) {
            let squares = frame[..counted].iter().map(|s| f64::from(*s).powi(2));
            self.energy += squares.sum::<f64>();
            self.frames += 1;
        }
        for sample in block {
            self.peak = self.peak.max(sample.abs());
            self.clipped += u64::from(sample.abs() > 1.0);
        }
    }

    /// Mean energy over all channels in dB re full scale; `None` for silence.
    fn energy_db(&self) -> Option<f64> {
        (self.energy > 0.0).then(|| 10.0 * (self.energy / self.frames as f64).log10())
    }

    /// Peak in dB re full scale; `None` for silence.
    fn peak_db(&self) -> Option<f64> {
        (self.peak > 0.0).then(|| 20.0 * f64::from(self.peak).log10())
    }

    fn notes(&self) -> Vec<String> {
        match (self.peak, self.clipped) {
            (0.0, _) => vec!["the result is silent".to_owned()],
            (_, 0) => Vec::new(),
            (_, clipped) => vec![format!(
                "{} beyond full scale: 16-bit copies of the file clip there",
                counted(clipped as usize, "sample")
            )],
        }
    }
}

/// Notes on places without sound: of the sources, and of the listener, at the beginning.
fn placement_notes(
    scene: &Scene,
    sounds: &[Sound],
    sources: &[SourceArgument],
    listener: &ListenerPath,
) -> Vec<String> {
    let pairs = sounds.iter().zip(sources).enumerate();
    let places: Vec<Place> = pairs
        .map(|(index, (sound, source))| Place {
            what: match &source.position {
                SourcePosition::Named(name) => format!("the source {name}"),
                SourcePosition::At(_) => format!("source {}", index + 1),
            },
            position: sound.source.position,
        })
        .collect();
    let ear = Place {
        what: "the listener".to_owned(),
        position: listener.at(0.0).position,
    };
    notes(scene, &places, &ear)
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let schedule = arguments.schedule()?;
    let predictor = predictor_named(&arguments.predictor)?;
    let sources: Vec<_> = arguments
        .sources
        .iter()
        .map(|s| parse_source(s))
        .collect::<Result<_>>()?;
    let inputs = inputs(arguments, &sources);
    keep_inputs(&arguments.out, inputs.iter().map(PathBuf::as_path))?;
    check_wav_name(&arguments.out)?;
    let listener = ListenerPath::parse(&arguments.listener)?;
    let layout: Layout = arguments.layout.parse()?;
    let hrtf = load_hrtf(arguments.hrtf.as_deref(), layout, arguments.rate)?;
    let loaded = load_scene(&arguments.scene, &arguments.intake)?;
    print_notes(&loaded.notes);
    let parts: Vec<_> = arguments
        .parts
        .iter()
        .map(|text| load_part(text, &arguments.intake))
        .collect::<Result<_>>()?;
    let mut sounds = Vec::with_capacity(sources.len());
    for (slot, source) in sources.iter().enumerate() {
        let pose = source.position.pose(slot, loaded.layout.as_ref())?;
        let clip = load_sound(&source.file, arguments.rate)?;
        sounds.push(Sound {
            source: pose,
            clip,
            looped: arguments.looped,
            path: None,
        });
    }
    for text in &arguments.source_paths {
        let (index, path) = source_path(text, &sources)?;
        sounds[index].path = Some(path);
    }
    print_notes(&placement_notes(
        &loaded.scene,
        &sounds,
        &sources,
        &listener,
    ));
    let duration_s = arguments.duration_s(&sounds, &listener)?;
    let mut settings = OfflineSettings::default();
    settings.graphics_rate_hz = arguments.graphics_rate;
    settings.block_frames = 1024;
    settings.schedule = schedule;
    settings.predictor = predictor;
    settings.propagation.seed = arguments.seed;
    settings.generation.rate_hz = arguments.rate;
    settings.generation.layout = layout;
    settings.generation.max_sources = sounds.len();
    let session = Session {
        what: "render",
        scene: &loaded.scene,
        hrtf: &hrtf,
        parts: &parts,
        sounds: &sounds,
        listener: &listener,
        duration_s,
        settings,
    };
    let mut sink = WavSink::create(&arguments.out, arguments.rate, layout.channels() as u16)?;
    sink.set_positions(layout.wav_mask());
    let mut levels = Levels::default();
    let rendered = session.render(&mut |block| {
        levels.add(block, layout);
        sink.write(block)
    })?;
    sink.finish()?;
    print_notes(&levels.notes());
    let report = &rendered.report;
    let sps_ms = milliseconds(&report.propagation);
    if arguments.json {
        let value = json!({
            "out": arguments.out.to_string_lossy(),
            "seconds": duration_s,
            "updates": report.paths.len(),
            "rays_per_update": median(&report.rays),
            "paths_p50": median(&report.paths),
            "level": schedule.extrapolation_level(),
            "sps_ms_p50": median(&sps_ms),
            "dropped_paths": report.dropped_paths,
            "layout": layout.name(),
            "channels": layout.channels(),
            "peak_db": levels.peak_db(),
            "energy_db": levels.energy_db(),
            "clipped_samples": levels.clipped,
        });
        outln!("{value}");
    } else {
        outln!(
            "{}: {duration_s:.2} s, {layout}, {}, peak {}, {}, {} and {:.2} ms an update",
            arguments.out.display(),
            counted(sounds.len(), "source"),
            levels
                .peak_db()
                .map_or("none".to_owned(), |db| format!("{db:.1} dB")),
            counted(median(&report.paths) as usize, "path"),
            counted(median(&report.rays) as usize, "ray"),
            median(&sps_ms)
        );
    }
    Ok(())
}
