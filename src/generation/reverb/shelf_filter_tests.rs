//! Levels of the filters and agreement of the instruction sets.

use super::*;
use crate::generation::CHUNK;
use crate::generation::reverb::wave_shares::smoothed;

const RATE_HZ: f64 = 44_100.0;

/// Level in dB at a frequency of what these gains are designed for.
fn designed_db(design: &ShelfDesign, gains: &Gains, hz: f64) -> f64 {
    let warped = (PI * hz / RATE_HZ).tan();
    let squares = std::array::from_fn(|k| (warped / design.tangents[k]).powi(4));
    level_at(&squares, &powers(gains), gains[SHELVES])
}

/// Losses in dB of a line of 50 ms for T60 in seconds.
fn losses(t60_s: [f64; BANDS]) -> [f64; BANDS] {
    t60_s.map(|t60_s| -60.0 * 0.05 / t60_s)
}

/// The level of one tone in dB after the filter of a line.
fn measured_db(filter: &mut ShelfFilter, line: usize, hz: f64) -> f64 {
    let mut rows: Box<Rows> = Box::new([[0.0; CHUNK]; LINES]);
    let (mut sum, mut wave) = ([0.0f64; 2], 0.0);
    let chunks = 400;
    for chunk in 0..chunks {
        let phase = |n: usize| std::f64::consts::TAU * hz * (chunk * CHUNK + n) as f64 / RATE_HZ;
        rows[line] = std::array::from_fn(|n| phase(n).sin() as f32);
        filter.process(&mut rows, 0, CHUNK);
        for n in (0..CHUNK).filter(|_| chunk >= chunks / 2) {
            let value = f64::from(rows[line][n]);
            sum[0] += value * phase(n).sin();
            sum[1] += value * phase(n).cos();
            wave += phase(n).sin().powi(2);
        }
    }
    20.0 * ((sum[0].powi(2) + sum[1].powi(2)).sqrt() / wave).log10()
}

#[test]
fn levels_at_the_centres_are_those_asked_for() {
    let design = ShelfDesign::new(RATE_HZ);
    for (t60_s, most) in [
        ([1.0; BANDS], 0.001),
        ([4.0, 2.0, 1.6, 1.0, 1.2, 0.6, 0.7, 0.3], 0.01),
        ([0.4, 0.5, 0.9, 1.4, 1.5, 1.3, 1.0, 0.7], 0.01),
        // Up and down from band to band: the shelves are no longer nearly linear.
        ([2.0, 0.8, 2.2, 0.9, 2.1, 1.0, 1.8, 0.7], 0.05),
    ] {
        let wanted = losses(t60_s);
        let gains = design.gains(&wanted);
        for (hz, wanted) in CENTRES_HZ.into_iter().zip(wanted) {
            let found = designed_db(&design, &gains, hz);
            assert!(
                (found / wanted - 1.0).abs() < most,
                "{hz}: {found} {wanted}"
            );
        }
    }
}

#[test]
fn the_filter_has_the_designed_response() {
    let design = ShelfDesign::new(RATE_HZ);
    let wanted = losses([4.0, 2.0, 1.6, 1.0, 1.2, 0.6, 0.7, 0.3]);
    let mut filter = ShelfFilter::new();
    let levels: [BandArray; LINES] =
        std::array::from_fn(|line| wanted.map(|level| (level * (1.0 + 0.02 * line as f64)) as f32));
    filter.retarget(&design, &levels, None, 0, 1);
    filter.process(&mut Box::new([[0.0; CHUNK]; LINES]), 1, CHUNK);
    for (line, hz) in [
        (0, 62.5),
        (7, 250.0),
        (13, 700.0),
        (23, 4000.0),
        (8, 11_000.0),
    ] {
        let gains = design.gains(&levels[line].map(f64::from));
        let (found, designed) = (
            measured_db(&mut filter, line, hz),
            designed_db(&design, &gains, hz),
        );
        assert!((found - designed).abs() < 0.01, "{hz}: {found} {designed}");
    }
}

#[test]
fn no_response_exceeds_its_limit() {
    let design = ShelfDesign::new(RATE_HZ);
    let mut state = 3u32;
    let mut draw = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24)
    };
    let mut closest = f64::INFINITY;
    for _ in 0..300 {
        let wanted = std::array::from_fn(|_| if draw() < 0.4 { 0.0 } else { -20.0 * draw() });
        let mut gains = design.gains(&wanted);
        design.limit(&mut gains, -0.001);
        let highest = (0..3000)
            .map(|n| {
                designed_db(
                    &design,
                    &gains,
                    5.0 * 10f64.powf(3.6 * f64::from(n) / 3000.0),
                )
            })
            .fold(f64::NEG_INFINITY, f64::max);
        closest = closest.min(-highest);
    }
    println!("closest to 0 dB: {closest:.4} dB");
    assert!(closest > 0.0, "{closest}");
}

#[test]
fn a_ramp_has_the_same_values_however_it_is_cut() {
    let design = ShelfDesign::new(RATE_HZ);
    let levels = |t60_s: f64| [losses([t60_s; BANDS]).map(|l| l as f32); LINES];
    let sound = |sizes: &[usize]| {
        let mut filter = ShelfFilter::new();
        filter.retarget(&design, &levels(1.0), None, 0, 1);
        let mut sloped = levels(0.5);
        sloped.iter_mut().for_each(|line| line[6] *= 2.0);
        let (mut sound, mut time, mut left) = (Vec::new(), 0, 1);
        let mut sizes = sizes.iter().cycle();
        while time < 3000 {
            if time == 600 {
                filter.retarget(&design, &sloped, None, 0, 1000);
                left = 1000;
            }
            let until = if time < 600 { 600 } else { 3000 };
            let frames = (*sizes.next().unwrap()).min(until - time);
            let mut rows: Box<Rows> = Box::new([[0.0; CHUNK]; LINES]);
            for row in rows.iter_mut() {
                for (n, value) in row[..frames].iter_mut().enumerate() {
                    *value = (0.1 * (time + n) as f32).sin();
                }
            }
            filter.process(&mut rows, left as u32, frames);
            sound.extend_from_slice(&rows[11][..frames]);
            time += frames;
            left -= left.min(frames);
        }
        sound
    };
    let whole = sound(&[CHUNK]);
    for sizes in [&[1][..], &[7, 64, 130], &[32]] {
        assert_eq!(sound(sizes), whole, "{sizes:?}");
    }
}

#[test]
fn instruction_sets_agree() {
    let design = ShelfDesign::new(RATE_HZ);
    let levels = [losses([4.0, 2.0, 1.6, 1.0, 1.2, 0.6, 0.7, 0.3]).map(|l| l as f32); LINES];
    let before: Box<Rows> = Box::new(std::array::from_fn(|line| {
        std::array::from_fn(|n| ((line * 7 + n * n) as f32 * 0.37).sin())
    }));
    let with = |set: LaneSet| {
        let mut filtered = ShelfFilter::new();
        filtered.set = set;
        filtered.retarget(&design, &levels, None, 0, 1);
        let mut rows = before.clone();
        filtered.process(&mut rows, 0, 100);
        filtered.process(&mut rows, 0, CHUNK);
        rows
    };
    for set in LaneSet::vector_units() {
        assert_eq!(with(set), with(LaneSet::Fused), "{set:?}");
    }
    for (a, b) in with(LaneSet::Portable)
        .iter()
        .flatten()
        .zip(with(LaneSet::Fused).iter().flatten())
    {
        // Some hundred roundings of values below three, in filters with a gain below one.
        assert!((a - b).abs() < 3e-5, "{a} {b}");
    }
}

/// The largest fourth difference of a tone of 100 Hz, relative to its peak, while the levels fall within `ramp` frames, as in
/// another scene. `hold` replaces the frames between two changes of the coefficients; after `again` chunks comes a graphics
/// frame with the same levels.
fn roughness(ramp: u32, hold: Option<usize>, again: Option<usize>) -> f32 {
    let design = ShelfDesign::new(RATE_HZ);
    let [lively, dead] = [4.0, 0.2].map(|t60_s| {
        let loss = losses([t60_s; BANDS]).map(|level| level as f32);
        let falling: BandArray = std::array::from_fn(|b| loss[b] * (1.0 + 0.05 * b as f32));
        [falling; LINES]
    });
    let mut filter = ShelfFilter::new();
    filter.retarget(&design, &lively, None, 0, 1);
    let mut rows: Box<Rows> = Box::new([[0.0; CHUNK]; LINES]);
    let mut sound = Vec::new();
    let mut left = 0;
    for chunk in 0..40 {
        if chunk == 20 {
            filter.retarget(&design, &dead, None, 0, ramp);
            filter.hold_frames = hold.unwrap_or(filter.hold_frames);
            left = ramp;
        } else if again.is_some_and(|again| chunk == 20 + again) {
            filter.retarget(&design, &dead, None, left, ramp);
            left = ramp;
        }
        let tone = |n: usize| (std::f64::consts::TAU * 100.0 * n as f64 / RATE_HZ).sin();
        rows[0] = std::array::from_fn(|n| tone(CHUNK * chunk + n) as f32);
        filter.process(&mut rows, left, CHUNK);
        left = left.saturating_sub(CHUNK as u32);
        sound.extend_from_slice(&rows[0]);
    }
    let heard = &sound[10 * CHUNK..];
    let peak = heard.iter().fold(0.0, |peak: f32, s| peak.max(s.abs()));
    let differences = heard.windows(5);
    let fourth = differences.map(|s| (s[4] - 4.0 * s[3] + 6.0 * s[2] - 4.0 * s[1] + s[0]).abs());
    fourth.fold(0.0, f32::max) / peak
}

#[test]
fn a_fast_ramp_has_no_steps() {
    for ramp in [256, 768] {
        let (held, found) = (
            roughness(ramp, Some(HOLD), None),
            roughness(ramp, None, None),
        );
        println!("{ramp}: {found:.4}, held for {HOLD} frames {held:.4}");
        // A hundredth: a tenth of what `ClickDetector` counts.
        assert!(found < 0.01 && held > 0.03, "{ramp}: {found} {held}");
    }
}

#[test]
fn a_graphics_frame_within_a_ramp_does_not_end_it() {
    let found = roughness(1024, None, Some(2));
    assert!(found < 0.01, "{found}");
}

/// Levels of a wave as few rays make them up, in the bootcamp with eight sources, where a burst was 28 times as loud as the rest.
#[test]
fn a_ramp_between_jagged_levels_has_no_burst() {
    let design = ShelfDesign::new(RATE_HZ);
    let ends_db = [
        [-6.7, -28.4, -13.2, -30.0, -11.7, -30.0, -30.0, -30.0],
        [-6.4, -29.8, -12.7, -17.4, -30.0, -24.4, -16.9, -30.0],
    ];
    let levels = ends_db.map(|wave: BandArray| {
        let mut energies = [[1.0; BANDS]; LINES];
        energies[2] = wave.map(|db| 10f32.powf(0.1 * db));
        smoothed(&energies).map(|wave| wave.map(|energy| 10.0 * energy.log10()))
    });
    for (from, to) in [(0, 1), (1, 0)] {
        for ramp in [640, 1760, 17_600] {
            let mut filter = ShelfFilter::new();
            filter.retarget(&design, &levels[from], None, 0, 1);
            let (mut highest, mut left) = (0.0f32, 0);
            let chunks = 100 + ramp / CHUNK;
            for chunk in 0..chunks {
                if chunk == 50 {
                    filter.retarget(&design, &levels[to], None, 0, ramp as u32);
                    left = ramp;
                }
                let mut rows: Box<Rows> = Box::new([[1.0; CHUNK]; LINES]);
                filter.process(&mut rows, left as u32, CHUNK);
                left = left.saturating_sub(CHUNK);
                highest = rows[2].iter().fold(highest, |most, s| most.max(s.abs()));
            }
            println!("{from} to {to} in {ramp} frames: {highest:.3}");
            // A wave of the isotropic level; this one is at least 6 dB below it at rest.
            assert!(highest < 1.0, "{from} to {to} in {ramp}: {highest}");
        }
    }
}
