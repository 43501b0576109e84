//! Several listeners: each hears what it would hear alone, the mix is the sum, and what is shared stays right.

use std::sync::Arc;

use foresound::paths::{LateEnergy, Path, PathSet, Propagator};
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, FrameTime, Renderer,
};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};
use foresound::{Error, Layout, PropagationSettings};
use glam::Vec3;

const BLOCK: usize = 735;

fn doorway() -> (Arc<Scene>, procedural::BenchmarkScene) {
    let layout = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&layout.mesh, &table, &SceneSettings::default()).expect("commits");
    (Arc::new(scene), layout)
}

fn propagator(scene: &Arc<Scene>, listeners: usize) -> Propagator {
    let settings = PropagationSettings::default();
    let mut propagator = Propagator::new(Arc::clone(scene), settings).expect("in range");
    propagator.set_listener_count(listeners);
    propagator
}

/// Whether a position at the height of ears is in the wall between the rooms of the doorway.
fn is_in_wall(position: Vec3) -> bool {
    (8.0..8.2).contains(&position.x) && !(3.1..4.05).contains(&position.z)
}

fn energy(paths: &[Path]) -> f32 {
    let of = |path: &Path| path.amplitude.iter().map(|a| a * a).sum::<f32>();
    paths.iter().map(of).sum()
}

/// Two listeners walk towards each other through a door, a source moves: paths and late energy of each are those of a propagator
/// of its own, which has twice the guide rays.
///
/// Discovery by rays is chance: a rotation of half as many rays finds fewer sequences, the other listener and the history of 64
/// updates find more. At least 97 % of the paths' energy and 90 % of their number is asked for, and the late energy within 0.5 dB.
#[test]
fn each_listener_has_the_paths_that_it_has_alone() {
    let (scene, layout) = doorway();
    let mut shared = propagator(&scene, 2);
    let mut alone = [0, 1].map(|_| propagator(&scene, 1));
    let (mut found, mut wanted) = ([0.0f32; 2], [0.0f32; 2]);
    let (mut count, mut all) = (0, 0);
    let mut rays = [0u64; 2];
    let mut within = 0;
    for step in 0..60 {
        let share = step as f32 / 60.0;
        let sources: Vec<SourcePose> = (0..2u16)
            .map(|n| {
                let moved = Vec3::X * 0.02 * step as f32 * f32::from(n);
                let position = layout.sources[usize::from(n)].1 + moved;
                SourcePose::at(SourceId::new(n, 1), position)
            })
            .collect();
        let ears = [share, 1.0 - share].map(|share| {
            let ear = layout.walk.from.lerp(layout.walk.to, share);
            ListenerPose::facing(ear, 0.0)
        });
        for (index, ear) in ears.iter().enumerate() {
            let (mut own, mut other) = (PathSet::default(), PathSet::default());
            shared.select_listener(index);
            shared.update(ear, &sources, f64::from(step), &mut own);
            alone[index].update(ear, &sources, f64::from(step), &mut other);
            rays[0] += own.rays;
            rays[1] += other.rays;
            if step < 20 {
                continue;
            }
            assert_eq!(own.listener.position, ear.position);
            let ids: Vec<_> = own.paths.iter().map(|path| path.id).collect();
            let both: Vec<Path> = other
                .paths
                .iter()
                .filter(|path| ids.contains(&path.id))
                .copied()
                .collect();
            count += both.len();
            all += other.paths.len();
            found[index] += energy(&both);
            wanted[index] += energy(&other.paths);
            for (own, other) in own.late.iter().zip(&other.late) {
                assert_eq!(own.source, other.source);
                let sum = |late: &LateEnergy| late.total().iter().sum::<f32>();
                // The walk cuts the jamb's corner, and only within the wall does nothing arrive.
                if is_in_wall(ear.position) {
                    assert_eq!([sum(own), sum(other)], [0.0; 2], "{}", ear.position);
                    within += 1;
                    continue;
                }
                let db = 10.0 * (sum(own) / sum(other)).log10();
                assert!(db.abs() < 0.5, "step {step}, listener {index}: {db} dB");
            }
        }
    }
    assert!(within > 0, "the walk passes the wall");
    for index in 0..2 {
        assert!(
            found[index] > 0.97 * wanted[index],
            "{found:?} of {wanted:?}"
        );
    }
    assert!(count as f32 > 0.9 * all as f32, "{count} of {all}");
    // Half of the guide rays, and the sources' rays once.
    assert!(rays[0] < rays[1], "{rays:?}");
}

fn engine(listeners: usize, layout: Layout) -> (Controller, Renderer) {
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 4;
    settings.generation.layout = layout;
    settings.generation.channels = Some(2);
    settings.generation.limiter = false;
    settings.generation.listeners = listeners;
    settings.propagation.guide_rays = 256;
    settings.propagation.source_rays = 32;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    // Clips begin with their graphics frame: in the same block whatever the number of listeners.
    settings.even_blocks = false;
    let (scene, places) = doorway();
    let (mut controller, renderer) = Engine::new(settings).expect("an engine");
    controller.set_scene(scene).expect("accepted");
    for n in 0..2u32 {
        let position = places.sources[n as usize].1;
        let id = controller.add_source(position).expect("a slot");
        let noise =
            |k: u32| ((k * 7 + n).wrapping_mul(2_654_435_761) >> 16) as f32 / 65_536.0 - 0.5;
        let samples: Arc<[f32]> = (0..9_999).map(noise).collect();
        controller.play(id, samples, true).expect("is there");
    }
    (controller, renderer)
}

/// Positions of the listeners in a graphics frame.
fn ears(frame: usize) -> [ListenerPose; 2] {
    let layout = procedural::doorway().walk;
    let share = frame as f32 / 60.0;
    [share, 1.0 - share]
        .map(|share| ListenerPose::facing(layout.from.lerp(layout.to, share), share))
}

/// The mix of all listeners is the sum of their outputs, also over a change of the layout and of the scene. The bound is that of
/// sums in another order: 1e-5 of the loudest sample.
#[test]
fn the_mix_is_the_sum_of_the_listeners() {
    let mut engines = [0, 1].map(|_| engine(2, Layout::Binaural));
    let (mut worst, mut loudest, mut differs) = (0.0f32, 0.0f32, 0.0f32);
    for frame in 0..60 {
        let ears = ears(frame);
        for (controller, _) in &mut engines {
            match frame {
                20 => controller.set_layout(Layout::Stereo).expect("two channels"),
                40 => controller.set_scene(doorway().0).expect("accepted"),
                _ => {}
            }
            controller.set_listener(1, ears[1]).expect("is there");
            controller.tick(ears[0], &[]).expect("a good pose");
        }
        let [(_, mixed), (_, apart)] = &mut engines;
        let (mut mix, mut both) = ([0.0; 2 * BLOCK], [0.0; 4 * BLOCK]);
        let reports = [mixed.render(&mut mix), apart.render_listeners(&mut both)];
        assert_eq!(reports.map(|report| report.frames), [BLOCK as u32; 2]);
        let (first, second) = both.split_at(2 * BLOCK);
        for ((mix, first), second) in mix.iter().zip(first).zip(second) {
            worst = worst.max((mix - first - second).abs());
            loudest = loudest.max(mix.abs());
            differs = differs.max((first - second).abs());
        }
    }
    assert!(loudest > 0.01 && differs > 0.1 * loudest);
    assert!(worst < 1e-5 * loudest, "{worst} of {loudest}");
}

/// The first of two listeners hears what the only listener of another engine hears, but for what its guide rays find.
#[test]
fn a_second_listener_hardly_changes_the_first() {
    let mut two = engine(2, Layout::Stereo);
    let mut one = engine(1, Layout::Stereo);
    let (mut error, mut energy) = (0.0f64, 0.0f64);
    for frame in 0..90 {
        // At rest after a second: all rotations have been cast.
        let ears = ears(frame.min(30));
        two.0.set_listener(1, ears[1]).expect("is there");
        for (controller, _) in [&mut one, &mut two] {
            controller.tick(ears[0], &[]).expect("a good pose");
        }
        let (mut alone, mut both) = ([0.0; 2 * BLOCK], [0.0; 4 * BLOCK]);
        one.1.render(&mut alone);
        two.1.render_listeners(&mut both);
        if frame < 60 {
            continue;
        }
        for (alone, first) in alone.iter().zip(&both) {
            error += f64::from(alone - first).powi(2);
            energy += f64::from(*alone).powi(2);
        }
    }
    // -20 dB: paths that one search has and the other lacks are of high orders, each a thousandth of the energy.
    assert!(
        error < 0.01 * energy,
        "{} dB",
        10.0 * (error / energy).log10()
    );
}

/// Each of three and four listeners is nearer to what it hears alone than to what any other does: by 10 dB at least.
#[test]
fn three_and_four_listeners_hear_what_each_hears_alone() {
    let at = |listener: usize, frame: usize| {
        let walk = procedural::doorway().walk;
        let share = 0.1 + 0.25 * listener as f32 + 0.001 * frame.min(30) as f32;
        ListenerPose::facing(walk.from.lerp(walk.to, share), 1.3 * listener as f32)
    };
    for count in [3, 4] {
        let mut together = engine(count, Layout::Stereo);
        let mut alone: Vec<_> = (0..count).map(|_| engine(1, Layout::Stereo)).collect();
        let (mut own, mut other) = (vec![0.0f64; count], vec![0.0f64; count]);
        for frame in 0..75 {
            for listener in 1..count {
                let set = together.0.set_listener(listener, at(listener, frame));
                set.expect("is there");
            }
            together.0.tick(at(0, frame), &[]).expect("a good pose");
            let mut all = vec![0.0; 2 * BLOCK * count];
            together.1.render_listeners(&mut all);
            let mut single = vec![0.0; 2 * BLOCK * count];
            let parts = single.chunks_exact_mut(2 * BLOCK);
            for ((listener, (controller, renderer)), part) in
                alone.iter_mut().enumerate().zip(parts)
            {
                let pose = at(listener, frame);
                controller.tick(pose, &[]).expect("a good pose");
                renderer.render(part);
            }
            if frame < 45 {
                continue;
            }
            let distance = |a: usize, b: usize| -> f64 {
                let [a, b] = [&all[2 * BLOCK * a..], &single[2 * BLOCK * b..]];
                let pairs = a.iter().zip(b).take(2 * BLOCK);
                pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum()
            };
            for listener in 0..count {
                own[listener] += distance(listener, listener);
                let others = (0..count).filter(|other| *other != listener);
                other[listener] += others
                    .map(|other| distance(listener, other))
                    .fold(f64::MAX, f64::min);
            }
        }
        for listener in 0..count {
            let share = own[listener] / other[listener];
            println!("{count} listeners, {listener}: {share:.4}");
            assert!(share < 0.1, "{count} listeners, {listener}: {share}");
        }
    }
}

#[test]
fn wrong_listeners_are_refused() {
    let (mut controller, mut renderer) = engine(2, Layout::Stereo);
    assert_eq!(renderer.listeners(), 2);
    let refused = controller.set_listener(2, ListenerPose::default());
    assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
    let nowhere = ListenerPose::facing(Vec3::splat(f32::NAN), 0.0);
    assert!(controller.set_listener(1, nowhere).is_err());
    controller
        .set_listener(0, ListenerPose::default())
        .expect("the first");
    controller
        .tick(ListenerPose::default(), &[])
        .expect("a good pose");
    // What does not fill a frame of both is silent.
    let mut output = [1.0; 4 * 100 + 3];
    assert_eq!(renderer.render_listeners(&mut output).frames, 100);
    assert_eq!(output[400..], [0.0; 3]);
    for listeners in [0, 5] {
        let mut settings = EngineSettings::default();
        settings.generation.listeners = listeners;
        assert!(Engine::new(settings).is_err());
    }
}
