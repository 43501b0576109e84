//! Java's memory, copied.

use ::jni::Env;
use ::jni::objects::{JByteBuffer, JObject, JPrimitiveArray, JString, TypeArray};

use crate::bridge::fault::{Fault, Status};

/// A direct buffer, or as much of it as was asked for.
pub(super) struct Direct {
    address: *mut u8,
    bytes: usize,
}

impl Direct {
    /// The first `bytes` bytes of a buffer, which lives at least as long as the native call it was given to.
    pub(super) fn of(
        env: &Env<'_>,
        name: &str,
        buffer: &JByteBuffer<'_>,
        bytes: usize,
    ) -> Result<Self, Fault> {
        present(name, buffer)?;
        let Ok(address) = env.get_direct_buffer_address(buffer) else {
            let text = format!("{name} is not direct; make it with ByteBuffer.allocateDirect");
            return Err(Fault::new(Status::BadArgument, text));
        };
        let capacity = env.get_direct_buffer_capacity(buffer)?;
        if bytes > capacity {
            let text = format!("{name} has {capacity} bytes and {bytes} are needed");
            return Err(Fault::new(Status::BadArgument, text));
        }
        Ok(Self { address, bytes })
    }

    /// Copies bytes out, from a place on.
    ///
    /// # Panics
    /// If they are not all there.
    pub(super) fn read(&self, from: usize, to: &mut [u8]) {
        assert!(from + to.len() <= self.bytes, "reads what is there");
        // SAFETY: checked above, within a buffer that lives during the call.
        let source = unsafe { self.address.add(from) };
        // SAFETY: as many bytes are there, and they are not the caller's own variable.
        unsafe { std::ptr::copy_nonoverlapping(source, to.as_mut_ptr(), to.len()) };
    }

    /// Copies floats in, from a place on that is counted in floats.
    ///
    /// # Panics
    /// If they do not all fit.
    pub(super) fn write(&self, from: usize, floats: &[f32]) {
        let bytes = size_of_val(floats);
        let start = from * size_of::<f32>();
        assert!(start + bytes <= self.bytes, "writes what fits");
        // SAFETY: checked above, within a buffer that lives during the call.
        let target = unsafe { self.address.add(start) };
        // SAFETY: as many bytes are there; they are not the caller's own variable.
        unsafe { std::ptr::copy_nonoverlapping(floats.as_ptr().cast(), target, bytes) };
    }
}

/// That a reference is not null.
pub(super) fn present(name: &str, object: &JObject<'_>) -> Result<(), Fault> {
    if object.is_null() {
        return Err(Fault::null(name));
    }
    Ok(())
}

/// All of an array.
pub(super) fn array<T: TypeArray + Copy + Default>(
    env: &Env<'_>,
    name: &str,
    array: &JPrimitiveArray<'_, T>,
) -> Result<Vec<T>, Fault> {
    present(name, array)?;
    let mut values = vec![T::default(); array.len(env)?];
    array.get_region(env, 0, &mut values)?;
    Ok(values)
}

/// All of an array, or nothing for null.
pub(super) fn optional_array<T: TypeArray + Copy + Default>(
    env: &Env<'_>,
    values: &JPrimitiveArray<'_, T>,
) -> Result<Vec<T>, Fault> {
    if values.is_null() {
        return Ok(Vec::new());
    }
    array(env, "array", values)
}

/// Fills an array that has exactly as many places.
pub(super) fn fill<T: TypeArray>(
    env: &Env<'_>,
    name: &str,
    array: &JPrimitiveArray<'_, T>,
    values: &[T],
) -> Result<(), Fault> {
    present(name, array)?;
    let places = array.len(env)?;
    if places != values.len() {
        let text = format!("{name} has {places} places, not {}", values.len());
        return Err(Fault::new(Status::BadArgument, text));
    }
    Ok(array.set_region(env, 0, values)?)
}

/// A text, or nothing for null.
pub(super) fn text(env: &Env<'_>, text: &JString<'_>) -> Result<Option<String>, Fault> {
    if text.is_null() {
        return Ok(None);
    }
    Ok(Some(text.try_to_string(env)?))
}
