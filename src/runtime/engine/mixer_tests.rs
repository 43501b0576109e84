//! What is heard of sounds that come, go and change slots.

use super::*;

const BLOCK: usize = 64;

fn place(number: u16, slot: u16, gain: f32) -> FeedPlace {
    let id = SourceId::new(number, 0);
    FeedPlace { id, slot, gain }
}

fn mixer(sources: u16) -> Mixer {
    let mut mixer = Mixer::new(usize::from(sources), 2, BLOCK, 44_100);
    for number in 0..sources {
        let feed = Feed::Clip {
            samples: vec![1.0; 100].into(),
            next: 0,
            looped: true,
        };
        let id = SourceId::new(number, 0);
        mixer.change(FeedChange { id, feed });
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
fn a_change_of_slots_is_a_fade_that_loses_nothing() {
    let mut mixer = mixer(1);
    mixer.place(&[place(0, 0, 1.0)]);
    assert_eq!(mixed(&mut mixer), [1.0, 0.0]);
    mixer.place(&[place(0, 1, 1.0)]);
    let mut last = 1.0;
    let mut blocks = 0;
    while last > 0.0 {
        let [old, new] = mixed(&mut mixer);
        assert!(old < last && last - old < 0.03, "{last} to {old}");
        assert!((old + new - 1.0).abs() < 1e-5);
        last = old;
        blocks += 1;
    }
    // 50 ms.
    assert_eq!(blocks, (0.05f32 * 44_100.0 / BLOCK as f32).ceil() as u32);
    assert_eq!(mixed(&mut mixer), [0.0, 1.0]);
}

#[test]
fn several_share_a_slot_and_the_unheard_keep_their_place() {
    let mut mixer = mixer(3);
    mixer.place(&[place(0, 1, 0.5), place(1, 1, 0.25), place(2, NO_SLOT, 1.0)]);
    assert_eq!(mixed(&mut mixer), [0.0, 0.75]);
    let Feed::Clip { next, .. } = &mixer.seats[2].feed else {
        panic!("a clip");
    };
    assert_eq!(*next, BLOCK);
    mixer.place(&[place(0, 1, 0.5)]);
    // The other one fades.
    let [_, first] = mixed(&mut mixer);
    assert!(first > 0.5 && first < 0.75, "{first}");
    (1..TAIL_FRAMES / BLOCK).for_each(|_| {
        mixed(&mut mixer);
    });
    assert_eq!(mixed(&mut mixer), [0.0, 0.5]);
    mixer.place(&[]);
    (0..TAIL_FRAMES / BLOCK).for_each(|_| {
        mixed(&mut mixer);
    });
    assert_eq!(mixed(&mut mixer), [0.0, 0.0]);
}

#[test]
fn a_sound_that_is_taken_away_ends_without_a_step() {
    for how in 0..3 {
        let mut mixer = mixer(1);
        mixer.place(&[place(0, 0, 0.5)]);
        assert_eq!(mixed(&mut mixer), [0.5, 0.0]);
        let id = SourceId::new(0, 0);
        match how {
            // Removed, stopped, or given another sound that begins softly.
            0 => mixer.place(&[]),
            1 => drop(mixer.change(FeedChange {
                id,
                feed: Feed::Silence,
            })),
            _ => drop(mixer.change(FeedChange {
                id,
                feed: Feed::Clip {
                    samples: vec![0.0; 100].into(),
                    next: 0,
                    looped: true,
                },
            })),
        }
        let mut last = 0.5;
        for _ in 0..TAIL_FRAMES / BLOCK + 1 {
            mixer.mix(BLOCK);
            let mut inputs: [&[f32]; 2] = [&[]; 2];
            mixer.inputs(BLOCK, &mut inputs);
            for n in 0..BLOCK {
                let next = inputs[0].get(n).copied().unwrap_or(0.0);
                // A cubic's steepest step is one and a half times a line's.
                assert!(next <= last && last - next <= 0.76 / TAIL_FRAMES as f32);
                last = next;
            }
        }
        assert_eq!(last, 0.0);
    }
}

#[test]
fn the_next_tenant_of_a_seat_does_not_begin_with_the_last_ones_end() {
    let mut mixer = mixer(1);
    mixer.place(&[place(0, 0, 1.0)]);
    mixed(&mut mixer);
    let next = FeedPlace {
        id: SourceId::new(0, 1),
        ..place(0, 0, 1.0)
    };
    mixer.place(&[next]);
    assert_eq!(mixed(&mut mixer), [0.0, 0.0]);
}
