//! `evaluate`: the paper's Tables 5 and 6 with our engine, and the report on them.

mod figures;
mod plan;
mod tables;
mod unit;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use foresound::generation::Hrtf;
use foresound::{Error, Result};

use self::plan::Unit;
use self::unit::{Props, RATE_HZ, Stage, UnitResult, fnv};
use crate::inputs::{SceneArguments, asset, load_scene, load_sound, tell};
use crate::progress::Progress;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// workstation, mobile or both: whose graphics rates and levels.
    #[arg(long, default_value = "both")]
    platform: String,
    /// One scene instead of the paper's three: a name, or an OBJ file with a layout beside it.
    #[arg(long)]
    scene: Option<String>,
    /// One number of sources instead of 1, 2, 4, 8 and 16.
    #[arg(long)]
    sources: Option<usize>,
    /// static, dynamic or both.
    #[arg(long, default_value = "both")]
    condition: String,
    /// hold, linear, best, all, or ablation: all and best without each of its ingredients.
    #[arg(long, default_value = "all")]
    predictor: String,
    /// modelled: results are used L + 1 graphics frames late; none: at once.
    #[arg(long, default_value = "modelled")]
    latency: String,
    /// speech, music or percussion.
    #[arg(long, default_value = "speech")]
    signal: String,
    /// Repeats of each cell; five, or one with --quick.
    #[arg(long)]
    repeats: Option<u64>,
    /// Length of each rendering.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// One cell a scene, one repeat.
    #[arg(long)]
    quick: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Folder for what is written; results found there are not made again.
    #[arg(long, default_value = "out/evaluation")]
    out: PathBuf,
}

impl Arguments {
    /// Whether neither platform nor condition was chosen.
    fn is_default_choice(&self) -> bool {
        self.platform == "both" && self.condition == "both"
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if !(2.0..=120.0).contains(&arguments.seconds) {
        let problem = format!("{} s", arguments.seconds);
        return Err(Error::setting("--seconds", problem, "give 2 to 120"));
    }
    let units = plan::units(arguments)?;
    let props = props(arguments)?;
    let mut stages = BTreeMap::new();
    for unit in &units {
        if !stages.contains_key(&unit.scene) {
            stages.insert(unit.scene.clone(), stage(&unit.scene)?);
        }
    }
    let results = all_results(&units, &stages, &props)?;
    let rows = tables::rows(&units, &results);
    tables::write(&arguments.out, &rows)?;
    let report = figures::report(&arguments.out, &units, &rows)?;
    if arguments.json {
        println!("{}", tables::json(&rows));
    } else {
        tables::print(&rows);
        println!("report: {}", report.display());
    }
    Ok(())
}

fn props(arguments: &Arguments) -> Result<Props> {
    let files: Vec<PathBuf> = match arguments.signal.as_str() {
        "speech" => (1..=16)
            .map(|voice| asset(&format!("speech/voice{voice:02}.wav")))
            .collect::<Result<_>>()?,
        other @ ("music" | "percussion") => vec![asset(&format!("signals/{other}.wav"))?],
        other => {
            let problem = format!("{other:?} is unknown");
            let advice = "give speech, music or percussion";
            return Err(Error::setting("--signal", problem, advice));
        }
    };
    let clips = files
        .iter()
        .map(|file| load_sound(file, RATE_HZ))
        .collect::<Result<_>>()?;
    let program = std::env::current_exe().and_then(std::fs::read);
    Ok(Props {
        hrtf: Arc::new(Hrtf::builtin(RATE_HZ)?),
        clips,
        out: arguments.out.clone(),
        // A program that cannot read itself finds no earlier results.
        program: program.map_or(u64::from(std::process::id()), fnv),
    })
}

fn stage(name: &str) -> Result<Stage> {
    let loaded = load_scene(Path::new(name), &SceneArguments::default())?;
    tell(&loaded.notes);
    let layout = loaded.layout.filter(|layout| !layout.sources.is_empty());
    let walk = layout.as_ref().and_then(|layout| layout.listener);
    let (Some(layout), Some(walk)) = (layout, walk) else {
        let advice = "put a TOML file with sources and a listener beside the OBJ file";
        return Err(Error::file(name, "has no layout", advice));
    };
    let corners = loaded.scene.triangles().flatten();
    let numbers = corners.flat_map(|corner| corner.to_array());
    let places = layout.sources.iter().map(|s| s.position);
    let places = places.chain([walk.from, walk.to, walk.standing]);
    let numbers = numbers.chain(places.flat_map(|place| place.to_array()));
    Ok(Stage {
        checksum: fnv(numbers.flat_map(f32::to_le_bytes)),
        scene: loaded.scene,
        layout,
        walk,
    })
}

/// Results of all units in their order, made on as many threads as the machine has cores. No result depends on the
/// others or on the threads.
fn all_results(
    units: &[Unit],
    stages: &BTreeMap<String, Stage>,
    props: &Props,
) -> Result<Vec<UnitResult>> {
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let mut results: Vec<Option<UnitResult>> = vec![None; units.len()];
    let mut progress = Progress::new("evaluate", units.len() as u64);
    std::thread::scope(|scope| -> Result<()> {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..workers.min(units.len()) {
            let (sender, next, stop) = (sender.clone(), &next, &stop);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let Some(unit) = units.get(place) else {
                        break;
                    };
                    let Some(stage) = stages.get(&unit.scene) else {
                        break;
                    };
                    if sender
                        .send((place, unit::result(unit, stage, props)))
                        .is_err()
                    {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (place, result) in receiver {
            if result.is_err() {
                stop.store(true, Ordering::Relaxed);
            }
            results[place] = Some(result?);
            progress.step();
        }
        Ok(())
    })?;
    Ok(results.into_iter().flatten().collect())
}
