//! Situations of the generation stage, measured at its output: splits, limits, invalid input.
#![expect(clippy::unwrap_used, reason = "a helper's failure is the test's")]

use std::sync::Arc;

use foresound::extrapolation::{FramePath, FramePaths, LATE_GROUPS, LateGroup, LateSend};
use foresound::generation::{BlockReport, Generator, GeneratorSettings, Hrtf};
use foresound::scene::SourceId;
use glam::{Quat, Vec3};

mod reference;
use reference::generators::{
    RAMP, busy, energy, frame, generator, largest_step, noise, path, settings, tone,
};
use reference::synthetic_hrtf;

/// Sound of [`busy`] with calls of the given sizes in turn; a frame every [`RAMP`].
fn busy_sound(sizes: &[usize], limiter: bool) -> Vec<f32> {
    let frames = 30 * RAMP as usize;
    let inputs = [noise(frames), tone(440.0, 44_100.0, 0, frames)];
    let mut generator = generator(GeneratorSettings {
        late: true,
        limiter,
        ceiling_db: -3.0,
        fine_voices: 4,
        ..settings(44_100)
    });
    let mut sound = vec![0.0; 2 * frames];
    let mut sizes = sizes.iter().cycle();
    for k in 0..30 {
        generator.set_frame(&busy(k), RAMP);
        let end = (k as usize + 1) * RAMP as usize;
        let mut start = k as usize * RAMP as usize;
        while start < end {
            let stop = end.min(start + sizes.next().unwrap());
            let inputs = [&inputs[0][start..stop], &inputs[1][start..stop]];
            generator.render(&inputs, &mut sound[2 * start..2 * stop]);
            start = stop;
        }
    }
    sound
}

#[test]
fn block_split_does_not_change_the_sound() {
    let whole = busy_sound(&[4096], false);
    assert!(energy(&whole) > 100.0);
    for sizes in [&[32][..], &[1, 3, 7, 64, 129, 5], &[256], &[481, 11]] {
        let parts = busy_sound(sizes, false);
        let worst = whole
            .iter()
            .zip(&parts)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        println!("{sizes:?}: largest difference {worst:e}");
        // Sums of some ten thousand products around 0.1, in another order only where a chunk ends.
        assert!(worst < 2e-6, "{sizes:?}: {worst}");
    }
}

#[test]
fn a_frame_that_is_prepared_in_parts_has_the_same_bits() {
    let input = noise(20 * RAMP as usize);
    let sound = |most: usize| {
        let mut generator = generator(GeneratorSettings {
            fine_voices: 4,
            max_voices: 7,
            ..settings(44_100)
        });
        let mut sound = vec![0.0; 2 * input.len()];
        let blocks = input.chunks(RAMP as usize);
        for (k, (input, output)) in (0..).zip(blocks.zip(sound.chunks_mut(2 * RAMP as usize))) {
            let frame = busy(k);
            if most == 0 {
                generator.set_frame(&frame, RAMP);
            } else {
                // Discarded: it belongs to another frame.
                generator.prepare_frame(&busy(k + 3), k as usize);
                generator.set_frame(&frame, RAMP);
                let (mut taken, mut parts) = (0, 0);
                let (before, behind) = output.split_at_mut(2 * 100);
                generator.render(&[&input[..100]], before);
                while k % 2 == 0 && taken < frame.paths.len() {
                    let is_done = generator.prepare_frame(&frame, most);
                    taken += most;
                    parts += 1;
                    assert_eq!(is_done, taken >= frame.paths.len());
                }
                assert!(k % 2 == 1 || parts == frame.paths.len().div_ceil(most));
                generator.set_prepared_frame(&frame, RAMP - 100);
                generator.render(&[&input[100..]], behind);
                continue;
            }
            let (before, behind) = output.split_at_mut(2 * 100);
            generator.render(&[&input[..100]], before);
            generator.set_frame(&frame, RAMP - 100);
            generator.render(&[&input[100..]], behind);
        }
        sound
    };
    let whole = sound(0);
    assert!(energy(&whole) > 100.0);
    for most in [1, 2, 5, 100] {
        assert_eq!(whole, sound(most), "{most}");
    }
}

#[test]
fn same_input_gives_the_same_bits() {
    assert_eq!(busy_sound(&[256], true), busy_sound(&[256], true));
}

#[test]
fn repeated_frame_changes_nothing() {
    let input = noise(16 * RAMP as usize);
    let sound = |repeats: usize| {
        let mut generator = generator(settings(44_100));
        let mut sound = vec![0.0; 2 * input.len()];
        for (k, (input, output)) in input
            .chunks(RAMP as usize)
            .zip(sound.chunks_mut(2 * RAMP as usize))
            .enumerate()
        {
            if k <= repeats {
                generator.set_frame(&busy(0), RAMP);
            }
            generator.render(&[input], output);
        }
        sound
    };
    assert_eq!(sound(0), sound(12));
}

#[test]
fn limiter_is_a_pure_delay_below_its_ceiling_and_never_passes_it() {
    let (free, limited) = (busy_sound(&[256], false), busy_sound(&[256], true));
    let peak = free.iter().fold(0.0f32, |m, s| m.max(s.abs()));
    let ceiling = 10f32.powf(-3.0 / 20.0);
    assert!(peak > ceiling);
    assert!(limited.iter().all(|s| s.abs() <= ceiling));
    let latency = |limiter| {
        generator(GeneratorSettings {
            limiter,
            ..settings(44_100)
        })
        .latency_frames()
    };
    assert_eq!(latency(true) - latency(false), 66);
    // Up to the first peak the gain is one and the limited sound is the delayed free one.
    let first = free.iter().position(|s| s.abs() > ceiling).unwrap();
    println!(
        "peak {peak}, first over the ceiling at {first} of {}",
        free.len()
    );
    assert!(first > 1000);
    let delay = 2 * 66;
    let same = first / 2 * 2;
    assert_eq!(limited[delay..same], free[..same - delay]);
}

#[test]
fn excess_and_invalid_paths_are_dropped_and_counted() {
    let mut generator = generator(GeneratorSettings {
        max_voices: 4,
        fine_voices: 2,
        ..settings(44_100)
    });
    let mut paths: Vec<FramePath> = (0..10)
        .map(|i| path(10 + i, 0.1 + 0.01 * i as f32, 0.01, Vec3::X))
        .collect();
    paths.push(path(30, 1.0, 0.7, Vec3::X));
    paths.push(FramePath {
        source: SourceId::new(5, 0),
        ..path(31, 1.0, 0.01, Vec3::X)
    });
    paths.push(path(32, f32::NAN, 0.01, Vec3::X));
    paths.push(path(33, 1.0, f64::NAN, Vec3::X));
    paths.push(path(34, 1.0, 0.01, Vec3::NAN));
    paths.push(path(9, 0.01, 0.01, Vec3::X));
    generator.set_frame(&frame(paths), 64);
    let mut output = [0.0; 2 * 256];
    let report = generator.render(&[&[1.0; 256]], &mut output);
    // Six of the ten are too quiet; then an unknown source, three that are not finite and one out of order.
    assert_eq!(
        report,
        BlockReport {
            frames: 256,
            voices: 4,
            dropped_paths: 11,
            dropped_delays: 1,
            ..BlockReport::default()
        }
    );
    assert_eq!(generator.render(&[], &mut output).dropped_paths, 0);
}

#[test]
fn all_paths_may_change_in_every_frame() {
    let mut generator = generator(settings(44_100));
    let mut output = [0.0; 2 * 64];
    let (mut late, mut last, mut steepest) = (0, 0.0f32, 0.0f32);
    for k in 0..50u64 {
        let paths = (0..32)
            .map(|i| path(100 * k + i, 0.1, 0.01, Vec3::X))
            .collect();
        generator.set_frame(&frame(paths), 64);
        let report = generator.render(&[&[0.5; 64]], &mut output);
        assert_eq!(report.dropped_paths, 0);
        assert!(report.voices <= 64);
        late += report.late_starts;
        for pair in output.chunks_exact(2) {
            steepest = steepest.max((pair[0] - last).abs());
            last = pair[0];
        }
    }
    // Fades last the ramp and the far ear's lag, a little longer than the frames here: spare voices run out.
    assert!(late > 0);
    // No fade is shortened for that: 32 paths of amplitude 0.1 and an input of 0.5 go from silence to all and back within
    // 64 frames, two sets at once.
    assert!(
        steepest <= 2.0 * 32.0 * 0.1 * 0.5 * 2.0 / 64.0,
        "{steepest}"
    );
}

#[test]
fn after_a_change_of_a_large_set_the_quieter_paths_wait_for_the_fades() {
    const PATHS: u64 = 400;
    let mut generator = generator(GeneratorSettings {
        max_voices: 512,
        ..settings(44_100)
    });
    let input = [0.5; RAMP as usize];
    let mut output = [0.0; 2 * RAMP as usize];
    let mut next = |first: u64| {
        generator.set_frame(&large_set(first, PATHS), RAMP);
        generator.render(&[&input], &mut output)
    };
    // The first set has no fades to wait for.
    let report = next(0);
    assert_eq!((report.voices, report.late_starts), (400, 0));
    // Capacity for a quarter more, and for 64.
    let mut waited = Vec::new();
    for _ in 0..4 {
        let report = next(1000);
        assert_eq!(report.dropped_paths, 0);
        assert!(report.voices <= 564, "{}", report.voices);
        waited.push(report.late_starts);
    }
    // While the old ones fade, and until the far ear has received their end.
    assert_eq!(waited, [236, 236, 0, 0]);
    assert_eq!(next(1000).voices, 400);
}

/// A frame of `paths` paths of one source with identities from `first` on, of different loudness.
fn large_set(first: u64, paths: u64) -> FramePaths {
    let loudness = |i: u64| 0.001 + 1e-5 * ((i * 37) % paths) as f32;
    frame(
        (0..paths)
            .map(|i| path(first + i, loudness(i), 0.01, Vec3::X))
            .collect(),
    )
}

#[test]
fn voices_started_a_few_at_a_time_all_sound_within_a_few_blocks_without_a_step() {
    const PATHS: u64 = 400;
    const BLOCK: usize = 256;
    // The fade of three blocks, the far ear's lag in a fourth, and 100 voices a block.
    const MOST_BLOCKS: usize = 4 + 4;
    let mut generator = generator(GeneratorSettings {
        max_voices: 512,
        ..settings(44_100)
    });
    let mut output = [0.0; 2 * BLOCK];
    let (mut last, mut steepest, mut sum) = (0.0f32, 0.0f32, 0.0);
    // The onset of the sound has passed when the first voices start.
    for _ in 0..8 {
        generator.render(&[&[0.5; BLOCK]], &mut output);
    }
    for set in 0..3 {
        generator.take_prepared_frame(&large_set(1000 * set, PATHS), 3 * BLOCK as u32);
        let mut waiting = PATHS as usize;
        for block in 0..30 {
            let before = waiting;
            waiting = generator.start_voices(100);
            assert!(before - waiting <= 100);
            let report = generator.render(&[&[0.5; BLOCK]], &mut output);
            assert!(report.voices <= PATHS as u32 + 64, "{}", report.voices);
            assert_eq!((report.dropped_paths, report.late_starts), (0, 0));
            assert!(waiting == 0 || block + 1 < MOST_BLOCKS, "{set}, {block}");
            for pair in output.chunks_exact(2) {
                steepest = steepest.max((pair[0] - last).abs());
                last = pair[0];
                sum += f64::from(last).abs();
            }
        }
        assert_eq!(
            generator.render(&[&[0.5; BLOCK]], &mut output).voices,
            PATHS as u32
        );
    }
    // All 400 rise within a block, as the set before them falls within three; an ear's weights are below one.
    let loudest: f32 = large_set(0, PATHS)
        .paths
        .iter()
        .map(|path| path.amplitude[0])
        .sum();
    assert!(
        sum > 0.0 && steepest <= 2.0 * 0.5 * loudest / BLOCK as f32,
        "{steepest}"
    );
}

#[test]
fn without_fades_voices_started_later_equal_those_started_with_the_frame() {
    let input = noise(4 * RAMP as usize);
    let sound = |apart: bool| {
        let mut generator = generator(GeneratorSettings {
            max_voices: 512,
            ..settings(44_100)
        });
        let set = large_set(0, 400);
        if apart {
            generator.take_prepared_frame(&set, RAMP);
            assert_eq!(generator.start_voices(0), 400);
            assert_eq!(generator.start_voices(150), 250);
            assert_eq!(generator.start_voices(1000), 0);
        } else {
            generator.set_frame(&set, RAMP);
        }
        let mut sound = vec![0.0; 2 * input.len()];
        generator.render(&[&input], &mut sound);
        sound
    };
    let (together, apart) = (sound(false), sound(true));
    assert!(energy(&together) > 1.0);
    // The same sum in another order: a few hundred roundings of values below 1.
    let worst = together.iter().zip(&apart).map(|(a, b)| (a - b).abs());
    let worst = worst.fold(0.0, f32::max);
    assert!(worst < 400.0 * f32::EPSILON, "{worst:e}");
}

#[test]
fn a_frame_before_all_voices_have_started_continues_from_the_started_ones() {
    const PATHS: u64 = 400;
    let mut generator = generator(GeneratorSettings {
        max_voices: 512,
        ..settings(44_100)
    });
    let mut output = [0.0; 2 * 256];
    let mut render = |generator: &mut Generator| generator.render(&[&[0.5; 256]], &mut output);
    let set = large_set(0, PATHS);
    generator.take_prepared_frame(&set, 256);
    assert_eq!(generator.start_voices(150), 250);
    assert_eq!(render(&mut generator).voices, 150);
    // The loudest have started: the next frame leaves out the waiting ones.
    let loudness = |path: &FramePath| path.amplitude[0];
    let mut all: Vec<f32> = set.paths.iter().map(loudness).collect();
    all.sort_unstable_by(|a, b| b.total_cmp(a));
    let loudest = set.paths.iter().filter(|path| loudness(path) >= all[149]);
    generator.take_prepared_frame(&frame(loudest.copied().collect()), 256);
    assert_eq!(generator.start_voices(1000), 0);
    assert_eq!(render(&mut generator).voices, 150);
    // A frame that does everything at once starts the waiting voices.
    generator.take_prepared_frame(&set, 256);
    assert_eq!(generator.start_voices(10), 240);
    generator.set_frame(&set, 256);
    assert_eq!(render(&mut generator).voices, PATHS as u32);
    // Preparing the next frame discards the waiting voices.
    generator.take_prepared_frame(&large_set(0, PATHS + 50), 256);
    generator.prepare_frame(&set, 10);
    assert_eq!(generator.start_voices(1000), 0);
    generator.set_prepared_frame(&set, 256);
    assert_eq!(render(&mut generator).voices, PATHS as u32);
}

#[test]
fn non_finite_samples_are_silence() {
    let good: Vec<f32> = noise(2048);
    let (mut holed, mut bad) = (good.clone(), good);
    for (index, value) in [
        (100, f32::NAN),
        (900, f32::INFINITY),
        (901, -3e38),
        (1700, 1e30),
    ] {
        holed[index] = 0.0;
        bad[index] = value;
    }
    let sound = |input: &[f32]| {
        let mut generator = generator(GeneratorSettings {
            late: true,
            limiter: true,
            ..settings(44_100)
        });
        generator.set_frame(&busy(1), RAMP);
        let mut output = vec![0.0; 2 * input.len()];
        let report = generator.render(&[input], &mut output);
        (output, report.non_finite)
    };
    let ((expected, none), (heard, counted)) = (sound(&holed), sound(&bad));
    assert_eq!((none, counted), (0, 4));
    assert_eq!(expected, heard);
}

#[test]
fn invalid_frames_give_finite_sound() {
    let mut generator = generator(GeneratorSettings {
        late: true,
        ..settings(44_100)
    });
    let mut output = [1.0; 2 * 300];
    generator.set_frame(
        &FramePaths {
            orientation: Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0),
            late: vec![LateSend {
                source: SourceId::new(0, 0),
                group: 0,
                energy_per_s: [f32::NAN, f32::INFINITY, -1.0, 0.0, 1.0, 1.0, 1.0, 1.0],
                start_s: f32::NAN,
            }],
            late_groups: [LateGroup::isotropic([f32::NAN, -1.0, 0.0, 1e9, 1.0, 1.0, 1.0, 1.0]);
                LATE_GROUPS],
            ..FramePaths::default()
        },
        0,
    );
    let report = generator.render(&[&[0.5; 100], &[], &[1.0; 300]], &mut output);
    assert_eq!(report.non_finite, 0);
    assert!(output.iter().all(|s| s.is_finite()));
    generator.render(&[], &mut []);
    let mut odd = [1.0; 7];
    assert_eq!(generator.render(&[], &mut odd).frames, 3);
    assert_eq!(odd[6], 0.0);
}

#[test]
fn a_reused_slot_does_not_play_its_last_source() {
    let mut generator = generator(settings(44_100));
    let mut output = vec![0.0; 2 * 4096];
    generator.set_frame(&frame(vec![path(1, 1.0, 0.1, Vec3::X)]), 64);
    generator.render(&[&noise(4096)], &mut output);
    let next = FramePath {
        source: SourceId::new(0, 1),
        ..path(2, 1.0, 0.06, Vec3::X)
    };
    generator.set_frame(&frame(vec![next]), 64);
    generator.render(&[&[]], &mut output);
    // The old path has faded within the ramp and the ear's lag; filters behind the buses ring for their 128 taps.
    assert!(output[2 * 300..].iter().all(|&s| s.abs() < 1e-12));
}

#[test]
fn a_new_owner_whose_sound_plays_already_begins_without_a_step() {
    let mut generator = generator(settings(44_100));
    let frames = 4 * RAMP as usize;
    let mut output = vec![0.0; 2 * frames];
    generator.set_frame(&frame(vec![path(1, 1.0, 0.01, Vec3::X)]), RAMP);
    generator.render(&[&[]], &mut output);
    // The new owner is hidden: it plays before a frame has a path of it, which is longer than the ramp.
    // A quarter of a period early, so that the frame comes at a peak.
    let sound = tone(150.0, 44_100.0, 73, 2 * frames);
    generator.set_frame(&frame(Vec::new()), RAMP);
    generator.render(&[&sound[..frames]], &mut output);
    let next = FramePath {
        source: SourceId::new(0, 1),
        ..path(2, 1.0, 0.04, Vec3::X)
    };
    generator.set_frame(&frame(vec![next]), RAMP);
    generator.render(&[&sound[frames..]], &mut output);
    for channel in 0..2 {
        let ear: Vec<f32> = output.iter().skip(channel).step_by(2).copied().collect();
        assert!(energy(&ear) > 1.0);
        // The slope of the tone at an ear, twice for the allpasses of the bands, and the fade's over 256 frames.
        let steepest = 2.0 * std::f32::consts::TAU * 150.0 / 44_100.0 + 1.5 / 256.0;
        let step = largest_step(&ear);
        assert!(step < steepest, "{step} {steepest}");
    }
}

#[test]
fn a_path_shorter_than_the_filter_of_the_air_reads_nothing_that_is_not_written_yet() {
    // Without Doppler shift the delay of a distant source is zero and its way through the air long.
    let sound = |delay_s: f64| {
        let mut generator = generator(settings(44_100));
        let far = FramePath {
            air_delay_s: 0.3,
            ..path(1, 1.0, delay_s, Vec3::X)
        };
        let frame = FramePaths {
            high_air_np_per_s: [30.0; 4],
            ..frame(vec![far])
        };
        generator.set_frame(&frame, RAMP);
        let input = noise(4 * RAMP as usize);
        let mut output = vec![0.0; 2 * input.len()];
        generator.render(&[&input], &mut output);
        output
    };
    // The filter's delay of four frames is the shortest.
    let shortest = sound(4.0 / 44_100.0);
    assert!(energy(&shortest) > 1.0);
    assert!(sound(0.0) == shortest, "the sounds differ");
}

#[test]
fn sound_decays_to_exact_silence() {
    let mut generator = generator(GeneratorSettings {
        late: true,
        ..settings(44_100)
    });
    let mut output = vec![0.0; 2 * 4096];
    generator.set_frame(&busy(1), 64);
    generator.render(&[&noise(4096)], &mut output);
    // 1.5 s of decay time take 4.5 s to 180 dB below.
    for _ in 0..60 {
        generator.render(&[], &mut output);
    }
    assert!(output.iter().all(|&s| s == 0.0));
}

#[test]
fn settings_out_of_range_are_errors_with_advice() {
    let hrtf = Arc::new(Hrtf::parse(&synthetic_hrtf::bytes(44_100), "synthetic").unwrap());
    for (name, wrong) in [
        (
            "rate_hz",
            GeneratorSettings {
                rate_hz: 48_000,
                ..settings(44_100)
            },
        ),
        (
            "rate_hz",
            GeneratorSettings {
                rate_hz: 8_000,
                ..settings(44_100)
            },
        ),
        (
            "max_sources",
            GeneratorSettings {
                max_sources: 0,
                ..settings(44_100)
            },
        ),
        (
            "max_voices",
            GeneratorSettings {
                max_voices: 0,
                ..settings(44_100)
            },
        ),
        (
            "max_delay_s",
            GeneratorSettings {
                max_delay_s: f64::NAN,
                ..settings(44_100)
            },
        ),
        (
            "ceiling_db",
            GeneratorSettings {
                ceiling_db: 3.0,
                ..settings(44_100)
            },
        ),
    ] {
        let error = Generator::new(wrong, Arc::clone(&hrtf))
            .unwrap_err()
            .to_string();
        assert!(error.starts_with(name), "{error}");
    }
}
