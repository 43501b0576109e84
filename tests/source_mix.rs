//! The mix of a source: every control does what it says and nothing else, changes while sound runs are smooth, and sources
//! without a position are heard as they are.

use std::sync::Arc;

use foresound::extrapolation::{
    Extrapolator, FramePath, FramePaths, LateSend, PathKind, PredictorKind,
};
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::{Controller, EngineSettings, Renderer};
use foresound::scene::{
    DistanceCurve, DistanceTable, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourceMix, SourcePose, procedural,
};
use foresound::{BANDS, Error};
use glam::Vec3;

mod small_engine;
use small_engine::{BLOCK, RATE_HZ};

/// Two rooms and a door, a source in one of them.
struct World {
    scene: Arc<Scene>,
    update: PathSet,
    source: SourcePose,
    ear: ListenerPose,
    propagator: Propagator,
}

impl World {
    fn new(is_blocked: bool) -> Self {
        let layout = procedural::doorway();
        let settings = SceneSettings::default();
        let table = MaterialTable::built_in();
        let scene = Scene::commit(&layout.mesh, &table, &settings).expect("commits");
        let scene = Arc::new(scene);
        let settings = PropagationSettings::default();
        let mut propagator = Propagator::new(Arc::clone(&scene), settings).expect("settings");
        let source = SourcePose::at(SourceId::new(0, 1), layout.sources[0].1);
        // At one end of the walk the wall beside the door is in between.
        let walk = layout.walk;
        let is_there = |at: &Vec3| {
            let mut update = PathSet::default();
            let ear = ListenerPose::facing(*at, 0.3);
            propagator.update(&ear, &[source], 0.0, &mut update);
            let mut frame = FramePaths::default();
            let mut extrapolator = Extrapolator::new(Arc::clone(&scene), PredictorKind::Hold, 0.3);
            extrapolator.frame(&ear, &[source], &mut frame);
            frame.obstructions[0].is_blocked == is_blocked
        };
        let steps = (0..=20).map(|n| walk.from.lerp(walk.to, n as f32 / 20.0));
        let at = steps.into_iter().find(is_there).expect("is on the walk");
        let ear = ListenerPose::facing(at, 0.3);
        let mut update = PathSet::default();
        propagator.update(&ear, &[source], 0.1, &mut update);
        Self {
            scene,
            update,
            source,
            ear,
            propagator,
        }
    }

    /// The frame of a mix.
    fn frame(&mut self, mix: SourceMix) -> FramePaths {
        let mut source = self.source;
        source.settings.mix = mix;
        let kind = PredictorKind::default();
        let mut extrapolator = Extrapolator::new(Arc::clone(&self.scene), kind, 0.3);
        extrapolator.store_update(self.update.clone(), 4);
        let mut frame = FramePaths::default();
        extrapolator.frame(&self.ear, &[source], &mut frame);
        assert!(frame.paths.len() > 4 && !frame.late.is_empty());
        frame
    }

    fn distance_m(&self) -> f32 {
        self.source.position.distance(self.ear.position)
    }
}

type Change = fn(&mut SourceMix);
type Applies = fn(PathKind) -> bool;

fn mix(change: impl FnOnce(&mut SourceMix)) -> SourceMix {
    let mut mix = SourceMix::default();
    change(&mut mix);
    mix
}

/// Pairs of the same path in two frames.
fn pairs<'a>(a: &'a FramePaths, b: &'a FramePaths) -> Vec<(&'a FramePath, &'a FramePath)> {
    assert_eq!(a.paths.len(), b.paths.len());
    let pairs: Vec<_> = a.paths.iter().zip(&b.paths).collect();
    assert!(pairs.iter().all(|(a, b)| a.id == b.id && a.kind == b.kind));
    pairs
}

/// Rounding of a product of a handful of factors.
fn is_near(found: f32, wanted: f32) -> bool {
    (found - wanted).abs() <= 4e-6 * wanted.abs()
}

#[test]
fn a_curve_scales_all_sound_alike_and_keeps_time() {
    let mut world = World::new(false);
    let physics = world.frame(SourceMix::default());
    let distance_m = world.distance_m();
    assert!(distance_m > 1.0);
    let table = DistanceTable::new(&[[0.0, 1.0], [2.0 * distance_m, 0.5]]).expect("rises");
    let (min_m, max_m) = (0.5, 3.0 * distance_m);
    for (distance, gain) in [
        (DistanceCurve::Inverse { min_m, max_m }, 0.5 / distance_m),
        (DistanceCurve::Inverse { min_m, max_m: 1.0 }, 0.5),
        (
            DistanceCurve::Linear { min_m, max_m },
            (max_m - distance_m) / (max_m - min_m),
        ),
        (DistanceCurve::Table(table), 0.75),
    ] {
        let mixed = world.frame(mix(|mix| mix.distance = distance));
        let ratio = gain * distance_m;
        for (path, plain) in pairs(&mixed, &physics) {
            assert_eq!((path.delay_s, path.arrival), (plain.delay_s, plain.arrival));
            for b in 0..BANDS {
                let wanted = ratio * plain.amplitude[b];
                assert!(is_near(path.amplitude[b], wanted), "{distance:?}");
            }
        }
        for (send, plain) in mixed.late.iter().zip(&physics.late) {
            assert_eq!(send.start_s, plain.start_s);
            let wanted = ratio * ratio * plain.energy_per_s[4];
            assert!(is_near(send.energy_per_s[4], wanted));
        }
    }
}

#[test]
fn each_gain_changes_its_part_only() {
    for is_blocked in [false, true] {
        let mut world = World::new(is_blocked);
        let physics = world.frame(SourceMix::default());
        let has = |kind| physics.paths.iter().any(|path| path.kind == kind);
        assert!(has(PathKind::Reflected) && has(PathKind::Diffracted));
        assert_eq!(has(PathKind::Direct), !is_blocked);
        let changes: [(Change, Applies); 4] = [
            (|mix| mix.direct_gain = 0.5, PathKind::is_straight),
            (
                |mix| mix.reflections_gain = 0.5,
                |kind| kind == PathKind::Reflected,
            ),
            (
                |mix| mix.diffraction_gain = 0.5,
                |kind| kind == PathKind::Diffracted,
            ),
            (|mix| mix.late_gain = 0.5, |_| false),
        ];
        for (number, (change, is_changed)) in changes.into_iter().enumerate() {
            let mixed = world.frame(mix(change));
            for (path, plain) in pairs(&mixed, &physics) {
                let gain = if is_changed(path.kind) { 0.5 } else { 1.0 };
                assert_eq!(path.amplitude, plain.amplitude.map(|a| gain * a));
            }
            let late = if number == 3 { 0.25 } else { 1.0 };
            for (send, plain) in mixed.late.iter().zip(&physics.late) {
                assert_eq!(send.energy_per_s, plain.energy_per_s.map(|e| late * e));
            }
        }
    }
}

#[test]
fn occlusion_and_transmission_act_on_the_direct_field_behind_walls() {
    let mut world = World::new(true);
    let physics = world.frame(SourceMix::default());
    let straight = |frame: &FramePaths| {
        let path = frame.paths.iter().find(|path| path.kind.is_straight());
        path.copied()
    };
    let distance_m = f64::from(world.distance_m());
    let free = foresound::propagation::amplitude::free_field(&world.scene, distance_m, 0.3);
    let heard = world.frame(mix(|mix| mix.occlusion = 0.0));
    let direct = straight(&heard).expect("is heard");
    for b in 0..BANDS {
        assert!((direct.amplitude[b] / free[b] - 1.0).abs() < 1e-5);
    }
    let around = |path: &&FramePath| path.kind == PathKind::Diffracted && path.order == 0;
    let shadow = |frame: &FramePaths| -> f32 {
        frame
            .paths
            .iter()
            .filter(around)
            .map(|path| path.amplitude[3].abs())
            .sum()
    };
    assert!(shadow(&physics) > 0.0);
    assert_eq!(shadow(&heard), 0.0);
    // Reflections do not change.
    let order = |frame: &FramePaths| -> f32 {
        frame
            .paths
            .iter()
            .filter(|path| path.order > 0)
            .map(|path| path.amplitude[3])
            .sum()
    };
    assert_eq!(order(&heard), order(&physics));
    let through = straight(&physics).expect("is transmitted");
    assert_eq!(through.kind, PathKind::Transmitted);
    let wall = physics.obstructions[0].transmission;
    let louder = straight(&world.frame(mix(|mix| mix.transmission = 2.0))).expect("is heard");
    for b in 0..BANDS {
        assert!((through.amplitude[b] / free[b] - wall[b]).abs() < 1e-5 * wall[b] + 1e-7);
        assert!(is_near(louder.amplitude[b], 2.0 * through.amplitude[b]));
    }
    // In sight neither has an effect.
    let mut open = World::new(false);
    let plain = open.frame(SourceMix::default());
    let mixed = open.frame(mix(|mix| mix.transmission = 0.0));
    assert_eq!(mixed.paths, plain.paths);
    assert_eq!(plain.obstructions[0].transmission, [1.0; BANDS]);
}

#[test]
fn doppler_scales_the_delay_of_direct_sound_and_air_can_be_left_out() {
    let mut world = World::new(false);
    let physics = world.frame(SourceMix::default());
    let speed_m_s = world.scene.speed_of_sound_m_s();
    let flight_s = f64::from(world.distance_m()) / speed_m_s;
    for strength in [0.0, 0.25, 2.0] {
        let mixed = world.frame(mix(|mix| mix.doppler = strength));
        let later_s = (f64::from(strength) - 1.0) * flight_s;
        for (path, plain) in pairs(&mixed, &physics) {
            // Positions are in single precision.
            assert!((path.delay_s - plain.delay_s - later_s).abs() < 1e-7);
            assert_eq!(
                (path.amplitude, path.air_delay_s),
                (plain.amplitude, plain.air_delay_s)
            );
        }
        for (send, plain) in mixed.late.iter().zip(&physics.late) {
            let wanted_s = f64::from(plain.start_s) + later_s;
            assert!((f64::from(send.start_s) - wanted_s).abs() < 1e-6);
            // The energy at the start stays.
            let decay_s = mixed.late_groups[usize::from(send.group)].decay_time_s[4];
            let at_start = |send: &LateSend| {
                let nepers = 13.815_511 * f64::from(send.start_s) / f64::from(decay_s);
                f64::from(send.energy_per_s[4]) * (-nepers).exp()
            };
            let (found, wanted) = (at_start(send), at_start(plain));
            assert!(
                (found - wanted).abs() <= 1e-4 * wanted,
                "{found} instead of {wanted}"
            );
        }
    }
    let mixed = world.frame(mix(|mix| mix.air_absorption = 0.0));
    for (path, plain) in pairs(&mixed, &physics) {
        assert_eq!((path.air_delay_s, path.delay_s), (0.0, plain.delay_s));
        let length_m = (plain.delay_s * speed_m_s) as f32;
        for (b, np) in world.scene.air_np_per_m().iter().enumerate() {
            let wanted = plain.amplitude[b] * (np * length_m).exp();
            assert!((path.amplitude[b] - wanted).abs() <= 1e-5 * wanted.abs());
        }
    }
    drop(world.propagator);
}

const TONE: f32 = 0.1;
/// Radians a sample of the tone.
const STEP: f32 = 0.02;

/// The default delay lines: a source is half a kilometre away.
fn engine() -> (Controller, Renderer) {
    small_engine::engine_with(|settings| {
        settings.generation.max_delay_s = EngineSettings::default().generation.max_delay_s;
    })
}

fn tone(seconds: usize) -> Arc<[f32]> {
    (0..seconds * RATE_HZ as usize)
        .map(|n| TONE * (STEP * n as f32).sin())
        .collect()
}

/// The left ear over graphics frames.
fn run(controller: &mut Controller, renderer: &mut Renderer, frames: usize) -> Vec<f32> {
    let heard = small_engine::run(controller, renderer, frames);
    heard.chunks_exact(2).map(|pair| pair[0]).collect()
}

fn steepest(heard: &[f32]) -> f32 {
    let steps = heard.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.fold(0.0, f32::max)
}

#[test]
fn controls_change_without_a_click() {
    let curve = DistanceCurve::Linear {
        min_m: 1.0,
        max_m: 1.5,
    };
    let changes: [fn(&mut SourceMix); 4] = [
        |mix| mix.direct_gain = 0.0,
        |mix| mix.doppler = 0.0,
        |mix| mix.air_absorption = 0.0,
        |_| (),
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let (mut controller, mut renderer) = engine();
        let id = controller.add_source(Vec3::NEG_Z * 2.0).expect("a slot");
        controller.play(id, tone(2), true).expect("is there");
        run(&mut controller, &mut renderer, 20);
        let before = run(&mut controller, &mut renderer, 10);
        let mut settings = controller.source_settings(id).expect("is there");
        change(&mut settings.mix);
        if number == 3 {
            settings.mix.distance = curve;
        }
        controller.configure_source(id, settings).expect("in range");
        let after = run(&mut controller, &mut renderer, 30);
        // A voice starts and another one ends within 256 audio frames or more; the amplitude at 2 m is half.
        let amplitude = 0.5 * TONE;
        let slope = STEP * amplitude + 2.0 * amplitude / 256.0;
        let joined: Vec<f32> = before.iter().chain(&after).copied().collect();
        assert!(
            steepest(&joined) < 1.02 * slope,
            "{number}: {}",
            steepest(&joined)
        );
        let last = after[after.len() - 2 * BLOCK..]
            .iter()
            .fold(0.0f32, |a, s| a.max(s.abs()));
        match number {
            0 | 3 => assert!(last < 1e-4 * TONE, "{number}: {last}"),
            _ => assert!((last / amplitude - 1.0).abs() < 0.01, "{number}: {last}"),
        }
    }
}

#[test]
fn a_source_without_a_position_is_heard_as_it_is() {
    let (mut controller, mut renderer) = engine();
    let id = controller.add_source(Vec3::NEG_Z * 500.0).expect("a slot");
    let mut settings = controller.source_settings(id).expect("is there");
    settings.is_2d = true;
    controller.configure_source(id, settings).expect("in range");
    let clip = tone(1);
    controller
        .play(id, Arc::clone(&clip), true)
        .expect("is there");
    let heard = run(&mut controller, &mut renderer, 20);
    // The route comes with the first graphics frame, a block later.
    let start = heard.iter().position(|s| *s != 0.0).expect("is heard") - 1;
    assert!(start <= 2 * BLOCK, "{start}");
    assert_eq!(heard[start..], clip[..20 * BLOCK - start]);
    assert_eq!(controller.statistics().paths, 0);
    // Back into the scene: the switch is a cross-fade.
    settings.is_2d = false;
    controller.configure_source(id, settings).expect("in range");
    controller.move_source(id, Vec3::NEG_Z).expect("in range");
    let before = run(&mut controller, &mut renderer, 1);
    let after = run(&mut controller, &mut renderer, 20);
    let joined: Vec<f32> = heard.iter().chain(&before).chain(&after).copied().collect();
    // The fade of 50 ms has a slope of 1.5 over its length, and a voice starts within a graphics frame.
    let fades = TONE * (1.5 / (0.05 * RATE_HZ as f32) + 1.0 / BLOCK as f32);
    assert!(
        steepest(&joined) < 2.0 * STEP * TONE + fades,
        "{}",
        steepest(&joined)
    );
    assert!(controller.statistics().paths > 0);
}

#[test]
fn values_out_of_range_are_refused_and_the_settings_stay() {
    let (mut controller, _renderer) = engine();
    let id = controller.add_source(Vec3::X).expect("a slot");
    let good = controller.source_settings(id).expect("is there");
    for change in [
        (|mix| mix.occlusion = 1.5) as fn(&mut SourceMix),
        |mix| mix.late_gain = -1.0,
        |mix| mix.doppler = f32::NAN,
        |mix| {
            mix.distance = DistanceCurve::Linear {
                min_m: 2.0,
                max_m: 1.0,
            }
        },
    ] {
        let mut settings = good;
        change(&mut settings.mix);
        let refused = controller.configure_source(id, settings);
        assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
        let mut pose = SourcePose::at(id, Vec3::Y);
        pose.settings = settings;
        assert!(controller.tick(ListenerPose::default(), &[pose]).is_err());
        assert_eq!(controller.source_settings(id).expect("is there"), good);
    }
}
