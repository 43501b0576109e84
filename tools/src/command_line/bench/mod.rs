//! `bench`: speeds on this machine, to be compared within one run.

mod blocks;
mod boxes;
mod commit;
mod dump;
mod look_ahead;
mod memory;
mod ray_sets;
mod rays;
mod recorded_rays;
mod schedules;
mod sources;
mod speed;
mod stream;
mod update;
mod updates;
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
    /// Committing a scene, saving it and loading it again.
    Commit(commit::Arguments),
    /// Memory of an engine in a scene.
    Memory(memory::Arguments),
    /// Rays a second on one thread, over three fixed sets of rays.
    Rays(rays::Arguments),
    /// The engine's two schedules, and propagation updates on one thread and two beside their own rays.
    Speed(speed::Arguments),
    /// A world of joined parts: times of adding and removing one, and of updates.
    Stream(stream::Arguments),
    /// A fixed number of propagation updates, for counters of instructions.
    Update(update::Arguments),
}

/// The value at a share (0 … 1) of the sorted values; 0 of none.
fn share(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let index = (share * sorted.len() as f64) as usize;
    sorted.get(index).or(sorted.last()).copied().unwrap_or(0.0)
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Blocks(arguments) => blocks::run(arguments),
        What::Commit(arguments) => commit::run(arguments),
        What::Memory(arguments) => memory::run(arguments),
        What::Rays(arguments) => rays::run(arguments),
        What::Speed(arguments) => speed::run(arguments),
        What::Stream(arguments) => stream::run(arguments),
        What::Update(arguments) => update::run(arguments),
    }
}
