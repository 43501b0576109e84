//! One propagation update (SPS), with its rays alone beside it.

use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use foresound::propagation::rays::directions::{fibonacci_direction, rotation};
use foresound::propagation::rays::guide_rays::GuideRays;
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
        let directions: Vec<_> = (0..1024).map(|i| fibonacci_direction(i, 1024)).collect();
        let guide = GuideRays {
            origin: scene.to_local(ear.position),
            rotation: rotation(0, 1),
            directions: &directions,
            depth: 4,
        };
        bencher.iter(|| {
            let mut found = 0;
            guide.trace(&scene, 0..1024, |_| found += 1);
            found
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
