//! `evaluate`: the paper's Tables 5 and 6 with this engine, and the report.

mod figures;
mod motion;
mod overload;
mod plan;
mod rendering;
mod stage;
mod tables;
mod unit;
mod work;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use foresound::output::WholeFile;
use foresound::{Error, Result};
use foresound_tools::report::Report;
use serde_json::Value;

use self::plan::{Part, Unit};
use self::stage::Stage;
use self::tables::Found;
use crate::inputs::{SceneArguments, print_notes, within};

/// Default file with the output of `bench speed --json`.
const SPEED_FILE: &str = "out/speed.json";

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Platform of graphics rates and levels: workstation, mobile or both; default both. Motion without prediction has
    /// 74.6 graphics frames a second and L = 12 unless one platform is named.
    #[arg(long)]
    platform: Option<String>,
    /// One scene instead of the paper's three: a name, or a mesh file. Without a layout beside it (FILE.toml), sources and
    /// a walk are put in open space.
    #[arg(long)]
    scene: Option<String>,
    #[command(flatten)]
    intake: SceneArguments,
    /// Folder of WAV files for the sources, instead of the sixteen voices.
    #[arg(long, value_name = "DIR")]
    speech: Option<PathBuf>,
    /// One number of sources instead of 1, 2, 4, 8 and 16.
    #[arg(long)]
    sources: Option<usize>,
    /// static, dynamic, stress (a running listener, moving sources, L = 24); without prediction restless (random walk with
    /// stops), dash (5 m/s around corners), irregular (sources on random curves), teleport (listener), jump (sources); or
    /// both (the paper's two), unpredicted (those five), usual (both and unpredicted, the default), or all.
    #[arg(long)]
    condition: Option<String>,
    /// Add the stress condition.
    #[arg(long)]
    stress: bool,
    /// hold, linear, best or all.
    #[arg(long, default_value = "all")]
    predictor: String,
    /// When results are used: modelled (L + 1 graphics frames later), none (at once) or both.
    #[arg(long, default_value = "modelled")]
    latency: String,
    /// Score the engine too, beside the offline renderer: virtual (updates arrive L + 1 graphics frames after their poses)
    /// or real (by this machine's clock, one cell after another), or both with a comma.
    #[arg(long, value_delimiter = ',')]
    engine: Vec<String>,
    /// speech, music, percussion, or all.
    #[arg(long, default_value = "speech")]
    signal: String,
    /// Compare discrete paths alone, without late reverb.
    #[arg(long)]
    no_late: bool,
    /// Repeats of each cell; five, or one with --quick.
    #[arg(long)]
    repeats: Option<u64>,
    /// Length of each rendering in seconds.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// One cell of each scene and one repeat.
    #[arg(long)]
    quick: bool,
    /// Output of `bench speed --json` for Tables 3 and 4 of the report; default out/speed.json, if it exists.
    #[arg(long, value_name = "FILE")]
    speed: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Output folder; results found there are reused.
    #[arg(long, default_value = "out/evaluation")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    within("--seconds", arguments.seconds, 2.0..=120.0, " s")?;
    let speed = speed(arguments.speed.as_deref())?;
    let mut units = plan::units(arguments)?;
    let stages = stages(arguments, &units)?;
    keep_with_floor(arguments, &stages, &mut units)?;
    keep_possible(arguments, &stages, &mut units)?;
    let signals = units.iter().map(|unit| unit.signal.as_str());
    let props = stage::props(arguments, signals)?;
    let results = work::all_results(&units, &stages, &props)?;
    let found = Found::of(&units, &results);
    let overload = overload::overload(&arguments.out, &units, &results)?;
    let text = tables::json(&found, &overload.rows);
    tables::write(&arguments.out, &found, &text)?;
    let mut report = Report {
        rows: found.rows,
        doorway: found.doorway,
        speed,
        overload: overload.rows,
        figures: Vec::new(),
        listening: Vec::new(),
        conditions: figures::conditions(arguments, &units, &results),
    };
    figures::add(&arguments.out, &units, &mut report)?;
    report.figures.extend(overload.figures);
    report.listening.extend(overload.listening);
    let page = arguments.out.join("index.html");
    WholeFile::write(&page, |file| {
        std::io::Write::write_all(file, report.html().as_bytes())
    })?;
    if arguments.json {
        outln!("{text}");
    } else {
        tables::print(&report.rows);
        outln!("report: {}", page.display());
    }
    Ok(())
}

/// The scene of every unit, by label.
fn stages(arguments: &Arguments, units: &[Unit]) -> Result<BTreeMap<String, Stage>> {
    let mut stages = BTreeMap::new();
    for unit in units {
        if stages.contains_key(&unit.scene) {
            continue;
        }
        let named = match &arguments.scene {
            Some(named) if unit.part == Part::Table => named,
            _ => &unit.scene,
        };
        let needs_floor =
            |other: &Unit| other.condition.is_unpredicted() && other.scene == unit.scene;
        let needs_floor = units.iter().any(needs_floor);
        let stage = stage::stage(named, &arguments.intake, needs_floor)?;
        stages.insert(unit.scene.clone(), stage);
    }
    Ok(stages)
}

/// Removes motion without prediction where no floor is found around the walk; refuses it if `--condition` names it.
fn keep_with_floor(
    arguments: &Arguments,
    stages: &BTreeMap<String, Stage>,
    units: &mut Vec<Unit>,
) -> Result<()> {
    let without = stages.iter().filter(|(_, stage)| stage.floor.is_none());
    for (label, _) in without {
        let needs_floor = |unit: &Unit| unit.scene == *label && unit.condition.is_unpredicted();
        if !units.iter().any(needs_floor) {
            continue;
        }
        let problem = format!("{label}: no floor was found around the walk");
        if arguments.condition.is_some() {
            let advice = "check --scale and --up, and the listener of the TOML file";
            return Err(Error::setting("--condition", problem, advice));
        }
        print_notes(&[format!("{problem}; motion without prediction is left out")]);
        units.retain(|unit| !needs_floor(unit));
    }
    Ok(())
}

/// Removes cells with more sources than their scene has; refuses them if `--sources` names them.
fn keep_possible(
    arguments: &Arguments,
    stages: &BTreeMap<String, Stage>,
    units: &mut Vec<Unit>,
) -> Result<()> {
    for (label, stage) in stages {
        let available = stage.sources.len();
        let too_many = |unit: &Unit| unit.scene == *label && unit.sources > available;
        if !units.iter().any(too_many) {
            continue;
        }
        if let Some(count) = arguments.sources {
            let problem = format!("{count}, but {label} has {available}");
            let advice = format!("give at most {available}, or add sources to its TOML file");
            return Err(Error::setting("--sources", problem, &advice));
        }
        print_notes(&[format!(
            "{label}: has {available} sources; cells of more are left out"
        )]);
        units.retain(|unit| !too_many(unit));
    }
    if units.is_empty() {
        let advice = "give --sources 1, or add sources to the scene's TOML file";
        return Err(Error::setting("evaluate", "no cell is left", advice));
    }
    Ok(())
}

/// The speed table of the named file, or of the default one if it exists.
fn speed(named: Option<&Path>) -> Result<Value> {
    let file = named.unwrap_or(Path::new(SPEED_FILE));
    if named.is_none() && !file.is_file() {
        return Ok(Value::Null);
    }
    let advice = "make it with `foresound bench speed --json > FILE`";
    let text = std::fs::read(file).map_err(|e| Error::file(file, e, advice))?;
    serde_json::from_slice(&text).map_err(|e| Error::format(file, None, e, advice))
}
