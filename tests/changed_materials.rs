//! Materials that change while sound runs are heard as those of a scene that was built with them, without another scene.

use std::sync::Arc;

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, procedural,
};
use foresound::{BANDS, Error, Material};
use glam::{DVec3, Vec3};

fn material(name: &str, absorption: f32, transmission: f32) -> Material {
    Material {
        name: name.into(),
        absorption: [absorption; BANDS],
        scattering: [0.3; BANDS],
        transmission: [transmission; BANDS],
    }
}

fn room(wall: &Material) -> Scene {
    let mesh = procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "wall");
    let table = MaterialTable::from_materials(vec![wall.clone()]);
    Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a room")
}

/// Updates until estimates rest.
fn settled(propagator: &mut Propagator, ear: &ListenerPose, sources: &[SourcePose]) -> PathSet {
    let mut update = PathSet::default();
    for _ in 0..40 {
        propagator.update(ear, sources, 0.0, &mut update);
    }
    update
}

#[test]
fn a_changed_material_is_heard_as_one_of_a_new_scene() {
    let (before, after) = (material("wall", 0.1, 0.0), material("wall", 0.6, 0.05));
    let mut changed = room(&before);
    let fresh = Arc::new(room(&after));
    let centre = (fresh.report().bounds_min + fresh.report().bounds_max) / 2.0;
    let ear = ListenerPose::facing(centre + Vec3::new(1.0, 0.0, 0.5), 0.0);
    let sources = [SourcePose::at(SourceId::new(0, 1), centre - Vec3::X)];
    let settings = PropagationSettings::default();
    let made = Arc::new(changed.clone());
    let mut propagator = Propagator::new(Arc::clone(&made), settings).expect("settings");
    let old = settled(&mut propagator, &ear, &sources);
    changed.set_material(&after).expect("is there");
    assert!(changed.same_fixed_part(&made));
    assert_eq!(made.materials()[0], before);
    *propagator.scene_mut() = changed;
    let now = settled(&mut propagator, &ear, &sources);
    let mut other = Propagator::new(fresh, settings).expect("settings");
    let wanted = settled(&mut other, &ear, &sources);
    let ids = |set: &PathSet| set.paths.iter().map(|path| path.id).collect::<Vec<_>>();
    assert_eq!(ids(&now), ids(&old), "paths keep their identities");
    assert_eq!(now.paths, wanted.paths);
    // Rays of both are alike in their directions.
    let level = |set: &PathSet| set.late[0].total()[4];
    let ratio = level(&now) / level(&wanted);
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
    assert!(
        level(&old) > 4.0 * level(&now),
        "{} {}",
        level(&old),
        level(&now)
    );
    let decay = |set: &PathSet| set.late_groups[0].decay_time_s[4];
    assert!(
        decay(&old) > 2.0 * decay(&now),
        "{} {}",
        decay(&old),
        decay(&now)
    );
}

#[test]
fn materials_of_instances_change_too_and_wrong_ones_are_refused() {
    let mut scene = room(&material("wall", 0.1, 0.0));
    let table = MaterialTable::from_materials(vec![material("window", 0.2, 0.01)]);
    let mesh = procedural::shoebox(Vec3::new(1.0, 1.0, 0.05), "window");
    let part = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a part");
    let pose = InstancePose::at(InstanceId::default(), DVec3::new(2.0, 1.0, 2.0));
    scene.add_instance(Arc::new(part), &pose).expect("a part");
    scene
        .set_material(&material("window", 1.0, 1.0))
        .expect("is there");
    for wrong in [
        material("door", 0.5, 0.1),
        material("wall", 0.5, 0.6),
        material("wall", 1.5, 0.0),
        material("wall", f32::NAN, 0.0),
        material("wall", 0.5, -0.1),
    ] {
        let refused = scene.set_material(&wrong);
        assert!(matches!(refused, Err(Error::Setting { .. })), "{wrong:?}");
    }
    assert_eq!(scene.materials()[0], material("wall", 0.1, 0.0));
    let middle = Vec3::new(2.0, 1.0, 2.0);
    let [from, to] = [-1.0, 1.0].map(|z| scene.to_local(middle + Vec3::new(0.0, 0.0, z)));
    let through = foresound::propagation::transmission::transmission(&scene, from, to, &mut 0);
    assert_eq!(through, Some([1.0; BANDS]), "a broken window");
}
