//! `bench update`: a fixed number of propagation updates and nothing else, for counters of instructions.
//!
//! No clock is read. Counts at N and at 2 N updates differ by N updates.

use std::sync::Arc;

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::{Error, Result};
use serde_json::json;

use super::boxes::Boxes;
use super::look_ahead::LookAhead;
use super::updates::{step_aside, stroll};
use super::walk::{Walk, time_s};
use crate::inputs::predictor_named;
use crate::printed;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scene by name, or `million`.
    #[arg(long, default_value = "concert_hall")]
    scene: String,
    /// Number of sources, up to 4096.
    #[arg(long, default_value_t = 16)]
    sources: usize,
    /// Number of updates after warm-up.
    #[arg(long, default_value_t = 16)]
    updates: usize,
    /// Threads that share an update.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Move the sources in every update, farther than the cells of the ray cache.
    #[arg(long)]
    moving_sources: bool,
    /// Move the sources at a walker's pace, to and fro: few rays of the cache are cast again.
    #[arg(long, conflicts_with = "moving_sources")]
    walking_sources: bool,
    /// Most sources that walk; the others are at rest.
    #[arg(long, value_name = "N", requires = "walking_sources")]
    walkers: Option<usize>,
    /// Keep the listener where its walk begins.
    #[arg(long)]
    standing: bool,
    /// The predictor that the updates are for, `hold` or `best`.
    #[arg(long, default_value = "hold")]
    predictor: String,
    /// Number of moving instances: one is a door, more are boxes.
    #[arg(long, value_name = "N", default_value_t = 0)]
    instances: usize,
    /// Most diffracting edges of a path.
    #[arg(long, alias = "bends", default_value_t = PropagationSettings::default().diffraction_order)]
    diffraction_order: usize,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if arguments.updates == 0 {
        let problem = "0 updates show nothing".to_owned();
        return Err(Error::setting("--updates", problem, "give 1 or more"));
    }
    let walk = Walk::through(&arguments.scene)?;
    let sources = walk.sources(arguments.sources)?;
    let settings = PropagationSettings {
        diffraction_order: arguments.diffraction_order,
        ..PropagationSettings::default()
    };
    let threads = Threads::start(arguments.threads)?;
    let predictor = predictor_named(&arguments.predictor)?;
    let mut propagator = Propagator::new(Arc::clone(&walk.scene), settings)?;
    let mut boxes = Boxes::add(&mut propagator, &walk, &sources, arguments.instances)?;
    propagator.warm_up(&walk.ear(0), &sources);
    let mut set = PathSet::default();
    let (mut paths, mut rays, mut digest) = (0, 0, 0);
    let mut moved = sources.clone();
    let walkers = arguments.walkers.unwrap_or(moved.len()).min(moved.len());
    let mut look_ahead = LookAhead::new(predictor);
    for step in 0..arguments.updates {
        if arguments.moving_sources {
            step_aside(&mut moved, &sources, step);
        }
        if arguments.walking_sources {
            stroll(&mut moved[..walkers], &sources, step);
        }
        let ear = walk.ear(if arguments.standing { 0 } else { step });
        boxes.move_on(&mut propagator, step);
        look_ahead.ask(&mut propagator, &ear, &moved);
        propagator.update_with(&threads, &ear, &moved, time_s(step), &mut set);
        digest = digested(digest, &set);
        paths += set.paths.len();
        rays += set.rays;
    }
    let updates = arguments.updates as f64;
    let (paths, rays) = (paths as f64 / updates, rays as f64 / updates);
    let row = json!({
        "scene": arguments.scene,
        "sources": arguments.sources,
        "updates": arguments.updates,
        "threads": arguments.threads,
        "moving_sources": arguments.moving_sources,
        "walking_sources": arguments.walking_sources,
        "walkers": if arguments.walking_sources { walkers } else { 0 },
        "standing": arguments.standing,
        "predictor": predictor.name(),
        "instances": arguments.instances,
        "bends": arguments.diffraction_order,
        "paths_an_update": paths,
        "rays_an_update": rays,
        "digest": format!("{digest:016x}"),
    });
    printed::rows(&[row], arguments.json);
    Ok(())
}

/// A hash of all bits of an update's result except its number of rays, and of the hash before.
fn digested(before: u64, set: &PathSet) -> u64 {
    let mut hash = before;
    let mut add = |value: u64| {
        hash = (hash.rotate_left(5) ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        hash ^= hash >> 29;
    };
    for path in set.paths.iter().chain(&set.nearby) {
        add(path.id.0);
        add(u64::from(path.length_m.to_bits()));
        path.surfaces().iter().for_each(|s| add(u64::from(*s)));
        path.edges.iter().for_each(|e| add(u64::from(*e)));
        let points = path.points().iter().chain([&path.image]);
        let coordinates = points.flat_map(|p| p.to_array());
        let numbers = coordinates.chain(path.amplitude);
        numbers.for_each(|n| add(u64::from(n.to_bits())));
    }
    for (_, edge) in &set.direct_edges {
        add(u64::from(*edge));
    }
    for late in set.late.iter().chain(&set.predicted_late) {
        let numbers = late.energy.as_flattened().as_flattened().iter();
        numbers.for_each(|n| add(u64::from(n.to_bits())));
        add(u64::from(late.start_s.to_bits()));
        add(u64::from(late.mean_free_time_s.to_bits()));
    }
    for group in set
        .late_groups
        .iter()
        .chain(set.predicted_groups.as_flattened())
    {
        let numbers = group.directions.as_flattened().iter();
        let numbers = numbers.chain(&group.decay_time_s);
        numbers.for_each(|n| add(u64::from(n.to_bits())));
    }
    hash
}
