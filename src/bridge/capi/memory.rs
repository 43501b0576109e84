//! Pointers from C, as far as they can be checked.

use std::ffi::{CStr, c_char};

use crate::bridge::fault::{Fault, Status};

/// Without words of its own: sound calls ask for it too.
fn aligned<T>(pointer: *const T) -> Result<(), Fault> {
    const ASKEW: &str = "an address is not aligned; give that of such a variable";
    if pointer.is_aligned() {
        return Ok(());
    }
    Err(Fault::fixed(Status::BadArgument, ASKEW))
}

/// That a pointer is there, for sound calls: its text was there before.
pub(super) fn present<T>(pointer: *const T) -> Result<(), Fault> {
    const NULL: Fault = Fault::fixed(Status::Null, "a pointer is null; give an address");
    if pointer.is_null() {
        return Err(NULL);
    }
    aligned(pointer)
}

/// A pointer that may be read or written as a `T`.
fn check<T>(name: &str, pointer: *const T) -> Result<(), Fault> {
    if pointer.is_null() {
        return Err(Fault::null(name));
    }
    aligned(pointer)
}

/// `count` values in a row; null is none if the count is zero.
///
/// # Safety
/// The pointer, if it is not null, is that of `count` values that nobody writes while the result lives.
pub(super) unsafe fn slice<'a, T>(
    name: &str,
    pointer: *const T,
    count: usize,
) -> Result<&'a [T], Fault> {
    if count == 0 {
        return Ok(&[]);
    }
    check(name, pointer)?;
    if count > isize::MAX as usize / size_of::<T>().max(1) {
        let text = format!("{name}: {count} are more than memory has");
        return Err(Fault::new(Status::BadArgument, text));
    }
    // SAFETY: neither null nor out of line, not larger than memory; the rest is the caller's word.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// As [`slice`], to be written.
///
/// # Safety
/// The pointer, if it is not null, is that of `count` values that nobody else uses while the result lives.
pub(super) unsafe fn slice_mut<'a, T>(
    name: &str,
    pointer: *mut T,
    count: usize,
) -> Result<&'a mut [T], Fault> {
    if count == 0 {
        return Ok(&mut []);
    }
    check(name, pointer)?;
    if count > isize::MAX as usize / size_of::<T>().max(1) {
        let text = format!("{name}: {count} are more than memory has");
        return Err(Fault::new(Status::BadArgument, text));
    }
    // SAFETY: neither null nor out of line, not larger than memory; the rest is the caller's word.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, count) })
}

/// Writes a result.
///
/// # Safety
/// The pointer, if it is not null, is that of a variable of this type.
pub(super) unsafe fn give<T>(name: &str, pointer: *mut T, value: T) -> Result<(), Fault> {
    check(name, pointer)?;
    // SAFETY: neither null nor out of line; the rest is the caller's word.
    unsafe { pointer.write(value) };
    Ok(())
}

/// Reads a value.
///
/// # Safety
/// The pointer, if it is not null, is that of a variable of this type.
pub(super) unsafe fn value<T: Copy>(name: &str, pointer: *const T) -> Result<T, Fault> {
    check(name, pointer)?;
    // SAFETY: neither null nor out of line; the rest is the caller's word.
    Ok(unsafe { pointer.read() })
}

/// Reads options: a structure that begins with its size in bytes as the caller knows it. What the caller does not know
/// keeps its default; null is all defaults.
///
/// # Safety
/// The pointer, if it is not null, is that of a structure that begins like `T` and has as many bytes as its first field says.
/// `T` begins with a `u32`, and any bytes are a `T`.
pub(super) unsafe fn read_options<T: Copy + Default>(
    name: &str,
    pointer: *const T,
) -> Result<T, Fault> {
    if pointer.is_null() {
        return Ok(T::default());
    }
    check(name, pointer)?;
    // SAFETY: neither null nor out of line, and begins with its size by the caller's word.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    if !(size_of::<u32>()..=4096).contains(&size) {
        let text = format!("{name}: size {size} is none; begin with the defaults");
        return Err(Fault::new(Status::BadArgument, text));
    }
    let mut options = T::default();
    let known = size.min(size_of::<T>());
    // SAFETY: both have this many bytes and do not overlap; any bytes are a `T` by the caller's word.
    unsafe {
        std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut options).cast(), known);
    }
    Ok(options)
}

/// A text; null is none.
///
/// # Safety
/// The pointer, if it is not null, is that of a text that ends with a zero and that nobody writes while the result lives.
pub(super) unsafe fn text<'a>(
    name: &str,
    pointer: *const c_char,
) -> Result<Option<&'a str>, Fault> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: not null; that it ends is the caller's word.
    let bytes = unsafe { CStr::from_ptr(pointer) };
    let text = bytes.to_str().map_err(|_| {
        let text = format!("{name} is not UTF-8; give UTF-8");
        Fault::new(Status::BadArgument, text)
    })?;
    Ok(Some(text))
}
