//! `bench`: speeds on this machine. A speed is worth something only beside another of the same run.

mod blocks;
mod dump;
mod own_rays;
mod ray_sets;
mod rays;
mod sources;
mod speed;

use foresound::Result;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    /// Generation's share of a core, block by block, with a scene's own paths.
    Blocks(blocks::Arguments),
    /// Rays a second on one thread, over three fixed sets of rays.
    Rays(rays::Arguments),
    /// Propagation updates on one thread and two, beside their own rays.
    Speed(speed::Arguments),
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Blocks(arguments) => blocks::run(arguments),
        What::Rays(arguments) => rays::run(arguments),
        What::Speed(arguments) => speed::run(arguments),
    }
}

/// The value that a share of the others does not exceed.
fn share(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = (share * sorted.len() as f64) as usize;
    sorted.get(place).or(sorted.last()).copied().unwrap_or(0.0)
}
