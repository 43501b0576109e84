//! `bench stream`: a world of many joined parts, of which one at a time comes and goes.
//!
//! The mesh is cut into the squares of a grid; each is committed and saved alone. With `--fixed` most squares are one fixed scene in
//! one commit, and a part that comes or goes is joined with that. Times are of the calling thread: of an app's
//! control thread for adding, removing and loading, of propagation's thread for updates.

use std::sync::Arc;
use std::time::Instant;

use foresound::Result;
use foresound::propagation::rays::directions::mix;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSettings, thread_processor_time,
};
use foresound::scene::procedural::{million, shoebox};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, TriangleMesh,
};
use foresound_tools::cut::cut;
use glam::{DAffine3, DVec3, Vec3};
use serde_json::json;

use super::share;
use crate::inputs::{SceneArguments, load_scene};
use crate::memory_use::resident_mb;
use crate::printed;

/// Metres beside the world of the fixed part, a cube of a centimetre.
const BESIDE_M: f32 = 10.0;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scene by name, or a file; `million` is hilly ground of a million triangles.
    #[arg(long, default_value = "million")]
    scene: std::path::PathBuf,
    /// Side of a chunk in metres, 1 at least; that of `million` has 10,082 triangles at 106.5 m.
    #[arg(long, default_value_t = 106.5)]
    chunk: f64,
    /// Chunks that are removed and added again.
    #[arg(long, default_value_t = 40)]
    repeats: usize,
    /// One fixed scene has all chunks but every eighth, which come and go.
    #[arg(long)]
    fixed: bool,
    /// Sources.
    #[arg(long, default_value_t = 4)]
    sources: usize,
    /// Updates before and after each change.
    #[arg(long, default_value_t = 12)]
    updates: usize,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

struct World {
    mesh: TriangleMesh,
    table: MaterialTable,
    sources: Vec<Vec3>,
    listener: Vec3,
}

fn world(arguments: &Arguments) -> Result<World> {
    if arguments.scene.to_str() == Some("million") && !arguments.scene.exists() {
        let made = million();
        return Ok(World {
            listener: made.walk.standing,
            sources: made.sources.iter().map(|(_, at)| *at).collect(),
            mesh: made.mesh,
            table: MaterialTable::built_in(),
        });
    }
    let arguments = (&arguments.scene, SceneArguments::default());
    let loaded = load_scene(arguments.0, &arguments.1)?;
    let read = crate::inputs::read_mesh(arguments.0, &arguments.1)?;
    let standing = loaded.walk().map(|walk| walk.standing);
    Ok(World {
        mesh: read.mesh,
        table: read.table,
        sources: loaded.sources(),
        listener: standing.unwrap_or_default(),
    })
}

/// Positions between two coordinates, a step apart.
fn planes(mesh: &TriangleMesh, axis: usize, step_m: f64) -> Vec<f64> {
    let values = || mesh.vertices.iter().map(|v| f64::from(v[axis]));
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    let count = ((high - low) / step_m).ceil() as usize;
    (1..count).map(|n| low + step_m * n as f64).collect()
}

/// A fixed part that touches nothing: a cube of a centimetre beside a mesh.
fn beside(mesh: &TriangleMesh) -> TriangleMesh {
    let corners = mesh.vertices.iter().copied();
    let low = corners.fold(Vec3::INFINITY, Vec3::min);
    let mut mark = shoebox(Vec3::splat(0.01), "concrete");
    for vertex in &mut mark.vertices {
        *vertex += low - BESIDE_M;
    }
    mark
}

/// Every eighth chunk, and all others as one mesh.
fn split(chunks: Vec<TriangleMesh>) -> Result<(Vec<TriangleMesh>, TriangleMesh)> {
    let (mut parts, mut fixed) = (Vec::new(), TriangleMesh::default());
    for (number, chunk) in chunks.into_iter().enumerate() {
        match number % 8 {
            3 => parts.push(chunk),
            _ => fixed.append(&chunk, &DAffine3::IDENTITY)?,
        }
    }
    Ok((parts, fixed))
}

#[expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
fn timed_ms<T>(run: impl FnOnce() -> T) -> (T, [f64; 2]) {
    let (start, worked) = (Instant::now(), thread_processor_time());
    let result = run();
    let took = thread_processor_time().zip(worked);
    let worked_s = took.map_or(0.0, |(after, before)| (after - before).as_secs_f64());
    (
        result,
        [start.elapsed().as_secs_f64(), worked_s].map(|s| 1e3 * s),
    )
}

fn here() -> InstancePose {
    InstancePose::at(InstanceId::default(), DVec3::ZERO)
}

/// Times of one kind in milliseconds: by the clock, and of the processor, which other programs do not lengthen.
#[derive(Default)]
struct Times(Vec<[f64; 2]>);

impl Times {
    fn summary(&self) -> serde_json::Value {
        let [clock, processor] = [0, 1].map(|kind| {
            let values: Vec<f64> = self.0.iter().map(|times| times[kind]).collect();
            (share(&values, 0.5), values.into_iter().fold(0.0, f64::max))
        });
        json!({
            "p50": clock.0,
            "max": clock.1,
            "processor_p50": processor.0,
            "processor_max": processor.1,
        })
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let world = world(arguments)?;
    let [x, z] = [0, 2].map(|axis| planes(&world.mesh, axis, arguments.chunk.max(1.0)));
    let chunks = cut(&world.mesh, [&x, &[], &z]);
    let (chunks, fixed) = match arguments.fixed {
        false => (chunks, beside(&world.mesh)),
        true => split(chunks)?,
    };
    let (mut commit, mut load) = (Times::default(), Times::default());
    let mut parts = Vec::new();
    for chunk in &chunks {
        let settings = SceneSettings::default();
        let (part, ms) = timed_ms(|| Scene::commit(chunk, &world.table, &settings));
        commit.0.push(ms);
        let bytes = part?.to_bytes()?;
        let (part, ms) = timed_ms(|| Scene::from_bytes(&bytes));
        load.0.push(ms);
        parts.push(Arc::new(part?));
    }
    let settings = SceneSettings::default();
    let fixed = Scene::commit(&fixed, &world.table, &settings)?;
    let of_fixed = fixed.report().triangles;
    let mut settings = EngineSettings::default();
    settings.affinity = AffinityPolicy::System;
    let (mut controller, _renderer) = Engine::new(settings)?;
    controller.set_scene(Arc::new(fixed))?;
    let mut growing = Times::default();
    let mut ids = Vec::new();
    for part in &parts {
        let (id, ms) = timed_ms(|| controller.add_joined_instance(Arc::clone(part), &here()));
        growing.0.push(ms);
        ids.push(id?);
    }
    let changed = changes(arguments, &world, &parts, &mut ids, &mut controller)?;
    let triangles: usize = parts.iter().map(|part| part.report().triangles).sum();
    let of_parts: usize = parts.iter().map(|part| part.memory_bytes()).sum();
    let own = controller.scene().memory_bytes();
    let row = json!({
        "scene": arguments.scene.display().to_string(),
        "triangles": triangles,
        "fixed_triangles": of_fixed,
        "chunks": parts.len(),
        "triangles_a_chunk": triangles / parts.len().max(1),
        "commit_ms": commit.summary(),
        "load_ms": load.summary(),
        "first_add_ms": growing.summary(),
        "add_ms": changed.add.summary(),
        "remove_ms": changed.remove.summary(),
        "update_ms": changed.before.summary(),
        "update_after_change_ms": changed.after.summary(),
        "parts_mb": of_parts as f64 / 1e6,
        "joined_mb": own as f64 / 1e6,
        "resident_mb": resident_mb(),
    });
    printed::rows(&[row], arguments.json);
    Ok(())
}

/// What chunks that come and go cost.
struct Changes {
    add: Times,
    remove: Times,
    before: Times,
    after: Times,
}

fn changes(
    arguments: &Arguments,
    world: &World,
    parts: &[Arc<Scene>],
    ids: &mut [InstanceId],
    controller: &mut Controller,
) -> Result<Changes> {
    let mut propagator = Propagator::new(
        Arc::clone(controller.scene()),
        PropagationSettings::default(),
    )?;
    let sources = world.sources.iter().take(arguments.sources).zip(0..);
    let sources: Vec<SourcePose> = sources
        .map(|(at, slot)| SourcePose::at(SourceId::new(slot, 0), *at))
        .collect();
    let mut set = PathSet::default();
    let mut step = 0;
    let mut update = |propagator: &mut Propagator, times: &mut Times| {
        let aside = Vec3::X * (0.02 * (step % 100) as f32);
        step += 1;
        let listener = ListenerPose::facing(world.listener + aside, 0.0);
        let ((), ms) = timed_ms(|| propagator.update(&listener, &sources, 0.0, &mut set));
        times.0.push(ms);
    };
    let mut result = Changes {
        add: Times::default(),
        remove: Times::default(),
        before: Times::default(),
        after: Times::default(),
    };
    for _ in 0..32 {
        update(&mut propagator, &mut Times::default());
    }
    for _ in 0..4 * arguments.updates {
        update(&mut propagator, &mut result.before);
    }
    for repeat in 0..arguments.repeats {
        let which = mix(repeat as u64) as usize % ids.len();
        let (removed, ms) = timed_ms(|| controller.remove_instance(ids[which]));
        removed?;
        result.remove.0.push(ms);
        propagator.scene_mut().clone_from(controller.scene());
        for _ in 0..arguments.updates {
            update(&mut propagator, &mut result.after);
        }
        let part = Arc::clone(&parts[which]);
        let (added, ms) = timed_ms(|| controller.add_joined_instance(part, &here()));
        ids[which] = added?;
        result.add.0.push(ms);
        propagator.scene_mut().clone_from(controller.scene());
        for _ in 0..arguments.updates {
            update(&mut propagator, &mut result.after);
        }
    }
    Ok(result)
}
