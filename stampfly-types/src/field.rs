//! Types that can be fields of a message, and their conversion to 32-bit words.
//!
//! | value | words |
//! |---|---|
//! | `f32`, integers of up to 32 bits, `bool`, an enumeration, a set of flags | 1 |
//! | `f64`, `u64`, `i64`, [`Instant`], [`Duration`] | 2, the low one first |
//! | [`Vec3`], [`Quat`] | 3, and 4 in the order w, x, y, z |
//! | `[T; N]` | N times those of `T`, for any N |
//! | `Option<T>` | 1 for the presence, 0 or 1, then those of `T`, zero when absent |
//! | a message | those of its fields |
//!
//! The macros [`message!`](crate::message!), [`message_enum!`](crate::message_enum!) and
//! [`message_flags!`](crate::message_flags!) implement [`Field`] for the types they declare.
//! Implement it manually for a type of your own that is stored like another `Field`, as [`Instant`]
//! is stored like a `u64`.

use crate::schema::FieldKind;
use crate::{Duration, Instant, Quat, Vec3};

/// A value inside a message with a fixed number of words.
pub trait Field: Copy {
    /// Storage of one element in the log.
    const KIND: FieldKind;
    /// Number of elements of `KIND`.
    const COUNT: usize;
    /// Number of 32-bit words of all elements together.
    const SIZE: usize;

    /// The value in a new message. Not [`Default`], which long arrays do not implement.
    fn initial() -> Self;

    /// Writes exactly [`Self::SIZE`] words. When `words` is shorter, an implementation writes only
    /// the elements that fit.
    fn write(&self, words: &mut [u32]);

    /// Reads the value back. `None` when the words do not encode a value: a `bool` of 2, an unknown
    /// variant, too few words.
    fn read(words: &[u32]) -> Option<Self>;
}

/// Implements [`Field`] for a type with a fixed number of elements, from the element's kind, their
/// number, and the conversions to and from words. For this file and the macros that declare named
/// values.
#[doc(hidden)]
#[macro_export]
macro_rules! __field {
    ($Type:ty, $kind:expr, $count:literal, |$value:ident| $write:expr, |$words:pat_param| $read:expr) => {
        impl $crate::Field for $Type {
            const KIND: $crate::FieldKind = $kind;
            const COUNT: usize = $count;
            const SIZE: usize = $count * Self::KIND.size();
            #[inline]
            fn initial() -> Self {
                Self::default()
            }
            #[inline]
            fn write(&self, words: &mut [u32]) {
                let $value = *self;
                if let Some(place) = words.first_chunk_mut() {
                    *place = $write;
                }
            }
            #[inline]
            fn read(words: &[u32]) -> Option<Self> {
                let $words = *words.first_chunk()?;
                $read
            }
        }
    };
}

/// Implements [`Field`] for scalars. Each line has the arguments of [`__field!`] for one element.
macro_rules! scalars {
    ($($Type:ty, $kind:ident, |$value:ident| $write:expr, |$words:pat_param| $read:expr;)*) => {
        $(crate::__field!($Type, FieldKind::$kind, 1, |$value| $write, |$words| $read);)*
    };
}

scalars! {
    f32, F32, |v| [v.to_bits()], |[w]| Some(f32::from_bits(w));
    u32, U32, |v| [v], |[w]| Some(w);
    i32, I32, |v| [v.cast_unsigned()], |[w]| Some(w.cast_signed());
    u16, U16, |v| [u32::from(v)], |[w]| u16::try_from(w).ok();
    i16, I16, |v| [i32::from(v).cast_unsigned()], |[w]| i16::try_from(w.cast_signed()).ok();
    u8, U8, |v| [u32::from(v)], |[w]| u8::try_from(w).ok();
    i8, I8, |v| [i32::from(v).cast_unsigned()], |[w]| i8::try_from(w.cast_signed()).ok();
    bool, Bool, |v| [u32::from(v)], |[w]| match w { 0 => Some(false), 1 => Some(true), _ => None };
    f64, F64, |v| split(v.to_bits()), |w| Some(f64::from_bits(join(w)));
    u64, U64, |v| split(v), |w| Some(join(w));
    i64, I64, |v| split(v.cast_unsigned()), |w| Some(join(w).cast_signed());
    Instant, U64, |v| split(v.as_micros()), |w| Some(Instant::from_micros(join(w)));
    Duration, U64, |v| split(v.as_micros()), |w| Some(Duration::from_micros(join(w)));
}

/// The low word, then the high word.
#[inline]
const fn split(bits: u64) -> [u32; 2] {
    [bits as u32, (bits >> 32) as u32]
}

#[inline]
const fn join([low, high]: [u32; 2]) -> u64 {
    low as u64 | (high as u64) << 32
}

crate::__field!(Vec3, FieldKind::F32, 3, |v| v.to_array().map(f32::to_bits), |words| {
    Some(Vec3::from(<[u32; 3]>::map(words, f32::from_bits)))
});

// Stored as w, x, y, z. Reading checks the length, so a corrupt log yields no invalid attitude.
crate::__field!(Quat, FieldKind::F32, 4, |v| v.wxyz().map(f32::to_bits), |words| {
    Quat::try_from(<[u32; 4]>::map(words, f32::from_bits)).ok()
});

impl<T: Field, const N: usize> Field for [T; N] {
    const KIND: FieldKind = T::KIND;
    const COUNT: usize = N * T::COUNT;
    const SIZE: usize = N * T::SIZE;
    #[inline]
    fn initial() -> Self {
        [T::initial(); N]
    }
    #[inline]
    fn write(&self, words: &mut [u32]) {
        let mut rest = words;
        for value in self {
            let Some((here, after)) = rest.split_at_mut_checked(T::SIZE) else { return };
            value.write(here);
            rest = after;
        }
    }
    #[inline]
    fn read(words: &[u32]) -> Option<Self> {
        let mut out = Self::initial();
        let mut rest = words;
        for value in &mut out {
            let (here, after) = rest.split_at_checked(T::SIZE)?;
            *value = T::read(here)?;
            rest = after;
        }
        Some(out)
    }
}

/// Reading refuses non-zero words of an absent value, so that each value has exactly one encoding.
impl<T: Field> Field for Option<T> {
    const KIND: FieldKind = FieldKind::Option { kind: &T::KIND, count: T::COUNT };
    const COUNT: usize = 1;
    const SIZE: usize = 1 + T::SIZE;
    #[inline]
    fn initial() -> Self {
        None
    }
    #[inline]
    fn write(&self, words: &mut [u32]) {
        if let Some((present, rest)) = words.split_first_mut() {
            *present = u32::from(self.is_some());
            match self {
                Some(value) => value.write(rest),
                None => rest.iter_mut().take(T::SIZE).for_each(|word| *word = 0),
            }
        }
    }
    #[inline]
    fn read(words: &[u32]) -> Option<Self> {
        let (present, rest) = words.split_first()?;
        let value = rest.get(..T::SIZE)?;
        match bool::read(&[*present])? {
            true => T::read(value).map(Some),
            false => value.iter().all(|word| *word == 0).then_some(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::fmt::Debug;
    use proptest::prelude::*;
    use std::vec;

    /// Writes into words that are not zero, reads back, and checks that one word less is refused.
    fn round_trip<T: Field + PartialEq + Debug>(value: T) -> Result<(), TestCaseError> {
        let mut words = vec![0xDEAD_BEEF; T::SIZE];
        value.write(&mut words);
        prop_assert_eq!(T::read(&words), Some(value));
        if T::SIZE > 0 {
            prop_assert_eq!(T::read(&words[1..]), None, "too few words");
        }
        let mut again = vec![0; T::SIZE];
        value.write(&mut again);
        prop_assert_eq!(words, again, "the same value has the same words");
        Ok(())
    }

    proptest! {
        #[test]
        fn every_kind_of_number_comes_back(
            (a, b, c, d, e, f, g, h) in any::<(u8, i8, u16, i16, u32, i32, u64, i64)>(),
            x in prop::num::f32::ANY.prop_filter("NaN is no equal", |x| !x.is_nan()),
            y in prop::num::f64::ANY.prop_filter("NaN is no equal", |y| !y.is_nan()),
            z: bool,
        ) {
            round_trip(a)?; round_trip(b)?; round_trip(c)?; round_trip(d)?; round_trip(e)?; round_trip(f)?;
            round_trip(g)?; round_trip(h)?; round_trip(x)?; round_trip(y)?; round_trip(z)?;
            round_trip(Instant::from_micros(g))?;
            round_trip(Duration::from_micros(g))?;
            round_trip(Vec3::new(x, -x, 1.0))?;
        }

        #[test]
        fn arrays_and_options_of_anything_come_back(
            bytes in prop::collection::vec(any::<u8>(), 64), pair: [Option<i64>; 2], nested: Option<[Option<u16>; 3]>,
            rows: [[i8; 3]; 2], signed: Option<i8>,
        ) {
            round_trip(<[u8; 64]>::try_from(bytes).expect("64 bytes"))?;
            round_trip(pair)?;
            round_trip(nested)?;
            round_trip(rows)?;
            round_trip(signed)?;
            round_trip::<[f32; 0]>([])?;
        }

        #[test]
        fn integers_refuse_what_does_not_fit(word: u32) {
            prop_assert_eq!(u8::read(&[word]).is_some(), word < 256);
            prop_assert_eq!(bool::read(&[word]).is_some(), word < 2);
            prop_assert_eq!(i16::read(&[word]), i16::try_from(word.cast_signed()).ok());
            prop_assert_eq!(i8::read(&[word]), i8::try_from(word.cast_signed()).ok());
            prop_assert_eq!(Option::<u32>::read(&[word, 5]), if word == 1 { Some(Some(5)) } else { None });
        }
    }

    #[test]
    fn an_absent_value_has_one_form() {
        let mut words = [9; 3];
        None::<u64>.write(&mut words);
        assert_eq!(words, [0; 3]);
        assert_eq!(Option::<u64>::read(&[0, 0, 1]), None);
        assert_eq!(Option::<bool>::read(&[1, 2]), None, "a present value that is none");
    }

    #[test]
    fn a_long_array_starts_as_its_elements_do() {
        assert_eq!(<[Option<u8>; 40]>::initial(), [None; 40]);
        assert_eq!(<[Quat; 2]>::initial(), [Quat::identity(); 2]);
    }

    #[test]
    fn a_quaternion_is_a_unit_quaternion() {
        assert_eq!(Quat::read(&[1.0f32.to_bits(), 0, 0, 0]), Some(Quat::identity()));
        assert_eq!(Quat::read(&[3.0f32.to_bits(), 0, 0, 0]), None, "norm 3");
    }
}
