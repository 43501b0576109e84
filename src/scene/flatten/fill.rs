//! Closes small holes in rough regions: triangles that a scan lacks.
//!
//! A hole is a cycle of few boundary edges, small against the region that it lies in; at a corner of a room it may lie in two. Windows and doors have many edges at the
//! scan's own resolution and stay open.

use std::collections::{BTreeMap, VecDeque};

use glam::DVec3;

use super::facets::{Facets, NONE};
use super::plane_fit::Plane;
use super::regions::Regions;

/// Most edges of a hole: four missing triangles next to each other.
const MOST_EDGES: usize = 6;

/// Largest area of a closing triangle relative to its region.
const MOST_SHARE: f64 = 0.1;

/// A closing triangle: its vertices, and a triangle of the region beside it.
pub(super) type Closing = ([u32; 3], u32);

/// Distance in metres of a moved vertex from its region's plane: rounding.
const IN_PLANE_M: f64 = 1e-4;

/// Boundary edges of regions: at each vertex the other ends, and a triangle at each edge.
type Boundary = BTreeMap<u32, Vec<(u32, u32)>>;

/// Triangles that close the holes of all regions; `positions` are those of the moved vertices.
pub(super) fn closing(
    facets: &Facets,
    triangles: &[[u32; 3]],
    positions: &[DVec3],
    regions: &Regions,
    planes: &[Plane],
) -> Vec<Closing> {
    let mut boundary = Boundary::new();
    for (triangle, corners) in (0..).zip(triangles) {
        if regions.of_triangle[triangle as usize] == NONE {
            continue;
        }
        for side in (0..3).filter(|&side| facets.is_boundary(3 * triangle + side)) {
            let side = side as usize;
            let (a, b) = (corners[side], corners[(side + 1) % 3]);
            boundary.entry(a).or_default().push((b, triangle));
            boundary.entry(b).or_default().push((a, triangle));
        }
    }
    let area_m2 = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    let mut found = Vec::new();
    let starts: Vec<u32> = boundary.keys().copied().collect();
    for start in starts {
        while let Some(cycle) = cycle_through(&boundary, start) {
            let beside = remove(&mut boundary, &cycle);
            // A triangle lies in the plane of a region beside the hole: at a corner of the room in one of two.
            let place = |corners: &[u32; 3]| {
                beside.iter().copied().find(|&triangle| {
                    let region = regions.of_triangle[triangle as usize] as usize;
                    let near = |&vertex: &u32| {
                        planes[region].distance_m(positions[vertex as usize]).abs() < IN_PLANE_M
                    };
                    let most_m2 = MOST_SHARE * regions.regions[region].moments.area_m2;
                    corners.iter().all(near) && area_m2(corners) < most_m2
                })
            };
            let fan = (0..cycle.len()).find_map(|first| {
                let turned: Vec<u32> = [&cycle[first..], &cycle[..first]].concat();
                let fan = turned[1..].windows(2).map(|p| [turned[0], p[0], p[1]]);
                fan.map(|corners| Some((corners, place(&corners)?)))
                    .collect::<Option<Vec<Closing>>>()
            });
            found.extend(fan.into_iter().flatten());
        }
    }
    found
}

/// The shortest cycle of boundary edges through a vertex, if it has few.
fn cycle_through(boundary: &Boundary, start: u32) -> Option<Vec<u32>> {
    let (first, _) = *boundary.get(&start)?.first()?;
    // The shortest way back to the start that does not use the edge to the first vertex.
    let mut before: BTreeMap<u32, (u32, usize)> = BTreeMap::from([(first, (start, 1))]);
    let mut pending = VecDeque::from([first]);
    while let Some(vertex) = pending.pop_front() {
        let (from, length) = before[&vertex];
        for &(next, _) in boundary.get(&vertex)? {
            if next == start && vertex != first {
                let mut cycle = vec![start, vertex];
                let mut at = from;
                while at != start {
                    cycle.push(at);
                    at = before[&at].0;
                }
                return Some(cycle);
            }
            if length + 1 < MOST_EDGES && next != start && !before.contains_key(&next) {
                before.insert(next, (vertex, length + 1));
                pending.push_back(next);
            }
        }
    }
    None
}

/// Removes the edges of a cycle; returns the triangles at them.
fn remove(boundary: &mut Boundary, cycle: &[u32]) -> Vec<u32> {
    let mut beside = Vec::with_capacity(2 * cycle.len());
    for (index, &a) in cycle.iter().enumerate() {
        let b = cycle[(index + 1) % cycle.len()];
        for (from, to) in [(a, b), (b, a)] {
            let Some(edges) = boundary.get_mut(&from) else {
                continue;
            };
            if let Some(found) = edges.iter().position(|(other, _)| *other == to) {
                beside.push(edges.remove(found).1);
            }
        }
    }
    beside
}
