//! The ground: a flat yard in the middle, hills around.

use glam::{DVec3, dvec3};

use super::super::builder::MeshBuilder;
use super::super::random::Random;
use super::{LAND_HALF_M, YARD_HALF_M};

/// Grid of the ground, in metres.
const CELL_M: f64 = 1.0;
/// Distance of the hills' control points, in metres.
const HILL_CELL_M: f64 = 20.0;
/// Control points a side.
const CONTROLS: usize = 9;
/// Distance from the yard's edge over which the ground rises to full height, in metres. With [`HEIGHT_M`] neighbouring
/// facets of the slope meet at 5° at most: the ground hardly diffracts.
const SLOPE_M: f64 = 24.0;
/// Least and greatest height of the hills, in metres.
const HEIGHT_M: [f64; 2] = [1.5, 5.5];
/// West and east side of the road, which crosses the yard from north to south, in metres east.
const ROAD_X_M: [f64; 2] = [12.0, 18.0];

/// Heights of the ground.
pub(super) struct Terrain {
    controls: Vec<f64>,
}

impl Terrain {
    /// Hills of a seed.
    pub(super) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let controls = (0..CONTROLS * CONTROLS)
            .map(|_| random.between(HEIGHT_M[0], HEIGHT_M[1]))
            .collect();
        Self { controls }
    }

    /// Height over the yard at a position, in metres: exactly 0 in the yard.
    pub(super) fn height(&self, x: f64, z: f64) -> f64 {
        let [dx, dz] = [x, z].map(|c| (c.abs() - YARD_HALF_M).max(0.0));
        let rise = smooth(((dx * dx + dz * dz).sqrt() / SLOPE_M).min(1.0));
        let [(i, u), (j, v)] = [x, z].map(|c| {
            let position = (c + LAND_HALF_M) / HILL_CELL_M;
            let cell = position.floor().clamp(0.0, (CONTROLS - 2) as f64);
            (cell as usize, smooth(position - cell))
        });
        let control = |i: usize, j: usize| self.controls[j * CONTROLS + i];
        let north = control(i, j) * (1.0 - u) + control(i + 1, j) * u;
        let south = control(i, j + 1) * (1.0 - u) + control(i + 1, j + 1) * u;
        rise * (north * (1.0 - v) + south * v)
    }

    /// The whole ground as one grid: yard and hills meet without a gap.
    pub(super) fn ground(&self, b: &mut MeshBuilder) {
        b.part("ground");
        let cells = (2.0 * LAND_HALF_M / CELL_M) as u32;
        let at = |i: u32, j: u32| -> DVec3 {
            let [x, z] = [i, j].map(|n| f64::from(n) * CELL_M - LAND_HALF_M);
            dvec3(x, self.height(x, z), z)
        };
        for j in 0..cells {
            for i in 0..cells {
                let [a, s, d, e] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                b.paint(cover((a + d) * 0.5));
                b.triangle([a, s, d]);
                b.triangle([a, d, e]);
            }
        }
    }
}

/// Smoothstep from 0 to 1.
fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

/// Material of the ground at a position.
fn cover(position: DVec3) -> &'static str {
    let in_yard = position.x.abs() < YARD_HALF_M && position.z.abs() < YARD_HALF_M;
    let on_road = position.x > ROAD_X_M[0] && position.x < ROAD_X_M[1];
    match (in_yard, on_road) {
        (true, true) => "asphalt",
        (true, false) => "gravel",
        // A trodden strip around the yard.
        _ if position.x.abs() < YARD_HALF_M + 4.0 && position.z.abs() < YARD_HALF_M + 4.0 => "soil",
        _ => "grass",
    }
}

#[cfg(test)]
mod tests {
    use super::super::HILL_SEED;
    use super::*;

    #[test]
    fn yard_is_flat_and_hills_are_not() {
        let land = Terrain::new(HILL_SEED);
        assert_eq!(land.height(39.0, -40.0), 0.0);
        assert!(land.height(75.0, 3.0) > HEIGHT_M[0]);
    }
}
