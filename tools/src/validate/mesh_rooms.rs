//! Rooms of the law *mesh*, tessellated: clean, with noise on the vertices, and as a scan.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

use foresound::propagation::rays::directions::{mix, unit};
use foresound::scene::TriangleMesh;

/// A room made of blocks of air between planes across the axes, and its source and listener pairs.
pub(super) struct BlockRoom {
    pub(super) name: &'static str,
    /// Positions of the planes along each axis, ascending.
    planes: [&'static [f32]; 3],
    /// Whether the block between planes i and i + 1 along x and z has air, a row of letters per z: `.` or `#`.
    plan: &'static [&'static str],
    pub(super) pairs: &'static [[Vec3; 2]],
    /// Direction of a walk along x and z from each listener.
    pub(super) walk: [f32; 2],
}

/// The rooms: a shoebox, an L, a T, and a hall with two columns.
pub(super) const ROOMS: [BlockRoom; 4] = [
    BlockRoom {
        name: "shoebox",
        planes: [&[0.0, 8.0], &[0.0, 3.0], &[0.0, 6.0]],
        plan: &["."],
        pairs: &[
            [Vec3::new(2.13, 1.57, 1.71), Vec3::new(5.87, 1.22, 4.39)],
            [Vec3::new(6.91, 2.21, 5.03), Vec3::new(1.07, 0.83, 4.76)],
        ],
        walk: [-0.8, -0.6],
    },
    BlockRoom {
        name: "L-room",
        planes: [&[0.0, 3.1, 7.3], &[0.0, 2.7], &[0.0, 2.9, 6.4]],
        plan: &["..", ".#"],
        pairs: &[
            [Vec3::new(1.13, 1.37, 5.11), Vec3::new(5.87, 1.62, 1.39)],
            [Vec3::new(2.21, 1.21, 1.03), Vec3::new(6.07, 0.93, 2.06)],
        ],
        walk: [-0.6, 0.8],
    },
    BlockRoom {
        name: "T-room",
        planes: [&[0.0, 2.7, 5.6, 8.2], &[0.0, 2.8], &[0.0, 3.0, 6.3]],
        plan: &["...", "#.#"],
        pairs: &[
            [Vec3::new(1.13, 1.37, 1.11), Vec3::new(4.07, 1.62, 5.39)],
            [Vec3::new(1.71, 1.21, 2.03), Vec3::new(6.97, 0.93, 1.36)],
        ],
        walk: [0.0, -1.0],
    },
    BlockRoom {
        name: "hall with columns",
        planes: [
            &[0.0, 2.4, 3.1, 5.9, 6.6, 9.0],
            &[0.0, 3.4],
            &[0.0, 2.9, 3.6, 6.2],
        ],
        plan: &[".....", ".#.#.", "....."],
        pairs: &[
            [Vec3::new(1.13, 1.37, 1.11), Vec3::new(7.87, 1.62, 4.39)],
            [Vec3::new(4.41, 1.21, 5.03), Vec3::new(4.77, 0.93, 1.36)],
        ],
        walk: [0.0, 1.0],
    },
];

/// Numbers of a normal distribution, the same in every run.
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f32 {
        // Sum of twelve uniform numbers: within 6 standard deviations, as measured distances are.
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = mix(self.0);
            sum += unit(self.0);
        }
        sum
    }
}

impl BlockRoom {
    fn is_air(&self, block: IVec3) -> bool {
        let at = |index: i32, count: usize| usize::try_from(index).ok().filter(|i| *i < count);
        let (Some(x), Some(_), Some(z)) = (
            at(block.x, self.planes[0].len() - 1),
            at(block.y, self.planes[1].len() - 1),
            at(block.z, self.planes[2].len() - 1),
        ) else {
            return false;
        };
        self.plan[z].as_bytes()[x] == b'.'
    }

    /// The walls in squares of about `edge_m`, wound inwards, in two triangles each; neighbours share their vertices.
    pub(super) fn tessellated(&self, edge_m: f32) -> TriangleMesh {
        // Positions of all lines along each axis, and the first line of each block.
        let lines: [(Vec<f32>, Vec<usize>); 3] = self.planes.map(|planes| {
            let (mut at, mut first) = (Vec::new(), Vec::new());
            for pair in planes.windows(2) {
                let count = ((pair[1] - pair[0]) / edge_m).round().max(1.0);
                first.push(at.len());
                let step = (pair[1] - pair[0]) / count;
                at.extend((0..count as u32).map(|i| pair[0] + step * i as f32));
            }
            first.push(at.len());
            at.extend(planes.last());
            (at, first)
        });
        let mut mesh = TriangleMesh::default();
        let material = mesh.material("wall");
        let mut indices: HashMap<[usize; 3], u32> = HashMap::new();
        let counts = self.planes.map(|planes| planes.len() as i32 - 1);
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    let block = IVec3::new(x, y, z);
                    if !self.is_air(block) {
                        continue;
                    }
                    for axis in 0..3 {
                        for far in [false, true] {
                            let mut beyond = block;
                            beyond[axis] += if far { 1 } else { -1 };
                            if self.is_air(beyond) {
                                continue;
                            }
                            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                            let line = |a: usize, next: i32| {
                                lines[a].1[usize::try_from(block[a] + next).unwrap_or(0)]
                            };
                            for i in line(u, 0)..line(u, 1) {
                                for j in line(v, 0)..line(v, 1) {
                                    let mut corner = |di: usize, dj: usize| {
                                        let mut at = [0; 3];
                                        at[axis] = line(axis, i32::from(far));
                                        (at[u], at[v]) = (i + di, j + dj);
                                        *indices.entry(at).or_insert_with(|| {
                                            let point = [0, 1, 2].map(|a| lines[a].0[at[a]]);
                                            mesh.vertices.push(Vec3::from(point));
                                            mesh.vertices.len() as u32 - 1
                                        })
                                    };
                                    let [a, b, c, d] =
                                        [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                                    // The diagonals alternate: no direction is preferred.
                                    let halves = match (i + j) % 2 == 0 {
                                        true => [[a, b, c], [a, c, d]],
                                        false => [[a, b, d], [b, c, d]],
                                    };
                                    for [p, q, r] in halves {
                                        mesh.triangles.push(match far {
                                            true => [p, r, q],
                                            false => [p, q, r],
                                        });
                                        mesh.triangle_materials.push(material);
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
        mesh
    }
}

/// Merges each vertex with an earlier one nearer than `least_m`, and drops what then has no area.
pub(super) fn merge_near(mesh: &mut TriangleMesh, least_m: f64) {
    let least_m = least_m as f32;
    let mut kept: Vec<Vec3> = Vec::new();
    let mut in_cell: HashMap<IVec3, Vec<u32>> = HashMap::new();
    let mut target = Vec::with_capacity(mesh.vertices.len());
    for vertex in &mesh.vertices {
        let cell = (*vertex / least_m).floor().as_ivec3();
        let around = (0..27).map(|n| cell + IVec3::new(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
        let mut near = around.filter_map(|c| in_cell.get(&c)).flatten();
        let is_near = |&&other: &&u32| kept[other as usize].distance(*vertex) < least_m;
        target.push(near.find(is_near).copied().unwrap_or_else(|| {
            kept.push(*vertex);
            let number = kept.len() as u32 - 1;
            in_cell.entry(cell).or_default().push(number);
            number
        }));
    }
    mesh.vertices = kept;
    let triangles = std::mem::take(&mut mesh.triangles);
    let materials = std::mem::take(&mut mesh.triangle_materials);
    for (triangle, material) in triangles.into_iter().zip(materials) {
        let [a, b, c] = triangle.map(|v| target[v as usize]);
        if a != b && b != c && c != a {
            mesh.triangles.push([a, b, c]);
            mesh.triangle_materials.push(material);
        }
    }
}

/// Moves every vertex along its normal by a normal distribution of `sigma_m`.
pub(super) fn add_noise(mesh: &mut TriangleMesh, sigma_m: f32, seed: u64) {
    let mut normals = vec![Vec3::ZERO; mesh.vertices.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for v in triangle {
            normals[*v as usize] += normal;
        }
    }
    let mut random = Normal(mix(seed));
    for (vertex, normal) in mesh.vertices.iter_mut().zip(normals) {
        *vertex += sigma_m * random.next() * normal.normalize_or_zero();
    }
}

/// Share of the inner vertices that a scan's decimation removes, and of its triangles that it lacks.
const DECIMATED: f32 = 0.4;
const LACKING: f32 = 0.02;

/// A mesh as of a scan: some vertices of flat places are merged into a neighbour, some triangles are missing.
pub(super) fn as_scan(mesh: &mut TriangleMesh, seed: u64) {
    let mut state = mix(seed);
    let mut random = || {
        state = mix(state);
        unit(state)
    };
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); mesh.vertices.len()];
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        triangle
            .iter()
            .for_each(|v| around[*v as usize].push(number));
    }
    let mut is_dead = vec![false; mesh.triangles.len()];
    for vertex in 0..mesh.vertices.len() as u32 {
        if random() >= DECIMATED {
            continue;
        }
        let ring: Vec<usize> = around[vertex as usize]
            .iter()
            .copied()
            .filter(|t| !is_dead[*t])
            .collect();
        let cross = |triangle: [u32; 3]| {
            let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
            (b - a).cross(c - a)
        };
        let normal = cross(mesh.triangles[ring[0]]).normalize_or_zero();
        let in_plane =
            |t: &usize| cross(mesh.triangles[*t]).normalize_or_zero().dot(normal) > 0.999;
        let others = ring.iter().flat_map(|&t| mesh.triangles[t]);
        let others: Vec<u32> = others.filter(|v| *v != vertex).collect();
        let into = others[(random() * others.len() as f32) as usize];
        let renamed = |t: usize| mesh.triangles[t].map(|v| if v == vertex { into } else { v });
        let least_m2 = 0.3 * cross(mesh.triangles[ring[0]]).length();
        let stays_valid = |t: &usize| {
            mesh.triangles[*t].contains(&into) || cross(renamed(*t)).dot(normal) > least_m2
        };
        if !ring.iter().all(in_plane) || !ring.iter().all(stays_valid) {
            continue;
        }
        for t in ring {
            let is_gone = mesh.triangles[t].contains(&into);
            is_dead[t] |= is_gone;
            if !is_gone {
                mesh.triangles[t] = mesh.triangles[t].map(|v| if v == vertex { into } else { v });
                around[into as usize].push(t);
            }
        }
    }
    for dead in &mut is_dead {
        *dead |= random() < LACKING;
    }
    let mut flags = is_dead.iter();
    mesh.triangles.retain(|_| flags.next() != Some(&true));
    mesh.triangle_materials.truncate(mesh.triangles.len());
}

/// Turns some triangles over: by chance, or all of them.
pub(super) fn rewind(mesh: &mut TriangleMesh, share: f32, seed: u64) {
    let mut state = mix(seed);
    for triangle in &mut mesh.triangles {
        state = mix(state);
        if unit(state) < share {
            triangle.swap(1, 2);
        }
    }
}
