//! `scenes`: writes the benchmark scenes as committed.

use std::path::PathBuf;

use foresound::Result;
use foresound::scene::procedural::{NAMES, by_name, write_files};

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Folder for the files.
    #[arg(long, default_value = "assets/scenes")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    for scene in NAMES.iter().filter_map(|name| by_name(name)) {
        write_files(&scene, &arguments.out)?;
        outln!("{}: {} triangles", scene.name, scene.mesh.triangles.len());
    }
    Ok(())
}
