//! One unit: the synchronous reference, its asynchronous estimates, their scores, kept in a file for the next time.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use foresound::evaluation::clip::Clip;
use foresound::evaluation::scores::Scores;
use foresound::extrapolation::PredictorKind;
use foresound::generation::{GeneratorSettings, Hrtf};
use foresound::output::WholeFile;
use foresound::output::wav::{WavFormat, WavSink};
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::{OfflineRenderer, OfflineReport, OfflineSettings, Poses, Schedule};
use foresound::scene::layout::{SceneLayout, Walk};
use foresound::scene::{ListenerPose, Scene, SourceId, SourcePose};
use foresound::{Error, Result};
use serde::{Deserialize, Serialize};

use super::plan::{Unit, Variant};
use crate::session::median;

/// Sample rate of everything.
pub(super) const RATE_HZ: u32 = 44_100;

/// How many times the usual rays the path set is looked for with, to tell the reference's recall.
const THOROUGH: u32 = 8;

/// A scene ready to be rendered in.
pub(super) struct Stage {
    pub(super) scene: Arc<Scene>,
    pub(super) layout: SceneLayout,
    pub(super) walk: Walk,
    /// Of the scene's files.
    pub(super) checksum: u64,
}

/// What all units share.
pub(super) struct Props {
    pub(super) hrtf: Arc<Hrtf>,
    pub(super) clips: Vec<Clip>,
    pub(super) out: PathBuf,
    /// Of the program: a result made by another program does not count.
    pub(super) program: u64,
}

/// What came of a unit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct UnitResult {
    key: String,
    /// FNV-1a of the reference's samples.
    pub(super) reference_checksum: String,
    /// Paths of the reference, median over updates.
    pub(super) reference_paths: usize,
    /// Share of the paths that a search with eight times the rays finds which the reference has in mid-walk.
    pub(super) reference_recall: f64,
    pub(super) estimates: Vec<Estimate>,
}

/// One predictor's result.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Estimate {
    pub(super) predictor: String,
    pub(super) scores: Scores,
    /// Median time of a graphics frame's extrapolation in µs, on whatever machine this was.
    pub(super) extrapolation_us: f64,
}

struct Rendered {
    ears: [Vec<f32>; 2],
    report: OfflineReport,
    middle: PathSet,
}

/// The unit's result: from the file that an earlier run left, or made anew.
pub(super) fn result(unit: &Unit, stage: &Stage, props: &Props) -> Result<UnitResult> {
    let key = format!(
        "{} {:016x} {:016x}",
        unit.key(),
        stage.checksum,
        props.program
    );
    let name = format!("{:016x}.json", fnv(key.bytes()));
    let file = props.out.join("cells").join(name);
    let kept = std::fs::read(&file).ok();
    let kept = kept.and_then(|text| serde_json::from_slice::<UnitResult>(&text).ok());
    if let Some(kept) = kept.filter(|kept| kept.key == key) {
        return Ok(kept);
    }
    let made = make(unit, stage, props, key)?;
    let text = serde_json::to_vec_pretty(&made)
        .map_err(|e| Error::file(&file, e, "report this as a mistake of ours"))?;
    WholeFile::write(&file, |out| {
        std::io::Write::write_all(out, &text)?;
        Ok(())
    })?;
    Ok(made)
}

fn make(unit: &Unit, stage: &Stage, props: &Props, key: String) -> Result<UnitResult> {
    let reference = render(
        unit,
        stage,
        props,
        Schedule::Synchronous,
        PredictorKind::Hold,
    )?;
    write_wav(unit, props, "reference", &reference.ears)?;
    let ears = both(&reference.ears);
    let mut estimates = Vec::new();
    for Variant { name, kind } in &unit.variants {
        let schedule = Schedule::Asynchronous {
            level: unit.pace.level,
            latency: unit.latency,
        };
        let estimate = render(unit, stage, props, schedule, *kind)?;
        write_wav(unit, props, name, &estimate.ears)?;
        let speech = unit.signal == "speech";
        let times: Vec<_> = estimate.report.extrapolation;
        estimates.push(Estimate {
            predictor: (*name).to_owned(),
            scores: Scores::of(ears, both(&estimate.ears), RATE_HZ, speech)?,
            extrapolation_us: median(&times).as_secs_f64() * 1e6,
        });
    }
    let samples = reference.ears.iter().flatten();
    let checksum = fnv(samples.flat_map(|s| s.to_bits().to_le_bytes()));
    Ok(UnitResult {
        key,
        reference_checksum: format!("{checksum:016x}"),
        reference_paths: median(&reference.report.paths),
        reference_recall: recall(&reference.middle, stage)?,
        estimates,
    })
}

fn render(
    unit: &Unit,
    stage: &Stage,
    props: &Props,
    schedule: Schedule,
    predictor: PredictorKind,
) -> Result<Rendered> {
    let settings = OfflineSettings {
        graphics_rate_hz: unit.pace.graphics_rate_hz,
        block_frames: 1024,
        schedule,
        predictor,
        propagation: PropagationSettings {
            seed: unit.repeat + 1,
            ..PropagationSettings::default()
        },
        generation: GeneratorSettings {
            rate_hz: RATE_HZ,
            max_sources: unit.sources,
            ..GeneratorSettings::default()
        },
    };
    let mut poses = Poses::default();
    for (slot, source) in stage.layout.sources.iter().take(unit.sources).enumerate() {
        poses.sources.push(SourcePose::at(
            SourceId::new(slot as u16, 0),
            source.position,
        ));
    }
    let mut renderer =
        OfflineRenderer::new(Arc::clone(&stage.scene), Arc::clone(&props.hrtf), settings)?;
    let frames = (unit.duration_s * unit.pace.graphics_rate_hz).ceil() as u64;
    // A step that divides no walk's length: starts are spread over the way there and back.
    let start_m =
        unit.repeat as f64 * 0.382 * 2.0 * f64::from(stage.walk.from.distance(stage.walk.to));
    let mut ears = [Vec::new(), Vec::new()];
    let mut middle = PathSet::default();
    let mut signal = |slot: usize, from: u64, samples: &mut [f32]| {
        let clip = &props.clips[slot % props.clips.len()];
        clip.looped(from as usize, samples);
    };
    for frame in 0..frames {
        let place = if unit.dynamic {
            stage.walk.position_at(renderer.time_s(), start_m)
        } else {
            stage.walk.standing
        };
        poses.listener = ListenerPose::facing(place, 0.0);
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

/// The share of a thorough search's paths that a set has.
fn recall(found: &PathSet, stage: &Stage) -> Result<f64> {
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
    let has = |id| {
        found
            .paths
            .binary_search_by_key(&id, |path| path.id)
            .is_ok()
    };
    let count = all.paths.iter().filter(|path| has(path.id)).count();
    Ok(count as f64 / all.paths.len().max(1) as f64)
}

/// WAVs of the first repeat, 16 bits.
fn write_wav(unit: &Unit, props: &Props, name: &str, ears: &[Vec<f32>; 2]) -> Result<()> {
    if unit.repeat > 0 {
        return Ok(());
    }
    let file = wav_file(&props.out, unit, name);
    let mut sink = WavSink::create_with(file, RATE_HZ, 2, WavFormat::Pcm16)?;
    sink.write_planar(&both(ears))?;
    sink.finish()
}

/// Where a rendering of the first repeat stands.
pub(super) fn wav_file(out: &Path, unit: &Unit, name: &str) -> PathBuf {
    out.join("wav")
        .join(format!("{}-{name}.wav", unit.cell_name()))
}

pub(super) fn both(ears: &[Vec<f32>; 2]) -> [&[f32]; 2] {
    [&ears[0], &ears[1]]
}

/// FNV-1a, 64 bits.
pub(super) fn fnv(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
