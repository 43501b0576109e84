//! The C interface: `include/foresound.h`, made from the files of this folder.
//!
//! `unsafe` because C gives pointers: each is checked for null and alignment here, that it points to what the header says
//! is its caller's word. Nothing else in the bridge trusts anybody.

pub mod engine;
pub mod instance;
mod memory;
pub mod scene;
pub mod sound;
pub mod source;

use std::cell::RefCell;
use std::ffi::{CString, c_char};

use super::fault::{Fault, Status, guarded};

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// Runs a control call and keeps the text of its error.
fn answer(call: impl FnOnce() -> Result<(), Fault>) -> Status {
    match guarded(call) {
        Ok(()) => Status::Ok,
        Err(fault) => {
            // A text with a zero in it would end there; none of ours has one, but names of files may.
            let text = fault.text.replace('\0', "?");
            let text = CString::new(text).unwrap_or_default();
            // No text at the very end of a thread, when its variables are gone.
            let _ = LAST.try_with(|last| last.replace(text));
            fault.status
        }
    }
}

/// Version of this interface: 65,536 x major + 256 x minor + patch. Another major number than
/// FORESOUND_API_VERSION's is another interface. Any thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_version() -> u32 {
    super::VERSION
}

/// What the last call on this thread that failed had to say: one line in UTF-8, what is wrong and what to do.
/// Stays until the next failure on the same thread; empty before the first. Never null, not to be freed.
/// The audio calls foresound_render and foresound_stream_write leave no text.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_last_error() -> *const c_char {
    LAST.try_with(|last| last.borrow().as_ptr())
        .unwrap_or(c"".as_ptr())
}

/// Closes any handle and ends what it stands for. An engine waits for the update under way, an output for its
/// threads. Any thread but the audio thread; waits for a call that is using the handle.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_close(handle: u64) -> Status {
    answer(|| super::close(handle))
}
