//! Clips in an engine: on time, in stereo, with ramps, forgotten after their end.

use std::sync::Arc;

use foresound::runtime::{
    AffinityPolicy, Clip, Controller, Engine, EngineSchedule, EngineSettings, FrameTime,
    PlaySettings, PlaybackState, Renderer,
};
use foresound::scene::{ListenerPose, SourceId, SourceSettings};
use foresound::{Error, Hrtf};
use glam::Vec3;

const RATE_HZ: u32 = 44_100;
const BLOCK: usize = 735;

fn engine() -> (Controller, Renderer) {
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 4;
    settings.generation.limiter = false;
    settings.generation.late = false;
    settings.generation.max_delay_s = 0.2;
    settings.propagation.guide_rays = 16;
    settings.propagation.source_rays = 16;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::None;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    settings.hrtf = Some(Arc::new(Hrtf::omnidirectional(RATE_HZ).expect("a set")));
    Engine::new(settings).expect("an engine")
}

/// Interleaved stereo over graphics frames.
fn run(controller: &mut Controller, renderer: &mut Renderer, frames: usize) -> Vec<f32> {
    let mut heard = Vec::new();
    let mut block = [0.0; 2 * BLOCK];
    for _ in 0..frames {
        controller
            .tick(ListenerPose::default(), &[])
            .expect("a good pose");
        renderer.render(&mut block);
        heard.extend(block);
    }
    heard
}

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
