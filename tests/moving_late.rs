//! The rays of a moving source start at fixed points near it (`propagation/diffuse/visibility_cells.rs`). Its late energy is that of the
//! source at rest there.

use std::sync::Arc;

use foresound::propagation::{LateEnergy, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};

/// Error of position that adds to the noise of rays, in decibels: what law `late/steady` allows an estimate's noise.
const POSITION_DB: f64 = 0.5;

const STEPS: usize = 24;

/// Updates before a source starts to walk.
const REST: usize = 4;

/// A source that walks through the doorway: the difference to the same source at rest is that of two seeds, plus [`POSITION_DB`] by
/// energy.
#[test]
fn late_energy_of_a_moving_source_is_that_of_one_at_rest() {
    let benchmark = procedural::doorway();
    let settings = SceneSettings::default();
    let scene = Scene::commit(&benchmark.mesh, &MaterialTable::built_in(), &settings);
    let scene = Arc::new(scene.expect("commits"));
    let listener = ListenerPose {
        position: benchmark.walk.standing,
        ..ListenerPose::default()
    };
    let propagator = |seed| {
        let settings = PropagationSettings {
            seed,
            ..PropagationSettings::default()
        };
        Propagator::new(Arc::clone(&scene), settings).expect("settings")
    };
    let seed = PropagationSettings::default().seed;
    let mut moving = propagator(seed);
    moving.set_nearby_radius(Some(0.3));
    let mut set = PathSet::default();
    let (mut of_motion, mut of_seeds) = (0.0, 0.0);
    for step in 0..=STEPS {
        let along = step as f32 / STEPS as f32;
        let position = benchmark.walk.from.lerp(benchmark.walk.to, along);
        let sources = [SourcePose::at(SourceId::new(0, 0), position)];
        moving.update(&listener, &sources, 0.0, &mut set);
        let moved = levels_db(&set.late[0]);
        let [at_rest, other] = [seed, seed + 1].map(|seed| {
            let mut resting = propagator(seed);
            resting.warm_up(&listener, &sources);
            let mut set = PathSet::default();
            resting.update(&listener, &sources, 0.0, &mut set);
            levels_db(&set.late[0])
        });
        // The first update has not moved yet.
        if step > 0 {
            of_motion += squares(&moved, &at_rest);
            of_seeds += squares(&other, &at_rest);
        }
    }
    let count = (STEPS * 8) as f64;
    let (of_motion, of_seeds) = ((of_motion / count).sqrt(), (of_seeds / count).sqrt());
    println!("motion {of_motion:.2} dB, seeds {of_seeds:.2} dB");
    assert!(
        of_motion <= of_seeds.hypot(POSITION_DB),
        "motion {of_motion} dB, seeds {of_seeds} dB"
    );
}

/// All rotations of a source are due when it starts to walk: where updates tell the time, few are cast in each, and soon all.
#[test]
fn a_source_that_starts_to_walk_casts_its_rays_over_several_updates() {
    let benchmark = procedural::doorway();
    let settings = SceneSettings::default();
    let scene = Scene::commit(&benchmark.mesh, &MaterialTable::built_in(), &settings);
    let scene = Arc::new(scene.expect("commits"));
    let listener = ListenerPose {
        position: benchmark.walk.standing,
        ..ListenerPose::default()
    };
    let towards = (benchmark.walk.to - benchmark.walk.from).normalize();
    // At rest for the first updates, then at a millimetre an update.
    let updates = |interval_s: f64| {
        let mut propagator =
            Propagator::new(Arc::clone(&scene), PropagationSettings::default()).expect("settings");
        propagator.set_nearby_radius(Some(0.3));
        let mut set = PathSet::default();
        let mut all = Vec::new();
        for step in 0..REST + 12 {
            let walked_m = 1e-3 * step.saturating_sub(REST - 1) as f32;
            let position = benchmark.walk.from + towards * walked_m;
            let sources = [SourcePose::at(SourceId::new(0, 0), position)];
            if step == 0 {
                propagator.warm_up(&listener, &sources);
            }
            let time_s = interval_s * step as f64;
            propagator.update(&listener, &sources, time_s, &mut set);
            all.push((set.rays, set.late.clone()));
        }
        all
    };
    let (at_once, spread) = (updates(0.0), updates(1.0 / 60.0));
    let rays = |all: &[(u64, Vec<LateEnergy>)]| all[REST..].iter().map(|(rays, _)| *rays).max();
    let (at_once_rays, spread_rays) = (rays(&at_once), rays(&spread));
    assert!(
        spread_rays < at_once_rays.map(|rays| rays / 3),
        "{spread_rays:?} rays of {at_once_rays:?}"
    );
    let late = |all: &[(u64, Vec<LateEnergy>)]| all.last().map(|(_, late)| late.clone());
    assert_ne!(
        at_once[REST].1, spread[REST].1,
        "some rays are of the position of rest"
    );
    assert_eq!(late(&at_once), late(&spread));
}

/// Total energy of each band in decibels.
fn levels_db(late: &LateEnergy) -> [f64; 8] {
    let spans = late.energy.as_flattened();
    std::array::from_fn(|band| {
        let sum: f64 = spans.iter().map(|span| f64::from(span[band])).sum();
        10.0 * sum.max(1e-30).log10()
    })
}

fn squares(a: &[f64; 8], b: &[f64; 8]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}
