//! Laws of the late reverb as it sounds: *late/density*, *late/colour* and *late/coherence*, each of rendered responses.
//!
//! Density is the normalised echo density \[ABEL06\] beside that of image sources of all orders. Colour is the largest
//! correlation of the whitened late response with itself and the deviation of its spectrum, beside that of noise that decays
//! alike. Coherence is that of the two ears in thirds of an octave while the head turns, beside an integral of the HRTF set
//! over the sphere.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Quat, Vec3};
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use super::shoebox::oracle as shoebox;
use super::{Case, Row, rooms};
use crate::room_parameters::room_parameters;
use foresound::acoustics::BANDS;
use foresound::error::Result;
use foresound::extrapolation::{Extrapolator, FramePaths, LateGroup, LateSend, PredictorKind};
use foresound::generation::{Generator, GeneratorSettings, Hrtf};
use foresound::propagation::PropagationSettings;
use foresound::scene::{ListenerPose, SourceId, SourcePose};

pub(super) const RATE_HZ: u32 = 48_000;

/// Length of a response in seconds.
const LENGTH_S: f64 = 1.8;

/// Rooms of 12 and 90 m³, by size.
const ROOMS: [[f64; 3]; 2] = [[3.0, 2.0, 2.0], [6.0, 3.0, 5.0]];

/// Absorption and scattering of their walls.
const ABSORPTION: f32 = 0.1;
const SCATTERING: f32 = 0.1;

/// Window of the echo density in seconds.
const WINDOW_S: f64 = 0.02;

/// Share of samples of a normal distribution beyond its standard deviation.
const NORMAL_SHARE: f64 = 0.317_310_5;

/// Density from which a response counts as dense, and windows in a row that have to reach it.
const DENSE: f64 = 0.9;
const DENSE_WINDOWS: usize = 4;

/// Density may come later than the reference's by this factor, or at this time in seconds if that is later.
const DENSITY_FACTOR: f64 = 1.2;
const DENSITY_S: f64 = 0.04;

/// A room's response at two ears and at a point, and the image sources' response at the point.
struct Response {
    name: String,
    ears: [Vec<f32>; 2],
    omni: Vec<f32>,
    images: Vec<f32>,
    /// Arrival of the direct sound in frames.
    direct: usize,
}

impl Response {
    fn of(size: [f64; 3]) -> Result<Self> {
        let wide = |share: [f64; 3]| std::array::from_fn::<f64, 3, _>(|a| share[a] * size[a]);
        let (source, listener) = (wide([0.24, 0.59, 0.31]), wide([0.71, 0.44, 0.66]));
        let narrow = |p: [f64; 3]| Vec3::from(p.map(|v| v as f32));
        let scene = rooms::uniform(narrow(size), ABSORPTION, SCATTERING)?;
        let settings = PropagationSettings::default();
        let min_distance_m = settings.min_distance_m;
        let mut probe = rooms::Probe::new(&scene, narrow(source), settings)?;
        for _ in 0..16 {
            probe.update(narrow(listener));
        }
        let ear = ListenerPose::facing(narrow(listener), 0.0);
        let poses = [SourcePose::at(SourceId::new(0, 0), narrow(source))];
        let kind = PredictorKind::Hold;
        let mut extrapolator = Extrapolator::new(Arc::clone(&scene), kind, min_distance_m);
        extrapolator.store_update(probe.set, 1);
        let mut frame = FramePaths::default();
        extrapolator.frame(&ear, &poses, &mut frame);
        let [left, right] = render(&frame, &Arc::new(Hrtf::builtin(RATE_HZ)?), 0, LENGTH_S)?;
        let omni = Arc::new(Hrtf::omnidirectional(RATE_HZ)?);
        let [point, _] = render(&frame, &omni, 0, LENGTH_S)?;

        let room = shoebox::Room {
            size,
            absorption: [[f64::from(ABSORPTION); BANDS]; 6],
            scattering: [[0.0; BANDS]; 6],
            air_np_per_m: scene.air_np_per_m().map(f64::from),
        };
        let frames_per_m = f64::from(RATE_HZ) / scene.speed_of_sound_m_s();
        let mut images = vec![0.0; (0.4 * f64::from(RATE_HZ)) as usize];
        let reach_m = images.len() as f64 / frames_per_m;
        for image in shoebox::images_within(&room, source, listener, reach_m) {
            if let Some(sample) = images.get_mut((image.length_m * frames_per_m) as usize) {
                *sample += image.amplitude[4] as f32;
            }
        }
        let distance_m = narrow(source).distance(narrow(listener));
        Ok(Self {
            name: format!("{:.0} m3", size.iter().product::<f64>()),
            ears: [left, right],
            omni: point,
            images,
            direct: (f64::from(distance_m) * frames_per_m) as usize,
        })
    }
}

/// The response of both ears to an impulse from the source in a slot.
pub(super) fn render(
    frame: &FramePaths,
    hrtf: &Arc<Hrtf>,
    slot: usize,
    length_s: f64,
) -> Result<[Vec<f32>; 2]> {
    let settings = GeneratorSettings {
        rate_hz: RATE_HZ,
        max_sources: slot + 1,
        limiter: false,
        ..GeneratorSettings::default()
    };
    let mut generator = Generator::new(settings, Arc::clone(hrtf))?;
    generator.set_frame(frame, 1);
    let frames = (length_s * f64::from(RATE_HZ)) as usize;
    // Paths fade in during the first frame.
    let lead = 64;
    let mut input = vec![0.0; lead + frames];
    input[lead] = 1.0;
    let mut output = vec![0.0; 2 * input.len()];
    let silence: &[f32] = &[];
    let mut inputs = vec![silence; slot + 1];
    inputs[slot] = &input;
    generator.render(&inputs, &mut output);
    let start = lead + generator.latency_frames();
    let ear = |ear: usize| {
        output[2 * start..]
            .chunks_exact(2)
            .map(|pair| pair[ear])
            .collect()
    };
    Ok([ear(0), ear(1)])
}

/// Law *late/density*.
pub(super) fn density() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for size in ROOMS {
        let response = Response::of(size)?;
        let after = |signal: &[f32]| {
            let at = dense_from_s(&signal[response.direct..]);
            at.unwrap_or(f64::INFINITY)
        };
        let reference = after(&response.images);
        let bound = f64::max(DENSITY_FACTOR * reference, DENSITY_S);
        let mut case = Case::new(format!("late/density: {}", response.name));
        let [left, right] = &response.ears;
        for (what, signal) in [
            ("point", &response.omni),
            ("left ear", left),
            ("right ear", right),
        ] {
            case.at_most(what, 1e3 * after(signal), 1e3 * bound, "ms");
        }
        rows.append(&mut case.rows);
    }
    Ok(rows)
}

/// Time in seconds from which a response is dense, to the middle of the window.
fn dense_from_s(response: &[f32]) -> Option<f64> {
    let width = (WINDOW_S * f64::from(RATE_HZ)) as usize | 1;
    let weight = |n: usize| 0.5 - 0.5 * (TAU * n as f64 / (width - 1) as f64).cos();
    let sum: f64 = (0..width).map(weight).sum();
    let density = |window: &[f32]| {
        let weighted = |value: &dyn Fn(f64) -> f64| -> f64 {
            let each = window.iter().enumerate();
            each.map(|(n, v)| weight(n) / sum * value(f64::from(*v)))
                .sum()
        };
        let deviation = weighted(&|v| v * v).sqrt();
        weighted(&|v| f64::from(u8::from(v.abs() > deviation))) / NORMAL_SHARE
    };
    let step = width / 8;
    let densities: Vec<f64> = response.windows(width).step_by(step).map(density).collect();
    let dense = |run: &[f64]| run.iter().all(|density| *density >= DENSE);
    let first = densities.windows(DENSE_WINDOWS).position(dense)?;
    Some((first * step) as f64 / f64::from(RATE_HZ) + 0.5 * WINDOW_S)
}

/// Law *late/colour*.
pub(super) fn colour() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for size in ROOMS {
        let response = Response::of(size)?;
        let t60_s = room_parameters(&response.omni, RATE_HZ).bands[4]
            .t30_s
            .unwrap_or(0.5);
        let mean = |figures: &[Colour]| {
            let count = figures.len() as f64;
            let sum = |value: fn(&Colour) -> f64| figures.iter().map(value).sum::<f64>() / count;
            [sum(|c| c.deviation_db), sum(|c| c.correlation)]
        };
        let noises: Vec<_> = (0..8)
            .map(|seed| Colour::of(&decaying_noise(seed, t60_s), t60_s))
            .collect();
        let [noise_db, noise_correlation] = mean(&noises);
        let late = |signal: &[f32]| Colour::of(&signal[response.direct..], t60_s);
        let [left, right] = &response.ears;
        let ears = [late(left), late(right)];
        let mut case = Case::new(format!(
            "late/colour: {}, T60 {t60_s:.2} s, noise {noise_correlation:.2}",
            response.name
        ));
        for (what, figures) in [("point", &[late(&response.omni)][..]), ("ears", &ears)] {
            let [deviation_db, correlation] = mean(figures);
            case.at_most(&format!("{what}, autocorrelation"), correlation, 0.1, "");
            let what = format!("{what}, spectrum");
            case.at_most(&what, deviation_db, noise_db + 0.5, "dB");
        }
        rows.append(&mut case.rows);
    }
    Ok(rows)
}

/// Normally distributed noise that decays.
fn decaying_noise(seed: u64, t60_s: f64) -> Vec<f32> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1;
    let mut unit = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    (0..(LENGTH_S * f64::from(RATE_HZ)) as usize)
        .map(|n| {
            let normal = (-2.0 * unit().ln()).sqrt() * (TAU * unit()).cos();
            let time_s = n as f64 / f64::from(RATE_HZ);
            (normal * 10f64.powf(-3.0 * time_s / t60_s)) as f32
        })
        .collect()
}

/// How far a late response is from noise.
struct Colour {
    /// Standard deviation of its level over frequency, 0.3 to 4 kHz, without the slow trend.
    deviation_db: f64,
    /// Largest correlation with itself after 5 to 120 ms, whitened and without the decay.
    correlation: f64,
}

impl Colour {
    /// Of what is 0.2 to 1.0 T60 after the response's beginning.
    fn of(response: &[f32], t60_s: f64) -> Self {
        let rate = f64::from(RATE_HZ);
        let start = (0.2 * t60_s * rate) as usize;
        let length = (f64::min(1.5, 0.8 * t60_s) * rate) as usize;
        let end = response.len().min(start + length);
        let part: Vec<f64> = response[start..end].iter().map(|v| f64::from(*v)).collect();
        let power = power(&part, part.len());
        let hz = rate / part.len() as f64;
        let inside: Vec<f64> = (0..power.len())
            .filter(|bin| (300.0..4000.0).contains(&(*bin as f64 * hz)))
            .map(|bin| power[bin])
            .collect();
        let trend = smoothed(&inside, 401);
        let edge = 200.min(inside.len() / 4);
        let levels: Vec<f64> = (edge..inside.len() - edge)
            .map(|n| 10.0 * (inside[n] / trend[n] + 1e-30).log10())
            .collect();
        let mean = levels.iter().sum::<f64>() / levels.len() as f64;
        let squares: f64 = levels.iter().map(|level| (level - mean).powi(2)).sum();
        Self {
            deviation_db: (squares / levels.len() as f64).sqrt(),
            correlation: correlation(&part, t60_s),
        }
    }
}

/// Largest magnitude of the whitened autocorrelation after 5 to 120 ms.
fn correlation(part: &[f64], t60_s: f64) -> f64 {
    let rate = f64::from(RATE_HZ);
    let undone = |(n, v): (usize, &f64)| v * 10f64.powf(3.0 * n as f64 / rate / t60_s);
    let part: Vec<f64> = part.iter().enumerate().map(undone).collect();
    let length = (2 * part.len()).next_power_of_two();
    let power = power(&part, length);
    let trend = smoothed(&power, 801);
    let whitened = |(bin, trend): (usize, &f64)| {
        let is_inside = (300.0..8000.0).contains(&(bin as f64 * rate / length as f64));
        Complex::new(
            if is_inside {
                power[bin] / trend.max(1e-30)
            } else {
                0.0
            },
            0.0,
        )
    };
    let mut spectrum: Vec<_> = trend.iter().enumerate().map(whitened).collect();
    let inverse = RealFftPlanner::<f64>::new().plan_fft_inverse(length);
    let mut found = inverse.make_output_vec();
    // Fails for wrong lengths alone.
    let _ = inverse.process(&mut spectrum, &mut found);
    let lags = (0.005 * rate) as usize..(0.12 * rate) as usize;
    let largest = found[lags].iter().fold(0.0, |m, v| f64::max(m, v.abs()));
    largest / found[0]
}

/// Squared magnitudes of the spectrum of a signal padded to a length.
pub(super) fn power(signal: &[f64], length: usize) -> Vec<f64> {
    spectrum(signal, length)
        .iter()
        .map(|v| v.norm_sqr())
        .collect()
}

fn spectrum(signal: &[f64], length: usize) -> Vec<Complex<f64>> {
    let forward = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let mut input = forward.make_input_vec();
    let count = signal.len().min(length);
    input[..count].copy_from_slice(&signal[..count]);
    let mut spectrum = forward.make_output_vec();
    // Fails for wrong lengths alone.
    let _ = forward.process(&mut input, &mut spectrum);
    spectrum
}

/// Mean over `width` neighbours, zeros beyond the ends.
fn smoothed(values: &[f64], width: usize) -> Vec<f64> {
    let mut sums = vec![0.0; values.len() + 1];
    for (n, value) in values.iter().enumerate() {
        sums[n + 1] = sums[n] + value;
    }
    let half = width / 2;
    (0..values.len())
        .map(|n| {
            let (from, to) = (n.saturating_sub(half), (n + half + 1).min(values.len()));
            (sums[to] - sums[from]) / width as f64
        })
        .collect()
}

/// Turns of the head, and responses of other sources and groups over which the coherence is taken.
const TURNS: usize = 12;
const SLOTS: usize = 4;
const GROUPS: u8 = 3;

/// Directions of the integral over the sphere.
const DIRECTIONS: usize = 2000;

/// Law *late/coherence*.
pub(super) fn coherence() -> Result<Vec<Row>> {
    let hrtf = Arc::new(Hrtf::builtin(RATE_HZ)?);
    let reference = diffuse_coherence(&hrtf);
    let (mut sum, mut worst_level_db, mut count) = (0.0, 0.0f64, 0);
    let mut levels_db = [Vec::new(), Vec::new()];
    for turn in 0..TURNS {
        let orientation = Quat::from_rotation_y((TAU * turn as f64 / TURNS as f64 + 0.03) as f32);
        let mut bands = Bands::default();
        for slot in 0..SLOTS {
            for group in 0..GROUPS {
                let frame = FramePaths {
                    orientation,
                    late: vec![LateSend {
                        source: SourceId::new(slot as u16, 0),
                        group,
                        energy_per_s: [1.0; BANDS],
                        start_s: 0.02,
                    }],
                    late_groups: [LateGroup::isotropic([1.5; BANDS]); 3],
                    ..FramePaths::default()
                };
                let [left, right] = render(&frame, &hrtf, slot, 1.3)?;
                let transform = |signal: &[f32]| {
                    let signal: Vec<f64> = signal.iter().map(|v| f64::from(*v)).collect();
                    spectrum(&signal, 1 << 16)
                };
                bands.add(&transform(&left), &transform(&right), 1.0);
            }
        }
        for (found, exact) in bands.coherence().iter().zip(reference.coherence()) {
            sum += (found - exact).norm_sqr();
            count += 1;
        }
        for (levels, powers) in levels_db.iter_mut().zip(bands.powers()) {
            levels.push(powers);
        }
    }
    for levels in &levels_db {
        for band in 0..levels[0].len() {
            let mean = levels.iter().map(|l| l[band]).sum::<f64>() / levels.len() as f64;
            for level in levels {
                worst_level_db = worst_level_db.max((10.0 * (level[band] / mean).log10()).abs());
            }
        }
    }
    let rms = (sum / f64::from(count)).sqrt();
    Ok(vec![
        Row::at_most("late/coherence: isotropic, 12 turns, rms", rms, 0.1, ""),
        Row::at_most(
            "late/coherence: level over the turns, worst third",
            worst_level_db,
            1.5,
            "dB",
        ),
    ])
}

/// Sums of the ears' spectra in thirds of an octave from 125 Hz to 6.3 kHz.
#[derive(Default)]
struct Bands {
    left: [f64; 18],
    right: [f64; 18],
    cross: [Complex<f64>; 18],
}

impl Bands {
    /// Adds two spectra of a response with this weight.
    fn add(&mut self, left: &[Complex<f64>], right: &[Complex<f64>], weight: f64) {
        let hz = 0.5 * f64::from(RATE_HZ) / (left.len() - 1) as f64;
        for (bin, (left, right)) in left.iter().zip(right).enumerate().skip(1) {
            let band = (3.0 * (bin as f64 * hz / 125.0).log2()).round();
            if (0.0..18.0).contains(&band) {
                let band = band as usize;
                self.left[band] += weight * left.norm_sqr();
                self.right[band] += weight * right.norm_sqr();
                self.cross[band] += weight * left * right.conj();
            }
        }
    }

    fn coherence(&self) -> [Complex<f64>; 18] {
        std::array::from_fn(|band| self.cross[band] / (self.left[band] * self.right[band]).sqrt())
    }

    fn powers(&self) -> [[f64; 18]; 2] {
        [self.left, self.right]
    }
}

/// The HRTF set's own response, integrated over a spiral of directions.
fn diffuse_coherence(hrtf: &Hrtf) -> Bands {
    let length = 2048;
    let groups = hrtf.groups();
    let mut filters = Vec::new();
    for group in 0..groups {
        for lane in 0..8 {
            let taps: Vec<f64> = hrtf
                .basis(group)
                .iter()
                .map(|tap| f64::from(tap.0[lane]))
                .collect();
            filters.push(spectrum(&taps, length));
        }
    }
    let mut bands = Bands::default();
    let mut weights = vec![foresound::simd::F32x8::default(); 2 * groups];
    for n in 0..DIRECTIONS {
        let up = 1.0 - (2 * n + 1) as f64 / DIRECTIONS as f64;
        let angle = PI * (3.0 - 5f64.sqrt()) * n as f64;
        let across = (1.0 - up * up).sqrt();
        let direction = [across * angle.cos(), up, across * angle.sin()].map(|v| v as f32);
        let delays = hrtf.look_up(Vec3::from(direction), &mut weights);
        let ears = [0, 1].map(|ear| -> Vec<Complex<f64>> {
            let own = &weights[ear * groups..][..groups];
            let own: Vec<f64> = own.iter().flat_map(|w| w.0).map(f64::from).collect();
            (0..=length / 2)
                .map(|bin| {
                    let sum: Complex<f64> = own.iter().zip(&filters).map(|(w, f)| f[bin] * w).sum();
                    let phase = TAU * bin as f64 / length as f64 * f64::from(delays[ear]);
                    sum * Complex::from_polar(1.0, -phase)
                })
                .collect()
        });
        bands.add(&ears[0], &ears[1], 1.0);
    }
    bands
}
