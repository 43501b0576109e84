//! Wideband PESQ against the ITU's own program, on degradations that both sides compute alike.
//!
//! `tests/reference/pesq_scores.py` computed the figures (PyPI pesq 0.0.4, scipy's resampler).

use foresound_tools::clip::load_clip;
use foresound_tools::pesq::{HIGHEST, pesq_wideband};

const RATE_HZ: u32 = 44_100;

/// Voice, degradation, the ITU program's score.
const SCORES: [(&str, &str, f64); 26] = [
    ("voice01", "identical", 4.6439),
    ("voice01", "half", 4.6439),
    ("voice01", "noise_30_db", 2.6105),
    ("voice01", "noise_15_db", 1.2771),
    ("voice01", "noise_5_db", 1.0465),
    ("voice01", "low_pass", 4.6422),
    ("voice01", "high_pass", 4.5922),
    ("voice01", "clipped", 1.1469),
    ("voice01", "coarse", 2.1073),
    ("voice01", "delayed", 4.0574),
    ("voice01", "echo", 1.1003),
    ("voice01", "lost", 1.3968),
    ("voice01", "slow_delay", 4.5304),
    ("voice05", "identical", 4.6439),
    ("voice05", "half", 4.6439),
    ("voice05", "noise_30_db", 2.7137),
    ("voice05", "noise_15_db", 1.3462),
    ("voice05", "noise_5_db", 1.0675),
    ("voice05", "low_pass", 4.6033),
    ("voice05", "high_pass", 4.5999),
    ("voice05", "clipped", 1.2203),
    ("voice05", "coarse", 2.2605),
    ("voice05", "delayed", 4.0043),
    ("voice05", "echo", 1.2111),
    ("voice05", "lost", 1.5847),
    ("voice05", "slow_delay", 4.5729),
];

/// Largest deviation: resamplers differ above 7 kHz, where the model has little weight.
const LIMIT: f64 = 0.02;

/// Largest deviation with a slowly varying delay, which the crate aligns less finely.
const SLOW_DELAY_LIMIT: f64 = 0.15;

fn noise(count: usize) -> Vec<f64> {
    let mut state = 1u32;
    (0..count)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(1u32 << 31) - 1.0
        })
        .collect()
}

fn delayed(x: &[f64], count: usize) -> Vec<f64> {
    let mut late = vec![0.0; count];
    late.extend_from_slice(&x[..x.len() - count]);
    late
}

fn slowly_delayed(x: &[f64], depth: f64, hz: f64) -> Vec<f64> {
    let pick = |i: f64| {
        if i < 0.0 {
            0.0
        } else {
            x.get(i as usize).copied().unwrap_or(0.0)
        }
    };
    (0..x.len())
        .map(|n| {
            let phase = std::f64::consts::TAU * hz * n as f64 / f64::from(RATE_HZ);
            let at = n as f64 - depth * (1.0 - phase.cos());
            let low = at.floor();
            pick(low) + (at - low) * (pick(low + 1.0) - pick(low))
        })
        .collect()
}

fn degraded(x: &[f64], name: &str) -> Vec<f64> {
    let level = (x.iter().map(|s| s * s).sum::<f64>() / x.len() as f64).sqrt();
    let noisy = |db: f64| -> Vec<f64> {
        let gain = level * 3f64.sqrt() * 10f64.powf(db / 20.0);
        let hiss = noise(x.len());
        x.iter().zip(hiss).map(|(s, n)| s + gain * n).collect()
    };
    let mut state = 0.0;
    let low: Vec<f64> = x
        .iter()
        .map(|s| {
            state = 0.25 * s + 0.75 * state;
            state
        })
        .collect();
    let each = |f: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
        x.iter().enumerate().map(|(n, s)| f(n, *s)).collect()
    };
    match name {
        "identical" => x.to_vec(),
        "half" => each(&|_, s| 0.5 * s),
        "noise_30_db" => noisy(-30.0),
        "noise_15_db" => noisy(-15.0),
        "noise_5_db" => noisy(-5.0),
        "low_pass" => low,
        "high_pass" => each(&|n, s| s - low[n]),
        "clipped" => each(&|_, s| s.clamp(-0.1, 0.1)),
        "coarse" => each(&|_, s| (s * 64.0).round_ties_even() / 64.0),
        "delayed" => delayed(x, 1000),
        "echo" => {
            let late = delayed(x, 4000);
            each(&|n, s| s + 0.5 * late[n])
        }
        "lost" => each(&|n, s| if n / 882 % 10 == 9 { 0.0 } else { s }),
        "slow_delay" => slowly_delayed(x, 40.0, 0.5),
        other => unreachable!("{other} is no degradation"),
    }
}

#[test]
fn scores_equal_those_of_the_standard_s_program() {
    for (voice, name, score) in SCORES {
        let file = format!(
            "{}/../assets/speech/{voice}.wav",
            env!("CARGO_MANIFEST_DIR")
        );
        let (clip, _) = load_clip(file, RATE_HZ).expect("a voice");
        let clean = &clip.samples[..4 * RATE_HZ as usize];
        let wide: Vec<f64> = clean.iter().map(|s| f64::from(*s)).collect();
        let estimate: Vec<f32> = degraded(&wide, name).iter().map(|s| *s as f32).collect();
        let found = pesq_wideband(clean, &estimate, RATE_HZ)
            .expect("long")
            .expect("speech");
        println!("{voice} {name}: {found:.4}, the standard's program {score:.4}");
        let slow = name == "slow_delay";
        let limit = if slow { SLOW_DELAY_LIMIT } else { LIMIT };
        assert!(
            (found - score).abs() <= limit,
            "{voice} {name}: {found:.4} for {score:.4}"
        );
    }
}

#[test]
fn identity_has_the_highest_score() {
    let file = format!(
        "{}/../assets/speech/voice02.wav",
        env!("CARGO_MANIFEST_DIR")
    );
    let (clip, _) = load_clip(file, RATE_HZ).expect("a voice");
    let found = pesq_wideband(&clip.samples, &clip.samples, RATE_HZ).expect("long");
    let found = found.expect("speech");
    assert!((found - HIGHEST).abs() < 1e-3, "{found}");
}

#[test]
fn a_sound_without_length_is_refused_and_silence_has_no_score() {
    assert!(pesq_wideband(&[], &[], RATE_HZ).is_err());
    assert!(pesq_wideband(&[0.1; 100], &[0.1; 100], RATE_HZ).is_err());
    let silence = vec![0.0; 2 * RATE_HZ as usize];
    assert_eq!(pesq_wideband(&silence, &silence, RATE_HZ).ok(), Some(None));
}
