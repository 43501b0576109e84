//! HRTF sets from files.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use foresound::generation::{Hrtf, Layout};
use foresound::{Error, Result};

/// Greatest size of a file.
const MAX_BYTES: u64 = 256 << 20;

/// The set of a file, or the built-in one; layouts without HRTF set have any.
pub(crate) fn load_hrtf(file: Option<&Path>, layout: Layout, rate_hz: u32) -> Result<Arc<Hrtf>> {
    let set = match (file, layout) {
        (Some(file), _) => Hrtf::read(&read(file)?, &file.to_string_lossy(), rate_hz)?,
        (None, Layout::Binaural) => Hrtf::builtin(rate_hz)?,
        (None, _) => Hrtf::omnidirectional(rate_hz)?,
    };
    Ok(Arc::new(set))
}

/// The content of a set's file.
pub(crate) fn read(file: &Path) -> Result<Vec<u8>> {
    let refused = |problem: String, advice: &str| Error::file(file, problem, advice);
    let unreadable = |error: std::io::Error| refused(error.to_string(), "give a readable file");
    let bytes = fs::metadata(file).map_err(unreadable)?.len();
    if bytes > MAX_BYTES {
        let problem = format!("{} MiB, more than {}", bytes >> 20, MAX_BYTES >> 20);
        return Err(refused(problem, "give an HRTF set of one head"));
    }
    fs::read(file).map_err(unreadable)
}
