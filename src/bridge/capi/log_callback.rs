//! The caller's function for the library's messages.

use std::ffi::{CString, c_char, c_void};

use super::answer;
use crate::bridge::enumeration::LogLevel;
use crate::bridge::error::Status;
use crate::bridge::logging::{self, Receiver};

/// Receives a message: one line in UTF-8, valid during the call. `user` is the pointer passed to foresound_set_log.
pub type LogCallback =
    Option<unsafe extern "C" fn(user: *mut c_void, level: LogLevel, message: *const c_char)>;

/// A caller's pointer, which only the caller's function uses.
struct User(*mut c_void);

// SAFETY: the caller's function may be called from any control thread, by the caller's obligation.
unsafe impl Send for User {}
// SAFETY: the same, also from several at once.
unsafe impl Sync for User {}

impl User {
    fn pointer(&self) -> *mut c_void {
        self.0
    }
}

/// Passes the library's messages up to a level to a function, for the whole process; null: none, but for the system's log on
/// Android. The function is called from any thread but the audio thread, from several at once, until this function is called
/// again and has returned; it must return and must not call foresound_set_log. FORESOUND_STATUS_STATE in a Rust program with a
/// logger of its own. Control thread.
///
/// # Safety
/// Pointers are null or valid as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn foresound_set_log(
    level: LogLevel,
    callback: LogCallback,
    user: *mut c_void,
) -> Status {
    answer(|| {
        let receiver = callback.map(|callback| -> Receiver {
            let user = User(user);
            Box::new(move |level, text| {
                let text = CString::new(text.replace('\0', "?")).unwrap_or_default();
                // SAFETY: a function of this signature; the rest is the caller's obligation.
                unsafe { callback(user.pointer(), level, text.as_ptr()) };
            })
        });
        logging::set_receiver(level, receiver)
    })
}
