//! `completions` and `manual`: what a package installs beside the program, made from the arguments' descriptions.

use std::path::PathBuf;

use clap::CommandFactory;
use clap_complete::Shell;
use clap_mangen::Man;
use foresound::{Error, Result};

use crate::Cli;

#[derive(clap::Args)]
pub(crate) struct CompletionArguments {
    /// The shell.
    shell: Shell,
}

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Folder for the pages of the program and of each command.
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
}

/// A command of another build.
#[cfg(not(feature = "play"))]
#[derive(clap::Args)]
pub(crate) struct Unavailable {
    /// Its arguments.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    _arguments: Vec<String>,
}

#[cfg(not(feature = "play"))]
impl Unavailable {
    /// What to do instead.
    pub(crate) fn error(&self) -> Error {
        Error::setting(
            "play",
            "this program was built without sound devices",
            "build it with `--features play`: `cargo install --path tools --features play`",
        )
    }
}

/// Prints a shell's completions.
pub(crate) fn complete(arguments: &CompletionArguments) {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "foresound", &mut text);
    outln!("{}", String::from_utf8_lossy(&text).trim_end());
}

/// Prints the manual page, or writes all into a folder.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    const ADVICE: &str = "name a folder that may be written to";
    let Some(folder) = &arguments.folder else {
        let mut page = Vec::new();
        // Into memory, which takes everything.
        let _ = Man::new(Cli::command()).render(&mut page);
        outln!("{}", String::from_utf8_lossy(&page).trim_end());
        return Ok(());
    };
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), folder))
        .map_err(|error| Error::file(folder, error, ADVICE))
}
