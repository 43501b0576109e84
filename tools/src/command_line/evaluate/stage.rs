//! What units are played on: a scene, where its sources stand, how its listener walks; and the sounds.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use foresound::generation::Hrtf;
use foresound::scene::Scene;
use foresound::scene::layout::Walk;
use foresound::{Error, Result};
use foresound_tools::clip::{Clip, load_clip, load_recording};
use foresound_tools::open_space::{clear_m, open_space};
use glam::Vec3;

use super::Arguments;
use crate::inputs::{SceneArguments, asset, load_scene, tell};

/// Sample rate of everything.
pub(super) const RATE_HZ: u32 = 44_100;

/// Most sources of a cell.
const MOST_SOURCES: usize = 16;

/// Farthest that a source of the stress condition sways to each side, in metres.
const SWAY_M: f32 = 1.5;

/// A scene ready to be rendered in.
pub(super) struct Stage {
    pub(super) scene: Arc<Scene>,
    pub(super) sources: Vec<Vec3>,
    /// Which way each source may sway, and how far to each side.
    pub(super) sways: Vec<Vec3>,
    pub(super) walk: Walk,
    /// Of the scene and all places.
    pub(super) checksum: u64,
}

/// What a scene is called in tables and files: its name, or its file's without folder and ending.
pub(super) fn label(named: &str) -> String {
    let stem = Path::new(named).file_stem();
    let stem = stem.map_or(named.into(), |stem| stem.to_string_lossy());
    let plain = |c: char| {
        if c.is_alphanumeric() || "_-".contains(c) {
            c
        } else {
            '_'
        }
    };
    stem.chars().map(plain).collect()
}

/// Loads a scene by name or file. What its layout leaves out is laid out in open space.
pub(super) fn stage(named: &str, intake: &SceneArguments) -> Result<Stage> {
    let loaded = load_scene(Path::new(named), intake)?;
    tell(&loaded.notes);
    let mut sources = loaded.sources();
    let mut walk = loaded.walk();
    if sources.is_empty() || walk.is_none() {
        let found = open_space(&loaded.scene, MOST_SOURCES)?;
        if sources.is_empty() {
            let count = found.sources.len();
            tell(&[format!("{named}: {count} sources laid out in open space")]);
            sources = found.sources;
        }
        walk.get_or_insert_with(|| {
            let Walk { from, to, .. } = found.walk;
            tell(&[format!("{named}: a walk laid out from {from} to {to}")]);
            found.walk
        });
    }
    let walk = walk.ok_or_else(|| {
        let advice = "put a TOML file with sources and a listener beside the OBJ file";
        Error::file(named, "has no layout", advice)
    })?;
    sources.truncate(MOST_SOURCES);
    let sways: Vec<Vec3> = sources
        .iter()
        .map(|place| sway(&loaded.scene, *place))
        .collect();
    let corners = loaded.scene.triangles().flatten();
    let ends = [walk.from, walk.to, walk.standing];
    let places = corners.chain(sources.iter().copied()).chain(ends);
    let numbers = places.flat_map(|place| place.to_array());
    let materials = format!("{:?}{}", loaded.scene.materials(), walk.speed_m_s);
    let bytes = numbers.flat_map(f32::to_le_bytes).chain(materials.bytes());
    Ok(Stage {
        checksum: fnv(bytes),
        scene: loaded.scene,
        sources,
        sways,
        walk,
    })
}

/// The horizontal way in which a place has most room to both sides, as far as a source may sway.
fn sway(scene: &Scene, place: Vec3) -> Vec3 {
    let ways = (0..8).map(|k| {
        let (sine, cosine) = (std::f32::consts::PI * k as f32 / 8.0).sin_cos();
        let way = SWAY_M * Vec3::new(cosine, 0.0, sine);
        let room = clear_m(scene, place, way).min(clear_m(scene, place, -way));
        (0.8 * room / SWAY_M) * way
    });
    ways.fold(Vec3::ZERO, |best, way| {
        if way.length() > best.length() {
            way
        } else {
            best
        }
    })
}

/// What sources say.
pub(super) struct Sounds {
    pub(super) clips: Vec<Clip>,
    pub(super) checksum: u64,
}

/// What all units share.
pub(super) struct Props {
    pub(super) hrtf: Arc<Hrtf>,
    /// By the signal's name.
    pub(super) sounds: BTreeMap<String, Sounds>,
    pub(super) out: PathBuf,
    /// Of the program: a result made by another program does not count.
    pub(super) program: u64,
}

/// Loads every sound that units need.
pub(super) fn props<'a>(
    arguments: &Arguments,
    signals: impl Iterator<Item = &'a str>,
) -> Result<Props> {
    let mut sounds = BTreeMap::new();
    for signal in signals {
        if !sounds.contains_key(signal) {
            sounds.insert(
                signal.to_owned(),
                load(signal, arguments.speech.as_deref())?,
            );
        }
    }
    let program = std::env::current_exe().and_then(std::fs::read);
    Ok(Props {
        hrtf: Arc::new(Hrtf::builtin(RATE_HZ)?),
        sounds,
        out: arguments.out.clone(),
        // A program that cannot read itself finds no earlier results.
        program: program.map_or(u64::from(std::process::id()), fnv),
    })
}

fn load(signal: &str, own: Option<&Path>) -> Result<Sounds> {
    let clips = match (signal, own) {
        ("speech", Some(folder)) => recordings(folder)?,
        ("speech", None) => (1..=MOST_SOURCES)
            .map(|voice| clip(&asset(&format!("speech/voice{voice:02}.wav"))?))
            .collect::<Result<_>>()?,
        (other, _) => vec![clip(&asset(&format!("signals/{other}.wav"))?)?],
    };
    let samples = clips.iter().flat_map(|clip| &clip.samples);
    let checksum = fnv(samples.flat_map(|s| s.to_bits().to_le_bytes()));
    Ok(Sounds { clips, checksum })
}

fn clip(file: &Path) -> Result<Clip> {
    let (clip, notes) = load_clip(file, RATE_HZ)?;
    tell(&notes);
    Ok(clip)
}

/// All WAV files of a folder, in the order of their names.
fn recordings(folder: &Path) -> Result<Vec<Clip>> {
    let advice = "give a folder that holds WAV files";
    let entries = std::fs::read_dir(folder).map_err(|e| Error::file(folder, e, advice))?;
    let mut files = Vec::new();
    for entry in entries {
        let file = entry.map_err(|e| Error::file(folder, e, advice))?.path();
        let is_wav = file
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("wav"));
        if is_wav && file.is_file() {
            files.push(file);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(Error::file(folder, "holds no WAV file", advice));
    }
    let mut clips = Vec::with_capacity(files.len());
    for file in files.iter().take(MOST_SOURCES) {
        let (clip, notes) = load_recording(file, RATE_HZ)?;
        tell(&notes);
        if clip.samples.iter().all(|sample| *sample == 0.0) {
            let advice = "take it out of the folder: nothing can be compared in silence";
            return Err(Error::format(file, None, "is silent", advice));
        }
        clips.push(clip);
    }
    if files.len() > MOST_SOURCES {
        tell(&[format!(
            "{}: the first {MOST_SOURCES} of {} files are used",
            folder.display(),
            files.len()
        )]);
    }
    Ok(clips)
}

/// FNV-1a, 64 bits.
pub(super) fn fnv(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
