//! The direct path: visible, or transmitted through walls.
//!
//! Computed with every update and every graphics frame instead of extrapolated. The factors of walls multiply. Own.

use glam::{DVec3, Vec3};

use crate::acoustics::{BANDS, BandArray, Material};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::amplitude::free_field;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER, Path};
use crate::scene::{Scene, SourceId, SourcePose};

/// Most walls of a transmitted path; more are taken as opaque.
pub const MAX_WALLS: usize = 4;

/// Thickness of a solid in metres up to which its two faces are one wall with one transmission loss.
const MAX_THICKNESS_M: f32 = 1.0;

/// Least cosine between the two faces of a wall that is no closed solid: 10 degrees.
const PARALLEL: f32 = 0.985;

/// Least amplitude relative to the free field: −120 dB.
const INAUDIBLE: f32 = 1e-6;

/// The straight path between two points in world coordinates as if nothing were between them, without directivity. Below
/// `min_distance_m` the amplitude is constant. Real-time safe.
pub fn unoccluded_path(
    scene: &Scene,
    source: SourceId,
    from: Vec3,
    to: Vec3,
    min_distance_m: f64,
) -> Path {
    let length_m = scene.to_local(from).distance(scene.to_local(to));
    Path {
        id: Sequence::default().path_id(scene, source),
        source,
        order: 0,
        diffraction_order: 0,
        surfaces: [0; MAX_ORDER],
        edges: [0; MAX_DIFFRACTION_ORDER],
        points: [Vec3::ZERO; MAX_ORDER],
        image: from,
        length_m: length_m as f32,
        amplitude: free_field(scene, length_m, min_distance_m),
    }
}

/// The direct path between two points in world coordinates without directivity, or `None` where [`transmission`] has none.
/// Below `min_distance_m` the amplitude is constant. Adds the rays cast to `rays`. Real-time safe.
pub fn direct_path(
    scene: &Scene,
    source: SourceId,
    from: Vec3,
    to: Vec3,
    min_distance_m: f64,
    rays: &mut u64,
) -> Option<Path> {
    let through = transmission(scene, scene.to_local(from), scene.to_local(to), rays)?;
    let mut path = unoccluded_path(scene, source, from, to, min_distance_m);
    for (value, factor) in path.amplitude.iter_mut().zip(through) {
        *value *= factor;
    }
    Some(path)
}

/// [`direct_path`] of a source as far as its effects permit. `default_min_distance_m` applies to sources without a least
/// distance of their own.
pub fn direct_path_of(
    scene: &Scene,
    source: &SourcePose,
    to: Vec3,
    default_min_distance_m: f64,
    rays: &mut u64,
) -> Option<Path> {
    let effects = source.settings.effects;
    if !effects.direct {
        return None;
    }
    let from = source.position;
    if !effects.transmission && is_blocked(scene, from, to, rays) {
        return None;
    }
    let min_distance_m = source.settings.min_distance_m(default_min_distance_m);
    direct_path(scene, source.id, from, to, min_distance_m, rays)
}

/// Whether anything is on the straight line between two points in world coordinates. One ray, added to `rays`. Real-time safe.
pub fn is_blocked(scene: &Scene, from: Vec3, to: Vec3, rays: &mut u64) -> bool {
    *rays += 1;
    let [from, to] = [from, to].map(|position| scene.to_local(position).as_vec3());
    scene.any_hit(&Ray::between(from, to), [NO_GROUP, NO_GROUP])
}

/// One intersection of the line with a surface.
#[derive(Clone, Copy)]
struct Crossing<'a> {
    distance_m: f32,
    material: &'a Material,
    /// Unit normal of the triangle, on either side.
    normal: Vec3,
    /// Whether the triangle is part of a closed solid.
    is_closed: bool,
}

impl Crossing<'_> {
    /// Whether two successive crossings are the two faces of one wall. Winding has no effect.
    fn is_one_wall_with(&self, next: &Crossing<'_>) -> bool {
        // The faces of a wall may be rough in different degrees.
        let is_same = |a: &Material, b: &Material| std::ptr::eq(a, b) || a.name == b.name;
        is_same(self.material, next.material)
            && next.distance_m - self.distance_m < MAX_THICKNESS_M
            && (self.is_closed && next.is_closed || self.normal.dot(next.normal).abs() > PARALLEL)
    }
}

/// Pressure factor of all walls between two points in local coordinates, per band; `None` behind more than [`MAX_WALLS`] or
/// below −120 dB. Adds the rays cast to `rays`.
///
/// Two successive faces of the same material within 1 m are one wall if both belong to closed solids or are parallel, and so
/// is a single sheet. Winding has no effect.
///
/// # Real-time
/// Allocates nothing; casts at most two rays per wall and one more.
pub fn transmission(scene: &Scene, from: DVec3, to: DVec3, rays: &mut u64) -> Option<BandArray> {
    let mut factor = [1.0; BANDS];
    let mut ray = Ray::between(from.as_vec3(), to.as_vec3());
    let length_m = ray.direction.length();
    let mut ignored = NO_GROUP;
    let mut walls = 0;
    let mut unpaired: Option<Crossing<'_>> = None;
    loop {
        *rays += 1;
        let Some(hit) = scene.closest_hit(&ray, [ignored, NO_GROUP]) else {
            return factor.iter().any(|f| *f > INAUDIBLE).then_some(factor);
        };
        let crossing = Crossing {
            distance_m: hit.t * length_m,
            material: scene.material(hit.group),
            normal: scene.triangle_normal(hit.triangle).normalize_or_zero(),
            is_closed: scene.is_in_closed_part(hit.triangle),
        };
        let leaves_wall = |first: &mut Crossing<'_>| first.is_one_wall_with(&crossing);
        if unpaired.take_if(leaves_wall).is_none() {
            walls += 1;
            if walls > MAX_WALLS {
                return None;
            }
            let wall = scene.transmission_factor(hit.group);
            for b in 0..BANDS {
                factor[b] *= wall[b];
            }
            unpaired = Some(crossing);
        }
        // The next crossing lies beyond this one, on another plane.
        ray.t_min = hit.t;
        ignored = hit.group;
    }
}
