//! `bench rays`: rays a second on one thread.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use foresound::geometry::bvh::{Bvh, InstructionSet};
use foresound::scene::procedural;
use foresound::{Error, Result};
use glam::Vec3;
use serde_json::json;

use super::dump::dump;
use super::ray_sets::{RaySet, ray_sets, trace};
use crate::inputs::{LoadedScene, SceneArguments, load_scene};

/// A round repeats its set for at least this long.
const ROUND: Duration = Duration::from_millis(50);

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scene by name (the three that are open to a comparison, if not given).
    #[arg(long)]
    scene: Option<String>,
    /// scalar, avx2 or neon; the machine's best if not given.
    #[arg(long, value_name = "SET")]
    instruction_set: Option<String>,
    /// Rounds of which the fastest counts.
    #[arg(long, default_value_t = 10)]
    rounds: u32,
    /// Write rays and triangles to a folder as raw little-endian f32.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

struct Row {
    scene: String,
    set: &'static str,
    rays: usize,
    mrays_per_s: f64,
    hits: usize,
    instruction_set: &'static str,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let scenes = match &arguments.scene {
        Some(scene) => vec![scene.as_str()],
        None => vec!["concert_hall", "bootcamp", "angrybot"],
    };
    let mut rows = Vec::new();
    for scene in scenes {
        measure(scene, arguments, &mut rows)?;
    }
    if arguments.json {
        let rows: Vec<_> = rows
            .iter()
            .map(|row| {
                json!({
                    "scene": row.scene,
                    "set": row.set,
                    "rays": row.rays,
                    "mrays_per_s": row.mrays_per_s,
                    "hits": row.hits,
                    "instruction_set": row.instruction_set,
                })
            })
            .collect();
        println!("{}", json!({ "rows": rows }));
    } else {
        for row in &rows {
            println!(
                "{:14} {:11} {:7} rays  {:8.3} million a second  {:7} hits  {}",
                row.scene, row.set, row.rays, row.mrays_per_s, row.hits, row.instruction_set
            );
        }
    }
    Ok(())
}

fn measure(name: &str, arguments: &Arguments, rows: &mut Vec<Row>) -> Result<()> {
    let loaded = load_scene(Path::new(name), &SceneArguments::default())?;
    let (listener, sources) = places(name, &loaded)?;
    let scene = &loaded.scene;
    let bvh = tree(scene.bvh(), arguments.instruction_set.as_deref())?;
    let sets = ray_sets(scene, listener, &sources);
    if let Some(folder) = &arguments.dump {
        dump(folder, name, &bvh, &sets)?;
    }
    for set in &sets {
        let (rays_per_s, hits) = fastest(&bvh, set, arguments.rounds.max(1));
        rows.push(Row {
            scene: name.to_owned(),
            set: set.name,
            rays: set.rays.len(),
            mrays_per_s: rays_per_s / 1e6,
            hits,
            instruction_set: bvh.instruction_set().name(),
        });
    }
    Ok(())
}

/// Where the listener stands and the sources are, in local coordinates.
fn places(name: &str, loaded: &LoadedScene) -> Result<(Vec3, Vec<Vec3>)> {
    let layout = loaded.layout.as_ref();
    let walk = layout.and_then(|layout| layout.listener.as_ref());
    let (Some(layout), Some(walk)) = (layout, walk) else {
        return Err(Error::setting(
            "--scene",
            format!("{name:?} names neither sources nor a walk"),
            &format!("give one of {}", procedural::NAMES.join(", ")),
        ));
    };
    let local = |place: Vec3| loaded.scene.to_local(place).as_vec3();
    let sources = layout.sources.iter().map(|s| local(s.position)).collect();
    Ok((local(walk.standing), sources))
}

fn tree(best: &Bvh, named: Option<&str>) -> Result<Bvh> {
    let Some(name) = named else {
        return Ok(best.clone());
    };
    InstructionSet::by_name(name)
        .and_then(|set| best.rebuilt_for(set))
        .ok_or_else(|| {
            let here: Vec<_> = InstructionSet::ALL
                .into_iter()
                .filter(|set| set.is_available())
                .map(InstructionSet::name)
                .collect();
            Error::setting(
                "--instruction-set",
                format!("this machine has no {name:?}"),
                &format!("give one of {}", here.join(", ")),
            )
        })
}

/// Rays a second of the fastest round, and hits.
#[expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
fn fastest(bvh: &Bvh, set: &RaySet, rounds: u32) -> (f64, usize) {
    let mut most = 0.0f64;
    let hits = trace(bvh, set);
    for _ in 0..rounds {
        let start = Instant::now();
        let mut rays = 0usize;
        while start.elapsed() < ROUND {
            std::hint::black_box(trace(bvh, set));
            rays += set.rays.len();
        }
        most = most.max(rays as f64 / start.elapsed().as_secs_f64());
    }
    (most, hits)
}
