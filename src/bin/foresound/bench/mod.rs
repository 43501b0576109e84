//! `bench`: speeds on this machine. A speed is worth something only beside another of the same run.

mod own_rays;
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
    /// Propagation updates on one thread and two, beside their own rays.
    Speed(speed::Arguments),
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        What::Speed(arguments) => speed::run(arguments),
    }
}
