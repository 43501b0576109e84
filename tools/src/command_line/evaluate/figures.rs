//! The report's pictures, players and conditions.

use std::path::Path;

use foresound::runtime::Latency;
use foresound::{Error, Result};
use foresound_tools::cells::{Condition, RendererKind};
use foresound_tools::report::{Figure, Listening, Report, Row, SimilarityMap, data_uri};
use foresound_tools::spectrogram_figure::SpectrogramFigure;
use foresound_tools::talk::{PAUSE_S, TALK_S};
use foresound_tools::{Picture, si_snr};

use super::Arguments;
use super::plan::{Part, Unit};
use super::stage::RATE_HZ;
use super::unit::{UnitResult, both, heard_as, wav_file};

/// Seconds of the doorway's pictures.
const WINDOW_S: f64 = 3.0;

/// Adds figures and players to a report with rows.
pub(super) fn add(out: &Path, units: &[Unit], report: &mut Report) -> Result<()> {
    for unit in units.iter().filter(|unit| unit.repeat == 0) {
        report.listening.push(listening(out, unit));
        let figures = match unit.part {
            Part::Doorway => pictures(out, unit, &report.doorway)?,
            Part::Table if is_pictured(unit, units) => pictures(out, unit, &report.rows)?,
            Part::Table => Vec::new(),
        };
        report.figures.extend(figures);
    }
    // In the order of the paper's figure numbers.
    report.figures.sort_by(|a, b| a.title.cmp(&b.title));
    Ok(())
}

/// Whether a cell is its scene's picture: speech, a walking listener, most sources, the first platform. The paper pictures
/// sixteen.
fn is_pictured(unit: &Unit, units: &[Unit]) -> bool {
    let fits = |u: &&Unit| {
        u.scene == unit.scene
            && u.part == Part::Table
            && u.condition == Condition::Dynamic
            && u.renderer == RendererKind::Offline
            && u.signal == "speech"
    };
    let most = units.iter().filter(fits).map(|u| u.sources).max();
    let first = units.iter().filter(fits).find(|u| Some(u.sources) == most);
    first.is_some_and(|first| first.cell_name() == unit.cell_name())
}

fn listening(out: &Path, unit: &Unit) -> Listening {
    let heard = unit
        .estimates()
        .map(|(kind, latency)| heard_as(kind.name(), latency));
    let files = std::iter::once("reference".to_owned())
        .chain(heard)
        .map(|name| {
            let file = wav_file(Path::new(""), unit, &name);
            (name, file.display().to_string())
        });
    Listening {
        title: format!(
            "{}, {}, {}, {}, {} of {}",
            unit.scene,
            unit.renderer.name(),
            unit.platform.name(),
            unit.condition.name(),
            sources_text(unit.sources),
            unit.signal
        ),
        files: files.filter(|(_, file)| out.join(file).is_file()).collect(),
    }
}

/// Spectrograms and similarity of `linear` and `best`, or of the only predictor present.
fn pictures(out: &Path, unit: &Unit, rows: &[Row]) -> Result<Vec<Figure>> {
    let latency = unit.latencies[0];
    let read = |name: &str| read_ears(&wav_file(out, unit, name));
    let reference = read("reference")?;
    let mut estimates = Vec::new();
    for name in unit.predictors.iter().map(|kind| kind.name()) {
        if matches!(name, "linear" | "best") || unit.predictors.len() == 1 {
            estimates.push((name, read(&heard_as(name, latency))?));
        }
    }
    let doorway = unit.part == Part::Doorway;
    let length = reference[0].len();
    let window = match estimates.first().filter(|_| doorway) {
        Some((_, estimate)) => worst_window(&reference, estimate),
        None => 0..length,
    };
    let cut = |ears: &[Vec<f32>; 2]| -> [Vec<f32>; 2] {
        [0, 1].map(|ear| ears[ear].get(window.clone()).unwrap_or(&ears[ear]).to_vec())
    };
    let reference = cut(&reference);
    let mut figures = Vec::new();
    for (name, estimate) in estimates {
        let estimate = cut(&estimate);
        let (reference, estimate) = (both(&reference), both(&estimate));
        let row = rows.iter().find(|row| {
            row.wav_stem == unit.cell_name()
                && row.predictor == name
                && row.is_late == (latency == Latency::Modelled)
        });
        let ratio = row.map_or(0.0, |row| row.si_snr_db.mean);
        let what = format!(
            "{}, {}, L = {}, {name}",
            unit.scene,
            sources_text(unit.sources),
            unit.pace.level
        );
        let mut caption = format!("{what}: SI-SNR {} dB", si_snr::capped_text(ratio));
        if doorway {
            let from_s = window.start as f64 / f64::from(RATE_HZ);
            caption = format!(
                "{caption} over all; shown from {from_s:.2} s, where paths appear and vanish"
            );
        }
        let (mel, similar) = if doorway {
            ("Figure 7: past a wall's edge beside a door", None)
        } else {
            (
                "Figure 5: mel spectrograms",
                Some("Figure 6: similarity maps"),
            )
        };
        let spectrograms = SpectrogramFigure {
            title: mel,
            caption: &caption,
            rate_hz: RATE_HZ,
            reference_label: "synchronous",
            estimate_label: name,
            reference: &reference,
            estimate: &estimate,
        };
        let stem = format!("{}-{name}", unit.cell_name());
        let text = format!(
            "{caption}. Above the synchronous reference, in the middle {name}, below the difference: red where {name} \
             is louder, blue where it is quieter."
        );
        figures.push(figure(
            out,
            &format!("{stem}-mel"),
            &spectrograms.draw()?,
            mel,
            text,
        )?);
        if let Some(title) = similar {
            let map = SimilarityMap {
                title: &what,
                rate_hz: RATE_HZ,
                reference: &reference,
                estimate: &estimate,
            };
            let text = format!(
                "{what}: structural similarity around each point, 1 where nothing differs."
            );
            figures.push(figure(
                out,
                &format!("{stem}-ssim"),
                &map.draw()?,
                title,
                text,
            )?);
        }
    }
    Ok(figures)
}

/// The window in which an estimate differs most from the reference, in samples.
fn worst_window(reference: &[Vec<f32>; 2], estimate: &[Vec<f32>; 2]) -> std::ops::Range<usize> {
    let samples = |seconds: f64| (seconds * f64::from(RATE_HZ)) as usize;
    let (length, step) = (samples(WINDOW_S), samples(0.25));
    let end = reference[0].len().min(estimate[0].len());
    let departure = |from: usize| -> f64 {
        let ears = reference.iter().zip(estimate);
        ears.flat_map(|(r, e)| r[from..from + length].iter().zip(&e[from..from + length]))
            .map(|(r, e)| f64::from(r - e).powi(2))
            .sum()
    };
    let starts = (0..end.saturating_sub(length)).step_by(step);
    let worst = starts.max_by(|a, b| departure(*a).total_cmp(&departure(*b)));
    let start = worst.unwrap_or(0);
    start..(start + length).min(end)
}

/// Writes a picture and puts it into a figure.
pub(super) fn figure(
    out: &Path,
    name: &str,
    picture: &Picture,
    title: &str,
    caption: String,
) -> Result<Figure> {
    let file = out.join("figures").join(format!("{name}.png"));
    picture.save_png(&file)?;
    let bytes = std::fs::read(&file).map_err(|e| Error::file(&file, e, "try again"))?;
    Ok(Figure {
        title: title.to_owned(),
        caption,
        image: data_uri("image/png", &bytes),
    })
}

/// A number of sources as text.
fn sources_text(count: usize) -> String {
    format!("{count} source{}", if count == 1 { "" } else { "s" })
}

/// Both ears of a rendering.
pub(super) fn read_ears(file: &Path) -> Result<[Vec<f32>; 2]> {
    let wrong = |e: hound::Error| Error::file(file, e, "delete the folder's cells and run again");
    let mut reader = hound::WavReader::open(file).map_err(wrong)?;
    let mut ears = [Vec::new(), Vec::new()];
    for (index, sample) in reader.samples::<i16>().enumerate() {
        let sample = f32::from(sample.map_err(wrong)?) / 32_768.0;
        ears[index % 2].push(sample);
    }
    Ok(ears)
}

/// The conditions of the evaluation.
pub(super) fn conditions(
    arguments: &Arguments,
    units: &[Unit],
    results: &[UnitResult],
) -> Vec<(String, String)> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let seconds = units.first().map_or(0.0, |unit| unit.duration_s);
    let work_min = results.iter().map(|result| result.seconds).sum::<f64>() / 60.0;
    let speech = match &arguments.speech {
        Some(folder) => format!("recordings of {}", folder.display()),
        None => "the sixteen voices of assets/speech".to_owned(),
    };
    let conditions = [
        ("Program", format!("foresound {}", env!("CARGO_PKG_VERSION"))),
        ("Machine", format!("{} {}, {cores} cores", std::env::consts::ARCH, std::env::consts::OS)),
        ("Work", format!("{} renderings in {work_min:.1} minutes of one core", results.iter().map(|r| r.estimates.len() + 1).sum::<usize>())),
        ("Length", format!("{seconds} s, the first half second not scored, 44.1 kHz")),
        ("Speech", format!("{speech}; all speak for {TALK_S} s and pause for {PAUSE_S} s, which PESQ needs to find utterances")),
        ("Rays", "1024 guide rays, 128 source rays a source, depth 4".to_owned()),
        ("Reference", "the synchronous schedule of the same renderer: a whole propagation every graphics frame".to_owned()),
        ("Late reverb", if arguments.no_late { "left out of all renderings" } else { "heard in all renderings" }.to_owned()),
        ("Latency", "modelled: a result is used L + 1 graphics frames after its poses, unless a row says \"at once\"".to_owned()),
        ("Stress", "a listener at 5 m/s who turns at 180 degrees a second, sources that sway at up to 2 m/s, L = 24".to_owned()),
        ("Without prediction", "restless: a random walk at 0.7 to 1.8 m/s with sudden turns and stops, the head up to 180 degrees a second; dash: 5 m/s through doorways and around corners; irregular: sources at up to 2 m/s on random smooth curves; teleport: the listener is put elsewhere every 1.5 s and walks on; jump: a source is put elsewhere every second; 74.6 graphics frames a second and L = 12 unless a platform was named".to_owned()),
        ("Engine", "engine-virtual: the engine on a virtual clock, an update arrives L + 1 graphics frames after its poses; engine-real: by this machine's clock, levels as they come; default settings at the highest quality, each against the engine's own synchronous schedule on the virtual clock".to_owned()),
        ("Seeds", "reference and estimate share the seed of their rays".to_owned()),
        ("SI-SNR", "both ears averaged; means above 40 dB are written \"> 40\" as in the paper".to_owned()),
        ("PESQ", "wideband, crate pesq 0.2, an ear that has no utterance left out; within 0.02 of the ITU's program on ordinary degradations, up to 0.15 off where a delay varies slowly within the sound, within 0.001 on cells of this report (tools/src/pesq.rs)".to_owned()),
        ("Recall", "of the reference, in the table above: paths that it misses are missing in both renderings".to_owned()),
        ("Repeats", "other ray seeds and other starts of the walk; mean ± standard deviation".to_owned()),
    ];
    conditions
        .map(|(name, value)| (name.to_owned(), value))
        .into()
}
