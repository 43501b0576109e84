//! Pointers from C: checked for null and alignment.

use std::ffi::{CStr, c_char};
use std::ptr;

use crate::bridge::enumeration::Enumeration;
use crate::bridge::error::{CallError, Status};
use crate::bridge::interface::{
    Bytes, Choice, Count, Flag, Handle, HandleOut, Id, In, Kind, OptionalBytes, OptionalText, Out,
    PoseIn, Real, Samples, Size, Text,
};
use crate::bridge::pose::Pose;
use crate::bridge::record::{Growing, MAX_BYTES, check_size};
use crate::bridge::sound::RenderInfo;

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

/// An error of the audio functions, whose messages are static, for an array that is null, misaligned or too long.
pub(super) fn check_samples<T>(
    pointer: *const T,
    count: usize,
    most: usize,
) -> Result<(), CallError> {
    const TOO_LONG: CallError = CallError::fixed(Status::BadArgument, "too many samples");
    const NULL: CallError = CallError::fixed(Status::Null, "a pointer is null; pass an address");
    match count {
        0 => Ok(()),
        _ if count > most => Err(TOO_LONG),
        _ if pointer.is_null() => Err(NULL),
        _ => aligned(pointer),
    }
}

/// A caller's structure for what was rendered, unless it is null.
///
/// # Safety
/// `info` is null or the address of a structure with its size.
pub(super) unsafe fn info_of(
    info: *mut RenderInfo,
) -> Result<Option<Variable<RenderInfo>>, CallError> {
    if info.is_null() {
        return Ok(None);
    }
    aligned(info)?;
    // SAFETY: not null; the rest is the caller's obligation.
    unsafe { Variable::new(info) }.map(Some)
}

/// An output in the caller's memory.
///
/// # Safety
/// `output` has `channels` x `frames` elements, unless it is null.
pub(super) unsafe fn output_of<'a>(
    output: *mut f32,
    channels: u32,
    frames: usize,
) -> Result<&'a mut [f32], CallError> {
    const CHANNELS: CallError = CallError::fixed(Status::BadArgument, "channels: outside 1 to 16");
    if !(1..=16).contains(&channels) {
        return Err(CHANNELS);
    }
    check_samples(output, frames, 1 << 24)?;
    // SAFETY: the caller's obligation.
    unsafe { slice_mut("output", output, channels as usize * frames) }
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

/// Reads one structure without a size of its own.
///
/// # Safety
/// A pointer that is not null is valid for reads of `size` bytes. Any bytes are a `T`.
pub(super) unsafe fn element<T: Copy + Default>(
    name: &str,
    pointer: *const T,
    size: usize,
) -> Result<T, CallError> {
    // SAFETY: the caller's obligation.
    let mut only = unsafe { elements(name, pointer, 1, size) }?;
    only.next().ok_or_else(|| CallError::null(name))
}

/// The size that a caller's structure begins with. Its error's message is static.
///
/// # Safety
/// The pointer is not null, aligned and valid for a read of a `u32`.
unsafe fn size_at<T: Growing>(pointer: *const T) -> Result<usize, CallError> {
    // SAFETY: the caller's obligation.
    check_size::<T>(unsafe { pointer.cast::<u32>().read() })
}

/// Reads a structure that begins with its size in bytes. Fields beyond that size keep their defaults; a null pointer means
/// all defaults.
///
/// # Safety
/// A pointer that is not null is valid for reads of as many bytes as its first `u32` says. `T` begins with that `u32` and
/// has numbers only.
pub(super) unsafe fn structure<T: Growing>(name: &str, pointer: *const T) -> Result<T, CallError> {
    if pointer.is_null() {
        return Ok(T::default());
    }
    check(name, pointer)?;
    // SAFETY: not null, aligned; begins with its size by the caller's obligation.
    let size = unsafe { size_at(pointer) }.map_err(|error| named(name, &error))?;
    let mut options = T::default();
    // SAFETY: valid for this many bytes, see above; a `T` of numbers has no invalid bytes.
    unsafe { copy_start(pointer.cast(), &mut options, size) };
    Ok(options)
}

/// Copies the first `size` bytes of a caller's structure, as many as a `T` has, and leaves the others as they are.
///
/// # Safety
/// The pointer is valid for reads of `size` bytes. Any bytes are a `T`.
unsafe fn copy_start<T>(pointer: *const u8, target: &mut T, size: usize) {
    let known = size.min(size_of::<T>());
    // SAFETY: both have this many bytes and do not overlap; the rest is the caller's obligation.
    unsafe { std::ptr::copy_nonoverlapping(pointer, ptr::from_mut(target).cast(), known) };
}

fn named(name: &str, error: &CallError) -> CallError {
    CallError::new(error.status, format!("{name}: {error}"))
}

/// Reads elements of an array of structures without a size of their own, `stride` bytes apart.
///
/// # Errors
/// `Status::BadArgument` for a stride that no version of the structure has, and for misalignment.
///
/// # Safety
/// A pointer that is not null is valid for reads of `count` x `stride` bytes during `'a`. Any bytes are a `T`.
pub(super) unsafe fn elements<'a, T: Copy + Default + 'a>(
    name: &str,
    pointer: *const T,
    count: usize,
    stride: usize,
) -> Result<impl Iterator<Item = T> + use<'a, T>, CallError> {
    check_stride::<T>(name, stride)?;
    let bytes = count.saturating_mul(stride);
    if count > 0 {
        aligned(pointer)?;
    }
    // SAFETY: the caller's obligation.
    let bytes = unsafe { slice::<u8>(name, pointer.cast(), bytes) }?;
    Ok(bytes.chunks_exact(stride).map(|element| {
        let mut value = T::default();
        // SAFETY: the element's bytes.
        unsafe { copy_start(element.as_ptr(), &mut value, element.len()) };
        value
    }))
}

/// An error for an element size that is smaller than the first version's, uninitialised or misaligned.
fn check_stride<T>(name: &str, stride: usize) -> Result<(), CallError> {
    if (size_of::<T>()..=MAX_BYTES).contains(&stride) && stride.is_multiple_of(align_of::<T>()) {
        return Ok(());
    }
    Err(CallError::bad(format!(
        "{name}: an element size of {stride} is invalid; pass the structure's sizeof"
    )))
}

/// A caller's array of structures without a size of their own, `stride` bytes apart.
pub(super) struct Elements<T> {
    pointer: *mut T,
    count: usize,
    stride: usize,
}

impl<T: Copy> Elements<T> {
    /// Checks the array.
    ///
    /// # Errors
    /// As [`elements`].
    ///
    /// # Safety
    /// A pointer that is not null is valid for writes of `count` x `stride` bytes while this exists.
    pub(super) unsafe fn new(
        name: &str,
        pointer: *mut T,
        count: usize,
        stride: usize,
    ) -> Result<Self, CallError> {
        check_stride::<T>(name, stride)?;
        if count > 0 {
            aligned(pointer)?;
            let bytes = count.saturating_mul(stride);
            check_array::<u8>(name, pointer.cast(), bytes)?;
        }
        Ok(Self {
            pointer,
            count,
            stride,
        })
    }

    /// Writes as many values as fit, with zeros behind each; returns their number.
    pub(super) fn store(&self, values: impl Iterator<Item = T>) -> usize {
        let mut stored = 0;
        for (index, value) in values.take(self.count).enumerate() {
            // SAFETY: within the array.
            let element = unsafe { self.pointer.byte_add(index * self.stride) };
            // SAFETY: aligned like the first, since the stride is a multiple of the alignment.
            unsafe { element.write(value) };
            let rest = self.stride - size_of::<T>();
            // SAFETY: within the element, whose size is the stride.
            let end = unsafe { element.cast::<u8>().add(size_of::<T>()) };
            // SAFETY: the same.
            unsafe { end.write_bytes(0, rest) };
            stored += 1;
        }
        stored
    }
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
    type Raw: Copy;
    /// The value in Rust.
    type Value;

    /// Clears a result, before any parameter is checked: nothing is left in it after a failure.
    ///
    /// # Safety
    /// As [`Self::from_c`].
    unsafe fn clear(_: &'static str, _: Self::Raw) {}

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
    PoseIn: (*const Pose, usize) => Pose, |name, raw| unsafe { element(name, raw.0, raw.1) };
}

impl FromC<'_> for HandleOut {
    type Raw = *mut u64;
    type Value = HandleVariable;

    unsafe fn clear(name: &'static str, raw: *mut u64) {
        // A pointer that is none is an error of `from_c`.
        // SAFETY: the caller's obligation.
        let _ = unsafe { store(name, raw, 0) };
    }

    unsafe fn from_c(name: &'static str, raw: *mut u64) -> Result<HandleVariable, CallError> {
        check(name, raw)?;
        Ok(HandleVariable(raw))
    }
}

impl<T: Enumeration> FromC<'_> for Choice<T> {
    type Raw = T;
    type Value = T;

    unsafe fn from_c(_: &'static str, raw: T) -> Result<T, CallError> {
        Ok(raw)
    }
}

impl<T: Growing> FromC<'_> for In<T> {
    type Raw = *const T;
    type Value = T;

    unsafe fn from_c(name: &'static str, raw: *const T) -> Result<T, CallError> {
        // SAFETY: the caller's obligation; records have numbers only.
        unsafe { structure(name, raw) }
    }
}

impl<T: Growing> FromC<'_> for Out<T> {
    type Raw = *mut T;
    type Value = Variable<T>;

    unsafe fn from_c(name: &'static str, raw: *mut T) -> Result<Variable<T>, CallError> {
        check(name, raw)?;
        // SAFETY: the caller's obligation.
        unsafe { Variable::new(raw) }.map_err(|error| named(name, &error))
    }
}

/// A caller's variable for a handle, checked.
pub(super) struct HandleVariable(*mut u64);

impl HandleVariable {
    /// Writes the handle.
    pub(super) fn store(&self, handle: u64) -> Result<(), CallError> {
        // SAFETY: not null, aligned and valid for writes during the call, see `from_c`.
        unsafe { self.0.write(handle) };
        Ok(())
    }
}

/// A caller's structure, checked, and its size in the caller's header.
pub(super) struct Variable<T> {
    pointer: *mut T,
    size: usize,
}

impl<T: Growing> Variable<T> {
    /// Reads the size. Its error's message is static.
    ///
    /// # Safety
    /// The pointer is not null, aligned and valid for reads and writes, while this exists, of as many bytes as its first
    /// `u32` says.
    pub(super) unsafe fn new(pointer: *mut T) -> Result<Self, CallError> {
        // SAFETY: the caller's obligation.
        let size = unsafe { size_at(pointer) }?;
        Ok(Self { pointer, size })
    }

    /// Writes as many fields as the caller's structure has, and zeros into fields of a newer caller. The size stays.
    pub(super) fn store(&self, value: T) -> Result<(), CallError> {
        const START: usize = size_of::<u32>();
        let known = self.size.min(size_of::<T>());
        let bytes = self.pointer.cast::<u8>();
        // SAFETY: `size` bytes are valid for writes, see `new`, and not less than `START`.
        let target = unsafe { bytes.add(START) };
        // SAFETY: within a `T`.
        let source = unsafe { (&raw const value).cast::<u8>().add(START) };
        // SAFETY: both have this many bytes and do not overlap.
        unsafe { std::ptr::copy_nonoverlapping(source, target, known - START) };
        // SAFETY: `known` is not more than `size`.
        let rest = unsafe { bytes.add(known) };
        // SAFETY: the same.
        unsafe { rest.write_bytes(0, self.size - known) };
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
    const NONE: u32 = 0;
}

impl Returned for Real {
    const NONE: f32 = 0.0;
}

impl Returned for Count {
    const NONE: u32 = 0;
}
