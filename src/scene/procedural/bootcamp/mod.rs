//! The boot camp: open country, 160 × 160 m, no ceiling.
//!
//! A flat yard of 80 × 80 m (gravel, one asphalt road) among hills of smooth terrain. Six wooden huts with open doors
//! and windows are along its north and west sides, steel containers in the east, concrete walls, barriers and sandbag
//! walls between; young trees are on the hills. +x is east, +z south. The walk crosses the middle of the yard, past the
//! ends of two walls: sources become visible and occluded.

mod obstacles;
mod terrain;
mod trees;

use glam::Vec3;

use super::builder::MeshBuilder;
use super::{BenchmarkScene, Walk};

/// Half the width of the flat yard, in metres.
const YARD_HALF_M: f64 = 40.0;
/// Half the width of the terrain, in metres.
const LAND_HALF_M: f64 = 80.0;
/// Seeds of the hills and of the trees.
const HILL_SEED: u64 = 1;
const TREE_SEED: u64 = 2;

/// Open terrain with obstacles.
pub fn bootcamp() -> BenchmarkScene {
    let mut b = MeshBuilder::new();
    let land = terrain::Terrain::new(HILL_SEED);
    land.ground(&mut b);
    obstacles::huts(&mut b);
    obstacles::containers(&mut b);
    obstacles::concrete(&mut b);
    obstacles::sandbags(&mut b);
    obstacles::course(&mut b);
    trees::trees(&mut b, &land, TREE_SEED);
    let walk = Walk::between(Vec3::new(-10.0, 1.65, 6.0), Vec3::new(10.0, 1.65, 6.0));
    b.into_scene("bootcamp", SOURCES, walk)
}

/// In the yard, except 5 to 8, which are in huts.
const SOURCES: [[f32; 3]; 16] = [
    [2.0, 1.6, 1.2],
    [-8.0, 1.5, 12.0],
    [12.6, 1.5, 2.0],
    [-4.0, 1.4, -8.0],
    [-20.0, 1.6, -31.0],
    [0.0, 1.5, -31.0],
    [24.0, 1.4, -31.0],
    [-32.0, 1.5, 10.0],
    [8.0, 1.7, 16.0],
    [-16.0, 1.5, 4.0],
    [18.0, 1.3, -14.0],
    [26.0, 1.5, 10.0],
    [-14.0, 1.6, -18.0],
    [-22.0, 1.5, 24.0],
    [4.0, 1.5, 30.0],
    [34.0, 1.6, 30.0],
];
