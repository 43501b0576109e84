//! The wave of an edge of finite length: the share that remains of an infinite edge's wave.
//!
//! Pure arithmetic, any thread, bounded. The line integral along the edge (\[SVENSSON99\]) near the crossing is
//! √x/π ∫ e^(−js²)/(s² + x) ds, where s² is the phase by which a path through a point of the edge exceeds the shortest one,
//! and x the transition function's argument: over all s it is the transition function. The part beyond an end is
//! G(a, u) = a/π ∫ e^(−js²)/(s² + a²) ds from u on, a = √x, the vertex's transition function (\[ALBANI09\], here
//! with the symmetry of \[OWEN56\]'s integral of the same form).

use std::f64::consts::{FRAC_1_PI, PI};

use crate::acoustics::{BANDS, smoothstep};
use crate::propagation::diffraction::complex::{Complex, ComplexBands};
use crate::propagation::diffraction::transition::transition;

/// Phase in radians from which the part beyond an end no longer interferes with the edge's wave within an octave, and the
/// phase where it begins to fade.
const SEPARATE_PHASE: f64 = 2.0 * PI;
const JOINED_PHASE: f64 = PI;

/// Phase from which the asymptotic form is used.
const FAR_PHASE: f64 = 2.0 * PI;

/// Nodes and weights of Gauss and Legendre's rule of order eight on 0 to 1.
const GAUSS: [(f64, f64); 8] = [
    (0.019_855_071_751_231_856, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_64, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_64),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_64),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_24),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13),
];

/// Shares of a wave with the transition function's `arguments` that remain of an edge with ends at these excess lengths
/// ([`crate::scene::edges::EdgeCrossing::excess_m`]), by band; `None` if all of it remains. Beyond an end the phase is that
/// of the path over the end.
pub(super) fn shares(
    excess_m: [f64; 2],
    wavenumbers: &[f64; BANDS],
    arguments: [f64; BANDS],
) -> Option<ComplexBands> {
    let is_near = |excess: f64| wavenumbers[0] * excess < SEPARATE_PHASE;
    if !excess_m.into_iter().any(is_near) {
        return None;
    }
    let whole = transition(&arguments);
    let beyond_m = excess_m.into_iter().fold(0.0, |most: f64, m| most.max(-m));
    let is_beyond = beyond_m > 0.0;
    let mut result = [if is_beyond {
        Complex::ZERO
    } else {
        Complex::ONE
    }; BANDS];
    for excess in excess_m.into_iter().filter(|excess| is_near(*excess)) {
        let phases = wavenumbers.map(|wavenumber| wavenumber * excess.abs());
        let at_end = transition(&phases);
        for b in 0..BANDS {
            let joined = (phases[b] - JOINED_PHASE) / (SEPARATE_PHASE - JOINED_PHASE);
            let weight = 1.0 - smoothstep(joined);
            if weight == 0.0 && excess > 0.0 {
                continue;
            }
            let part = beyond(arguments[b], phases[b], whole[b], at_end[b]) / whole[b];
            if excess < 0.0 {
                result[b] += part;
            } else {
                let later = Complex::cis(wavenumbers[b] * beyond_m - phases[b]);
                result[b] = result[b] - part * later * weight;
            }
        }
    }
    Some(result)
}

/// G(√x, √p) e^(jp), given the transition functions of x and p.
fn beyond(x: f64, phase: f64, of_x: Complex, of_phase: Complex) -> Complex {
    let (a, u) = (x.max(0.0).sqrt(), phase.sqrt());
    if a.min(u) * a.min(u) > FAR_PHASE {
        return Complex::new(0.0, -0.5 * FRAC_1_PI * a / (u * (u * u + a * a)));
    }
    if u <= a {
        let ratio = if a > 0.0 { u / a } else { 1.0 };
        return (of_x * 0.5 - finite(a, ratio)) * Complex::cis(phase);
    }
    let other = of_phase * 0.5 - finite(u, a / u);
    of_x * of_phase * 0.5 - other * Complex::cis(x)
}

/// 1/π ∫ e^(−ja²y²)/(1 + y²) dy from 0 to `ratio`, for phases a² ratio² up to [`FAR_PHASE`].
fn finite(a: f64, ratio: f64) -> Complex {
    let mut sum = Complex::ZERO;
    for (node, weight) in GAUSS {
        let y = ratio * node;
        sum += Complex::cis(-(a * y).powi(2)) * (weight / (1.0 + y * y));
    }
    sum * (ratio * FRAC_1_PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// G(a, u) along s = u + e^(−jπ/4) t, where the integrand decays.
    fn integrated(a: f64, u: f64) -> Complex {
        let turn = Complex::cis(-0.25 * PI);
        let (steps, end) = (40_000, 9.0);
        let mut sum = Complex::ZERO;
        for i in 0..steps {
            let t = end * (f64::from(i) + 0.5) / f64::from(steps);
            let s = Complex::new(u, 0.0) + turn * t;
            let square = s * s;
            let wave = Complex::cis(-square.re) * square.im.exp();
            sum += wave / (square + Complex::new(a * a, 0.0));
        }
        sum * turn * (a * FRAC_1_PI * end / f64::from(steps))
    }

    #[test]
    fn the_part_beyond_an_end_is_the_integral() {
        for a in [0.1, 0.4, 1.0, 1.7, 3.0, 8.0] {
            for u in [0.05, 0.3, 0.9, 1.5, 2.4, 4.0, 9.0] {
                let [of_x, of_phase] = [a, u].map(|v: f64| transition(&[v * v; BANDS])[0]);
                let ours = beyond(a * a, u * u, of_x, of_phase);
                let exact = integrated(a, u) * Complex::cis(u * u);
                // The asymptotic form's next term is 1/2u² and 1/2a² of it.
                let most = if a.min(u) > 2.5 {
                    0.12 * exact.abs()
                } else {
                    2e-4
                };
                assert!((ours - exact).abs() < most, "{a} {u}: {ours:?} {exact:?}");
            }
        }
    }
}
