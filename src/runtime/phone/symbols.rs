//! The system's functions, looked up by name.
//!
//! `APerformanceHint_*` came with API 33, `AThermal_*` with 30 and 31, and the library is for 26: linked by name it would
//! not load on older phones. A group that is not complete is not used. Signatures: the platform's `performance_hint.h` and
//! `thermal.h`, which are frozen.
//!
//! `unsafe` because a name says nothing of a function's type.

use std::ffi::{CStr, c_int, c_void};
use std::mem::transmute;
use std::sync::OnceLock;

/// The system's opaque pointers.
pub type Handle = *mut c_void;

/// Gives the address of a function by its name, or null.
pub type Lookup<'a> = &'a mut dyn FnMut(&CStr) -> Handle;

type Acquire = unsafe extern "C" fn() -> Handle;
type Release = unsafe extern "C" fn(Handle);
type Status = unsafe extern "C" fn(Handle) -> c_int;
type Headroom = unsafe extern "C" fn(Handle, c_int) -> f32;
type Create = unsafe extern "C" fn(Handle, *const i32, usize, i64) -> Handle;
type Duration = unsafe extern "C" fn(Handle, i64) -> c_int;

/// Heat (API 30; the headroom 31).
#[derive(Debug, Clone, Copy)]
pub struct ThermalSymbols {
    /// `AThermal_acquireManager`.
    pub acquire: Acquire,
    /// `AThermal_releaseManager`.
    pub release: Release,
    /// `AThermal_getCurrentThermalStatus`.
    pub status: Status,
    /// `AThermal_getThermalHeadroom`.
    pub headroom: Option<Headroom>,
}

/// Performance hints (API 33).
#[derive(Debug, Clone, Copy)]
pub struct HintSymbols {
    /// `APerformanceHint_getManager`; never released.
    pub manager: Acquire,
    /// `APerformanceHint_createSession`.
    pub create: Create,
    /// `APerformanceHint_updateTargetWorkDuration`.
    pub target: Duration,
    /// `APerformanceHint_reportActualWorkDuration`.
    pub report: Duration,
    /// `APerformanceHint_closeSession`.
    pub close: Release,
}

/// What this system has.
#[derive(Debug, Clone, Copy, Default)]
pub struct Symbols {
    /// Heat.
    pub thermal: Option<ThermalSymbols>,
    /// Performance hints.
    pub hints: Option<HintSymbols>,
}

/// A function's address as a function, or nothing from the group.
macro_rules! function {
    ($lookup:expr, $name:literal, $type:ty) => {{
        let address = $lookup($name);
        if address.is_null() {
            None
        } else {
            // SAFETY: not null, and the function of this name, whose type the frozen header says: the caller's word.
            Some(unsafe { transmute::<Handle, $type>(address) })
        }
    }};
}

impl Symbols {
    /// Looks all of them up.
    ///
    /// # Safety
    /// What `lookup` gives for a name is null or a function of the type that Android's headers give it, for ever.
    pub unsafe fn found_by(lookup: Lookup<'_>) -> Self {
        let mut thermal = || {
            Some(ThermalSymbols {
                acquire: function!(lookup, c"AThermal_acquireManager", Acquire)?,
                release: function!(lookup, c"AThermal_releaseManager", Release)?,
                status: function!(lookup, c"AThermal_getCurrentThermalStatus", Status)?,
                headroom: function!(lookup, c"AThermal_getThermalHeadroom", Headroom),
            })
        };
        let thermal = thermal();
        let mut hints = || {
            Some(HintSymbols {
                manager: function!(lookup, c"APerformanceHint_getManager", Acquire)?,
                create: function!(lookup, c"APerformanceHint_createSession", Create)?,
                target: function!(
                    lookup,
                    c"APerformanceHint_updateTargetWorkDuration",
                    Duration
                )?,
                report: function!(
                    lookup,
                    c"APerformanceHint_reportActualWorkDuration",
                    Duration
                )?,
                close: function!(lookup, c"APerformanceHint_closeSession", Release)?,
            })
        };
        let hints = hints();
        Self { thermal, hints }
    }

    /// Those of this system, looked up once; none but on Android.
    pub fn of_this_system() -> &'static Self {
        static FOUND: OnceLock<Symbols> = OnceLock::new();
        FOUND.get_or_init(|| {
            let mut lookup = system::lookup();
            // SAFETY: they are the functions of the system's own library, which is never closed.
            unsafe { Self::found_by(&mut lookup) }
        })
    }
}

#[cfg(target_os = "android")]
mod system {
    use super::Handle;
    use std::ffi::CStr;

    /// Looks a name up in the NDK's library, which every Android has.
    pub(super) fn lookup() -> impl FnMut(&CStr) -> Handle {
        // SAFETY: takes a name that ends with a zero; the library is the system's and loaded already.
        let library = unsafe { libc::dlopen(c"libandroid.so".as_ptr(), libc::RTLD_NOW) };
        move |name| {
            if library.is_null() {
                return std::ptr::null_mut();
            }
            // SAFETY: an open library, and a name that ends with a zero.
            unsafe { libc::dlsym(library, name.as_ptr()) }
        }
    }
}

#[cfg(not(target_os = "android"))]
mod system {
    use super::Handle;
    use std::ffi::CStr;

    /// Nothing to be found.
    pub(super) fn lookup() -> impl FnMut(&CStr) -> Handle {
        |_| std::ptr::null_mut()
    }
}
