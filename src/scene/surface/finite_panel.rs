//! Finite panels: connected planar panels with free edges, their size, and the distance of a point from their edges.
//!
//! Examples are a reflector under a ceiling, a board, and a facet of a column: the reflection is specular above a frequency
//! that depends on the size, and fades at the edges. The wall of a room is continued by its neighbours on the reflecting
//! side and is not a finite panel.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::super::weld::sorted_edges;
use super::{SurfaceSet, panel};
use crate::binary::{are_starts, stored};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Bvh, Ray};

/// Search distance in metres for a continuation of the panel at an edge: the largest gap between a wall and its neighbour.
const REACH_M: f32 = 0.02;

/// Largest distance in metres by which a surface passes through its continuation.
const OVERLAP_M: f32 = 0.05;

/// Largest slope of a continuation behind the plane of the panel: 17 degrees, less than between facets of a column.
const FALL: f32 = 0.3;

/// Sample positions along an edge, relative to its length.
const SAMPLES: [f32; 3] = [0.2, 0.5, 0.8];

/// Most rays that test whether a segment of a boundary is free: two a sample and side.
const RAYS_A_SEGMENT: usize = 4 * SAMPLES.len();

/// Boxes that all these rays intersect, by estimate, beyond which no panel counts as free. The benchmark scenes have a
/// quarter of it at most.
const MOST_BOXES: f64 = (1u64 << 28) as f64;

/// Least free share of a panel's boundary on the free side of a finite panel.
const FREE_SHARE: f64 = 0.5;

/// Tolerance outside of the panel in metres; see [`super::INSIDE_TOLERANCE_M`].
const MARGIN_M: f64 = 1e-4;

/// A segment of the boundary: its ends, and whether it is free on the normal's side and on the other.
#[derive(Debug, Clone, Copy)]
struct BoundarySegment {
    ends: [Vec3; 2],
    free: [bool; 2],
}

/// The inner half-plane of one side of a triangle.
#[derive(Debug, Clone, Copy)]
struct HalfPlane {
    from: DVec3,
    /// Across the side into the triangle, as long as the side.
    inward: DVec3,
    /// Lower bound of a point's component along it.
    least: f64,
}

/// One connected panel of a surface.
#[derive(Debug, Clone)]
struct Panel {
    surface: u32,
    area_m2: f64,
    triangles: Vec<[HalfPlane; 3]>,
    boundary: Vec<BoundarySegment>,
    free: [bool; 2],
    sides: [Vec3; 2],
    /// Bounds, with a margin for the surface's unevenness.
    low: DVec3,
    high: DVec3,
}

/// A finite panel at one of its points and on one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinitePanel {
    /// Area in m².
    pub area_m2: f64,
    /// The two sides of the equivalent rectangle in metres: of the same area, along the longest boundary segment.
    pub sides: [Vec3; 2],
    /// Distance in metres to the nearest free edge.
    pub to_edge_m: f64,
}

/// All finite panels, by surface.
#[derive(Debug, Clone, Default)]
pub struct FinitePanels {
    pieces: Vec<Panel>,
    /// Start of each surface's pieces, and the end of the list.
    first: Vec<u32>,
}

impl FinitePanels {
    /// Panels up to `largest_m2` of a mesh in local coordinates and its tree.
    pub(crate) fn build(
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        set: &SurfaceSet,
        bvh: &Bvh,
        largest_m2: f64,
    ) -> Self {
        let edges = sorted_edges(triangles);
        let roots = panel::roots(&edges, &set.triangle_surface);
        let mut members: Vec<u32> = (0..triangles.len() as u32)
            .filter(|&t| set.is_panel(t))
            .collect();
        members.sort_unstable_by_key(|&t| (set.triangle_surface[t as usize], roots[t as usize], t));
        // Small pieces: their area, and their triangles in `members`.
        let mut small: Vec<(f64, Range<usize>)> = Vec::new();
        let mut piece_index = vec![u32::MAX; triangles.len()];
        let corners = |t: u32| triangles[t as usize].map(|v| vertices[v as usize]);
        let mut first = 0;
        for same in members.chunk_by(|&a, &b| roots[a as usize] == roots[b as usize]) {
            let range = first..first + same.len();
            first = range.end;
            let area_m2 = same.iter().map(|&t| area_m2(corners(t))).sum();
            if area_m2 > largest_m2 {
                continue;
            }
            for &t in same {
                piece_index[t as usize] = small.len() as u32;
            }
            small.push((area_m2, range));
        }
        drop(roots);
        let boundary = |visit: &mut dyn FnMut(u32, u32)| {
            visit_boundary(&edges, &set.triangle_surface, &piece_index, visit);
        };
        let mut count = 0;
        boundary(&mut |_, _| count += 1);
        if (count * RAYS_A_SEGMENT) as f64 * bvh.crossed_boxes() > MOST_BOXES {
            // None is free.
            return Self {
                pieces: Vec::new(),
                first: vec![0; set.surfaces.len() + 1],
            };
        }
        let piece = |(area_m2, range): (f64, Range<usize>)| {
            let same = &members[range];
            let surface = set.triangle_surface[same[0] as usize];
            let normal = set.surfaces[surface as usize].normal;
            let all = same.iter().flat_map(|&t| corners(t)).map(Vec3::as_dvec3);
            let bound = |of: fn(DVec3, DVec3) -> DVec3| all.clone().reduce(of).unwrap_or_default();
            Panel {
                surface,
                area_m2,
                triangles: same
                    .iter()
                    .map(|&t| half_planes(corners(t), normal))
                    .collect(),
                boundary: Vec::new(),
                free: [false; 2],
                sides: [Vec3::ZERO; 2],
                low: bound(DVec3::min) - f64::from(REACH_M),
                high: bound(DVec3::max) + f64::from(REACH_M),
            }
        };
        let mut pieces: Vec<Panel> = small.into_iter().map(piece).collect();
        // The piece, its segment and the corner opposite of it, for each segment of a boundary.
        let mut segments: Vec<(u32, usize, Vec3)> = Vec::with_capacity(count);
        boundary(&mut |index, edge| {
            let piece = &mut pieces[index as usize];
            let (corners, side) = (corners(edge / 3), edge as usize % 3);
            segments.push((index, piece.boundary.len(), corners[(side + 2) % 3]));
            piece.boundary.push(BoundarySegment {
                ends: [corners[side], corners[(side + 1) % 3]],
                free: [false; 2],
            });
        });
        for (index, segment, inner) in segments {
            let piece = &mut pieces[index as usize];
            let normal = set.surfaces[piece.surface as usize].normal.as_vec3();
            let segment = &mut piece.boundary[segment];
            segment.free = free_sides(bvh, segment.ends, inner, normal);
        }
        for piece in &mut pieces {
            piece.sides = sides(piece, set.surfaces[piece.surface as usize].normal.as_vec3());
            let length_m =
                |segment: &&BoundarySegment| f64::from(segment.ends[0].distance(segment.ends[1]));
            let whole_m: f64 = piece.boundary.iter().map(|b| length_m(&b)).sum();
            piece.free = [0, 1].map(|side| {
                let free = piece.boundary.iter().filter(|b| b.free[side]);
                free.map(|b| length_m(&b)).sum::<f64>() > FREE_SHARE * whole_m
            });
        }
        pieces.retain(|piece| piece.free != [false; 2]);
        let mut first = vec![0; set.surfaces.len() + 1];
        for piece in &pieces {
            first[piece.surface as usize + 1] += 1;
        }
        for surface in 0..set.surfaces.len() {
            first[surface + 1] += first[surface];
        }
        Self { pieces, first }
    }

    /// The finite panel at a point of a surface, on the normal's side or on the other.
    pub fn at(&self, surface: u32, point: DVec3, in_front: bool) -> Option<FinitePanel> {
        self.at_without(surface, point, in_front, &[])
    }

    /// The same without some of the panels, which are sorted.
    pub(in crate::scene) fn at_without(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
        without: &[u32],
    ) -> Option<FinitePanel> {
        let range =
            self.first[surface as usize] as usize..self.first[surface as usize + 1] as usize;
        let side = usize::from(!in_front);
        let first = range.start as u32;
        let (_, piece) = (first..).zip(&self.pieces[range]).find(|(index, piece)| {
            piece.free[side]
                && without.binary_search(index).is_err()
                && point.cmpge(piece.low).all()
                && point.cmple(piece.high).all()
                && piece.triangles.iter().any(|sides| contains(sides, point))
        })?;
        let free = piece.boundary.iter().filter(|segment| segment.free[side]);
        Some(FinitePanel {
            area_m2: piece.area_m2,
            sides: piece.sides,
            to_edge_m: free
                .map(|segment| distance_m(segment.ends.map(Vec3::as_dvec3), point))
                .fold(f64::INFINITY, f64::min),
        })
    }

    /// The panels in a box, each with its surface.
    pub(in crate::scene) fn in_box(
        &self,
        low: DVec3,
        high: DVec3,
    ) -> impl Iterator<Item = (u32, u32)> + '_ {
        let is_in = move |piece: &Panel| piece.low.cmple(high).all() && piece.high.cmpge(low).all();
        let pieces = (0..).zip(&self.pieces);
        pieces.filter_map(move |(index, piece)| is_in(piece).then_some((index, piece.surface)))
    }

    /// Whether `continues`, which is asked with points of a panel's boundary, holds anywhere there.
    pub(in crate::scene) fn is_continued(
        &self,
        panel: u32,
        mut continues: impl FnMut(Vec3, Vec3) -> bool,
    ) -> bool {
        let boundary = &self.pieces[panel as usize].boundary;
        boundary.iter().any(|segment| {
            let along = segment.ends[1] - segment.ends[0];
            let mut samples = SAMPLES.iter();
            segment.free != [false; 2]
                && samples.any(|share| continues(segment.ends[0] + along * *share, along))
        })
    }

    /// Number of panels.
    pub fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }
}

/// Calls `visit` with each piece and the sides of its triangles (`3 t + e`) that no other triangle of its surface meets.
fn visit_boundary(
    sides: &[(u64, u32)],
    triangle_surface: &[u32],
    piece_index: &[u32],
    visit: &mut dyn FnMut(u32, u32),
) {
    let surface = |side: u32| triangle_surface[(side / 3) as usize];
    let mut meeting: Vec<u32> = Vec::new();
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        // Sorted, because thousands of triangles may meet at one edge.
        meeting.clear();
        meeting.extend(same.iter().map(|(_, side)| surface(*side)));
        meeting.sort_unstable();
        for &(_, side) in same {
            let index = piece_index[(side / 3) as usize];
            let own = meeting.partition_point(|&other| other < surface(side));
            if index != u32::MAX && meeting.get(own + 1) != Some(&surface(side)) {
                visit(index, side);
            }
        }
    }
}

/// Whether an edge is free on the normal's side and on the other, at most of its samples.
fn free_sides(bvh: &Bvh, ends: [Vec3; 2], inner: Vec3, normal: Vec3) -> [bool; 2] {
    let along = ends[1] - ends[0];
    let across = normal.cross(along).normalize_or_zero();
    let outward = -across * across.dot(inner - ends[0]).signum();
    [normal, -normal].map(|up| {
        let free = SAMPLES
            .iter()
            .filter(|share| is_free(bvh, ends[0] + along * **share, outward, up));
        2 * free.count() > SAMPLES.len()
    })
}

/// Whether nothing continues a surface at a point `at` of its boundary, on the side of the unit vector `up`: no triangle
/// beyond the boundary lies in the plane or is tilted towards that side, and none rises at it. `outward` is the unit vector
/// in the plane away from the surface.
pub(in crate::scene) fn is_free(bvh: &Bvh, at: Vec3, outward: Vec3, up: Vec3) -> bool {
    let met = |from: Vec3, to: Vec3| bvh.any_hit(&Ray::between(from, to), [NO_GROUP; 2]);
    let out_m = 0.5 * REACH_M;
    let (beyond, above) = (at + outward * out_m, at + up * REACH_M);
    !met(beyond + up * REACH_M, beyond - up * (FALL * out_m))
        && !met(above - outward * OVERLAP_M, above + outward * REACH_M)
}

/// The sides of a rectangle as long and wide as a piece, but of its area.
fn sides(piece: &Panel, normal: Vec3) -> [Vec3; 2] {
    let length_m = |segment: &BoundarySegment| segment.ends[0].distance(segment.ends[1]);
    let boundary = piece.boundary.iter();
    let longest = boundary.max_by(|a, b| length_m(a).total_cmp(&length_m(b)));
    let along = longest.map_or(Vec3::ZERO, |segment| segment.ends[1] - segment.ends[0]);
    let along = along.normalize_or(normal.any_orthonormal_vector());
    let across = normal.cross(along);
    let span_m = [along, across].map(|axis| {
        let corners = piece.boundary.iter().flat_map(|segment| segment.ends);
        let (low, high) = corners.fold((f32::MAX, f32::MIN), |(low, high), at| {
            (low.min(axis.dot(at)), high.max(axis.dot(at)))
        });
        (high - low).max(1e-3)
    });
    let filled = (piece.area_m2 as f32 / (span_m[0] * span_m[1])).sqrt();
    [along * span_m[0] * filled, across * span_m[1] * filled]
}

fn area_m2([a, b, c]: [Vec3; 3]) -> f64 {
    0.5 * (b - a).as_dvec3().cross((c - a).as_dvec3()).length()
}

/// The sides of a triangle in a plane of this normal.
fn half_planes(corners: [Vec3; 3], normal: DVec3) -> [HalfPlane; 3] {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let turn = (b - a).cross(c - a).dot(normal).signum();
    [(a, b), (b, c), (c, a)].map(|(from, to)| {
        let inward = normal.cross(to - from) * turn;
        HalfPlane {
            from,
            inward,
            least: -MARGIN_M * inward.length(),
        }
    })
}

/// Whether a point of a triangle's plane lies in it.
fn contains(sides: &[HalfPlane; 3], point: DVec3) -> bool {
    let inside = |side: &HalfPlane| side.inward.dot(point - side.from) >= side.least;
    sides.iter().all(inside)
}

/// Distance of a point from a segment in metres.
fn distance_m([from, to]: [DVec3; 2], point: DVec3) -> f64 {
    let along = to - from;
    let share = (point - from).dot(along) / along.length_squared().max(1e-12);
    point.distance(from + along * share.clamp(0.0, 1.0))
}

stored!(BoundarySegment {
    ends: [Vec3; 2],
    free: [bool; 2]
});

stored!(HalfPlane {
    from: DVec3,
    inward: DVec3,
    least: f64
});

stored!(Panel {
    surface: u32,
    area_m2: f64,
    triangles: Vec<[HalfPlane; 3]>,
    boundary: Vec<BoundarySegment>,
    free: [bool; 2],
    sides: [Vec3; 2],
    low: DVec3,
    high: DVec3,
});

stored!(FinitePanels { pieces: Vec<Panel>, first: Vec<u32> });

impl FinitePanels {
    /// Whether panels that were loaded belong to a set of `surfaces`.
    pub(crate) fn is_consistent(&self, surfaces: usize) -> bool {
        are_starts(&self.first, surfaces, self.pieces.len())
            && self
                .pieces
                .iter()
                .all(|piece| (piece.surface as usize) < surfaces)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use glam::Vec3;

    use super::{FinitePanels, MOST_BOXES};
    use crate::geometry::bvh::RayObserver;
    use crate::geometry::{Bvh, Ray};
    use crate::scene::commit::commit_mesh;
    use crate::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh, procedural};

    fn commit(mesh: &TriangleMesh) -> Scene {
        Scene::commit(mesh, &MaterialTable::built_in(), &SceneSettings::default()).expect("commits")
    }

    #[test]
    fn the_walls_of_a_room_are_not_free_and_a_board_is() {
        let mut mesh = procedural::shoebox(Vec3::new(4.0, 2.5, 3.0), "concrete");
        let room = commit(&mesh);
        let centre = room.to_local(Vec3::new(2.0, 1.25, 1.5));
        for (index, wall) in room.surfaces().iter().enumerate() {
            let height_m = wall.distance_m(centre);
            let point = centre - height_m * wall.normal;
            let seen = |in_front: bool| room.finite_panel_at(index as u32, point, in_front);
            // Inside, each wall is continued at its corners; outside, the room is a box.
            assert!(seen(height_m > 0.0).is_none() && seen(height_m < 0.0).is_some());
        }
        let first = mesh.vertices.len() as u32;
        for (x, z) in [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)] {
            mesh.vertices.push(Vec3::new(x, 2.0, z));
        }
        for corners in [[0, 1, 2], [0, 2, 3]] {
            mesh.triangles.push(corners.map(|c| first + c));
            mesh.triangle_materials.push(0);
        }
        let scene = commit(&mesh);
        assert_eq!(scene.finite_panels().len(), 1 + room.finite_panels().len());
        let board = (0..scene.surfaces().len() as u32)
            .find(|&s| (scene.surface(s).area_m2 - 1.0).abs() < 1e-6)
            .expect("the board");
        let local = |x: f32| scene.to_local(Vec3::new(x, 2.0, 1.5));
        let panel = scene
            .finite_panel_at(board, local(1.2), true)
            .expect("on it");
        assert!((panel.area_m2 - 1.0).abs() < 1e-6 && (panel.to_edge_m - 0.2).abs() < 1e-5);
        let lengths = panel.sides.map(Vec3::length);
        assert!(
            lengths.iter().all(|side| (side - 1.0).abs() < 1e-5),
            "{lengths:?}"
        );
        assert!(scene.finite_panel_at(board, local(2.1), true).is_none());
    }

    /// Facets turn by 36 degrees, too much for a round column; from inside they form a room.
    #[test]
    fn the_facets_of_a_column_are_free_outside_only() {
        let mut mesh = TriangleMesh::default();
        mesh.material("concrete");
        let ring = |height: f32| {
            let angles = (0..10u8).map(|i| std::f32::consts::TAU * f32::from(i) / 10.0);
            angles.map(move |a| Vec3::new(0.5 * a.cos(), height, 0.5 * a.sin()))
        };
        mesh.vertices.extend(ring(0.0).chain(ring(6.0)));
        for i in 0..10 {
            let next = (i + 1) % 10;
            mesh.triangles.push([i, next, 10 + i]);
            mesh.triangles.push([next, 10 + next, 10 + i]);
        }
        mesh.triangle_materials.resize(20, 0);
        let scene = commit(&mesh);
        for (index, facet) in scene.surfaces().iter().enumerate() {
            let centre = scene.to_local(Vec3::new(0.0, 3.0, 0.0));
            let height_m = facet.distance_m(centre);
            let point = centre - height_m * facet.normal;
            let seen = |in_front: bool| scene.finite_panel_at(index as u32, point, in_front);
            assert!(seen(height_m > 0.0).is_none());
            let sides = seen(height_m < 0.0).expect("free outside").sides;
            assert!(
                (sides[0].length() - 6.0).abs() < 1e-3 && (sides[1].length() - 0.309).abs() < 1e-3
            );
        }
    }

    #[derive(Debug, Default)]
    struct RayCount(AtomicUsize);

    impl RayObserver for RayCount {
        fn on_ray(&self, _: &Ray, _: [u32; 2], _: bool) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Boxes that the search for free panels intersects, by estimate.
    fn boxes(mesh: &TriangleMesh) -> f64 {
        let mesh = commit_mesh(mesh, &MaterialTable::built_in(), 0.5).expect("commits");
        let groups = &mesh.surfaces.triangle_surface;
        let rays = Arc::new(RayCount::default());
        let bvh = Bvh::build(&mesh.vertices, &mesh.triangles, groups).with_observer(rays.clone());
        FinitePanels::build(&mesh.vertices, &mesh.triangles, &mesh.surfaces, &bvh, 40.0);
        rays.0.load(Ordering::Relaxed) as f64 * bvh.crossed_boxes()
    }

    #[test]
    fn the_search_for_free_panels_is_bounded() {
        for name in procedural::NAMES {
            let boxes = boxes(&procedural::by_name(name).expect("a scene").mesh);
            assert!(0.0 < boxes && boxes < MOST_BOXES / 4.0, "{name}: {boxes}");
        }
        // Panels of half a square metre and more, as long as a cube of 50 m.
        let random = |n: u32| (n.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        let mut mesh = TriangleMesh::default();
        let material = mesh.material("steel");
        for n in 0..20_000 {
            let [a, b] = [6 * n, 6 * n + 3]
                .map(|n| 50.0 * Vec3::new(random(n), random(n + 1), random(n + 2)));
            mesh.vertices
                .extend([a, b, b + 0.05 * (b - a).any_orthonormal_vector()]);
            mesh.triangles.push([3 * n, 3 * n + 1, 3 * n + 2]);
            mesh.triangle_materials.push(material);
        }
        let boxes = boxes(&mesh);
        assert!(boxes <= MOST_BOXES, "{boxes}");
    }
}
