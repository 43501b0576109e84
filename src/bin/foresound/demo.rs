//! `demo`: a walk through the concert hall, both ways, heard and seen.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use foresound::evaluation::si_snr::si_snr_ears_db;
use foresound::extrapolation::PredictorKind;
use foresound::generation::{GeneratorSettings, Hrtf};
use foresound::output::wav::WavSink;
use foresound::propagation::PropagationSettings;
use foresound::runtime::{Latency, OfflineSettings, Schedule};
use foresound::{Error, Result};
use serde_json::json;

use crate::inputs::{LoadedScene, SceneArguments, asset, load_scene, load_sound, tell};
use crate::listener_path::ListenerPath;
use crate::session::{Rendered, Session, Sound, median};

/// Sample rate of the speech.
const RATE_HZ: u32 = 44_100;

/// Graphics frames a second and level L: the paper's concert hall with sixteen sources on a workstation.
const GRAPHICS_RATE_HZ: f64 = 74.6;
const LEVEL: u32 = 12;

/// Sources that speak.
const SOURCES: usize = 4;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Folder for what is written.
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
        Self { out: "out/demo".into(), seconds: 10.0, json: false }
    }
}

/// One schedule's rendering with its sound.
struct Walked {
    file: PathBuf,
    rendered: Rendered,
    ears: [Vec<f32>; 2],
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if !(1.0..=600.0).contains(&arguments.seconds) {
        let problem = format!("{} s is no walk", arguments.seconds);
        return Err(Error::setting("--seconds", problem, "give 1 to 600"));
    }
    let hall = load_scene(Path::new("concert_hall"), &SceneArguments::default())?;
    tell(&hall.notes);
    let layout = hall.layout.as_ref().filter(|l| l.sources.len() >= SOURCES);
    let walk = layout.and_then(|l| l.listener);
    let (Some(layout), Some(walk)) = (layout, walk) else {
        return Err(Error::file(
            "assets/scenes/concert_hall.toml",
            "has no walk or too few sources",
            "restore it with `foresound scenes`",
        ));
    };
    let mut sounds = Vec::new();
    for (number, source) in layout.sources.iter().take(SOURCES).enumerate() {
        let file = asset(&format!("speech/voice{:02}.wav", number + 1))?;
        let clip = load_sound(&file, RATE_HZ)?;
        sounds.push(Sound { position: source.position, clip, looped: true });
    }
    let hrtf = Arc::new(Hrtf::builtin(RATE_HZ)?);
    let listener = ListenerPath::Walking(walk);
    let walk_once = |name: &'static str, schedule| -> Result<Walked> {
        let session = Session {
            what: name,
            scene: &hall.scene,
            hrtf: &hrtf,
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
        Ok(Walked { file, rendered, ears })
    };
    let synchronous = walk_once("synchronous", Schedule::Synchronous)?;
    let late = Schedule::Asynchronous { level: LEVEL, latency: Latency::Modelled };
    let asynchronous = walk_once("asynchronous", late)?;
    let si_snr_db = si_snr_ears_db(
        [&synchronous.ears[0], &synchronous.ears[1]],
        [&asynchronous.ears[0], &asynchronous.ears[1]],
    );
    let figures = draw(arguments, &hall, &synchronous, &asynchronous, si_snr_db)?;
    print_findings(arguments, &hall, &synchronous, &asynchronous, si_snr_db, &figures);
    Ok(())
}

fn settings(schedule: Schedule) -> OfflineSettings {
    OfflineSettings {
        graphics_rate_hz: GRAPHICS_RATE_HZ,
        block_frames: 1024,
        schedule,
        predictor: PredictorKind::Linear,
        propagation: PropagationSettings::default(),
        generation: GeneratorSettings {
            rate_hz: RATE_HZ,
            max_sources: SOURCES,
            ..GeneratorSettings::default()
        },
    }
}
