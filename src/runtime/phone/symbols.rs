//! Functions of the system, looked up by name.
//!
//! `APerformanceHint_*` needs API 33, `AThermal_*` API 30 and 31; the library supports 26 and cannot link them. An
//! incomplete group is not used. Signatures: the platform's frozen `performance_hint.h` and `thermal.h`.
//!
//! Unsafe: a name does not determine a function's type.

use std::ffi::{CStr, c_int, c_void};
use std::mem::transmute;
use std::sync::OnceLock;

/// The system's opaque pointers.
pub type Handle = *mut c_void;

/// Returns the address of a function by name, or null.
pub type Lookup<'a> = &'a mut dyn FnMut(&CStr) -> Handle;

type Acquire = unsafe extern "C" fn() -> Handle;
type Release = unsafe extern "C" fn(Handle);
type Status = unsafe extern "C" fn(Handle) -> c_int;
type Headroom = unsafe extern "C" fn(Handle, c_int) -> f32;
type Create = unsafe extern "C" fn(Handle, *const i32, usize, i64) -> Handle;
type Duration = unsafe extern "C" fn(Handle, i64) -> c_int;

/// Thermal functions (API 30; headroom 31).
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

/// Functions that the system has.
#[derive(Debug, Clone, Copy, Default)]
pub struct Symbols {
    /// Thermal state.
    pub thermal: Option<ThermalSymbols>,
    /// Performance hints.
    pub hints: Option<HintSymbols>,
}

/// The function at an address; null is `None`.
macro_rules! function {
    ($lookup:expr, $name:literal, $type:ty) => {{
        let address = $lookup($name);
        if address.is_null() {
            None
        } else {
            // SAFETY: not null; the caller guarantees a function of this name and of the frozen header's type.
            Some(unsafe { transmute::<Handle, $type>(address) })
        }
    }};
}

impl Symbols {
    /// Looks up all functions.
    ///
    /// # Safety
    /// `lookup` returns null or a function of the type in Android's headers, valid forever.
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

    /// The functions of this system, looked up once; none except on Android.
    pub fn of_this_system() -> &'static Self {
        static FOUND: OnceLock<Symbols> = OnceLock::new();
        FOUND.get_or_init(|| {
            let mut lookup = system::lookup();
            // SAFETY: functions of the system library, which is never closed.
            unsafe { Self::found_by(&mut lookup) }
        })
    }
}

#[cfg(target_os = "android")]
mod system {
    use super::Handle;
    use std::ffi::CStr;

    /// Looks up names in the NDK's library.
    pub(super) fn lookup() -> impl FnMut(&CStr) -> Handle {
        // SAFETY: a zero-terminated name; the library is part of the system.
        let library = unsafe { libc::dlopen(c"libandroid.so".as_ptr(), libc::RTLD_NOW) };
        move |name| {
            if library.is_null() {
                return std::ptr::null_mut();
            }
            // SAFETY: an open library and a zero-terminated name.
            unsafe { libc::dlsym(library, name.as_ptr()) }
        }
    }
}

#[cfg(not(target_os = "android"))]
mod system {
    use super::Handle;
    use std::ffi::CStr;

    /// Finds nothing.
    pub(super) fn lookup() -> impl FnMut(&CStr) -> Handle {
        |_| std::ptr::null_mut()
    }
}
