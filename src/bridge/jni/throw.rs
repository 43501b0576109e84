//! Faults as Java exceptions, all of the platform's own classes, so that nothing has to be kept from a shrinker.

use std::any::Any;

use ::jni::errors::{Error, ErrorPolicy, Result};
use ::jni::strings::{JNIStr, JNIString};
use ::jni::{Env, jni_str};

use crate::bridge::fault::{Fault, Status, panic_fault};

/// Throws what went wrong.
pub(super) struct Throw;

/// The class for a fault.
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
        Status::Ok | Status::Closed | Status::Busy | Status::State | Status::Full => {
            jni_str!("java/lang/IllegalStateException")
        }
        Status::Panic => jni_str!("java/lang/RuntimeException"),
    }
}

fn throw<T: Default>(env: &mut Env<'_>, fault: &Fault) -> Result<T> {
    // One that Java has thrown already says more.
    if env.exception_check() {
        return Ok(T::default());
    }
    match env.throw_new(class_of(fault.status), JNIString::new(&*fault.text)) {
        // That is how throwing succeeds.
        Err(Error::JavaException) | Ok(()) => Ok(T::default()),
        Err(error) => Err(error),
    }
}

impl<T: Default> ErrorPolicy<T, Fault> for Throw {
    type Captures<'unowned_env_local: 'native_method, 'native_method> = ();

    fn on_error<'unowned_env_local: 'native_method, 'native_method>(
        env: &mut Env<'unowned_env_local>,
        (): &mut (),
        fault: Fault,
    ) -> Result<T> {
        throw(env, &fault)
    }

    fn on_panic<'unowned_env_local: 'native_method, 'native_method>(
        env: &mut Env<'unowned_env_local>,
        (): &mut (),
        payload: Box<dyn Any + Send>,
    ) -> Result<T> {
        throw(env, &panic_fault(payload))
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        let status = match error {
            Error::NullPtr(_) => Status::Null,
            _ => Status::State,
        };
        Self::new(status, format!("Java: {error}"))
    }
}
