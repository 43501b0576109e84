//! Errors as Java exceptions, all of the platform's classes: a shrinker needs no rules for them.

use std::any::Any;

use ::jni::errors::{Error, ErrorPolicy, Result};
use ::jni::strings::{JNIStr, JNIString};
use ::jni::{Env, jni_str};

use crate::bridge::error::{CallError, Status, panic_error};

/// Throws the error of a call.
pub(super) struct Throw;

/// The exception class for a status.
fn class_of(status: Status) -> &'static JNIStr {
    match status {
        Status::Null => jni_str!("java/lang/NullPointerException"),
        Status::BadArgument
        | Status::Format
        | Status::WrongKind
        | Status::StaleSource
        | Status::StaleInstance => {
            jni_str!("java/lang/IllegalArgumentException")
        }
        Status::File => jni_str!("java/io/IOException"),
        Status::Cancelled => jni_str!("java/util/concurrent/CancellationException"),
        Status::Ok
        | Status::Version
        | Status::Closed
        | Status::Busy
        | Status::State
        | Status::Full => {
            jni_str!("java/lang/IllegalStateException")
        }
        Status::Panic => jni_str!("java/lang/RuntimeException"),
    }
}

fn throw<T: Default>(env: &mut Env<'_>, error: &CallError) -> Result<T> {
    // A pending exception of Java is more specific.
    if env.exception_check() {
        return Ok(T::default());
    }
    match env.throw_new(class_of(error.status), JNIString::new(&*error.message)) {
        // The result of a successful throw.
        Err(Error::JavaException) | Ok(()) => Ok(T::default()),
        Err(error) => Err(error),
    }
}

impl<T: Default> ErrorPolicy<T, CallError> for Throw {
    type Captures<'unowned_env_local: 'native_method, 'native_method> = ();

    fn on_error<'unowned_env_local: 'native_method, 'native_method>(
        env: &mut Env<'unowned_env_local>,
        (): &mut (),
        error: CallError,
    ) -> Result<T> {
        throw(env, &error)
    }

    fn on_panic<'unowned_env_local: 'native_method, 'native_method>(
        env: &mut Env<'unowned_env_local>,
        (): &mut (),
        payload: Box<dyn Any + Send>,
    ) -> Result<T> {
        throw(env, &panic_error(payload))
    }
}

impl From<Error> for CallError {
    fn from(error: Error) -> Self {
        let status = match error {
            Error::NullPtr(_) => Status::Null,
            _ => Status::State,
        };
        Self::new(status, format!("Java: {error}"))
    }
}
