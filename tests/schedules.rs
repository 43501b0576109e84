//! Both schedules on the virtual clock.

use std::sync::Arc;

use foresound::extrapolation::PredictorKind;
use foresound::generation::Hrtf;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::{Latency, OfflineRenderer, OfflineSettings, Poses, Schedule};
use foresound::scene::{
    Directivity, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose,
    procedural,
};
use glam::Vec3;

const ASYNCHRONOUS: Schedule = Schedule::Asynchronous {
    extrapolation_level: 5,
    latency: Latency::Modelled,
};

fn settings(schedule: Schedule) -> OfflineSettings {
    let mut settings = OfflineSettings::default();
    settings.graphics_rate_hz = 74.6;
    settings.block_frames = 512;
    settings.schedule = schedule;
    settings.predictor = PredictorKind::Linear;
    settings.generation.max_sources = 3;
    settings
}

/// Renders the doorway scene; `listener` returns the position at a graphics frame's time.
fn render(settings: OfflineSettings, frames: u32, listener: impl Fn(f64) -> Vec3) -> Vec<f32> {
    let doorway = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&doorway.mesh, &table, &SceneSettings::default()).expect("commits");
    let hrtf = Arc::new(Hrtf::builtin(settings.generation.rate_hz).expect("an HRTF set"));
    let mut renderer = OfflineRenderer::new(Arc::new(scene), hrtf, settings).expect("settings");
    let mut poses = Poses::default();
    for (slot, (_, position)) in doorway.sources.iter().take(3).enumerate() {
        poses
            .sources
            .push(SourcePose::at(SourceId::new(slot as u16, 0), *position));
    }
    let mut output = Vec::new();
    for _ in 0..frames {
        poses.listener = ListenerPose {
            position: listener(renderer.time_s()),
            ..ListenerPose::default()
        };
        let mut noise = |slot: usize, from: u64, samples: &mut [f32]| {
            for (n, sample) in samples.iter_mut().enumerate() {
                *sample = 0.2 * unit(mix((slot as u64) << 40 | (from + n as u64))) - 0.1;
            }
        };
        renderer
            .next_frame(&poses, &mut noise, &mut |block| {
                output.extend_from_slice(block);
                Ok(())
            })
            .expect("the sink succeeds");
    }
    output
}

fn at_rest(_: f64) -> Vec3 {
    procedural::doorway().walk.standing
}

fn walking(time_s: f64) -> Vec3 {
    let walk = procedural::doorway().walk;
    walk.from.lerp(walk.to, (0.3 + 0.1 * time_s) as f32)
}

fn snr_db(reference: &[f32], estimate: &[f32]) -> f64 {
    assert_eq!(reference.len(), estimate.len());
    let energy = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
    let signal = energy(&mut reference.iter().map(|s| f64::from(*s)));
    let noise = energy(
        &mut reference
            .iter()
            .zip(estimate)
            .map(|(a, b)| f64::from(*a) - f64::from(*b)),
    );
    10.0 * (signal / noise.max(1e-30)).log10()
}

/// Frame 0 has its result at once; delayed results are computed in frames 1, L + 2, 2 L + 3 and used L + 1 frames later.
#[test]
fn late_updates_begin_with_frame_one() {
    let doorway = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&doorway.mesh, &table, &SceneSettings::default()).expect("commits");
    let hrtf = Arc::new(Hrtf::builtin(44_100).expect("an HRTF set"));
    let mut settings = settings(ASYNCHRONOUS);
    settings.generation.rate_hz = 44_100;
    let mut renderer = OfflineRenderer::new(Arc::new(scene), hrtf, settings).expect("settings");
    let position = |frame: u32| doorway.walk.from + Vec3::Y * 0.01 * frame as f32;
    for frame in 0..30 {
        let poses = Poses {
            listener: ListenerPose {
                position: position(frame),
                ..ListenerPose::default()
            },
            sources: vec![SourcePose::at(SourceId::default(), doorway.sources[0].1)],
        };
        let mut silence = |_: usize, _: u64, samples: &mut [f32]| samples.fill(0.0);
        renderer
            .next_frame(&poses, &mut silence, &mut |_| Ok(()))
            .expect("the sink succeeds");
        let of = match frame {
            0..7 => 0,
            _ => (frame - 7) / 6 * 6 + 1,
        };
        assert_eq!(renderer.paths().listener.position, position(of), "{frame}");
    }
}

#[test]
fn a_listener_at_rest_hears_both_schedules_alike() {
    for rate_hz in [44_100, 48_000] {
        let with = |schedule| {
            let mut settings = settings(schedule);
            settings.generation.rate_hz = rate_hz;
            render(settings, 40, at_rest)
        };
        let (synchronous, asynchronous) = (with(Schedule::Synchronous), with(ASYNCHRONOUS));
        assert!(synchronous.iter().any(|s| s.abs() > 1e-3));
        let figure = snr_db(&synchronous, &asynchronous);
        assert!(figure > 100.0, "{figure} dB at {rate_hz} Hz");
    }
}

#[test]
fn an_update_in_every_frame_equals_the_synchronous_schedule() {
    let every = Schedule::Asynchronous {
        extrapolation_level: 0,
        latency: Latency::None,
    };
    assert_eq!(
        render(settings(every), 30, walking),
        render(settings(Schedule::Synchronous), 30, walking)
    );
}

#[test]
fn a_walking_listener_hears_the_difference() {
    let synchronous = render(settings(Schedule::Synchronous), 60, walking);
    let asynchronous = render(settings(ASYNCHRONOUS), 60, walking);
    let figure = snr_db(&synchronous, &asynchronous);
    assert!(
        figure > -10.0 && figure < 60.0,
        "{figure} dB: the schedules are equal or unrelated"
    );
}

#[test]
fn the_same_input_gives_the_same_bits() {
    assert_eq!(
        render(settings(ASYNCHRONOUS), 20, walking),
        render(settings(ASYNCHRONOUS), 20, walking)
    );
}

#[test]
fn the_block_size_changes_nothing_audible() {
    let reference = render(settings(ASYNCHRONOUS), 20, walking);
    for block_frames in [32, 77, 4096] {
        let mut blocks = settings(ASYNCHRONOUS);
        blocks.block_frames = block_frames;
        let figure = snr_db(&reference, &render(blocks, 20, walking));
        // Ramps are split at other frames, so single-precision sums round differently: 24 bits less some growth.
        assert!(figure > 100.0, "{figure} dB with blocks of {block_frames}");
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let doorway = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&doorway.mesh, &table, &SceneSettings::default()).expect("commits");
    let (scene, hrtf) = (
        Arc::new(scene),
        Arc::new(Hrtf::builtin(44_100).expect("an HRTF set")),
    );
    let endless = Schedule::Asynchronous {
        extrapolation_level: 100_000,
        latency: Latency::Modelled,
    };
    type Change<'a> = &'a dyn Fn(&mut OfflineSettings);
    let cases: [(Change<'_>, &str); 3] = [
        (&|s| s.graphics_rate_hz = f64::NAN, "graphics_rate_hz"),
        (&|s| s.block_frames = 16, "block_frames"),
        (&|s| s.schedule = endless, "level"),
    ];
    for (set, name) in cases {
        let mut settings = settings(Schedule::Synchronous);
        set(&mut settings);
        let refused = OfflineRenderer::new(Arc::clone(&scene), Arc::clone(&hrtf), settings);
        let error = refused.err().expect("refused").to_string();
        assert!(error.starts_with(name), "{error}");
    }
}

/// What an offline rendering has no place for is refused, and a graphics frame that was refused may be given again.
#[test]
fn sources_without_a_position_and_further_listeners_are_refused() {
    let (mesh, table) = (procedural::doorway().mesh, MaterialTable::built_in());
    let scene = Arc::new(Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits"));
    let hrtf = Arc::new(Hrtf::builtin(44_100).expect("an HRTF set"));
    let make = |listeners: usize| {
        let mut settings = settings(Schedule::Synchronous);
        settings.generation.listeners = listeners;
        OfflineRenderer::new(Arc::clone(&scene), Arc::clone(&hrtf), settings)
    };
    let error = make(2).err().expect("refused").to_string();
    assert!(error.starts_with("listeners"), "{error}");
    let mut renderer = make(1).expect("settings");
    let mut poses = Poses::default();
    poses.listener.position = procedural::doorway().walk.standing;
    poses.sources.push(SourcePose::at(
        SourceId::default(),
        procedural::doorway().sources[0].1,
    ));
    let mut silence = |_: usize, _: u64, samples: &mut [f32]| samples.fill(0.0);
    let mut frame = |renderer: &mut OfflineRenderer, poses: &Poses| {
        renderer.next_frame(poses, &mut silence, &mut |_| Ok(()))
    };
    poses.sources[0].settings.is_2d = true;
    let error = frame(&mut renderer, &poses).expect_err("refused");
    assert!(error.to_string().starts_with("is_2d"), "{error}");
    poses.sources[0].settings.is_2d = false;
    frame(&mut renderer, &poses).expect("a good pose");
    assert_eq!(renderer.report().graphics_frames, 1);
}

/// The amplitudes of the first frame's paths of a dipole of this orientation.
fn dipole(orientation: [f32; 4]) -> Result<Vec<[f32; 8]>, foresound::Error> {
    let (mesh, table) = (procedural::doorway().mesh, MaterialTable::built_in());
    let scene = Arc::new(Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits"));
    let hrtf = Arc::new(Hrtf::builtin(44_100).expect("an HRTF set"));
    let settings = settings(Schedule::Synchronous);
    let mut renderer = OfflineRenderer::new(scene, hrtf, settings).expect("settings");
    let mut poses = Poses::default();
    poses.listener.position = procedural::doorway().walk.standing;
    let source = SourcePose::at(SourceId::default(), procedural::doorway().sources[0].1);
    poses.sources.push(source.with_orientation(orientation));
    poses.sources[0].settings.directivity = Directivity::even(1.0, 1.0);
    let mut silence = |_: usize, _: u64, samples: &mut [f32]| samples.fill(0.0);
    renderer.next_frame(&poses, &mut silence, &mut |_| Ok(()))?;
    let paths = &renderer.frame_paths().paths;
    Ok(paths.iter().map(|path| path.amplitude).collect())
}

#[test]
fn orientations_are_normalised_offline_too() {
    let facing = dipole([0.0, 0.0, 0.0, 1.0]).expect("a good pose");
    assert!(facing.iter().any(|bands| bands[0] != 0.0));
    for same in [[0.0; 4], [0.0, 0.0, 0.0, 8.0]] {
        assert_eq!(dipole(same).expect("a good pose"), facing);
    }
    for bad in [f32::MAX, f32::NAN] {
        assert!(dipole([0.0, bad, 0.0, 0.0]).is_err(), "{bad}");
    }
}
