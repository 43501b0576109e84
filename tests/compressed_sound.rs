//! FLAC and Ogg Vorbis files: what was encoded comes out, and damaged files are refused in few words.
//!
//! The seeds of the fuzz target are tones of a hundred samples a period, encoded by libsndfile 1.2.2.

use std::f64::consts::TAU;
use std::io::Cursor;

use foresound::output::compressed::{Decoded, decode, is_compressed};

const FRAMES: usize = 4410;
const FULL_SCALE: f64 = 32_768.0;

fn seed(name: &str) -> Vec<u8> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fuzz/seeds/compressed/");
    std::fs::read(format!("{folder}{name}")).expect("is there")
}

fn decoded(bytes: &[u8]) -> Result<Decoded, String> {
    decode(Cursor::new(bytes), 1 << 20)
}

/// The sample that was encoded: channel k has k periods in a hundred samples.
fn sample(frame: usize, channel: usize) -> f32 {
    let turn = TAU * (channel + 1) as f64 * frame as f64 / 100.0;
    ((8000.0 * turn.sin()).round() / FULL_SCALE) as f32
}

#[test]
fn flac_is_what_was_encoded() {
    for (name, channels, rate_hz) in [
        ("mono.flac", 1, 44_100),
        ("stereo.flac", 2, 48_000),
        ("field.flac", 4, 48_000),
    ] {
        let found = decoded(&seed(name)).expect("is whole");
        assert_eq!((found.channels, found.rate_hz), (channels, rate_hz));
        assert_eq!(found.samples.len(), FRAMES * channels);
        for (n, value) in found.samples.iter().enumerate() {
            // The rounding of halves may differ by one step.
            let wanted = sample(n / channels, n % channels);
            let step = 1.5 / FULL_SCALE as f32;
            assert!((value - wanted).abs() < step, "{name}, {n}: {value}");
        }
    }
}

#[test]
fn vorbis_sounds_like_what_was_encoded() {
    for (name, channels, rate_hz) in [("mono.ogg", 1, 44_100), ("stereo.ogg", 2, 22_050)] {
        let found = decoded(&seed(name)).expect("is whole");
        assert_eq!((found.channels, found.rate_hz), (channels, rate_hz));
        assert_eq!(found.samples.len(), FRAMES * channels, "{name}");
        let (mut error, mut energy) = (0.0, 0.0);
        for (n, value) in found.samples.iter().enumerate() {
            let wanted = sample(n / channels, n % channels);
            error += (value - wanted).powi(2);
            energy += wanted * wanted;
        }
        // The codec's own error at its usual quality; in time with the original, or it would be of the tone's energy.
        assert!(error < 0.01 * energy, "{name}: {error} of {energy}");
    }
}

#[test]
fn what_is_cut_off_damaged_or_too_long_is_refused() {
    for name in ["mono.flac", "stereo.flac", "mono.ogg"] {
        let bytes = seed(name);
        assert!(is_compressed(&bytes));
        for eighths in 0..8 {
            let cut = &bytes[..bytes.len() * eighths / 8];
            let problem = decoded(cut);
            assert!(
                name.ends_with("ogg") && eighths > 6 || problem.is_err(),
                "{name} {eighths}"
            );
        }
        let limit = decode(Cursor::new(&bytes[..]), 1000).expect_err("is longer");
        assert!(limit.contains("more than 1000 samples"), "{limit}");
    }
    let mut damaged = seed("mono.flac");
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0x55;
    assert!(decoded(&damaged).is_err());
    assert!(!is_compressed(b"RIFF") && decoded(b"RIFF and so on").is_err());
}
