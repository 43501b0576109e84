//! How much the program says on standard error: errors only (`--quiet`), notes and progress, or what it does (`--verbose`).

use std::fmt::Arguments;
use std::sync::atomic::{AtomicU8, Ordering};

use log::{LevelFilter, Log, Metadata, Record};

const QUIET: u8 = 0;
const NOTES: u8 = 1;
const VERBOSE: u8 = 2;

static VERBOSITY: AtomicU8 = AtomicU8::new(NOTES);

/// The library's messages as notes.
struct Messages;

impl Log for Messages {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &Record<'_>) {
        eprintln!(
            "{}: {}",
            record.level().as_str().to_lowercase(),
            record.args()
        );
    }

    fn flush(&self) {}
}

/// Sets it, once, at the start.
pub(crate) fn set(quiet: bool, verbose: bool) {
    let (verbosity, messages) = match (quiet, verbose) {
        (true, _) => (QUIET, LevelFilter::Off),
        (false, true) => (VERBOSE, LevelFilter::Debug),
        (false, false) => (NOTES, LevelFilter::Warn),
    };
    VERBOSITY.store(verbosity, Ordering::Relaxed);
    // The only logger of the program.
    if log::set_logger(&Messages).is_ok() {
        log::set_max_level(messages);
    }
}

/// Whether only errors are printed.
pub(crate) fn is_quiet() -> bool {
    VERBOSITY.load(Ordering::Relaxed) == QUIET
}

/// Says what is being done, with `--verbose`.
pub(crate) fn told(text: Arguments<'_>) {
    if VERBOSITY.load(Ordering::Relaxed) == VERBOSE {
        eprintln!("{text}");
    }
}
