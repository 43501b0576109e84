//! Progress of a scene's construction, which another thread reads and may cancel.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::error::CallError;
use super::handles::{HandleTable, Kind};

/// Progress of one construction.
#[derive(Debug, Default)]
pub struct Progress {
    done_bits: AtomicU32,
    cancelled: AtomicBool,
}

/// Progresses.
pub static PROGRESSES: HandleTable<Arc<Progress>> = HandleTable::new(Kind::Progress);

/// Adds a progress.
///
/// # Errors
/// Those of [`HandleTable::insert`].
pub fn create() -> Result<u64, CallError> {
    PROGRESSES.insert(Arc::default())
}

/// The share that is done, 0 to 1. Any control thread.
///
/// # Errors
/// Those of [`HandleTable::with`].
pub fn read(progress: u64) -> Result<f32, CallError> {
    PROGRESSES.with(progress, |progress| {
        Ok(f32::from_bits(progress.done_bits.load(Ordering::Relaxed)))
    })
}

/// Cancels the construction that runs with this progress, or any later one. Any control thread.
///
/// # Errors
/// Those of [`HandleTable::with`].
pub fn cancel(progress: u64) -> Result<(), CallError> {
    PROGRESSES.with(progress, |progress| {
        progress.cancelled.store(true, Ordering::Relaxed);
        Ok(())
    })
}

/// What a construction reports to: the progress of a handle, or nothing for 0.
///
/// # Errors
/// Those of [`HandleTable::with`].
pub fn observer(progress: u64) -> Result<impl FnMut(f32) -> bool, CallError> {
    let progress = match progress {
        0 => None,
        handle => Some(PROGRESSES.with(handle, |progress| Ok(Arc::clone(progress)))?),
    };
    Ok(move |done: f32| {
        progress.as_ref().is_none_or(|progress| {
            progress.done_bits.store(done.to_bits(), Ordering::Relaxed);
            !progress.cancelled.load(Ordering::Relaxed)
        })
    })
}
