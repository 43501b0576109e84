//! What a wedge does to a wave: the uniform theory of diffraction.
//!
//! Pure arithmetic, any thread, bounded. Takes angles and lengths, gives the diffracted field as a share of the free
//! field over the same length. Follows \[KOUYOUMJIAN74\] for a rigid wedge, rewritten without its poles: with
//! ε = π ± β − 2πnN each term cot(ε/2n) F(kLa) D is cos(ε/2n) sin(ε/2)/sin(ε/2n) times the transition function, finite
//! everywhere, and the lengths cancel to 1/(s + s'). Faces that absorb scale their own reflected term (\[LUEBBERS84\];
//! its angle is chosen so that source and listener may change places, which his is not). It is the first term of a series
//! in 1/kL; where kL is small [`crate::propagation::diffraction::biot_tolstoy`] takes its place.

use std::f64::consts::PI;

use crate::acoustics::BANDS;
use crate::propagation::diffraction::biot_tolstoy;
use crate::propagation::diffraction::biot_tolstoy::DiffractingEdge;
use crate::propagation::diffraction::complex::Complex;
use crate::propagation::diffraction::transition::{transition, transitions};

/// Where a source and a listener stand around a wedge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WedgeAngles {
    /// Exterior angle in units of π: 2 for a sheet, 1.5 outside a right-angled corner.
    pub n: f64,
    /// Angle of the incoming ray from the first face, in radians, 0 to nπ.
    pub incoming: f64,
    /// Angle of the outgoing ray from the first face, in radians, 0 to nπ.
    pub outgoing: f64,
}

/// Angle in radians below which a ray runs along a face.
const GRAZING: f64 = 1e-6;

/// Lengths on the way around an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The distance parameter L = s s' sin²β₀ / (s + s') in metres.
    pub distance_m: f64,
    /// s + s' in metres.
    pub length_m: f64,
}

/// The field behind a wedge in parts, each relative to the free field over the bent path's length (its own delay
/// taken out).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Diffracted {
    /// What makes the incoming wave continuous at its shadow boundary: −½ on the lit side of it, +½ beyond.
    pub incident: Complex,
    /// The same for the wave that the first face reflects.
    pub first_face: Complex,
    /// The same for the wave that the second face reflects.
    pub second_face: Complex,
}

impl WedgeAngles {
    /// Whether a straight line from source to listener passes the wedge.
    pub fn is_lit(&self) -> bool {
        (self.outgoing - self.incoming).abs() < PI
    }

    /// Cosines of incidence on the two faces, for their reflection factors: those at the boundary where the reflection
    /// ends, the same when source and listener change places.
    pub fn face_cosines(&self, sin_edge: f64) -> [f64; 2] {
        let steeper = |a: f64, b: f64| (a.sin().max(b.sin()) * sin_edge).clamp(0.0, 1.0);
        let far = self.n * PI;
        [
            steeper(self.incoming, self.outgoing),
            steeper(far - self.incoming, far - self.outgoing),
        ]
    }

    /// How far a ray bends around the edge, as k times a length: x of the incident term that is nearest to its shadow
    /// boundary. `length_m` is the distance parameter L = s s' sin²β₀ / (s + s').
    pub fn crossing(&self, wavenumber: f64, length_m: f64) -> f64 {
        let beta = self.outgoing - self.incoming;
        let nearest = |beta| self.deviation(beta).sin_half_squared();
        2.0 * wavenumber * length_m * nearest(beta).min(nearest(-beta))
    }

    /// The diffracted field at one wavenumber k (rad/m).
    pub fn diffracted(&self, wavenumber: f64, spread: &Spread) -> Diffracted {
        let around = AroundWedge::of(self, spread, wavenumber);
        around.diffracted(wavenumber * spread.distance_m)
    }

    /// Share of a wave that is not its own reflection: one that runs along a face meets that there, and the incoming wave
    /// is half of what goes on.
    pub(crate) fn share(&self) -> f64 {
        let far = self.n * PI;
        let on_face = |angle: f64| angle < GRAZING || far - angle < GRAZING;
        if on_face(self.incoming) || on_face(self.outgoing) {
            0.5
        } else {
            1.0
        }
    }

    /// The angles ε by which a ray misses the boundaries: two of the incoming wave, the first face's and the second's.
    pub(crate) fn deviations(&self) -> [f64; 4] {
        let (minus, plus) = (self.outgoing - self.incoming, self.outgoing + self.incoming);
        // π − (φ + φ') is zero where the first face's reflection ends, π + (φ + φ') − 2πn the second's.
        [minus, -minus, -plus, plus].map(|beta| self.deviation(beta).0)
    }

    /// What of the diffracted field does not depend on the frequency.
    pub fn terms(&self) -> WedgeTerms {
        let scale = -self.share() / (2.0 * self.n);
        let term = |epsilon| Deviation(epsilon).term(self.n, scale);
        WedgeTerms(self.deviations().map(term))
    }

    fn deviation(&self, beta: f64) -> Deviation {
        let period = 2.0 * PI * self.n;
        let from = PI + beta;
        Deviation(from - period * (from / period).round())
    }
}

impl Diffracted {
    /// The part that a boundary belongs to: of the first two the incident wave, then the faces in turn.
    #[inline]
    pub(crate) fn part_mut(&mut self, boundary: usize) -> &mut Complex {
        match boundary {
            0 | 1 => &mut self.incident,
            2 => &mut self.first_face,
            _ => &mut self.second_face,
        }
    }

    /// This share of it, and for the rest another.
    fn mixed(&self, other: &Self, share: f64) -> Self {
        if share >= 1.0 {
            return *self;
        }
        let mixed = |here: Complex, there: Complex| here * share + there * (1.0 - share);
        Self {
            incident: mixed(self.incident, other.incident),
            first_face: mixed(self.first_face, other.first_face),
            second_face: mixed(self.second_face, other.second_face),
        }
    }

    /// Behind a rigid wedge: all parts together.
    pub fn rigid(&self) -> Complex {
        self.incident + self.first_face + self.second_face
    }
}

/// ε: the angle by which a ray misses a shadow boundary.
struct Deviation(f64);

impl Deviation {
    fn sin_half_squared(&self) -> f64 {
        (0.5 * self.0).sin().powi(2)
    }

    fn term(&self, n: f64, scale: f64) -> Term {
        let size = self.0.abs();
        let slow = size / (2.0 * n);
        let ratio = if slow < 1e-9 {
            n
        } else {
            (0.5 * size).sin() / slow.sin()
        };
        Term {
            factor: 1f64.copysign(self.0) * slow.cos() * ratio * scale,
            turn: 2.0 * self.sin_half_squared(),
        }
    }
}

/// One boundary's share of the diffracted field.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Term {
    factor: f64,
    /// The transition function's argument over kL.
    turn: f64,
}

/// The four boundaries of [`WedgeAngles`], ready for every frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WedgeTerms([Term; 4]);

impl WedgeTerms {
    /// The diffracted field at a product of wavenumber and distance parameter in each band.
    fn diffracted_in_bands(&self, kl: &[f64; BANDS]) -> [Diffracted; BANDS] {
        let mut fields = [Diffracted::default(); BANDS];
        for (i, term) in self.0.iter().enumerate() {
            let at = transitions(&kl.map(|kl| kl * term.turn));
            for (field, at) in fields.iter_mut().zip(at) {
                *field.part_mut(i) += at * term.factor;
            }
        }
        fields
    }

    /// The diffracted field at a product of wavenumber and distance parameter.
    pub fn diffracted(&self, kl: f64) -> Diffracted {
        let at = |term: &Term| transition(kl * term.turn) * term.factor;
        let [a, b, first, second] = &self.0;
        Diffracted {
            incident: at(a) + at(b),
            first_face: at(first),
            second_face: at(second),
        }
    }
}

/// A wedge ready for every frequency from a lowest one on: the uniform theory, and near the edge the exact field.
#[derive(Debug, Clone, Copy)]
pub struct AroundWedge {
    terms: WedgeTerms,
    near: Option<DiffractingEdge>,
}

impl AroundWedge {
    /// For wavenumbers of at least `lowest` (rad/m).
    pub fn of(angles: &WedgeAngles, spread: &Spread, lowest: f64) -> Self {
        let is_near = biot_tolstoy::share(lowest * spread.distance_m) > 0.0;
        let near = || DiffractingEdge::of(angles, spread.distance_m / spread.length_m);
        Self {
            terms: angles.terms(),
            near: is_near.then(near),
        }
    }

    /// The diffracted field at a product of wavenumber and distance parameter.
    pub fn diffracted(&self, kl: f64) -> Diffracted {
        let Some(near) = &self.near else {
            return self.terms.diffracted(kl);
        };
        let share = biot_tolstoy::share(kl);
        if share <= 0.0 {
            return self.terms.diffracted(kl);
        }
        let exact = near.diffracted(kl);
        exact.mixed(&self.terms.diffracted(kl), share)
    }

    /// The same in each band, at once.
    pub fn diffracted_in_bands(&self, kl: &[f64; BANDS]) -> [Diffracted; BANDS] {
        let mut fields = self.terms.diffracted_in_bands(kl);
        if let Some(near) = &self.near {
            let pole_waves = near.poles_in_bands(kl);
            for (b, field) in fields.iter_mut().enumerate() {
                let share = biot_tolstoy::share(kl[b]);
                if share > 0.0 {
                    let exact = near.with_rest(pole_waves[b], kl[b]);
                    *field = exact.mixed(field, share);
                }
            }
        }
        fields
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far and near: the lowest frequency is taken from the uniform theory, or from the exact field.
    const SPREADS: [(f64, Spread); 2] = [
        (
            20.0,
            Spread {
                distance_m: 2.0,
                length_m: 8.0,
            },
        ),
        (
            1.0,
            Spread {
                distance_m: 0.5,
                length_m: 2.5,
            },
        ),
    ];

    #[test]
    fn half_of_the_wave_is_left_at_the_shadow_boundary() {
        for n in [1.1, 1.5, 1.75, 2.0] {
            for incoming in [0.1, 0.5] {
                let at = |outgoing| WedgeAngles {
                    n,
                    incoming,
                    outgoing,
                };
                let boundary = incoming + PI;
                if boundary > n * PI {
                    continue;
                }
                let step = 1e-9;
                for (wavenumber, spread) in &SPREADS {
                    // The series' own error; near a right angle's edge a pole changes sheets at the very boundary, and
                    // the sum over points differs by its own, 0.001 dB.
                    let most = if wavenumber * spread.distance_m > 3.0 {
                        1e-5
                    } else {
                        3e-4
                    };
                    let lit = at(boundary - step).diffracted(*wavenumber, spread);
                    let dark = at(boundary + step).diffracted(*wavenumber, spread);
                    let jump = dark.incident - lit.incident;
                    assert!((jump - Complex::ONE).abs() < most, "{jump:?}");
                    assert!((dark.rigid() - lit.rigid() - Complex::ONE).abs() < most);
                }
            }
        }
    }

    #[test]
    fn a_reflection_hands_over_half_of_itself_where_its_face_ends() {
        let n = 1.5;
        for (incoming, boundary, first) in
            [(1.0, PI - 1.0, true), (4.0, 2.0 * n * PI - PI - 4.0, false)]
        {
            for (wavenumber, spread) in &SPREADS {
                let at = |outgoing| {
                    WedgeAngles {
                        n,
                        incoming,
                        outgoing,
                    }
                    .diffracted(*wavenumber, spread)
                };
                let (low, high) = (at(boundary - 1e-9), at(boundary + 1e-9));
                let jump = if first {
                    high.first_face - low.first_face
                } else {
                    low.second_face - high.second_face
                };
                assert!((jump - Complex::ONE).abs() < 1e-5, "{jump:?}");
            }
        }
    }

    #[test]
    fn source_and_listener_may_change_places() {
        for (n, incoming, outgoing) in [(2.0, 0.3, 4.9), (1.5, 0.0, 4.0), (1.25, 1.0, 3.9)] {
            let there = WedgeAngles {
                n,
                incoming,
                outgoing,
            };
            let back = WedgeAngles {
                n,
                incoming: outgoing,
                outgoing: incoming,
            };
            for (wavenumber, spread) in &SPREADS {
                let at = |angles: &WedgeAngles| angles.diffracted(*wavenumber, spread).rigid();
                assert!((at(&there) - at(&back)).abs() < 1e-12);
            }
            assert_eq!(there.face_cosines(0.9), back.face_cosines(0.9));
        }
    }

    #[test]
    fn from_the_uniform_theory_to_the_exact_field_there_is_no_step() {
        let angles = WedgeAngles {
            n: 1.5,
            incoming: 0.4,
            outgoing: 4.1,
        };
        let spread = Spread {
            distance_m: 0.5,
            length_m: 2.5,
        };
        let mut before: Option<Complex> = None;
        for step in 0..400 {
            let kl = 0.5 + 0.01 * f64::from(step);
            let now = angles.diffracted(kl / spread.distance_m, &spread).rigid();
            if let Some(before) = before {
                assert!((now - before).abs() < 0.01 * before.abs(), "{kl}");
            }
            before = Some(now);
        }
    }
}
