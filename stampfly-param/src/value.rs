//! Types of values in a store: numbers of every size, `bool`, and up to 32 bytes.
//!
//! Each value is stored with its kind and its name, so it is never read as another type, and a
//! store can be listed without knowing what was saved. Store an enumeration as a number and text as
//! bytes.

use core::fmt;
use sequential_storage::map::{SerializationError, Value};

/// The longest value, bytes.
pub(crate) const LONGEST: usize = 32;
/// The longest name, bytes.
pub const LONGEST_NAME: usize = 48;

/// Of which type a stored value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// `bool`.
    Bool,
    /// `u8`.
    U8,
    /// `i8`.
    I8,
    /// `u16`.
    U16,
    /// `i16`.
    I16,
    /// `u32`.
    U32,
    /// `i32`.
    I32,
    /// `u64`.
    U64,
    /// `i64`.
    I64,
    /// `f32`.
    F32,
    /// `f64`.
    F64,
    /// `[u8; N]`, with this N.
    Bytes(u8),
}

impl Kind {
    /// Numbers that stand in flash: they are never given to another kind.
    const CODES: [(u8, Self, usize); 11] = [
        (1, Self::Bool, 1),
        (2, Self::U8, 1),
        (3, Self::I8, 1),
        (4, Self::U16, 2),
        (5, Self::I16, 2),
        (6, Self::U32, 4),
        (7, Self::I32, 4),
        (8, Self::U64, 8),
        (9, Self::I64, 8),
        (10, Self::F32, 4),
        (11, Self::F64, 8),
    ];
    /// That of bytes, less their number.
    const BYTES: u8 = 0x40;

    fn code(self) -> u8 {
        match self {
            Self::Bytes(count) => Self::BYTES | count,
            other => Self::CODES.iter().find(|(_, kind, _)| *kind == other).map_or(0, |(code, ..)| *code),
        }
    }

    fn of(code: u8) -> Option<(Self, usize)> {
        if code & Self::BYTES != 0 {
            let count = code & !Self::BYTES;
            return (usize::from(count) <= LONGEST).then_some((Self::Bytes(count), usize::from(count)));
        }
        Self::CODES.iter().find(|(known, ..)| *known == code).map(|(_, kind, size)| (*kind, *size))
    }
}

/// A type that a store can keep: `bool`, integers and floating-point numbers of up to 64 bits,
/// `[u8; N]` of up to 32.
pub trait Storable: Copy + sealed::Sealed {
    /// Its kind.
    const KIND: Kind;

    #[doc(hidden)]
    fn to_stored(self) -> AnyValue;
    #[doc(hidden)]
    fn from_stored(value: &AnyValue) -> Option<Self>;
}

mod sealed {
    pub trait Sealed {}
}

/// A stored value, whatever it is. Equal when kind and bits are: −0 is not 0, and the same NaN is
/// the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnyValue {
    kind: Kind,
    /// Little-endian; zero behind the end.
    bytes: [u8; LONGEST],
}

impl AnyValue {
    /// What it is.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The value, if it is of this type.
    ///
    /// ```
    /// # use stampfly_param::AnyValue;
    /// let stored = AnyValue::from(16_777_217_u32);
    /// assert_eq!(stored.get(), Some(16_777_217_u32));
    /// assert_eq!(stored.get::<f32>(), None);
    /// ```
    #[must_use]
    pub fn get<T: Storable>(&self) -> Option<T> {
        if self.kind == T::KIND { T::from_stored(self) } else { None }
    }

    fn first<const N: usize>(&self) -> Option<[u8; N]> {
        self.bytes.first_chunk().copied()
    }

    fn new(kind: Kind, from: &[u8]) -> Self {
        let mut bytes = [0; LONGEST];
        bytes.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        Self { kind, bytes }
    }
}

impl<T: Storable> From<T> for AnyValue {
    fn from(value: T) -> Self {
        value.to_stored()
    }
}

/// Numbers as numbers, bytes in hexadecimal.
impl fmt::Display for AnyValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        macro_rules! number {
            ($Type:ty) => {
                self.get::<$Type>().map_or(Ok(()), |value| fmt::Display::fmt(&value, f))
            };
        }
        match self.kind {
            Kind::Bool => number!(bool),
            Kind::U8 => number!(u8),
            Kind::I8 => number!(i8),
            Kind::U16 => number!(u16),
            Kind::I16 => number!(i16),
            Kind::U32 => number!(u32),
            Kind::I32 => number!(i32),
            Kind::U64 => number!(u64),
            Kind::I64 => number!(i64),
            Kind::F32 => number!(f32),
            Kind::F64 => number!(f64),
            Kind::Bytes(count) => self.bytes.iter().take(count.into()).try_for_each(|byte| write!(f, "{byte:02x}")),
        }
    }
}

macro_rules! numbers {
    ($($Type:ty, $kind:ident;)*) => {$(
        impl sealed::Sealed for $Type {}
        impl Storable for $Type {
            const KIND: Kind = Kind::$kind;
            fn to_stored(self) -> AnyValue {
                AnyValue::new(Self::KIND, &self.to_le_bytes())
            }
            fn from_stored(value: &AnyValue) -> Option<Self> {
                value.first().map(Self::from_le_bytes)
            }
        }
    )*};
}

numbers! {
    u8, U8; i8, I8; u16, U16; i16, I16; u32, U32; i32, I32; u64, U64; i64, I64; f32, F32; f64, F64;
}

impl sealed::Sealed for bool {}
impl Storable for bool {
    const KIND: Kind = Kind::Bool;
    fn to_stored(self) -> AnyValue {
        AnyValue::new(Self::KIND, &[u8::from(self)])
    }
    fn from_stored(value: &AnyValue) -> Option<Self> {
        match value.first()? {
            [0] => Some(false),
            [1] => Some(true),
            _ => None,
        }
    }
}

impl<const N: usize> sealed::Sealed for [u8; N] {}
impl<const N: usize> Storable for [u8; N] {
    const KIND: Kind = {
        assert!(N <= LONGEST, "too long for a value");
        Kind::Bytes(N as u8)
    };
    fn to_stored(self) -> AnyValue {
        AnyValue::new(Self::KIND, &self)
    }
    fn from_stored(value: &AnyValue) -> Option<Self> {
        value.first()
    }
}

/// A value with its name, as it lies in flash: the kind's code, the value, the name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Item<'a> {
    pub name: &'a str,
    pub value: AnyValue,
}

impl<'a> Value<'a> for Item<'a> {
    fn serialize_into(&self, buffer: &mut [u8]) -> Result<usize, SerializationError> {
        let code = self.value.kind.code();
        let (_, size) = Kind::of(code).ok_or(SerializationError::InvalidData)?;
        let length = 1 + size + self.name.len();
        let into = buffer.get_mut(..length).ok_or(SerializationError::BufferTooSmall)?;
        let bytes = [code].into_iter().chain(self.value.bytes.into_iter().take(size)).chain(self.name.bytes());
        into.iter_mut().zip(bytes).for_each(|(to, from)| *to = from);
        Ok(length)
    }

    fn deserialize_from(buffer: &'a [u8]) -> Result<(Self, usize), SerializationError> {
        Self::read(buffer).map(|item| (item, buffer.len())).ok_or(SerializationError::InvalidFormat)
    }
}

impl<'a> Item<'a> {
    fn read(buffer: &'a [u8]) -> Option<Self> {
        let (code, rest) = buffer.split_first()?;
        let (kind, size) = Kind::of(*code)?;
        let (value, name) = rest.split_at_checked(size)?;
        Some(Self { name: core::str::from_utf8(name).ok()?, value: AnyValue::new(kind, value) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    fn round_trip<T: Storable + PartialEq + fmt::Debug>(value: T, name: &str) -> Result<(), TestCaseError> {
        let stored = AnyValue::from(value);
        prop_assert_eq!(stored.get(), Some(value));
        let mut buffer = [0xAA; 1 + LONGEST + LONGEST_NAME];
        let length = Item { name, value: stored }.serialize_into(&mut buffer).unwrap();
        let (item, read) = Item::deserialize_from(&buffer[..length]).unwrap();
        prop_assert_eq!((item, read), (Item { name, value: stored }, length));
        Ok(())
    }

    proptest! {
        #[test]
        fn every_value_comes_back_as_what_it_is(
            (a, b, c, d, e, f, g, h) in any::<(u8, i8, u16, i16, u32, i32, u64, i64)>(),
            x in prop::num::f32::ANY.prop_filter("NaN is no equal", |x| !x.is_nan()),
            y in prop::num::f64::ANY.prop_filter("NaN is no equal", |y| !y.is_nan()),
            z: bool, bytes: [u8; 16], six: [u8; 6], name in "[a-z.]{0,48}",
        ) {
            round_trip(a, &name)?; round_trip(b, &name)?; round_trip(c, &name)?; round_trip(d, &name)?;
            round_trip(e, &name)?; round_trip(f, &name)?; round_trip(g, &name)?; round_trip(h, &name)?;
            round_trip(x, &name)?; round_trip(y, &name)?; round_trip(z, &name)?; round_trip(bytes, &name)?;
            round_trip(six, &name)?; round_trip([0u8; 0], &name)?;
        }

        #[test]
        fn no_bytes_are_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
            if let Ok((item, _)) = Item::deserialize_from(&bytes) {
                let _ = (item.value.get::<bool>(), item.value.get::<f64>(), item.value.to_string());
            }
        }
    }

    #[test]
    fn values_are_no_others() {
        let stored = AnyValue::from(1u8);
        assert_eq!((stored.get::<bool>(), stored.get::<i8>(), stored.get::<[u8; 1]>()), (None, None, None));
        assert_eq!(AnyValue::from(-1i64).to_string(), "-1");
        assert_eq!(AnyValue::from(0.25f32).to_string(), "0.25");
        assert_eq!(AnyValue::from([2, 0xAB]).to_string(), "02ab");
        assert_ne!(AnyValue::from(-0.0f32), AnyValue::from(0.0f32));
    }
}
