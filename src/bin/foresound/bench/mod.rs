//! `bench`: speeds on this machine. A speed is worth something only beside another of the same run.

mod dump;
mod moving;
mod own_rays;
mod ray_sets;
mod rays;
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
    /// Rays a second on one thread, over three fixed sets of rays.
    Rays(rays::Arguments),
    /// Propagation updates on one thread and two, beside their own rays.
    Speed(speed::Arguments),
    /// A fixed number of propagation updates, for counters of instructions.
    Update(update::Arguments),
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Rays(arguments) => rays::run(arguments),
        What::Speed(arguments) => speed::run(arguments),
        What::Update(arguments) => update::run(arguments),
    }
}
