//! The exact field around a rigid wedge, for small kL, where the uniform theory is not accurate.
//!
//! Pure arithmetic, any thread, bounded. Own evaluation of the solution of \[BIOT57\] in the notation of \[MEDWIN81\], the
//! limit of [`crate::propagation::diffraction::utd`]. With R₀ the path's length over the edge, σ = (R − R₀)/L, q = L/2R₀,
//! v = cosh y − 1 = σ (1 + q σ) and ε_i the angles from the boundaries, the field relative to the free field over R₀ is
//! −1/(2πn) ∫ Σ sin(ε_i/n) / (cosh(y/n) − cos(ε_i/n)) e^(−jkLσ) / √(v (v + 2)) dσ. Each term has a pole at
//! σ = −Δ, where kLΔ is the phase by which the straight line is shorter; its part is the transition function of kLΔ times
//! ½/√(1 − 8 q sin²(ε/2)). The remainder is smooth: along σ = −jτ² it is a sum over a few points of τ = sinh u, the same
//! ones for all frequencies.

use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

use crate::acoustics::smoothstep;
use crate::propagation::diffraction::transition::{
    BoundaryTerm, BoundaryWaves, HALF, HalfWave, boundary_waves,
};
use crate::propagation::diffraction::wedge_geometry::{Boundaries, Spread, WedgeAngles};
use crate::simd::elementary::{decay, root_of_lower_half, sinh_squared_of_power};
use crate::simd::{ComplexLanes, Doubles, LaneSet, kernel};

/// Quadrature points of the remainder, and their distance in u. Against 3,000 points the sum is off by up to 0.015 dB
/// from kL = 0.03 to 3 (n = 1.25 to 2, source and listener equally far from the edge, the worst case).
const POINTS: usize = 8;
const STEP: f64 = 0.45;

/// τ = sinh u of the points.
const TAU: [[f64; HALF]; 2] = [
    [
        0.22690324871624368,
        0.727438277681149,
        1.3777821907798407,
        2.311867032714563,
    ],
    [
        3.7220585507245074,
        5.898772061421044,
        9.290280678993138,
        14.595032831461635,
    ],
];

/// cosh u of the points.
const COSH: [[f64; HALF]; 2] = [
    [
        1.0254194674756207,
        1.2365946982886982,
        1.7024346581381904,
        2.5188745853957153,
    ],
    [
        3.8540523939123377,
        5.982935051678355,
        9.343945370905868,
        14.629250949773304,
    ],
];

/// ε from which on a pole stays in the remainder, far enough from the points. Towards π it meets the root's branch point,
/// where both parts diverge; beyond, it is on another sheet of y(v).
const FARTHEST_POLE: f64 = 0.6 * PI;

/// The exact field has the whole weight up to the first kL and none from the second on, where the uniform theory is
/// within 0.15 dB and improves with kL.
const EXACT_KL: f64 = 1.5;
const UNIFORM_KL: f64 = 3.0;

/// Weight of the exact field at kL, 0 to 1; the uniform theory has the rest.
pub fn weight(kl: f64) -> f64 {
    smoothstep((UNIFORM_KL - kl) / (UNIFORM_KL - EXACT_KL))
}

/// What the exact field of a wedge has in common for all bands: the poles, and the remainder of each part at the points, half of
/// the points in each row.
pub(crate) struct ExactField {
    poles: [Option<BoundaryTerm>; 4],
    remainders: [[HalfWave; 3]; 2],
}

impl ExactField {
    pub(crate) fn of(angles: &WedgeAngles, boundaries: &Boundaries, spread: &Spread) -> Self {
        let n = angles.n;
        let q = 0.5 * (spread.distance_m / spread.length_m).clamp(0.0, 0.25);
        let whole = angles.grazing_factor();
        let mut result = Self {
            poles: [None; 4],
            remainders: [[HalfWave::default(); 3]; 2],
        };
        let mut terms = RemainderTerms {
            q,
            exponent: 1.0 / n,
            outside: whole * FRAC_1_SQRT_2 / (n * PI),
            boundaries: [BoundaryRemainder::default(); 4],
        };
        for (i, term) in terms.boundaries.iter_mut().enumerate() {
            let (epsilon, sine) = (boundaries.epsilon[i], boundaries.half_sine[i]);
            let (slow_sine, slow_cosine) = (boundaries.slow_sine[i], boundaries.slow_cosine[i]);
            term.sine = (slow_sine * slow_cosine).copysign(epsilon);
            term.slow_square = slow_sine * slow_sine;
            if epsilon.abs() >= FARTHEST_POLE {
                continue;
            }
            let width = (1.0 - 8.0 * q * sine * sine).sqrt();
            let pole = BoundaryTerm {
                amplitude: (-0.5 * whole / width).copysign(-epsilon),
                argument: 4.0 * sine * sine / (1.0 + width),
            };
            term.pole = pole.argument;
            term.residue = (2.0 * n * sine / (width * (1.0 + width).sqrt())).copysign(epsilon);
            result.poles[i] = Some(pole);
        }
        fill_remainders(LaneSet::best(), &terms, &mut result.remainders);
        result
    }

    /// Mixes the field into that of the uniform theory, by the weights of bands.
    pub(crate) fn mix(&self, kl: &[f64; HALF], weights: &[f64; HALF], uniform: &mut [HalfWave; 3]) {
        let mut exact = BoundaryWaves::default();
        let lanes = LaneSet::best();
        boundary_waves(lanes, &self.poles, kl, &mut exact);
        mix_remainders(lanes, &self.remainders, kl, &exact.parts, weights, uniform);
    }
}

/// What the remainder of one boundary needs.
#[derive(Clone, Copy, Default)]
struct BoundaryRemainder {
    /// Half of sin(ε/n), and sin²(ε/2n).
    sine: f64,
    slow_square: f64,
    /// kLΔ over kL of a pole that is taken out, and its residue; 0 without one.
    pole: f64,
    residue: f64,
}

/// What the remainders at the points need.
struct RemainderTerms {
    q: f64,
    /// 1/n.
    exponent: f64,
    /// Size of the real and the imaginary part of the factor on the integral, which is on the bisector between −1 and j.
    outside: f64,
    boundaries: [BoundaryRemainder; 4],
}

kernel! {
    /// The remainders of the parts at the points. Points are lanes.
    fn fill_remainders<Wide>(terms: &RemainderTerms, result: &mut [[HalfWave; 3]; 2]) {
        let (zero, one) = (Wide::Doubles::splat(0.0), Wide::Doubles::splat(1.0));
        let half = Wide::Doubles::splat(0.5);
        let q = Wide::Doubles::splat(terms.q);
        for row in 0..2 {
            let tau = Wide::Doubles::load(&TAU[row]);
            let cosh = Wide::Doubles::load(&COSH[row]);
            let size = cosh.mul(Wide::Doubles::splat(STEP * terms.outside));
            let point_weight = ComplexLanes { re: zero.sub(size), im: size };
            // σ = −jτ².
            let square = tau.mul(tau);
            let sigma = ComplexLanes { re: zero, im: zero.sub(square) };
            let longer = ComplexLanes { re: one, im: zero.sub(square.mul(q)) };
            // v = cosh y − 1, halved; √(v/2) + √(1 + v/2) is e^(y/2).
            let halved = sigma.mul(longer).scale(half);
            let above = ComplexLanes { re: one.add(halved.re), im: halved.im };
            let root_above = root_of_lower_half(above);
            let grown = root_of_lower_half(halved).add(root_above);
            let sinh_squared = sinh_squared_of_power(grown, Wide::Doubles::splat(terms.exponent));
            let roots = root_of_lower_half(longer).mul(root_above);
            let common = point_weight.div(roots.scale(Wide::Doubles::splat(SQRT_2)));
            for part in 0..3 {
                let mut remainder = ComplexLanes::splat(0.0, 0.0);
                // The incident wave has two boundaries.
                let (first, last) = if part == 0 { (0, 2) } else { (part + 1, part + 2) };
                for boundary in &terms.boundaries[first..last] {
                    let below = ComplexLanes {
                        re: sinh_squared.re.add(Wide::Doubles::splat(boundary.slow_square)),
                        im: sinh_squared.im,
                    };
                    let value = common.scale(Wide::Doubles::splat(boundary.sine)).div(below);
                    remainder = remainder.add(value);
                    if boundary.residue != 0.0 {
                        let away = ComplexLanes { re: Wide::Doubles::splat(boundary.pole), im: sigma.im };
                        let residue = Wide::Doubles::splat(boundary.residue);
                        remainder = remainder.sub(point_weight.scale(residue).div(away));
                    }
                }
                result[row][part].store(remainder);
            }
        }
    }
}

kernel! {
    /// Adds the remainders to the poles' waves, and mixes their sum with the uniform theory's. Bands are lanes.
    fn mix_remainders<Wide>(
        remainders: &[[HalfWave; 3]; 2],
        kl: &[f64; HALF],
        poles: &[HalfWave; 3],
        weights: &[f64; HALF],
        uniform: &mut [HalfWave; 3],
    ) {
        let weights = Wide::Doubles::load(weights);
        let one = Wide::Doubles::splat(1.0);
        // From this kL on the exact field has no weight; the clamp keeps the decays finite.
        let kl = Wide::Doubles::load(kl).min(Wide::Doubles::splat(UNIFORM_KL));
        let mut exact = [ComplexLanes::splat(0.0, 0.0); 3];
        for part in 0..3 {
            exact[part] = poles[part].load::<Wide::Doubles>();
        }
        for point in 0..POINTS {
            let (row, lane) = (point / HALF, point % HALF);
            let tau = TAU[row][lane];
            let decay = decay(kl.mul(Wide::Doubles::splat(tau * tau)));
            for part in 0..3 {
                let remainder = remainders[row][part].at(lane);
                let remainder = ComplexLanes::splat(remainder.re, remainder.im);
                exact[part] = exact[part].add_scaled(remainder, decay);
            }
        }
        for part in 0..3 {
            let (exact, other) = (exact[part], uniform[part].load());
            let mixed = exact.scale(weights).add(other.scale(one.sub(weights)));
            let mixed = ComplexLanes::select_at_most(weights, Wide::Doubles::splat(0.0), other, mixed);
            uniform[part].store(ComplexLanes::select_at_most(one, weights, exact, mixed));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_points_are_hyperbolic_functions_of_even_steps() {
        for point in 0..POINTS {
            let (row, lane) = (point / HALF, point % HALF);
            let u = (point as f64 + 0.5) * STEP;
            // Libraries differ in the last bit.
            assert!((TAU[row][lane] / u.sinh() - 1.0).abs() < 1e-15, "{point}");
            assert!((COSH[row][lane] / u.cosh() - 1.0).abs() < 1e-15, "{point}");
        }
    }
}
