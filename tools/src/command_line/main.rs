//! The command line: `foresound demo`, `render`, `rir`, `inspect`, `commit`, `materials`, `hrtf`, `validate`, `evaluate`, `bench`,
//! `soak`, `scenes`, `view`, `completions`, `manual`, and with the feature `play` also `play`.
//!
//! Results go to standard output, everything else to standard error. A wrong argument or file gives one line with advice
//! and exit code 2; a violated law gives exit code 1.

/// Prints a line of results. If standard output is closed or full, the program ends with exit code 2.
macro_rules! outln {
    ($($text:tt)*) => {
        $crate::printed::line(format_args!($($text)*))
    };
}

mod assets;
mod bench;
mod commit;
mod counting;
mod demo;
mod engine_walk;
mod evaluate;
mod hrtf;
mod hrtf_file;
mod inputs;
mod inspect;
mod laid_out;
mod manual;
mod materials;
mod memory_use;
mod placement;
#[cfg(feature = "play")]
mod play;
mod printed;
mod processor_shares;
mod progress;
mod render;
mod restless;
mod rir;
mod scenes;
mod session;
mod signals;
mod soak;
mod surfaces_file;
mod traces;
mod validate;
mod verbosity;
mod view;
mod walker;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use foresound::Result;

/// Counts allocations for `soak`.
#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;

/// Real-time ray-traced sound: renders, measures and inspects on a host.
#[derive(Parser)]
#[command(name = "foresound", version, about)]
pub(crate) struct Cli {
    /// Print errors only, no notes and no progress.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say what is being done.
    #[arg(short, long, global = true)]
    verbose: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Renders a walk through the concert hall, or another scene, with four voices, by both schedules (the default).
    Demo(demo::Arguments),
    /// Renders your scene, sounds and listener to a WAV file: binaural, for loudspeakers, or Ambisonics.
    Render(render::Arguments),
    /// Writes an impulse response and its room-acoustic parameters.
    Rir(rir::Arguments),
    /// Reports on a mesh: triangles, surfaces, materials, edges, bounds.
    Inspect(inspect::Arguments),
    /// Prepares a scene and saves it, to be loaded in a fraction of the time.
    Commit(commit::Arguments),
    /// Lists the built-in materials.
    Materials(materials::Arguments),
    /// Converts a SOFA file to an HRTF set, and states how far a set is from its measurement.
    Hrtf(hrtf::Arguments),
    /// Checks propagation against closed forms and standards.
    Validate(validate::Arguments),
    /// Runs the engine in real time into a null device while its state changes at random.
    Soak(soak::Arguments),
    /// Plays a scene live on the sound device; the keyboard moves the listener.
    #[cfg(feature = "play")]
    Play(play::Arguments),
    /// Shows a scene live in the browser: walk, drag sources and doors, see paths, hear it.
    View(view::Arguments),
    /// Is not in this build.
    #[cfg(not(feature = "play"))]
    #[command(hide = true)]
    Play(manual::Unavailable),
    /// Scores asynchronous rendering against synchronous: the paper's Tables 5 and 6, with a report.
    Evaluate(evaluate::Arguments),
    /// Writes the benchmark scenes.
    Scenes(scenes::Arguments),
    /// Measures speed on this machine.
    Bench(bench::Arguments),
    /// Prints completions for a shell.
    Completions(manual::CompletionArguments),
    /// Prints the manual page, or writes one for each command.
    Manual(manual::Arguments),
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if !error.use_stderr() => {
            // Help and version are results.
            outln!("{}", error.to_string().trim_end());
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            eprintln!("{}; see `foresound --help`", one_line(&error.to_string()));
            return ExitCode::from(2);
        }
    };
    verbosity::set(cli.quiet, cli.verbose);
    signals::remove_temporary_files_on_signals();
    match run(cli) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(cli: Cli) -> Result<ExitCode> {
    match cli
        .command
        .unwrap_or(Command::Demo(demo::Arguments::default()))
    {
        Command::Demo(arguments) => demo::run(&arguments)?,
        Command::Render(arguments) => render::run(&arguments)?,
        Command::Rir(arguments) => rir::run(&arguments)?,
        Command::Inspect(arguments) => inspect::run(&arguments)?,
        Command::Commit(arguments) => commit::run(&arguments)?,
        Command::Validate(arguments) => return validate::run(&arguments),
        Command::Soak(arguments) => soak::run(&arguments)?,
        #[cfg(feature = "play")]
        Command::Play(arguments) => play::run(&arguments)?,
        Command::View(arguments) => view::run(&arguments)?,
        #[cfg(not(feature = "play"))]
        Command::Play(arguments) => return Err(arguments.error()),
        Command::Materials(arguments) => materials::run(&arguments)?,
        Command::Hrtf(arguments) => hrtf::run(&arguments)?,
        Command::Completions(arguments) => manual::complete(&arguments),
        Command::Manual(arguments) => manual::run(&arguments)?,
        Command::Evaluate(arguments) => evaluate::run(&arguments)?,
        Command::Scenes(arguments) => scenes::run(&arguments)?,
        Command::Bench(arguments) => bench::run(&arguments)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The text of an argument error before its usage, on one line.
fn one_line(text: &str) -> String {
    let saying = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:"));
    let words: Vec<&str> = saying.filter(|line| !line.is_empty()).collect();
    words.join(" ")
}
