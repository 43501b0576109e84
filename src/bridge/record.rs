//! Structures of the interface, declared once: layout and documentation in C, and the list of doubles that Java passes.
//!
//! A structure that a C caller owns begins with its size in the caller's header ([`Growing`]): no more than that is read or
//! written. It grows at its end, and has no padding, so each size that it ever had is a field's end. A structure without a
//! size is an element of an array, whose element size is passed beside it, or part of another structure and never changes.
//!
//! A list has the fields in their order, arrays and nested structures unrolled, without the size. `include/foresound.h` and
//! the indices in `Native.java` are written from [`Record::SOURCE`] and [`Record::fields`].

use super::error::{CallError, Status};

/// A value that is one element of a list, or several in a row.
pub trait Field: Copy {
    /// Elements of the list.
    const ELEMENTS: usize;
    /// Zero in every element.
    const ZERO: Self;

    /// The value as an initialiser in C.
    fn initializer(self) -> String;

    /// Reads the value from the front of a list.
    ///
    /// # Errors
    /// `Status::BadArgument` names the field if the list ends early or an element is out of the type's range.
    fn read(name: &str, list: &mut &[f64]) -> Result<Self, CallError>;

    /// Appends the value. Integers beyond 2^53 are rounded.
    fn write(self, list: &mut Vec<f64>);
}

/// A structure of the interface.
pub trait Record: Field {
    /// The declaration in Rust, from which cbindgen makes the C structure.
    const SOURCE: &str;
    /// The structure's name.
    const NAME: &str;
    /// Ends of the fields in bytes, the size included.
    const ENDS: &[usize];

    /// Each field's name and index in the list.
    fn fields() -> Vec<(&'static str, usize)>;

    /// The structure as a list.
    fn to_list(self) -> Vec<f64> {
        let mut list = Vec::with_capacity(Self::ELEMENTS);
        self.write(&mut list);
        list
    }

    /// The structure from a list, which the error message calls `name`.
    ///
    /// # Errors
    /// `Status::BadArgument` for a list of another length and for elements out of range.
    fn from_list(name: &str, mut list: &[f64]) -> Result<Self, CallError> {
        if list.len() != Self::ELEMENTS {
            let (length, wanted) = (list.len(), Self::ELEMENTS);
            return Err(CallError::bad(format!(
                "{name}: {length} elements instead of {wanted}"
            )));
        }
        Self::read(name, &mut list)
    }
}

/// A structure that begins with its size, and grows at its end.
pub trait Growing: Record + Default {}

/// The layout of a caller's structure: a size that the structure has in some version, or a larger one of a newer caller.
///
/// # Errors
/// `Status::BadArgument` with a static message.
pub fn check_size<T: Record>(size: u32) -> Result<usize, CallError> {
    const WRONG: &str = "a structure's size is none of its sizes; begin with its initialiser, or set size to its sizeof";
    let size = size as usize;
    let is_newer =
        size > size_of::<T>() && size <= MAX_BYTES && size.is_multiple_of(align_of::<T>());
    if is_newer || T::ENDS.contains(&size) {
        Ok(size)
    } else {
        Err(CallError::fixed(Status::BadArgument, WRONG))
    }
}

/// Largest structure of a newer caller. More is an uninitialised size.
pub const MAX_BYTES: usize = 4096;

macro_rules! numbers {
    ($($type:ty: $is_valid:expr, $range:literal, $suffix:literal;)*) => {$(
        impl Field for $type {
            const ELEMENTS: usize = 1;
            const ZERO: Self = 0 as $type;

            fn initializer(self) -> String {
                format!(concat!("{:?}", $suffix), self)
            }

            fn read(name: &str, list: &mut &[f64]) -> Result<Self, CallError> {
                let element = list.split_off_first().copied();
                let is_valid: fn(f64) -> bool = $is_valid;
                match element.filter(|element| is_valid(*element)) {
                    Some(element) => Ok(element as $type),
                    None => Err(CallError::bad(match element {
                        Some(element) => format!(concat!("{}: {} is not ", $range), name, element),
                        None => format!("{name}: is missing"),
                    })),
                }
            }

            fn write(self, list: &mut Vec<f64>) {
                list.push(self as f64);
            }
        }
    )*};
}

numbers! {
    // The engine refuses NaN and infinity where they do not belong, with the range of the setting.
    f32: |_| true, "a number", "f";
    f64: |_| true, "a number", "";
    i32: |x| f64::from(x as i32) == x, "a whole number from -2147483648 to 2147483647", "";
    u32: |x| f64::from(x as u32) == x, "a whole number from 0 to 4294967295", "u";
    u64: |x| x as u64 as f64 == x, "a whole number from 0 to 2^64 - 1", "u";
}

impl<T: Field, const N: usize> Field for [T; N] {
    const ELEMENTS: usize = N * T::ELEMENTS;
    const ZERO: Self = [T::ZERO; N];

    fn initializer(self) -> String {
        format!("{{{}}}", self.map(T::initializer).join(", "))
    }

    fn read(name: &str, list: &mut &[f64]) -> Result<Self, CallError> {
        let mut values = [T::ZERO; N];
        for value in &mut values {
            *value = T::read(name, list)?;
        }
        Ok(values)
    }

    fn write(self, list: &mut Vec<f64>) {
        for value in self {
            value.write(list);
        }
    }
}

/// Declares a structure of the interface. `struct Name[size]` begins with its size in bytes, which C callers set; with
/// `struct Name[size, zeros]` its defaults are zeros.
macro_rules! record {
    (@bytes $size:ident) => {
        size_of::<u32>()
    };
    (@growing $name:ident $size:ident) => {
        impl $crate::bridge::record::Growing for $name {}
    };
    (@initializer $name:ident $size:ident) => {
        format!("sizeof(Foresound{})", stringify!($name))
    };
    (
        $(#[$meta:meta])*
        pub struct $name:ident $([$size:ident $(, $zeros:ident)?])? {
            $($(#[doc = $doc:literal])* pub $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name {
            $(
                /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
                pub $size: u32,
            )?
            $($(#[doc = $doc])* pub $field: $type,)*
        }

        // Padding at the end would become a field of a later version, with what an older caller happens to have there.
        const _: () = assert!(
            size_of::<$name>() == 0 $(+ record!(@bytes $size))? $(+ size_of::<$type>())*,
            "the structure has padding"
        );

        $($(
            impl Default for $name {
                fn default() -> Self {
                    let $zeros = <Self as $crate::bridge::record::Field>::ZERO;
                    $zeros
                }
            }
        )?)?

        impl $crate::bridge::record::Field for $name {
            const ELEMENTS: usize = 0 $(+ <$type as $crate::bridge::record::Field>::ELEMENTS)*;
            const ZERO: Self = Self {
                $($size: size_of::<Self>() as u32,)?
                $($field: <$type as $crate::bridge::record::Field>::ZERO,)*
            };

            fn initializer(self) -> String {
                let sizes: &[String] = &[$(record!(@initializer $name $size))?];
                let fields = [$($crate::bridge::record::Field::initializer(self.$field)),*];
                format!("{{{}}}", [sizes, &fields].concat().join(", "))
            }

            fn read(_: &str, list: &mut &[f64]) -> Result<Self, $crate::bridge::CallError> {
                Ok(Self {
                    $($size: size_of::<Self>() as u32,)?
                    $($field: $crate::bridge::record::Field::read(stringify!($field), list)?,)*
                })
            }

            fn write(self, list: &mut Vec<f64>) {
                $($crate::bridge::record::Field::write(self.$field, list);)*
            }
        }

        $(record!(@growing $name $size);)?

        impl $crate::bridge::record::Record for $name {
            const NAME: &str = stringify!($name);
            const ENDS: &[usize] = &[
                $(std::mem::offset_of!(Self, $size) + size_of::<u32>(),)?
                $(std::mem::offset_of!(Self, $field) + size_of::<$type>()),*
            ];
            const SOURCE: &str = stringify!(
                $(#[$meta])*
                #[repr(C)]
                pub struct $name {
                    $(
                        /// Bytes of this structure in the caller's version of the header, set by the caller. No more are read or written.
                        pub $size: u32,
                    )?
                    $($(#[doc = $doc])* pub $field: $type,)*
                }
            );

            fn fields() -> Vec<(&'static str, usize)> {
                let lengths = [$((stringify!($field), <$type as $crate::bridge::record::Field>::ELEMENTS)),*];
                let indices = lengths.iter().scan(0, |next, (name, length)| {
                    *next += length;
                    Some((*name, *next - length))
                });
                indices.collect()
            }
        }
    };
}
pub(super) use record;

#[cfg(test)]
#[expect(unreachable_pub, reason = "the macro declares public structures")]
mod tests {
    use super::super::Status;
    use super::*;

    record! {
        /// A structure with every kind of field.
        pub struct Sample[size, zeros] {
            /// One element.
            pub count: u32,
            /// Two elements.
            pub pair: [f32; 2],
            /// Another.
            pub status: i32,
        }
    }

    #[test]
    fn lists_have_the_fields_in_their_order() {
        let list = [3.0, 0.5, -1.0, -7.0];
        let sample = Sample::from_list("sample", &list).expect("is one");
        assert_eq!((sample.count, sample.status), (3, -7));
        assert_eq!(sample.size as usize, size_of::<Sample>());
        assert_eq!(sample.to_list(), list);
        assert_eq!(Sample::fields(), [("count", 0), ("pair", 1), ("status", 3)]);
        assert!(Sample::SOURCE.contains("Two elements"));
        assert_eq!(
            sample.initializer(),
            "{sizeof(ForesoundSample), 3u, {0.5f, -1.0f}, -7}"
        );
    }

    #[test]
    fn sizes_are_ends_of_fields_or_larger() {
        let valid: Vec<u32> = (0..40)
            .filter(|size| check_size::<Sample>(*size).is_ok())
            .collect();
        assert_eq!(valid, [4, 8, 16, 20, 24, 28, 32, 36]);
        for wrong in [4097, 4100, u32::MAX] {
            assert!(check_size::<Sample>(wrong).is_err());
        }
    }

    #[test]
    fn elements_out_of_range_are_refused_by_name() {
        for wrong in [-1.0, 0.5, f64::NAN, f64::INFINITY, 1e10] {
            let error = Sample::from_list("sample", &[wrong, 0.0, 0.0, 0.0]).expect_err("no count");
            assert_eq!(error.status, Status::BadArgument);
            assert!(error.message.contains("count"), "{error}");
        }
        assert!(Sample::from_list("sample", &[1.0]).is_err());
    }
}
