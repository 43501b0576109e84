//! Kinds of parameters and results of the table of functions, with their types in C and Java.

use std::ffi::c_char;
use std::marker::PhantomData;

use super::enumeration::Enumeration;
use super::pose::Pose;
use super::record::Growing;

/// A kind of parameter or result.
pub trait Kind {
    /// The parameter's type in C. Kinds that only Java has: `()`.
    type C;
    /// The name of the type in Java, and in the signature of a native.
    const JAVA: [&str; 2];

    /// The type in C, as Rust source.
    fn c() -> String;
}

macro_rules! kinds {
    ($($(#[doc = $doc:literal])* $kind:ident: $c:ty, $java:literal $signature:literal;)*) => {$(
        $(#[doc = $doc])*
        pub struct $kind;

        impl Kind for $kind {
            type C = $c;
            const JAVA: [&str; 2] = [$java, $signature];

            fn c() -> String {
                stringify!($c).into()
            }
        }
    )*};
}

kinds! {
    /// A handle of an object.
    Handle: u64, "long" "J";
    /// The id of a source or an instance.
    Id: u32, "int" "I";
    /// A number that is not negative.
    Count: u32, "int" "I";
    /// A size, not negative.
    Size: usize, "int" "I";
    /// A real number.
    Real: f32, "float" "F";
    /// A flag: 0 is false.
    Flag: u32, "boolean" "Z";
    /// A text in UTF-8.
    Text: *const c_char, "String" "Ljava/lang/String;";
    /// A text or null.
    OptionalText: *const c_char, "String" "Ljava/lang/String;";
    /// Samples.
    Samples: *const f32, "float[]" "[F";
    /// Bytes.
    Bytes: *const u8, "byte[]" "[B";
    /// Bytes, or null with a length of 0.
    OptionalBytes: *const u8, "byte[]" "[B";
    /// A pose and its size: in Java position and orientation, seven floats.
    PoseIn: *const Pose, "float[]" "[F";
    /// A variable for a handle: in Java an array of one.
    HandleOut: *mut u64, "long[]" "[J";
    /// Java: integers that are not negative, or null.
    Indices: (), "int[]" "[I";
    /// Java: texts, or null.
    Texts: (), "String[]" "[Ljava/lang/String;";
    /// Java: a list of doubles to fill.
    List: (), "double[]" "[D";
    /// Java: a direct buffer in native order.
    Buffer: (), "ByteBuffer" "Ljava/nio/ByteBuffer;";
    /// Java: a direct buffer in native order, or null.
    OptionalBuffer: (), "ByteBuffer" "Ljava/nio/ByteBuffer;";
    /// Java: a direct buffer in native order to fill.
    BufferOut: (), "ByteBuffer" "Ljava/nio/ByteBuffer;";
}

/// A structure to read, or null for its defaults: in Java a list of doubles.
pub struct In<T>(PhantomData<T>);

/// A structure to write, whose size the caller sets: in Java a list of doubles.
pub struct Out<T>(PhantomData<T>);

/// A member of an enumeration.
pub struct Choice<T>(PhantomData<T>);

impl<T: Enumeration> Kind for Choice<T> {
    type C = T;
    const JAVA: [&str; 2] = Count::JAVA;

    fn c() -> String {
        T::NAME.into()
    }
}

impl<T: Growing> Kind for In<T> {
    type C = *const T;
    const JAVA: [&str; 2] = List::JAVA;

    fn c() -> String {
        format!("*const {}", T::NAME)
    }
}

impl<T: Growing> Kind for Out<T> {
    type C = *mut T;
    const JAVA: [&str; 2] = List::JAVA;

    fn c() -> String {
        format!("*mut {}", T::NAME)
    }
}
