//! One propagation update (SPS), with its rays alone beside it.

use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use foresound::propagation::discovery::trace_guide_rays;
use foresound::propagation::sampling::rotation;
use foresound::propagation::sequence::SequenceSet;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};

fn propagation(criterion: &mut Criterion) {
    let hall = procedural::concert_hall();
    let table = MaterialTable::built_in();
    let commit =
        || Scene::commit(&hall.mesh, &table, &SceneSettings::default()).expect("the hall commits");
    let scene = Arc::new(commit());
    let ear = ListenerPose {
        position: hall.walk.standing,
        ..ListenerPose::default()
    };
    let mut group = criterion.benchmark_group("concert hall");
    group.sample_size(20);
    group.bench_function("commit", |bencher| bencher.iter(commit));
    group.bench_function("guide rays", |bencher| {
        let mut found = SequenceSet::with_capacity(4096);
        bencher.iter(|| {
            found.clear();
            let local = scene.to_local(ear.position);
            trace_guide_rays(&scene, local, &rotation(0, 1), 1024, 4, &mut found, &mut 0);
            found.entries().len()
        });
    });
    for count in [1, 16] {
        let sources: Vec<SourcePose> = hall
            .sources
            .iter()
            .take(count)
            .enumerate()
            .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot as u16, 0), *position))
            .collect();
        let settings = PropagationSettings::default();
        let mut propagator = Propagator::new(Arc::clone(&scene), settings).expect("settings");
        let mut set = PathSet::default();
        propagator.warm_up(&ear, &sources);
        group.bench_function(format!("update, {count} sources"), |bencher| {
            bencher.iter(|| propagator.update(&ear, &sources, 0.0, &mut set));
        });
    }
    group.finish();
}

criterion_group!(benches, propagation);
criterion_main!(benches);
