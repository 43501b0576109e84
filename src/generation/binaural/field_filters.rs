//! The filters by which a first-order sound field reaches two ears.
//!
//! Construction: control side; some milliseconds. Below 2 kHz the responses of an HRTF set are projected on the four signals of
//! the field. Above, where four signals cannot carry the phases between the ears, they match the magnitudes (\[SCHORKHUBER18\]):
//! the phase of each frequency goes on from the one below. The mean energy over all directions is that of the set at every
//! frequency. Adapted: the energy is kept an ear, without the coherence between the ears.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::generation::Hrtf;
use crate::simd::F32x8;

/// Directions of the projection: many more than the four signals.
const DIRECTIONS: usize = 64;
/// Frequency in Hz from which magnitudes are matched.
const MAGNITUDES_FROM_HZ: f64 = 2000.0;
/// Delay of all filters in frames: room for what precedes the direct sound.
const DELAY: usize = 32;
/// Frames of the fade at the end of a filter.
const FADE: usize = 32;

/// A complex number as real and imaginary part.
type Complex = [f64; 2];

fn add_product(sum: &mut Complex, a: Complex, b: Complex) {
    sum[0] += a[0] * b[0] - a[1] * b[1];
    sum[1] += a[0] * b[1] + a[1] * b[0];
}

fn cis(phase: f64) -> Complex {
    let (sin, cos) = phase.sin_cos();
    [cos, sin]
}

fn size(value: Complex) -> f64 {
    value[0].hypot(value[1])
}

/// Even directions in head coordinates, on a spiral.
fn direction(index: usize) -> DVec3 {
    let up = 1.0 - (2 * index + 1) as f64 / DIRECTIONS as f64;
    let (sin, cos) = (PI * (3.0 - 5f64.sqrt()) * index as f64).sin_cos();
    let across = (1.0 - up * up).sqrt();
    DVec3::new(across * cos, up, across * sin)
}

/// The projection of responses to all directions on the field's signals: the omnidirectional one and the three components.
fn project(responses: &[Complex; DIRECTIONS], directions: &[DVec3; DIRECTIONS]) -> [Complex; 4] {
    let mut signals = [[0.0; 2]; 4];
    for (response, direction) in responses.iter().zip(directions) {
        let factors = [1.0, 3.0 * direction.x, 3.0 * direction.y, 3.0 * direction.z];
        for (signal, factor) in signals.iter_mut().zip(factors) {
            for (sum, part) in signal.iter_mut().zip(response) {
                *sum += part * factor / DIRECTIONS as f64;
            }
        }
    }
    signals
}

/// The response to a plane wave from a direction.
fn towards(signals: &[Complex; 4], direction: DVec3) -> Complex {
    let factors = [1.0, direction.x, direction.y, direction.z];
    let mut sum = [0.0; 2];
    for (signal, factor) in signals.iter().zip(factors) {
        for (sum, part) in sum.iter_mut().zip(signal) {
            *sum += part * factor;
        }
    }
    sum
}

/// The taps of the filters, from the first: of the left ear for the omnidirectional signal and the components along +x, +y and +z
/// in head coordinates, then those of the right.
pub(crate) fn field_filters(hrtf: &Hrtf) -> Vec<F32x8> {
    if hrtf.taps() == 1 && hrtf.max_delay() == 0.0 {
        // Ears without a head: the omnidirectional signal, and the set's only filter.
        return omnidirectional(hrtf);
    }
    let reach = hrtf.taps() + hrtf.max_delay().ceil() as usize + DELAY;
    let length = (2 * reach).next_power_of_two();
    let bins = length / 2 + 1;
    let turns: Vec<Complex> = (0..length)
        .map(|n| cis(-TAU * n as f64 / length as f64))
        .collect();
    let directions: [DVec3; DIRECTIONS] = std::array::from_fn(direction);
    let width = hrtf.groups();
    let mut weights = vec![F32x8::ZERO; 2 * width];
    let mut of_direction = Vec::with_capacity(DIRECTIONS);
    for direction in directions {
        let delays = hrtf.look_up(direction.as_vec3(), &mut weights);
        of_direction.push((delays, weights.clone()));
    }
    // Of all directions: what is continued from one frequency to the next keeps this delay.
    let mean_delays = [0, 1].map(|ear| {
        let all = of_direction
            .iter()
            .map(|(delays, _)| f64::from(delays[ear]));
        all.sum::<f64>() / DIRECTIONS as f64 + DELAY as f64
    });
    let mut spectra = [const { Vec::new() }; 2];
    let mut before = [[[0.0; 2]; 4]; 2];
    for bin in 0..bins {
        let components: Vec<Complex> = (0..8 * width)
            .map(|component| {
                let (group, lane) = (component / 8, component % 8);
                let mut sum = [0.0; 2];
                for (tap, value) in hrtf.basis(group).iter().enumerate() {
                    let turn = turns[bin * tap % length];
                    add_product(&mut sum, [f64::from(value.0[lane]), 0.0], turn);
                }
                sum
            })
            .collect();
        let hz = bin as f64 * f64::from(hrtf.rate_hz()) / length as f64;
        for ear in 0..2 {
            let mut responses = [[0.0; 2]; DIRECTIONS];
            for (response, (delays, weights)) in responses.iter_mut().zip(&of_direction) {
                let mut sum = [0.0; 2];
                let lanes = weights[ear * width..][..width].iter();
                for (weight, component) in lanes.flat_map(|group| group.0).zip(&components) {
                    add_product(&mut sum, [f64::from(weight), 0.0], *component);
                }
                let delay = f64::from(delays[ear]) + DELAY as f64;
                let later = cis(-TAU * bin as f64 * delay / length as f64);
                add_product(response, sum, later);
            }
            let energy: f64 = responses.iter().map(|r| size(*r).powi(2)).sum();
            if hz >= MAGNITUDES_FROM_HZ {
                let step = cis(-TAU * mean_delays[ear] / length as f64);
                for (response, direction) in responses.iter_mut().zip(directions) {
                    let mut phase = [0.0; 2];
                    add_product(&mut phase, towards(&before[ear], direction), step);
                    let scale = size(*response) / size(phase).max(f64::MIN_POSITIVE);
                    *response = phase.map(|part| part * scale);
                }
            }
            let mut signals = project(&responses, &directions);
            let heard = directions.map(|direction| size(towards(&signals, direction)).powi(2));
            let gain = (energy / heard.iter().sum::<f64>().max(f64::MIN_POSITIVE)).sqrt();
            for part in signals.as_flattened_mut() {
                *part *= gain;
            }
            before[ear] = signals;
            spectra[ear].push(signals);
        }
    }
    let taps = length / 2;
    let mut filters = vec![F32x8::ZERO; taps];
    for (tap, lanes) in filters.iter_mut().enumerate() {
        let left = (taps - tap) as f64 / FADE as f64;
        let fade = 0.5 - 0.5 * (PI * left.min(1.0)).cos();
        for (ear, spectrum) in spectra.iter().enumerate() {
            for (bin, signals) in spectrum.iter().enumerate() {
                // The conjugate of the forward transform; the bins between the ends count twice.
                let turn = turns[bin * tap % length];
                let count = if bin == 0 || bin == length / 2 {
                    1.0
                } else {
                    2.0
                };
                for (signal, value) in signals.iter().enumerate() {
                    let part = value[0] * turn[0] + value[1] * turn[1];
                    lanes.0[4 * ear + signal] += (fade * count * part / length as f64) as f32;
                }
            }
        }
    }
    filters
}

fn omnidirectional(hrtf: &Hrtf) -> Vec<F32x8> {
    let width = hrtf.groups();
    let mut weights = vec![F32x8::ZERO; 2 * width];
    hrtf.look_up(Vec3::NEG_Z, &mut weights);
    let mut taps = F32x8::ZERO;
    for ear in 0..2 {
        let groups = weights[ear * width..][..width].iter().enumerate();
        taps.0[4 * ear] = groups
            .map(|(group, weight)| {
                let lanes = weight.0.iter().zip(hrtf.basis(group)[0].0);
                lanes.map(|(weight, value)| weight * value).sum::<f32>()
            })
            .sum();
    }
    vec![taps]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generation::synthetic_hrtf;

    /// Energy of an ear over all frequencies, for a plane wave from a direction.
    fn energy(filters: &[F32x8], ear: usize, direction: Vec3) -> f32 {
        let factors = [1.0, direction.x, direction.y, direction.z];
        let heard = filters.iter().map(|tap| {
            let lanes = tap.0[4 * ear..4 * ear + 4].iter().zip(factors);
            lanes.map(|(tap, factor)| tap * factor).sum::<f32>()
        });
        heard.map(|sample| sample * sample).sum()
    }

    #[test]
    fn the_near_ear_is_louder_and_earlier_and_the_mean_is_the_sets() {
        let set = Hrtf::parse(&synthetic_hrtf::bytes(44_100), "synthetic").unwrap();
        let filters = field_filters(&set);
        let [near, far] = [0, 1].map(|ear| energy(&filters, ear, Vec3::NEG_X));
        assert!(near > 1.5 * far, "{near} {far}");
        let mean = |ear: usize| {
            let all = (0..DIRECTIONS).map(|n| energy(&filters, ear, direction(n).as_vec3()));
            all.sum::<f32>() / DIRECTIONS as f32
        };
        // The set's own mean energy, from its weights and filters.
        let mut weights = vec![F32x8::ZERO; 2 * set.groups()];
        let mut own = 0.0;
        for n in 0..DIRECTIONS {
            set.look_up(direction(n).as_vec3(), &mut weights);
            for tap in 0..set.taps() {
                let groups = 0..set.groups();
                let sum: f32 = groups
                    .flat_map(|group| {
                        let lanes = weights[group].0.into_iter();
                        lanes.zip(set.basis(group)[tap].0)
                    })
                    .map(|(weight, value)| weight * value)
                    .sum();
                own += sum * sum / DIRECTIONS as f32;
            }
        }
        // What the window cuts off is 2 % of the energy at most.
        assert!((mean(0) / own - 1.0).abs() < 0.02, "{} {own}", mean(0));
        let difference = 10.0 * (mean(1) / mean(0)).log10();
        assert!(difference.abs() < 0.2, "{difference} dB");
    }

    #[test]
    fn without_a_head_the_omnidirectional_signal_is_heard() {
        let set = Hrtf::omnidirectional(48_000).unwrap();
        let expected = F32x8([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(field_filters(&set), [expected]);
    }
}
