//! Updates with nearby paths find what plain updates find: the gate leaves out nearby paths only.

use std::collections::HashSet;
use std::sync::Arc;

use foresound::propagation::{PathId, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};

const STEPS: usize = 24;
const STEP_M: f32 = 0.15;

/// Most nearby paths of a source, as the engine keeps them.
const MOST: usize = 128;

#[test]
fn a_closed_gate_leaves_no_valid_path_out() {
    let benchmark = procedural::concert_hall();
    let settings = SceneSettings::default();
    let scene = Scene::commit(&benchmark.mesh, &MaterialTable::built_in(), &settings);
    let scene = Arc::new(scene.expect("commits"));
    let mut propagators = [Some(0.3), None].map(|radius_m| {
        let settings = PropagationSettings::default();
        let mut propagator = Propagator::new(Arc::clone(&scene), settings).expect("settings");
        propagator.set_nearby_radius(radius_m);
        propagator
    });
    let sources: Vec<SourcePose> = (0..)
        .zip(benchmark.sources.iter().take(4))
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot, 0), *position))
        .collect();
    let along = (benchmark.walk.to - benchmark.walk.from).normalize();
    let (mut gated, mut compared) = (0, 0);
    for step in 0..STEPS {
        let listener = ListenerPose {
            position: benchmark.walk.from + along * (STEP_M * step as f32),
            ..ListenerPose::default()
        };
        let sets = propagators.each_mut().map(|propagator| {
            let mut set = PathSet::default();
            propagator.update(&listener, &sources, 0.0, &mut set);
            set
        });
        let found: HashSet<PathId> = sets[0].paths.iter().map(|path| path.id).collect();
        for path in &sets[1].paths {
            assert!(found.contains(&path.id), "step {step}: {path:?} is missing");
        }
        compared += sets[1].paths.len();
        for source in &sources {
            let of_source = |path: &&foresound::propagation::Path| path.source == source.id;
            gated += usize::from(sets[0].nearby.iter().filter(of_source).count() >= MOST);
        }
    }
    // Otherwise no gate was closed, and nothing was shown.
    assert!(
        gated > STEPS && compared > 1000,
        "{gated} full lists, {compared} paths"
    );
}
