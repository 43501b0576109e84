//! Traces of a run in a file for Perfetto.

use std::path::Path;

use foresound::Result;
use foresound::output::WholeFile;
use foresound::runtime::TraceLog;

/// Writes a log and reports lost spans on standard error.
pub(crate) fn write_trace(file: &Path, log: &TraceLog) -> Result<()> {
    WholeFile::write(file, |out| log.write_json(out))?;
    if log.lost() > 0 {
        eprintln!("note: {} spans were lost", log.lost());
    }
    Ok(())
}
