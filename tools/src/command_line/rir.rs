//! `rir`: an impulse response and its room-acoustic parameters.

use std::path::PathBuf;
use std::sync::Arc;

use foresound::Result;
use foresound::acoustics::BANDS;
use foresound::acoustics::bands::NOMINAL_HZ;
use foresound::extrapolation::PredictorKind;
use foresound::generation::Hrtf;
use foresound::output::wav::WavSink;
use foresound::propagation::{LateEnergy, LateGroup, PathSet};
use foresound::runtime::{OfflineSettings, Schedule};
use foresound::scene::{SourceId, SourcePose};
use foresound_tools::clip::Clip;
use foresound_tools::decay_figure::draw_decay_figure;
use foresound_tools::listener_path::{ListenerPath, parse_position};
use foresound_tools::room_parameters::{BandParameters, RoomParameters, room_parameters};
use serde_json::json;

use crate::inputs::{SceneArguments, check_wav_name, keep_inputs, load_scene, print_notes, within};
use crate::placement::{Place, notes};
use crate::session::{Session, Sound};

/// Graphics frames, and updates, a second; nothing moves.
const GRAPHICS_RATE_HZ: f64 = 10.0;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// OBJ, PLY, glTF or GLB file, or the name of a benchmark scene.
    #[arg(long, value_name = "FILE|NAME")]
    scene: PathBuf,
    #[command(flatten)]
    intake: SceneArguments,
    /// Position of the source in metres.
    #[arg(long, value_name = "x,y,z", allow_hyphen_values = true)]
    source: String,
    /// Position of the listener in metres.
    #[arg(long, value_name = "x,y,z", allow_hyphen_values = true)]
    listener: String,
    /// The WAV file to write, 32-bit float.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// A PNG file for the decay curves of all bands.
    #[arg(long, value_name = "FILE.png")]
    plot: Option<PathBuf>,
    /// Two ears (looking along −z) instead of one omnidirectional channel.
    #[arg(long)]
    binaural: bool,
    /// Sample rate in Hz: 44100 or 48000.
    #[arg(long, default_value_t = 48_000, value_name = "HZ")]
    rate: u32,
    /// Length in seconds.
    #[arg(long, default_value_t = 3.0)]
    seconds: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let position = parse_position("--source", &arguments.source)?;
    let listener = ListenerPath::AtRest(parse_position("--listener", &arguments.listener)?);
    within("--seconds", arguments.seconds, 0.1..=60.0, " s")?;
    let inputs = arguments.intake.files(&arguments.scene);
    keep_inputs(&arguments.out, inputs.iter().map(PathBuf::as_path))?;
    check_wav_name(&arguments.out)?;
    let omni = Arc::new(Hrtf::omnidirectional(arguments.rate)?);
    let loaded = load_scene(&arguments.scene, &arguments.intake)?;
    print_notes(&loaded.notes);
    let place = |what: &str, position| Place {
        what: what.to_owned(),
        position,
    };
    let places = [place("the source", position)];
    let ear = place("the listener", listener.at(0.0).position);
    print_notes(&notes(&loaded.scene, &places, &ear));
    let channels = if arguments.binaural { 2 } else { 1 };
    let mut sink = WavSink::create(&arguments.out, arguments.rate, channels)?;
    let mut settings = OfflineSettings::default();
    settings.graphics_rate_hz = GRAPHICS_RATE_HZ;
    settings.block_frames = 1024;
    settings.schedule = Schedule::Synchronous;
    settings.predictor = PredictorKind::Hold;
    settings.generation.rate_hz = arguments.rate;
    settings.generation.max_sources = 1;
    settings.generation.limiter = false;
    // Paths fade in during the first graphics frame; the impulse is in the second.
    let lead = (f64::from(arguments.rate) / GRAPHICS_RATE_HZ).round() as usize;
    let mut samples = vec![0.0; lead + 1];
    samples[lead] = 1.0;
    let sounds = [Sound {
        source: SourcePose::at(SourceId::new(0, 0), position),
        clip: Clip {
            rate_hz: arguments.rate,
            samples,
        },
        looped: false,
        path: None,
    }];
    let response = |hrtf: &Arc<Hrtf>| -> Result<(Vec<f32>, PathSet)> {
        let session = Session {
            what: "impulse response",
            scene: &loaded.scene,
            hrtf,
            parts: &[],
            sounds: &sounds,
            listener: &listener,
            duration_s: arguments.seconds + 1.0 / GRAPHICS_RATE_HZ,
            settings: settings.clone(),
        };
        let mut output = Vec::new();
        let rendered = session.render(&mut |block| {
            output.extend_from_slice(block);
            Ok(())
        })?;
        output.drain(..2 * lead);
        Ok((output, rendered.middle))
    };
    let (mono, paths) = response(&omni)?;
    let mono: Vec<f32> = mono.iter().step_by(2).copied().collect();
    if arguments.binaural {
        let hrtf = Arc::new(Hrtf::builtin(arguments.rate)?);
        sink.write(&response(&hrtf)?.0)?;
    } else {
        sink.write(&mono)?;
    }
    sink.finish()?;
    let parameters = room_parameters(&mono, arguments.rate);
    print_parameters(arguments, &parameters, &paths);
    if let Some(file) = &arguments.plot {
        draw_decay_figure(&parameters)?.save_png(file)?;
    }
    Ok(())
}

/// The decays of the late reverb in a band: reverberation time, and level of their energy relative to the free field at 1 m.
fn slopes(paths: &PathSet, band: usize) -> Vec<serde_json::Value> {
    let energy = |group: usize| -> f32 {
        let of_source = |late: &LateEnergy| late.energy[group].iter().map(|e| e[band]).sum::<f32>();
        paths.late.iter().map(of_source).sum()
    };
    let groups = paths.late_groups.iter().enumerate();
    let audible = groups.filter(|(group, _)| energy(*group) > 0.0);
    let slope = |(group, decay): (usize, &LateGroup)| {
        json!({
            "t60_s": decay.decay_time_s[band],
            "level_db": 10.0 * f64::from(energy(group)).log10(),
        })
    };
    audible.map(slope).collect()
}

fn print_parameters(arguments: &Arguments, parameters: &RoomParameters, paths: &PathSet) {
    let RoomParameters {
        bands, broadband, ..
    } = parameters;
    if arguments.json {
        let column = |value: fn(&BandParameters) -> Option<f64>| -> Vec<_> {
            bands.iter().map(value).collect()
        };
        let value = json!({
            "out": arguments.out.to_string_lossy(),
            "bands_hz": NOMINAL_HZ,
            "t20_s": column(|b| b.t20_s),
            "t30_s": column(|b| b.t30_s),
            "edt_s": column(|b| b.edt_s),
            "c50_db": column(|b| b.c50_db),
            "c80_db": column(|b| b.c80_db),
            "d50": column(|b| b.d50),
            "broadband": {
                "t20_s": broadband.t20_s,
                "t30_s": broadband.t30_s,
                "edt_s": broadband.edt_s,
                "c50_db": broadband.c50_db,
                "c80_db": broadband.c80_db,
                "d50": broadband.d50,
            },
            "late": (0..BANDS).map(|band| slopes(paths, band)).collect::<Vec<_>>(),
        });
        outln!("{value}");
        return;
    }
    outln!("{}", arguments.out.display());
    outln!(
        "  {:>9} {:>7} {:>7} {:>7} {:>8} {:>8} {:>6}",
        "band Hz",
        "T20 s",
        "T30 s",
        "EDT s",
        "C50 dB",
        "C80 dB",
        "D50"
    );
    let cell = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.2}"));
    let names = NOMINAL_HZ.map(|hz| hz.to_string());
    let names = names.iter().map(String::as_str).chain(["broadband"]);
    for (band, name) in bands.iter().chain([broadband]).zip(names) {
        outln!(
            "  {name:>9} {:>7} {:>7} {:>7} {:>8} {:>8} {:>6}",
            cell(band.t20_s),
            cell(band.t30_s),
            cell(band.edt_s),
            cell(band.c50_db),
            cell(band.c80_db),
            cell(band.d50)
        );
    }
}
