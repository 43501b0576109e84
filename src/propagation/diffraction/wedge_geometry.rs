//! Angles and lengths at a wedge, and the field diffracted there. Plain data, any thread.

use std::f64::consts::PI;

use glam::DVec3;

use crate::propagation::diffraction::complex::Complex;
use crate::scene::edges::{Edge, EdgeCrossing};

/// Directions of the incoming and the outgoing ray around a wedge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WedgeAngles {
    /// Exterior angle in units of π: 2 for a sheet, 1.5 outside a right-angled corner.
    pub n: f64,
    /// Angle of the incoming ray from the first face, in radians, 0 to nπ.
    pub incoming: f64,
    /// Angle of the outgoing ray from the first face, in radians, 0 to nπ.
    pub outgoing: f64,
}

/// Angle in radians below which a ray is parallel to a face.
const GRAZING: f64 = 1e-6;

/// Angle in radians from a shadow boundary within which rays in single precision do not resolve the side.
const UNRESOLVED: f64 = 1e-4;

/// Least angle in radians from a shadow boundary.
const LEAST_ANGLE: f64 = 1e-9;

/// Lengths of a path over an edge: s before and s' after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The distance parameter L = s s' sin²β₀ / (s + s') in metres.
    pub distance_m: f64,
    /// s + s' in metres.
    pub length_m: f64,
}

/// The diffracted field, relative to the free field over the path's length, without its delay.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DiffractedField {
    /// Continues the incident wave at its shadow boundary: −½ on the lit side, +½ in the shadow.
    pub incident: Complex,
    /// Continues the reflection in the first face at its boundary.
    pub first_face: Complex,
    /// Continues the reflection in the second face at its boundary.
    pub second_face: Complex,
}

/// Whether an angle around a wedge of exterior angle nπ is that of one of its faces.
pub(crate) fn is_on_face(n: f64, angle: f64) -> bool {
    angle < GRAZING || n * PI - angle < GRAZING
}

/// The same crossing on the side of the incident wave's shadow boundary that a visibility ray has found, if its angles are
/// too close to the boundary: a wave counts as lit or as diffracted, never as both or neither.
pub fn on_side(edge: &Edge, crossing: &EdgeCrossing, is_lit: bool) -> EdgeCrossing {
    let turn = crossing.outgoing - crossing.incoming;
    let depth = turn.abs() - PI;
    if depth.abs() > UNRESOLVED {
        return *crossing;
    }
    let depth = depth.abs().max(LEAST_ANGLE);
    let depth = if is_lit { -depth } else { depth };
    let outgoing = crossing.incoming + (PI + depth).copysign(turn);
    EdgeCrossing {
        outgoing: outgoing.clamp(0.0, edge.n * PI),
        ..*crossing
    }
}

/// An angle ε from the boundary of a wave.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Deviation {
    /// ε in radians.
    pub(crate) epsilon: f64,
    /// sin(ε/2).
    pub(crate) half_sine: f64,
    /// Sine and cosine of |ε|/2n.
    pub(crate) slow_sine: f64,
    pub(crate) slow_cosine: f64,
}

impl WedgeAngles {
    /// The angles of a path over an edge.
    pub fn of(edge: &Edge, crossing: &EdgeCrossing) -> Self {
        Self {
            n: edge.n,
            incoming: crossing.incoming,
            outgoing: crossing.outgoing,
        }
    }

    /// The angles of two points around an edge; `None` if one is inside the wedge.
    pub(crate) fn between(edge: &Edge, from: DVec3, to: DVec3) -> Option<Self> {
        Some(Self {
            n: edge.n,
            incoming: edge.angle_of(from)?,
            outgoing: edge.angle_of(to)?,
        })
    }

    /// Cosines of incidence on the two faces at the boundaries of their reflections, for the reflection factors.
    /// Reciprocal: the same with source and listener exchanged.
    pub fn face_cosines(&self, sin_edge: f64) -> [f64; 2] {
        let steeper = |a: f64, b: f64| (a.sin().max(b.sin()) * sin_edge).clamp(0.0, 1.0);
        let far = self.n * PI;
        [
            steeper(self.incoming, self.outgoing),
            steeper(far - self.incoming, far - self.outgoing),
        ]
    }

    /// Argument x of the transition function at the nearest shadow boundary of the incident wave. `wavenumber` in rad/m,
    /// `distance_m` is [`Spread::distance_m`].
    pub fn transition_argument(&self, wavenumber: f64, distance_m: f64) -> f64 {
        let beta = self.outgoing - self.incoming;
        let sine_squared = |beta| (0.5 * self.deviation(beta)).sin().powi(2);
        2.0 * wavenumber * distance_m * sine_squared(beta).min(sine_squared(-beta))
    }

    /// Share of the incident wave in the field at the edge: ½ at grazing incidence, where it includes its reflection.
    pub(crate) fn grazing_factor(&self) -> f64 {
        match is_on_face(self.n, self.incoming) || is_on_face(self.n, self.outgoing) {
            true => 0.5,
            false => 1.0,
        }
    }

    /// Angles ε from the four boundaries: two of the incident wave, those of the first and the second face's reflection.
    pub(crate) fn deviations(&self) -> [f64; 4] {
        let (minus, plus) = (self.outgoing - self.incoming, self.outgoing + self.incoming);
        // π − (φ + φ') is zero where the first face's reflection ends, π + (φ + φ') − 2πn the second's.
        [minus, -minus, -plus, plus].map(|beta| self.deviation(beta))
    }

    /// On which side of each of the four boundaries the path lies: bits 0 to 3. A wave changes its sign where one of them
    /// changes.
    pub(crate) fn sides(&self) -> u32 {
        let bits = self.deviations().map(|epsilon| u32::from(epsilon < 0.0));
        bits.into_iter().fold(0, |sides, bit| 2 * sides + bit)
    }

    /// [`Self::deviations`] with their sines.
    pub(crate) fn boundaries(&self) -> [Deviation; 4] {
        self.deviations().map(|epsilon| {
            let (slow_sine, slow_cosine) = (epsilon.abs() / (2.0 * self.n)).sin_cos();
            Deviation {
                epsilon,
                half_sine: (0.5 * epsilon).sin(),
                slow_sine,
                slow_cosine,
            }
        })
    }

    fn deviation(&self, beta: f64) -> f64 {
        let period = 2.0 * PI * self.n;
        let from = PI + beta;
        from - period * (from / period).round()
    }
}

impl DiffractedField {
    /// The total field behind a rigid wedge.
    pub fn rigid(&self) -> Complex {
        self.incident + self.first_face + self.second_face
    }
}
