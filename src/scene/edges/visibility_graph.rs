//! Pairs of edges with a line of sight, for second-order diffraction. The relation is symmetric.

use glam::DVec3;

use crate::binary::{are_below, are_starts, stored};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Bvh, Ray};
use crate::scene::edges::edge::Edge;
use crate::scene::edges::search_budget::SearchBudget;
use crate::scene::edges::tree::EdgeTree;

/// Neighbours that one edge chooses; those at the same distance as the last one count as well.
pub const MOST_NEIGHBOURS: usize = 12;

/// Most neighbours of one edge, with the edges that have chosen it.
pub const MOST_LISTED: usize = 32;

/// Distances that differ by less are equal, in metres.
const SAME_M: f64 = 1e-5;

/// Largest distance in metres, times [`Edge::length_scale`], of two edges of a second-order path: beyond it the path is
/// inaudible.
pub const REACH_M: f64 = 6.0;

/// The same of two edges of one face: the wave along the face spreads in two dimensions only. Paths fade from three quarters
/// of it on.
pub const FACE_REACH_M: f64 = 60.0;

/// Most neighbours of one edge beyond [`REACH_M`].
const MOST_FAR_NEIGHBOURS: usize = 6;

/// Distance in metres of the ends of sight lines from the edge, along the middle of the exterior wedge.
const CLEARANCE_M: f64 = 1e-3;

/// Candidates of one edge that are tested, nearest first.
const MOST_TESTED: usize = 32;

/// Candidates that may be as near as the last tested one and are tested as well.
const MOST_EQUAL: usize = 16;

/// Edges of one face compared with one edge, and with all edges together.
const MOST_COMPARED_IN_FACE: usize = 1024;
const MOST_COMPARED_IN_FACES: usize = 1 << 23;

/// Neighbour lists of all edges, end to end.
#[derive(Debug, Clone, Default)]
pub(crate) struct EdgeVisibilityGraph {
    first: Vec<u32>,
    list: Vec<u32>,
}

impl EdgeVisibilityGraph {
    pub(crate) fn build(edges: &[Edge], tree: &EdgeTree, bvh: &Bvh, length_scale: f64) -> Self {
        let reach_m = REACH_M * length_scale;
        let budget = SearchBudget::new(edges.len(), bvh.crossed_boxes());
        let mut pairs: Vec<(u32, f64, u32)> = Vec::new();
        let by_face = EdgesByFace::build(edges);
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
                    Some((farthest_m, _)) => *farthest_m + SAME_M,
                    None => reach_m,
                };
                if compared >= budget.compared || gap_m - tree.slack_m() > bound_m {
                    return false;
                }
                for &other in leaf.iter().filter(|&&o| o as usize != index) {
                    compared += 1;
                    let candidate = &edges[other as usize];
                    let apart_m = edge.distance_m(candidate);
                    if apart_m < reach_m {
                        insert(&mut near, (apart_m, other), || outside(edge, candidate));
                    }
                }
                true
            });
            let mut choose = |near: &[(f64, u32)], most: usize| {
                let seen = with_equals(near.iter(), MOST_TESTED)
                    .take(budget.tested)
                    .filter(|(_, other)| is_unoccluded(edge, &edges[*other as usize], bvh));
                for &(apart_m, other) in with_equals(seen, most) {
                    pairs.push((index as u32, apart_m, other));
                    pairs.push((other, apart_m, index as u32));
                }
            };
            choose(&near, MOST_NEIGHBOURS);
            if budget.tested == 0 {
                continue;
            }
            by_face.far(edges, index as u32, &mut near);
            choose(&near, MOST_FAR_NEIGHBOURS);
        }
        Self::of_pairs(pairs, edges.len())
    }

    /// The lists of chosen pairs, each given in both orders, nearest first.
    fn of_pairs(pairs: Vec<(u32, f64, u32)>, edges: usize) -> Self {
        // Counted by edge, since the order of an edge's pairs decides which of two equal ones counts.
        let mut next = vec![0usize; edges + 1];
        for pair in &pairs {
            next[pair.0 as usize + 1] += 1;
        }
        for edge in 0..edges {
            next[edge + 1] += next[edge];
        }
        let mut by_edge = vec![(0.0, 0); pairs.len()];
        for (edge, apart_m, other) in pairs {
            let slot = &mut next[edge as usize];
            by_edge[*slot] = (apart_m, other);
            *slot += 1;
        }
        let mut result = Self {
            first: vec![0; edges + 1],
            list: Vec::with_capacity(by_edge.len()),
        };
        let (mut from, mut own) = (0, Vec::new());
        for edge in 0..edges {
            own.clear();
            own.extend_from_slice(&by_edge[from..next[edge]]);
            own.sort_by_key(|&(_, other): &(f64, u32)| other);
            own.dedup_by_key(|&mut (_, other)| other);
            own.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let others = own.iter().take(MOST_LISTED).map(|pair| pair.1);
            result.list.extend(others);
            result.first[edge + 1] = result.list.len() as u32;
            from = next[edge];
        }
        result.list.shrink_to_fit();
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

/// Inserts an edge into the [`MOST_TESTED`] and [`MOST_EQUAL`] nearest ones unless it is there or does not count.
fn insert(nearest: &mut Vec<(f64, u32)>, new: (f64, u32), counts: impl Fn() -> bool) {
    let rank = |other: &(f64, u32)| other.0.total_cmp(&new.0).then(other.1.cmp(&new.1));
    let rank_index = nearest.partition_point(|other| rank(other).is_lt());
    if rank_index == MOST_TESTED + MOST_EQUAL || nearest.get(rank_index) == Some(&new) || !counts()
    {
        return;
    }
    nearest.truncate(MOST_TESTED + MOST_EQUAL - 1);
    nearest.insert(rank_index, new);
}

/// The first `most` of edges by distance, and those as near as the last of them: which of equals come first is arbitrary.
fn with_equals<'a>(
    near: impl Iterator<Item = &'a (f64, u32)>,
    most: usize,
) -> impl Iterator<Item = &'a (f64, u32)> {
    let (mut count, mut last_m) = (0, 0.0);
    near.take_while(move |(apart_m, _)| {
        count += 1;
        if count <= most {
            last_m = *apart_m;
        }
        count <= most || apart_m - last_m < SAME_M
    })
}

/// Edges by face, for pairs across a wide one.
struct EdgesByFace {
    /// Face and edge, sorted.
    list: Vec<(u32, u32)>,
    /// Edges of a face that are compared with one edge.
    compared: usize,
}

impl EdgesByFace {
    fn build(edges: &[Edge]) -> Self {
        let both = |(index, edge): (u32, &Edge)| edge.faces.map(|face| (face, index));
        let mut list: Vec<(u32, u32)> = (0..).zip(edges).flat_map(both).collect();
        list.sort_unstable();
        list.dedup();
        let share = MOST_COMPARED_IN_FACES / list.len().max(1);
        Self {
            list,
            compared: share.min(MOST_COMPARED_IN_FACE),
        }
    }

    /// Sets `far` to the edges between [`REACH_M`] and [`FACE_REACH_M`] from one that share a face with it, nearest first,
    /// [`MOST_TESTED`] and [`MOST_EQUAL`] at most.
    fn far(&self, edges: &[Edge], index: u32, far: &mut Vec<(f64, u32)>) {
        far.clear();
        let edge = &edges[index as usize];
        let reach_m = [REACH_M, FACE_REACH_M].map(|m| m * edge.length_scale);
        for (number, face) in edge.faces.into_iter().enumerate() {
            if number == 1 && face == edge.faces[0] {
                continue;
            }
            let first = self.list.partition_point(|entry| entry.0 < face);
            let own = self.list[first..]
                .iter()
                .take_while(|entry| entry.0 == face);
            for &(_, other) in own.take(self.compared) {
                let candidate = &edges[other as usize];
                let apart_m = edge.distance_m(candidate);
                if (reach_m[0]..reach_m[1]).contains(&apart_m) {
                    insert(far, (apart_m, other), || outside(edge, candidate));
                }
            }
        }
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

/// Whether any of six sight lines between two edges is unoccluded: the shortest one, and those between the middles and the
/// ends.
fn is_unoccluded(a: &Edge, b: &Edge, bvh: &Bvh) -> bool {
    let (s, t) = a.closest(b);
    let at = |of_a: f64, of_b: f64| (of_a * a.length_m, of_b * b.length_m);
    let ends = [(0.1, 0.1), (0.9, 0.9), (0.1, 0.9), (0.9, 0.1)].map(|(p, q)| at(p, q));
    let shared = a.faces.into_iter().find(|face| b.faces.contains(face));
    [(s, t), at(0.5, 0.5)]
        .into_iter()
        .chain(ends)
        .any(|(s, t)| {
            let clear = |e: &Edge, along: f64| -> DVec3 { e.at(along) + CLEARANCE_M * e.outward() };
            let sight = Ray::between(clear(a, s).as_vec3(), clear(b, t).as_vec3());
            !bvh.any_hit(&sight, [shared.unwrap_or(NO_GROUP), NO_GROUP])
        })
}

stored!(EdgeVisibilityGraph { first: Vec<u32>, list: Vec<u32> });

impl EdgeVisibilityGraph {
    /// Whether a graph that was loaded belongs to so many edges.
    pub(super) fn is_consistent(&self, edges: usize) -> bool {
        are_starts(&self.first, edges, self.list.len()) && are_below(&self.list, edges)
    }
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
            // The nearest in a range of distances that are visible.
            let chosen = |index: usize, reach_m: std::ops::Range<f64>, most: usize| {
                let edge = &edges[index];
                let mut near: Vec<(f64, u32)> = Vec::new();
                for (other, candidate) in edges.iter().enumerate() {
                    let apart_m = edge.distance_m(candidate);
                    let shares = candidate.faces.iter().any(|face| edge.faces.contains(face));
                    let counts = reach_m.contains(&apart_m) && (shares || apart_m < REACH_M);
                    if other != index && counts && outside(edge, candidate) {
                        near.push((apart_m, other as u32));
                    }
                }
                near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                let last_m = near
                    .get(MOST_TESTED - 1)
                    .map_or(f64::INFINITY, |last| last.0);
                near.retain(|(apart_m, _)| *apart_m < last_m + SAME_M);
                near.truncate(MOST_TESTED + MOST_EQUAL);
                near.retain(|(_, other)| is_unoccluded(edge, &edges[*other as usize], scene.bvh()));
                let last_m = near.get(most - 1).map_or(f64::INFINITY, |last| last.0);
                near.retain(|(apart_m, _)| *apart_m < last_m + SAME_M);
                near
            };
            let all: Vec<Vec<(f64, u32)>> = (0..edges.len())
                .map(|index| {
                    let mut own = chosen(index, 0.0..REACH_M, MOST_NEIGHBOURS);
                    own.extend(chosen(index, REACH_M..FACE_REACH_M, MOST_FAR_NEIGHBOURS));
                    own
                })
                .collect();
            for (index, own) in all.iter().enumerate() {
                let has_chosen = |(other, list): (usize, &Vec<(f64, u32)>)| {
                    let pair = list.iter().find(|pair| pair.1 == index as u32)?;
                    Some((pair.0, other as u32))
                };
                let mut expected = own.clone();
                let others = all.iter().enumerate().filter_map(has_chosen);
                expected.extend(others.filter(|(_, other)| own.iter().all(|o| o.1 != *other)));
                let mut neighbours = scene.edges().neighbours(index as u32).to_vec();
                neighbours.sort_unstable();
                let mut names: Vec<u32> = expected.iter().map(|pair| pair.1).collect();
                names.sort_unstable();
                match names.len() <= MOST_LISTED {
                    true => assert_eq!(neighbours, names),
                    false => assert!(neighbours.iter().all(|other| names.contains(other))),
                }
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
            EdgeVisibilityGraph::build(edges, &EdgeTree::build(edges), &bvh, 1.0);
            let boxes = rays.0.load(Ordering::Relaxed) as f64 * bvh.crossed_boxes();
            // Two nanoseconds a box: half a second.
            assert!(
                boxes <= f64::from(1 << 28),
                "{boxes} boxes of {count} triangles"
            );
        }
    }
}
