//! Inputs of a command line: scenes, materials, positions, sounds.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use foresound::extrapolation::PredictorKind;
use foresound::scene::committed::saved::is_saved;
use foresound::scene::edges::MOST_EDGES;
use foresound::scene::layout::{SceneLayout, Walk};
use foresound::scene::{
    MaterialTable, MeshOptions, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh, UpAxis,
    load_mesh, procedural,
};
use foresound::{Error, Result};
use foresound_tools::clip::{Clip, load_clip};
use foresound_tools::listener_path::parse_position;
use glam::Vec3;

use crate::materials::near;
use crate::{assets, verbosity};

/// Options of reading a mesh.
#[derive(clap::Args, Clone, Default)]
pub(crate) struct SceneArguments {
    /// Materials by name (TOML), in addition to the built-in table and the scene's own.
    #[arg(long, value_name = "FILE")]
    pub(crate) materials: Option<PathBuf>,
    /// Length of the file's unit in metres.
    #[arg(long, value_name = "FACTOR")]
    pub(crate) scale: Option<f32>,
    /// Upward axis of the file: y or z.
    #[arg(long, value_name = "AXIS")]
    pub(crate) up: Option<String>,
}

/// A scene with its layout and notes from loading.
pub(crate) struct LoadedScene {
    pub(crate) scene: Arc<Scene>,
    pub(crate) layout: Option<SceneLayout>,
    pub(crate) notes: Vec<String>,
}

impl LoadedScene {
    /// Positions of the layout's sources.
    pub(crate) fn sources(&self) -> Vec<Vec3> {
        let sources = self.layout.iter().flat_map(|layout| &layout.sources);
        sources.map(|source| source.position).collect()
    }

    /// The layout's walk.
    pub(crate) fn walk(&self) -> Option<Walk> {
        self.layout.as_ref()?.listener
    }
}

/// A mesh with the materials that its names mean.
pub(crate) struct ReadMesh {
    pub(crate) mesh: TriangleMesh,
    pub(crate) table: MaterialTable,
    layout: Option<SceneLayout>,
    warnings: Vec<String>,
}

/// The layout beside a scene's file, if there is one.
fn layout_beside(file: &Path) -> Result<Option<SceneLayout>> {
    let beside = file.with_extension("toml");
    beside
        .is_file()
        .then(|| SceneLayout::load(&beside))
        .transpose()
}

/// Reads a mesh file, or a benchmark scene by name, with its materials.
pub(crate) fn read_mesh(named: &Path, arguments: &SceneArguments) -> Result<ReadMesh> {
    let file = scene_file(named)?;
    let up = match arguments.up.as_deref() {
        None | Some("y" | "Y") => UpAxis::Y,
        Some("z" | "Z") => UpAxis::Z,
        Some(other) => {
            return Err(Error::setting(
                "--up",
                format!("{other:?} is no axis"),
                "give y or z",
            ));
        }
    };
    let options = MeshOptions::default()
        .with_scale(arguments.scale.unwrap_or(1.0))
        .with_up(up);
    let object = load_mesh(&file, &options)?;
    if object.mesh.triangles.len() == 1 {
        let advice = "export the whole model, with its faces";
        return Err(Error::format(
            &file,
            None,
            "one triangle is no scene",
            advice,
        ));
    }
    let mut table = MaterialTable::built_in();
    table.extend(object.materials);
    let layout = layout_beside(&file)?;
    if let Some(layout) = &layout {
        table.extend(layout.materials.clone());
    }
    if let Some(materials) = &arguments.materials {
        table.extend(MaterialTable::load(materials)?);
    }
    Ok(ReadMesh {
        mesh: object.mesh,
        table,
        layout,
        warnings: object.warnings,
    })
}

/// Loads a scene by file, or a benchmark scene by name. A saved scene is loaded as it is.
pub(crate) fn load_scene(named: &Path, arguments: &SceneArguments) -> Result<LoadedScene> {
    let file = scene_file(named)?;
    let (scene, layout, mut notes, table) = if is_saved(&file) {
        let given = [
            arguments.scale.is_some(),
            arguments.up.is_some(),
            arguments.materials.is_some(),
        ];
        if given.contains(&true) {
            let problem = "is a saved scene, whose scale, axis and materials are settled";
            let advice = "give them to `foresound commit`, which saves it";
            return Err(Error::file(&file, problem, advice));
        }
        let table = MaterialTable::built_in();
        (
            Scene::load(&file)?,
            layout_beside(&file)?,
            Vec::new(),
            table,
        )
    } else {
        let read = read_mesh(named, arguments)?;
        let scene = Scene::commit(&read.mesh, &read.table, &SceneSettings::default())?;
        (scene, read.layout, read.warnings, read.table)
    };
    let report = scene.report();
    let dropped = report.dropped_non_finite + report.dropped_degenerate + report.dropped_duplicate;
    if dropped > 0 {
        notes.push(format!(
            "{}: dropped {}: {} not finite, {} without area, {} twice",
            file.display(),
            counted(dropped, "triangle"),
            report.dropped_non_finite,
            report.dropped_degenerate,
            report.dropped_duplicate
        ));
    }
    if !scene.defaulted_materials().is_empty() {
        let names = scene.defaulted_materials().iter().map(|name| {
            let name = name.escape_debug().to_string();
            near(&name, &table).map_or(name.clone(), |near| format!("{name} ({near} is near)"))
        });
        notes.push(format!(
            "{}: no material is called {}; \"generic\" is used: give a --materials file that names them, or names of `foresound materials`",
            file.display(),
            listed(&names.collect::<Vec<_>>())
        ));
    }
    if scene.edges().len() == MOST_EDGES {
        notes.push(format!(
            "{}: only the longest {MOST_EDGES} diffracting edges are kept; a world of several scenes, joined with each other, keeps as many of each",
            file.display()
        ));
    }
    verbosity::told(format_args!(
        "{}: {}, {}, {}, {}",
        file.display(),
        counted(report.triangles, "triangle"),
        counted(scene.surfaces().len(), "surface"),
        counted(scene.edges().len(), "diffracting edge"),
        bytes_text(scene.memory_bytes())
    ));
    Ok(LoadedScene {
        scene: Arc::new(scene),
        layout,
        notes,
    })
}

/// A number of bytes in the unit that gives it one to three digits.
pub(crate) fn bytes_text(bytes: usize) -> String {
    let mut amount = bytes as f64;
    for unit in ["bytes", "kB", "MB"] {
        if amount < 1000.0 {
            return match unit {
                "bytes" => counted(bytes, "byte"),
                _ => format!("{amount:.1} {unit}"),
            };
        }
        amount /= 1000.0;
    }
    format!("{amount:.1} GB")
}

/// A number of things: `1 source`, `2 sources`.
pub(crate) fn counted(count: usize, thing: &str) -> String {
    match count {
        1 => format!("1 {thing}"),
        _ => format!("{count} {thing}s"),
    }
}

/// Refuses an output that would be no WAV file of its name.
pub(crate) fn check_wav_name(out: &Path) -> Result<()> {
    let is_wav = |extension: &std::ffi::OsStr| extension.eq_ignore_ascii_case("wav");
    let problem = if out.as_os_str() == "-" {
        "a WAV file's header needs its length, which standard output cannot take back"
    } else if out.extension().is_some_and(|extension| !is_wav(extension)) {
        "is no name of a WAV file, which is what is written"
    } else {
        return Ok(());
    };
    Err(Error::file(out, problem, "give a name that ends in .wav"))
}

/// The first names of a list, without control characters.
fn listed(names: &[String]) -> String {
    const MOST: usize = 12;
    let shown = names.iter().take(MOST);
    let mut text = shown.cloned().collect::<Vec<_>>().join(", ");
    if names.len() > MOST {
        text.push_str(&format!(" and {} more", names.len() - MOST));
    }
    text
}

fn scene_file(named: &Path) -> Result<PathBuf> {
    let name = named.to_string_lossy();
    if procedural::NAMES.contains(&&*name) && !named.exists() {
        return assets::scene(&name);
    }
    Ok(named.to_owned())
}

/// A source and its sound.
pub(crate) struct SourceArgument {
    pub(crate) position: SourcePosition,
    pub(crate) file: PathBuf,
}

/// Position of a source.
pub(crate) enum SourcePosition {
    /// A position in metres.
    At(Vec3),
    /// A source of the scene's layout, with all its settings.
    Named(String),
}

/// `x,y,z=voice.wav` or `NAME=voice.wav`.
pub(crate) fn parse_source(text: &str) -> Result<SourceArgument> {
    let Some((position, file)) = text.split_once('=').filter(|(_, file)| !file.is_empty()) else {
        let advice = "write x,y,z=voice.wav";
        return Err(Error::setting(
            "--source",
            format!("{text:?} names no sound"),
            advice,
        ));
    };
    let starts_as_name = |text: &str| text.starts_with(|c: char| c.is_alphabetic() || c == '_');
    let position = if starts_as_name(position) && !position.contains(',') {
        SourcePosition::Named(position.to_owned())
    } else {
        SourcePosition::At(parse_position("--source", position)?)
    };
    Ok(SourceArgument {
        position,
        file: file.into(),
    })
}

impl SourcePosition {
    /// The source itself, under the handle of its slot.
    pub(crate) fn pose(&self, slot: usize, layout: Option<&SceneLayout>) -> Result<SourcePose> {
        let id = SourceId::new(slot as u16, 0);
        let name = match self {
            Self::At(position) => return Ok(SourcePose::at(id, *position)),
            Self::Named(name) => name,
        };
        let sources = layout.map_or(&[][..], |layout| &layout.sources);
        let found = sources.iter().find(|source| source.name == *name);
        found.map(|source| source.pose(id)).ok_or_else(|| {
            let known: Vec<_> = sources.iter().map(|source| source.name.as_str()).collect();
            let advice = if known.is_empty() {
                "give x,y,z, or name sources in a TOML file beside the scene".to_owned()
            } else {
                format!("give x,y,z or one of {}", known.join(", "))
            };
            Error::setting("--source", format!("no source is called {name:?}"), &advice)
        })
    }
}

/// Refuses an output that would replace an input.
pub(crate) fn keep_inputs<'a>(
    out: &Path,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Result<()> {
    // What does not exist is no input.
    let Ok(written) = out.canonicalize() else {
        return Ok(());
    };
    let is_written = |input: &&Path| input.canonicalize().is_ok_and(|input| input == written);
    match inputs.into_iter().find(is_written) {
        Some(_) => Err(Error::file(
            out,
            "is an input of this command",
            "write to another file",
        )),
        None => Ok(()),
    }
}

impl SceneArguments {
    /// Files that are read for a scene.
    pub(crate) fn files(&self, named: &Path) -> Vec<PathBuf> {
        let beside = named.with_extension("toml");
        let files = [named.to_path_buf(), beside].into_iter();
        files.chain(self.materials.clone()).collect()
    }
}

/// A predictor by its name; `geometric`, as the library calls it, is `best`.
pub(crate) fn predictor_named(name: &str) -> Result<PredictorKind> {
    let name = match name {
        "geometric" => "best",
        name => name,
    };
    let found = PredictorKind::ALL
        .into_iter()
        .find(|kind| kind.name() == name);
    found.ok_or_else(|| {
        let known: Vec<_> = PredictorKind::ALL.iter().map(|kind| kind.name()).collect();
        let problem = format!("{name:?} is no predictor");
        let advice = format!("choose of: {}", known.join(", "));
        Error::setting("--predictor", problem, &advice)
    })
}

/// Refuses a value outside a range.
pub(crate) fn within(
    argument: &str,
    value: f64,
    range: RangeInclusive<f64>,
    unit: &str,
) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    let (low, high) = range.into_inner();
    let advice = format!("choose {low} to {high}{unit}");
    Err(Error::setting(
        argument,
        format!("{value}{unit} is out of range"),
        &advice,
    ))
}

/// A clip of one of the sixteen voices; higher numbers wrap around.
pub(crate) fn voice(number: usize, rate_hz: u32) -> Result<Clip> {
    let file = assets::sound(&format!("speech/voice{:02}", number % 16 + 1))?;
    load_sound(&file, rate_hz)
}

/// Loads a sound and prints notes on its conversion.
pub(crate) fn load_sound(file: &Path, rate_hz: u32) -> Result<Clip> {
    let (clip, notes) = load_clip(file, rate_hz)?;
    print_notes(&notes);
    Ok(clip)
}

/// Notes on standard error, a line each, unless the program is to be quiet.
pub(crate) fn print_notes(notes: &[String]) {
    if verbosity::is_quiet() {
        return;
    }
    for note in notes {
        eprintln!("note: {note}");
    }
}
