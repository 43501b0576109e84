//! Benchmark scenes made by code.
//!
//! Control side, host or device; bounded by the scene's size. Output: a mesh with material names, sixteen source
//! positions and one listener walk. The bits are the same on every machine: seeds are fixed, arithmetic is `+ − × ÷` and
//! square roots in f64, and coordinates are rounded to a millimetre.
//!
//! The scenes of the paper are not public; these have their size and character. Walls, floors and ceilings are
//! exactly planar and axis-parallel, solids face outwards, room shells inwards (counter-clockwise towards the
//! listener). Objects stand flush on the surface that carries them, without a face of their own there.

mod angrybot;
mod bootcamp;
mod builder;
mod carving;
mod concert_hall;
mod doorway;
mod million;
mod random;
mod solids;
mod write;

use std::ops::Range;

use glam::Vec3;

use super::TriangleMesh;

pub use angrybot::angrybot;
pub use bootcamp::bootcamp;
pub use concert_hall::concert_hall;
pub use doorway::doorway;
pub use million::million;
pub use write::write_files;

/// Names of the benchmark scenes for [`by_name`].
pub const NAMES: [&str; 4] = ["concert_hall", "bootcamp", "angrybot", "doorway"];

/// Walking speed of the listener, m/s.
pub const WALK_SPEED_M_S: f32 = 1.4;

/// A benchmark scene.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchmarkScene {
    /// One of [`NAMES`].
    pub name: &'static str,
    /// Welded triangles without degenerate and duplicate ones.
    pub mesh: TriangleMesh,
    /// Kinds of objects, in the order of the mesh's triangles and without gaps.
    pub parts: Vec<ObjectRange>,
    /// Sixteen names (`source01` to `source16`) and positions in metres.
    pub sources: Vec<(String, Vec3)>,
    /// Walk of the listener.
    pub walk: Walk,
}

/// All objects of one kind in a mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObjectRange {
    /// Kind of the objects, in one word.
    pub name: &'static str,
    /// Their triangles in the mesh.
    pub triangles: Range<usize>,
}

/// A straight line that the listener walks back and forth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk {
    /// Ear position at the start, in metres.
    pub from: Vec3,
    /// Ear position at the turn, in metres.
    pub to: Vec3,
    /// Speed in m/s.
    pub speed_m_s: f32,
    /// Ear position of a listener at rest, in metres: the middle of the line.
    pub standing: Vec3,
}

impl Walk {
    fn between(from: Vec3, to: Vec3) -> Self {
        Self {
            from,
            to,
            speed_m_s: WALK_SPEED_M_S,
            standing: (from + to) * 0.5,
        }
    }
}

/// The scene of a name in [`NAMES`]; `None` for any other.
pub fn by_name(name: &str) -> Option<BenchmarkScene> {
    match name {
        "concert_hall" => Some(concert_hall()),
        "bootcamp" => Some(bootcamp()),
        "angrybot" => Some(angrybot()),
        "doorway" => Some(doorway()),
        _ => None,
    }
}

/// A closed rectangular room of twelve triangles that face inwards, one corner at the origin, the other at `size`
/// in metres. Sizes are not rounded: closed forms hold.
///
/// # Examples
/// ```
/// let room = foresound::shoebox([8.0, 3.0, 5.0], "concrete");
/// assert_eq!(room.triangles.len(), 12);
/// ```
pub fn shoebox(size: impl Into<Vec3>, material: &str) -> TriangleMesh {
    let size = size.into();
    let mut mesh = TriangleMesh::default();
    let index = mesh.material(material);
    for corner in 0..8 {
        let far = Vec3::new(
            (corner & 1) as f32,
            (corner >> 1 & 1) as f32,
            (corner >> 2) as f32,
        );
        mesh.vertices.push(size * far);
    }
    // Corner bits are 1 for x, 2 for y, 4 for z; counter-clockwise seen from inside.
    const FACES: [[u32; 4]; 6] = [
        [0, 2, 6, 4],
        [1, 5, 7, 3],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 1, 3, 2],
        [4, 6, 7, 5],
    ];
    for [a, b, c, d] in FACES {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
        mesh.triangle_materials.extend([index; 2]);
    }
    mesh
}

/// Names positions `source01` and up.
fn named(positions: [[f32; 3]; 16]) -> Vec<(String, Vec3)> {
    (1..)
        .zip(positions)
        .map(|(number, position)| (format!("source{number:02}"), Vec3::from(position)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shoebox_faces_point_inwards() {
        let size = Vec3::new(3.0, 2.5, 4.1);
        let room = shoebox(size, "plaster");
        assert_eq!(room.triangles.len(), 12);
        for triangle in &room.triangles {
            let [a, b, c] = triangle.map(|v| room.vertices[v as usize]);
            assert!((b - a).cross(c - a).dot(size * 0.5 - a) > 0.0);
        }
    }

    #[test]
    fn scene_is_found_by_its_own_name() {
        let scene = by_name("doorway").expect("a name of the list");
        assert_eq!(scene.name, "doorway");
        assert!(by_name("Doorway").is_none());
    }
}
