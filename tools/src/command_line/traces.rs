//! Traces of a run in a file for Perfetto.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use foresound::runtime::TraceLog;
use foresound::{Error, Result};

/// Writes a log and reports lost spans on standard error.
pub(crate) fn write_trace(file: &Path, log: &TraceLog) -> Result<()> {
    let failed = |error| Error::file(file, error, "give a file in a folder that is there");
    let mut out = BufWriter::new(File::create(file).map_err(failed)?);
    log.write_json(&mut out)
        .and_then(|()| out.flush())
        .map_err(failed)?;
    if log.lost() > 0 {
        eprintln!("note: {} spans were lost", log.lost());
    }
    Ok(())
}
