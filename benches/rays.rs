//! Closest hit and any hit, one ray at a time, on one thread.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use foresound::geometry::Ray;
use foresound::geometry::bvh::NO_GROUP;
use foresound::propagation::rays::directions::{fibonacci_direction, mix, unit};
use foresound::scene::{MaterialTable, Scene, SceneSettings, procedural};
use glam::Vec3;

const RAYS: u32 = 4096;

fn rays(criterion: &mut Criterion) {
    for scene in [
        procedural::concert_hall(),
        procedural::bootcamp(),
        procedural::angrybot(),
    ] {
        let table = MaterialTable::built_in();
        let committed =
            Scene::commit(&scene.mesh, &table, &SceneSettings::default()).expect("commits");
        let origin = committed.to_local(scene.walk.standing).as_vec3();
        let bounds = committed.report();
        let point = |i: u64| {
            let share = Vec3::new(unit(mix(3 * i)), unit(mix(3 * i + 1)), unit(mix(3 * i + 2)));
            let world = bounds.bounds_min + share * (bounds.bounds_max - bounds.bounds_min);
            committed.to_local(world).as_vec3()
        };
        let closest: Vec<Ray> = (0..RAYS)
            .map(|i| Ray::new(origin, fibonacci_direction(i, RAYS)))
            .collect();
        let segments: Vec<Ray> = (0..u64::from(RAYS))
            .map(|i| Ray::between(point(2 * i), point(2 * i + 1)))
            .collect();
        let mut group = criterion.benchmark_group(scene.name);
        group.throughput(Throughput::Elements(u64::from(RAYS)));
        group.sample_size(20);
        group.bench_function("closest hit", |bencher| {
            let hits = |r: &&Ray| committed.bvh().closest_hit(r, [NO_GROUP; 2]).is_some();
            bencher.iter(|| closest.iter().filter(hits).count());
        });
        group.bench_function("any hit", |bencher| {
            let hits = |r: &&Ray| committed.bvh().any_hit(r, [NO_GROUP; 2]);
            bencher.iter(|| segments.iter().filter(hits).count());
        });
        group.finish();
    }
}

criterion_group!(benches, rays);
criterion_main!(benches);
