//! Decay, level, energy and directions of the late reverb.

use super::*;
use crate::acoustics::BANDS;
use crate::acoustics::bands::CENTRES_HZ;
use crate::extrapolation::{LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LateGroup, LateSend};
use crate::generation::BandFilter;
use crate::generation::reverb::wave_shares::wave_directions;
use crate::scene::SourceId;
use crate::simd::F32x8;

const RATE_HZ: u32 = 44_100;
const ENERGY_PER_S: f32 = 0.4;
const START_S: f32 = 0.08;
/// Sources over which levels are averaged.
const SLOTS: usize = 8;

/// A segment of the source in a slot.
fn send(slot: u16, group: u8) -> LateSend {
    LateSend {
        source: SourceId::new(slot, 0),
        group,
        energy_per_s: [ENERGY_PER_S; BANDS],
        start_s: START_S,
    }
}

/// A frame in which the first source sends to the first group.
fn frame(group: LateGroup) -> FramePaths {
    FramePaths {
        late: vec![send(0, 0)],
        late_groups: [group, LateGroup::default(), LateGroup::default()],
        ..FramePaths::default()
    }
}

/// The waves' signals after inputs to the sources in the first slots.
fn waves(frame: &FramePaths, inputs: &[&[f32]], seconds: f32) -> Vec<Vec<f32>> {
    let frames = (seconds * RATE_HZ as f32) as usize;
    let mut reverb = LateReverb::new(RATE_HZ, inputs.len());
    let mut lines: Vec<_> = inputs
        .iter()
        .map(|_| DelayLine::new(RATE_HZ as usize, RATE_HZ as usize))
        .collect();
    let mut filters: Vec<_> = inputs.iter().map(|_| BandFilter::new(RATE_HZ)).collect();
    let correction = BandCorrection::new(RATE_HZ);
    reverb.set_frame(frame, &vec![1.0; inputs.len()], &correction, 0, 1);
    let mut output = vec![Vec::new(); LINES];
    for now in (0..frames).step_by(CHUNK) {
        let chunk = ChunkSpan {
            now: now as i64,
            left: 0,
            frames: CHUNK,
        };
        for (slot, input) in inputs.iter().enumerate() {
            let sample = |n: usize| input.get(now + n).copied().unwrap_or(0.0);
            let own: [f32; CHUNK] = std::array::from_fn(sample);
            let mut bands = [[F32x8::ZERO; CHUNK]; 4];
            let [a, b, c, d] = &mut bands;
            filters[slot].process(
                [&own, &[0.0; CHUNK], &[0.0; CHUNK], &[0.0; CHUNK]],
                [a, b, c, d],
            );
            lines[slot].write(now as i64, &bands[0]);
        }
        for (slot, line) in lines.iter().enumerate() {
            reverb.collect(slot, line, chunk);
        }
        let waves = reverb.process(0, CHUNK).copied();
        let signals = waves.unwrap_or([[0.0; CHUNK]; LINES]);
        for (output, signal) in output.iter_mut().zip(&signals) {
            output.extend_from_slice(signal);
        }
    }
    output
}

/// A tone of unit energy within a Gaussian window, its spectrum's deviation 6 % of the frequency, and the frame of its middle.
fn tone(frequency_hz: f64) -> (Vec<f32>, usize) {
    let width = f64::from(RATE_HZ) / (0.06 * std::f64::consts::TAU * frequency_hz);
    let middle = (4.0 * width).ceil();
    let value = |n: usize| {
        let time = n as f64 - middle;
        let phase = std::f64::consts::TAU * frequency_hz * time / f64::from(RATE_HZ);
        (-0.5 * (time / width).powi(2)).exp() * phase.cos()
    };
    let values: Vec<f64> = (0..2 * middle as usize).map(value).collect();
    let energy: f64 = values.iter().map(|v| v * v).sum();
    let tone = values.iter().map(|v| (v / energy.sqrt()) as f32).collect();
    (tone, middle as usize)
}

/// Energy per frame, summed over the waves.
fn energy(waves: &[Vec<f32>]) -> Vec<f64> {
    let at = |n: usize| waves.iter().map(|wave| f64::from(wave[n]).powi(2)).sum();
    (0..waves[0].len()).map(at).collect()
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
    // Between the centres, decay times follow a smooth curve: at a steep one, the tone would have several.
    let decays_s = [4.0, 2.6, 1.7, 1.2, 1.3, 1.0, 0.8, 0.5];
    for (band, t60_s) in decays_s.into_iter().enumerate() {
        let (tone, middle) = tone(CENTRES_HZ[band]);
        let mut frame = frame(LateGroup::default());
        frame.late_groups = [LateGroup::isotropic(decays_s); LATE_GROUPS];
        // Low bands have few modes: groups have others, and sources excite them differently.
        let mut sum = Vec::new();
        for slot in 0..SLOTS {
            frame.late[0] = send(slot as u16, (slot % LATE_GROUPS) as u8);
            let mut inputs = [&[0.0f32][..]; SLOTS];
            inputs[slot] = &tone;
            let seconds = 1.3 * t60_s + 0.3 + middle as f32 / RATE_HZ as f32;
            let energy = energy(&waves(&frame, &inputs, seconds));
            sum.resize(energy.len(), 0.0);
            sum.iter_mut()
                .zip(energy)
                .for_each(|(sum, e)| *sum += e / SLOTS as f64);
        }
        let curve = backward_integrated(&sum[middle..]);
        let measured_s = decay_time_s(&curve);
        // The energy after a time t is E T / (6 ln 10) 10^(−6 t / T).
        let expected = |time_s: f32| {
            f64::from(ENERGY_PER_S) * f64::from(t60_s) / 13.815_510_558
                * 10f64.powf(-6.0 * f64::from(time_s / t60_s))
        };
        let level_db = |time_s: f32| {
            let at = (time_s * RATE_HZ as f32) as usize;
            10.0 * (curve[at] / expected(time_s)).log10()
        };
        let (start_db, later_db) = (level_db(START_S), level_db(START_S + 0.1));
        println!(
            "{:.0} Hz, {t60_s} s: measured {measured_s:.4} s, {start_db:.2} dB, {later_db:.2} dB",
            CENTRES_HZ[band]
        );
        assert!((measured_s / f64::from(t60_s) - 1.0).abs() < 0.03);
        // Modes of all groups within the tone's spectrum, at 1.3 a hertz; their energies deviate as much as their mean.
        let modes = 1.3 * 3.0 * 3.54 * 0.06 * CENTRES_HZ[band];
        let bound_db = 0.5 + 4.34 / modes.sqrt();
        assert!(start_db.abs() < bound_db && later_db.abs() < bound_db);
    }
}

#[test]
fn nothing_arrives_before_its_time() {
    let group = LateGroup::isotropic([1.0; BANDS]);
    for step in 0..40 {
        let mut frame = frame(group);
        frame.late[0].start_s = START_S + 1e-4 * step as f32;
        let energy = energy(&waves(&frame, &[&[1.0]], 0.2));
        let start = (frame.late[0].start_s * RATE_HZ as f32) as usize;
        assert!(energy[..start - 2].iter().all(|e| *e == 0.0), "{step}");
        assert!(
            energy[start..start + RATE_HZ as usize / 100]
                .iter()
                .sum::<f64>()
                > 0.0
        );
    }
}

#[test]
fn invalid_decay_times_are_silence() {
    for t60_s in [0.0, -1.0, 0.05, f32::NAN] {
        let frame = frame(LateGroup::isotropic([t60_s; BANDS]));
        let energy = energy(&waves(&frame, &[&[1.0]], 0.4));
        assert!(energy.iter().all(|&e| e == 0.0), "{t60_s}");
    }
}

#[test]
fn endless_decay_stays_bounded() {
    for mixed in [false, true] {
        let mut decay_s = [f32::INFINITY; BANDS];
        if mixed {
            decay_s = std::array::from_fn(|b| if b % 2 == 0 { f32::INFINITY } else { 1.0 });
        }
        let frame = frame(LateGroup::isotropic(decay_s));
        let energy = energy(&waves(&frame, &[&[1.0]], 4.0));
        let early = energy[8820..52_920].iter().sum::<f64>();
        let late = energy[energy.len() - 44_100..].iter().sum::<f64>();
        println!("late / early {:.3}", late / early);
        assert!(late / early < 1.1);
        assert!(mixed || late / early > 0.9);
    }
}

#[test]
fn a_silent_network_is_not_processed() {
    let mut reverb = LateReverb::new(RATE_HZ, 1);
    assert!(reverb.process(0, CHUNK).is_none());
}

#[test]
fn another_group_changes_nothing() {
    let (first, second) = ([0.8; BANDS], [2.5; BANDS]);
    let mut alone = frame(LateGroup::isotropic(first));
    let input: Vec<f32> = (0..2000).map(|n| ((n * n) as f32 * 0.37).sin()).collect();
    let before = waves(&alone, &[&input, &[0.0]], 1.0);
    alone.late.push(send(1, 1));
    alone.late_groups[1] = LateGroup::isotropic(second);
    assert_eq!(waves(&alone, &[&input, &[0.0]], 1.0), before);
    // With sound in the other group the energies add up: the groups are uncorrelated.
    let both = energy(&waves(&alone, &[&input, &input], 1.0));
    let sum = |energy: &[f64]| energy.iter().sum::<f64>();
    alone.late.remove(0);
    let other = energy(&waves(&alone, &[&[0.0], &input], 1.0));
    let ratio_db = 10.0 * (sum(&both) / (sum(&energy(&before)) + sum(&other))).log10();
    println!("energies of two groups add up within {ratio_db:.2} dB");
    assert!(ratio_db.abs() < 0.3);
}

#[test]
fn waves_arrive_from_where_the_group_says() {
    let mut group = LateGroup::isotropic([1.0; BANDS]);
    group.directions = [[0.0; BANDS]; LATE_DIRECTIONS];
    // Low bands from one direction, high bands from the opposite one.
    for b in 0..BANDS {
        group.directions[usize::from(b >= 4)][b] = 1.0;
    }
    for (band, index) in [(1, 0), (6, 1)] {
        let (tone, _) = tone(CENTRES_HZ[band]);
        let waves = waves(&frame(group), &[&tone], 1.0);
        let energies: Vec<f64> = waves
            .iter()
            .map(|wave| wave.iter().map(|v| f64::from(*v).powi(2)).sum())
            .collect();
        let near: f64 = wave_directions()
            .iter()
            .zip(&energies)
            .filter(|(wave, _)| wave.dot(LATE_DIRECTION_VECTORS[index]) > 0.707)
            .map(|(_, energy)| energy)
            .sum();
        let total: f64 = energies.iter().sum();
        let level_db =
            10.0 * (total / (f64::from(ENERGY_PER_S) / 13.8155 * 10f64.powf(-0.48))).log10();
        println!(
            "band {band}: {:.3} from within 45 degrees, {level_db:.2} dB",
            near / total
        );
        assert!(near / total > 0.8 && level_db.abs() < 1.0);
    }
}

#[test]
fn a_send_depends_only_on_its_frame() {
    let taps_after = |starts: &[u32]| {
        let mut reverb = LateReverb::new(RATE_HZ, 1);
        for &start in starts {
            let mut frame = frame(LateGroup::isotropic([1.0; BANDS]));
            frame.late[0].start_s = START_S + 1e-4 * start as f32;
            let correction = BandCorrection::none();
            reverb.set_frame(&frame, &[1.0], &correction, 0, 1);
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
    let mut line = DelayLine::new(RATE_HZ as usize, RATE_HZ as usize);
    let correction = BandCorrection::none();
    let (mut last, mut worst, mut loudest) = (0.0f32, 0.0f32, 0.0f32);
    let (mut left, mut now) = (0u32, 0i64);
    for jump in 0..500 {
        line.write(now, &[F32x8::splat(0.125); CHUNK]);
        let mut frame = frame(LateGroup::isotropic([2.0; BANDS]));
        frame.late[0].start_s = 0.02 * (1 + jump % 7) as f32;
        if jump >= 300 {
            // No sends after the jumps: everything fades.
            frame.late.clear();
        }
        // Ramps of a tenth of a second and a frame per chunk.
        reverb.set_frame(&frame, &[1.0], &correction, left, 4410);
        left = 4410 - CHUNK as u32;
        let chunk = ChunkSpan {
            now,
            left: 4410,
            frames: CHUNK,
        };
        reverb.sends.collect(0, &line, chunk);
        // The delay line's signal starts with a step.
        for n in 0..CHUNK {
            let value: f32 = (0..BUSES)
                .map(|bus| reverb.sends.bus(0, bus, CHUNK)[n])
                .sum();
            if jump * CHUNK > RATE_HZ as usize / 4 {
                worst = worst.max((value - last).abs());
            }
            loudest = loudest.max(value.abs());
            last = value;
        }
        reverb.sends.clear();
        now += CHUNK as i64;
    }
    assert!(loudest > 0.01, "{loudest}");
    // Four taps that all rise or fall within a tenth of a second.
    assert!(worst < 4.0 * loudest / 4410.0, "{worst} of {loudest}");
    assert!(last.abs() < 1e-3 * loudest, "{last}");
}
