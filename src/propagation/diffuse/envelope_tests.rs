//! Fits of decays to arrivals.

use super::*;
use crate::propagation::diffuse::decay_fit::sum_of;
use crate::propagation::diffuse::energy_course::BIN_STEPS;
use crate::propagation::rays::directions::mix;
use crate::scene::SourceId;

/// Energy of a source's late reverb from `from_s` to `to_s` after emission, in a band.
fn energy_within(
    late: &LateEnergy,
    groups: &[LateGroup; LATE_GROUPS],
    from_s: f64,
    to_s: f64,
) -> f64 {
    let segments = late_segments(late, groups);
    let within = segments.map(|segment| {
        let decay_s = groups[usize::from(segment.group)].decay_time_s[3];
        let rate = NEPERS_OF_60_DB / f64::from(decay_s);
        let left = |t: f64| (-rate * t).exp() / rate;
        let start_s = f64::from(segment.start_s);
        let span = left(from_s.max(start_s)) - left(to_s.max(start_s));
        f64::from(segment.energy_per_s[3]) * span
    });
    within.sum()
}

/// Continues arrivals after the responses; energies are those of a time step after the straight line's arrival.
fn go_on(histogram: &mut ArrivalHistogram, energy_at: impl Fn(usize) -> BandArray) {
    let nearest = histogram.nearest_steps().round() as usize;
    for (bin, sum) in histogram.late.iter_mut().enumerate().skip(1) {
        let first = STEPS + BIN_STEPS * (bin - 1) - nearest;
        *sum = sum_of(
            &(first..first + BIN_STEPS)
                .map(&energy_at)
                .collect::<Vec<_>>(),
        );
    }
}

#[test]
fn two_slopes_with_a_slow_start_are_fitted() {
    let (step_s, nearest_s) = (0.006f32, 0.02f32);
    let times = [2.0f32, 0.6, 0.2];
    let rates = times.map(|time_s| [(NEPERS_OF_60_DB / f64::from(time_s)) as f32; BANDS]);
    let groups = times.map(|time_s| LateGroup::isotropic([time_s; BANDS]));
    let mut histogram = ArrivalHistogram::new(step_s, nearest_s);
    // A fast decay from the start, and a slow one that builds up.
    let energy_at = |t: f64| {
        let slow = 0.02 * (-f64::from(rates[0][0]) * t).exp() * (1.0 - (-t / 0.05).exp());
        (-f64::from(rates[2][0]) * t).exp() + slow
    };
    for step in 0..STEPS {
        let weight = if step == 0 { 0.5 } else { 1.0 };
        let energy = weight * energy_at(step as f64 * f64::from(step_s));
        histogram.energy[step] = [energy as f32; BANDS];
    }
    go_on(&mut histogram, |step| {
        [energy_at(step as f64 * f64::from(step_s)) as f32; BANDS]
    });
    let mut late = LateEnergy::silent(SourceId::default());
    late.start_s = nearest_s;
    late.mean_free_time_s = STEPS_PER_FREE_TIME * step_s;
    let columns = DecayColumns::new(&rates, &[0.0; BANDS], &[false; BANDS], step_s);
    histogram.fit(&columns, &EnergyCourse::default(), 1.0, &mut late);
    for (first, end) in [(0, 8), (8, 20), (20, 40), (40, 70)] {
        let expected: f64 = histogram.energy[first..end]
            .iter()
            .map(|e| f64::from(e[3]))
            .sum();
        let edge = |step: usize| {
            let at = (step as f64 - 0.5).max(0.0) * f64::from(step_s);
            f64::from(nearest_s) + at
        };
        let found = energy_within(&late, &groups, edge(first), edge(end));
        let off_db = 10.0 * (found / expected).log10();
        assert!(off_db.abs() < 0.5, "{first} to {end}: {off_db} dB");
    }
}

/// Behind another room energy grows for half of the response. Without the last start the beginning has 1.1 dB too much.
#[test]
fn energy_that_builds_up_slowly_is_fitted() {
    let (step_s, nearest_s) = (0.004f32, 0.02f32);
    let times = [1.5f32, 1.0, 0.3];
    let rates = times.map(|time_s| [(NEPERS_OF_60_DB / f64::from(time_s)) as f32; BANDS]);
    let groups = times.map(|time_s| LateGroup::isotropic([time_s; BANDS]));
    let mut histogram = ArrivalHistogram::new(step_s, nearest_s);
    let energy_at = |step: usize| {
        let time_s = step as f32 * step_s;
        let grown = 1.0 - (-time_s / 0.08).exp();
        rates[0].map(|rate| (-rate * time_s).exp() * grown * grown)
    };
    histogram.energy = std::array::from_fn(energy_at);
    go_on(&mut histogram, energy_at);
    let mut late = LateEnergy::silent(SourceId::default());
    late.start_s = nearest_s;
    late.mean_free_time_s = STEPS_PER_FREE_TIME * step_s;
    histogram.fit(
        &DecayColumns::new(&rates, &[0.0; BANDS], &[false; BANDS], step_s),
        &EnergyCourse::default(),
        1.0,
        &mut late,
    );
    for (first, end) in [(0, 20), (20, 40), (40, 60), (60, 75)] {
        let energies = &histogram.energy[first..end];
        let expected: f64 = energies.iter().map(|e| f64::from(e[3])).sum();
        let edge =
            |step: usize| f64::from(nearest_s) + (step as f64 - 0.5).max(0.0) * f64::from(step_s);
        let found = energy_within(&late, &groups, edge(first), edge(end));
        let off_db = 10.0 * (found / expected).log10();
        println!("{first} to {end}: {off_db:.2} dB");
        assert!(off_db.abs() < 0.8, "{first} to {end}: {off_db} dB");
    }
}

/// From the first of three rooms to the last one: what arrives per second is in proportion to the time and to the rooms' decay. Without the
/// second group's late start the early decay time is 16 % too short.
#[test]
fn energy_through_a_room_between_is_fitted() {
    let (step_s, nearest_s) = (0.0046f32, 0.038f32);
    let times = [1.9f32, 1.9 / 0.8, 0.27];
    let rates = times.map(|time_s| [(NEPERS_OF_60_DB / f64::from(time_s)) as f32; BANDS]);
    let groups = times.map(|time_s| LateGroup::isotropic([time_s; BANDS]));
    let energy_at = |step: usize| {
        let time_s = (step as f32 * step_s - 0.03).max(0.0);
        let grown = time_s * (1.0 - (-time_s / 0.03).exp());
        rates[0].map(|rate| (-rate * time_s).exp() * grown)
    };
    let mut histogram = ArrivalHistogram::new(step_s, nearest_s);
    histogram.energy = std::array::from_fn(energy_at);
    go_on(&mut histogram, energy_at);
    // The course of the air's energy goes on for as long.
    let mut air = EnergyCourse::default();
    let of_steps =
        std::array::from_fn(|step| rates[0].map(|rate| (-rate * step as f32 * step_s).exp()));
    let bins = std::array::from_fn(|bin| {
        let time_s = (STEPS + BIN_STEPS * bin) as f32 * step_s;
        rates[0].map(|rate| BIN_STEPS as f32 * (-rate * time_s).exp())
    });
    air.set(&of_steps, &bins);
    let early_decay_s = |spreading: f32| {
        let mut late = LateEnergy::silent(SourceId::default());
        late.start_s = nearest_s;
        late.mean_free_time_s = STEPS_PER_FREE_TIME * step_s;
        let columns = DecayColumns::new(&rates, &[spreading; BANDS], &[false; BANDS], step_s);
        histogram.fit(&columns, &air, 1.0, &mut late);
        let left = |time_s: f64| energy_within(&late, &groups, time_s, 20.0);
        let whole = left(0.0);
        (0..4000)
            .map(|ms| f64::from(ms) * 1e-3)
            .find(|time_s| left(*time_s) < 0.1 * whole)
    };
    let left = |first: usize| -> f64 {
        (first..3000)
            .map(|step| f64::from(energy_at(step)[3]))
            .sum()
    };
    let expected = (0..3000).find(|step| left(*step) < 0.1 * left(0)).unwrap();
    let expected_s = f64::from(nearest_s) + f64::from(step_s) * expected as f64;
    let [without, with] =
        [0.0, 1.0].map(|spreading| early_decay_s(spreading).unwrap() / expected_s);
    println!("{without} without, {with} with");
    // 5 % are just heard.
    assert!((with - 1.0).abs() < 0.05 && without < 0.9);
}

/// A second group that is slower than the only decay gets next to nothing of it, although the arrivals fall by 10 dB only.
#[test]
fn one_decay_is_not_lengthened_by_a_slower_group() {
    let (step_s, nearest_s) = (0.004f32, 0.02f32);
    let times = [2.0f32, 2.0 / 0.77, 1.0];
    let rates = times.map(|time_s| [(NEPERS_OF_60_DB / f64::from(time_s)) as f32; BANDS]);
    let groups = times.map(|time_s| LateGroup::isotropic([time_s; BANDS]));
    let rate = f64::from(rates[0][0]);
    let left = |time_s: f64| (-rate * time_s).exp() / rate;
    let mut histogram = ArrivalHistogram::new(step_s, nearest_s);
    let energy_at = |step: usize| {
        let edges = [step as f64 - 0.5, step as f64 + 0.5];
        let [start, end] = edges.map(|edge| left(edge.max(0.0) * f64::from(step_s)));
        [(start - end) as f32; BANDS]
    };
    histogram.energy = std::array::from_fn(energy_at);
    go_on(&mut histogram, energy_at);
    let mut late = LateEnergy::silent(SourceId::default());
    late.start_s = nearest_s;
    late.mean_free_time_s = STEPS_PER_FREE_TIME * step_s;
    let columns = DecayColumns::new(&rates, &[0.0; BANDS], &[false; BANDS], step_s);
    histogram.fit(&columns, &EnergyCourse::default(), 1.0, &mut late);
    // The energies are scaled to those of the arrivals.
    let arrived_s = f64::from(step_s) * (STEPS as f64 - 0.5);
    let within = |from_s: f64, to_s: f64| {
        let start_s = f64::from(nearest_s);
        energy_within(&late, &groups, start_s + from_s, start_s + to_s)
    };
    let found = within(1.0, 2.0) / within(0.0, arrived_s);
    let expected = (left(1.0) - left(2.0)) / (left(0.0) - left(arrived_s));
    let off_db = 10.0 * (found / expected).log10();
    assert!(off_db.abs() < 0.5, "{off_db} dB");
}

/// Where it would start too late, the last segment has no energy: leaving it out changes no bit.
#[test]
fn a_segment_without_energy_is_left_out() {
    let step_s = 0.01f32;
    let times = [1.0f32, 1.2, 0.4];
    let rates = times.map(|time_s| [(NEPERS_OF_60_DB / f64::from(time_s)) as f32; BANDS]);
    let mut columns = DecayColumns::new(&rates, &[0.0; BANDS], &[false; BANDS], step_s);
    assert_eq!(columns.has_last, [false; 2]);
    let mut histogram = ArrivalHistogram::new(step_s, 0.02);
    for (step, energy) in histogram.energy.iter_mut().enumerate() {
        let noise = 0.5 + (mix(step as u64) >> 40) as f32 / (1 << 24) as f32;
        *energy = rates[0].map(|rate| noise * (-rate * step as f32 * step_s).exp());
    }
    let mut fits = [LateEnergy::silent(SourceId::default()); 3];
    let has_last = [[false; 2], [true, false], [true; 2]];
    for (has_last, late) in has_last.into_iter().zip(&mut fits) {
        columns.has_last = has_last;
        histogram.fit(&columns, &EnergyCourse::default(), 1.0, late);
    }
    assert!(fits[0].energy[0][0][3] > 0.0);
    assert_eq!(fits[0], fits[1]);
    assert_eq!(fits[0], fits[2]);
    let has_last = |spreading, step_s| {
        DecayColumns::new(&rates, &[spreading; BANDS], &[false; BANDS], step_s).has_last
    };
    assert_eq!(has_last(0.0, 0.008), [true, false]);
    assert_eq!(has_last(1.0, 0.008), [true, false]);
    assert_eq!(has_last(0.0, 0.004), [true, false]);
    assert_eq!(has_last(1.0, 0.004), [true; 2]);
}

#[test]
fn noise_does_not_move_energy_between_similar_decays() {
    let (step_s, nearest_s) = (0.006f32, 0.02f32);
    let times = [1.2f32, 1.0, 0.4];
    let rates = times.map(|time_s| [(NEPERS_OF_60_DB / f64::from(time_s)) as f32; BANDS]);
    let columns = DecayColumns::new(&rates, &[0.0; BANDS], &[false; BANDS], step_s);
    let fitted = |seed: u64| {
        let mut histogram = ArrivalHistogram::new(step_s, nearest_s);
        for (step, energy) in histogram.energy.iter_mut().enumerate() {
            let time_s = step as f64 * f64::from(step_s);
            let decay = (-NEPERS_OF_60_DB * time_s / 1.1).exp() as f32;
            for (b, energy) in energy.iter_mut().enumerate() {
                // A tenth, 0.4 dB: what few rays leave.
                let noise = mix(seed + (1000 * step + b) as u64) as f32 / u64::MAX as f32;
                *energy = decay * (0.9 + 0.2 * noise);
            }
        }
        let mut late = LateEnergy::silent(SourceId::default());
        histogram.fit(&columns, &EnergyCourse::default(), 1.0, &mut late);
        late.energy
    };
    let quiet = fitted(0);
    let mut mean = 0.0;
    for seed in 1..20 {
        let noisy = fitted(seed << 32);
        for b in 0..BANDS {
            // Each decay has lines of its own: the sound's correlation is that of the amplitudes.
            let (mut product, mut energies) = (0.0, [0.0; 2]);
            let pairs = quiet.as_flattened().iter().zip(noisy.as_flattened());
            for (a, c) in pairs.map(|(a, c)| (a[b], c[b])) {
                product += (a * c).sqrt();
                energies = [energies[0] + a, energies[1] + c];
            }
            mean += product / (energies[0] * energies[1]).sqrt() / (19 * BANDS) as f32;
        }
    }
    // A difference 20 dB below the sound.
    assert!(mean > 0.995, "{mean}");
}

#[test]
fn the_energy_of_the_sends_is_that_of_the_estimate() {
    let mut late = LateEnergy::silent(SourceId::default());
    late.energy = [[
        [0.1; BANDS],
        [0.2; BANDS],
        [0.2; BANDS],
        [0.1; BANDS],
        [0.0; BANDS],
    ]; LATE_GROUPS];
    late.energy[0][LATE_SEGMENTS - 1] = [0.2; BANDS];
    late.start_s = 0.03;
    late.mean_free_time_s = 0.01;
    for decay_s in [0.3f32, 1.0, 4.0] {
        let groups = [LateGroup::isotropic([decay_s; BANDS]); LATE_GROUPS];
        let total = energy_within(&late, &groups, 0.0, 100.0);
        assert!((total - 2.0).abs() < 1e-4, "{total}");
    }
}

/// The air's energy decays slowly from the end of the responses on; the source's is alike until then. Carried by few rays, it goes on as
/// the air's; certain, as that of the patches, here as it was.
#[test]
fn arrivals_of_few_rays_go_on_as_the_airs_energy() {
    let step_s = 0.004f32;
    let times = [2.4f32, 0.8, 0.2];
    let rates = times.map(|time_s| [(NEPERS_OF_60_DB / f64::from(time_s)) as f32; BANDS]);
    let groups = times.map(|time_s| LateGroup::isotropic([time_s; BANDS]));
    let [slow, fast] = [rates[0][0], rates[1][0]].map(|rate| rate * step_s);
    let level = |step: f32| {
        let later = (step - STEPS as f32).max(0.0);
        (-fast * (step - later) - slow * later).exp()
    };
    let as_before = |step: f32| (-fast * step).exp();
    let bins = |level: &dyn Fn(f32) -> f32, bin: usize| {
        let first = STEPS - 10 + 10 * bin;
        [(first..first + 10).map(|step| level(step as f32)).sum(); BANDS]
    };
    let of_steps = std::array::from_fn(|step| [level(step as f32); BANDS]);
    let mut air = EnergyCourse::default();
    air.set(&of_steps, &std::array::from_fn(|bin| bins(&level, bin)));
    let columns = DecayColumns::new(&rates, &[0.0; BANDS], &[false; BANDS], step_s);
    let off_db = |variance: f32, expected: &dyn Fn(f32) -> f32| {
        let mut histogram = ArrivalHistogram::new(step_s, 0.0);
        for (step, energy) in of_steps.iter().enumerate() {
            histogram.add_of_few(step as f32 * step_s, energy, variance);
        }
        histogram.late = std::array::from_fn(|bin| bins(&as_before, bin));
        let mut late = LateEnergy::silent(SourceId::default());
        late.mean_free_time_s = STEPS_PER_FREE_TIME * step_s;
        histogram.fit(&columns, &air, 1.0, &mut late);
        let [from, to] = [130.0f32, 170.0].map(|step| f64::from((step - 0.5) * step_s));
        let expected = (130..170).map(|step| expected(step as f32));
        let expected = f64::from(expected.sum::<f32>());
        10.0 * (energy_within(&late, &groups, from, to) / expected).log10()
    };
    let (few, many) = (off_db(100.0, &level), off_db(0.0, &as_before));
    assert!(few.abs() < 3.0, "{few} dB");
    assert!(many.abs() < 3.0, "{many} dB");
}
