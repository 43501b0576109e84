//! Pairs of edges with a line of sight, for second-order diffraction.

use glam::DVec3;

use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Bvh, Ray};
use crate::scene::edges::edge::Edge;
use crate::scene::edges::search_budget::SearchBudget;
use crate::scene::edges::tree::EdgeTree;

/// Most neighbours of one edge.
pub const MOST_NEIGHBOURS: usize = 12;

/// Largest distance in metres of two edges of a second-order path: beyond it the path is inaudible.
pub const REACH_M: f64 = 6.0;

/// Distance in metres of the ends of sight lines from the edge, along the middle of the exterior wedge.
const CLEARANCE_M: f64 = 1e-3;

/// Candidates of one edge that are tested, nearest first.
const MOST_TESTED: usize = 32;

/// Neighbour lists of all edges, end to end.
#[derive(Debug, Clone, Default)]
pub(crate) struct EdgeVisibilityGraph {
    first: Vec<u32>,
    list: Vec<u32>,
}

impl EdgeVisibilityGraph {
    pub(crate) fn build(edges: &[Edge], tree: &EdgeTree, bvh: &Bvh) -> Self {
        let mut result = Self {
            first: vec![0],
            list: Vec::new(),
        };
        let budget = SearchBudget::new(edges.len(), bvh.crossed_boxes());
        let mut near: Vec<(f64, u32)> = Vec::new();
        for (index, edge) in edges.iter().enumerate() {
            near.clear();
            let (a, b) = (edge.at(0.0), edge.at(edge.length_m));
            let (low, high) = (a.min(b), a.max(b));
            let mut compared = 0;
            let gap_m =
                |min: DVec3, max: DVec3| (min - high).max(low - max).max(DVec3::ZERO).length();
            tree.walk_nearest(gap_m, |gap_m, leaf| {
                let bound_m = match near.get(MOST_TESTED - 1) {
                    Some((farthest_m, _)) => *farthest_m,
                    None => REACH_M,
                };
                if compared >= budget.compared || gap_m - tree.slack_m() > bound_m {
                    return false;
                }
                for &other in leaf.iter().filter(|&&o| o as usize != index) {
                    compared += 1;
                    let (s, t) = edge.closest(&edges[other as usize]);
                    let apart_m = edge.at(s).distance(edges[other as usize].at(t));
                    let rank =
                        |&(m, o): &(f64, u32)| m.total_cmp(&apart_m).then(o.cmp(&other)).is_lt();
                    let rank_index = near.partition_point(rank);
                    if rank_index < MOST_TESTED
                        && apart_m < REACH_M
                        && outside(edge, &edges[other as usize])
                    {
                        near.truncate(MOST_TESTED - 1);
                        near.insert(rank_index, (apart_m, other));
                    }
                }
                true
            });
            let seen = near
                .iter()
                .take(budget.tested)
                .filter(|(_, other)| is_unoccluded(edge, &edges[*other as usize], bvh))
                .take(MOST_NEIGHBOURS);
            result.list.extend(seen.map(|(_, other)| *other));
            result.first.push(result.list.len() as u32);
        }
        result
    }

    pub(crate) fn of(&self, index: u32) -> &[u32] {
        let [first, end] = [0, 1].map(|k| self.first[index as usize + k] as usize);
        &self.list[first..end]
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.first.as_slice()) + size_of_val(self.list.as_slice())
    }
}

/// Whether part of each edge lies in the exterior wedge of the other.
fn outside(a: &Edge, b: &Edge) -> bool {
    let touches = |e: &Edge, o: &Edge| {
        [0.1, 0.5, 0.9]
            .iter()
            .any(|share| e.angle_of(o.at(share * o.length_m)).is_some())
    };
    touches(a, b) && touches(b, a)
}

/// Whether any of four sight lines between two edges is unoccluded.
fn is_unoccluded(a: &Edge, b: &Edge, bvh: &Bvh) -> bool {
    let (s, t) = a.closest(b);
    let same_direction = a.direction.dot(b.direction) >= 0.0;
    let across = |share: f64| {
        let other = if same_direction { share } else { 1.0 - share };
        (share * a.length_m, other * b.length_m)
    };
    let shared = a.faces.into_iter().find(|face| b.faces.contains(face));
    [(s, t), across(0.5), across(0.1), across(0.9)]
        .into_iter()
        .any(|(s, t)| {
            let clear = |e: &Edge, along: f64| -> DVec3 { e.at(along) + CLEARANCE_M * e.outward() };
            let sight = Ray::between(clear(a, s).as_vec3(), clear(b, t).as_vec3());
            !bvh.any_hit(&sight, [shared.unwrap_or(NO_GROUP), NO_GROUP])
        })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use glam::Vec3;

    use super::*;
    use crate::geometry::bvh::RayObserver;
    use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh, procedural};

    /// Loose triangles in a box of a given size.
    fn heap(count: u32, size: Vec3) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        let material = mesh.material("concrete");
        let random = |n: u32| (n.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        for n in 0..3 * count {
            let at = Vec3::new(random(3 * n), random(3 * n + 1), random(3 * n + 2));
            mesh.vertices.push(size * at);
        }
        for n in 0..count {
            mesh.triangles.push([3 * n, 3 * n + 1, 3 * n + 2]);
            mesh.triangle_materials.push(material);
        }
        mesh
    }

    #[test]
    fn neighbours_equal_an_exhaustive_search() {
        let doorway = procedural::by_name("doorway").expect("a scene").mesh;
        for mesh in [doorway, heap(120, Vec3::splat(8.0))] {
            let table = MaterialTable::built_in();
            let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits");
            let edges = scene.edges().as_slice();
            assert!(edges.len() > 40 && edges.len() < 4096);
            for (index, edge) in edges.iter().enumerate() {
                let mut near: Vec<(f64, u32)> = Vec::new();
                for (other, candidate) in edges.iter().enumerate() {
                    let (s, t) = edge.closest(candidate);
                    let apart_m = edge.at(s).distance(candidate.at(t));
                    if other != index && apart_m < REACH_M && outside(edge, candidate) {
                        near.push((apart_m, other as u32));
                    }
                }
                near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                let seen = near
                    .iter()
                    .take(MOST_TESTED)
                    .map(|(_, other)| *other)
                    .filter(|&other| is_unoccluded(edge, &edges[other as usize], scene.bvh()));
                let expected: Vec<u32> = seen.take(MOST_NEIGHBOURS).collect();
                assert_eq!(scene.edges().neighbours(index as u32), expected);
            }
        }
    }

    #[derive(Debug, Default)]
    struct RayCount(AtomicUsize);

    impl RayObserver for RayCount {
        fn on_ray(&self, _: &Ray, _: [u32; 2], _: bool) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn sight_lines_through_heaps_of_triangles_are_bounded() {
        let flat = Vec3::new(50.0, 0.0, 50.0);
        for (count, size) in [
            (1000, flat),
            (5000, flat),
            (20_000, flat),
            (10_000, Vec3::splat(50.0)),
        ] {
            let mesh = heap(count, size);
            let vertices = &mesh.vertices;
            let groups: Vec<u32> = (0..count).collect();
            let rays = Arc::new(RayCount::default());
            let bvh = Bvh::build(vertices, &mesh.triangles, &groups).with_observer(rays.clone());
            let table = MaterialTable::built_in();
            let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits");
            let edges = scene.edges().as_slice();
            EdgeVisibilityGraph::build(edges, &EdgeTree::build(edges), &bvh);
            let boxes = rays.0.load(Ordering::Relaxed) as f64 * bvh.crossed_boxes();
            // Two nanoseconds a box: half a second.
            assert!(
                boxes <= f64::from(1 << 28),
                "{boxes} boxes of {count} triangles"
            );
        }
    }
}
