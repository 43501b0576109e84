//! Temporary files are removed when a signal ends the program.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{MutexGuard, PoisonError};

use foresound::output::watch_temporary_files;

/// Temporary files that are there.
#[expect(
    clippy::disallowed_types,
    reason = "files are written on the command line's own threads"
)]
static TEMPORARY: std::sync::Mutex<BTreeSet<PathBuf>> = std::sync::Mutex::new(BTreeSet::new());

fn temporary() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}

fn watch(path: &Path, is_there: bool) {
    if is_there {
        temporary().insert(path.to_path_buf());
    } else {
        temporary().remove(path);
    }
}

/// Removes temporary files at once; no others can be made afterwards.
pub(crate) fn remove_temporary_files() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    let files = temporary();
    for file in &*files {
        // The program ends; nobody is left to hear of a failure.
        let _ = std::fs::remove_file(file);
    }
    files
}

/// Starts a thread that waits for SIGHUP, SIGINT and SIGTERM, removes temporary files and ends the program by the signal.
/// Signals that the program was started to ignore, as by `nohup`, stay ignored.
#[cfg(unix)]
pub(crate) fn remove_temporary_files_on_signals() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    watch_temporary_files(watch);
    let ignored = ignored_signals();
    let heeded = [SIGHUP, SIGINT, SIGTERM].map(|signal| (signal, ignored >> (signal - 1) & 1));
    let heeded = heeded.iter().filter(|(_, ignored)| *ignored == 0);
    // Without a thread the program works, and leaves a file behind.
    let Ok(mut signals) = Signals::new(heeded.map(|(signal, _)| signal)) else {
        return;
    };
    let wait = move || {
        if let Some(signal) = signals.forever().next() {
            let _files = remove_temporary_files();
            let _ = emulate_default_handler(signal);
        }
    };
    let _ = std::thread::Builder::new()
        .name("foresound-signals".into())
        .stack_size(1 << 17)
        .spawn(wait);
}

#[cfg(not(unix))]
pub(crate) fn remove_temporary_files_on_signals() {
    watch_temporary_files(watch);
}

/// The signals that the program ignores, one a bit from the lowest; none where the system does not list them.
#[cfg(unix)]
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0)
}
