//! Clips in an engine: on time, in stereo, around the listener, with ramps, forgotten after their end.

use foresound::Error;
use foresound::Layout;
use foresound::runtime::{Clip, Controller, PlaySettings, PlaybackState};
use foresound::scene::{ListenerPose, SourceId, SourceSettings};
use glam::Vec3;

mod small_engine;
use small_engine::{BLOCK, RATE_HZ, engine, run};

/// A 2D source.
fn flat(controller: &mut Controller) -> SourceId {
    let id = controller.add_source(Vec3::X).expect("a slot");
    let mut settings = SourceSettings::default();
    settings.is_2d = true;
    controller.configure_source(id, settings).expect("in range");
    id
}

#[test]
fn a_stereo_clip_starts_on_its_frame_and_keeps_its_channels() {
    let (mut controller, mut renderer) = engine();
    let id = flat(&mut controller);
    run(&mut controller, &mut renderer, 3);
    let samples: Vec<f32> = (1..=2000).map(|n| n as f32 / 4000.0).collect();
    let settings = PlaySettings {
        start_at: 5 * BLOCK as u64 + 123,
        ..PlaySettings::default()
    };
    controller
        .play_clip(id, Clip::stereo(samples.clone()), settings)
        .expect("is there");
    let state = |controller: &Controller| controller.playback(id).expect("is there").state;
    assert_eq!(state(&controller), PlaybackState::Scheduled);
    assert_eq!(controller.audio_frame(), 3 * BLOCK as u64);
    assert!(
        run(&mut controller, &mut renderer, 2)
            .iter()
            .all(|s| *s == 0.0)
    );
    assert_eq!(state(&controller), PlaybackState::Scheduled);
    let heard = run(&mut controller, &mut renderer, 2);
    for (found, wanted) in heard[2 * 123..].iter().zip(&samples[..1000]) {
        // The channels go through their mean and half their difference.
        assert!((found - wanted).abs() < 1e-6, "{found} instead of {wanted}");
    }
    run(&mut controller, &mut renderer, 1);
    assert_eq!(state(&controller), PlaybackState::Finished);
    controller.stop(id).expect("is there");
    assert_eq!(state(&controller), PlaybackState::Idle);
}

#[test]
fn a_source_pauses_seeks_and_ramps() {
    let (mut controller, mut renderer) = engine();
    let id = flat(&mut controller);
    let settings = PlaySettings {
        is_looped: true,
        ..PlaySettings::default()
    };
    controller
        .play_clip(id, vec![0.5; 40_000], settings)
        .expect("is there");
    run(&mut controller, &mut renderer, 4);
    controller.pause_source(id, true).expect("is there");
    run(&mut controller, &mut renderer, 3);
    let paused = controller.playback(id).expect("is there");
    assert_eq!(paused.state, PlaybackState::Paused);
    assert!(
        run(&mut controller, &mut renderer, 2)
            .iter()
            .all(|s| *s == 0.0)
    );
    assert_eq!(controller.playback(id).expect("is there"), paused);
    controller.seek_source(id, 30_000).expect("plays a clip");
    controller.pause_source(id, false).expect("is there");
    run(&mut controller, &mut renderer, 3);
    let playback = controller.playback(id).expect("is there");
    assert_eq!(playback.state, PlaybackState::Playing);
    assert!(
        (30_000..30_000 + 4 * BLOCK as u64).contains(&playback.frame),
        "{playback:?}"
    );
    controller.set_source_pitch(id, 2.0).expect("in range");
    run(&mut controller, &mut renderer, 4);
    let before = controller.playback(id).expect("is there").frame;
    run(&mut controller, &mut renderer, 1);
    let passed = controller.playback(id).expect("is there").frame + 40_000 - before;
    assert_eq!(passed % 40_000, 2 * BLOCK as u64);
    // A ramp of half a second is a line, but for its rounded ends.
    controller.fade_source_gain(id, 0.0, 0.5).expect("in range");
    let heard = run(&mut controller, &mut renderer, 40);
    let left: Vec<f32> = heard.chunks_exact(2).map(|pair| pair[0]).collect();
    let steps = left.windows(2).map(|pair| pair[0] - pair[1]);
    let steepest = steps.fold(0.0, f32::max);
    let line = 0.5 / (0.5 * RATE_HZ as f32);
    assert!(steepest < 1.5 * line, "{steepest} instead of {line}");
    let middle = left[20 * BLOCK];
    assert!((0.1..0.4).contains(&middle), "{middle}");
    assert!(left[left.len() - 10..].iter().all(|s| s.abs() < 1e-5));
}

#[test]
fn a_one_shot_is_heard_and_forgotten() {
    let (mut controller, mut renderer) = engine();
    let (clip, settings) = (Clip::mono(vec![0.5; 2000]), PlaySettings::default());
    let mut most = 0;
    for _ in 0..6 {
        let near = SourceSettings::default();
        let id = controller
            .play_once(Vec3::NEG_Z, clip.clone(), settings, near)
            .expect("a free slot");
        most = most.max(controller.source_count());
        let heard = run(&mut controller, &mut renderer, 12);
        assert!(heard.iter().any(|s| s.abs() > 0.2));
        // 2,000 frames and the longest delay of 0.2 s are 15 graphics frames.
        assert!(controller.playback(id).is_ok());
        run(&mut controller, &mut renderer, 8);
        assert!(matches!(
            controller.playback(id),
            Err(Error::StaleSource { .. })
        ));
    }
    assert_eq!((most, controller.source_count()), (1, 0));
}

#[test]
fn a_one_shot_of_an_empty_clip_is_forgotten() {
    let (mut controller, mut renderer) = engine();
    for clip in [Clip::mono(Vec::new()), Clip::stereo(vec![0.5])] {
        let (play, source) = (PlaySettings::default(), SourceSettings::default());
        let begun = controller.play_once(Vec3::NEG_Z, clip, play, source);
        let id = begun.expect("a free slot");
        let heard = run(&mut controller, &mut renderer, 20);
        assert!(heard.iter().all(|s| *s == 0.0));
        let ended = controller.playback(id);
        assert!(matches!(ended, Err(Error::StaleSource { .. })), "{ended:?}");
    }
    assert_eq!(controller.source_count(), 0);
}

/// A clip that was sought after its end ends when it has played again and its longest path of 0.2 s has arrived, which are 12
/// graphics frames; a pause of the engine counts for neither.
#[test]
fn a_finished_clip_that_is_sought_ends_anew() {
    let (mut controller, mut renderer) = engine();
    let (clip, settings) = (Clip::mono(vec![0.5; 20 * BLOCK]), PlaySettings::default());
    let id = controller
        .play_once(Vec3::NEG_Z, clip, settings, SourceSettings::default())
        .expect("a free slot");
    run(&mut controller, &mut renderer, 25);
    let state = |controller: &Controller| controller.playback(id).expect("is there").state;
    assert_eq!(state(&controller), PlaybackState::Finished);
    controller.pause();
    run(&mut controller, &mut renderer, 1);
    controller.seek_source(id, 0).expect("plays a clip");
    run(&mut controller, &mut renderer, 20);
    controller.resume();
    let heard = run(&mut controller, &mut renderer, 15);
    assert!(heard.iter().any(|s| s.abs() > 0.2));
    assert_eq!(state(&controller), PlaybackState::Playing);
    run(&mut controller, &mut renderer, 15);
    assert_eq!(state(&controller), PlaybackState::Finished);
    run(&mut controller, &mut renderer, 10);
    assert!(controller.playback(id).is_err());
}

#[test]
fn values_out_of_range_are_refused_and_sound_goes_on() {
    let (mut controller, mut renderer) = engine();
    let id = flat(&mut controller);
    let clip = Clip::mono(vec![0.5; 1000]);
    let refused = |result: foresound::Result<()>| {
        assert!(matches!(result, Err(Error::Setting { .. })), "{result:?}");
    };
    controller
        .play_clip(
            id,
            clip.clone(),
            PlaySettings {
                is_looped: true,
                ..PlaySettings::default()
            },
        )
        .expect("plays");
    for loop_frames in [[5, 5], [7, 3], [0, 1001]] {
        let settings = PlaySettings {
            loop_frames: Some(loop_frames),
            ..PlaySettings::default()
        };
        refused(controller.play_clip(id, clip.clone(), settings));
    }
    let settings = PlaySettings {
        first_frame: 1001,
        ..PlaySettings::default()
    };
    refused(controller.play_clip(id, clip.clone(), settings));
    for value in [0.0, -1.0, 4.1, f32::NAN] {
        refused(controller.set_source_pitch(id, value));
        refused(controller.fade_source_gain(id, 0.5, -1.0 - value.abs()));
    }
    refused(controller.fade_source_gain(id, -1.0, 1.0));
    let sources = controller.source_count();
    let mut wrong = SourceSettings::default();
    wrong.mix.occlusion = 2.0;
    assert!(
        controller
            .play_once(Vec3::X, clip, PlaySettings::default(), wrong)
            .is_err()
    );
    assert_eq!(controller.source_count(), sources);
    let idle = controller.add_source(Vec3::Y).expect("a slot");
    assert!(matches!(
        controller.seek_source(idle, 0),
        Err(Error::Engine { .. })
    ));
    let heard = run(&mut controller, &mut renderer, 4);
    assert_eq!(heard.last(), Some(&0.5));
    assert_eq!(
        controller.playback(id).expect("is there").state,
        PlaybackState::Playing
    );
}

/// A field of one plane wave in AmbiX form, from a direction in its own coordinates (x ahead, y to the left, z up).
fn wave(samples: &[f32], [x, y, z]: [f32; 3]) -> Clip {
    let frames = samples.iter();
    Clip::ambisonic(
        frames
            .flat_map(|s| [*s, s * y, s * z, s * x])
            .collect::<Vec<f32>>(),
    )
}

/// Energies of the channels for a listener turned to the left by so many radians.
fn field_energies(layout: Layout, clip: Clip, turned: f32) -> Vec<f64> {
    let (mut controller, mut renderer) = small_engine::engine_with(|settings| {
        settings.generation.layout = layout;
        settings.hrtf = None;
    });
    let id = flat(&mut controller);
    let settings = PlaySettings {
        is_looped: true,
        ..PlaySettings::default()
    };
    controller.play_clip(id, clip, settings).expect("is there");
    let listener = ListenerPose::facing(Vec3::ZERO, turned);
    let channels = renderer.channels();
    let (mut block, mut energies) = (vec![0.0; channels * BLOCK], vec![0.0; channels]);
    for frame in 0..40 {
        controller.tick(listener, &[]).expect("a good pose");
        renderer.render(&mut block);
        for heard in block.chunks_exact(channels).filter(|_| frame >= 10) {
            for (energy, sample) in energies.iter_mut().zip(heard) {
                *energy += f64::from(*sample).powi(2);
            }
        }
    }
    energies
}

fn noise(count: usize) -> Vec<f32> {
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 25) as f32 - 0.25
    };
    (0..count).map(|_| next()).collect()
}

#[test]
fn a_sound_field_stays_in_the_world_while_the_head_turns() {
    let noise = noise(RATE_HZ as usize / 4);
    let left = || wave(&noise, [0.0, 1.0, 0.0]);
    let db = |ratio: f64| 10.0 * ratio.log10();
    for name in ["binaural", "stereo", "5.1"] {
        let layout: Layout = name.parse().expect("is a layout");
        let sides = |turned: f32| {
            let energies = field_energies(layout, left(), turned);
            db(energies[0] / energies[1])
        };
        let (ahead, towards, away) = (sides(0.0), sides(1.6), sides(3.1));
        println!("{name}: {ahead:.1} dB ahead, {towards:.1} dB towards it, {away:.1} dB away");
        assert!(ahead > 3.0 && away < -3.0 && towards.abs() < 1.5, "{name}");
    }
    // Ambisonics passes on: facing the wave, its energy is in W and X.
    let energies = field_energies(Layout::Ambisonics1, left(), std::f32::consts::FRAC_PI_2);
    assert!(
        (energies[3] / energies[0] - 1.0).abs() < 1e-3,
        "{energies:?}"
    );
    assert!(energies[1] < 1e-6 * energies[0] && energies[2] < 1e-6 * energies[0]);
}

/// The same field from many directions has the same total energy in all layouts: that of two ears.
#[test]
fn a_sound_field_is_as_loud_in_every_layout() {
    let noise = noise(RATE_HZ as usize / 4);
    let sent: f64 = noise.iter().map(|s| f64::from(*s).powi(2)).sum();
    let sent = sent / noise.len() as f64 * (30 * BLOCK) as f64;
    let mut levels = Vec::new();
    for name in [
        "binaural", "stereo", "mono", "5.1", "7.1.4", "ambix1", "ambix3",
    ] {
        let layout: Layout = name.parse().expect("is a layout");
        // The corners of an octahedron: their mean is that of all directions for a field of first order.
        let mut energy = 0.0;
        for axis in 0..3 {
            for side in [1.0, -1.0] {
                let mut direction = [0.0; 3];
                direction[axis] = side;
                let energies = field_energies(layout, wave(&noise, direction), 0.4);
                let counted = layout.ambisonics_order().map_or(energies.len(), |_| 1);
                energy += energies[..counted].iter().sum::<f64>() / 6.0;
            }
        }
        levels.push((name, 10.0 * (energy / (2.0 * sent)).log10()));
    }
    println!("{levels:.2?} dB");
    assert!(levels.iter().all(|(_, db)| db.abs() < 0.5), "{levels:.2?}");
}

#[test]
fn a_sound_field_on_a_source_with_a_position_is_its_first_channel() {
    let (mut controller, mut renderer) = engine();
    let heard = [
        wave(&[0.5; 4000], [0.0, 0.9, 0.1]),
        Clip::mono(vec![0.5; 4000]),
    ]
    .map(|clip| {
        let id = controller.add_source(Vec3::NEG_Z).expect("a slot");
        let settings = PlaySettings::default();
        controller.play_clip(id, clip, settings).expect("is there");
        let heard = run(&mut controller, &mut renderer, 10);
        controller.remove_source(id).expect("is there");
        run(&mut controller, &mut renderer, 40);
        heard
    });
    assert!(heard[0].iter().any(|s| s.abs() > 0.2));
    assert_eq!(heard[0], heard[1]);
    for channels in [0, 3, 5, 16] {
        let refused = Clip::with_channels(vec![0.0; 240], channels);
        assert!(matches!(refused, Err(Error::Setting { .. })), "{channels}");
    }
    let field = Clip::with_channels(vec![0.0; 240], 4).expect("is a field");
    assert_eq!((field.frames(), field.channels()), (60, 4));
}
