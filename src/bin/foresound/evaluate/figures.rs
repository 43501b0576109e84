//! The report's pictures and players, and the page itself.

use std::io::Write;
use std::path::{Path, PathBuf};

use foresound::evaluation::report::{Figure, Listening, Report, Row, SimilarityMap, data_uri};
use foresound::evaluation::spectrogram_figure::SpectrogramFigure;
use foresound::evaluation::{Canvas, si_snr};
use foresound::output::WholeFile;
use foresound::{Error, Result};

use super::plan::Unit;
use super::unit::{RATE_HZ, both, wav_file};

/// Writes `index.html`; gives its place.
pub(super) fn report(out: &Path, units: &[Unit], rows: &[Row]) -> Result<PathBuf> {
    let mut report = Report {
        rows: rows.to_vec(),
        figures: Vec::new(),
        listening: Vec::new(),
        conditions: conditions(units),
    };
    for unit in units.iter().filter(|unit| unit.repeat == 0) {
        report.listening.push(listening(out, unit));
        if unit.dynamic && is_largest(unit, units) {
            report.figures.extend(pictures(out, unit, rows)?);
        }
    }
    let page = out.join("index.html");
    WholeFile::write(&page, |file| file.write_all(report.html().as_bytes()))?;
    Ok(page)
}

/// Whether no other cell of the scene has more sources: the paper pictures sixteen.
fn is_largest(unit: &Unit, units: &[Unit]) -> bool {
    let first = units.iter().find(|other| {
        other.scene == unit.scene
            && other.dynamic
            && units
                .iter()
                .all(|u| u.scene != unit.scene || u.sources <= other.sources)
    });
    first.is_some_and(|first| first.cell_name() == unit.cell_name())
}

fn listening(out: &Path, unit: &Unit) -> Listening {
    let names = unit.variants.iter().map(|variant| variant.name);
    let shown = names.filter(|name| !name.starts_with("best-"));
    let files = std::iter::once("reference").chain(shown).map(|name| {
        let file = wav_file(Path::new(""), unit, name);
        (name.to_owned(), file.display().to_string())
    });
    Listening {
        title: format!(
            "{}, {}, {}, {} sources",
            unit.scene,
            unit.platform.name(),
            unit.condition(),
            unit.sources
        ),
        files: files.filter(|(_, file)| out.join(file).is_file()).collect(),
    }
}

/// Spectrograms and similarity of `linear` and `best`, or of the only predictor there is.
fn pictures(out: &Path, unit: &Unit, rows: &[Row]) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    let reference = read_ears(&wav_file(out, unit, "reference"))?;
    for variant in &unit.variants {
        if !(matches!(variant.name, "linear" | "best") || unit.variants.len() == 1) {
            continue;
        }
        let estimate = read_ears(&wav_file(out, unit, variant.name))?;
        let (reference, estimate) = (both(&reference), both(&estimate));
        let row = rows
            .iter()
            .find(|row| row.wav_stem == unit.cell_name() && row.predictor == variant.name);
        let ratio = row.map_or(0.0, |row| row.si_snr_db.mean);
        let what = format!(
            "{}, {} sources, L = {}, {}",
            unit.scene, unit.sources, unit.pace.level, variant.name
        );
        let caption = format!("{what}: SI-SNR {} dB", si_snr::capped_text(ratio));
        let spectrograms = SpectrogramFigure {
            title: if unit.scene == "doorway" {
                "Through a wall's edge beside a door (Figure 7)"
            } else {
                "Mel spectrograms (Figure 5)"
            },
            caption: &caption,
            rate_hz: RATE_HZ,
            reference_label: "synchronous",
            estimate_label: variant.name,
            reference: &reference,
            estimate: &estimate,
        };
        let name = format!("{}-{}", unit.cell_name(), variant.name);
        figures.push(figure(
            out,
            &format!("{name}-mel"),
            spectrograms.draw()?,
            &caption,
        )?);
        let map = SimilarityMap {
            title: &what,
            rate_hz: RATE_HZ,
            reference: &reference,
            estimate: &estimate,
        };
        let caption = format!("Similarity map (Figure 6): {what}");
        figures.push(figure(out, &format!("{name}-ssim"), map.draw()?, &caption)?);
    }
    Ok(figures)
}

fn figure(out: &Path, name: &str, canvas: Canvas, caption: &str) -> Result<Figure> {
    let file = out.join("figures").join(format!("{name}.png"));
    canvas.save_png(&file)?;
    let bytes = std::fs::read(&file).map_err(|e| Error::file(&file, e, "try again"))?;
    Ok(Figure {
        caption: caption.to_owned(),
        image: data_uri("image/png", &bytes),
    })
}

fn read_ears(file: &Path) -> Result<[Vec<f32>; 2]> {
    let wrong = |e: hound::Error| Error::file(file, e, "delete the folder's cells and run again");
    let mut reader = hound::WavReader::open(file).map_err(wrong)?;
    let mut ears = [Vec::new(), Vec::new()];
    for (place, sample) in reader.samples::<i16>().enumerate() {
        let sample = f32::from(sample.map_err(wrong)?) / 32_768.0;
        ears[place % 2].push(sample);
    }
    Ok(ears)
}

fn conditions(units: &[Unit]) -> Vec<(String, String)> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let seconds = units.first().map_or(0.0, |unit| unit.duration_s);
    let told = [
        ("Program", format!("foresound {}", env!("CARGO_PKG_VERSION"))),
        ("Machine", format!("{} {}, {cores} cores", std::env::consts::ARCH, std::env::consts::OS)),
        ("Length", format!("{seconds} s, the first half second not scored, 44.1 kHz")),
        ("Rays", "1024 guide rays, 128 source rays a source, depth 4".to_owned()),
        ("Reference", "the synchronous schedule of the same engine: a whole propagation every graphics frame".to_owned()),
        ("Latency", "modelled: a result is used L + 1 graphics frames after its poses, unless a row says \"at once\"".to_owned()),
        ("PESQ", "wideband, crate pesq 0.2; it departs from the ITU's program by up to 0.13 where delays vary slowly, 0.02 elsewhere".to_owned()),
        ("Repeats", "other ray seeds and other starts of the walk; mean ± standard deviation".to_owned()),
    ];
    told.map(|(name, value)| (name.to_owned(), value)).into()
}
