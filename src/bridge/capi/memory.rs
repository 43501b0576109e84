//! Pointers from C: checked for null and alignment.

use std::ffi::{CStr, c_char};

use crate::bridge::error::{CallError, Status};
use crate::bridge::interface::{
    Bytes, Count, Flag, Handle, HandleOut, Id, In, Kind, OptionalBytes, OptionalText, Out, PoseIn,
    Real, Samples, Size, Text,
};
use crate::bridge::pose::Pose;
use crate::bridge::record::Record;

/// An error with a static message, for audio calls too, for a misaligned pointer.
pub(super) fn aligned<T>(pointer: *const T) -> Result<(), CallError> {
    const MISALIGNED: &str = "a pointer is not aligned; pass the address of a variable of its type";
    if pointer.is_aligned() {
        return Ok(());
    }
    Err(CallError::fixed(Status::BadArgument, MISALIGNED))
}

/// A pointer that may be read or written as a `T`.
fn check<T>(name: &str, pointer: *const T) -> Result<(), CallError> {
    if pointer.is_null() {
        return Err(CallError::null(name));
    }
    aligned(pointer)
}

/// A pointer to `count` values.
fn check_array<T>(name: &str, pointer: *const T, count: usize) -> Result<(), CallError> {
    check(name, pointer)?;
    if count > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(CallError::bad(format!(
            "{name}: {count} elements exceed memory"
        )));
    }
    Ok(())
}

/// An array; a null pointer with a count of zero is empty.
///
/// # Safety
/// A pointer that is not null is valid for reads of `count` values during `'a`.
pub(super) unsafe fn slice<'a, T>(
    name: &str,
    pointer: *const T,
    count: usize,
) -> Result<&'a [T], CallError> {
    if count == 0 {
        return Ok(&[]);
    }
    check_array(name, pointer, count)?;
    // SAFETY: not null, aligned, not larger than memory; the rest is the caller's obligation.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// As [`slice`], for writing.
///
/// # Safety
/// A pointer that is not null is valid for reads and writes of `count` values, exclusively, during `'a`.
pub(super) unsafe fn slice_mut<'a, T>(
    name: &str,
    pointer: *mut T,
    count: usize,
) -> Result<&'a mut [T], CallError> {
    if count == 0 {
        return Ok(&mut []);
    }
    check_array(name, pointer, count)?;
    // SAFETY: not null, aligned, not larger than memory; the rest is the caller's obligation.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, count) })
}

/// Writes a result.
///
/// # Safety
/// A pointer that is not null is valid for a write.
pub(super) unsafe fn store<T>(name: &str, pointer: *mut T, value: T) -> Result<(), CallError> {
    check(name, pointer)?;
    // SAFETY: not null, aligned; the rest is the caller's obligation.
    unsafe { pointer.write(value) };
    Ok(())
}

/// Reads a value.
///
/// # Safety
/// A pointer that is not null is valid for a read.
pub(super) unsafe fn value<T: Copy>(name: &str, pointer: *const T) -> Result<T, CallError> {
    check(name, pointer)?;
    // SAFETY: not null, aligned; the rest is the caller's obligation.
    Ok(unsafe { pointer.read() })
}

/// Reads a structure that begins with its size in bytes. Fields beyond that size keep their defaults; a null pointer means
/// all defaults.
///
/// # Safety
/// A pointer that is not null is valid for reads of as many bytes as its first `u32` says. `T` begins with that `u32` and
/// has numbers only.
pub(super) unsafe fn structure<T: Copy + Default>(
    name: &str,
    pointer: *const T,
) -> Result<T, CallError> {
    if pointer.is_null() {
        return Ok(T::default());
    }
    check(name, pointer)?;
    // SAFETY: not null, aligned; begins with its size by the caller's obligation.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    if !(size_of::<u32>()..=4096).contains(&size) {
        let text = format!("{name}: size {size} is invalid; begin with the defaults");
        return Err(CallError::bad(text));
    }
    let mut options = T::default();
    let known = size.min(size_of::<T>());
    // SAFETY: both have this many bytes and do not overlap; a `T` of numbers has no invalid bytes.
    unsafe {
        std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut options).cast(), known);
    }
    Ok(options)
}

/// A text in UTF-8; `None` for null.
///
/// # Safety
/// A pointer that is not null is valid for reads up to a zero byte during `'a`.
pub(super) unsafe fn text<'a>(
    name: &str,
    pointer: *const c_char,
) -> Result<Option<&'a str>, CallError> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: not null; the end is the caller's obligation.
    let bytes = unsafe { CStr::from_ptr(pointer) };
    let text = bytes.to_str();
    Ok(Some(text.map_err(|_| {
        CallError::bad(format!("{name} is not UTF-8"))
    })?))
}

/// A kind of parameter as it comes from C.
pub(super) trait FromC<'a> {
    /// The pointer or number; an array's also has the length.
    type Raw;
    /// The value in Rust.
    type Value;

    /// Checks and converts a parameter.
    ///
    /// # Safety
    /// Pointers are null or valid as the header says, during `'a`.
    unsafe fn from_c(name: &'static str, raw: Self::Raw) -> Result<Self::Value, CallError>;
}

macro_rules! kinds {
    ($($kind:ident: $raw:ty => $value:ty, |$name:ident, $parameter:ident| $convert:expr;)*) => {$(
        impl<'a> FromC<'a> for $kind {
            type Raw = $raw;
            type Value = $value;

            unsafe fn from_c($name: &'static str, $parameter: $raw) -> Result<$value, CallError> {
                $convert
            }
        }
    )*};
}

kinds! {
    Handle: u64 => u64, |_name, raw| Ok(raw);
    Id: u32 => u32, |_name, raw| Ok(raw);
    Count: u32 => u32, |_name, raw| Ok(raw);
    Size: usize => usize, |_name, raw| Ok(raw);
    Real: f32 => f32, |_name, raw| Ok(raw);
    Flag: u32 => bool, |_name, raw| Ok(raw != 0);
    // SAFETY: the caller's obligation.
    OptionalText: *const c_char => Option<&'a str>, |name, raw| unsafe { text(name, raw) };
    Text: *const c_char => &'a str, |name, raw| {
        // SAFETY: the caller's obligation.
        unsafe { text(name, raw) }?.ok_or_else(|| CallError::null(name))
    };
    // SAFETY: the caller's obligation.
    Samples: (*const f32, usize) => &'a [f32], |name, raw| unsafe { slice(name, raw.0, raw.1) };
    // SAFETY: the caller's obligation.
    Bytes: (*const u8, usize) => &'a [u8], |name, raw| unsafe { slice(name, raw.0, raw.1) };
    OptionalBytes: (*const u8, usize) => Option<&'a [u8]>, |name, raw| match raw {
        (pointer, 0) if pointer.is_null() => Ok(None),
        // SAFETY: the caller's obligation.
        (pointer, count) => unsafe { slice(name, pointer, count) }.map(Some),
    };
    // SAFETY: the caller's obligation.
    PoseIn: *const Pose => Pose, |name, raw| unsafe { value(name, raw) };
    HandleOut: *mut u64 => Variable<u64>, |name, raw| {
        // SAFETY: the caller's obligation.
        unsafe { store(name, raw, 0) }?;
        Ok(Variable(raw))
    };
}

impl<T: Record + Default> FromC<'_> for In<T> {
    type Raw = *const T;
    type Value = T;

    unsafe fn from_c(name: &'static str, raw: *const T) -> Result<T, CallError> {
        // SAFETY: the caller's obligation; records have numbers only.
        unsafe { structure(name, raw) }
    }
}

impl<T: Record> FromC<'_> for Out<T> {
    type Raw = *mut T;
    type Value = Variable<T>;

    unsafe fn from_c(name: &'static str, raw: *mut T) -> Result<Variable<T>, CallError> {
        check(name, raw)?;
        Ok(Variable(raw))
    }
}

/// A caller's variable, checked.
pub(super) struct Variable<T>(*mut T);

impl<T> Variable<T> {
    /// Writes the variable.
    pub(super) fn store(&self, value: T) -> Result<(), CallError> {
        // SAFETY: not null, aligned and valid for writes during the call, see `from_c`.
        unsafe { self.0.write(value) };
        Ok(())
    }
}

/// A kind of result.
pub(super) trait Returned: Kind {
    /// The value of a failed call.
    const NONE: Self::C;
}

impl Returned for Handle {
    const NONE: u64 = 0;
}

impl Returned for Id {
    const NONE: u32 = u32::MAX;
}

impl Returned for Count {
    const NONE: u32 = 0;
}
