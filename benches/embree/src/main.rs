//! Rays a second of our tree beside Embree's, one ray at a time, on one thread, over the rays that `bench rays --dump`
//! wrote. `benches/README.md` describes the use.
//!
//! Rays go in batches of a thousand, and all tracers take turns at every batch: other load on the machine affects all
//! alike. A tracer's time for a batch is its least.

mod embree;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use foresound::geometry::bvh::{InstructionSet, NO_GROUP};
use foresound::geometry::{Bvh, Ray};
use glam::Vec3;

const SCENES: [&str; 3] = ["concert_hall", "bootcamp", "angrybot"];

/// Names of sets, and whether they use any-hit queries.
const SETS: [(&str, bool); 3] = [("guide", false), ("source", false), ("visibility", true)];

/// Rays in a batch.
const BATCH: usize = 1024;

/// Consecutive repetitions of a batch by one tracer, which bring its tree into the cache.
const ROW: usize = 3;

/// One tracer: returns the number of rays that hit.
type Tracer<'a> = Box<dyn Fn(&[Ray], bool) -> usize + 'a>;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [dump, rounds, libraries @ ..] = arguments.as_slice() else {
        return Err("arguments: DUMP-FOLDER ROUNDS EMBREE-LIBRARY[@CONFIGURATION]...".into());
    };
    let rounds: usize = rounds.parse()?;
    let libraries = libraries
        .iter()
        .map(|library| embree::Library::open(library))
        .collect::<Result<Vec<_>, _>>()?;
    let ours: Vec<InstructionSet> = InstructionSet::ALL
        .into_iter()
        .filter(|set| *set != InstructionSet::Scalar && set.is_available())
        .collect();
    let mut names: Vec<String> = ours.iter().map(|set| set.name().to_owned()).collect();
    for library in &libraries {
        names.extend(["robust", "default"].map(|mode| format!("{} {mode}", library.name())));
    }
    print!("{:24}", "million rays a second");
    names.iter().for_each(|name| print!(" {name:>16}"));
    println!();
    let mut rates: Vec<Vec<f64>> = Vec::new();
    for scene in SCENES {
        let vertices = points(&floats(
            &Path::new(dump).join(format!("{scene}-triangles.f32")),
        )?);
        let triangles: Vec<[u32; 3]> = (0..vertices.len() as u32 / 3)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        let tree = Bvh::build(&vertices, &triangles, &vec![0; triangles.len()]);
        let trees: Vec<Bvh> = ours
            .iter()
            .filter_map(|set| tree.rebuilt_for(*set))
            .collect();
        let mut tracers: Vec<Tracer<'_>> = Vec::new();
        for tree in &trees {
            tracers.push(Box::new(move |rays: &[Ray], any: bool| {
                trace(tree, rays, any)
            }));
        }
        for library in &libraries {
            for robust in [true, false] {
                let scene = library.scene(&vertices, &triangles, robust)?;
                tracers.push(Box::new(move |rays: &[Ray], any: bool| {
                    scene.trace(rays, any)
                }));
            }
        }
        for (set, any) in SETS {
            let rays = rays(&floats(
                &Path::new(dump).join(format!("{scene}-{set}.f32")),
            )?);
            let (seconds, hits) = measure(&tracers, &rays, any, rounds);
            let row: Vec<f64> = seconds
                .iter()
                .map(|s| rays.len() as f64 / s / 1e6)
                .collect();
            print!("{:24}", format!("{scene} {set}"));
            row.iter().for_each(|rate| print!(" {rate:16.3}"));
            println!("   hits {hits:?}");
            rates.push(row);
        }
    }
    for us in 0..ours.len() {
        for them in ours.len()..names.len() {
            let ratios: Vec<f64> = rates.iter().map(|row| row[us] / row[them]).collect();
            let mean = ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64;
            let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
            let each: Vec<String> = ratios.iter().map(|r| format!("{r:.2}")).collect();
            println!(
                "{} / {}: geometric mean {:.3}, least {least:.3}, each {}",
                names[us],
                names[them],
                mean.exp(),
                each.join(" ")
            );
        }
    }
    Ok(())
}

/// Seconds that each tracer takes for all rays, and hits.
fn measure(
    tracers: &[Tracer<'_>],
    rays: &[Ray],
    any: bool,
    rounds: usize,
) -> (Vec<f64>, Vec<usize>) {
    let mut seconds = vec![0.0; tracers.len()];
    let mut hits = vec![0; tracers.len()];
    for batch in rays.chunks(BATCH) {
        let mut least = vec![f64::INFINITY; tracers.len()];
        for _ in 0..rounds {
            for (tracer, least) in tracers.iter().zip(&mut least) {
                for _ in 0..ROW {
                    let start = Instant::now();
                    std::hint::black_box(tracer(batch, any));
                    *least = least.min(start.elapsed().as_secs_f64());
                }
            }
        }
        for (k, tracer) in tracers.iter().enumerate() {
            seconds[k] += least[k];
            hits[k] += tracer(batch, any);
        }
    }
    (seconds, hits)
}

fn trace(tree: &Bvh, rays: &[Ray], any: bool) -> usize {
    let hits = |ray: &&Ray| {
        if any {
            tree.any_hit(ray, [NO_GROUP; 2])
        } else {
            tree.closest_hit(ray, [NO_GROUP; 2]).is_some()
        }
    };
    rays.iter().filter(hits).count()
}

fn floats(file: &Path) -> Result<Vec<f32>, Box<dyn Error>> {
    let bytes = std::fs::read(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let (values, _) = bytes.as_chunks::<4>();
    Ok(values
        .iter()
        .map(|bytes| f32::from_le_bytes(*bytes))
        .collect())
}

fn points(values: &[f32]) -> Vec<Vec3> {
    let (points, _) = values.as_chunks::<3>();
    points
        .iter()
        .map(|point| Vec3::from_array(*point))
        .collect()
}

fn rays(values: &[f32]) -> Vec<Ray> {
    let (rays, _) = values.as_chunks::<7>();
    rays.iter()
        .map(|&[ox, oy, oz, dx, dy, dz, t_max]| Ray {
            t_max,
            ..Ray::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz))
        })
        .collect()
}
