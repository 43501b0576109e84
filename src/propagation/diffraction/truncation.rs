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
use crate::simd::{LaneSet, kernel};

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

/// Taylor's series of sin(r)/r and cos(r) in r², highest power first. Up to π/2 the first term left out is 5.3 · 10⁻¹³.
const SINE: [f64; 9] = [
    2.811_457_254_345_521e-15,
    -7.647_163_731_819_816e-13,
    1.605_904_383_682_161_3e-10,
    -2.505_210_838_544_172e-8,
    2.755_731_922_398_589_3e-6,
    -1.984_126_984_126_984e-4,
    8.333_333_333_333_333e-3,
    -0.166_666_666_666_666_66,
    1.0,
];
const COSINE: [f64; 9] = [
    4.779_477_332_387_385e-14,
    -1.147_074_559_772_972_5e-11,
    2.087_675_698_786_81e-9,
    -2.755_731_922_398_589e-7,
    2.480_158_730_158_73e-5,
    -1.388_888_888_888_889e-3,
    4.166_666_666_666_666_4e-2,
    -0.5,
    1.0,
];

/// Shares of three waves with the transition function's `arguments` that remain of an edge with ends at these excess lengths
/// ([`crate::scene::edges::EdgeCrossing::excess_m`]), by band; `None` if all of them remains. Beyond an end the phase is that
/// of the path over the end.
pub(super) fn shares(
    excess_m: [f64; 2],
    wavenumbers: &[f64; BANDS],
    arguments: &[[f64; BANDS]; 3],
) -> Option<[ComplexBands; 3]> {
    let is_near = |excess: f64| wavenumbers[0] * excess < SEPARATE_PHASE;
    if !excess_m.into_iter().any(is_near) {
        return None;
    }
    let beyond_m = excess_m.into_iter().fold(0.0, |most: f64, m| most.max(-m));
    let is_beyond = beyond_m > 0.0;
    let whole = [0, 1, 2].map(|part| transition(&arguments[part]));
    let all = match is_beyond {
        true => Complex::ZERO,
        false => Complex::ONE,
    };
    let mut result = [[all; BANDS]; 3];
    for excess in excess_m.into_iter().filter(|excess| is_near(*excess)) {
        let phases = wavenumbers.map(|wavenumber| wavenumber * excess.abs());
        let at_end = transition(&phases);
        let mut later = [Complex::ZERO; BANDS];
        turn_back(LaneSet::best(), &phases, &mut later);
        let end = End {
            phases,
            at_end,
            turned: later,
        };
        if is_beyond {
            later = std::array::from_fn(|b| Complex::cis(wavenumbers[b] * beyond_m - phases[b]));
        }
        let weights = phases.map(|phase| {
            1.0 - smoothstep((phase - JOINED_PHASE) / (SEPARATE_PHASE - JOINED_PHASE))
        });
        for part in 0..3 {
            let cut = end.beyond(&arguments[part], &whole[part]);
            for b in 0..BANDS {
                let cut = cut[b] / whole[part][b];
                if excess < 0.0 {
                    result[part][b] += cut;
                } else if weights[b] > 0.0 {
                    result[part][b] = result[part][b] - cut * later[b] * weights[b];
                }
            }
        }
    }
    Some(result)
}

/// One end of an edge, by band.
struct End {
    phases: [f64; BANDS],
    /// Transition function of the phases.
    at_end: ComplexBands,
    /// e^(−jp) of the phases p up to [`FAR_PHASE`].
    turned: ComplexBands,
}

impl End {
    /// G(√x, √p) e^(jp) by band, given the transition function of x.
    fn beyond(&self, x: &[f64; BANDS], of_x: &ComplexBands) -> ComplexBands {
        let (mut larger, mut ratio) = ([0.0; BANDS], [0.0; BANDS]);
        let roots = |b: usize| (x[b].max(0.0).sqrt(), self.phases[b].sqrt());
        for b in 0..BANDS {
            let (a, u) = roots(b);
            larger[b] = a.max(u);
            ratio[b] = match larger[b] > 0.0 {
                true => a.min(u) / larger[b],
                false => 1.0,
            };
        }
        let (mut finite, mut turned) = ([Complex::ZERO; BANDS], [Complex::ZERO; BANDS]);
        integrate(LaneSet::best(), &larger, &ratio, &mut finite);
        turn_back(LaneSet::best(), x, &mut turned);
        let turn = |wave: Complex, back: Complex| wave * Complex::new(back.re, -back.im);
        std::array::from_fn(|b| {
            let (a, u) = roots(b);
            if a.min(u) * a.min(u) > FAR_PHASE {
                return Complex::new(0.0, -0.5 * FRAC_1_PI * a / (u * (u * u + a * a)));
            }
            if u <= a {
                return turn(of_x[b] * 0.5 - finite[b], self.turned[b]);
            }
            let other = self.at_end[b] * 0.5 - finite[b];
            of_x[b] * self.at_end[b] * 0.5 - turn(other, turned[b])
        })
    }
}

/// e^(−jφ) for phases from 0 to 2π, and somewhat beyond; larger ones count as 7.
#[inline(always)]
fn turned_back(phase: f64) -> (f64, f64) {
    let phase = if phase < 7.0 { phase } else { 7.0 };
    // With φ = π + 2r the real part is 2 sin² r − 1, the imaginary one 2 sin r cos r.
    let r = 0.5 * (phase - PI);
    let square = r * r;
    let (mut sine, mut cosine) = (SINE[0], COSINE[0]);
    for k in 1..SINE.len() {
        sine = sine * square + SINE[k];
        cosine = cosine * square + COSINE[k];
    }
    let sine = sine * r;
    (2.0 * sine * sine - 1.0, 2.0 * sine * cosine)
}

kernel! {
    /// [`turned_back`] by band. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn turn_back<Wide>(phase: &[f64; BANDS], result: &mut ComplexBands) {
        let (mut re, mut im) = ([0.0; BANDS], [0.0; BANDS]);
        for b in 0..BANDS {
            (re[b], im[b]) = turned_back(phase[b]);
        }
        for b in 0..BANDS {
            result[b] = Complex::new(re[b], im[b]);
        }
    }
}

kernel! {
    /// 1/π ∫ e^(−ja²y²)/(1 + y²) dy from 0 to `ratio` by band, for phases a² ratio² up to [`FAR_PHASE`]. Bands are lanes. No
    /// fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn integrate<Wide>(a: &[f64; BANDS], ratio: &[f64; BANDS], result: &mut ComplexBands) {
        let (mut sum_re, mut sum_im) = ([0.0; BANDS], [0.0; BANDS]);
        for (node, weight) in GAUSS {
            for b in 0..BANDS {
                let y = ratio[b] * node;
                let (re, im) = turned_back((a[b] * y) * (a[b] * y));
                let weight = weight / (1.0 + y * y);
                sum_re[b] += re * weight;
                sum_im[b] += im * weight;
            }
        }
        for b in 0..BANDS {
            let scale = ratio[b] * FRAC_1_PI;
            result[b] = Complex::new(sum_re[b] * scale, sum_im[b] * scale);
        }
    }
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
    fn turns_are_those_of_the_mathematical_library() {
        for step in 0..=700 {
            let phase = 0.01 * f64::from(step);
            let ((re, im), exact) = (turned_back(phase), Complex::cis(-phase));
            // Twice the first term left out, and rounding: r is π/2 at 2π and 1.93 at 7.
            let most = if phase < 2.0 * PI { 1.2e-12 } else { 5e-11 };
            assert!((Complex::new(re, im) - exact).abs() < most, "{phase}");
        }
        let phases = std::array::from_fn(|b| 0.1 + 0.85 * b as f64);
        for set in LaneSet::vector_units()
            .into_iter()
            .chain([LaneSet::Portable])
        {
            let mut turned = [Complex::ZERO; BANDS];
            turn_back(set, &phases, &mut turned);
            let alone = phases.map(turned_back);
            assert_eq!(turned, alone.map(|(re, im)| Complex::new(re, im)));
        }
    }

    #[test]
    fn the_part_beyond_an_end_is_the_integral() {
        for a in [0.1, 0.4, 1.0, 1.7, 3.0, 8.0] {
            for u in [0.05, 0.3, 0.9, 1.5, 2.4, 4.0, 9.0] {
                let [of_x, of_phase] = [a, u].map(|v: f64| transition(&[v * v; BANDS])[0]);
                let mut turned = [Complex::ZERO; BANDS];
                turn_back(LaneSet::best(), &[u * u; BANDS], &mut turned);
                let end = End {
                    phases: [u * u; BANDS],
                    at_end: [of_phase; BANDS],
                    turned,
                };
                let ours = end.beyond(&[a * a; BANDS], &[of_x; BANDS])[3];
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
