//! HRTF sets from SOFA files: accuracy against the measurement, and what is refused.

use std::f64::consts::TAU;

use foresound::Hrtf;
use foresound::simd::F32x8;
use glam::Vec3;
use hdf5_pure::{AttrValue, File, FileBuilder};

/// The raw responses (assets/PROVENANCE.md).
const KEMAR: &[u8] = include_bytes!("../assets/hrtf/MIT_KEMAR_normal_pinna.sofa");

/// Phases of the interaural cross-spectrum from 0.3 to 1.5 kHz in steps of 20 Hz, by the definition of the transform.
fn cross_spectrum(ears: [&[f64]; 2], rate_hz: f64) -> Vec<[f64; 2]> {
    let bin = |hz: f64| {
        let [a, b] = ears.map(|ear| {
            let turn = TAU * hz / rate_hz;
            let terms = ear.iter().enumerate();
            terms.fold((0.0, 0.0), |(re, im), (n, sample)| {
                let (sin, cos) = (-turn * n as f64).sin_cos();
                (re + sample * cos, im + sample * sin)
            })
        });
        [a.0 * b.0 + a.1 * b.1, a.1 * b.0 - a.0 * b.1]
    };
    (0..=60).map(|n| bin(300.0 + 20.0 * f64::from(n))).collect()
}

/// The lag of the largest correlation in microseconds, tried in steps of 2; positive if the right ear is later.
fn lag_us(cross: &[[f64; 2]], further_us: f64) -> f64 {
    let correlation = |lag_us: f64| -> f64 {
        let bins = cross.iter().zip(0..);
        let terms = bins.map(|([re, im], n)| {
            let turn = TAU * (300.0 + 20.0 * f64::from(n)) * 1e-6 * (lag_us - further_us);
            re * turn.cos() + im * turn.sin()
        });
        terms.sum()
    };
    let lags = (-550..=550).map(|n| 2.0 * f64::from(n));
    let found = lags.map(|lag| (correlation(lag), lag));
    found
        .fold((f64::MIN, 0.0), |a, b| if b.0 > a.0 { b } else { a })
        .1
}

/// Where to look, from SOFA's azimuth and elevation in degrees.
fn direction(azimuth: f64, elevation: f64) -> Vec3 {
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    let across = elevation.cos();
    Vec3::new(
        (-across * azimuth.sin()) as f32,
        elevation.sin() as f32,
        (-across * azimuth.cos()) as f32,
    )
}

/// The bound is that of the issue: 20 us at 95 % of directions.
#[test]
fn interaural_delays_of_the_built_in_sets_are_measured_ones() {
    let file = File::from_bytes(KEMAR.to_vec()).unwrap();
    let positions = file.dataset("SourcePosition").unwrap().read_f64().unwrap();
    let impulses = file.dataset("Data.IR").unwrap().read_f64().unwrap();
    let taps = impulses.len() / (2 * positions.len() / 3);
    for rate_hz in [44_100, 48_000] {
        let set = Hrtf::builtin(rate_hz).unwrap();
        let mut weights = vec![F32x8::ZERO; 2 * set.groups()];
        let (mut near, mut all) = (0, 0);
        for (position, pair) in positions
            .chunks(3)
            .zip(impulses.chunks(2 * taps))
            .step_by(3)
        {
            let (left, right) = pair.split_at(taps);
            let raw = lag_us(&cross_spectrum([left, right], 44_100.0), 0.0);
            let delays = set.look_up(direction(position[0], position[1]), &mut weights);
            let ears: [Vec<f64>; 2] = std::array::from_fn(|ear| {
                let tap = |n: usize| {
                    let groups = (0..set.groups()).map(|group| {
                        let basis = set.basis(group)[n].0;
                        let of_group = weights[ear * set.groups() + group].0;
                        basis
                            .iter()
                            .zip(of_group)
                            .map(|(b, w)| f64::from(b * w))
                            .sum::<f64>()
                    });
                    groups.sum()
                };
                (0..set.taps()).map(tap).collect()
            });
            let further_us = 1e6 * f64::from(delays[1] - delays[0]) / f64::from(rate_hz);
            let cross = cross_spectrum([&ears[0], &ears[1]], f64::from(rate_hz));
            let found = lag_us(&cross, further_us);
            near += usize::from((found - raw).abs() <= 20.0);
            all += 1;
        }
        println!("{rate_hz} Hz: {near} of {all} directions within 20 us");
        assert!(
            all > 200 && near as f64 >= 0.95 * all as f64,
            "{near} of {all}"
        );
    }
}

/// A SOFA file of a sphere's onset: impulses at both ears.
struct Sphere {
    convention: &'static str,
    rate_hz: f64,
    ears: u64,
    /// Lowest height of a direction.
    least: f64,
    view: [f64; 3],
    peak: f64,
}

const GOOD: Sphere = Sphere {
    convention: "SimpleFreeFieldHRIR",
    rate_hz: 48_000.0,
    ears: 2,
    least: -1.0,
    view: [1.0, 0.0, 0.0],
    peak: 1.0,
};

/// Radius over speed of sound, in seconds.
const RADIUS_S: f64 = 0.000_25;

impl Sphere {
    fn bytes(&self) -> Vec<u8> {
        let text = |text: &str| AttrValue::AsciiString(text.into());
        let (count, taps) = (300, 128);
        let (mut positions, mut impulses) = (Vec::new(), Vec::new());
        for n in 0..count {
            let z = 1.0 - (2 * n + 1) as f64 / count as f64;
            if z < self.least {
                continue;
            }
            let azimuth = 2.4 * f64::from(n);
            positions.extend([
                azimuth.to_degrees().rem_euclid(360.0),
                z.asin().to_degrees(),
                1.4,
            ]);
            let lateral = (z.asin().cos() * azimuth.sin()).asin();
            let delay = 0.5 * RADIUS_S * (lateral + lateral.sin()) * self.rate_hz;
            for ear in 0..self.ears {
                let at = 50.0 + [-delay, delay, 0.0][ear as usize];
                // A Gaussian of two samples: its delay need not be whole.
                let sample = |n: i32| self.peak * (-0.125 * (f64::from(n) - at).powi(2)).exp();
                impulses.extend((0..taps).map(sample));
            }
        }
        let count = positions.len() as u64 / 3;
        let mut file = FileBuilder::new();
        file.set_attr("Conventions", text("SOFA"));
        file.set_attr("SOFAConventions", text(self.convention));
        let spherical = |name: &str, values: &[f64], shape: &[u64], file: &mut FileBuilder| {
            let data = file
                .create_dataset(name)
                .with_f64_data(values)
                .with_shape(shape);
            data.set_attr("Type", text("spherical"));
            data.set_attr("Units", text("degree, degree, metre"));
        };
        spherical("SourcePosition", &positions, &[count, 3], &mut file);
        let view = file
            .create_dataset("ListenerView")
            .with_f64_data(&self.view)
            .with_shape(&[1, 3]);
        view.set_attr("Type", text("cartesian"));
        let data = file.create_dataset("Data.IR").with_f64_data(&impulses);
        data.with_shape(&[count, self.ears, taps as u64]);
        file.create_dataset("Data.SamplingRate")
            .with_f64_data(&[self.rate_hz])
            .with_shape(&[1]);
        file.create_dataset("Data.Delay")
            .with_f64_data(&[0.0; 2])
            .with_shape(&[1, 2]);
        file.finish().expect("a file in memory")
    }
}

/// Sample rates of the file and of the set are independent.
#[test]
fn a_sphere_has_its_interaural_delay_at_every_sample_rate() {
    for (measured_hz, rate_hz) in [(48_000.0, 48_000), (48_000.0, 44_100), (96_000.0, 48_000)] {
        let sphere = Sphere {
            rate_hz: measured_hz,
            ..GOOD
        };
        let set = Hrtf::read(&sphere.bytes(), "sphere.sofa", rate_hz).unwrap();
        let again = Hrtf::read(&set.to_bytes(), "sphere.hrtf", rate_hz).unwrap();
        assert_eq!((set.rate_hz(), again.taps()), (rate_hz, set.taps()));
        let mut weights = vec![F32x8::ZERO; 2 * set.groups()];
        let delays = set.look_up(Vec3::NEG_X, &mut weights);
        let found_s = f64::from(delays[1] - delays[0]) / f64::from(rate_hz);
        let wanted_s = RADIUS_S * (1.0 + TAU / 4.0);
        assert!(
            (found_s - wanted_s).abs() < 20e-6,
            "{rate_hz}: {found_s} {wanted_s}"
        );
    }
}

#[test]
fn what_is_no_set_is_refused_in_words() {
    let good = GOOD.bytes();
    let cases = [
        (b"RIFF".to_vec(), "not a baked HRTF set"),
        (good[..good.len() / 2].to_vec(), "damaged SOFA file"),
        (FileBuilder::new().finish().unwrap(), "no SOFA file"),
        (
            Sphere {
                convention: "SingleRoomDRIR",
                ..GOOD
            }
            .bytes(),
            "convention is SingleRoomDRIR",
        ),
        (
            Sphere {
                rate_hz: 8000.0,
                ..GOOD
            }
            .bytes(),
            "8000 Hz",
        ),
        (Sphere { ears: 1, ..GOOD }.bytes(), "Data.IR has the shape"),
        (Sphere { least: 0.5, ..GOOD }.bytes(), "no response within"),
        (
            Sphere {
                view: [0.0, 1.0, 0.0],
                ..GOOD
            }
            .bytes(),
            "ListenerView is turned",
        ),
        (Sphere { peak: 0.0, ..GOOD }.bytes(), "peak of 0e0"),
        (
            Sphere {
                peak: f64::NAN,
                ..GOOD
            }
            .bytes(),
            "not finite",
        ),
    ];
    for (bytes, words) in cases {
        let error = Hrtf::read(&bytes, "ears.sofa", 48_000)
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with("ears.sofa: ") && error.contains(words),
            "{error}"
        );
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    assert!(Hrtf::from_sofa(&good, "ears.sofa", 8000).is_err());
}
