//! Updates that search for a part: what they find, and what they leave as it was.

use std::sync::Arc;

use foresound::propagation::{Path, PathSet, PropagationSettings, Propagator, UpdateScope};
use foresound::scene::procedural::shoebox;
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose};
use glam::Vec3;

const ROOM_M: Vec3 = Vec3::new(8.0, 3.0, 6.0);

fn propagator() -> Propagator {
    let table = MaterialTable::built_in();
    let scene = Scene::commit(
        &shoebox(ROOM_M, "concrete"),
        &table,
        &SceneSettings::default(),
    )
    .expect("commits");
    Propagator::new(Arc::new(scene), PropagationSettings::default()).expect("in range")
}

/// Five sources: more than are unfolded one by one.
fn sources() -> Vec<SourcePose> {
    let pose = |slot: u16| {
        let at = Vec3::new(
            1.0 + 1.3 * f32::from(slot),
            1.2,
            1.0 + 0.7 * f32::from(slot),
        );
        SourcePose::at(SourceId::new(slot, 0), at)
    };
    (0..5).map(pose).collect()
}

fn of(set: &PathSet, source: &SourcePose) -> Vec<Path> {
    let own = set.paths.iter().filter(|path| path.source == source.id);
    own.copied().collect()
}

/// Six walls give a source six single reflections anywhere in the room, and the rays of its rotations have hit all six.
#[test]
fn first_reflections_after_a_jump_need_no_ray_but_their_own() {
    let (mut propagator, sources) = (propagator(), sources());
    let mut set = PathSet::default();
    let here = ListenerPose::facing([1.0, 1.7, 1.0], 0.0);
    propagator.warm_up(&here, &sources);
    propagator.update(&here, &sources, 0.0, &mut set);
    let before = set.clone();
    propagator.set_scope(UpdateScope {
        max_order: Some(1),
        guide_rays: Some(0),
        only_planes: true,
        ..UpdateScope::default()
    });
    let there = ListenerPose::facing([6.5, 1.5, 4.5], 0.0);
    propagator.update(&there, &sources, 1.0, &mut set);
    for source in &sources {
        let (paths, old) = (of(&set, source), of(&before, source));
        let reflected: Vec<&Path> = paths.iter().filter(|path| path.order > 0).collect();
        assert_eq!(reflected.len(), 6);
        for path in reflected {
            assert_eq!(path.order, 1);
            let distance_m = path.image.distance(there.position);
            assert!(
                (path.length_m - distance_m).abs() < 1e-4,
                "of the new place"
            );
        }
        let direct = |paths: &[Path]| paths.iter().find(|path| path.is_direct()).copied();
        assert!(direct(&paths).is_some() && direct(&paths) == direct(&old));
    }
    assert!(!set.scope.is_whole());
}

#[test]
fn a_search_for_one_source_finds_what_a_whole_one_does() {
    let (mut whole, mut alone) = (propagator(), propagator());
    let mut sources = sources();
    let listener = ListenerPose::facing([2.0, 1.7, 3.0], 0.0);
    let (mut expected, mut found) = (PathSet::default(), PathSet::default());
    for (propagator, set) in [(&mut whole, &mut expected), (&mut alone, &mut found)] {
        propagator.warm_up(&listener, &sources);
        propagator.update(&listener, &sources, 0.0, set);
    }
    let before = found.clone();
    sources[3].position = Vec3::new(6.9, 2.1, 0.8);
    alone.set_scope(UpdateScope {
        sources: Some(vec![sources[3].id]),
        ..UpdateScope::default()
    });
    whole.update(&listener, &sources, 1.0, &mut expected);
    alone.update(&listener, &sources, 1.0, &mut found);
    for (index, source) in sources.iter().enumerate() {
        let other = match index {
            3 => of(&expected, source),
            _ => of(&before, source),
        };
        assert!(!other.is_empty() && of(&found, source) == other, "{index}");
    }
}
