//! A failed call: a status for C, an exception class for Java, and one line of text for both.

use std::any::Any;
use std::borrow::Cow;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::error::Error;

/// Result of every call.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Success.
    Ok = 0,
    /// A number, size or text is out of range.
    BadArgument = 1,
    /// A pointer or reference is null where a value is required.
    Null = 2,
    /// The handle was closed or never existed.
    Closed = 3,
    /// The handle is of another kind.
    WrongKind = 4,
    /// Another thread is using the handle; audio calls do not wait.
    Busy = 5,
    /// A file cannot be read.
    File = 6,
    /// The content of a file or mesh is invalid.
    Format = 7,
    /// The source was removed or never added.
    StaleSource = 8,
    /// The call is not possible in the engine's present state.
    State = 9,
    /// Too many handles are open.
    Full = 10,
    /// A defect of the library was caught. The handle accepts nothing but foresound_close from now on.
    Panic = 11,
    /// The instance was removed or never added.
    StaleInstance = 12,
    /// The caller's header is of another major version than the library.
    Version = 13,
    /// The call was cancelled.
    Cancelled = 14,
}

/// A failed call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CallError {
    /// The kind of failure.
    pub status: Status,
    /// One line: the cause and the remedy.
    pub message: Cow<'static, str>,
}

impl CallError {
    /// An error with a static message: no allocation.
    pub const fn fixed(status: Status, message: &'static str) -> Self {
        Self {
            status,
            message: Cow::Borrowed(message),
        }
    }

    /// An error with a formatted message.
    pub fn new(status: Status, message: impl Into<String>) -> Self {
        Self {
            status,
            message: Cow::Owned(message.into()),
        }
    }

    /// [`Status::BadArgument`].
    pub fn bad(message: impl Into<String>) -> Self {
        Self::new(Status::BadArgument, message)
    }

    /// [`Status::Null`] for an argument.
    pub fn null(name: &str) -> Self {
        Self::new(Status::Null, format!("{name} is null; pass a value"))
    }
}

impl std::fmt::Display for CallError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for CallError {}

impl From<Error> for CallError {
    fn from(error: Error) -> Self {
        let status = match error {
            Error::File { .. } => Status::File,
            Error::Format { .. } | Error::Mesh { .. } => Status::Format,
            Error::Setting { .. } => Status::BadArgument,
            Error::StaleSource { .. } => Status::StaleSource,
            Error::StaleInstance { .. } => Status::StaleInstance,
            Error::Engine { .. } => Status::State,
            Error::Cancelled => Status::Cancelled,
        };
        Self::new(status, error.to_string())
    }
}

/// The error for a caught panic, with the panic's message.
pub fn panic_error(payload: Box<dyn Any + Send>) -> CallError {
    let message = match payload.downcast::<&'static str>() {
        Ok(text) => (*text).to_owned(),
        Err(payload) => match payload.downcast::<String>() {
            Ok(text) => *text,
            Err(payload) => {
                // Dropping a payload of unknown type might panic again.
                std::mem::forget(payload);
                "no message".to_owned()
            }
        },
    };
    let text = format!("the library panicked: {message}; close the handle and report this");
    CallError::new(Status::Panic, text)
}

/// Runs a call and turns a panic into an error.
///
/// # Errors
/// The call's, or [`Status::Panic`].
pub fn catch_panic<T>(call: impl FnOnce() -> Result<T, CallError>) -> Result<T, CallError> {
    // State that a panic leaves inconsistent is behind a handle, which the panic disables.
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|payload| Err(panic_error(payload)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panics_message_is_kept() {
        let error = catch_panic::<()>(|| panic!("seven {}", 7)).expect_err("panics");
        assert_eq!(error.status, Status::Panic);
        assert!(error.message.contains("seven 7"), "{error}");
        let error = catch_panic::<()>(|| panic!("plain")).expect_err("panics");
        assert!(error.message.contains("plain"), "{error}");
    }
}
