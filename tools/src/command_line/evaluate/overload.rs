//! Playback on an overloaded machine: the paper's Figure 8, on the virtual clock.

use std::path::Path;

use foresound::Result;
use foresound::extrapolation::GeometricSettings;
use foresound::output::wav::{WavFormat, WavSink};
use foresound::runtime::Latency;
use foresound_tools::cells::{Condition, RendererKind};
use foresound_tools::paper::printed_speed;
use foresound_tools::playback::{AHEAD, Playback, play};
use foresound_tools::report::{Figure, Listening, OverloadRow};
use foresound_tools::scores::SKIP_S;
use foresound_tools::si_snr::si_snr_ears_db;
use foresound_tools::spectrogram_figure::SpectrogramFigure;

use super::figures::{figure, read_ears};
use super::plan::{Part, Unit};
use super::stage::RATE_HZ;
use super::unit::{UnitResult, both, heard_as, wav_file};
use crate::inputs::counted;
use crate::session::median;

/// The paper's scene and number of sources; fewer if a run has no more.
const SCENE: &str = "concert_hall";
const SOURCES: usize = 8;

/// Time of an update in graphics frames, of the reported cases besides the paper's own ratio.
const LOADS: [f64; 4] = [0.8, 1.0, 1.25, 2.0];

/// The case with sound and pictures.
const PICTURED: f64 = 1.25;

/// Start and end of the pictures in seconds.
const SHOWN_S: [f64; 2] = [3.5, 6.5];

/// The results; empty without the cell.
#[derive(Default)]
pub(super) struct Overload {
    pub(super) rows: Vec<OverloadRow>,
    pub(super) figures: Vec<Figure>,
    pub(super) listening: Option<Listening>,
}

/// Plays the cell's reference and `best` as on a slow machine.
///
/// Cost model: all rays take the same time, and the median update takes a load's share of a graphics frame. The
/// synchronous loop casts all of an update's rays within a frame; `best` casts its own few, while the update has another
/// core and L + 1 frames. Generation is free on both sides.
pub(super) fn overload(out: &Path, units: &[Unit], results: &[UnitResult]) -> Result<Overload> {
    let fits = |unit: &Unit| {
        unit.part == Part::Table
            && unit.scene == SCENE
            && unit.condition == Condition::Dynamic
            && unit.renderer == RendererKind::Offline
            && unit.signal == "speech"
            && unit.repeat == 0
            && unit.sources <= SOURCES
            && unit.latencies.contains(&Latency::Modelled)
            && unit.predictors.iter().any(|kind| kind.name() == "best")
    };
    let cells = units.iter().zip(results).filter(|(unit, _)| fits(unit));
    let Some((unit, result)) = cells.rev().max_by_key(|(unit, _)| unit.sources) else {
        return Ok(Overload::default());
    };
    let reference = read_ears(&wav_file(out, unit, "reference"))?;
    let ours = read_ears(&wav_file(out, unit, &heard_as("best", Latency::Modelled)))?;
    let rays: Vec<f64> = result
        .reference_rays
        .iter()
        .map(|rays| *rays as f64)
        .collect();
    let typical = median(&rays).max(1.0);
    let own = ((GeometricSettings::FULL.rays_per_source + 1) as usize * unit.sources) as f64;
    let paper = printed_speed(unit.platform, &unit.scene, unit.sources).map(|p| p.speedup);
    let mut overload = Overload::default();
    for load in LOADS.into_iter().chain(paper) {
        let cost: Vec<f64> = rays.iter().map(|rays| load * rays / typical).collect();
        let repeated = play(&cost);
        let in_time = play(&vec![load * own / typical; rays.len()]);
        let heard = sound(unit, &repeated, &reference);
        let heard_of_ours = sound(unit, &in_time, &ours);
        for (schedule, playback, ears) in [
            ("synchronous", &repeated, &heard),
            ("asynchronous, best", &in_time, &heard_of_ours),
        ] {
            overload.rows.push(OverloadRow {
                scene: unit.scene.clone(),
                sources: unit.sources,
                load,
                schedule: schedule.to_owned(),
                frames: rays.len(),
                late: playback.late,
                dropped: playback.dropped,
                repeated: playback.repeated,
                si_snr_db: si_snr_ears_db(scored(&reference), scored(ears)),
            });
        }
        if load == PICTURED {
            let late = ("synchronous playback", "too slow", "overload-synchronous");
            let best = ("asynchronous playback with best", "best", "overload-best");
            for (names, ears) in [(late, &heard), (best, &heard_of_ours)] {
                overload
                    .figures
                    .push(picture(out, unit, names, &reference, ears)?);
            }
            overload.listening = Some(listening(out, unit, &heard)?);
        }
    }
    Ok(overload)
}

/// Both ears of a playback, cut into blocks a graphics frame long.
fn sound(unit: &Unit, playback: &Playback, ears: &[Vec<f32>; 2]) -> [Vec<f32>; 2] {
    let start = |frame: usize| {
        (frame as f64 * f64::from(RATE_HZ) / unit.pace.graphics_rate_hz).round() as usize
    };
    let starts: Vec<usize> = (0..=playback.played.len())
        .map(|frame| start(frame).min(ears[0].len()))
        .collect();
    [0, 1].map(|ear| playback.sound(&ears[ear], &starts))
}

fn scored(ears: &[Vec<f32>; 2]) -> [&[f32]; 2] {
    let skip = (SKIP_S * f64::from(RATE_HZ)) as usize;
    both(ears).map(|ear| &ear[skip.min(ear.len())..])
}

fn picture(
    out: &Path,
    unit: &Unit,
    (schedule, label, file): (&str, &str, &str),
    reference: &[Vec<f32>; 2],
    heard: &[Vec<f32>; 2],
) -> Result<Figure> {
    let [from, to] = SHOWN_S.map(|s| (s * f64::from(RATE_HZ)) as usize);
    let cut = |ears| both(ears).map(|ear| &ear[from.min(ear.len())..to.min(ear.len())]);
    let caption = format!(
        "{}, {}, {schedule}, updates of {PICTURED} frame times, from {} s",
        unit.scene,
        counted(unit.sources, "source"),
        SHOWN_S[0]
    );
    let title = "Figure 8: playback under overload";
    let spectrograms = SpectrogramFigure {
        title,
        caption: &caption,
        rate_hz: RATE_HZ,
        reference_label: "in time",
        estimate_label: label,
        reference: &cut(reference),
        estimate: &cut(heard),
    };
    let text = format!(
        "{caption}. Above the synchronous rendering on a machine that is never late, in the middle playback on the slow \
         machine, below the difference."
    );
    let file = format!("{}-{file}", unit.cell_name());
    figure(out, &file, &spectrograms.draw()?, title, text)
}

fn listening(out: &Path, unit: &Unit, repeated: &[Vec<f32>; 2]) -> Result<Listening> {
    let name = "overload-synchronous";
    let mut sink = WavSink::create_with(wav_file(out, unit, name), RATE_HZ, 2, WavFormat::Pcm16)?;
    sink.write_planar(&both(repeated))?;
    sink.finish()?;
    let file = |name: &str| wav_file(Path::new(""), unit, name).display().to_string();
    Ok(Listening {
        title: format!(
            "Overload: {}, {}, updates of {PICTURED} frame times, {AHEAD} blocks ahead",
            unit.scene,
            counted(unit.sources, "source")
        ),
        files: vec![
            ("synchronous, in time".to_owned(), file("reference")),
            ("synchronous, too slow".to_owned(), file(name)),
            ("best, on the same machine".to_owned(), file("best")),
        ],
    })
}
