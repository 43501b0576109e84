//! Arguments from Java, copied.

use std::sync::OnceLock;

use ::jni::objects::{
    JByteArray, JByteBuffer, JDoubleArray, JFloatArray, JIntArray, JLongArray, JMethodID, JObject,
    JObjectArray, JPrimitiveArray, JString, TypeArray,
};
use ::jni::sys::{jboolean, jfloat, jint, jlong};
use ::jni::{Env, jni_sig, jni_str};

use crate::bridge::enumeration::Enumeration;
use crate::bridge::error::{CallError, Status};
use crate::bridge::interface::{
    Buffer, BufferOut, Bytes, Choice, Count, Flag, Handle, HandleOut, Id, In, Indices, List,
    OptionalBuffer, OptionalBytes, OptionalText, Out, PoseIn, Real, Samples, Size, Text, Texts,
};
use crate::bridge::pose::Pose;
use crate::bridge::record::{Field, Growing, Record};

/// A kind of parameter as it comes from Java.
pub(super) trait FromJava {
    /// The native's parameter.
    type Raw<'l>;
    /// The value in Rust.
    type Value<'a>;

    /// Checks, copies and converts a parameter.
    fn from_java<'a>(
        env: &'a Env<'_>,
        name: &'static str,
        raw: &'a Self::Raw<'_>,
    ) -> Result<Self::Value<'a>, CallError>;
}

/// A kind of result.
pub(super) trait Returned {
    /// The value in Rust.
    type Value;
    /// The native's result.
    type Java;

    /// Converts a result.
    fn to_java(value: Self::Value) -> Self::Java;
}

macro_rules! kinds {
    ($($kind:ident: $raw:ty => $value:ty, |$env:ident, $name:ident, $parameter:ident| $convert:expr;)*) => {$(
        impl FromJava for $kind {
            type Raw<'l> = $raw;
            type Value<'a> = $value;

            fn from_java<'a>(
                $env: &'a Env<'_>,
                $name: &'static str,
                $parameter: &'a Self::Raw<'_>,
            ) -> Result<Self::Value<'a>, CallError> {
                $convert
            }
        }
    )*};
}

kinds! {
    Handle: jlong => u64, |_env, _name, raw| Ok(*raw as u64);
    Id: jint => u32, |_env, _name, raw| Ok(*raw as u32);
    Count: jint => u32, |_env, name, raw| unsigned(name, *raw);
    Size: jint => usize, |_env, name, raw| Ok(unsigned(name, *raw)? as usize);
    Real: jfloat => f32, |_env, _name, raw| Ok(*raw);
    Flag: jboolean => bool, |_env, _name, raw| Ok(*raw);
    Text: JString<'l> => String, |env, name, raw| text(env, raw)?.ok_or_else(|| CallError::null(name));
    OptionalText: JString<'l> => Option<String>, |env, _name, raw| text(env, raw);
    Samples: JFloatArray<'l> => Vec<f32>, |env, name, raw| required(name, array(env, raw)?);
    Bytes: JByteArray<'l> => Vec<u8>, |env, name, raw| required(name, bytes(env, raw)?);
    OptionalBytes: JByteArray<'l> => Option<Vec<u8>>, |env, _name, raw| bytes(env, raw);
    Indices: JIntArray<'l> => Option<Vec<u32>>, |env, name, raw| {
        let signed = array(env, raw)?;
        signed.map(|all| all.into_iter().map(|index| unsigned(name, index)).collect()).transpose()
    };
    Texts: JObjectArray<'l, JString<'l>> => Vec<String>, |env, name, raw| {
        let count = if raw.is_null() { 0 } else { raw.len(env)? };
        let element = |index| {
            env.with_local_frame(1, |env| {
                let element = raw.get_element(env, index)?;
                text(env, &element)?.ok_or_else(|| CallError::null(name))
            })
        };
        (0..count).map(element).collect()
    };
    PoseIn: JFloatArray<'l> => Pose, |env, name, raw| {
        let floats = required(name, array(env, raw)?)?;
        let floats = floats.try_into().map_err(|floats: Vec<f32>| {
            CallError::bad(format!("{name}: {} elements instead of 7", floats.len()))
        });
        Ok(Pose::from_floats(floats?))
    };
    List: JDoubleArray<'l> => ArrayOut<'a, f64>, |env, name, raw| ArrayOut::new(env, name, raw);
    HandleOut: JLongArray<'l> => ArrayOut<'a, jlong>, |env, name, raw| ArrayOut::new(env, name, raw)?.of_length(name, 1);
    Buffer: JByteBuffer<'l> => DirectBuffer, |env, name, raw| DirectBuffer::new(env, name, raw);
    OptionalBuffer: JByteBuffer<'l> => Option<DirectBuffer>, |env, name, raw| {
        (!raw.is_null()).then(|| DirectBuffer::new(env, name, raw)).transpose()
    };
    BufferOut: JByteBuffer<'l> => DirectBuffer, |env, name, raw| {
        let buffer = DirectBuffer::new(env, name, raw)?;
        if is_read_only(env, raw)? {
            let text = format!("{name} is read-only; make it with ByteBuffer.allocateDirect");
            return Err(CallError::bad(text));
        }
        Ok(buffer)
    };
}

impl<T: Enumeration + Field> FromJava for Choice<T> {
    type Raw<'l> = jint;
    type Value<'a> = T;

    fn from_java<'a>(_: &'a Env<'_>, name: &'static str, raw: &'a jint) -> Result<T, CallError> {
        T::read(name, &mut &[f64::from(*raw)][..])
    }
}

impl<T: Growing> FromJava for In<T> {
    type Raw<'l> = JDoubleArray<'l>;
    type Value<'a> = T;

    fn from_java<'a>(
        env: &'a Env<'_>,
        name: &'static str,
        raw: &'a JDoubleArray<'_>,
    ) -> Result<T, CallError> {
        let list = array(env, raw)?;
        list.map_or_else(|| Ok(T::default()), |list| T::from_list(name, &list))
    }
}

impl<T: Growing> FromJava for Out<T> {
    type Raw<'l> = JDoubleArray<'l>;
    type Value<'a> = RecordOut<'a>;

    fn from_java<'a>(
        env: &'a Env<'_>,
        name: &'static str,
        raw: &'a JDoubleArray<'_>,
    ) -> Result<RecordOut<'a>, CallError> {
        let list = ArrayOut::new(env, name, raw)?;
        Ok(RecordOut(list.of_length(name, T::ELEMENTS)?))
    }
}

macro_rules! results {
    ($($kind:ident: $value:ty => $java:ty;)*) => {$(
        impl Returned for $kind {
            type Value = $value;
            type Java = $java;

            fn to_java(value: $value) -> $java {
                value as $java
            }
        }
    )*};
}

results! {
    Handle: u64 => jlong;
    Id: u32 => jint;
    Count: u32 => jint;
    Real: f32 => jfloat;
}

/// Java has no unsigned integers.
fn unsigned(name: &str, value: jint) -> Result<u32, CallError> {
    u32::try_from(value).map_err(|_| CallError::bad(format!("{name}: {value} is negative")))
}

fn required<T>(name: &str, value: Option<T>) -> Result<T, CallError> {
    value.ok_or_else(|| CallError::null(name))
}

/// An array's elements; `None` for null.
fn array<T: TypeArray + Copy + Default>(
    env: &Env<'_>,
    array: &JPrimitiveArray<'_, T>,
) -> Result<Option<Vec<T>>, CallError> {
    if array.is_null() {
        return Ok(None);
    }
    let mut values = vec![T::default(); array.len(env)?];
    array.get_region(env, 0, &mut values)?;
    Ok(Some(values))
}

fn bytes(env: &Env<'_>, raw: &JByteArray<'_>) -> Result<Option<Vec<u8>>, CallError> {
    let signed = array(env, raw)?;
    Ok(signed.map(|all| all.into_iter().map(|byte| byte as u8).collect()))
}

/// A text; `None` for null.
fn text(env: &Env<'_>, text: &JString<'_>) -> Result<Option<String>, CallError> {
    if text.is_null() {
        return Ok(None);
    }
    Ok(Some(text.try_to_string(env)?))
}

fn present(name: &str, object: &JObject<'_>) -> Result<(), CallError> {
    required(name, (!object.is_null()).then_some(()))
}

/// An array to fill.
pub(super) struct ArrayOut<'a, T: TypeArray> {
    env: &'a Env<'a>,
    array: &'a JPrimitiveArray<'a, T>,
    /// Its number of elements.
    pub(super) length: usize,
}

impl<'a, T: TypeArray> ArrayOut<'a, T> {
    fn new(
        env: &'a Env<'a>,
        name: &str,
        array: &'a JPrimitiveArray<'a, T>,
    ) -> Result<Self, CallError> {
        present(name, array)?;
        let length = array.len(env)?;
        Ok(Self { env, array, length })
    }

    fn of_length(self, name: &str, wanted: usize) -> Result<Self, CallError> {
        if self.length == wanted {
            return Ok(self);
        }
        let length = self.length;
        Err(CallError::bad(format!(
            "{name}: {length} elements instead of {wanted}"
        )))
    }
}

impl ArrayOut<'_, f64> {
    /// Writes the first elements.
    pub(super) fn store(&self, values: &[f64]) -> Result<(), CallError> {
        Ok(self.array.set_region(self.env, 0, values)?)
    }
}

impl ArrayOut<'_, jlong> {
    /// Writes a handle.
    pub(super) fn store(&self, handle: u64) -> Result<(), CallError> {
        Ok(self.array.set_region(self.env, 0, &[handle as jlong])?)
    }
}

/// A list to fill with a structure.
pub(super) struct RecordOut<'a>(ArrayOut<'a, f64>);

impl RecordOut<'_> {
    /// Writes the structure.
    pub(super) fn store(&self, record: impl Record) -> Result<(), CallError> {
        self.0.store(&record.to_list())
    }
}

/// `java.nio.Buffer.isReadOnly`, looked up when the library is loaded. The class is never unloaded.
static IS_READ_ONLY: OnceLock<JMethodID> = OnceLock::new();

/// Looks up the methods that natives call.
pub(super) fn look_up_methods(env: &mut Env<'_>) -> Result<(), CallError> {
    let class = jni_str!("java/nio/Buffer");
    let found = env.get_method_id(class, jni_str!("isReadOnly"), jni_sig!("()Z"))?;
    IS_READ_ONLY.get_or_init(|| found);
    Ok(())
}

/// Whether a buffer may not be written to; its memory may be mapped without the right to write.
fn is_read_only(env: &Env<'_>, buffer: &JByteBuffer<'_>) -> Result<bool, CallError> {
    let method = *IS_READ_ONLY
        .get()
        .ok_or_else(|| CallError::null("isReadOnly"))?;
    let raw = env.get_raw();
    // SAFETY: the environment of the virtual machine that made the call.
    let interface = unsafe { *raw };
    // SAFETY: its table of functions, which lives as long as the virtual machine.
    let functions = unsafe { &*interface };
    // SAFETY: a function of every version of the interface.
    let call = unsafe { functions.v1_1.CallBooleanMethodA };
    // SAFETY: a buffer that is not null, its class's own method, which takes no argument and returns a boolean. No local
    // reference is made.
    let answer = unsafe { call(raw, buffer.as_raw(), method.into_raw(), std::ptr::null()) };
    if env.exception_check() {
        return Err(CallError::fixed(Status::State, "Java: isReadOnly failed"));
    }
    Ok(answer)
}

/// A direct buffer, which lives at least as long as the call.
pub(super) struct DirectBuffer {
    name: &'static str,
    address: *mut u8,
    bytes: usize,
}

impl DirectBuffer {
    fn new(env: &Env<'_>, name: &'static str, buffer: &JByteBuffer<'_>) -> Result<Self, CallError> {
        present(name, buffer)?;
        let Ok(address) = env.get_direct_buffer_address(buffer) else {
            let text = format!("{name} is not direct; make it with ByteBuffer.allocateDirect");
            return Err(CallError::bad(text));
        };
        let bytes = env.get_direct_buffer_capacity(buffer)?;
        Ok(Self {
            name,
            address,
            bytes,
        })
    }

    /// An error for fewer bytes.
    pub(super) fn check(&self, wanted: usize) -> Result<(), CallError> {
        let Self { name, bytes, .. } = self;
        if wanted > *bytes {
            let text = format!("{name} has {bytes} bytes of {wanted} needed");
            return Err(CallError::bad(text));
        }
        Ok(())
    }

    /// Copies bytes out.
    ///
    /// # Panics
    /// If the range exceeds the buffer.
    pub(super) fn read<const N: usize>(&self, start: usize) -> [u8; N] {
        assert!(start + N <= self.bytes, "reads within the buffer");
        let mut bytes = [0; N];
        // SAFETY: checked above, within a buffer that lives during the call.
        let source = unsafe { self.address.add(start) };
        // SAFETY: both have this many bytes and do not overlap.
        unsafe { std::ptr::copy_nonoverlapping(source, bytes.as_mut_ptr(), N) };
        bytes
    }

    /// Copies floats out from the start.
    ///
    /// # Panics
    /// If there are fewer.
    pub(super) fn read_floats(&self, floats: &mut [f32]) {
        for (n, float) in floats.iter_mut().enumerate() {
            *float = f32::from_ne_bytes(self.read(size_of::<f32>() * n));
        }
    }

    /// Copies floats in; `start` is counted in floats.
    ///
    /// # Panics
    /// If the range exceeds the buffer.
    pub(super) fn write(&self, start: usize, floats: &[f32]) {
        let (start, count) = (start * size_of::<f32>(), size_of_val(floats));
        assert!(start + count <= self.bytes, "writes within the buffer");
        // SAFETY: checked above, within a buffer that lives during the call.
        let target = unsafe { self.address.add(start) };
        // SAFETY: both have this many bytes and do not overlap.
        unsafe { std::ptr::copy_nonoverlapping(floats.as_ptr().cast(), target, count) };
    }
}
