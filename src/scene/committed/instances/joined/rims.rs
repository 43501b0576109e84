//! Free boundaries and finite panels of a joined part where other parts continue them.

use glam::{DVec3, Vec3};

use super::Neighbours;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::committed::instances::Instances;
use crate::scene::committed::instances::joint::JoinedRims;
use crate::scene::committed::instances::numbering::FIXED;
use crate::scene::committed::instances::placed::PlacedInstance;
use crate::scene::edges::FreeBoundary;
use crate::scene::surface::finite_panel::is_free;
use crate::scene::surface::{Surface, is_parallel};

/// Distance in metres from another part's bounds within which it may continue a surface.
pub(super) const REACH_M: f64 = 0.05;

/// Distance in metres from a boundary at which a surface is on one side of it only.
const ASIDE_M: f64 = 0.01;

/// Renews what lies in the bounds of another part that has come or gone.
pub(super) fn renew(
    rims: &mut JoinedRims,
    instances: &Instances,
    placed: &PlacedInstance,
    other: &PlacedInstance,
    neighbours: &Neighbours,
) {
    let (low, high) = placed.local_box(&other.bounds, REACH_M);
    let edges = placed.part.edges();
    let is_near = |boundary: &FreeBoundary| {
        let ends = [0.0, boundary.length_m].map(|m| boundary.origin + m * boundary.direction);
        let [a, b] = ends;
        a.min(b).cmple(high).all() && a.max(b).cmpge(low).all()
    };
    let of_edge = |edge: &u32| edges.border().boundaries_of(*edge as usize - edges.len());
    let of_pieces = || placed.raised_edges().iter().flat_map(of_edge);
    let before = rims.boundaries.iter().flat_map(|entry| entry.1.iter());
    let near = before.filter(|b| is_near(b)).map(|b| b.surface);
    let all = edges.all_boundaries().iter().chain(of_pieces());
    let near = near.chain(all.filter(|b| is_near(b)).map(|b| b.surface));
    let mut surfaces: Vec<u32> = near.collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    for surface in surfaces {
        let committed = edges.boundaries_of(surface).iter();
        let own = committed.chain(of_pieces().filter(|b| b.surface == surface));
        let mut rest = Vec::new();
        for boundary in own {
            let across = across_of(placed, boundary);
            boundary.add_rest(&mut rest, |point, side| {
                let sign = [1.0, -1.0][side];
                let up = sign * placed.part.surfaces()[surface as usize].normal;
                is_still_free(instances, placed, neighbours, (point, across, up))
            });
        }
        let index = rims.boundaries.partition_point(|entry| entry.0 < surface);
        match rims.boundaries.get_mut(index) {
            Some(entry) if entry.0 == surface => entry.1 = rest,
            _ => rims.boundaries.insert(index, (surface, rest)),
        }
    }
    for (panel, surface) in placed.part.finite_panels().in_box(low, high) {
        let is_continued = placed
            .part
            .finite_panels()
            .is_continued(panel, |at, along| {
                goes_on(instances, placed, neighbours, surface, at, along)
            });
        match (rims.continued.binary_search(&panel), is_continued) {
            (Err(index), true) => rims.continued.insert(index, panel),
            (Ok(index), false) => _ = rims.continued.remove(index),
            _ => (),
        }
    }
}

/// Unit vector in a surface's plane from its boundary away from it.
fn across_of(placed: &PlacedInstance, boundary: &FreeBoundary) -> DVec3 {
    let surface = &placed.part.surfaces()[boundary.surface as usize];
    let across = surface.normal.cross(boundary.direction);
    let middle = boundary.origin + 0.5 * boundary.length_m * boundary.direction;
    let is_inside = placed.mirrors_at(boundary.surface, middle + ASIDE_M * across);
    if is_inside { -across } else { across }
}

/// Whether no neighbour continues a surface at a point of its boundary; all in the part's coordinates.
fn is_still_free(
    instances: &Instances,
    placed: &PlacedInstance,
    neighbours: &Neighbours,
    (point, across, up): (DVec3, DVec3, DVec3),
) -> bool {
    let at = placed.to_scene(point.as_vec3());
    let mut near = neighbours.at(at, REACH_M);
    let [across, up] = [across, up].map(|vector| placed.direction(vector.as_vec3()));
    near.all(|slot| {
        instances.at(slot).is_none_or(|other| {
            let [across, up] = [across, up].map(|vector| other.local_direction(vector));
            is_free(other.part.bvh(), other.point(at).as_vec3(), across, up)
        })
    })
}

/// Whether a neighbour has the same common surface beside a point of a panel's boundary; point and direction of the boundary
/// in the part's coordinates.
fn goes_on(
    instances: &Instances,
    placed: &PlacedInstance,
    neighbours: &Neighbours,
    surface: u32,
    at: Vec3,
    along: Vec3,
) -> bool {
    let number = placed.surface_number(surface);
    let normal = placed.part.surfaces()[surface as usize].normal;
    let across = normal.cross(along.as_dvec3()).normalize_or_zero();
    let beside = [across, -across].map(|aside| {
        let beside = (at.as_dvec3() + ASIDE_M * aside).as_vec3();
        placed.to_scene(beside)
    });
    let up = placed.direction(normal.as_vec3());
    let slots: Vec<usize> = neighbours.at(placed.to_scene(at), REACH_M).collect();
    slots.into_iter().any(|slot| {
        let Some(other) = instances.at(slot) else {
            return false;
        };
        let is_with_fixed = slot == FIXED || placed.pose.id.slot() == FIXED;
        beside.into_iter().any(|beside| match is_with_fixed {
            true => {
                let own = &placed.surfaces[surface as usize];
                has_panel_at(other, own, beside, up)
            }
            false => instances
                .member(number, slot)
                .is_some_and(|member| other.mirrors_at(member.local, other.point(beside))),
        })
    })
}

/// Whether a part has a panel in the plane and of the material of another one's surface at a point, in the scene's coordinates.
fn has_panel_at(part: &PlacedInstance, surface: &Surface, at: DVec3, up: Vec3) -> bool {
    let found = triangle_in_plane(part, surface, at, up);
    found.is_some_and(|triangle| part.is_panel(triangle))
}

/// A part's triangle in the plane and of the material of another one's surface at a point, in the scene's coordinates.
pub(super) fn triangle_in_plane(
    part: &PlacedInstance,
    surface: &Surface,
    at: DVec3,
    up: Vec3,
) -> Option<u32> {
    let [above, below] = [1.0, -1.0].map(|side| (at + side * ASIDE_M * up.as_dvec3()).as_vec3());
    let ray = part.ray(&Ray::between(above, below));
    let hit = part.part.bvh().closest_hit(&ray, [NO_GROUP; 2])?;
    let own = &part.surfaces[hit.group as usize];
    (own.material == surface.material && is_parallel(own.normal, surface.normal))
        .then_some(hit.triangle)
}
