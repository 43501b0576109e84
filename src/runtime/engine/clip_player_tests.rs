//! Clips are what they are at pitch 1, band-limited at others, and smooth at every change.

use super::*;
use crate::runtime::engine::playback::Playback;

fn player(samples: Vec<f32>, looped: Option<[usize; 2]>, start: [u64; 2]) -> ClipPlayer {
    let cell = Arc::new(PlaybackCell::default());
    ClipPlayer::new(
        Clip::mono(samples),
        looped,
        start,
        1,
        cell,
        Arc::new(Kernel::new()),
    )
}

/// The next frames in blocks of some length.
fn run(player: &mut ClipPlayer, state: &PlayState, now: &mut u64, frames: usize) -> Vec<f32> {
    let mut heard = vec![9.0; frames];
    let mut others = [[9.0; 64]; OTHERS];
    for block in heard.chunks_mut(64) {
        let others = others.each_mut().map(|other| &mut other[..]);
        player.fill(block, others, state, *now);
        *now += block.len() as u64;
    }
    heard
}

fn tone(step: f32, frames: usize) -> Vec<f32> {
    (0..frames).map(|n| (step * n as f32).sin()).collect()
}

fn steepest(heard: &[f32]) -> f32 {
    let steps = heard.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.fold(0.0, f32::max)
}

fn state(change: impl FnOnce(&mut PlayState)) -> PlayState {
    let mut state = PlayState::default();
    change(&mut state);
    state
}

#[test]
fn a_clip_ends_loops_between_its_points_and_starts_on_time() {
    let clip = || (1..=6).map(|n| n as f32).collect::<Vec<f32>>();
    let plain = PlayState::default();
    let heard = |looped, start| run(&mut player(clip(), looped, start), &plain, &mut 0, 12);
    assert_eq!(
        heard(None, [0, 0])[..8],
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0]
    );
    assert_eq!(
        heard(None, [4, 3])[..8],
        [0.0, 0.0, 0.0, 5.0, 6.0, 0.0, 0.0, 0.0]
    );
    let looped = heard(Some([2, 4]), [0, 0]);
    assert_eq!(looped[..8], [1.0, 2.0, 3.0, 4.0, 3.0, 4.0, 3.0, 4.0]);
    // A start in the past is at once, and one on a block's first frame is exact.
    for start_at in [64, 100, 128] {
        let mut player = player(clip(), None, [0, start_at]);
        let heard = run(&mut player, &plain, &mut 0, 256);
        let first = heard.iter().position(|s| *s != 0.0);
        assert_eq!(first, Some(start_at as usize));
    }
    assert_eq!(
        run(&mut player(clip(), None, [0, 5]), &plain, &mut 9, 2),
        [1.0, 2.0]
    );
}

#[test]
fn skipped_frames_advance_as_heard_ones() {
    for looped in [None, Some([10, 50])] {
        for pitch in [1.0, 0.5, 2.0] {
            let state = state(|state| state.pitch = pitch);
            let mut players = [0, 1].map(|_| player(tone(0.1, 400), looped, [0, 30]));
            let (mut now, frames) = (0, 192);
            run(&mut players[0], &state, &mut now, frames);
            for block in 0..3 {
                players[1].skip(64, &state, 64 * block);
            }
            assert!((players[0].position - players[1].position).abs() < 1e-9);
            assert_eq!(players[0].cell.load(1), players[1].cell.load(1));
        }
    }
}

#[test]
fn a_resampled_tone_is_a_tone_and_nothing_folds_back() {
    for pitch in [0.5, 0.8, 1.3, 2.0, 3.7] {
        let state = state(|state| state.pitch = pitch);
        // 0.06 of the rate, and a tone that a pitch of 2 or more moves beyond half the rate.
        let step = 0.06 * std::f32::consts::TAU / pitch.max(1.0);
        let heard = run(
            &mut player(tone(step, 40_000), None, [0, 0]),
            &state,
            &mut 0,
            8000,
        );
        // Amplitude and frequency: x[n−1] + x[n+1] = 2 cos(step) x[n] of a tone; the rest is error.
        let factor = 2.0 * (f64::from(step) * f64::from(pitch)).cos();
        let rest = heard[100..]
            .windows(3)
            .map(|w| (f64::from(w[0]) + f64::from(w[2]) - factor * f64::from(w[1])).abs());
        let worst = rest.fold(0.0, f64::max);
        // Side lobes of −80 dB, and straight lines between 128 values from one zero crossing to the next.
        assert!(worst < 2e-3, "pitch {pitch}: {worst}");
        let peak = heard[100..]
            .iter()
            .fold(0.0f32, |most, s| most.max(s.abs()));
        assert!((peak - 1.0).abs() < 5e-3, "pitch {pitch}: {peak}");
    }
    // The transition of the kernel ends at 1.64 times half the narrowed rate.
    let state = state(|state| state.pitch = 4.0);
    let step = 0.45 * std::f32::consts::TAU;
    let heard = run(
        &mut player(tone(step, 40_000), None, [0, 0]),
        &state,
        &mut 0,
        4000,
    );
    let peak = heard[100..]
        .iter()
        .fold(0.0f32, |most, s| most.max(s.abs()));
    assert!(peak < 1e-3, "{peak}");
}

#[test]
fn pause_seek_and_pitch_have_no_step() {
    let step = 0.05;
    let plain = PlayState::default();
    let changes = [
        state(|state| state.is_paused = true),
        state(|state| state.pitch = 1.5),
        state(|state| state.pitch = 0.25),
        state(|state| (state.seek, state.seek_serial, state.seek_to) = (1, 1, 1033)),
    ];
    let whole = tone(step, 60_000);
    for change in changes {
        let mut player = player(whole.clone(), None, [0, 0]);
        let mut now = 0;
        let mut heard = run(&mut player, &plain, &mut now, 500);
        assert_eq!(heard, whole[..500]);
        heard.extend(run(&mut player, &change, &mut now, 1600));
        if change.is_paused {
            assert_eq!(player.cell.load(1).state, PlaybackState::Paused);
            assert_eq!(heard.last(), Some(&0.0));
        }
        let back = PlayState {
            pitch: 1.0,
            is_paused: false,
            ..change
        };
        heard.extend(run(&mut player, &back, &mut now, 3200));
        // The tone's slope at the highest pitch; a fade of both signals has 1.5 of its change over its length.
        let fade = 2.0 * 1.5 / FADE_FRAMES as f32;
        let slope = step * change.pitch.max(1.0) + fade;
        assert!(steepest(&heard) < slope, "{change:?}: {}", steepest(&heard));
        assert!(heard[heard.len() - 200..].iter().any(|s| s.abs() > 0.9));
    }
}

#[test]
fn a_seek_of_another_playback_has_no_effect_and_a_clip_reports_its_end() {
    let other = state(|state| (state.seek, state.seek_serial, state.seek_to) = (1, 2, 50));
    let whole = tone(0.1, 100);
    let mut player = player(whole.clone(), None, [0, 0]);
    let mut now = 0;
    let heard = run(&mut player, &other, &mut now, 64);
    assert_eq!(heard, whole[..64]);
    let playing = Playback {
        state: PlaybackState::Playing,
        frame: 64,
    };
    assert_eq!(player.cell.load(1), playing);
    assert_eq!(player.cell.load(2).state, PlaybackState::Scheduled);
    assert_eq!(player.cell.load(0).state, PlaybackState::Idle);
    run(&mut player, &other, &mut now, 64);
    assert_eq!(player.cell.load(1).state, PlaybackState::Finished);
    let again = state(|state| (state.seek, state.seek_serial, state.seek_to) = (2, 1, 0));
    run(&mut player, &again, &mut now, 64);
    assert_eq!(player.cell.load(1).state, PlaybackState::Playing);
}

#[test]
fn stereo_is_a_mean_and_half_a_difference() {
    let cell = Arc::new(PlaybackCell::default());
    let clip = Clip::stereo(vec![1.0, 0.0, 0.5, -0.5]);
    let kernel = Arc::new(Kernel::new());
    let mut player = ClipPlayer::new(clip, None, [0, 0], 1, cell, kernel);
    let (mut middle, mut others) = ([9.0; 3], [[9.0; 3]; OTHERS]);
    let rest = others.each_mut().map(|other| &mut other[..]);
    let signals = player.fill(&mut middle, rest, &PlayState::default(), 0);
    assert_eq!(signals, 2);
    let side = others[0];
    assert_eq!((middle, side), ([0.5, 0.0, 0.0], [0.5, 0.5, 0.0]));
}
