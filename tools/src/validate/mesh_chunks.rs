//! Law *mesh/chunks*: a scene that is put together of joined parts sounds like the same scene committed in one piece, also where
//! a chunk of it is the fixed part.
//!
//! Rooms and a street are cut by planes through walls, floors and solids. A path has a counterpart where one of the same
//! numbers of reflections and diffractions has its image source nearby.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::mesh_rooms::ROOMS;
use super::rooms::{Probe, commit, even};
use super::{Case, Row};
use crate::cut::cut;
use foresound::acoustics::BANDS;
use foresound::error::Result;
use foresound::propagation::{PathSet, PropagationSettings};
use foresound::scene::{InstanceId, InstancePose, Scene, TriangleMesh};

/// Numbers of chunks along x, y and z.
const GRIDS: [[usize; 3]; 3] = [[2, 1, 2], [4, 1, 4], [4, 4, 4]];

/// Updates of which the last one is compared.
const UPDATES: u32 = 16;

/// Most reflections and diffractions of a compared path.
const ORDER: u8 = 3;

/// Least recall and most paths without a counterpart, in percent.
const RECALL: f64 = 99.0;
const SPURIOUS: f64 = 1.0;

/// Bounds of the median difference of amplitudes and of the difference of late levels in dB.
const AMPLITUDE_DB: f64 = 0.1;
const LATE_DB: f64 = 1.0;

/// Distance of the image sources of one path in metres.
const SAME_IMAGE_M: f32 = 0.05;

/// Distance of points of one edge in metres, and of the points that are compared.
const SAME_EDGE_M: f64 = 0.01;
const EDGE_STEP_M: f64 = 0.05;

/// Most of the length of all edges that may be missing, in percent: pieces of 0.3 m cast no shadow.
const MISSING_EDGES: f64 = 5.0;

/// Level in dB below the loudest path of those that are compared: the weakest of many diffracted paths are chosen by rank.
const COMPARED_DB: f32 = -60.0;

pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for room in &ROOMS {
        let mesh = room.tessellated(f32::MAX);
        rows.extend(cuts(room.name, &mesh, room.pairs)?);
    }
    let pairs = [
        [Vec3::new(-3.1, 1.6, -14.3), Vec3::new(2.3, 1.7, 9.4)],
        [Vec3::new(-2.2, 1.5, -12.7), Vec3::new(13.4, 1.7, 1.1)],
    ];
    rows.extend(cuts("street", &street(), &pairs)?);
    Ok(rows)
}

/// Ground of 60 m by 48 m with four houses, and a street between each two.
fn street() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let wall = mesh.material("wall");
    let mut quad = |corners: [Vec3; 4]| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| first + i);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
        mesh.triangle_materials.extend([wall; 2]);
    };
    let at = Vec3::new;
    quad([
        at(-30.0, 0.0, -24.0),
        at(-30.0, 0.0, 24.0),
        at(30.0, 0.0, 24.0),
        at(30.0, 0.0, -24.0),
    ]);
    for (x, z) in [(-22.0, -20.0), (-22.0, 5.0), (6.0, -20.0), (6.0, 5.0)] {
        let (low, high) = (at(x, 0.0, z), at(x + 16.0, 8.5, z + 15.0));
        let corner = |n: u32| {
            let pick = |axis: usize| {
                if n >> axis & 1 == 1 {
                    high[axis]
                } else {
                    low[axis]
                }
            };
            at(pick(0), pick(1), pick(2))
        };
        for face in [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [2, 6, 7, 3],
        ] {
            quad(face.map(corner));
        }
    }
    mesh
}

fn cuts(name: &str, mesh: &TriangleMesh, pairs: &[[Vec3; 2]]) -> Result<Vec<Row>> {
    let whole = commit(mesh, vec![even("wall", 0.1, 0.05)])?;
    let reference = heard(&whole, pairs)?;
    let mut rows = Vec::new();
    let layouts = GRIDS
        .iter()
        .flat_map(|grid| [(*grid, false), (*grid, true)]);
    for (grid, is_one_fixed) in layouts {
        let world = world(mesh, grid, is_one_fixed)?;
        let count = world.instance_count() + usize::from(is_one_fixed);
        let fixed = if is_one_fixed {
            ", one of them fixed"
        } else {
            ""
        };
        let mut case = Case::new(format!("mesh/chunks: {name}, {count} chunks{fixed}"));
        let found = heard(&world, pairs)?;
        let (mut all, mut missing, mut spurious) = (0, 0, 0);
        let (mut levels_db, mut late_db) = (Vec::new(), 0f64);
        for (whole, chunks) in reference.iter().zip(&found) {
            all += whole.paths.len();
            missing += whole.without_counterpart(chunks, Some(&mut levels_db));
            spurious += chunks.without_counterpart(whole, None);
            late_db = late_db.max(10.0 * (chunks.late / whole.late).log10().abs());
        }
        levels_db.sort_by(f64::total_cmp);
        let median = levels_db.get(levels_db.len() / 2).copied();
        let percent = |count: usize| 100.0 * count as f64 / all as f64;
        case.at_least("recall", 100.0 - percent(missing), RECALL, "%");
        case.at_most(
            "paths without a counterpart",
            percent(spurious),
            SPURIOUS,
            "%",
        );
        case.at_most(
            "amplitude, median",
            median.unwrap_or(f64::INFINITY),
            AMPLITUDE_DB,
            "dB",
        );
        case.at_most("late level", late_db, LATE_DB, "dB");
        let [whole_edges, chunk_edges] = [&whole, &world].map(|scene| points_of_edges(scene));
        let off = |a: &[DVec3], b: &[DVec3]| without_neighbour(a, b);
        let length_m = EDGE_STEP_M * off(&chunk_edges, &whole_edges) as f64;
        case.at_most("edges that the whole does not have", length_m, 0.0, "m");
        let missing = 100.0 * off(&whole_edges, &chunk_edges) as f64 / whole_edges.len() as f64;
        case.at_most("edges missing", missing, MISSING_EDGES, "%");
        rows.extend(case.rows);
    }
    Ok(rows)
}

/// The mesh as joined parts beside a fixed part: that of the chunk with the most triangles, or one of a centimetre.
fn world(mesh: &TriangleMesh, grid: [usize; 3], is_one_fixed: bool) -> Result<Arc<Scene>> {
    let bounds = |axis: usize| {
        let values = || mesh.vertices.iter().map(move |v| f64::from(v[axis]));
        (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        )
    };
    // Off the middle: planes through corners would be an easy case.
    let planes = |axis: usize| -> Vec<f64> {
        let (low, high) = bounds(axis);
        let count = grid[axis];
        let at = |n: usize| low + (high - low) * (n as f64 + 0.06) / count as f64;
        (1..count).map(at).collect()
    };
    let planes = [0, 1, 2].map(planes);
    let low = Vec3::new(bounds(0).0 as f32, bounds(1).0 as f32, bounds(2).0 as f32);
    let mut mark = foresound::scene::procedural::shoebox(Vec3::splat(0.01), "wall");
    for vertex in &mut mark.vertices {
        *vertex += low - 2.0;
    }
    let materials = || vec![even("wall", 0.1, 0.05)];
    let mut chunks: Vec<TriangleMesh> = cut(mesh, planes.each_ref().map(Vec::as_slice))
        .into_iter()
        .collect();
    if is_one_fixed {
        let largest = (0..chunks.len()).max_by_key(|&index| chunks[index].triangles.len());
        mark = chunks.swap_remove(largest.unwrap_or(0));
    }
    let mut world = Scene::clone(&*commit(&mark, materials())?);
    for chunk in chunks {
        let pose = InstancePose::at(InstanceId::default(), DVec3::ZERO);
        world.add_joined_instance(commit(&chunk, materials())?, &pose)?;
    }
    Ok(Arc::new(world))
}

/// What a listener receives.
struct Heard {
    paths: Vec<Arrival>,
    late: f64,
}

struct Arrival {
    order: [u8; 2],
    image: Vec3,
    amplitude: [f32; BANDS],
}

fn heard(scene: &Arc<Scene>, pairs: &[[Vec3; 2]]) -> Result<Vec<Heard>> {
    let [from, to] = pairs[0];
    let mut first = Probe::new(scene, from, PropagationSettings::default())?;
    first.update(to);
    let pair = |[from, to]: &[Vec3; 2]| -> Result<Heard> {
        let mut probe = first.beside(*from)?;
        for _ in 0..UPDATES {
            probe.update(*to);
        }
        Ok(Heard::of(&probe.set))
    };
    pairs.iter().map(pair).collect()
}

impl Heard {
    fn of(set: &PathSet) -> Self {
        let energy = |a: &[f32; BANDS]| a.iter().map(|a| a * a).sum::<f32>();
        let loudest = set
            .paths
            .iter()
            .map(|p| energy(&p.amplitude))
            .fold(0.0, f32::max);
        let floor = loudest * 10f32.powf(0.1 * COMPARED_DB);
        let compared = set.paths.iter().filter(|path| {
            path.order + path.diffraction_order <= ORDER && energy(&path.amplitude) > floor
        });
        let late = set.late.iter().flat_map(|late| late.total());
        Self {
            paths: compared
                .map(|path| Arrival {
                    order: [path.order, path.diffraction_order],
                    image: path.image,
                    amplitude: path.amplitude,
                })
                .collect(),
            late: late.map(f64::from).sum(),
        }
    }

    /// Number of paths that another set does not have; adds the differences of the others' levels.
    fn without_counterpart(&self, other: &Self, mut levels_db: Option<&mut Vec<f64>>) -> usize {
        let mut missing = 0;
        for path in &self.paths {
            let apart = |a: &&Arrival| a.image.distance(path.image);
            let same = other.paths.iter().filter(|a| a.order == path.order);
            let nearest = same.min_by(|a, b| apart(a).total_cmp(&apart(b)));
            let Some(found) = nearest.filter(|a| apart(a) < SAME_IMAGE_M) else {
                missing += 1;
                continue;
            };
            if let Some(levels_db) = levels_db.as_deref_mut() {
                let pairs = path.amplitude.iter().zip(&found.amplitude);
                let differences = pairs.map(|(a, b)| 20.0 * f64::from((b / a).abs()).log10());
                levels_db.extend(differences.map(f64::abs));
            }
        }
        missing
    }
}

/// Points of all edges of a scene, in world coordinates.
fn points_of_edges(scene: &Scene) -> Vec<DVec3> {
    let origin = scene.to_world(DVec3::ZERO).as_dvec3();
    let mut points = Vec::new();
    for edge in scene.all_edges() {
        let steps = (edge.length_m / EDGE_STEP_M).floor() as u32;
        points.extend((0..=steps).map(|n| edge.at(EDGE_STEP_M * f64::from(n)) + origin));
    }
    points
}

/// Number of points without one of the others nearby.
fn without_neighbour(points: &[DVec3], others: &[DVec3]) -> usize {
    // Points of the same line may lie half a step apart.
    let reach_m = SAME_EDGE_M.hypot(0.51 * EDGE_STEP_M);
    let mut sorted = others.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x));
    let is_near = |point: &&DVec3| {
        let first = sorted.partition_point(|p| p.x < point.x - reach_m);
        let near = sorted[first..].iter();
        let mut near = near.take_while(|p| p.x <= point.x + reach_m);
        near.any(|p| p.distance(**point) <= reach_m)
    };
    points.iter().filter(|point| !is_near(point)).count()
}
