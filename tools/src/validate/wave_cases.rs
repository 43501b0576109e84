//! Obstacles along the axes with a source and listeners: cases that finite differences solve and that propagation is
//! measured against.

use std::sync::Arc;

use foresound::error::Result;
use foresound::scene::{Scene, TriangleMesh};
use glam::Vec3;

use super::rooms;

/// A point, in metres.
pub type Point = [f64; 3];

/// Half the length in metres of what has no end in a case.
const FAR_M: f64 = 60.0;

/// Absorption coefficient of a case's absorbing faces, and its specific impedance: the most that a real impedance absorbs
/// (\[KUTTRUFF\] 2.42).
const ABSORPTION: f32 = 0.951;
const IMPEDANCE: f64 = 1.567;

/// A box along the axes; a sheet where it has no thickness. Infinite where it has no end.
pub type Obstacle = [Point; 2];

/// Obstacles of one material, a region around them for finite differences, a source and its listeners.
#[derive(Debug, Clone)]
pub struct WaveCase {
    /// Name of the scene and of the source.
    pub name: &'static str,
    /// The boxes, which may touch.
    pub obstacles: Vec<Obstacle>,
    /// Specific impedance of all faces; infinite where they are rigid.
    pub impedance: f64,
    /// Corners of the region that finite differences cover.
    pub region: [Point; 2],
    /// The source.
    pub source: Point,
    /// The listeners.
    pub listeners: Vec<Point>,
}

/// Tones of an octave.
pub const TONES: usize = 24;

const INF: f64 = f64::INFINITY;

/// A wall across x from 0 to `thickness_m` with an opening of 0.96 m by 2.04 m.
fn partition(thickness_m: f64) -> Vec<Obstacle> {
    let part = |y: [f64; 2], z: [f64; 2]| [[0.0, y[0], z[0]], [thickness_m, y[1], z[1]]];
    let (jambs, head) = ([-0.48, 0.48], 2.04);
    vec![
        part([-INF, jambs[0]], [-INF, INF]),
        part([jambs[1], INF], [-INF, INF]),
        part(jambs, [-INF, 0.0]),
        part(jambs, [head, INF]),
    ]
}

/// The listeners on a grid.
fn grid(x: &[f64], y: &[f64], z: &[f64]) -> Vec<Point> {
    let mut points = Vec::new();
    for &x in x {
        for &y in y {
            points.extend(z.iter().map(|&z| [x, y, z]));
        }
    }
    points
}

/// All cases.
pub fn cases() -> Vec<WaveCase> {
    let mut cases = Vec::new();
    let sources = [
        ["axis", "oblique", "near"],
        ["axis thick", "oblique thick", "near thick"],
        ["axis absorbing", "oblique absorbing", "near absorbing"],
    ];
    for (kind, names) in sources.into_iter().enumerate() {
        let positions = [[-2.0, 0.0, 1.2], [-1.5, -1.3, 1.5], [-0.7, 0.7, 0.6]];
        for (name, source) in names.into_iter().zip(positions) {
            let thickness_m = if kind == 1 { 0.24 } else { 0.0 };
            let mut obstacles = partition(thickness_m);
            let mut low_z = -0.9;
            if kind == 2 {
                // An absorbing floor, and no sill.
                obstacles.remove(2);
                for obstacle in &mut obstacles {
                    obstacle[0][2] = obstacle[0][2].max(0.0);
                }
                obstacles.push([[-INF, -INF, -INF], [INF, INF, 0.0]]);
                low_z = -0.06;
            }
            cases.push(WaveCase {
                name,
                obstacles,
                impedance: if kind == 2 { IMPEDANCE } else { INF },
                region: [[-2.1, -2.1, low_z], [2.4, 2.1, 2.7]],
                source,
                listeners: grid(
                    &[0.6 + thickness_m, 1.2, 2.1],
                    &[-1.8, -0.9, 0.0, 0.7, 1.3, 2.0],
                    &[0.4, 1.3, 1.8, 2.4],
                ),
            });
        }
    }
    let ground = [[-INF, -INF, -INF], [INF, INF, 0.0]];
    let screen = [[0.0, -1.5, 0.0], [0.0, 1.5, 1.8]];
    let positions = [[-1.5, 0.0, 1.2], [-1.2, -1.2, 0.6], [-2.0, 1.8, 1.5]];
    for (name, source) in ["screen middle", "screen side", "screen beside"]
        .into_iter()
        .zip(positions)
    {
        cases.push(WaveCase {
            name,
            obstacles: vec![ground, screen],
            impedance: INF,
            region: [[-2.4, -2.4, -0.06], [2.4, 2.4, 2.7]],
            source,
            listeners: grid(
                &[0.6, 1.2, 2.1],
                &[-2.1, -1.2, 0.0, 0.7, 1.3, 2.1],
                &[0.4, 1.2, 2.0],
            ),
        });
    }
    let wall = [[0.0, -INF, -INF], [0.3, INF, 0.0]];
    let positions = [[-1.5, 0.0, -0.6], [-0.6, 0.0, -0.9], [-1.5, 0.0, 0.3]];
    for (name, source) in ["wall deep", "wall near", "wall high"]
        .into_iter()
        .zip(positions)
    {
        cases.push(WaveCase {
            name,
            obstacles: vec![wall],
            impedance: INF,
            region: [[-1.8, -0.3, -1.8], [2.4, 0.9, 0.9]],
            source,
            listeners: grid(&[0.6, 1.2, 2.1], &[0.0, 0.6], &[-1.5, -0.9, -0.3, 0.2, 0.6]),
        });
    }
    cases
}

impl WaveCase {
    /// The obstacles as a scene.
    ///
    /// # Errors
    /// Those of committing a scene.
    pub fn scene(&self) -> Result<Arc<Scene>> {
        let absorption = if self.impedance.is_finite() {
            ABSORPTION
        } else {
            0.0
        };
        rooms::commit(&self.mesh(), vec![rooms::even("wall", absorption, 0.0)])
    }

    /// Faces between air and obstacles on the lattice of all their planes, without faces at the far ends.
    fn mesh(&self) -> TriangleMesh {
        let obstacles: Vec<[Point; 2]> = (self.obstacles.iter())
            .map(|corners| corners.map(|corner| corner.map(|v| v.clamp(-FAR_M, FAR_M))))
            .collect();
        let planes = [0, 1, 2].map(|axis| {
            let mut planes: Vec<f64> = vec![-FAR_M, FAR_M];
            planes.extend(obstacles.iter().flatten().map(|corner| corner[axis]));
            planes.sort_by(f64::total_cmp);
            planes.dedup();
            planes
        });
        let is_solid = |at: Point| {
            (obstacles.iter()).any(|[low, high]| (0..3).all(|a| low[a] < at[a] && at[a] < high[a]))
        };
        let mut mesh = TriangleMesh::default();
        let material = mesh.material("wall");
        for axis in 0..3 {
            let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
            for &plane in &planes[axis][1..planes[axis].len() - 1] {
                for across in planes[b].windows(2) {
                    for along in planes[c].windows(2) {
                        let mut middle = [plane; 3];
                        middle[b] = 0.5 * (across[0] + across[1]);
                        middle[c] = 0.5 * (along[0] + along[1]);
                        let beside = |offset: f64| {
                            let mut at = middle;
                            at[axis] += offset;
                            is_solid(at)
                        };
                        let is_sheet = (obstacles.iter()).any(|[low, high]| {
                            low[axis] == plane
                                && high[axis] == plane
                                && [b, c]
                                    .iter()
                                    .all(|&a| low[a] < middle[a] && middle[a] < high[a])
                        });
                        let (before, behind) = (beside(-1e-6), beside(1e-6));
                        if before == behind && (before || !is_sheet) {
                            continue;
                        }
                        let mut corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]| {
                            let mut corner = [plane; 3];
                            (corner[b], corner[c]) = (across[i], along[j]);
                            corner
                        });
                        if behind {
                            corners.reverse();
                        }
                        let first = mesh.vertices.len() as u32;
                        let narrow = |p: Point| Vec3::from(p.map(|v| v as f32));
                        mesh.vertices.extend(corners.map(narrow));
                        mesh.triangles.push([first, first + 1, first + 2]);
                        mesh.triangles.push([first, first + 2, first + 3]);
                        mesh.triangle_materials.extend([material; 2]);
                    }
                }
            }
        }
        mesh
    }
}
