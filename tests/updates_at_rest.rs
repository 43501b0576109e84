//! At rest an update keeps the results of the one before. They are those of a search, and so are all later ones.

use std::sync::Arc;

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, procedural,
};
use foresound::{BANDS, Material};
use glam::{DVec3, Quat, Vec3};

/// Updates until results are kept: of all guide rays and of all source rays, then one for each rotation.
const UPDATES: u32 = 36;

fn poses(scene: &procedural::BenchmarkScene, count: usize) -> Vec<SourcePose> {
    let positions = scene.sources.iter().take(count).enumerate();
    positions
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot as u16, 0), *position))
        .collect()
}

/// Position on a walk at an update, 20 updates a second.
fn ear(scene: &procedural::BenchmarkScene, update: u32) -> ListenerPose {
    let share = 0.5 + 0.07 * update as f32 / scene.walk.from.distance(scene.walk.to);
    ListenerPose {
        position: scene.walk.from.lerp(scene.walk.to, share),
        ..ListenerPose::default()
    }
}

/// A propagator beside one that searches in every update.
struct Pair {
    keeps: Propagator,
    searches: Propagator,
    update: u32,
}

impl Pair {
    fn new(scene: &Arc<Scene>) -> Self {
        let settings = PropagationSettings::default();
        let new = || Propagator::new(Arc::clone(scene), settings).expect("settings");
        Self {
            keeps: new(),
            searches: new(),
            update: 0,
        }
    }

    /// An update of both, which find the same except for nearby paths.
    fn sets(&mut self, listener: &ListenerPose, sources: &[SourcePose]) -> [PathSet; 2] {
        let time_s = 0.05 * f64::from(self.update);
        let [mut kept, mut found] = [PathSet::default(), PathSet::default()];
        self.keeps.update(listener, sources, time_s, &mut kept);
        // What was at rest is forgotten, and nothing else.
        self.searches.set_listener_count(1);
        self.searches.update(listener, sources, time_s, &mut found);
        let rays = std::mem::replace(&mut found.rays, kept.rays);
        assert!(kept.paths.len() > 4);
        kept.nearby.clear();
        found.nearby.clear();
        assert_eq!(kept, found, "update {}", self.update);
        self.update += 1;
        found.rays = rays;
        [kept, found]
    }

    /// An update of both; whether it was kept.
    fn update(&mut self, listener: &ListenerPose, sources: &[SourcePose]) -> bool {
        let [kept, found] = self.sets(listener, sources);
        kept.rays == 0 && found.rays > 0
    }

    /// The first of so many updates that was kept.
    fn first_kept(&mut self, listener: &ListenerPose, sources: &[SourcePose]) -> Option<u32> {
        let kept: Vec<u32> = (0..UPDATES)
            .filter(|_| self.update(listener, sources))
            .collect();
        let first = *kept.first()?;
        assert!(kept.into_iter().eq(first..UPDATES), "to the last");
        Some(first)
    }
}

#[test]
fn kept_results_are_those_of_a_search() {
    for name in ["concert_hall", "angrybot"] {
        let benchmark = procedural::by_name(name).expect("a name of the list");
        let table = MaterialTable::built_in();
        let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default());
        let mut pair = Pair::new(&Arc::new(scene.expect("commits")));
        let mut sources = poses(&benchmark, 5);
        let first = pair.first_kept(&ear(&benchmark, 0), &sources);
        assert!(first.is_some_and(|first| first > 16), "{name}: {first:?}");
        // A turned head hears the same.
        let turned = ListenerPose {
            orientation: Quat::from_rotation_y(1.0),
            ..ear(&benchmark, 0)
        };
        assert!(pair.update(&turned, &sources), "{name}");
        for step in 1..8 {
            assert!(!pair.update(&ear(&benchmark, step), &sources), "{name}");
        }
        let ear = ear(&benchmark, 7);
        assert!(pair.first_kept(&ear, &sources).is_some(), "{name}");
        sources[2].orientation = Quat::from_rotation_y(0.5);
        assert!(!pair.update(&ear, &sources), "{name}");
        assert!(pair.first_kept(&ear, &sources).is_some(), "{name}");
        sources[0].position.x += 0.1;
        assert!(!pair.update(&ear, &sources), "{name}");
        sources.swap(1, 3);
        assert!(!pair.update(&ear, &sources), "{name}");
        sources.pop();
        assert!(pair.first_kept(&ear, &sources).is_some(), "{name}");
    }
}

/// One source walks past a listener that stands, as the engine predicts it; the others are kept.
#[test]
fn sources_at_rest_are_kept_while_another_one_walks() {
    let benchmark = procedural::concert_hall();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default());
    let mut pair = Pair::new(&Arc::new(scene.expect("commits")));
    let mut sources = poses(&benchmark, 6);
    let mut ear = ear(&benchmark, 0);
    for update in 0..60u32 {
        // The listener walks in the end.
        ear.position.x += 0.07 * update.saturating_sub(50) as f32;
        let step = Vec3::Z * 0.05;
        sources[1].position += step;
        let steps = 1 + update as usize % 3;
        let listeners = vec![ear.position; steps];
        let ahead = |step_number: usize| {
            let mut ahead: Vec<Vec3> = sources.iter().map(|source| source.position).collect();
            ahead[1] += step * step_number as f32;
            ahead
        };
        let ahead: Vec<Vec3> = (0..steps).flat_map(ahead).collect();
        let radius_m = 0.1 + 0.01 * f64::from(update % 5);
        for propagator in [&mut pair.keeps, &mut pair.searches] {
            propagator.set_nearby_radius(Some(radius_m));
            propagator.set_predicted_positions(&listeners, &ahead);
        }
        let [kept, found] = pair.sets(&ear, &sources);
        // Later on what blocked paths last may differ, and with it the number of rays.
        if update <= 50 {
            assert_eq!(kept.rays < found.rays, update >= 32, "update {update}");
        }
        assert_eq!(kept.predicted_late.len(), 6 * steps);
    }
}

#[test]
fn a_changed_scene_is_searched() {
    let benchmark = procedural::doorway();
    let table = MaterialTable::built_in();
    let settings = SceneSettings::default();
    let scene = Scene::commit(&benchmark.mesh, &table, &settings).expect("commits");
    let mut soft: Material = scene.materials()[0].clone();
    soft.absorption = [0.6; BANDS];
    let mesh = procedural::shoebox(Vec3::new(0.9, 2.0, 0.05), "wood_panel");
    let part = Arc::new(Scene::commit(&mesh, &table, &settings).expect("commits"));
    let mut pair = Pair::new(&Arc::new(scene));
    let (ear, sources) = (ear(&benchmark, 0), poses(&benchmark, 4));
    assert!(pair.first_kept(&ear, &sources).is_some());
    let pose = |id, z| InstancePose::at(id, DVec3::new(9.0, 0.02, z));
    let mut id = InstanceId::default();
    for propagator in [&mut pair.keeps, &mut pair.searches] {
        let scene = propagator.scene_mut();
        id = scene
            .add_instance(Arc::clone(&part), &pose(InstanceId::default(), 1.0))
            .expect("one");
    }
    assert!(!pair.update(&ear, &sources));
    assert!(pair.first_kept(&ear, &sources).is_some());
    // Poses that are set again are no change.
    for (z, is_kept) in [(1.0, true), (1.2, false)] {
        for propagator in [&mut pair.keeps, &mut pair.searches] {
            propagator.scene_mut().set_instance_poses(&[pose(id, z)]);
        }
        assert_eq!(pair.update(&ear, &sources), is_kept);
    }
    assert!(pair.first_kept(&ear, &sources).is_some());
    for propagator in [&mut pair.keeps, &mut pair.searches] {
        propagator
            .scene_mut()
            .set_material(&soft)
            .expect("is there");
    }
    assert!(!pair.update(&ear, &sources));
    assert!(pair.first_kept(&ear, &sources).is_some());
}
