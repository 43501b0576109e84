//! Angles and lengths at a wedge, and the field diffracted there. Plain data, any thread.

use std::f64::consts::PI;

use glam::DVec3;

use crate::geometry::angle::sin_cos;
use crate::propagation::diffraction::complex::Complex;
use crate::scene::edges::{Edge, EdgeCrossing};
use crate::simd::elementary::sine_cosine;
use crate::simd::{Doubles, LaneSet, kernel};

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

/// The angles ε from the four boundaries ([`WedgeAngles::deviations`]), and functions of them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Boundaries {
    /// ε in radians.
    pub(crate) epsilon: [f64; 4],
    /// |sin(ε/2)|.
    pub(crate) half_sine: [f64; 4],
    /// Sine and cosine of |ε|/2n.
    pub(crate) slow_sine: [f64; 4],
    pub(crate) slow_cosine: [f64; 4],
}

kernel! {
    /// The sines and cosines of boundaries, whose ε are given. Boundaries are lanes.
    fn fill_sines<Wide>(n: f64, boundaries: &mut Boundaries) {
        let epsilon = Wide::Doubles::load(&boundaries.epsilon);
        let size = epsilon.max(Wide::Doubles::splat(0.0).sub(epsilon));
        // |ε|/2 reaches nπ/2, up to π; both angles have the same sine.
        let half = Wide::Doubles::splat(0.5).mul(size);
        let (half_sine, _) = sine_cosine(half.min(Wide::Doubles::splat(PI).sub(half)));
        let (sine, cosine) = sine_cosine(half.div(Wide::Doubles::splat(n)));
        half_sine.store(&mut boundaries.half_sine);
        sine.store(&mut boundaries.slow_sine);
        cosine.store(&mut boundaries.slow_cosine);
    }
}

kernel! {
    /// Sines of angles from 0 to 2π. Beyond π, where rays are below a face, only the sign is exact.
    fn sines<Wide>(angles: &[f64; 4], result: &mut [f64; 4]) {
        let angles = Wide::Doubles::load(angles);
        let (sine, _) = sine_cosine(angles.min(Wide::Doubles::splat(PI).sub(angles)));
        sine.store(result);
    }
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
        let far = self.n * PI;
        let angles = [
            self.incoming,
            self.outgoing,
            far - self.incoming,
            far - self.outgoing,
        ];
        let mut result = [0.0; 4];
        sines(LaneSet::best(), &angles, &mut result);
        let steeper = |a: f64, b: f64| (a.max(b) * sin_edge).clamp(0.0, 1.0);
        [steeper(result[0], result[1]), steeper(result[2], result[3])]
    }

    /// Argument x of the transition function at the nearest shadow boundary of the incident wave. `wavenumber` in rad/m,
    /// `distance_m` is [`Spread::distance_m`].
    pub fn transition_argument(&self, wavenumber: f64, distance_m: f64) -> f64 {
        let beta = self.outgoing - self.incoming;
        let sine_squared = |beta| sin_cos(0.5 * self.deviation(beta)).0.powi(2);
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
    pub(crate) fn boundaries(&self) -> Boundaries {
        let mut result = Boundaries {
            epsilon: self.deviations(),
            ..Boundaries::default()
        };
        fill_sines(LaneSet::best(), self.n, &mut result);
        result
    }

    fn deviation(&self, beta: f64) -> f64 {
        let period = 2.0 * PI * self.n;
        let from = PI + beta;
        // Half a turn more than the greatest angle is less than one and a half periods.
        let turns = from / period;
        from - period * (f64::from(u8::from(turns >= 0.5)) - f64::from(u8::from(turns <= -0.5)))
    }
}

impl DiffractedField {
    /// The total field behind a rigid wedge.
    pub fn rigid(&self) -> Complex {
        self.incident + self.first_face + self.second_face
    }
}
