//! Data that units share: a scene with its sources and walk, and the sounds.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use foresound::generation::Hrtf;
use foresound::scene::Scene;
use foresound::scene::layout::Walk;
use foresound::{Error, Result};
use foresound_tools::clip::{Clip, load_clip, load_recording};
use foresound_tools::fnv::fnv;
use foresound_tools::motion::ReachableFloor;
use foresound_tools::open_space::clear_m;
use glam::Vec3;

use super::Arguments;
use crate::assets::sound;
use crate::inputs::{SceneArguments, load_scene, print_notes};
use crate::laid_out::{LaidOut, laid_out};

/// Sample rate of all sounds.
pub(super) const RATE_HZ: u32 = 44_100;

/// Most sources of a cell.
const MAX_SOURCES: usize = 16;

/// Largest sway of a source to each side in the stress condition, in metres.
const SWAY_M: f32 = 1.5;

/// A scene ready for rendering.
pub(super) struct Stage {
    pub(super) scene: Arc<Scene>,
    pub(super) sources: Vec<Vec3>,
    /// Direction and distance of each source's sway.
    pub(super) sways: Vec<Vec3>,
    pub(super) walk: Walk,
    /// The floor around the walk, if motion without prediction needs it and there is one.
    pub(super) floor: Option<ReachableFloor>,
    /// Checksum of the scene and all positions.
    pub(super) checksum: u64,
}

/// Loads a scene by name or file. Sources or a walk that its layout lacks are put in open space. The floor is searched if
/// `needs_floor`.
pub(super) fn stage(named: &str, intake: &SceneArguments, needs_floor: bool) -> Result<Stage> {
    let loaded = load_scene(Path::new(named), intake)?;
    print_notes(&loaded.notes);
    let LaidOut { sources, walk } = laid_out(named, &loaded, MAX_SOURCES)?;
    let sources: Vec<Vec3> = sources.iter().map(|source| source.position).collect();
    let sways: Vec<Vec3> = sources
        .iter()
        .map(|position| sway(&loaded.scene, *position))
        .collect();
    Ok(Stage {
        floor: match needs_floor {
            true => ReachableFloor::around(&loaded.scene, walk.standing),
            false => None,
        },
        checksum: checksum(&loaded.scene, &sources, &walk),
        scene: loaded.scene,
        sources,
        sways,
        walk,
    })
}

/// Checksum of all that is heard of a scene: triangles with their surfaces and materials, the sources and the walk. Lists
/// begin with their lengths.
fn checksum(scene: &Scene, sources: &[Vec3], walk: &Walk) -> u64 {
    let count = scene.triangles().count();
    let triangles = (0u32..)
        .zip(scene.triangles())
        .flat_map(|(index, corners)| {
            let surface = scene.surface_of(index);
            let material = scene.surface(surface).material;
            let bits = corners.into_iter().flat_map(bits_of);
            [surface, material].into_iter().chain(bits)
        });
    let ends = [walk.from, walk.to, walk.standing];
    let places = sources.iter().copied().chain(ends).flat_map(bits_of);
    let lists = [count as u32].into_iter().chain(triangles);
    let lists = lists.chain([sources.len() as u32]).chain(places);
    let settings = format!("{:?} {:?}", scene.materials(), walk.speed_m_s);
    fnv(lists.flat_map(u32::to_le_bytes).chain(settings.bytes()))
}

fn bits_of(position: Vec3) -> [u32; 3] {
    position.to_array().map(f32::to_bits)
}

/// The horizontal vector with most room on both sides of a position, [`SWAY_M`] long at most.
fn sway(scene: &Scene, position: Vec3) -> Vec3 {
    let vectors = (0..8).map(|k| {
        let (sine, cosine) = (std::f32::consts::PI * k as f32 / 8.0).sin_cos();
        let vector = SWAY_M * Vec3::new(cosine, 0.0, sine);
        let room = clear_m(scene, position, vector).min(clear_m(scene, position, -vector));
        (0.8 * room / SWAY_M) * vector
    });
    vectors.fold(Vec3::ZERO, |best, vector| {
        if vector.length() > best.length() {
            vector
        } else {
            best
        }
    })
}

/// Sounds of the sources.
pub(super) struct Sounds {
    pub(super) clips: Vec<Clip>,
    pub(super) checksum: u64,
}

/// Shared by all units.
pub(super) struct Props {
    pub(super) hrtf: Arc<Hrtf>,
    /// By the signal's name.
    pub(super) sounds: BTreeMap<String, Sounds>,
    pub(super) out: PathBuf,
    /// Checksum of the program; results of another program are not reused.
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
        // Without the checksum no earlier results are reused.
        program: program.map_or(u64::from(std::process::id()), fnv),
    })
}

fn load(signal: &str, own: Option<&Path>) -> Result<Sounds> {
    let clips = match (signal, own) {
        ("speech", Some(folder)) => recordings(folder)?,
        ("speech", None) => (1..=MAX_SOURCES)
            .map(|voice| clip(&sound(&format!("speech/voice{voice:02}"))?))
            .collect::<Result<_>>()?,
        (other, _) => vec![clip(&sound(&format!("signals/{other}"))?)?],
    };
    let lists = clips.iter().flat_map(|clip| {
        let bits = clip.samples.iter().map(|sample| sample.to_bits());
        [clip.samples.len() as u32].into_iter().chain(bits)
    });
    let checksum = fnv(lists.flat_map(u32::to_le_bytes));
    Ok(Sounds { clips, checksum })
}

fn clip(file: &Path) -> Result<Clip> {
    let (clip, notes) = load_clip(file, RATE_HZ)?;
    print_notes(&notes);
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
    for file in files.iter().take(MAX_SOURCES) {
        let (clip, notes) = load_recording(file, RATE_HZ)?;
        print_notes(&notes);
        if clip.samples.iter().all(|sample| *sample == 0.0) {
            let advice = "take it out of the folder: nothing can be compared in silence";
            return Err(Error::format(file, None, "is silent", advice));
        }
        clips.push(clip);
    }
    if files.len() > MAX_SOURCES {
        print_notes(&[format!(
            "{}: the first {MAX_SOURCES} of {} files are used",
            folder.display(),
            files.len()
        )]);
    }
    Ok(clips)
}
