//! Decay, level and energy of the late reverb.

use super::*;
use crate::extrapolation::{LATE_GROUPS, LateGroup, LateSend};

const RATE_HZ: u32 = 44_100;
const ENERGY_PER_S: f32 = 0.4;
const START_S: f32 = 0.08;

/// Energy per frame, summed over the lines, after an impulse in one band with that band's decay time at time 0.
fn response(band: usize, t60_s: f32, other_t60_s: f32, seconds: f32) -> Vec<f64> {
    let mut reverb = LateReverb::new(RATE_HZ, 1);
    let mut line = DelayLine::new(RATE_HZ as usize);
    let mut decay_time_s = [other_t60_s; 8];
    decay_time_s[band] = t60_s;
    let frame = FramePaths {
        late: vec![LateSend {
            source: Default::default(),
            group: 0,
            energy_per_s: [ENERGY_PER_S; 8],
            start_s: START_S,
        }],
        late_groups: [LateGroup::isotropic(decay_time_s); LATE_GROUPS],
        ..FramePaths::default()
    };
    // Without the correction, which mixes bands of unequal gain: the law holds for one band's gain.
    let correction = BandCorrection::none();
    reverb.set_frame(&frame, i64::from(RATE_HZ), &correction, 0, 1);
    let mut impulse = [F32x8::ZERO; CHUNK];
    impulse[0].0[band] = 1.0;
    let mut signals: [Vec<f32>; LINES] = std::array::from_fn(|_| vec![0.0; CHUNK]);
    let mut energy = Vec::new();
    let mut now = 0;
    while energy.len() < (seconds * RATE_HZ as f32) as usize {
        line.write(
            now,
            if now == 0 {
                &impulse
            } else {
                &[F32x8::ZERO; CHUNK]
            },
        );
        let chunk = ChunkSpan {
            now,
            left: 0,
            frames: CHUNK,
        };
        reverb.collect(0, &line, chunk);
        if !reverb.process(0, &mut signals, 0, CHUNK) {
            signals.iter_mut().for_each(|signal| signal.fill(0.0));
        }
        energy.extend((0..CHUNK).map(|i| {
            signals
                .iter()
                .map(|signal| f64::from(signal[i]).powi(2))
                .sum::<f64>()
        }));
        now += CHUNK as i64;
    }
    energy
}

/// Backward-integrated energy (\[SCHROEDER65\]).
fn backward_integrated(energy: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut curve: Vec<f64> = energy
        .iter()
        .rev()
        .map(|e| {
            sum += e;
            sum
        })
        .collect();
    curve.reverse();
    curve
}

/// Decay time from a linear fit to the decay curve between −5 and −45 dB.
fn decay_time_s(curve: &[f64]) -> f64 {
    let points: Vec<(f64, f64)> = curve
        .iter()
        .enumerate()
        .map(|(i, e)| (i as f64 / f64::from(RATE_HZ), 10.0 * (e / curve[0]).log10()))
        .filter(|(_, db)| (-45.0..-5.0).contains(db))
        .collect();
    let n = points.len() as f64;
    let (mean_t, mean_db) = points
        .iter()
        .fold((0.0, 0.0), |(t, d), p| (t + p.0 / n, d + p.1 / n));
    let (above, below) = points.iter().fold((0.0, 0.0), |(above, below), p| {
        let t = p.0 - mean_t;
        (above + t * (p.1 - mean_db), below + t * t)
    });
    -60.0 * below / above
}

#[test]
fn every_band_decays_at_its_own_rate_from_its_own_level() {
    for (band, t60_s) in [(0, 4.0), (1, 2.0), (3, 1.0), (5, 0.6), (7, 0.3)] {
        let curve = backward_integrated(&response(band, t60_s, 1.1, 1.3 * t60_s + 0.3));
        let measured_s = decay_time_s(&curve);
        let start = (START_S * RATE_HZ as f32) as usize;
        // The energy after the start of the late reverb is E T / (6 ln 10) 10^(−6 start / T).
        let expected = f64::from(ENERGY_PER_S) * f64::from(t60_s) / 13.815_510_558
            * 10f64.powf(-6.0 * f64::from(START_S / t60_s));
        let level_db = 10.0 * (curve[start] / expected).log10();
        let later = start + RATE_HZ as usize / 10;
        let later_db =
            10.0 * (curve[later] / expected * 10f64.powf(0.6 / f64::from(t60_s))).log10();
        println!("{t60_s} s: measured {measured_s:.4} s, {level_db:.2} dB, {later_db:.2} dB");
        assert!((measured_s / f64::from(t60_s) - 1.0).abs() < 0.03);
        assert!(level_db.abs() < 0.5 && later_db.abs() < 0.5);
    }
}

#[test]
fn feedback_never_adds_energy() {
    let mut values: [F32x8; LINES] =
        std::array::from_fn(|i| F32x8(std::array::from_fn(|b| ((i * 8 + b) as f32).sin())));
    let energy = |values: &[F32x8; LINES]| {
        values
            .iter()
            .flat_map(|v| v.0)
            .map(|v| f64::from(v).powi(2))
            .sum::<f64>()
    };
    let before = energy(&values);
    mix(&mut values);
    // Twenty-five roundings of relative size 6e-8.
    assert!((energy(&values) / before - 1.0).abs() < 2e-6);
}

#[test]
fn invalid_decay_times_are_silence() {
    for t60_s in [0.0, -1.0, 0.05, f32::NAN] {
        assert!(
            response(2, t60_s, 1.0, 0.4).iter().all(|&e| e == 0.0),
            "{t60_s}"
        );
    }
}

#[test]
fn endless_decay_stays_bounded() {
    let energy = response(2, f32::INFINITY, 1.0, 4.0);
    let (early, late) = (
        energy[8820..52_920].iter().sum::<f64>(),
        energy[energy.len() - 44_100..].iter().sum::<f64>(),
    );
    assert!((late / early - 1.0).abs() < 0.1);
}

#[test]
fn a_silent_network_is_not_processed() {
    let mut reverb = LateReverb::new(RATE_HZ, 1);
    let mut signals: [Vec<f32>; LINES] = std::array::from_fn(|_| vec![0.0; CHUNK]);
    assert!(!reverb.process(0, &mut signals, 0, CHUNK));
}

#[test]
fn line_lengths_share_no_factor() {
    for rate_hz in [16_000, 44_100, 48_000] {
        let lengths = LateReverb::new(rate_hz, 1).lengths;
        for (i, a) in lengths.iter().enumerate() {
            assert!(lengths[i + 1..].iter().all(|b| b % a != 0 && a != b));
        }
    }
}

#[test]
fn a_send_depends_only_on_its_frame() {
    let taps_after = |starts: &[u32]| {
        let mut reverb = LateReverb::new(RATE_HZ, 1);
        for &start in starts {
            let frame = FramePaths {
                late: vec![LateSend {
                    source: Default::default(),
                    group: 0,
                    energy_per_s: [ENERGY_PER_S; 8],
                    start_s: START_S + 1e-4 * start as f32,
                }],
                late_groups: [LateGroup::isotropic([1.0; 8]); LATE_GROUPS],
                ..FramePaths::default()
            };
            let correction = BandCorrection::none();
            reverb.set_frame(&frame, i64::from(RATE_HZ), &correction, 0, 1);
        }
        reverb.sends.first()
    };
    let mut changing = 0;
    for end in (0..400).step_by(7) {
        let at_once = taps_after(&[end]);
        let back_and_forth = taps_after(&[900, end, 0, end]);
        let walked: Vec<u32> = (0..=end).collect();
        assert_eq!(taps_after(&walked), at_once, "{end}");
        assert_eq!(back_and_forth, at_once, "{end}");
        changing += usize::from(at_once.len() == 2);
        let [first, last] = [at_once[0], at_once[at_once.len() - 1]];
        assert!(last.0 - first.0 <= i64::from(RATE_HZ) / 200 + 1, "{end}");
    }
    assert!((5..30).contains(&changing), "{changing}");
}

#[test]
fn sends_that_jump_faster_than_they_fade_do_not_click() {
    let mut reverb = LateReverb::new(RATE_HZ, 1);
    let mut line = DelayLine::new(RATE_HZ as usize);
    let correction = BandCorrection::none();
    let (mut last, mut worst, mut loudest) = (0.0f32, 0.0f32, 0.0f32);
    let (mut left, mut now) = (0u32, 0i64);
    for jump in 0..500 {
        line.write(now, &[F32x8::splat(1.0); CHUNK]);
        let late = LateSend {
            source: Default::default(),
            group: 0,
            energy_per_s: [ENERGY_PER_S; 8],
            start_s: 0.02 * (1 + jump % 7) as f32,
        };
        let frame = FramePaths {
            // No sends after the jumps: everything fades.
            late: if jump < 300 { vec![late] } else { vec![] },
            late_groups: [LateGroup::isotropic([2.0; 8]); LATE_GROUPS],
            ..FramePaths::default()
        };
        // Ramps of a tenth of a second and a frame per chunk.
        reverb.set_frame(&frame, i64::from(RATE_HZ), &correction, left, 4410);
        left = 4410 - CHUNK as u32;
        let chunk = ChunkSpan {
            now,
            left: 4410,
            frames: CHUNK,
        };
        reverb.sends.collect(0, &line, chunk);
        // The delay line's signal starts with a step.
        for value in reverb.sends.band(0, CHUNK) {
            if jump * CHUNK > RATE_HZ as usize / 4 {
                worst = worst.max((value - last).abs());
            }
            loudest = loudest.max(value.abs());
            last = *value;
        }
        reverb.sends.clear();
        now += CHUNK as i64;
    }
    assert!(loudest > 0.01, "{loudest}");
    // Four taps that all rise or fall within a tenth of a second.
    assert!(worst < 4.0 * loudest / 4410.0, "{worst} of {loudest}");
    assert!(last.abs() < 1e-3 * loudest, "{last}");
}

/// Feedback of one band's chunk against the definition of the Hadamard matrix.
#[test]
fn circulation_follows_its_definition() {
    let draw = |n: usize| ((n * n) as f32 * 0.37 + n as f32).sin();
    let feedback = FeedbackGains {
        gain: std::array::from_fn(|line| 0.5 + 0.4 * draw(line)),
        growth: std::array::from_fn(|line| 1e-4 * draw(50 + line)),
    };
    for frames in [1, 7, 8, 20, CHUNK] {
        let fed: Vec<f32> = (0..frames).map(|n| draw(3000 + n)).collect();
        let before: Box<Chunks> = Box::new(std::array::from_fn(|line| {
            std::array::from_fn(|n| draw(999 * line + n))
        }));
        let output_before: Box<Chunks> = Box::new([[0.25; CHUNK]; LINES]);
        let round = |set: LaneSet| {
            let (mut lines, mut output) = (before.clone(), output_before.clone());
            circulate(set, &feedback, &fed, &mut lines, &mut output);
            (lines, output)
        };
        let (lines, output) = round(LaneSet::best());
        for set in LaneSet::vector_units() {
            let (found, specified) = (round(set), round(LaneSet::Fused));
            for line in 0..LINES {
                assert_eq!(found.0[line][..frames], specified.0[line][..frames]);
                assert_eq!(found.1[line][..frames], specified.1[line][..frames]);
            }
        }
        let (portable_lines, portable_output) = round(LaneSet::Portable);
        for n in 0..frames {
            let weighted: [f64; LINES] = std::array::from_fn(|line| {
                let gain = f64::from(feedback.gain[line])
                    + f64::from(feedback.growth[line]) * (n + 1) as f64;
                gain * f64::from(before[line][n])
            });
            for line in 0..LINES {
                let row = weighted.iter().enumerate().map(|(other, value)| {
                    let sign = if (line & other).count_ones().is_multiple_of(2) {
                        1.0
                    } else {
                        -1.0
                    };
                    sign * value
                });
                let norm = 1.0 / 8f64.sqrt();
                let fed = f64::from(fed[n]) * f64::from(SIGNS[line]);
                let next = norm * (row.sum::<f64>() + fed);
                let out = 0.25 + weighted[line];
                for (lines, output) in [(&lines, &output), (&portable_lines, &portable_output)] {
                    // Nine sums below 9, and the subnormal guard.
                    let bound = 9.0 * 9.0 * f64::from(f32::EPSILON / 2.0) + 1e-17;
                    assert!(
                        (f64::from(lines[line][n]) - next).abs() < bound,
                        "{frames} {n} {line}"
                    );
                    assert!(
                        (f64::from(output[line][n]) - out).abs() < bound,
                        "{frames} {n} {line}"
                    );
                }
            }
        }
    }
}
