//! One unit: the synchronous reference, its asynchronous estimates and their scores, kept in a file for later runs.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use foresound::extrapolation::PredictorKind;
use foresound::output::WholeFile;
use foresound::output::wav::{WavFormat, WavSink};
use foresound::propagation::{self, PathSet, PropagationSettings, Propagator};
use foresound::runtime::{
    Latency, OfflineRenderer, OfflineReport, OfflineSettings, Poses, Schedule,
};
use foresound::{Error, Result};
use foresound_tools::scores::Scores;
use foresound_tools::talk;
use serde::{Deserialize, Serialize};

use super::motion;
use super::plan::Unit;
use super::stage::{Props, RATE_HZ, Sounds, Stage, fnv};
use crate::session::median;

/// Factor on the rays of the search that the reference's recall is measured against.
const THOROUGH: u32 = 8;

/// Result of a unit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct UnitResult {
    key: String,
    /// FNV-1a of the reference's samples.
    pub(super) reference_checksum: String,
    /// Paths of the reference, median over updates.
    pub(super) reference_paths: usize,
    /// Share of the paths of a search with eight times the rays that the reference has in mid-walk.
    pub(super) reference_recall: f64,
    /// The same by energy.
    pub(super) reference_energy_recall: f64,
    /// Rays of each of the reference's updates, of the first repeat.
    pub(super) reference_rays: Vec<u64>,
    /// Files of the first repeat, the reference's first, by name and FNV-1a of their bytes.
    files: Vec<(String, String)>,
    /// Duration of all of it in seconds.
    pub(super) seconds: f64,
    pub(super) estimates: Vec<Estimate>,
}

/// One predictor's result.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Estimate {
    pub(super) predictor: String,
    /// modelled or none.
    pub(super) latency: String,
    pub(super) scores: Scores,
    /// Mean processor time of a graphics frame's extrapolation in µs.
    pub(super) extrapolation_us: f64,
}

/// Mean in seconds. Frames in which an update arrives take longer and count like the others.
fn mean_s(times: &[Duration]) -> f64 {
    let all: Duration = times.iter().sum();
    all.as_secs_f64() / times.len().max(1) as f64
}

struct Rendered {
    ears: [Vec<f32>; 2],
    report: OfflineReport,
    middle: PathSet,
}

/// The unit's result, and whether it comes from the file of an earlier run.
pub(super) fn result(unit: &Unit, stage: &Stage, props: &Props) -> Result<(UnitResult, bool)> {
    let sounds = &props.sounds[&unit.signal];
    let key = format!(
        "{} {:016x} {:016x} {:016x}",
        unit.key(),
        stage.checksum,
        sounds.checksum,
        props.program
    );
    let name = format!("{:016x}.json", fnv(key.bytes()));
    let file = props.out.join("cells").join(name);
    let kept = std::fs::read(&file).ok();
    let kept = kept.and_then(|text| serde_json::from_slice::<UnitResult>(&text).ok());
    if let Some(kept) = kept.filter(|kept| kept.key == key && are_unchanged(&kept.files, props)) {
        return Ok((kept, true));
    }
    let made = make(unit, stage, props, key)?;
    let text = serde_json::to_vec_pretty(&made)
        .map_err(|e| Error::file(&file, e, "report this as a mistake of ours"))?;
    WholeFile::write(&file, |out| {
        std::io::Write::write_all(out, &text)?;
        Ok(())
    })?;
    Ok((made, false))
}

/// Whether a result's sound files are unchanged; a run with other sounds overwrites them.
fn are_unchanged(files: &[(String, String)], props: &Props) -> bool {
    files.iter().all(|(name, checksum)| {
        let bytes = std::fs::read(props.out.join("wav").join(name));
        bytes.is_ok_and(|bytes| *checksum == format!("{:016x}", fnv(bytes)))
    })
}

#[expect(
    clippy::disallowed_methods,
    reason = "measures the time of the work; no result depends on it"
)]
fn make(unit: &Unit, stage: &Stage, props: &Props, key: String) -> Result<UnitResult> {
    let started = Instant::now();
    let mut files = Vec::new();
    let reference = render(
        unit,
        stage,
        props,
        Schedule::Synchronous,
        PredictorKind::Hold,
    )?;
    files.extend(write_wav(unit, props, "reference", &reference.ears)?);
    let ears = both(&reference.ears);
    let mut estimates = Vec::new();
    for (predictor, latency) in unit.estimates() {
        let schedule = Schedule::Asynchronous {
            extrapolation_level: unit.pace.level,
            latency,
        };
        let estimate = render(unit, stage, props, schedule, predictor)?;
        let name = heard_as(predictor.name(), latency);
        files.extend(write_wav(unit, props, &name, &estimate.ears)?);
        let speech = unit.signal == "speech";
        estimates.push(Estimate {
            predictor: predictor.name().to_owned(),
            latency: latency_name(latency).to_owned(),
            scores: Scores::of(ears, both(&estimate.ears), RATE_HZ, speech)?,
            extrapolation_us: mean_s(&estimate.report.extrapolation) * 1e6,
        });
    }
    let samples = reference.ears.iter().flatten();
    let checksum = fnv(samples.flat_map(|s| s.to_bits().to_le_bytes()));
    let [recall, energy_recall] = recall(&reference.middle, stage)?;
    Ok(UnitResult {
        key,
        reference_checksum: format!("{checksum:016x}"),
        reference_paths: median(&reference.report.paths),
        reference_recall: recall,
        reference_energy_recall: energy_recall,
        reference_rays: if unit.repeat == 0 {
            reference.report.rays
        } else {
            Vec::new()
        },
        files,
        seconds: started.elapsed().as_secs_f64(),
        estimates,
    })
}

/// The JSON's word for a latency.
pub(super) fn latency_name(latency: Latency) -> &'static str {
    match latency {
        Latency::Modelled => "modelled",
        Latency::None => "none",
    }
}

/// The name of an estimate's rendering.
pub(super) fn heard_as(predictor: &str, latency: Latency) -> String {
    match latency {
        Latency::Modelled => predictor.to_owned(),
        Latency::None => format!("{predictor}-at-once"),
    }
}

fn render(
    unit: &Unit,
    stage: &Stage,
    props: &Props,
    schedule: Schedule,
    predictor: PredictorKind,
) -> Result<Rendered> {
    let mut settings = OfflineSettings::default();
    settings.graphics_rate_hz = unit.pace.graphics_rate_hz;
    settings.block_frames = 1024;
    settings.schedule = schedule;
    settings.predictor = predictor;
    settings.propagation.seed = unit.repeat + 1;
    settings.generation.rate_hz = RATE_HZ;
    settings.generation.max_sources = unit.sources;
    settings.generation.late = unit.late;
    let mut poses = Poses::default();
    let mut renderer =
        OfflineRenderer::new(Arc::clone(&stage.scene), Arc::clone(&props.hrtf), settings)?;
    let frames = (unit.duration_s * unit.pace.graphics_rate_hz).ceil() as u64;
    // A fraction that spreads the starts of repeats over the walk there and back.
    let start_m =
        unit.repeat as f64 * 0.382 * 2.0 * f64::from(stage.walk.from.distance(stage.walk.to));
    let mut ears = [Vec::new(), Vec::new()];
    let mut middle = PathSet::default();
    let Sounds { clips, .. } = &props.sounds[&unit.signal];
    let mut signal = |slot: usize, from: u64, samples: &mut [f32]| {
        let clip = &clips[slot % clips.len()];
        if unit.signal == "speech" {
            talk::spoken(clip, from, samples);
        } else {
            clip.looped(from as usize, samples);
        }
    };
    for frame in 0..frames {
        motion::set_poses(unit, stage, renderer.time_s(), start_m, &mut poses);
        renderer.next_frame(&poses, &mut signal, &mut |block| {
            for stereo in block.chunks_exact(2) {
                ears[0].push(stereo[0]);
                ears[1].push(stereo[1]);
            }
            Ok(())
        })?;
        if frame == frames / 2 {
            middle = renderer.paths().clone();
        }
    }
    Ok(Rendered {
        ears,
        report: renderer.report().clone(),
        middle,
    })
}

/// Share of the paths of a search with more rays that a set has, by number and by energy.
fn recall(found: &PathSet, stage: &Stage) -> Result<[f64; 2]> {
    let usual = PropagationSettings::default();
    let settings = PropagationSettings {
        guide_rays: THOROUGH * usual.guide_rays,
        source_rays: THOROUGH * usual.source_rays,
        ..usual
    };
    let mut propagator = Propagator::new(Arc::clone(&stage.scene), settings)?;
    let mut all = PathSet::default();
    for _ in 0..4 {
        propagator.update(&found.listener, &found.sources, 0.0, &mut all);
    }
    let has = |path: &&propagation::Path| {
        let by_id = |other: &propagation::Path| other.id;
        found.paths.binary_search_by_key(&path.id, by_id).is_ok()
    };
    let energy = |path: &propagation::Path| -> f64 {
        let squares = path.amplitude.iter().map(|a| f64::from(*a).powi(2));
        squares.sum()
    };
    let count = all.paths.iter().filter(has).count() as f64;
    let carried: f64 = all.paths.iter().filter(has).map(energy).sum();
    let whole: f64 = all.paths.iter().map(energy).sum();
    if all.paths.is_empty() {
        return Ok([1.0; 2]);
    }
    Ok([
        count / all.paths.len() as f64,
        carried / whole.max(f64::MIN_POSITIVE),
    ])
}

/// Writes the WAV file of a first repeat, 16 bits, and returns its name and checksum.
fn write_wav(
    unit: &Unit,
    props: &Props,
    name: &str,
    ears: &[Vec<f32>; 2],
) -> Result<Option<(String, String)>> {
    if unit.repeat > 0 {
        return Ok(None);
    }
    let file = wav_file(&props.out, unit, name);
    let mut sink = WavSink::create_with(&file, RATE_HZ, 2, WavFormat::Pcm16)?;
    sink.write_planar(&both(ears))?;
    sink.finish()?;
    let bytes = std::fs::read(&file).map_err(|e| Error::file(&file, e, "try again"))?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    Ok(Some((name.into_owned(), format!("{:016x}", fnv(bytes)))))
}

/// File of a rendering of the first repeat.
pub(super) fn wav_file(out: &Path, unit: &Unit, name: &str) -> PathBuf {
    out.join("wav")
        .join(format!("{}-{name}.wav", unit.cell_name()))
}

pub(super) fn both(ears: &[Vec<f32>; 2]) -> [&[f32]; 2] {
    [&ears[0], &ears[1]]
}
