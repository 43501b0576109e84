//! `bench rays`: rays a second on one thread.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use foresound::geometry::bvh::{Bvh, InstructionSet};
use foresound::scene::procedural;
use foresound::{Error, Result};
use glam::Vec3;
use serde_json::{Value, json};

use super::dump::dump;
use super::ray_sets::{RaySet, ray_sets, trace};
use crate::inputs::{LoadedScene, SceneArguments, load_scene};
use crate::printed;

/// A round repeats its set for at least this long.
const ROUND: Duration = Duration::from_millis(50);

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scene by name; all three of the paper's kind if not given.
    #[arg(long)]
    scene: Option<String>,
    /// scalar, avx2 or neon; the machine's best if not given.
    #[arg(long, value_name = "SET")]
    instruction_set: Option<String>,
    /// Number of rounds; the fastest counts.
    #[arg(long, default_value_t = 10)]
    rounds: u32,
    /// Write rays and triangles to a folder as raw little-endian f32.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
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
    printed::rows(&rows, arguments.json);
    Ok(())
}

fn measure(name: &str, arguments: &Arguments, rows: &mut Vec<Value>) -> Result<()> {
    let loaded = load_scene(Path::new(name), &SceneArguments::default())?;
    let (listener, sources) = positions(name, &loaded)?;
    let scene = &loaded.scene;
    let bvh = tree(scene.bvh(), arguments.instruction_set.as_deref())?;
    let sets = ray_sets(scene, listener, &sources);
    if let Some(folder) = &arguments.dump {
        dump(folder, name, &bvh, &sets)?;
    }
    for set in &sets {
        let (rays_per_s, hits) = fastest(&bvh, set, arguments.rounds.max(1));
        rows.push(json!({
            "scene": name,
            "set": set.name,
            "rays": set.rays.len(),
            "mrays_per_s": rays_per_s / 1e6,
            "hits": hits,
            "instruction_set": bvh.instruction_set().name(),
        }));
    }
    Ok(())
}

/// Positions of listener and sources in local coordinates.
fn positions(name: &str, loaded: &LoadedScene) -> Result<(Vec3, Vec<Vec3>)> {
    let local = |position: Vec3| loaded.scene.to_local(position).as_vec3();
    match loaded.walk() {
        Some(walk) => Ok((
            local(walk.standing),
            loaded.sources().into_iter().map(local).collect(),
        )),
        None => {
            let problem = format!("{name:?} names neither sources nor a walk");
            let advice = format!("give one of {}", procedural::NAMES.join(", "));
            Err(Error::setting("--scene", problem, &advice))
        }
    }
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
