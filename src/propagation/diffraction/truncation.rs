//! The wave of an edge of finite length: the share that remains of an infinite edge's wave.
//!
//! Pure arithmetic, any thread, bounded. The line integral along the edge (\[SVENSSON99\]) near the crossing is
//! √x/π ∫ e^(−js²)/(s² + x) ds, where s² is the phase by which a path through a point of the edge exceeds the shortest one,
//! and x the transition function's argument: over all s it is the transition function. The part beyond an end is
//! G(a, u) = a/π ∫ e^(−js²)/(s² + a²) ds from u on, a = √x, the vertex's transition function (\[ALBANI09\], here
//! with the symmetry of \[OWEN56\]'s integral of the same form).

use std::f64::consts::{FRAC_1_PI, PI};

use crate::acoustics::{BANDS, smoothstep};
use crate::propagation::diffraction::complex::Complex;
use crate::propagation::diffraction::transition::{HALF, HalfWave, halves, transition_lanes};
use crate::simd::elementary::{rough_sine_cosine, sine_cosine};
use crate::simd::{ComplexLanes, Doubles, LaneSet, kernel};

/// Phase in radians from which the part beyond an end no longer interferes with the edge's wave within an octave, and the
/// phase where it begins to fade.
const SEPARATE_PHASE: f64 = 2.0 * PI;
const JOINED_PHASE: f64 = PI;

/// Phase from which the asymptotic form is used.
const FAR_PHASE: f64 = 2.0 * PI;

/// Nodes and weights of Gauss and Legendre's rule of order six on 0 to 1: the integral up to [`FAR_PHASE`] is within 3.5 · 10⁻⁵.
const GAUSS: [(f64, f64); 6] = [
    (0.03376524289842403, 0.08566224618958514),
    (0.16939530676686776, 0.18038078652406936),
    (0.38069040695840156, 0.23395696728634552),
    (0.6193095930415985, 0.23395696728634552),
    (0.8306046932331322, 0.18038078652406936),
    (0.9662347571015759, 0.08566224618958514),
];

/// The ends of an edge whose waves interfere with its own.
pub(super) struct Ends<'a> {
    excess_m: [f64; 2],
    beyond_m: f64,
    wavenumbers: &'a [f64; BANDS],
}

impl<'a> Ends<'a> {
    /// Ends with these excess lengths ([`crate::scene::edges::EdgeCrossing::excess_m`]).
    pub(super) fn of(excess_m: [f64; 2], wavenumbers: &'a [f64; BANDS]) -> Self {
        Self {
            excess_m,
            beyond_m: excess_m.into_iter().fold(0.0, |most: f64, m| most.max(-m)),
            wavenumbers,
        }
    }

    /// Whether an end reaches into half of the bands: a path lies beyond it, or what lies beyond it still interferes.
    pub(super) fn reach(&self, half: usize) -> bool {
        // Frequency rises with the band.
        let lowest = self.wavenumbers[half * HALF];
        let mut ends = self.excess_m.into_iter();
        ends.any(|excess_m| lowest * excess_m < SEPARATE_PHASE)
    }

    /// Takes from three waves in half of the bands what lies beyond the ends, and applies a weight. `arguments` are the
    /// transition function's, `whole` its values. Beyond an end the phase is that of the path over the end.
    pub(super) fn truncate(
        &self,
        half: usize,
        arguments: &[[f64; HALF]; 3],
        whole: &[HalfWave; 3],
        weight: f64,
        waves: &mut [HalfWave; 3],
    ) {
        let wavenumbers = halves(self.wavenumbers)[half];
        let is_beyond = self.beyond_m > 0.0;
        let all = f64::from(u8::from(!is_beyond));
        let mut shares = [HalfWave::default(); 3];
        for share in &mut shares {
            (0..HALF).for_each(|b| share.set(b, Complex::new(all, 0.0)));
        }
        for excess_m in self.excess_m {
            let phases = wavenumbers.map(|wavenumber| wavenumber * excess_m.abs());
            if excess_m >= 0.0 && phases[0] >= SEPARATE_PHASE {
                continue;
            }
            let mut later = HalfWave::default();
            if is_beyond && excess_m >= 0.0 {
                for b in 0..HALF {
                    later.set(b, Complex::cis(wavenumbers[b] * self.beyond_m - phases[b]));
                }
            }
            let end = End {
                phases,
                weights: phases.map(|phase| {
                    1.0 - smoothstep((phase - JOINED_PHASE) / (SEPARATE_PHASE - JOINED_PHASE))
                }),
                later: is_beyond.then_some(later),
                is_passed: excess_m < 0.0,
            };
            cut(LaneSet::best(), &end, arguments, whole, &mut shares);
        }
        scale(LaneSet::best(), &shares, weight, waves);
    }
}

/// One end of an edge, in half of the bands.
struct End {
    phases: [f64; HALF],
    /// Share of what lies beyond it that interferes with the edge's wave.
    weights: [f64; HALF],
    /// Its phase from the path's end if that lies beyond the other end, otherwise e^(−jp) of the phases p.
    later: Option<HalfWave>,
    /// Whether the path lies beyond this end.
    is_passed: bool,
}

kernel! {
    /// Takes from the shares of three waves what lies beyond an end. Bands are lanes.
    fn cut<Wide>(
        end: &End,
        arguments: &[[f64; HALF]; 3],
        whole: &[HalfWave; 3],
        shares: &mut [HalfWave; 3],
    ) {
        let phases = Wide::Doubles::load(&end.phases);
        let weights = Wide::Doubles::load(&end.weights);
        let at_end = transition_lanes(phases);
        let turned = turned_back(phases);
        let later = match &end.later {
            Some(later) => later.load(),
            None => turned,
        };
        for part in 0..3 {
            let argument = Wide::Doubles::load(&arguments[part]);
            let of_argument = whole[part].load();
            let cut = beyond(argument, of_argument, phases, at_end, turned).div(of_argument);
            let share = shares[part].load();
            let share = if end.is_passed {
                share.add(cut)
            } else {
                let joined = share.sub(cut.mul(later).scale(weights));
                ComplexLanes::select_at_most(weights, Wide::Doubles::splat(0.0), share, joined)
            };
            shares[part].store(share);
        }
    }
}

kernel! {
    /// Applies shares and a weight to waves.
    fn scale<Wide>(shares: &[HalfWave; 3], weight: f64, waves: &mut [HalfWave; 3]) {
        let weight = Wide::Doubles::splat(weight);
        for part in 0..3 {
            let wave = waves[part].load().mul(shares[part].load());
            waves[part].store(wave.scale(weight));
        }
    }
}

/// G(√x, √p) e^(jp) by lane, given the transition function of x and of p, and e^(−jp).
#[inline(always)]
fn beyond<D: Doubles>(
    x: D,
    of_x: ComplexLanes<D>,
    phases: D,
    at_end: ComplexLanes<D>,
    turned_by_phases: ComplexLanes<D>,
) -> ComplexLanes<D> {
    let (zero, half) = (D::splat(0.0), D::splat(0.5));
    let (a, u) = (x.max(zero).sqrt(), phases.sqrt());
    let (least, most) = (a.min(u), a.max(u));
    let far = ComplexLanes {
        re: zero,
        im: D::splat(-0.5 * FRAC_1_PI)
            .mul(a)
            .div(u.mul(u.mul(u).add(a.mul(a)))),
    };
    let (square, bound) = (least.mul(least), D::splat(FAR_PHASE));
    if !square.any_at_most(bound) {
        return far;
    }
    let ratio = most.select_at_most(zero, D::splat(1.0), least.div(most));
    let finite = integrated(most, ratio);
    let turned = turned_back(x);
    let steep = of_x.scale(half).sub(finite).mul_conjugate(turned_by_phases);
    let rest = at_end.scale(half).sub(finite).mul_conjugate(turned);
    let flat = of_x.mul(at_end).scale(half).sub(rest);
    let near = ComplexLanes::select_at_most(u, a, steep, flat);
    ComplexLanes::select_at_most(square, bound, near, far)
}

/// e^(−jφ) for phases from 0 to 2π, and somewhat beyond; larger ones count as 7.
#[inline(always)]
fn turned_back<D: Doubles>(phase: D) -> ComplexLanes<D> {
    turned_by(sine_cosine(half_from_middle(phase)))
}

/// (φ − π)/2.
#[inline(always)]
fn half_from_middle<D: Doubles>(phase: D) -> D {
    let phase = phase.min(D::splat(7.0));
    D::splat(0.5).mul(phase.sub(D::splat(PI)))
}

/// With φ = π + 2r the real part is 2 sin² r − 1, the imaginary one 2 sin r cos r.
#[inline(always)]
fn turned_by<D: Doubles>((sine, cosine): (D, D)) -> ComplexLanes<D> {
    let twice = D::splat(2.0).mul(sine);
    ComplexLanes {
        re: twice.mul_add(sine, D::splat(-1.0)),
        im: twice.mul(cosine),
    }
}

/// 1/π ∫ e^(−ja²y²)/(1 + y²) dy from 0 to `ratio` by lane, for phases a² ratio² up to [`FAR_PHASE`].
#[inline(always)]
fn integrated<D: Doubles>(a: D, ratio: D) -> ComplexLanes<D> {
    let mut sum = ComplexLanes::splat(0.0, 0.0);
    for (node, weight) in &GAUSS {
        let y = ratio.mul(D::splat(*node));
        let root = a.mul(y);
        let turn = turned_by(rough_sine_cosine(half_from_middle(root.mul(root))));
        let weight = D::splat(*weight).div(y.mul_add(y, D::splat(1.0)));
        sum = sum.add_scaled(turn, weight);
    }
    sum.scale(ratio.mul(D::splat(FRAC_1_PI)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// G(a, u) along s = u + e^(−jπ/4) t, where the integrand decays.
    fn by_small_steps(a: f64, u: f64) -> Complex {
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

    kernel! {
        fn turn<Wide>(phases: &[f64; HALF], result: &mut HalfWave) {
            result.store(turned_back(Wide::Doubles::load(phases)));
        }
    }

    kernel! {
        /// The part beyond an end for arguments x and phases.
        fn part<Wide>(x: &[f64; HALF], phases: &[f64; HALF], result: &mut HalfWave) {
            let [x, phases] = [Wide::Doubles::load(x), Wide::Doubles::load(phases)];
            let (of_x, at_end) = (transition_lanes(x), transition_lanes(phases));
            result.store(beyond(x, of_x, phases, at_end, turned_back(phases)));
        }
    }

    #[test]
    fn turns_are_those_of_the_mathematical_library() {
        let sets = LaneSet::vector_units();
        for step in 0..=700 {
            let phase = 0.01 * f64::from(step);
            let turned = |set, phases: [f64; HALF]| {
                let mut wave = HalfWave::default();
                turn(set, &phases, &mut wave);
                wave
            };
            let ours = turned(LaneSet::Portable, [phase; HALF]).at(0);
            // Twice the first term left out, and rounding: r is π/2 at 2π and 1.93 at 7.
            let most = if phase < 2.0 * PI { 1.2e-12 } else { 5e-11 };
            assert!((ours - Complex::cis(-phase)).abs() < most, "{phase}");
            let phases = [phase, 0.5 * phase, 2.0 * phase, 1.0];
            let alone = phases.map(|phase| turned(LaneSet::Fused, [phase; HALF]).at(0));
            for &set in &sets {
                let wave = turned(set, phases);
                assert_eq!([0, 1, 2, 3].map(|band| wave.at(band)), alone);
            }
        }
    }

    #[test]
    fn the_part_beyond_an_end_is_the_integral() {
        for a in [0.1, 0.4, 1.0, 1.7, 3.0, 8.0] {
            for u in [0.05, 0.3, 0.9, 1.5, 2.4, 4.0, 9.0] {
                let mut wave = HalfWave::default();
                // Another lane of another kind must not matter.
                let (x, phases) = ([0.01, a * a, 1.0, 90.0], [0.01, u * u, 2.0, 90.0]);
                part(LaneSet::best(), &x, &phases, &mut wave);
                let ours = wave.at(1);
                let exact = by_small_steps(a, u) * Complex::cis(u * u);
                // The asymptotic form's next term is 1/2u² and 1/2a² of it.
                let most = if a.min(u) > 2.5 {
                    0.12 * exact.abs()
                } else {
                    2e-4
                };
                assert!((ours - exact).abs() < most, "{a} {u}: {ours:?} {exact:?}");
                let mut alone = HalfWave::default();
                part(LaneSet::best(), &[a * a; HALF], &[u * u; HALF], &mut alone);
                assert_eq!(alone.at(3), ours);
            }
        }
    }
}
