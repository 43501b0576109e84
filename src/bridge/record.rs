//! Structures of the interface, declared once: layout and documentation in C, and the list of doubles that Java passes.
//!
//! A list has the fields in their order, arrays and nested structures unrolled, without the size that C's options begin
//! with. `include/foresound.h` and the indices in `Native.java` are written from [`Record::SOURCE`] and [`Record::fields`].

use super::error::CallError;

/// A value that is one element of a list, or several in a row.
pub trait Field: Copy {
    /// Elements of the list.
    const ELEMENTS: usize;

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

macro_rules! numbers {
    ($($type:ty: $is_valid:expr, $range:literal;)*) => {$(
        impl Field for $type {
            const ELEMENTS: usize = 1;

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
    f32: |_| true, "a number";
    f64: |_| true, "a number";
    i32: |x| f64::from(x as i32) == x, "a whole number from -2147483648 to 2147483647";
    u32: |x| f64::from(x as u32) == x, "a whole number from 0 to 4294967295";
    u64: |x| x as u64 as f64 == x, "a whole number from 0 to 2^64 - 1";
}

impl<T: Field + Default, const N: usize> Field for [T; N] {
    const ELEMENTS: usize = N * T::ELEMENTS;

    fn read(name: &str, list: &mut &[f64]) -> Result<Self, CallError> {
        let mut values = [T::default(); N];
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

/// Declares a structure of the interface. `struct Name[size]` begins with its size in bytes, which C callers set.
macro_rules! record {
    (
        $(#[$meta:meta])*
        pub struct $name:ident $([$size:ident])? {
            $($(#[doc = $doc:literal])* pub $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name {
            $(
                /// Bytes of this structure in the caller's version of the header: fields beyond keep their defaults.
                pub $size: u32,
            )?
            $($(#[doc = $doc])* pub $field: $type,)*
        }

        impl $crate::bridge::record::Field for $name {
            const ELEMENTS: usize = 0 $(+ <$type as $crate::bridge::record::Field>::ELEMENTS)*;

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

        impl $crate::bridge::record::Record for $name {
            const NAME: &str = stringify!($name);
            const SOURCE: &str = stringify!(
                $(#[$meta])*
                #[repr(C)]
                pub struct $name {
                    $(
                        /// Bytes of this structure in the caller's version of the header: fields beyond keep their defaults.
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
        #[derive(Default)]
        pub struct Sample[size] {
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
