//! Values as bytes, little-endian on every machine, and back: for saved scenes.
//!
//! Control side. [`Reader`] takes any bytes: what does not fit makes it unsound, and its values are then zeros and empty
//! lists; whoever reads asks [`Reader::is_sound`] at the end. A list takes no more memory than its bytes deserve.

mod checksum;

use glam::{DVec2, DVec3, Vec3};

pub(crate) use checksum::checksum;

/// Collects bytes.
#[derive(Default)]
pub(crate) struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    /// The bytes so far.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// Takes bytes apart.
pub(crate) struct Reader<'a> {
    rest: &'a [u8],
    is_sound: bool,
}

impl<'a> Reader<'a> {
    /// A reader of all of these bytes.
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self {
            rest: bytes,
            is_sound: true,
        }
    }

    /// Whether all values were whole, every number finite, and no byte is left.
    pub(crate) fn is_sound(&self) -> bool {
        self.is_sound && self.rest.is_empty()
    }

    #[inline(always)]
    fn take<const N: usize>(&mut self) -> [u8; N] {
        match self.rest.split_first_chunk::<N>() {
            Some((bytes, rest)) => {
                self.rest = rest;
                *bytes
            }
            None => {
                self.is_sound = false;
                self.rest = &[];
                [0; N]
            }
        }
    }

    #[inline(always)]
    fn require(&mut self, is_sound: bool) {
        self.is_sound &= is_sound;
    }
}

/// A value that bytes hold.
pub(crate) trait Stored: Sized {
    /// Fewest bytes of a value, above zero.
    const LEAST_BYTES: usize;

    /// Appends the value's bytes.
    fn store(&self, to: &mut Writer);

    /// The next value.
    fn load(from: &mut Reader<'_>) -> Self;
}

macro_rules! number {
    ($($type:ty: $is_good:expr;)*) => {
        $(impl Stored for $type {
            const LEAST_BYTES: usize = size_of::<$type>();

            #[inline(always)]
            fn store(&self, to: &mut Writer) {
                to.bytes.extend_from_slice(&self.to_le_bytes());
            }

            #[inline(always)]
            fn load(from: &mut Reader<'_>) -> Self {
                let value = Self::from_le_bytes(from.take());
                let is_good: fn($type) -> bool = $is_good;
                from.require(is_good(value));
                value
            }
        })*
    };
}

number! {
    u32: |_| true;
    u64: |_| true;
    f32: f32::is_finite;
    f64: f64::is_finite;
}

impl Stored for usize {
    const LEAST_BYTES: usize = 8;

    fn store(&self, to: &mut Writer) {
        (*self as u64).store(to);
    }

    fn load(from: &mut Reader<'_>) -> Self {
        let value = usize::try_from(u64::load(from));
        from.require(value.is_ok());
        value.unwrap_or(0)
    }
}

impl Stored for bool {
    const LEAST_BYTES: usize = 1;

    #[inline(always)]
    fn store(&self, to: &mut Writer) {
        to.bytes.push(u8::from(*self));
    }

    #[inline(always)]
    fn load(from: &mut Reader<'_>) -> Self {
        let [value] = from.take();
        from.require(value <= 1);
        value == 1
    }
}

impl<T: Stored, const N: usize> Stored for [T; N] {
    const LEAST_BYTES: usize = N * T::LEAST_BYTES;

    #[inline(always)]
    fn store(&self, to: &mut Writer) {
        for value in self {
            value.store(to);
        }
    }

    #[inline(always)]
    fn load(from: &mut Reader<'_>) -> Self {
        std::array::from_fn(|_| T::load(from))
    }
}

impl<T: Stored> Stored for Vec<T> {
    const LEAST_BYTES: usize = 8;

    fn store(&self, to: &mut Writer) {
        to.bytes.reserve(8 + self.len() * T::LEAST_BYTES);
        self.len().store(to);
        for value in self {
            value.store(to);
        }
    }

    fn load(from: &mut Reader<'_>) -> Self {
        let count = usize::load(from);
        if count > from.rest.len() / T::LEAST_BYTES {
            from.is_sound = false;
            from.rest = &[];
            return Vec::new();
        }
        let mut list = Vec::with_capacity(count);
        list.extend((0..count).map(|_| T::load(from)));
        list
    }
}

impl Stored for String {
    const LEAST_BYTES: usize = 8;

    fn store(&self, to: &mut Writer) {
        self.len().store(to);
        to.bytes.extend_from_slice(self.as_bytes());
    }

    fn load(from: &mut Reader<'_>) -> Self {
        let count = usize::load(from);
        let Some((bytes, rest)) = from.rest.split_at_checked(count) else {
            from.is_sound = false;
            return Self::new();
        };
        from.rest = rest;
        let text = std::str::from_utf8(bytes);
        from.require(text.is_ok());
        text.unwrap_or_default().to_owned()
    }
}

macro_rules! vector {
    ($($type:ty: [$number:ty; $count:literal];)*) => {
        $(impl Stored for $type {
            const LEAST_BYTES: usize = $count * size_of::<$number>();

            #[inline(always)]
            fn store(&self, to: &mut Writer) {
                self.to_array().store(to);
            }

            #[inline(always)]
            fn load(from: &mut Reader<'_>) -> Self {
                Self::from_array(<[$number; $count]>::load(from))
            }
        })*
    };
}

vector! {
    Vec3: [f32; 3];
    DVec2: [f64; 2];
    DVec3: [f64; 3];
}

/// Makes a structure [`Stored`]: all of its fields with their types, in the order of their bytes. A field that is missing
/// does not compile.
macro_rules! stored {
    ($type:ident $(<$width:literal>)? { $($field:ident: $of:ty),* $(,)? }) => {
        impl $crate::binary::Stored for $type $(<$width>)? {
            const LEAST_BYTES: usize = 0 $(+ <$of as $crate::binary::Stored>::LEAST_BYTES)*;

            #[inline(always)]
            fn store(&self, to: &mut $crate::binary::Writer) {
                let Self { $($field),* } = self;
                $($crate::binary::Stored::store($field, to);)*
            }

            #[inline(always)]
            fn load(from: &mut $crate::binary::Reader<'_>) -> Self {
                Self { $($field: $crate::binary::Stored::load(from)),* }
            }
        }
    };
}

pub(crate) use stored;

/// Whether the starts of parts of a list, followed by its end, are in order: `parts` parts of `length` entries.
pub(crate) fn are_starts(starts: &[u32], parts: usize, length: usize) -> bool {
    starts.len() == parts + 1
        && starts.is_sorted()
        && starts.last().is_some_and(|&end| end as usize == length)
}

/// Whether all indices are below a count.
pub(crate) fn are_below(indices: &[u32], count: usize) -> bool {
    indices.iter().all(|&index| (index as usize) < count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq)]
    struct Thing {
        name: String,
        places: Vec<Vec3>,
        flags: [bool; 2],
        count: usize,
    }

    stored!(Thing {
        name: String,
        places: Vec<Vec3>,
        flags: [bool; 2],
        count: usize,
    });

    fn thing() -> (Thing, Vec<u8>) {
        let thing = Thing {
            name: "Tür".into(),
            places: vec![Vec3::X, Vec3::new(-0.0, 2.5, 1e-30)],
            flags: [true, false],
            count: 7,
        };
        let mut writer = Writer::default();
        thing.store(&mut writer);
        (thing, writer.into_bytes())
    }

    fn load(bytes: &[u8]) -> (Thing, bool) {
        let mut reader = Reader::new(bytes);
        (Thing::load(&mut reader), reader.is_sound())
    }

    #[test]
    fn values_come_back_and_bytes_are_little_endian() {
        let (thing, bytes) = thing();
        assert_eq!(
            bytes[..12],
            [4, 0, 0, 0, 0, 0, 0, 0, b'T', 0xc3, 0xbc, b'r']
        );
        assert_eq!(bytes[12..24], [2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f]);
        assert_eq!(load(&bytes), (thing, true));
    }

    #[test]
    fn bytes_that_do_not_fit_are_unsound() {
        let (_, bytes) = thing();
        for end in 0..bytes.len() {
            assert!(!load(&bytes[..end]).1, "{end} bytes");
        }
        assert!(!load(&[&bytes[..], &[0]].concat()).1);
        // A list of 2^56 entries, a letter that is none, a number that is none, a flag of 3.
        for (at, value) in [(19, 1), (9, 0xff), (23, 0x7f), (44, 3)] {
            let mut damaged = bytes.clone();
            damaged[at] = value;
            if at == 23 {
                damaged[22] = 0x80;
            }
            assert!(!load(&damaged).1, "byte {at}");
        }
    }

    #[test]
    fn starts_of_parts_are_in_order() {
        assert!(are_starts(&[0, 2, 2, 5], 3, 5));
        assert!(!are_starts(&[0, 3, 2, 5], 3, 5));
        assert!(!are_starts(&[0, 2, 5], 3, 5));
        assert!(!are_starts(&[], 0, 0));
    }
}
