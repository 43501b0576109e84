//! `bench`: speeds on this machine. A speed is worth something only beside another of the same run.

mod alone;
mod blocks;
mod boxes;
mod dump;
mod memory;
mod moving;
mod ray_sets;
mod rays;
mod schedules;
mod sources;
mod speed;
mod update;
mod walk;

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
    /// Memory of an engine in a scene.
    Memory(memory::Arguments),
    /// Rays a second on one thread, over three fixed sets of rays.
    Rays(rays::Arguments),
    /// The engine's two schedules, and propagation updates on one thread and two beside their own rays.
    Speed(speed::Arguments),
    /// A fixed number of propagation updates, for counters of instructions.
    Update(update::Arguments),
}

/// The value that a share of the others does not exceed.
fn share(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = (share * sorted.len() as f64) as usize;
    sorted.get(place).or(sorted.last()).copied().unwrap_or(0.0)
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Blocks(arguments) => blocks::run(arguments),
        What::Memory(arguments) => memory::run(arguments),
        What::Rays(arguments) => rays::run(arguments),
        What::Speed(arguments) => speed::run(arguments),
        What::Update(arguments) => update::run(arguments),
    }
}
