//! One graphics frame of extrapolation (EPS): direct paths validated, the others continued.

use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use foresound::extrapolation::{Extrapolator, FramePaths, PredictorKind};
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};

fn extrapolation(criterion: &mut Criterion) {
    let hall = procedural::concert_hall();
    let table = MaterialTable::built_in();
    let scene = Arc::new(
        Scene::commit(&hall.mesh, &table, &SceneSettings::default()).expect("the hall commits"),
    );
    let ear = ListenerPose {
        position: hall.walk.standing,
        ..ListenerPose::default()
    };
    let sources: Vec<SourcePose> = hall
        .sources
        .iter()
        .enumerate()
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot as u16, 0), *position))
        .collect();
    let mut propagator =
        Propagator::new(Arc::clone(&scene), PropagationSettings::default()).expect("settings");
    let mut updates = [PathSet::default(), PathSet::default()];
    for update in &mut updates {
        propagator.update(&ear, &sources, 0.0, update);
    }
    let mut group = criterion.benchmark_group("concert hall, 16 sources");
    for kind in PredictorKind::ALL {
        let mut extrapolator = Extrapolator::new(Arc::clone(&scene), kind, 0.3);
        for update in &updates {
            extrapolator.store_update(update.clone(), 12);
        }
        let mut frame = FramePaths::default();
        group.bench_function(kind.name(), |bencher| {
            bencher.iter(|| extrapolator.frame(&ear, &sources, &mut frame));
        });
    }
    group.finish();
}

criterion_group!(benches, extrapolation);
criterion_main!(benches);
