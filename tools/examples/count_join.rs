//! Chunks that come and go in a world of a million triangles, for counters of instructions.
//!
//! `count_join TIMES`: nine neighbouring chunks of 10,000 triangles and 91 copies of them far away are joined parts; the one in
//! the middle goes and comes back. `valgrind --tool=callgrind --toggle-collect='count_join::come_back'` counts its returns.
//! `count_join fixed FILE` saves a million triangles without that chunk as one scene, `count_join TIMES FILE` adds the chunk to it:
//! the first time is the first part that the scene is joined with.

use std::path::Path;
use std::sync::Arc;

use foresound::scene::procedural::{million, shoebox};
use foresound::scene::{
    InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, TriangleMesh,
};
use foresound_tools::cut::cut;
use glam::{DAffine3, DVec3, Vec3};

/// Side of a chunk in metres.
const CHUNK_M: f64 = 106.5;
/// Copies of the nine chunks in the world, with the last one in part.
const CHUNKS: usize = 100;
/// Distance of copies in metres.
const APART_M: f64 = 400.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        ["fixed", file] => save_fixed(Path::new(file)),
        [times, file] => to_fixed(times.parse()?, Path::new(file)),
        [times] => among_parts(times.parse()?),
        _ => Err("arguments: TIMES | fixed FILE | TIMES FILE".into()),
    }
}

/// The chunk in the middle, and all others as one mesh.
fn hole() -> foresound::Result<(TriangleMesh, TriangleMesh)> {
    let planes: Vec<f64> = (1..10).map(|n| CHUNK_M * f64::from(n)).collect();
    let mut chunks = cut(&million().mesh, [&planes, &[], &planes]);
    let middle = chunks.swap_remove(chunks.len() / 2);
    let mut rest = TriangleMesh::default();
    for chunk in &chunks {
        rest.append(chunk, &DAffine3::IDENTITY)?;
    }
    Ok((middle, rest))
}

fn save_fixed(file: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let (_, rest) = hole()?;
    let scene = Scene::commit(&rest, &MaterialTable::built_in(), &SceneSettings::default())?;
    Ok(scene.save(file)?)
}

fn to_fixed(times: usize, file: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let (middle, _) = hole()?;
    let part = Scene::commit(
        &middle,
        &MaterialTable::built_in(),
        &SceneSettings::default(),
    )?;
    let part = Arc::new(part);
    let mut world = Scene::load(file)?;
    for _ in 0..times {
        let id = come_back(&mut world, &part)?;
        world.remove_instance(id)?;
    }
    Ok(())
}

fn among_parts(times: usize) -> Result<(), Box<dyn std::error::Error>> {
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
