//! Diffraction by a wedge: the uniform theory of diffraction, and the exact field close to the edge.
//!
//! Pure arithmetic, any thread, bounded. Follows \[KOUYOUMJIAN74\] for a rigid wedge, rewritten without its poles: with
//! ε = π ± β − 2πnN each term cot(ε/2n) F(kLa) D is cos(ε/2n) sin(ε/2)/sin(ε/2n) times the transition function, finite
//! everywhere, and the lengths cancel to 1/(s + s'). The terms of the faces are separate, for the faces' reflection
//! factors (\[LUEBBERS84\], adapted: with reciprocal angles of incidence). The theory is the first term of a series in
//! 1/kL; for small kL [`biot_tolstoy`] replaces it.

use crate::acoustics::BANDS;
use crate::propagation::diffraction::biot_tolstoy::{self, ExactField};
use crate::propagation::diffraction::transition::{
    BoundaryTerm, BoundaryWaves, HALF, boundary_waves, halves,
};
use crate::propagation::diffraction::wedge_geometry::{
    Boundaries, DiffractedField, Spread, WedgeAngles,
};
use crate::simd::LaneSet;

/// The diffracted field in each band. `kl` is wavenumber times [`Spread::distance_m`], dimensionless, positive.
///
/// # Real-time
/// Allocates nothing; constant work.
pub fn wedge_field(
    angles: &WedgeAngles,
    spread: &Spread,
    kl: &[f64; BANDS],
) -> [DiffractedField; BANDS] {
    let halves = wedge_waves(angles, spread, kl).halves;
    std::array::from_fn(|b| {
        let part = |part: usize| halves[b / HALF].waves.parts[part].at(b % HALF);
        DiffractedField {
            incident: part(0),
            first_face: part(1),
            second_face: part(2),
        }
    })
}

/// The field of a wedge.
pub(crate) struct WedgeWaves {
    pub(crate) halves: [HalfField; 2],
    /// The transition function's arguments, over kL, at the four boundaries ([`WedgeAngles::deviations`]).
    pub(crate) arguments: [f64; 4],
}

/// The field of a wedge in half of the bands.
#[derive(Clone, Copy, Default)]
pub(crate) struct HalfField {
    pub(crate) waves: BoundaryWaves,
    /// Whether the uniform theory has a share in any band: otherwise there are no transition functions.
    pub(crate) is_uniform: bool,
}

/// [`wedge_field`] by halves of the bands. Inlined, since the result is large to copy.
#[inline]
pub(crate) fn wedge_waves(angles: &WedgeAngles, spread: &Spread, kl: &[f64; BANDS]) -> WedgeWaves {
    let scale = -angles.grazing_factor() / (2.0 * angles.n);
    let boundaries = angles.boundaries();
    let terms = [0, 1, 2, 3].map(|i| boundary_term(&boundaries, i, angles.n, scale));
    let mut result = WedgeWaves {
        halves: [HalfField::default(); 2],
        arguments: terms.map(|term| term.argument),
    };
    let terms = terms.map(Some);
    let mut exact = None;
    for (half, kl) in result.halves.iter_mut().zip(&halves(kl)) {
        let weights = kl.map(biot_tolstoy::weight);
        if weights.iter().any(|weight| *weight < 1.0) {
            boundary_waves(LaneSet::best(), &terms, kl, &mut half.waves);
            half.is_uniform = true;
        }
        if weights.iter().any(|weight| *weight > 0.0) {
            let exact = exact.get_or_insert_with(|| ExactField::of(angles, &boundaries, spread));
            exact.mix(kl, &weights, &mut half.waves.parts);
        }
    }
    result
}

fn boundary_term(boundaries: &Boundaries, i: usize, n: f64, scale: f64) -> BoundaryTerm {
    let (slow_sine, half_sine) = (boundaries.slow_sine[i], boundaries.half_sine[i]);
    let ratio = match slow_sine < 1e-9 {
        true => n,
        false => half_sine / slow_sine,
    };
    BoundaryTerm {
        amplitude: (boundaries.slow_cosine[i] * ratio * scale)
            .copysign(boundaries.epsilon[i] * scale),
        argument: 2.0 * half_sine * half_sine,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::propagation::diffraction::complex::Complex;

    /// Far and near: fields of the uniform theory and of the exact solution, with their kL.
    const SPREADS: [(f64, Spread); 2] = [
        (
            40.0,
            Spread {
                distance_m: 2.0,
                length_m: 8.0,
            },
        ),
        (
            0.5,
            Spread {
                distance_m: 0.5,
                length_m: 2.5,
            },
        ),
    ];

    fn field([n, incoming, outgoing]: [f64; 3], spread: &Spread, kl: f64) -> DiffractedField {
        let angles = WedgeAngles {
            n,
            incoming,
            outgoing,
        };
        wedge_field(&angles, spread, &[kl; BANDS])[0]
    }

    #[test]
    fn half_of_the_wave_remains_at_the_shadow_boundary() {
        for n in [1.1, 1.5, 1.75, 2.0] {
            for incoming in [0.1, 0.5] {
                let boundary = incoming + PI;
                if boundary > n * PI {
                    continue;
                }
                let step = 1e-9;
                for (kl, spread) in &SPREADS {
                    // The transition function's own error; near a right angle's edge a pole changes sheets at the very
                    // boundary, and the sum over points differs by its own, 0.001 dB.
                    let most = if *kl > 3.0 { 1e-5 } else { 3e-4 };
                    let lit = field([n, incoming, boundary - step], spread, *kl);
                    let dark = field([n, incoming, boundary + step], spread, *kl);
                    let jump = dark.incident - lit.incident;
                    assert!((jump - Complex::ONE).abs() < most, "{jump:?}");
                    assert!((dark.rigid() - lit.rigid() - Complex::ONE).abs() < most);
                }
            }
        }
    }

    #[test]
    fn a_reflection_is_halved_where_its_face_ends() {
        let n = 1.5;
        for (incoming, boundary, first) in
            [(1.0, PI - 1.0, true), (4.0, 2.0 * n * PI - PI - 4.0, false)]
        {
            for (kl, spread) in &SPREADS {
                let [low, high] = [-1e-9, 1e-9]
                    .map(|offset| field([n, incoming, boundary + offset], spread, *kl));
                let jump = match first {
                    true => high.first_face - low.first_face,
                    false => low.second_face - high.second_face,
                };
                // The transition function's relative error is 5e-6, on a half from either side.
                assert!((jump - Complex::ONE).abs() < 1e-5, "{jump:?}");
            }
        }
    }

    #[test]
    fn source_and_listener_are_reciprocal() {
        for (n, incoming, outgoing) in [(2.0, 0.3, 4.9), (1.5, 0.0, 4.0), (1.25, 1.0, 3.9)] {
            let [there, back] = [[n, incoming, outgoing], [n, outgoing, incoming]];
            for (kl, spread) in &SPREADS {
                let [a, b] = [there, back].map(|angles| field(angles, spread, *kl).rigid());
                // Rounding of angles of some radians.
                assert!((a - b).abs() < 1e-12);
            }
            let cosines = |[n, incoming, outgoing]: [f64; 3]| {
                WedgeAngles {
                    n,
                    incoming,
                    outgoing,
                }
                .face_cosines(0.9)
            };
            assert_eq!(cosines(there), cosines(back));
        }
    }

    #[test]
    fn the_uniform_theory_and_the_exact_field_join_without_a_step() {
        let spread = SPREADS[1].1;
        let mut before: Option<Complex> = None;
        for step in 0..400 {
            let kl = 0.5 + 0.01 * f64::from(step);
            let now = field([1.5, 0.4, 4.1], &spread, kl).rigid();
            if let Some(before) = before {
                // Far from its boundaries the field falls as (kL)^−½: by 1 % in the first step, of 2 %.
                assert!((now - before).abs() < 0.01 * before.abs(), "{kl}");
            }
            before = Some(now);
        }
    }
}
