//! What all bent paths have in common: sight lines to an edge, the wave around it, the path that comes of it.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::acoustics::bands::CENTRES_HZ;
use crate::acoustics::material::Reflectance;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::propagation::amplitude::{apply_directivity, free_field};
use crate::propagation::diffraction::complex::Complex;
use crate::propagation::diffraction::utd::{AroundWedge, Spread, WedgeAngles};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::sequence::{Interaction, interaction_path_id};
use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER, Path};
use crate::scene::Scene;
use crate::scene::edges::{Edge, EdgeCrossing};

/// One complex value a band.
pub type Wave = [Complex; BANDS];

/// How far in front of an edge, in the middle of its air, sight lines end, in metres: a third surface that touches the
/// edge does not hide it, and nothing that one could hear passes between.
const CLEARANCE_M: f64 = 1e-3;

/// Where sight lines to a bend end.
pub fn stand(edge: &Edge, apex: DVec3) -> DVec3 {
    stand_outward(apex, edge.outward())
}

/// The same for an edge whose [`Edge::outward`] is known.
pub fn stand_outward(apex: DVec3, outward: DVec3) -> DVec3 {
    apex + CLEARANCE_M * outward
}

/// Whether nothing outside two surfaces lies between two points. Adds the ray to `rays`.
pub fn sees(scene: &Scene, from: DVec3, to: DVec3, ignored: [u32; 2], rays: &mut u64) -> bool {
    *rays += 1;
    let line = Ray::between(from.as_vec3(), to.as_vec3());
    !scene.any_hit(&line, ignored)
}

/// Wavenumbers of the band centres in rad/m.
pub fn wavenumbers(scene: &Scene) -> [f64; BANDS] {
    CENTRES_HZ.map(|hz| 2.0 * PI * hz / scene.speed_of_sound_m_s())
}

/// Share of a wave that the wall behind an edge takes away: 1 less what comes through its faces.
pub fn taken_away(scene: &Scene, edge: &Edge) -> BandArray {
    let [a, b] = edge.faces;
    let through = scene.transmission_factor(a);
    // In through one face and out through the other of the same material is one wall.
    if scene.surface(a).material == scene.surface(b).material {
        return through.map(|t| 1.0 - t);
    }
    let other = scene.transmission_factor(b);
    std::array::from_fn(|band| 1.0 - through[band] * other[band])
}

/// The wave around one edge, relative to the free field over the same length and with that length's delay taken out:
/// what continues the incoming wave, and what continues its reflections in the edge's faces.
/// `beside_transmission` says whether what comes through the wall is heard besides ([`taken_away`]), `fades` of each face
/// whether its reflection fades towards the edge by itself ([`fading_faces`]), so that it is not continued here.
pub fn around(
    scene: &Scene,
    edge: &Edge,
    crossing: &EdgeCrossing,
    spread: &Spread,
    beside_transmission: bool,
    fades: [bool; 2],
) -> (Wave, Wave) {
    let angles = WedgeAngles {
        n: edge.n,
        incoming: crossing.incoming,
        outgoing: crossing.outgoing,
    };
    let cosines = angles.face_cosines(crossing.sin_edge);
    let faces = edge.faces.map(|face| scene.reflectance(face));
    let taken = match beside_transmission {
        true => taken_away(scene, edge),
        false => [1.0; BANDS],
    };
    let (mut incident, mut reflected) = ([Complex::ZERO; BANDS], [Complex::ZERO; BANDS]);
    let wavenumbers = wavenumbers(scene);
    let wedge = AroundWedge::of(&angles, spread, wavenumbers[0]);
    let kl = wavenumbers.map(|wavenumber| wavenumber * spread.distance_m);
    let waves = wedge.diffracted_in_bands(&kl);
    for b in 0..BANDS {
        let (wave, kl) = (&waves[b], kl[b]);
        incident[b] = wave.incident * f64::from(taken[b]);
        let first = near_face(faces[0], b, cosines[0], kl);
        let second = near_face(faces[1], b, cosines[1], kl);
        let first_face = wave.first_face * (first * not_continuing(wave.first_face, fades[0]));
        let second_face = wave.second_face * (second * not_continuing(wave.second_face, fades[1]));
        reflected[b] = first_face + second_face;
    }
    (incident, reflected)
}

/// What is left of a face's part where the face's reflection fades by itself: nothing at the boundary, where the part is
/// half of the reflection and would continue it, all from where it is a quarter.
fn not_continuing(part: Complex, fades: bool) -> f64 {
    match fades {
        true => 1.0 - crate::propagation::diffraction::smooth(4.0 * part.abs() - 1.0),
        false => 1.0,
    }
}

/// Which of an edge's faces are small free panels at a bend: single reflections in them fade towards the edge
/// ([`crate::propagation::image_source::finite_panel`]).
pub fn fading_faces(scene: &Scene, edge: &Edge, apex: DVec3) -> [bool; 2] {
    if !scene.has_finite_panels() {
        return [false; 2];
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
        is_free(edge.faces[0], first),
        is_free(edge.faces[1], second),
    ]
}

/// Reflection factor of a spherical wave at an angle given by its cosine, k times the distance parameter away: the plane
/// wave's, R, but where a wave runs along a face for some wavelengths only the face hardly weakens it, while R of any
/// impedance is −1 there.
///
/// Weyl and van der Pol's Q = R + (1 − R) F(w), w = ½ k L (cos θ + 1/ζ)² (\[ATTENBOROUGH88\]), adapted: in place of the
/// boundary loss F its size, 1 − √(πw) for small w and 1/2w for large, in one fraction.
fn near_face(face: &Reflectance, band: usize, cosine: f64, kl: f64) -> f64 {
    let impedance = f64::from(face.impedance[band]);
    let plane = (impedance * cosine - 1.0) / (impedance * cosine + 1.0);
    let w = 0.5 * kl * (cosine + 1.0 / impedance).powi(2);
    let loss = 1.0 / (1.0 + (PI * w).sqrt() + 2.0 * w);
    (plane + (1.0 - plane) * loss) * f64::from(face.residue[band])
}

/// L = s s' sin²β₀ / (s + s') of a single bend.
pub fn distance_m(crossing: &EdgeCrossing) -> f64 {
    crossing.before_m * crossing.after_m / crossing.length_m() * crossing.sin_edge.powi(2)
}

/// Lengths of a single bend.
pub fn spread(crossing: &EdgeCrossing) -> Spread {
    Spread {
        distance_m: distance_m(crossing),
        length_m: crossing.length_m(),
    }
}

/// The signed size of a wave. Its phase is near 0 to −45° behind a boundary and 180° to 135° before it, so the sign of
/// its part along −22.5° tells the sides apart; where a wave is neither it fades instead of jumping.
pub fn signed(wave: Complex) -> f64 {
    let size = wave.abs();
    if size < 1e-12 {
        return 0.0;
    }
    let along = (wave * Complex::turn(PI / 8.0)).re / size;
    size * (4.0 * along).clamp(-1.0, 1.0)
}

/// Reflections and bends of a path, from source to listener.
pub struct Course<'a> {
    /// What the path meets.
    pub stops: &'a [Interaction],
    /// Where, in local coordinates.
    pub points: &'a [DVec3],
    /// Its length in metres.
    pub length_m: f64,
    /// Where the listener hears it from: the last point, or where the last bend is seen in the mirrors after it.
    pub heard_at: DVec3,
}

/// A path of given band gains relative to the free field over its length, no louder than the source is at the nearest
/// distance: closer to an edge than a wavelength the asymptotic waves along hard faces add up to a tenth more.
pub fn path(scene: &Scene, spot: &Endpoints, course: &Course<'_>, gains: &BandArray) -> Path {
    let mut amplitude = free_field(scene, course.length_m, spot.min_distance_m);
    let loudest = (1.0 / spot.min_distance_m) as f32;
    for (value, gain) in amplitude.iter_mut().zip(gains) {
        *value = (*value * gain).clamp(-loudest, loudest);
    }
    if let Some(first) = course.points.first() {
        let departure = (*first - scene.to_local(spot.from)).as_vec3();
        apply_directivity(&mut amplitude, &spot.source, departure);
    }
    let (mut surfaces, mut edges) = ([0; MAX_ORDER], [0; MAX_DIFFRACTION_ORDER]);
    let (mut order, mut diffraction_order) = (0, 0);
    for stop in course.stops {
        match *stop {
            Interaction::Surface(surface) => {
                surfaces[order] = surface;
                order += 1;
            }
            Interaction::Edge(edge) => {
                edges[diffraction_order] = edge;
                diffraction_order += 1;
            }
        }
    }
    let mut points = [Vec3::ZERO; MAX_ORDER];
    for (slot, point) in points.iter_mut().zip(course.points) {
        *slot = scene.to_world(*point);
    }
    let ear = scene.to_local(spot.to);
    let towards = (course.heard_at - ear).normalize_or_zero();
    Path {
        id: interaction_path_id(scene, spot.source.id, course.stops.iter().copied()),
        source: spot.source.id,
        order: order as u8,
        diffraction_order: diffraction_order as u8,
        surfaces,
        edges,
        points,
        image: scene.to_world(ear + towards * course.length_m),
        length_m: course.length_m as f32,
        amplitude,
    }
}
