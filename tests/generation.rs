//! Laws of the generation stage, measured at its output.

use std::f64::consts::TAU;

use foresound::extrapolation::{FramePath, FramePaths, LATE_GROUPS, LateGroup, LateSend};
use foresound::generation::{Generator, GeneratorSettings};
use foresound::scene::SourceId;
use glam::{Quat, Vec3};

mod reference;
use reference::generators::{
    RAMP, SPEED_M_S, energy, frame, generator, generator_with_built_in_head, largest_step, noise,
    path, run, settings, tone,
};

#[test]
fn pass_by_has_the_doppler_shift_of_its_geometry() {
    // 20 m/s along a line 5 m away, at the listener's height; a tone, with a phase at every zero crossing.
    const HZ: f64 = 1000.0;
    for rate_hz in [44_100u32, 48_000] {
        let rate = f64::from(rate_hz);
        let frame_s = f64::from(RAMP) / rate;
        let delay_s =
            |time_s: f64| (5f64.powi(2) + (20.0 * (time_s - 2.0)).powi(2)).sqrt() / SPEED_M_S;
        let mut generator = generator(settings(rate_hz));
        let frames = (0..(4.0 / frame_s) as usize).map(|k| {
            // A frame holds the state at its end.
            let end_s = (k + 1) as f64 * frame_s;
            frame(vec![path(7, 1.0, delay_s(end_s), Vec3::NEG_Z)])
        });
        let [left, _] = run(&mut generator, frames, |start| {
            tone(HZ, rate, start, RAMP as usize)
        });

        // Amplitude ahead is 1 (the synthetic head's weights sum to one at low frequencies, near one here).
        let settled = (0.3 * rate) as usize;
        let crossings: Vec<f64> = (settled..left.len() - 1)
            .filter(|&n| left[n] < 0.0 && left[n + 1] >= 0.0)
            .map(|n| n as f64 + f64::from(left[n]) / f64::from(left[n] - left[n + 1]))
            .collect();
        let mut worst = 0.0f64;
        // 20 periods are 20 ms, one and a half graphics frames: within one the delay is a straight line, whose slope
        // is the geometry's mean over the frame.
        let lag_s = generator.latency_frames() as f64 / rate;
        for span in crossings.windows(21) {
            let (from_s, to_s) = (span[0] / rate - lag_s, span[20] / rate - lag_s);
            let phase = |t: f64| HZ * (t - delay_s(t));
            let exact = (phase(to_s) - phase(from_s)) / (to_s - from_s);
            let measured = 20.0 / (to_s - from_s);
            worst = worst.max((measured / exact - 1.0).abs());
        }
        println!("{rate_hz} Hz: pitch within {:.5} %", 100.0 * worst);
        assert!(worst < 0.001);

        let peak = left[settled..].iter().fold(0.0f32, |m, s| m.max(s.abs()));
        // The steepest slope of the tone at the highest pitch, one percent for the interpolator and rounding.
        let steepest = f64::from(peak) * TAU * HZ * (1.0 + 20.0 / SPEED_M_S) / rate * 1.01;
        assert!(f64::from(largest_step(&left[settled..])) < steepest);
    }
}

/// Sixteen louder paths of a silent source leave whole frames to a path: its ears are off by half a frame at most, whether its
/// direction and delay change or not, and nothing steps. With four it has exact delays.
#[test]
fn a_quiet_path_reaches_each_ear_within_half_a_frame() {
    const HZ: f64 = 500.0;
    const RATE_HZ: f64 = 44_100.0;
    for (turn, delay_growth_s) in [(0.0, 0.0), (0.013, 0.0), (0.013, 2e-5), (0.0, -2e-5)] {
        let ears = |louder: u64| {
            let settings = GeneratorSettings {
                fine_voices: 4,
                ..settings(44_100)
            };
            let mut generator = generator_with_built_in_head(settings);
            let frames = (0..60).map(|k| {
                let k = f64::from(k);
                let angle = (0.7 + turn * k) as f32;
                let arrival = Vec3::new(angle.sin(), 0.1, -angle.cos()).normalize();
                let louder = (0..louder).map(|id| FramePath {
                    source: SourceId::new(1, 0),
                    ..path(100 + id, 1.0, 0.02, Vec3::NEG_Z)
                });
                let quiet = path(7, 0.3, 0.01 + delay_growth_s * k, arrival);
                frame([quiet].into_iter().chain(louder).collect())
            });
            run(&mut generator, frames, |start| {
                tone(HZ, RATE_HZ, start, RAMP as usize)
            })
        };
        let (exact, whole) = (ears(4), ears(16));
        let mut most = 0.0f64;
        for (exact, whole) in exact.iter().zip(&whole) {
            let settled = 4 * RAMP as usize;
            let (exact, whole) = (&exact[settled..], &whole[settled..]);
            let off: Vec<f32> = exact.iter().zip(whole).map(|(a, b)| a - b).collect();
            let off = (energy(&off) / energy(exact)).sqrt();
            // The phase of half a frame, and 1 % of it for gains that are held and rounding.
            assert!(off < TAU * HZ * 0.5 / RATE_HZ * 1.01, "{off}");
            most = most.max(off);
            // The steepest slope of the tone where the delay shrinks and an ear's delay changes by a whole frame in a ramp.
            let peak = whole.iter().fold(0.0f32, |most, s| most.max(s.abs()));
            let slope = TAU * HZ / RATE_HZ * (1.0 + 1e-2);
            assert!(f64::from(largest_step(whole)) < f64::from(peak) * slope);
        }
        assert!(most > 1e-3, "whole frames are in use: {most}");
    }
}

#[test]
fn impulse_arrives_after_delay_ear_and_latency() {
    for rate_hz in [44_100u32, 48_000] {
        let rate = f64::from(rate_hz);
        let mut generator = generator(settings(rate_hz));
        generator.set_frame(&frame(vec![path(1, 0.5, 1000.0 / rate, Vec3::NEG_X)]), 1);
        let mut output = vec![0.0; 2 * 4096];
        generator.render(&[&[0.0; 4096]], &mut output);
        let mut impulse = vec![0.0; 4096];
        impulse[0] = 1.0;
        generator.render(&[&impulse], &mut output);
        // The left ear faces the source: its delay is zero and its response 2 δ − low-pass; the allpass of the bands
        // disperses, so the law is about the onset and the sum.
        let left: Vec<f64> = output
            .chunks_exact(2)
            .map(|pair| f64::from(pair[0]))
            .collect();
        let onset = 1000 + generator.latency_frames();
        let peak = left.iter().fold(0.0f64, |m, s| m.max(s.abs()));
        assert!(left[..onset - 3].iter().all(|s| s.abs() < 1e-6 * peak));
        let first = left.iter().position(|s| s.abs() > 0.1 * peak).unwrap();
        assert!(first.abs_diff(onset) <= 1, "{first} against {onset}");
        // The gain at 0 Hz: amplitude 0.5, weights sum to one; the slowest band's ringing is cut off at −60 dB.
        let sum: f64 = left.iter().sum();
        assert!((sum - 0.5).abs() < 1e-3, "{sum}");
    }
}

#[test]
fn source_on_the_left_is_louder_and_earlier_at_the_left_ear() {
    let mut generator = generator(settings(44_100));
    let noise = noise(RAMP as usize);
    let [left, right] = run(
        &mut generator,
        (0..20).map(|_| frame(vec![path(1, 1.0, 0.01, Vec3::NEG_X)])),
        |_| noise.clone(),
    );
    let (left, right) = (&left[4000..], &right[4000..]);
    let level_db = 10.0 * (energy(left) / energy(right)).log10();
    // The far ear has a one-pole low-pass of 5.6 frames, h(0) = 0.164, the near ear two minus it: white noise at powers of
    // 0.09 and 3.4, 15.8 dB apart. Interpolation and bands may change either ear by less than 3 dB.
    assert!(level_db > 10.0, "{level_db}");
    let best = (-60i64..=60)
        .max_by_key(|&lag| {
            let sum: f64 = (100..5000)
                .map(|n| f64::from(left[n]) * f64::from(right[(n as i64 + lag) as usize]))
                .sum();
            (1e3 * sum) as i64
        })
        .unwrap();
    // Woodworth's 0.656 ms are 28.9 frames; the shadow's low-pass adds up to its time constant of 5.6 frames.
    assert!((29..=35).contains(&best), "{best}");
}

#[test]
fn turning_the_head_is_continuous() {
    let mut generator = generator(settings(44_100));
    // A turn in 1.6 s.
    let frames = (0..150).map(|k| FramePaths {
        orientation: Quat::from_rotation_y((f64::from(k) * TAU / 120.0) as f32),
        paths: vec![path(1, 1.0, 0.02, Vec3::new(0.3, 0.2, -0.9).normalize())],
        ..FramePaths::default()
    });
    let ears = run(&mut generator, frames, |start| {
        tone(200.0, 44_100.0, start, RAMP as usize)
    });
    for ear in ears {
        let ear = &ear[5000..];
        let peak = ear.iter().fold(0.0f32, |m, s| m.max(s.abs()));
        // A tone of this peak, one percent for the Doppler of the turning ear and the changing weights.
        let steepest = f64::from(peak) * TAU * 200.0 / 44_100.0 * 1.01;
        assert!(f64::from(largest_step(ear)) < steepest);
    }
}

#[test]
fn full_turn_returns_to_the_same_sound() {
    let held = |turns: u32| {
        let mut generator = generator(settings(44_100));
        let frames = (0..=turns + 20).map(|k| FramePaths {
            orientation: Quat::from_rotation_y((f64::from(k.min(turns)) * TAU / 40.0) as f32),
            paths: vec![path(1, 1.0, 0.02, Vec3::X)],
            ..FramePaths::default()
        });
        let ears = run(&mut generator, frames, |start| {
            tone(300.0, 44_100.0, start % 147, RAMP as usize)
        });
        ears[0][ears[0].len() - 588..].to_vec()
    };
    // The angle is rounded after a turn: 2π in f32 is off by 1.7e-7.
    let still = held(0);
    assert!(energy(&still) > 1.0);
    for (a, b) in still.iter().zip(held(40)) {
        assert!((a - b).abs() < 1e-5);
    }
}

#[test]
fn births_deaths_and_jumps_do_not_click() {
    let mut generator = generator(settings(44_100));
    let frames = (0..60).map(|k| {
        let mut paths = Vec::new();
        if k / 7 % 2 == 0 {
            paths.push(path(3, 1.0, 0.011, Vec3::NEG_Z));
        }
        // Jumps by 60 ms every fifth frame.
        let delay_s = if k / 5 % 2 == 0 { 0.02 } else { 0.08 };
        paths.push(path(9, 1.0, delay_s, Vec3::NEG_Z));
        frame(paths)
    });
    let [left, _] = run(&mut generator, frames, |start| {
        tone(150.0, 44_100.0, start, RAMP as usize)
    });
    // A third of a second of a tone of amplitude one and power one half.
    assert!(energy(&left) > 0.5 * 44_100.0 / 3.0);
    // Two voices of amplitude one, and ramps of at most three in all at once: slope of the tone, and one ramp each.
    let steepest = 2.0 * TAU * 150.0 / 44_100.0 + 3.0 / f64::from(RAMP);
    assert!(f64::from(largest_step(&left)) < steepest * 1.01);
}

/// Level of the late reverb at the ears, in dB re the level that the send requests.
fn late_level_db(mut generator: Generator) -> f64 {
    generator.set_frame(
        &FramePaths {
            late: vec![LateSend {
                source: SourceId::new(0, 0),
                group: 0,
                energy_per_s: [2.0; 8],
                start_s: 0.06,
            }],
            late_groups: [LateGroup::isotropic([1.0; 8]); LATE_GROUPS],
            ..FramePaths::default()
        },
        1,
    );
    // Below 5 kHz, where the interpolator is flat; long enough for the late reverb to settle and its modes to even out.
    let input: Vec<f32> = noise(6 * 44_100)
        .windows(6)
        .map(|window| window.iter().sum())
        .collect();
    let mut output = vec![0.0; 2 * input.len()];
    generator.render(&[&input], &mut output);
    let settled = &output[2 * 2 * 44_100..];
    let heard = energy(settled) / settled.len() as f64;
    let sent = energy(&input) / input.len() as f64;
    // Steady state: E T / (6 ln 10) 10^(−6 start / T) of the input's power reach a point.
    10.0 * (heard / (sent * 2.0 / 13.8155 * 10f64.powf(-0.36))).log10()
}

#[test]
fn late_reverb_reaches_an_ear_with_the_energy_of_its_send() {
    let settings = GeneratorSettings {
        late: true,
        ..settings(44_100)
    };
    // The mean power of the built-in set over all directions is flat, over those of the waves it is not quite.
    let synthetic_db = late_level_db(generator(settings.clone()));
    let built_in_db = late_level_db(generator_with_built_in_head(settings));
    println!("late reverb at an ear: {synthetic_db:.2} dB synthetic, {built_in_db:.2} dB built in");
    assert!(synthetic_db.abs() < 0.7 && built_in_db.abs() < 1.0);
}

#[test]
fn built_in_hrtf_sets_have_left_on_the_left() {
    for rate_hz in [44_100, 48_000] {
        let mut generator = generator_with_built_in_head(settings(rate_hz));
        let noise = noise(RAMP as usize);
        let [left, right] = run(
            &mut generator,
            (0..20).map(|_| frame(vec![path(1, 1.0, 0.01, Vec3::NEG_X)])),
            |_| noise.clone(),
        );
        let level_db = 10.0 * (energy(&left[4000..]) / energy(&right[4000..])).log10();
        // assets/hrtf/README.md: 15 dB of energy.
        assert!((level_db - 15.0).abs() < 1.5, "{level_db}");
    }
}
