//! `bench commit`: time of committing a scene, of saving it, and of loading what was saved.

use std::path::PathBuf;
use std::time::Instant;

use foresound::Result;
use foresound::scene::procedural::million;
use foresound::scene::{MaterialTable, Scene, SceneSettings};
use serde_json::json;

use crate::inputs::{SceneArguments, read_mesh};
use crate::printed;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scenes by name, or files; `million` is hilly ground of a million triangles.
    #[arg(long, num_args = 1.., default_values = ["concert_hall", "bootcamp", "million"])]
    scene: Vec<PathBuf>,
    /// Commits and loads of each scene; the shortest counts.
    #[arg(long, default_value_t = 3)]
    repeats: usize,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A result and the shortest time of several runs, in milliseconds.
#[expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
fn shortest_ms<T>(repeats: usize, mut run: impl FnMut() -> Result<T>) -> Result<(T, f64)> {
    let mut timed = || {
        let start = Instant::now();
        let result = run()?;
        Ok((result, 1e3 * start.elapsed().as_secs_f64()))
    };
    let mut best = timed()?;
    for _ in 1..repeats {
        let next = timed()?;
        if next.1 < best.1 {
            best = next;
        }
    }
    Ok(best)
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut rows = Vec::new();
    for named in &arguments.scene {
        let (mesh, table) = match named.to_str() {
            Some("million") if !named.exists() => (million().mesh, MaterialTable::built_in()),
            _ => {
                let read = read_mesh(named, &SceneArguments::default())?;
                (read.mesh, read.table)
            }
        };
        let settings = SceneSettings::default();
        let repeats = arguments.repeats;
        let commit = || Scene::commit(&mesh, &table, &settings);
        let (scene, commit_ms) = shortest_ms(repeats, commit)?;
        let (bytes, save_ms) = shortest_ms(1, || scene.to_bytes())?;
        let (_, load_ms) = shortest_ms(repeats, || Scene::from_bytes(&bytes))?;
        rows.push(json!({
            "scene": named.display().to_string(),
            "triangles": scene.report().triangles,
            "commit_ms": commit_ms,
            "save_ms": save_ms,
            "load_ms": load_ms,
            "load_share": load_ms / commit_ms,
            "bytes": bytes.len(),
        }));
    }
    printed::rows(&rows, arguments.json);
    Ok(())
}
