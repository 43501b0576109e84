//! A propagator that leaves out what cannot have a path has the results of one that tries everything.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::Propagator;
use crate::propagation::{PathSet, PropagationSettings, UpdateScope};
use crate::scene::instances::{InstanceId, InstancePose};
use crate::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};

/// Updates of a walk.
const UPDATES: usize = 120;

/// Two propagators of one scene, the second of which tries everything.
struct Pair {
    propagators: [Propagator; 2],
    most_marked: usize,
}

impl Pair {
    fn of(scene: &Arc<Scene>) -> Self {
        let settings = PropagationSettings::default();
        let new = || Propagator::new(Arc::clone(scene), settings).expect("settings");
        Self {
            propagators: [new(), new()],
            most_marked: 0,
        }
    }

    fn each(&mut self, change: impl Fn(&mut Propagator)) {
        self.propagators.iter_mut().for_each(change);
    }

    fn update(&mut self, listener: Vec3, sources: &[SourcePose], step: usize) -> PathSet {
        let listener = ListenerPose {
            position: listener,
            ..ListenerPose::default()
        };
        let time_s = step as f64 / 20.0;
        let [marking, trying] = &mut self.propagators;
        for task in &mut trying.tasks {
            task.forget_marks();
        }
        let [mut set, mut expected] = [PathSet::default(), PathSet::default()];
        marking.update(&listener, sources, time_s, &mut set);
        trying.update(&listener, sources, time_s, &mut expected);
        // Other candidates are validated together, and what blocked one may be known.
        expected.rays = set.rays;
        assert!(set == expected, "update {step}");
        let marked = marking.tasks.iter().map(|task| task.marked_for_a_metre());
        self.most_marked = self.most_marked.max(marked.sum());
        set
    }
}

fn scene_and_sources(
    name: &str,
    count: usize,
) -> (procedural::BenchmarkScene, Arc<Scene>, Vec<SourcePose>) {
    let benchmark = procedural::by_name(name).expect("a name of the list");
    let settings = SceneSettings::default();
    let scene = Scene::commit(&benchmark.mesh, &MaterialTable::built_in(), &settings);
    let positions = benchmark.sources.iter().take(count).enumerate();
    let sources = positions
        .map(|(slot, (_, at))| SourcePose::at(SourceId::new(slot as u16, 0), *at))
        .collect();
    (benchmark, Arc::new(scene.expect("commits")), sources)
}

/// To and fro between the ends of the benchmark's walk, in steps of 1 to 30 cm, with a jump now and then.
fn listener(benchmark: &procedural::BenchmarkScene, step: usize) -> Vec3 {
    let pace_m = [0.07, 0.01, 0.3, 0.07][step / 30 % 4];
    let jump_m = 3.1 * (step / 37) as f32;
    let (from, to) = (benchmark.walk.from, benchmark.walk.to);
    let whole_m = from.distance(to);
    let along_m = (pace_m * step as f32 + jump_m) % (2.0 * whole_m);
    let along_m = along_m.min(2.0 * whole_m - along_m);
    from.lerp(to, along_m / whole_m)
}

#[test]
fn a_walk_has_the_paths_of_one_that_tries_all() {
    for (name, nearby_m) in [
        ("concert_hall", Some(0.12)),
        ("angrybot", Some(0.12)),
        ("doorway", Some(0.12)),
        ("concert_hall", None),
    ] {
        let (benchmark, scene, mut sources) = scene_and_sources(name, 2);
        let mut pair = Pair::of(&scene);
        pair.each(|propagator| propagator.set_nearby_radius(nearby_m));
        let (mut paths, mut nearby) = (0, 0);
        for step in 0..UPDATES {
            match step {
                50 => sources[1].position.x += 0.01,
                80..84 => sources[0].position.x -= 0.02,
                _ => {}
            }
            let set = pair.update(listener(&benchmark, step), &sources, step);
            paths += set.paths.len();
            nearby += set.nearby.len();
        }
        assert!(paths > UPDATES, "{name}");
        assert_eq!(nearby > UPDATES, nearby_m.is_some(), "{name}");
        assert!(pair.most_marked > 100, "{name}: {}", pair.most_marked);
    }
}

#[test]
fn changes_of_anything_else_void_what_is_marked() {
    let (benchmark, scene, mut sources) = scene_and_sources("doorway", 3);
    let table = MaterialTable::built_in();
    let mesh = procedural::shoebox(Vec3::new(0.9, 2.0, 0.05), "wood_panel");
    let part = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits");
    let part = Arc::new(part);
    let mut pair = Pair::of(&scene);
    let mut id = InstanceId::default();
    for step in 0..UPDATES {
        let beside = benchmark.walk.from.lerp(benchmark.walk.to, 0.4).as_dvec3();
        let pose = |id, step: usize| {
            InstancePose::at(id, beside + DVec3::new(0.5 + 0.02 * step as f64, 0.0, 0.3))
        };
        match step {
            20 => pair.each(|one| one.set_nearby_radius(Some(0.12))),
            40 => pair.each(|one| one.set_nearby_radius(Some(0.3))),
            44 => {
                for one in &mut pair.propagators {
                    let added = one
                        .scene_mut()
                        .add_instance(Arc::clone(&part), &pose(id, 0));
                    id = added.expect("one");
                }
            }
            58..62 => pair.each(|one| {
                one.scene_mut().set_instance_poses(&[pose(id, step - 57)]);
            }),
            70 => pair.each(|one| {
                let mut material = one.scene().materials()[0].clone();
                material.absorption = [0.5; 8];
                one.scene_mut().set_material(&material).expect("known");
            }),
            80 => pair.each(|one| {
                one.set_scope(UpdateScope {
                    max_order: Some(2),
                    ..UpdateScope::default()
                });
            }),
            84 => pair.each(|one| {
                one.set_scope(UpdateScope {
                    jumped: vec![sources[0].id],
                    ..UpdateScope::default()
                });
            }),
            90 => pair.each(|one| {
                one.scene_mut()
                    .remove_instance(id)
                    .map(drop)
                    .expect("there")
            }),
            95 => sources.swap(0, 2),
            100 => drop(sources.remove(1)),
            105 => sources.push(SourcePose::at(SourceId::new(9, 1), sources[0].position)),
            _ => {}
        }
        pair.update(listener(&benchmark, step), &sources, step);
    }
    assert!(pair.most_marked > 100, "{}", pair.most_marked);
}
