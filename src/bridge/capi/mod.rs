//! The C interface: `include/foresound.h`.
//!
//! Most functions are made from the table of [`super::interface`]; those with arrays in the caller's memory are in `arrays` and
//! `buses`. `unsafe` because C passes pointers: null and alignment are checked, validity is the caller's obligation.

mod arrays;
mod buses;
mod log_callback;
mod memory;

use std::cell::RefCell;
use std::ffi::{CString, c_char};

pub use arrays::*;
pub use buses::*;
pub use log_callback::*;

use super::engine::{self, ENGINES, MaterialOptions, PropagationOptions, SourceOptions};
use super::enumeration::{Layout, Predictor, Schedule};
use super::error::{CallError, Status, catch_panic};
use super::health::{BudgetOptions, EngineHealth};
use super::interface::{
    Bytes, Choice, Count, Flag, Handle, HandleOut, Id, In, Kind, OptionalBytes, OptionalText, Out,
    PoseIn, Real, Samples, Size, Text, result, shared_functions,
};
use super::numbers::SourceNumbers;
use super::playback::{PlayOptions, Playback};
use super::pose::source_id;
use super::scenes::{SceneInfo, SceneOptions};
use super::sound::OutputInfo;
use super::{EngineStatistics, Options, clip, instances, playback, progress, scenes, sound};
use memory::{FromC, Returned, store};

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Runs a control call and keeps its error's message.
fn answer(call: impl FnOnce() -> Result<(), CallError>) -> Status {
    match catch_panic(call) {
        Ok(()) => Status::Ok,
        Err(error) => {
            // File names may contain zeros, which would end the text.
            let text = error.message.replace('\0', "?");
            let text = CString::new(text).unwrap_or_default();
            // Fails at the end of a thread, after its variables.
            let _ = LAST_ERROR.try_with(|last| last.replace(text));
            error.status
        }
    }
}

/// Runs a call of the audio thread, whose errors leave no message.
fn audio_answer(call: impl FnOnce() -> Result<(), CallError>) -> Status {
    catch_panic(call).map_or_else(|error| error.status, |()| Status::Ok)
}

/// Version of this interface: 65,536 x major + 256 x minor + patch. Another major number than
/// FORESOUND_API_VERSION's is incompatible, and foresound_engine_create refuses it. Any thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_version() -> u32 {
    super::VERSION
}

/// Message of this thread's last failed call: one line in UTF-8, the cause and the remedy. Valid until the thread's next
/// failure; empty before the first. Never null; not to be freed. Functions of the audio thread leave no
/// message. Any thread.
#[unsafe(no_mangle)]
pub extern "C" fn foresound_last_error() -> *const c_char {
    LAST_ERROR
        .try_with(|last| last.borrow().as_ptr())
        .unwrap_or(c"".as_ptr())
}

macro_rules! c_function {
    (safe $(#[$attribute:meta])* fn $($rest:tt)*) => { $(#[$attribute])* pub extern "C" fn $($rest)* };
    (unsafe $(#[$attribute:meta])* fn $($rest:tt)*) => {
        $(#[$attribute])*
        ///
        /// # Safety
        /// Pointers are null or valid as the header says.
        pub unsafe extern "C" fn $($rest)*
    };
}

macro_rules! c_functions {
    ($($(#[doc = $doc:literal])* $safety:ident fn $name:ident(
        $($parameter:ident $([$count:ident])?: $kind:ty),*
    ) $(-> $result:ident: $result_kind:ty)? $body:block)*) => {$(
        c_function! {
            $safety
            $(#[doc = $doc])*
            #[unsafe(no_mangle)]
            fn $name(
                $($parameter: <$kind as Kind>::C, $($count: usize,)?)*
                $($result: *mut <$result_kind as Kind>::C)?
            ) -> Status {
                answer(|| {
                    // SAFETY: the caller's obligation.
                    $(unsafe { <$kind as FromC>::clear(stringify!($parameter), ($parameter $(, $count)?)) };)*
                    // SAFETY: the caller's obligation.
                    $(unsafe { store(stringify!($result), $result, <$result_kind as Returned>::NONE) }?;)?
                    $(
                        // SAFETY: the caller's obligation.
                        let $parameter = unsafe {
                            <$kind as FromC>::from_c(stringify!($parameter), ($parameter $(, $count)?))
                        }?;
                    )*
                    c_result!($body $($result)?)
                })
            }
        }
    )*};
}

macro_rules! c_result {
    ($body:block) => {
        result($body)
    };
    ($body:block $result:ident) => {{
        let value = result($body)?;
        // SAFETY: the caller's obligation.
        unsafe { store(stringify!($result), $result, value) }
    }};
}

shared_functions!(c_functions);
