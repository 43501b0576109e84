//! The direct path: seen, or heard through walls.
//!
//! Cheap enough for every graphics frame, so extrapolation asks it anew each time instead of predicting.

use glam::{DVec3, Vec3};

use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::amplitude::{apply_directivity, free_field};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER, Path};
use crate::scene::{Scene, SourceId, SourcePose};

/// Walls that sound is followed through; what is behind more is not heard.
pub const MAX_WALLS: usize = 4;

/// Thickest solid that counts as one wall, in metres: its two faces make one loss, not two.
const THICKEST_WALL_M: f32 = 1.0;

/// Weakest direct path worth keeping, relative to the free field: −120 dB.
const INAUDIBLE: f32 = 1e-6;

/// The direct path from a source to a listener, both in world coordinates, or none if too much stands in between.
/// Adds the rays it cast to `rays`.
pub fn direct_path(
    scene: &Scene,
    source: SourceId,
    from: Vec3,
    to: Vec3,
    min_distance_m: f64,
    rays: &mut u64,
) -> Option<Path> {
    let (local_from, local_to) = (scene.to_local(from), scene.to_local(to));
    let through = transmission(scene, local_from, local_to, rays)?;
    let length_m = local_from.distance(local_to);
    let mut amplitude = free_field(scene, length_m, min_distance_m);
    for (value, factor) in amplitude.iter_mut().zip(through) {
        *value *= factor;
    }
    Some(Path {
        id: Sequence::default().path_id(scene, source),
        source,
        order: 0,
        diffraction_order: 0,
        surfaces: [0; MAX_ORDER],
        edges: [0; MAX_DIFFRACTION_ORDER],
        points: [Vec3::ZERO; MAX_ORDER],
        image: from,
        length_m: length_m as f32,
        amplitude,
    })
}

/// The direct path of a source with its settings: [`direct_path`], unless it is not wanted, with the directivity.
/// `otherwise_m` is the distance below which sources get no louder that do not say themselves.
pub fn direct_path_of(
    scene: &Scene,
    source: &SourcePose,
    to: Vec3,
    otherwise_m: f64,
    rays: &mut u64,
) -> Option<Path> {
    let effects = source.settings.effects;
    if !effects.direct {
        return None;
    }
    let from = source.position;
    if !effects.transmission {
        *rays += 1;
        let (from, to) = (scene.to_local(from).as_vec3(), scene.to_local(to).as_vec3());
        if scene.any_hit(&Ray::between(from, to), [NO_GROUP, NO_GROUP]) {
            return None;
        }
    }
    let min_distance_m = source.settings.min_distance_m(otherwise_m);
    let mut path = direct_path(scene, source.id, from, to, min_distance_m, rays)?;
    apply_directivity(&mut path.amplitude, source, to - from);
    Some(path)
}

/// One crossing of a surface on the way.
#[derive(Clone, Copy)]
struct Crossing {
    distance_m: f32,
    material: u32,
    /// Whether the way goes in through the face that its winding shows, out of a solid otherwise.
    enters: bool,
}

/// Pressure factor of all walls between two points in local coordinates; `None` beyond [`MAX_WALLS`] or below hearing.
///
/// Two faces of the same material that the way enters and leaves within a metre are one wall of that material, and so
/// is a single sheet.
pub fn transmission(scene: &Scene, from: DVec3, to: DVec3, rays: &mut u64) -> Option<BandArray> {
    let mut factor = [1.0; BANDS];
    let mut ray = Ray::between(from.as_vec3(), to.as_vec3());
    let length_m = ray.direction.length();
    let mut ignored = NO_GROUP;
    let mut walls = 0;
    let mut entered: Option<Crossing> = None;
    loop {
        *rays += 1;
        let Some(hit) = scene.closest_hit(&ray, [ignored, NO_GROUP]) else {
            return factor.iter().any(|f| *f > INAUDIBLE).then_some(factor);
        };
        let crossing = Crossing {
            distance_m: hit.t * length_m,
            material: scene.surface(hit.group).material,
            enters: scene.triangle_normal(hit.triangle).dot(ray.direction) < 0.0,
        };
        let closes_wall = entered.is_some_and(|first| {
            !crossing.enters
                && first.material == crossing.material
                && crossing.distance_m - first.distance_m < THICKEST_WALL_M
        });
        if closes_wall {
            entered = None;
        } else {
            walls += 1;
            if walls > MAX_WALLS {
                return None;
            }
            let wall = scene.transmission_factor(hit.group);
            for b in 0..BANDS {
                factor[b] *= wall[b];
            }
            entered = crossing.enters.then_some(crossing);
        }
        // The next crossing lies beyond this one, on another plane.
        ray.t_min = hit.t;
        ignored = hit.group;
    }
}
