//! `bench`: speeds on this machine. A speed is worth something only beside another of the same run.

mod dump;
mod ray_sets;
mod rays;

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
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Rays(arguments) => rays::run(arguments),
    }
}
