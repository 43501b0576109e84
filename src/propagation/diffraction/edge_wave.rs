//! Shared by all diffracted paths: visibility of an edge, the diffracted field there, and the resulting [`Path`].

use std::array::from_fn;
use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::acoustics::bands::CENTRES_HZ;
use crate::acoustics::{BANDS, BandArray, smoothstep};
use crate::geometry::Ray;
use crate::propagation::amplitude::{apply_directivity, free_field};
use crate::propagation::diffraction::MIN_RELATIVE_AMPLITUDE;
use crate::propagation::diffraction::complex::{Complex, ComplexBands};
use crate::propagation::diffraction::transition::{HALF, HalfWave, halves, transition_of_half};
use crate::propagation::diffraction::truncation::Ends;
use crate::propagation::diffraction::utd::{WedgeWaves, wedge_waves};
use crate::propagation::diffraction::wedge_geometry::{Spread, WedgeAngles};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::{Interaction, interaction_path_id};
use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER, Path};
use crate::scene::Scene;
use crate::scene::edges::{Edge, EdgeCrossing};
use crate::simd::elementary::turned;
use crate::simd::{ComplexLanes, Doubles, LaneSet, kernel};

/// Distance of [`sight_point`] from its edge in metres: a third surface that touches the edge does not occlude it.
const CLEARANCE_M: f64 = 1e-3;

/// End point of visibility rays to a point on an edge: in the middle of the air around it, and off the edge's ends.
/// `outward` is [`Edge::outward`].
pub fn sight_point(edge: &Edge, apex: DVec3, outward: DVec3) -> DVec3 {
    let along_m = (apex - edge.origin).dot(edge.direction);
    let inside_m = along_m.clamp(CLEARANCE_M, edge.length_m - CLEARANCE_M) - along_m;
    apex + inside_m * edge.direction + CLEARANCE_M * outward
}

/// Whether no surface but the two `ignored` ones lies between two points. Adds the ray to `rays`.
pub fn is_unoccluded(
    scene: &Scene,
    from: DVec3,
    to: DVec3,
    ignored: [u32; 2],
    rays: &mut u64,
) -> bool {
    *rays += 1;
    let line = Ray::between(from.as_vec3(), to.as_vec3());
    !scene.any_hit(&line, ignored)
}

/// Source and listener in local coordinates.
pub fn local_positions(scene: &Scene, endpoints: &Endpoints) -> (DVec3, DVec3) {
    (scene.to_local(endpoints.from), scene.to_local(endpoints.to))
}

/// Wavenumbers of the band centres in rad/m.
pub fn wavenumbers(scene: &Scene) -> [f64; BANDS] {
    CENTRES_HZ.map(|hz| 2.0 * PI * hz / scene.speed_of_sound_m_s())
}

/// Share of a wave's pressure that the wall at an edge removes: 1 − transmission.
pub fn barrier_loss(scene: &Scene, edge: &Edge) -> BandArray {
    let [a, b] = edge.faces;
    let through = scene.transmission_factor(a);
    // Two faces of the same material are one wall.
    if scene.surface(a).material == scene.surface(b).material {
        return through.map(|t| 1.0 - t);
    }
    let other = scene.transmission_factor(b);
    from_fn(|band| 1.0 - through[band] * other[band])
}

/// The diffracted field of one edge relative to the free field over the same length, without its delay: first the part
/// that continues the incident wave, then the part that continues its reflections in the edge's faces.
///
/// With `beside_transmission` the incident part is scaled by [`barrier_loss`], since the transmitted path is audible
/// besides. The reflection of a face in `fading` ([`finite_panel_faces`]) fades and is not continued.
pub fn diffracted_field(
    scene: &Scene,
    edge: &Edge,
    crossing: &EdgeCrossing,
    spread: &Spread,
    beside_transmission: bool,
    fading: [bool; 2],
) -> (ComplexBands, ComplexBands) {
    let weight = |face: usize, wave, along| continuation_factor(wave, fading[face], along);
    field_of_faces(scene, edge, crossing, spread, beside_transmission, weight)
}

/// [`diffracted_field`] with a weight for the part of each face, first (0) or second (1), given its [`along_faces`].
pub(super) fn field_of_faces(
    scene: &Scene,
    edge: &Edge,
    crossing: &EdgeCrossing,
    spread: &Spread,
    beside_transmission: bool,
    weight: impl Fn(usize, Complex, f64) -> f64,
) -> (ComplexBands, ComplexBands) {
    let angles = WedgeAngles::of(edge, crossing);
    let cosines = angles.face_cosines(crossing.sin_edge);
    let faces = edge.faces.map(|face| scene.reflectance(face));
    let loss = match beside_transmission {
        true => barrier_loss(scene, edge),
        false => [1.0; BANDS],
    };
    let wavenumbers = wavenumbers(scene);
    let kl = wavenumbers.map(|wavenumber| wavenumber * spread.distance_m);
    let mut waves = wedge_waves(&angles, spread, &kl);
    let mut of_faces = [[FaceFactors::default(); 2]; 2];
    let along = along_faces(&waves.arguments);
    for (half, of_faces) in waves.halves.iter().zip(&mut of_faces) {
        for (face, factors) in of_faces.iter_mut().enumerate() {
            factors.cosine = cosines[face];
            let part = &half.waves.parts[1 + face];
            for (b, continued) in factors.continued.iter_mut().enumerate() {
                *continued = weight(face, part.at(b), along[face]);
            }
        }
    }
    truncate(&mut waves, crossing, &wavenumbers, &kl);
    let (mut incident, mut reflected) = ([Complex::ZERO; BANDS], [Complex::ZERO; BANDS]);
    for (half, (kl, of_faces)) in halves(&kl).iter().zip(&mut of_faces).enumerate() {
        let first = half * HALF;
        for (factors, face) in of_faces.iter_mut().zip(faces) {
            for b in 0..HALF {
                factors.impedance[b] = f64::from(face.impedance[first + b]);
                factors.residue[b] = f64::from(face.residue[first + b]);
            }
        }
        let loss = from_fn(|b| f64::from(loss[first + b]));
        let parts = &waves.halves[half].waves.parts;
        let mut result = [HalfWave::default(); 2];
        combine(LaneSet::best(), parts, &loss, of_faces, kl, &mut result);
        for b in 0..HALF {
            incident[first + b] = result[0].at(b);
            reflected[first + b] = result[1].at(b);
        }
    }
    (incident, reflected)
}

/// Factors on the part of one face in half of the bands.
#[derive(Clone, Copy, Default)]
struct FaceFactors {
    continued: [f64; HALF],
    impedance: [f64; HALF],
    residue: [f64; HALF],
    /// Cosine of the angle of incidence.
    cosine: f64,
}

kernel! {
    /// The incident part times what the wall removes, and the faces' parts times their factors. Bands are lanes.
    fn combine<Wide>(
        parts: &[HalfWave; 3],
        loss: &[f64; HALF],
        faces: &[FaceFactors; 2],
        kl: &[f64; HALF],
        result: &mut [HalfWave; 2],
    ) {
        let incident = parts[0].load::<Wide::Doubles>();
        result[0].store(incident.scale(Wide::Doubles::load(loss)));
        let kl = Wide::Doubles::load(kl);
        let first = of_face(&parts[1], &faces[0], kl);
        let second = of_face(&parts[2], &faces[1], kl);
        result[1].store(first.add(second));
    }
}

/// The part of a face times its factors.
#[inline(always)]
fn of_face<D: Doubles>(part: &HalfWave, face: &FaceFactors, kl: D) -> ComplexLanes<D> {
    let factor = spherical_reflection_factor(face, kl);
    part.load().scale(factor.mul(D::load(&face.continued)))
}

/// Removes from the field of an infinite edge what lies beyond the edge's ends. Beyond an end the field is relative to
/// the free field over the path through it.
fn truncate(
    waves: &mut WedgeWaves,
    crossing: &EdgeCrossing,
    wavenumbers: &[f64; BANDS],
    kl: &[f64; BANDS],
) {
    let ends = Ends::of(crossing.excess_m, wavenumbers);
    if !ends.reach(0) {
        return;
    }
    let beyond_m = crossing.beyond_m();
    let weight = crossing.beyond_weight() * crossing.length_m() / (crossing.length_m() - beyond_m);
    let arguments = waves.arguments;
    let incident = usize::from(arguments[1] < arguments[0]);
    for (index, (half, kl)) in waves.halves.iter_mut().zip(&halves(kl)).enumerate() {
        if !ends.reach(index) && weight == 1.0 {
            continue;
        }
        // At the nearer of the incident wave's boundaries, and at those of the faces' reflections.
        let boundaries = [incident, 2, 3];
        let arguments = boundaries.map(|boundary| kl.map(|kl| kl * arguments[boundary]));
        let whole = match half.is_uniform {
            true => boundaries.map(|boundary| half.waves.alone[boundary]),
            false => arguments.map(|argument| transition_of_half(&argument)),
        };
        ends.truncate(index, &arguments, &whole, weight, &mut half.waves.parts);
    }
}

/// How much the part of each face belongs to the incident wave along the face, given [`WedgeWaves::arguments`]: 1 on the face,
/// where both are the same wave, and 0 where the boundary of the face's reflection is half as far as the incident wave's.
fn along_faces(arguments: &[f64; 4]) -> [f64; 2] {
    let incident = arguments[0].min(arguments[1]).max(1e-30);
    // An argument is as the square of a small angle from its boundary.
    from_fn(|face| smoothstep(2.0 * (arguments[2 + face] / incident).sqrt() - 1.0))
}

/// Factor on a face's part: for a fading face 0 at the reflection's boundary, where the part is ½, and 1 from ¼ down and `along`
/// the face.
pub(super) fn continuation_factor(part: Complex, is_fading: bool, along: f64) -> f64 {
    match is_fading {
        true => 1.0 - smoothstep(4.0 * part.abs() - 1.0) * (1.0 - along),
        false => 1.0,
    }
}

/// Which of an edge's faces have no reflection at a point of it that the edge's wave continues: those without panels, and
/// small panels, whose single reflections fade towards the edge ([`crate::propagation::image_source::finite_panel`]).
pub fn finite_panel_faces(scene: &Scene, edge: &Edge, apex: DVec3) -> [bool; 2] {
    let is_dull = edge.faces.map(|face| !scene.has_panels(face));
    if !scene.has_finite_panels() {
        return is_dull;
    }
    let normals = edge.faces.map(|face| scene.surface(face).normal);
    let first = edge.normal.dot(normals[0]) > 0.0;
    // The air is on both sides of a sheet's rim.
    let second = match edge.faces[0] == edge.faces[1] {
        true => !first,
        false => edge.outward().dot(normals[1]) > 0.0,
    };
    let is_free = |face, in_front| scene.finite_panel_at(face, apex, in_front).is_some();
    [
        is_dull[0] || is_free(edge.faces[0], first),
        is_dull[1] || is_free(edge.faces[1], second),
    ]
}

/// Reflection factor of a spherical wave at an angle of incidence with this cosine. At grazing incidence over some
/// wavelengths a hard face hardly weakens the wave, while the plane wave's factor R is −1 for any impedance.
///
/// Weyl and van der Pol's Q = R + (1 − R) F(w), w = ½ k L (cos θ + 1/ζ)² (\[ATTENBOROUGH88\]), adapted: the boundary
/// loss F is replaced by a fraction of its size, 1 − √(πw) for small w and 1/2w for large w.
#[inline(always)]
fn spherical_reflection_factor<D: Doubles>(face: &FaceFactors, kl: D) -> D {
    let (one, cosine) = (D::splat(1.0), D::splat(face.cosine));
    let impedance = D::load(&face.impedance);
    let product = impedance.mul(cosine);
    let plane = product.sub(one).div(product.add(one));
    let sum = cosine.add(one.div(impedance));
    let w = D::splat(0.5).mul(kl).mul(sum.mul(sum));
    let root = D::splat(PI).mul(w).sqrt();
    let loss = one.div(one.add(root).add(D::splat(2.0).mul(w)));
    let factor = plane.add(one.sub(plane).mul(loss));
    factor.mul(D::load(&face.residue))
}

/// Lengths of a path over one edge.
pub fn spread(crossing: &EdgeCrossing) -> Spread {
    let length_m = crossing.before_m + crossing.after_m;
    Spread {
        distance_m: crossing.before_m * crossing.after_m / length_m * crossing.sin_edge.powi(2),
        length_m,
    }
}

/// e^(−jkl) for each wavenumber k and a length l in metres: the delay of a wave that travels farther.
pub(super) fn delays(wavenumbers: &[f64; BANDS], length_m: f64) -> ComplexBands {
    let (mut result, phases) = ([Complex::ZERO; BANDS], wavenumbers.map(|k| -k * length_m));
    for (half, phases) in halves(&phases).iter().enumerate() {
        let mut wave = HalfWave::default();
        turn(LaneSet::best(), phases, &mut wave);
        (0..HALF).for_each(|b| result[half * HALF + b] = wave.at(b));
    }
    result
}

kernel! {
    /// Waves of phases. Bands are lanes.
    fn turn<Wide>(phases: &[f64; HALF], result: &mut HalfWave) {
        result.store(turned(Wide::Doubles::load(phases)));
    }
}

/// The signed magnitude of a wave. Its phase is 0 to −45° in the shadow and 180° to 135° on the lit side, so the part
/// along −22.5° has the sign; between the two the magnitude fades to 0.
pub fn real_gain(wave: Complex) -> f64 {
    /// e^(jπ/8).
    const BACK: Complex = Complex::new(0.923_879_532_511_286_7, 0.382_683_432_365_089_8);
    let size = wave.abs();
    if size < 1e-12 {
        return 0.0;
    }
    let along = (wave * BACK).re / size;
    size * (4.0 * along).clamp(-1.0, 1.0)
}

/// Whether any band's gain, relative to the free field over the path's length, exceeds [`MIN_RELATIVE_AMPLITUDE`] relative to
/// the free field over the straight distance; `spreading` is the ratio of the two free fields.
pub fn is_audible(gains: &BandArray, spreading: f64) -> bool {
    let is_loud = |gain: &f32| f64::from(gain.abs()) * spreading > MIN_RELATIVE_AMPLITUDE;
    gains.iter().any(is_loud)
}

/// The geometry of a diffracted path, from source to listener.
pub struct EdgePath<'a> {
    /// Reflections and diffractions.
    pub interactions: &'a [Interaction],
    /// Their points in local coordinates.
    pub points: &'a [DVec3],
    /// Length in metres.
    pub length_m: f64,
    /// The last point before the listener.
    pub last_point: DVec3,
}

impl EdgePath<'_> {
    /// The path of band gains relative to the free field over its length. Its amplitude is limited to that of the source
    /// at the least distance: within a wavelength of an edge the asymptotic waves along hard faces exceed it by a tenth.
    pub fn to_path(&self, scene: &Scene, endpoints: &Endpoints, gains: &BandArray) -> Path {
        let mut amplitude = free_field(scene, self.length_m, endpoints.min_distance_m);
        let loudest = (1.0 / endpoints.min_distance_m) as f32;
        for (value, gain) in amplitude.iter_mut().zip(gains) {
            *value = (*value * gain).clamp(-loudest, loudest);
        }
        let (source, listener) = local_positions(scene, endpoints);
        if let Some(first) = self.points.first() {
            let departure = (*first - source).as_vec3();
            apply_directivity(&mut amplitude, &endpoints.source, departure);
        }
        let (mut surfaces, mut edges) = ([0; MAX_ORDER], [0; MAX_DIFFRACTION_ORDER]);
        let (mut order, mut diffraction_order) = (0, 0);
        for interaction in self.interactions {
            match *interaction {
                Interaction::Surface(surface) => {
                    surfaces[order] = surface;
                    order += 1;
                }
                Interaction::Edge(edge) => {
                    edges[diffraction_order] = edge;
                    diffraction_order += 1;
                }
                // No edge's wave meets a curved surface.
                Interaction::Curved(_) => {}
            }
        }
        let mut points = [Vec3::ZERO; MAX_ORDER];
        for (world, point) in points.iter_mut().zip(self.points) {
            *world = scene.to_world(*point);
        }
        let arrival = (self.last_point - listener).normalize_or_zero();
        let interactions = self.interactions.iter().copied();
        Path {
            id: interaction_path_id(scene, endpoints.source.id, interactions),
            source: endpoints.source.id,
            order: order as u8,
            diffraction_order: diffraction_order as u8,
            surfaces,
            edges,
            points,
            image: scene.to_world(listener + arrival * self.length_m),
            length_m: self.length_m as f32,
            amplitude,
        }
    }
}
