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

/// A material that scatters everything may scatter less from now on, and one that is set to what it is changes no bit.
#[test]
fn scattering_may_fall_from_all_and_stays_to_the_bit() {
    let scattering = |scattering: f32| Material {
        scattering: [scattering; BANDS],
        ..material("wall", 0.1, 0.0)
    };
    for before in [1.0, 0.999_999_9, 0.3, 0.1, 0.0] {
        let mut scene = room(&scattering(before));
        for after in [before, 0.1, 1.0, 0.0, 0.7, before] {
            scene.set_material(&scattering(after)).expect("is there");
            assert_eq!(scene.materials(), [scattering(after)], "from {before}");
        }
    }
}

/// A wall of small steps, flattened to a rough one beside smooth ones: as a scene and as a part of one.
#[test]
fn rough_surfaces_stay_as_rough() {
    let wall = material("wall", 0.1, 0.0);
    let mut mesh = procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "wall");
    let number = mesh.material("wall");
    let first = mesh.vertices.len() as u32;
    // A grid of 10 cm in the middle of the room, whose corners are up to 1 cm off their plane.
    let (columns, rows) = (30u32, 20u32);
    for row in 0..=rows {
        for column in 0..=columns {
            let off = 0.01 * ((column * 7 + row * 13) % 5) as f32 / 4.0;
            let at = Vec3::new(1.5 + 0.1 * column as f32, 0.5 + 0.1 * row as f32, 2.5 + off);
            mesh.vertices.push(at);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let corner = first + row * (columns + 1) + column;
            let above = corner + columns + 1;
            for triangle in [[corner, corner + 1, above], [corner + 1, above + 1, above]] {
                mesh.triangles.push(triangle);
                mesh.triangle_materials.push(number);
            }
        }
    }
    let table = MaterialTable::from_materials(vec![wall.clone()]);
    let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a scene");
    let specular = |of: &Material| of.scattering.map(|scattering| 1.0 - scattering);
    let rough = scene.materials().last().expect("materials");
    let [before, smooth] = [specular(rough), specular(&wall)];
    assert!(before[7] < 0.9 * smooth[7], "{rough:?} is rough");
    let after = Material {
        scattering: [0.5; BANDS],
        ..wall.clone()
    };
    let check = |changed: [f32; BANDS]| {
        for b in 0..BANDS {
            let kept = changed[b] / 0.5;
            assert!((kept - before[b] / smooth[b]).abs() < 1e-5, "{changed:?}");
        }
    };
    let mut changed = scene.clone();
    changed.set_material(&after).expect("is there");
    check(specular(changed.materials().last().expect("materials")));

    // The part's wall is hit from in front, and so is the room's around it.
    let mut outer = room(&material("wall", 0.2, 0.0));
    let pose = InstancePose::at(InstanceId::default(), DVec3::ZERO);
    outer.add_instance(Arc::new(scene), &pose).expect("a part");
    outer.set_material(&after).expect("is there");
    let specular_at = |from: Vec3, towards: Vec3| {
        let ray = foresound::geometry::Ray::new(outer.to_local(from).as_vec3(), towards);
        let hit = outer.closest_hit(&ray, [foresound::geometry::bvh::NO_GROUP; 2]);
        let surface = outer.surface(hit.expect("a wall").group);
        specular(outer.material_of(surface))
    };
    check(specular_at(Vec3::new(3.03, 1.52, 1.0), Vec3::Z));
    assert_eq!(
        specular_at(Vec3::new(0.5, 0.2, 1.0), Vec3::NEG_X),
        [0.5; BANDS]
    );
}
