//! The exact field around a rigid wedge, for small kL, where the uniform theory is not accurate.
//!
//! Pure arithmetic, any thread, bounded. Own evaluation of the solution of \[BIOT57\] in the notation of \[MEDWIN81\], the
//! limit of [`crate::propagation::diffraction::utd`]. With R₀ the path's length over the edge, σ = (R − R₀)/L, q = L/2R₀,
//! v = cosh y − 1 = σ (1 + q σ) and ε_i the angles from the boundaries, the field relative to the free field over R₀ is
//! −1/(2πn) ∫ Σ sin(ε_i/n) / (cosh(y/n) − cos(ε_i/n)) e^(−jkLσ) / √(v (v + 2)) dσ. Each term has a pole at
//! σ = −Δ, where kLΔ is the phase by which the straight line is shorter; its part is the transition function of kLΔ times
//! ½/√(1 − 8 q sin²(ε/2)). The remainder is smooth: along σ = −jτ² it is a sum over a few points of τ = sinh u, the same
//! ones for all frequencies.

use std::f64::consts::{PI, SQRT_2};

use crate::acoustics::smoothstep;
use crate::propagation::diffraction::complex::Complex;
use crate::propagation::diffraction::transition::{
    BoundaryTerm, BoundaryWaves, HALF, HalfWave, boundary_waves,
};
use crate::propagation::diffraction::wedge_geometry::{Deviation, Spread, WedgeAngles};
use crate::simd::{ComplexLanes, Doubles, LaneSet, kernel};

/// Quadrature points of the remainder, and their distance in u. Against 3,000 points the sum is off by up to 0.015 dB
/// from kL = 0.03 to 3 (n = 1.25 to 2, source and listener equally far from the edge, the worst case).
const POINTS: usize = 8;
const STEP: f64 = 0.45;

/// τ = sinh u and cosh u of the points.
const AT_POINTS: [(f64, f64); POINTS] = [
    (0.22690324871624368, 1.0254194674756207),
    (0.727438277681149, 1.2365946982886982),
    (1.3777821907798407, 1.7024346581381904),
    (2.311867032714563, 2.5188745853957153),
    (3.7220585507245074, 3.8540523939123377),
    (5.898772061421044, 5.982935051678355),
    (9.290280678993138, 9.343945370905868),
    (14.595032831461635, 14.629250949773304),
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

/// What the exact field of a wedge has in common for all bands: the poles, and the remainder of each part at the points.
pub(crate) struct ExactField {
    poles: [Option<BoundaryTerm>; 4],
    remainders: [[Complex; 3]; POINTS],
}

impl ExactField {
    /// `boundaries` are those of the angles.
    pub(crate) fn of(angles: &WedgeAngles, boundaries: &[Deviation; 4], spread: &Spread) -> Self {
        let n = angles.n;
        let q = 0.5 * (spread.distance_m / spread.length_m).clamp(0.0, 0.25);
        let whole = angles.grazing_factor();
        let mut poles = [None; 4];
        let mut residues = [0.0; 4];
        for (i, boundary) in boundaries.iter().enumerate() {
            if boundary.epsilon.abs() >= FARTHEST_POLE {
                continue;
            }
            let sine = boundary.half_sine;
            let width = (1.0 - 8.0 * q * sine * sine).sqrt();
            poles[i] = Some(BoundaryTerm {
                amplitude: -0.5 * whole * 1f64.copysign(boundary.epsilon) / width,
                argument: 4.0 * sine * sine / (1.0 + width),
            });
            residues[i] = 2.0 * n * sine / (width * (1.0 + width).sqrt());
        }
        let outside = Complex::new(0.0, whole / (n * PI)) * Complex::cis(0.25 * PI);
        let sines = boundaries.map(|boundary| 0.5 * (boundary.epsilon / n).sin());
        let remainders = AT_POINTS.map(|(tau, cosh)| {
            let point_weight = outside * (STEP * cosh);
            let sigma = Complex::new(0.0, -tau * tau);
            let longer = Complex::ONE + sigma * q;
            let v = sigma * longer;
            let above = Complex::ONE + v * 0.5;
            // e^(y/2n), which determines sinh²(y/2n).
            let power = ((v * 0.5).sqrt() + above.sqrt()).powf(1.0 / n);
            let sinh = (power - Complex::ONE / power) * 0.5;
            let sinh_squared = sinh * sinh;
            let common = point_weight / (longer.sqrt() * above.sqrt() * SQRT_2);
            let mut remainder = [Complex::ZERO; 3];
            for i in 0..4 {
                let below = sinh_squared + Complex::new(boundaries[i].slow_sine.powi(2), 0.0);
                let mut value = common * sines[i] / below;
                if let Some(pole) = poles[i] {
                    let away = sigma + Complex::new(pole.argument, 0.0);
                    value = value - point_weight * residues[i] / away;
                }
                remainder[i.saturating_sub(1)] += value;
            }
            remainder
        });
        Self { poles, remainders }
    }

    /// Mixes the field into that of the uniform theory, by the weights of bands.
    pub(crate) fn mix(&self, kl: &[f64; HALF], weights: &[f64; HALF], uniform: &mut [HalfWave; 3]) {
        let decays = AT_POINTS.map(|(tau, _)| {
            std::array::from_fn(|b| match weights[b] > 0.0 {
                true => (-kl[b] * (tau * tau)).exp(),
                false => 0.0,
            })
        });
        let mut exact = BoundaryWaves::default();
        boundary_waves(LaneSet::best(), &self.poles, kl, &mut exact);
        let lanes = LaneSet::best();
        mix_remainders(
            lanes,
            &self.remainders,
            &decays,
            &exact.parts,
            weights,
            uniform,
        );
    }
}

kernel! {
    /// Adds the remainders to the poles' waves, and mixes their sum with the uniform theory's. Bands are lanes.
    fn mix_remainders<Wide>(
        remainders: &[[Complex; 3]; POINTS],
        decays: &[[f64; HALF]; POINTS],
        poles: &[HalfWave; 3],
        weights: &[f64; HALF],
        uniform: &mut [HalfWave; 3],
    ) {
        let weights = Wide::Doubles::load(weights);
        let one = Wide::Doubles::splat(1.0);
        for part in 0..3 {
            let mut exact = poles[part].load::<Wide::Doubles>();
            for point in 0..POINTS {
                let remainder = &remainders[point][part];
                let decay = Wide::Doubles::load(&decays[point]);
                exact = exact.add(ComplexLanes::splat(remainder.re, remainder.im).scale(decay));
            }
            let other = uniform[part].load();
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
        for (point, (tau, cosh)) in AT_POINTS.into_iter().enumerate() {
            let u = (point as f64 + 0.5) * STEP;
            // Libraries differ in the last bit.
            assert!((tau / u.sinh() - 1.0).abs() < 1e-15, "{point}");
            assert!((cosh / u.cosh() - 1.0).abs() < 1e-15, "{point}");
        }
    }
}
