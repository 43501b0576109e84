//! Shares of paths whose edges are near the end of a list of the nearest ones.
//!
//! Where a listener moves on, another edge takes the place of the last one, and with a whole path over either of them the sound
//! would step. Updates and frames have the same shares ([`EdgeLimits`]). Own.

use glam::DVec3;

use crate::acoustics::smoothstep;
use crate::propagation::diffraction::ranked_list::rank_weight;
use crate::propagation::path::EdgeLimits;
use crate::scene::Scene;
use crate::scene::edges::Edge;

/// Share of a list's longest detour within which paths fade, as they do towards `MAX_DETOUR_M`.
const FADED_SHARE: f64 = 0.25;

/// Least share that counts: that of the last edge, which is 0 but for rounding, is none.
pub(super) const LEAST_SHARE: f64 = 1e-3;

/// Amplitude factor of a path by its detour over an edge in metres, in a list that ends at a longest detour.
pub(super) fn list_share(detour_m: f64, longest_m: f64) -> f64 {
    if longest_m == f64::INFINITY {
        return 1.0;
    }
    let faded_m = (FADED_SHARE * longest_m).max(f64::MIN_POSITIVE);
    let share = smoothstep((longest_m - detour_m) / faded_m);
    if share < LEAST_SHARE { 0.0 } else { share }
}

/// Energy of the path over two edges that continues a wave over one, relative to that wave's, where the second edge begins to hide it:
/// half of its amplitude.
pub(super) const HIDDEN_ENERGY: f64 = 0.25;

/// Amplitude factor at the boundary where a second edge begins to hide a wave over one edge with this energy and detour: 1 where the
/// path over both edges continues it, 0 where that path is too long or too quiet for its lists. `least_energy` is
/// [`DirectField::least_energy`](super::DirectField::least_energy).
pub(super) fn continued_share(
    energy: f64,
    detour_m: f64,
    least_energy: f64,
    limits: &EdgeLimits,
) -> f64 {
    let own = rank_weight(energy, least_energy);
    if own <= 0.0 {
        return 0.0;
    }
    let other = rank_weight(HIDDEN_ENERGY * energy, limits.two_edge_floor);
    let longest_m = limits.two_edge_detour_m.unwrap_or(f64::INFINITY);
    (other / own).min(1.0) * list_share(detour_m, longest_m)
}

/// The point of an edge over which the path between two points is the shortest.
pub(super) fn nearest_point(edge: &Edge, from: DVec3, to: DVec3) -> DVec3 {
    edge.at(edge.apex_m(from, to).clamp(0.0, edge.length_m))
}

/// Detour in metres over an edge, or its end, between two local positions.
fn detour_m(scene: &Scene, edge: u32, [from, to]: [DVec3; 2]) -> f64 {
    let edge = scene.edge(edge);
    let at = nearest_point(&edge, from, to);
    from.distance(at) + at.distance(to) - from.distance(to)
}

/// That of a path over one edge with reflections, between two local positions.
pub(super) fn reflected_share(
    scene: &Scene,
    edge: u32,
    ends: [DVec3; 2],
    limits: &EdgeLimits,
) -> f64 {
    match limits.near_detours_m {
        Some([near_m, _]) if near_m < f64::INFINITY => {
            list_share(detour_m(scene, edge, ends), near_m)
        }
        _ => 1.0,
    }
}

/// That of a path over two edges.
pub(super) fn two_edge_share(
    scene: &Scene,
    [a, b]: [u32; 2],
    ends: [DVec3; 2],
    limits: &EdgeLimits,
) -> f64 {
    let Some([near_m, paired_m]) = limits.near_detours_m else {
        return 1.0;
    };
    if paired_m == f64::INFINITY {
        return 1.0;
    }
    let detours_m = [a, b].map(|edge| detour_m(scene, edge, ends));
    match scene.edge_neighbours(a).any(|edge| edge == b) {
        true => list_share(detours_m[0].min(detours_m[1]), near_m),
        false => list_share(detours_m[0].max(detours_m[1]), paired_m),
    }
}
