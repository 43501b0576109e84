//! Chunks that come and go in a world of a million triangles, for counters of instructions.
//!
//! `count_join TIMES`: nine neighbouring chunks of 10,000 triangles and 91 copies of them far away are joined parts; the one in
//! the middle goes and comes back. `valgrind --tool=callgrind --toggle-collect='count_join::come_back'` counts its returns.

use std::sync::Arc;

use foresound::scene::procedural::{million, shoebox};
use foresound::scene::{InstanceId, InstancePose, MaterialTable, Scene, SceneSettings};
use foresound_tools::cut::cut;
use glam::{DVec3, Vec3};

/// Side of a chunk in metres.
const CHUNK_M: f64 = 106.5;
/// Copies of the nine chunks in the world, with the last one in part.
const CHUNKS: usize = 100;
/// Distance of copies in metres.
const APART_M: f64 = 400.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let times: usize = match std::env::args().nth(1) {
        Some(times) => times.parse()?,
        None => return Err("arguments: TIMES".into()),
    };
    let table = MaterialTable::built_in();
    let commit = |mesh: &_| Scene::commit(mesh, &table, &SceneSettings::default());
    let planes = [-1.5, -0.5, 0.5, 1.5].map(|n| n * CHUNK_M + 200.0);
    let chunks = cut(&million().mesh, [&planes, &[], &planes]);
    let inner = [6, 7, 8, 11, 12, 13, 16, 17, 18].map(|index| &chunks[index]);
    let parts: Result<Vec<_>, _> = inner
        .iter()
        .map(|mesh| commit(mesh).map(Arc::new))
        .collect();
    let parts = parts?;
    let mut mark = shoebox(Vec3::splat(0.01), "concrete");
    for vertex in &mut mark.vertices {
        *vertex -= 2000.0;
    }
    let mut world = commit(&mark)?;
    let mut middle = InstanceId::default();
    for number in 0..CHUNKS {
        let away = DVec3::X * APART_M * (number / parts.len()) as f64;
        let pose = InstancePose::at(InstanceId::default(), away);
        let id = world.add_joined_instance(Arc::clone(&parts[number % parts.len()]), &pose)?;
        if number == parts.len() / 2 {
            middle = id;
        }
    }
    let part = &parts[parts.len() / 2];
    for _ in 0..times {
        world.remove_instance(middle)?;
        middle = come_back(&mut world, part)?;
    }
    Ok(())
}

#[inline(never)]
fn come_back(world: &mut Scene, part: &Arc<Scene>) -> foresound::Result<InstanceId> {
    let here = InstancePose::at(InstanceId::default(), DVec3::ZERO);
    world.add_joined_instance(Arc::clone(part), &here)
}
