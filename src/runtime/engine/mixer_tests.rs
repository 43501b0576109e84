//! Sources that start, end and change slots.

use std::sync::Arc;

use super::*;
use crate::runtime::engine::clip_player::{Clip, ClipPlayer, Kernel};
use crate::runtime::engine::playback::PlaybackCell;

const BLOCK: usize = 64;

fn route(index: u16, slot: u16, gain: f32) -> SourceRoute {
    let id = SourceId::new(index, 0);
    SourceRoute {
        id,
        slot,
        gain,
        ramp_s: 0.0,
        play: PlayState::default(),
    }
}

fn clip(samples: Vec<f32>, is_looped: bool) -> SampleSource {
    let looped = is_looped.then_some([0, samples.len()]);
    let (cell, kernel) = (Arc::new(PlaybackCell::default()), Arc::new(Kernel::new()));
    let player = ClipPlayer::new(Clip::mono(samples), looped, [0, 0], 1, cell, kernel);
    SampleSource::Clip(Box::new(player))
}

fn mixer(sources: u16) -> Mixer {
    let mut mixer = Mixer::new(usize::from(sources), [2, 2], BLOCK, 44_100);
    for index in 0..sources {
        let feed = clip(vec![1.0; 100], true);
        let id = SourceId::new(index, 0);
        mixer.replace(SampleSourceChange { id, source: feed });
    }
    mixer
}

/// The last sample of each slot after a block.
fn mixed(mixer: &mut Mixer) -> [f32; 2] {
    mixer.mix(BLOCK);
    let mut inputs: [&[f32]; 2] = [&[]; 2];
    mixer.inputs(BLOCK, &mut inputs);
    inputs.map(|input| input.last().copied().unwrap_or(0.0))
}

#[test]
fn a_slot_change_cross_fades_without_loss() {
    let mut mixer = mixer(1);
    mixer.set_routes(&[route(0, 0, 1.0)]);
    assert_eq!(mixed(&mut mixer), [1.0, 0.0]);
    mixer.set_routes(&[route(0, 1, 1.0)]);
    let mut last = 1.0;
    let mut blocks = 0;
    while last > 0.0 {
        let [old, new] = mixed(&mut mixer);
        // The slope is 1.5 times that of a line of 50 ms.
        let most = 1.5 * BLOCK as f32 / (0.05 * 44_100.0) + f32::EPSILON;
        assert!(old < last && last - old < most, "{last} to {old}");
        assert!((old + new - 1.0).abs() < 1e-5);
        last = old;
        blocks += 1;
    }
    // 50 ms.
    assert_eq!(blocks, (0.05f32 * 44_100.0 / BLOCK as f32).ceil() as u32);
    assert_eq!(mixed(&mut mixer), [0.0, 1.0]);
}

#[test]
fn sources_share_a_slot_and_inaudible_ones_advance() {
    let mut mixer = mixer(3);
    mixer.set_routes(&[route(0, 1, 0.5), route(1, 1, 0.25), route(2, NO_SLOT, 1.0)]);
    assert_eq!(mixed(&mut mixer), [0.0, 0.75]);
    let SampleSource::Clip(player) = &mixer.sources[2].samples else {
        panic!("a clip");
    };
    assert_eq!(player.frame_position(), BLOCK as u64);
    mixer.set_routes(&[route(0, 1, 0.5)]);
    // The other source fades.
    let [_, first] = mixed(&mut mixer);
    assert!(first > 0.5 && first < 0.75, "{first}");
    (1..RELEASE_FRAMES / BLOCK).for_each(|_| {
        mixed(&mut mixer);
    });
    assert_eq!(mixed(&mut mixer), [0.0, 0.5]);
    mixer.set_routes(&[]);
    (0..RELEASE_FRAMES / BLOCK).for_each(|_| {
        mixed(&mut mixer);
    });
    assert_eq!(mixed(&mut mixer), [0.0, 0.0]);
}

#[test]
fn a_removed_sound_ends_without_a_step() {
    for how in 0..3 {
        let mut mixer = mixer(1);
        mixer.set_routes(&[route(0, 0, 0.5)]);
        assert_eq!(mixed(&mut mixer), [0.5, 0.0]);
        let id = SourceId::new(0, 0);
        match how {
            // Removed, stopped, or replaced by another sound with a soft start.
            0 => mixer.set_routes(&[]),
            1 => drop(mixer.replace(SampleSourceChange {
                id,
                source: SampleSource::Silence,
            })),
            _ => drop(mixer.replace(SampleSourceChange {
                id,
                source: clip(vec![0.0; 100], true),
            })),
        }
        let mut last = 0.5;
        for _ in 0..RELEASE_FRAMES / BLOCK + 1 {
            mixer.mix(BLOCK);
            let mut inputs: [&[f32]; 2] = [&[]; 2];
            mixer.inputs(BLOCK, &mut inputs);
            for n in 0..BLOCK {
                let next = inputs[0].get(n).copied().unwrap_or(0.0);
                // A cubic's steepest step is 1.5 times a line's.
                assert!(next <= last && last - next <= 0.76 / RELEASE_FRAMES as f32);
                last = next;
            }
        }
        assert_eq!(last, 0.0);
    }
}

/// The greatest step between two samples of either slot.
fn steepest(mixer: &mut Mixer, last: &mut [f32; 2], blocks: usize) -> f32 {
    let mut steepest = 0.0f32;
    for _ in 0..blocks {
        mixer.mix(BLOCK);
        let mut inputs: [&[f32]; 2] = [&[]; 2];
        mixer.inputs(BLOCK, &mut inputs);
        for (last, input) in last.iter_mut().zip(inputs) {
            for n in 0..BLOCK {
                let next = input.get(n).copied().unwrap_or(0.0);
                steepest = steepest.max((next - *last).abs());
                *last = next;
            }
        }
    }
    steepest
}

#[test]
fn a_source_that_changes_or_ends_during_a_fade_fades() {
    let smooth = 1.52 / RELEASE_FRAMES as f32;
    for goes in [false, true] {
        let mut mixer = mixer(1);
        let mut last = [0.0; 2];
        mixer.set_routes(&[route(0, 0, 1.0)]);
        steepest(&mut mixer, &mut last, 1);
        // Without a slot for ten blocks of a cross-fade of thirty-five, then in another slot.
        mixer.set_routes(&[route(0, NO_SLOT, 1.0)]);
        assert!(steepest(&mut mixer, &mut last, 10) < smooth);
        mixer.set_routes(&[route(0, 1, 1.0)]);
        assert!(steepest(&mut mixer, &mut last, 40) < smooth);
        assert!(last[0] == 0.0 && last[1] > 0.1, "{last:?}");
        let routes: &[SourceRoute] = if goes { &[] } else { &[route(0, 0, 1.0)] };
        mixer.set_routes(routes);
        assert!(steepest(&mut mixer, &mut last, 80) < smooth);
        assert_eq!(last, if goes { [0.0; 2] } else { [1.0, 0.0] });
    }
}

#[test]
fn sounds_that_end_one_after_the_other_all_fade() {
    let mut mixer = mixer(1);
    let mut last = [0.0; 2];
    mixer.set_routes(&[route(0, 0, 1.0)]);
    steepest(&mut mixer, &mut last, 1);
    let id = SourceId::new(0, 0);
    let rising: Vec<f32> = (0..640).map(|n| n as f32 / 640.0).collect();
    let feed = clip(rising, false);
    mixer.replace(SampleSourceChange { id, source: feed });
    let smooth = 1.52 / RELEASE_FRAMES as f32 + 1.0 / 640.0;
    assert!(steepest(&mut mixer, &mut last, 2) < smooth);
    let feed = SampleSource::Silence;
    mixer.replace(SampleSourceChange { id, source: feed });
    assert!(steepest(&mut mixer, &mut last, 5) < smooth);
    assert_eq!(last, [0.0; 2]);
}

#[test]
fn levels_and_fades_have_no_kinks() {
    let mut mixer = mixer(1);
    mixer.set_routes(&[route(0, 0, 1.0)]);
    mixed(&mut mixer);
    let mut last = [[1.0, 0.0]; 2];
    let mut sharpest = 0.0f32;
    // Eight times the gain, another slot, silence, and back, one frame each: as when a scene is replaced.
    for to in [
        route(0, 0, 8.0),
        route(0, 1, 8.0),
        route(0, 1, 0.0),
        route(0, 0, 1.0),
    ] {
        mixer.set_routes(&[to]);
        for _ in 0..40 {
            mixer.mix(BLOCK);
            let mut inputs: [&[f32]; 2] = [&[]; 2];
            mixer.inputs(BLOCK, &mut inputs);
            for n in 0..BLOCK {
                let next = inputs.map(|input| input.get(n).copied().unwrap_or(0.0));
                for slot in 0..2 {
                    let kink = next[slot] - 2.0 * last[1][slot] + last[0][slot];
                    sharpest = sharpest.max(kink.abs());
                }
                last = [last[1], next];
            }
        }
    }
    // A line over a block has a kink of 1/8, one over 50 ms a kink of 1/280.
    assert!(sharpest < 5e-4, "{sharpest}");
    assert_eq!(last[1], [1.0, 0.0]);
}
