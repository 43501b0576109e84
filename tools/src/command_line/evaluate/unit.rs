//! One unit: the synchronous reference, its asynchronous estimates and their scores, kept in a file for later runs.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use foresound::extrapolation::PredictorKind;
use foresound::output::WholeFile;
use foresound::output::wav::{WavFormat, WavSink};
use foresound::propagation::{self, PathSet, PropagationSettings, Propagator};
use foresound::runtime::{Latency, Schedule};
use foresound::{Error, Result};
use foresound_tools::fnv::fnv;
use foresound_tools::scores::Scores;
use foresound_tools::settling::Settling;
use serde::{Deserialize, Serialize};

use super::motion::Motion;
use super::plan::Unit;
use super::rendering::{How, Rendered, render};
use super::stage::{Props, RATE_HZ, Stage};

/// Factor on the rays of the search that the reference's recall is measured against.
const THOROUGH: u32 = 8;

/// Distance of the other ray seed from a unit's own; repeats have neighbouring ones.
const OTHER_SEED: u64 = 1000;

/// Result of a unit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct UnitResult {
    key: String,
    /// FNV-1a of the reference's samples.
    pub(super) reference_checksum: String,
    /// Paths of the reference, median over updates.
    pub(super) reference_paths: usize,
    /// Share of the paths of a search with eight times the rays that the reference has in mid-walk, by number and by
    /// energy; of the offline renderer only.
    pub(super) reference_recall: Option<[f64; 2]>,
    /// Rays of each of the reference's updates, of the first repeat.
    pub(super) reference_rays: Vec<u64>,
    /// Median time of the reference's updates.
    pub(super) reference_update_ms: f64,
    /// The reference with another ray seed compared with the reference; of the first repeat only.
    pub(super) other_seed: Option<Scores>,
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
    /// After each jump of listener or sources, if there are any.
    pub(super) settling: Option<Settling>,
    /// Processor time of a graphics frame's extrapolation in µs, mean; through the engine elapsed time, median.
    pub(super) extrapolation_us: f64,
    /// Extrapolation level: median and 99th percentile.
    pub(super) level: [f64; 2],
    /// Median time of its updates.
    pub(super) update_ms: f64,
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
    let seed = unit.repeat + 1;
    let synchronous = How {
        schedule: Schedule::Synchronous,
        predictor: PredictorKind::Hold,
        seed,
    };
    let reference = render(unit, stage, props, synchronous)?;
    files.extend(write_wav(unit, props, "reference", &reference.ears)?);
    let ears = both(&reference.ears);
    let speech = unit.signal == "speech";
    let scores = |heard: &Rendered| Scores::of(ears, both(&heard.ears), RATE_HZ, speech);
    let other_seed = match unit.repeat {
        0 => {
            let seed = seed + OTHER_SEED;
            let other = render(
                unit,
                stage,
                props,
                How {
                    seed,
                    ..synchronous
                },
            )?;
            Some(scores(&other)?)
        }
        _ => None,
    };
    let jumps_s = Motion::of(unit, stage).jumps_s();
    let mut estimates = Vec::new();
    for (predictor, latency) in unit.estimates() {
        let schedule = Schedule::Asynchronous {
            extrapolation_level: unit.pace.level,
            latency,
        };
        let how = How {
            schedule,
            predictor,
            seed,
        };
        let estimate = render(unit, stage, props, how)?;
        let name = heard_as(predictor.name(), latency);
        files.extend(write_wav(unit, props, &name, &estimate.ears)?);
        estimates.push(Estimate {
            predictor: predictor.name().to_owned(),
            latency: latency_name(latency).to_owned(),
            scores: scores(&estimate)?,
            settling: Settling::of(ears, both(&estimate.ears), RATE_HZ, &jumps_s),
            extrapolation_us: 1e6 * estimate.extrapolation_s,
            level: estimate.level,
            update_ms: 1e3 * estimate.update_s,
        });
    }
    let samples = reference.ears.iter().flatten();
    let checksum = fnv(samples.flat_map(|s| s.to_bits().to_le_bytes()));
    let recall = reference.middle.map(|middle| recall(&middle, stage));
    Ok(UnitResult {
        key,
        reference_checksum: format!("{checksum:016x}"),
        reference_paths: reference.paths,
        reference_recall: recall.transpose()?,
        reference_rays: if unit.repeat == 0 {
            reference.rays
        } else {
            Vec::new()
        },
        reference_update_ms: 1e3 * reference.update_s,
        other_seed,
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
