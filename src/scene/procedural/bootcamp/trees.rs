//! Young trees: a trunk and a crown of leafy lumps.
//!
//! Facets of the crowns are smaller than 0.3 m: leaves scatter and neither reflect specularly nor diffract.

use glam::{DVec3, dvec3};

use super::super::builder::MeshBuilder;
use super::super::random::Random;
use super::super::solids::{Axis, Ball, Ends};
use super::terrain::Terrain;
use super::{LAND_HALF_M, YARD_HALF_M};

/// Number of trees.
const TREES: usize = 70;
/// Least distance of two trunks, in metres.
const APART_M: f64 = 5.0;
/// Least distance of trees from the yard and from the end of the land, in metres.
const MARGIN_M: f64 = 2.5;
/// Lumps of a crown: offset from the top of the trunk in units of the crown's radius.
const LUMPS: [DVec3; 3] = [
    dvec3(0.55, 0.0, 0.25),
    dvec3(-0.5, 0.15, 0.35),
    dvec3(-0.05, 0.75, -0.35),
];

/// Plants trees on the hills.
pub(super) fn trees(b: &mut MeshBuilder, land: &Terrain, seed: u64) {
    let mut random = Random::new(seed);
    let ball = Ball::new(2);
    let mut positions: Vec<DVec3> = Vec::new();
    let end = LAND_HALF_M - MARGIN_M;
    while positions.len() < TREES {
        let [x, z] = [(); 2].map(|()| random.between(-end, end));
        let in_yard = x.abs().max(z.abs()) < YARD_HALF_M + MARGIN_M;
        let position = dvec3(x, land.height(x, z), z);
        if !in_yard
            && positions
                .iter()
                .all(|&other| other.distance(position) > APART_M)
        {
            positions.push(position);
        }
    }
    b.part("trees");
    for position in positions {
        let radius = random.between(0.8, 1.0);
        let trunk_m = random.between(1.8, 2.6);
        b.paint("wood_panel");
        // The root is below the slope, the top inside the crown.
        let root = position - DVec3::Y * 0.3;
        b.prism(Axis::Y, root, trunk_m + 0.6, 0.09, 10, Ends::Far);
        b.paint("foliage");
        for offset in LUMPS {
            let middle = position + DVec3::Y * (trunk_m + 0.5) + offset * radius;
            b.lump(&ball, middle, radius, 0.12, &mut random);
        }
    }
}
