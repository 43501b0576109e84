//! Law *thread count*: an update has the same bits on any number of threads.

use std::sync::Arc;

use super::Row;
use foresound::error::Result;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};

/// Numbers of threads compared with one.
const THREADS: [usize; 3] = [2, 3, 5];

/// Updates of a walk that are compared, and metres between two of them.
const WALK: (u32, f32) = (6, 0.07);

/// Number of sources: more than threads, and not a multiple of them.
const SOURCES: usize = 7;

/// A closed scene and one with shadows.
const SCENES: [&str; 2] = ["concert_hall", "doorway"];

/// One row a scene and number of threads.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for name in SCENES {
        let Some(benchmark) = procedural::by_name(name) else {
            continue;
        };
        let table = MaterialTable::built_in();
        let settings = SceneSettings::default();
        let scene = Arc::new(Scene::commit(&benchmark.mesh, &table, &settings)?);
        let alone = walk(&scene, &benchmark, 1)?;
        for threads in THREADS {
            let bits = differing_bits(&alone, &walk(&scene, &benchmark, threads)?);
            let law = format!("thread count: {name}, {threads} threads against one");
            rows.push(Row::at_most(law, bits as f64, 0.0, "bits of an update"));
        }
    }
    Ok(rows)
}

/// Results of a few updates as words.
fn walk(
    scene: &Arc<Scene>,
    benchmark: &procedural::BenchmarkScene,
    threads: usize,
) -> Result<Vec<u32>> {
    let threads = Threads::start(threads)?;
    let mut propagator = Propagator::new(Arc::clone(scene), PropagationSettings::default())?;
    let positions = (0..).zip(benchmark.sources.iter().take(SOURCES));
    let sources: Vec<_> = positions
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot, 0), *position))
        .collect();
    let onward = (benchmark.walk.to - benchmark.walk.from).normalize_or_zero();
    let mut set = PathSet::default();
    let mut words = Vec::new();
    for step in 0..WALK.0 {
        let ear = ListenerPose {
            position: benchmark.walk.standing + onward * (WALK.1 * step as f32),
            ..ListenerPose::default()
        };
        propagator.update_with(&threads, &ear, &sources, 0.0, &mut set);
        put_words(&set, &mut words);
    }
    Ok(words)
}

fn put_words(set: &PathSet, words: &mut Vec<u32>) {
    let long = |value: u64| [value as u32, (value >> 32) as u32];
    words.extend(long(set.rays));
    for path in &set.paths {
        words.extend(long(path.id.0));
        words.extend([
            path.source.bits(),
            path.order.into(),
            path.diffraction_order.into(),
        ]);
        words.extend(path.surfaces.iter().chain(&path.edges));
        let points = path.points.iter().chain([&path.image]);
        words.extend(points.flat_map(|p| p.to_array()).map(f32::to_bits));
        let levels = path.amplitude.iter().chain([&path.length_m]);
        words.extend(levels.map(|value| value.to_bits()));
    }
    for (source, edge) in &set.direct_edges {
        words.extend([source.bits(), *edge]);
    }
    for (source, near) in &set.reflection_edges {
        let surfaces = near.surfaces.map(|surface| surface.unwrap_or(u32::MAX));
        words.extend([source.bits(), near.edge]);
        words.extend(surfaces);
    }
    for late in &set.late {
        let values = late.energy.as_flattened().as_flattened().iter();
        let values = values.chain([&late.start_s, &late.mean_free_time_s]);
        words.extend(values.map(|value| value.to_bits()));
    }
    for group in &set.late_groups {
        let values = group.directions.as_flattened().iter();
        let values = values.chain(&group.decay_time_s);
        words.extend(values.map(|value| value.to_bits()));
    }
}

/// Number of different bits; words present on one side only differ in all bits.
fn differing_bits(a: &[u32], b: &[u32]) -> u64 {
    let shared: u64 = a
        .iter()
        .zip(b)
        .map(|(a, b)| u64::from((a ^ b).count_ones()))
        .sum();
    shared + 32 * a.len().abs_diff(b.len()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_is_compared() {
        assert_eq!(differing_bits(&[1, 6, 0], &[1, 5, 0]), 2);
        assert_eq!(differing_bits(&[1], &[1, 5]), 32);
    }
}
