//! What went wrong, as a number for C, an exception for Java, and a text for people.

use std::any::Any;
use std::borrow::Cow;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::error::Error;

/// Result of every call.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// A number, size or text that cannot be.
    BadArgument = 1,
    /// A null pointer or reference where there has to be something.
    Null = 2,
    /// A handle that was closed, or never was one.
    Closed = 3,
    /// A handle of something else.
    WrongKind = 4,
    /// Another thread is using the handle; sound calls do not wait.
    Busy = 5,
    /// A file that cannot be read.
    File = 6,
    /// A file or mesh whose content is wrong.
    Format = 7,
    /// A source that was removed or never added.
    StaleSource = 8,
    /// Not possible in the engine's present state.
    State = 9,
    /// Too many handles are open.
    Full = 10,
    /// A defect of the library was caught. The handle answers nothing but close from now on.
    Panic = 11,
    /// An instance that was removed or never added.
    StaleInstance = 12,
}

/// A failed call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Which kind.
    pub status: Status,
    /// One line: what is wrong and what to do.
    pub text: Cow<'static, str>,
}

impl Fault {
    /// With a text that is there already: allocates nothing.
    pub const fn fixed(status: Status, text: &'static str) -> Self {
        Self {
            status,
            text: Cow::Borrowed(text),
        }
    }

    /// With a text made for the occasion.
    pub fn new(status: Status, text: impl Into<String>) -> Self {
        Self {
            status,
            text: Cow::Owned(text.into()),
        }
    }

    /// Something that has to be there is null.
    pub fn null(name: &str) -> Self {
        Self::new(Status::Null, format!("{name} is null; give one"))
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for Fault {}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        let status = match error {
            Error::File { .. } => Status::File,
            Error::Format { .. } | Error::Mesh { .. } => Status::Format,
            Error::Setting { .. } => Status::BadArgument,
            Error::StaleSource { .. } => Status::StaleSource,
            Error::StaleInstance { .. } => Status::StaleInstance,
            Error::Engine { .. } => Status::State,
        };
        Self::new(status, error.to_string())
    }
}

/// What a panic said.
pub fn panic_fault(payload: Box<dyn Any + Send>) -> Fault {
    let said = match payload.downcast::<&'static str>() {
        Ok(text) => (*text).to_owned(),
        Err(payload) => match payload.downcast::<String>() {
            Ok(text) => *text,
            Err(payload) => {
                // Whatever it is, dropping it might panic again.
                std::mem::forget(payload);
                "no words".to_owned()
            }
        },
    };
    let text = format!("the library panicked: {said}; close the handle and report this");
    Fault::new(Status::Panic, text)
}

/// Runs a call and turns a panic into a fault.
pub fn guarded<T>(call: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
    // What a panic may have left half done stands behind handles, which are shut by it.
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|payload| Err(panic_fault(payload)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_keeps_its_words() {
        let fault = guarded::<()>(|| panic!("seven {}", 7)).expect_err("panics");
        assert_eq!(fault.status, Status::Panic);
        assert!(fault.text.contains("seven 7"), "{fault}");
        let fault = guarded::<()>(|| panic!("plain")).expect_err("panics");
        assert!(fault.text.contains("plain"), "{fault}");
    }
}
