//! `bench update`: a fixed number of propagation updates and nothing else, for counters of instructions.
//!
//! No clock is read: measure at N and at 2 N updates and subtract, and what is left is N updates.

use std::sync::Arc;

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::{Error, Result};
use serde_json::json;

use super::alone::step_aside;
use super::walk::Walk;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Benchmark scene by name, or `million`.
    #[arg(long, default_value = "concert_hall")]
    scene: String,
    /// Number of sources.
    #[arg(long, default_value_t = 16)]
    sources: usize,
    /// Number of updates after warm-up.
    #[arg(long, default_value_t = 16)]
    updates: usize,
    /// Threads that share an update.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Have the sources move a millimetre in every update, so that nothing their rays found stays true.
    #[arg(long)]
    moving_sources: bool,
    /// Most edges that one path bends around.
    #[arg(long, default_value_t = PropagationSettings::default().bends)]
    bends: usize,
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
        bends: arguments.bends,
        ..PropagationSettings::default()
    };
    let threads = Threads::start(arguments.threads)?;
    let mut propagator = Propagator::new(Arc::clone(&walk.scene), settings)?;
    propagator.warm_up(&walk.ear(0), &sources);
    let mut set = PathSet::default();
    let (mut paths, mut rays) = (0, 0);
    let mut moved = sources.clone();
    for step in 0..arguments.updates {
        if arguments.moving_sources {
            step_aside(&mut moved, &sources, step);
        }
        propagator.update_with(&threads, &walk.ear(step), &moved, 0.0, &mut set);
        paths += set.paths.len();
        rays += set.rays;
    }
    let updates = arguments.updates as f64;
    let (paths, rays) = (paths as f64 / updates, rays as f64 / updates);
    if arguments.json {
        let row = json!({
            "scene": arguments.scene,
            "sources": arguments.sources,
            "updates": arguments.updates,
            "threads": arguments.threads,
            "moving_sources": arguments.moving_sources,
            "bends": arguments.bends,
            "paths_an_update": paths,
            "rays_an_update": rays,
        });
        println!("{}", json!({ "rows": [row] }));
    } else {
        println!(
            "{:14} {:4} sources: {} updates of {rays:.0} rays and {paths:.0} paths",
            arguments.scene, arguments.sources, arguments.updates
        );
    }
    Ok(())
}
