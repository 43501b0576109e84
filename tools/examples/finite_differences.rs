//! Solves the cases of the law *doorway* by finite differences and prints their levels as CSV.
//!
//! `cargo run --release -p foresound-tools --example finite_differences [cell in metres] [part of a case's name]`. With
//! cells of 0.03 m it takes twenty minutes of one core and 100 MB. The name `check` prints levels around a rigid half-plane
//! and their difference from the exact solution instead.

#![expect(clippy::print_stdout, reason = "the result")]

#[path = "../../tests/reference/finite_differences.rs"]
#[expect(unreachable_pub, reason = "the oracle is a file of the tests")]
mod finite_differences;
#[path = "../src/validate/oracles/wedge.rs"]
#[expect(unreachable_pub, reason = "the oracle is a file of the tests")]
mod wedge;

use std::f64::consts::PI;

use finite_differences::{Obstacle, Point, Region, SPEED_M_S, octave_ratio};
use foresound_tools::validate::wave_cases::{TONES, WaveCase, cases};

/// Middles of the octaves.
const OCTAVES_HZ: [f64; 3] = [250.0, 500.0, 1000.0];

/// Simulated time in seconds: the longest path of a case over two edges, and its pulse.
const DURATION_S: f64 = 0.028;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let cell = arguments.next().map(|argument| argument.parse());
    let Ok(cell_m) = cell.unwrap_or(Ok(0.03)) else {
        eprintln!("the first argument is the edge of a cell in metres");
        return;
    };
    let part = arguments.next().unwrap_or_default();
    if part == "check" {
        return check(cell_m);
    }
    println!("case,source_x,source_y,source_z,x,y,z,db_250,db_500,db_1000");
    for case in cases().iter().filter(|case| case.name.contains(&part)) {
        solve(case, cell_m);
    }
}

/// Levels around a rigid half-plane, z < 0 at x = 0, and how far the exact solution is below them.
fn check(cell_m: f64) {
    let mut region = Region {
        cell_m,
        low: [-1.5, -0.6, -1.5],
        high: [1.5, 0.6, 1.5],
        obstacles: vec![Obstacle {
            low: [0.0, f64::NEG_INFINITY, f64::NEG_INFINITY],
            high: [0.0, f64::INFINITY, 0.0],
            impedance: f64::INFINITY,
        }],
        source: [-1.2, 0.0, -0.4],
        listeners: Vec::new(),
        duration_s: DURATION_S,
    };
    region.source = region.on_grid(region.source);
    for x in [-1.2, -0.6, 0.3, 0.6, 1.2] {
        for z in [-1.2, -0.6, 0.0, 0.6, 1.2] {
            region.listeners.push(region.on_grid([x, 0.3, z]));
        }
    }
    let heard = region.pressures();
    region.obstacles.clear();
    let free = region.pressures();
    println!("x,y,z,db_250,db_500,db_1000,off_250,off_500,off_1000");
    for (i, listener) in region.listeners.iter().enumerate() {
        // Angles from the face at positive x.
        let polar = |p: Point| (p[0].hypot(p[2]), p[0].atan2(-p[2]).rem_euclid(2.0 * PI));
        let ((near, incoming), (far, outgoing)) = (polar(region.source), polar(*listener));
        let wedge = wedge::Wedge {
            n: 2.0,
            radii_m: [near, far],
            angles: [incoming, outgoing],
            along_m: listener[1] - region.source[1],
        };
        let levels = OCTAVES_HZ.map(|hz| {
            let energy = octave_ratio(&heard[i], &free[i], region.step_s(), hz, TONES);
            let exact = |tone: usize| {
                let octaves = (tone as f64 + 0.5) / TONES as f64 - 0.5;
                let wavenumber = 2.0 * PI * hz * octaves.exp2() / SPEED_M_S;
                (wedge::size(wedge.total([wavenumber])[0]) * wedge.direct_m()).powi(2)
            };
            let exact = (0..TONES).map(exact).sum::<f64>() / TONES as f64;
            [energy, energy / exact].map(|ratio| format!("{:.2}", 10.0 * ratio.log10()))
        });
        let places = listener.map(|v| format!("{v:.3}")).join(",");
        let of = |column: usize| {
            levels
                .each_ref()
                .map(|level| level[column].as_str())
                .join(",")
        };
        println!("{places},{},{}", of(0), of(1));
    }
}

fn solve(case: &WaveCase, cell_m: f64) {
    let mut region = Region {
        cell_m,
        low: case.region[0],
        high: case.region[1],
        obstacles: (case.obstacles.iter())
            .map(|&[low, high]| Obstacle {
                low,
                high,
                impedance: case.impedance,
            })
            .collect(),
        source: case.source,
        listeners: Vec::new(),
        duration_s: DURATION_S,
    };
    region.source = region.on_grid(case.source);
    region.listeners = case
        .listeners
        .iter()
        .map(|&at| region.on_grid(at))
        .collect();
    let heard = region.pressures();
    region.obstacles.clear();
    let free = region.pressures();
    for (i, listener) in region.listeners.iter().enumerate() {
        let levels = OCTAVES_HZ.map(|hz| {
            let energy = octave_ratio(&heard[i], &free[i], region.step_s(), hz, TONES);
            format!("{:.2}", 10.0 * energy.log10())
        });
        let places = region
            .source
            .iter()
            .chain(listener)
            .map(|v| format!("{v:.3}"));
        let name = case.name;
        println!(
            "{name},{},{}",
            places.collect::<Vec<_>>().join(","),
            levels.join(",")
        );
    }
}
