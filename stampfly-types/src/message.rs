//! What can travel on the bus and into the log.
//!
//! A message is a plain struct that knows how to become a fixed number of 32-bit words and back. The bus moves
//! only words, so it needs no `unsafe`; the log stores the same words; the schema that explains them
//! ([`Message::FIELDS`]) is generated from the same declaration, with names and units.
//!
//! Declare messages with [`message!`](crate::message!), enumerations with
//! [`message_enum!`](crate::message_enum!) and bit sets with [`message_flags!`](crate::message_flags!). Do not
//! implement [`Message`] by hand. For bytes on a radio use a codec instead: words are for inside the vehicle.

use crate::{Duration, Instant, Quat, Vec3};

/// One value inside a message: how many words it takes, and how to write and read them.
pub trait Field: Copy {
    /// How the value is stored in the log.
    const KIND: FieldKind;
    /// How many elements of `KIND`.
    const COUNT: usize;
    /// How many 32-bit words.
    const WORDS: usize;

    /// Writes exactly [`Self::WORDS`] words. Words that do not fit are dropped.
    fn write(&self, words: &mut [u32]);

    /// Reads the value back; `None` when the words are no such value (a bool of 2, an unknown variant).
    fn read(words: &[u32]) -> Option<Self>;
}

/// How one element of a field is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FieldKind {
    /// IEEE 754 single.
    F32,
    /// Unsigned, one word.
    U32,
    /// Signed, one word.
    I32,
    /// Unsigned 16 bits in one word.
    U16,
    /// Signed 16 bits in one word.
    I16,
    /// Unsigned 8 bits in one word.
    U8,
    /// Truth value in one word, 0 or 1.
    Bool,
    /// Unsigned 64 bits in two words, low first.
    U64,
    /// One of a list of named values, in one word.
    Enum(&'static [(&'static str, u32)]),
    /// A set of named bits, in one word.
    Flags(&'static [(&'static str, u32)]),
}

/// One line of a message's schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldInfo {
    /// The field's name.
    pub name: &'static str,
    /// SI unit, `"1"` where there is none.
    pub unit: &'static str,
    /// Storage of one element.
    pub kind: FieldKind,
    /// Number of elements.
    pub count: usize,
    /// Number of words the field takes.
    pub words: usize,
}

/// A struct that can travel as words. Implemented by [`message!`](crate::message!) only.
pub trait Message: Copy + PartialEq + core::fmt::Debug + 'static {
    /// `[u32; Self::WORDS]`.
    type Words: Copy + AsRef<[u32]> + AsMut<[u32]> + core::fmt::Debug + 'static;
    /// Number of words.
    const WORDS: usize;
    /// All words zero.
    const ZERO: Self::Words;
    /// The message's type name.
    const NAME: &'static str;
    /// The schema, in word order.
    const FIELDS: &'static [FieldInfo];

    /// The message as words.
    fn to_words(&self) -> Self::Words;

    /// The message back from words; `None` when a field refuses its words.
    fn from_words(words: &Self::Words) -> Option<Self>;
}

macro_rules! one_word {
    ($($type:ty, $kind:ident, |$value:ident| $write:expr, |$word:ident| $read:expr;)*) => { $(
        impl Field for $type {
            const KIND: FieldKind = FieldKind::$kind;
            const COUNT: usize = 1;
            const WORDS: usize = 1;
            #[inline]
            fn write(&self, words: &mut [u32]) {
                let $value = *self;
                if let Some(word) = words.first_mut() { *word = $write }
            }
            #[inline]
            fn read(words: &[u32]) -> Option<Self> {
                let $word = *words.first()?;
                $read
            }
        }
    )* };
}

one_word! {
    f32, F32, |v| v.to_bits(), |w| Some(f32::from_bits(w));
    u32, U32, |v| v, |w| Some(w);
    i32, I32, |v| v.cast_unsigned(), |w| Some(w.cast_signed());
    u16, U16, |v| u32::from(v), |w| u16::try_from(w).ok();
    i16, I16, |v| i32::from(v).cast_unsigned(), |w| i16::try_from(w.cast_signed()).ok();
    u8, U8, |v| u32::from(v), |w| u8::try_from(w).ok();
    bool, Bool, |v| u32::from(v), |w| match w { 0 => Some(false), 1 => Some(true), _ => None };
}

impl Field for u64 {
    const KIND: FieldKind = FieldKind::U64;
    const COUNT: usize = 1;
    const WORDS: usize = 2;
    #[inline]
    fn write(&self, words: &mut [u32]) {
        if let [low, high, ..] = words {
            *low = *self as u32;
            *high = (*self >> 32) as u32;
        }
    }
    #[inline]
    fn read(words: &[u32]) -> Option<Self> {
        match words {
            [low, high, ..] => Some(u64::from(*low) | u64::from(*high) << 32),
            _ => None,
        }
    }
}

macro_rules! microseconds {
    ($($type:ty),*) => { $(
        impl Field for $type {
            const KIND: FieldKind = FieldKind::U64;
            const COUNT: usize = 1;
            const WORDS: usize = 2;
            #[inline]
            fn write(&self, words: &mut [u32]) {
                self.as_micros().write(words);
            }
            #[inline]
            fn read(words: &[u32]) -> Option<Self> {
                u64::read(words).map(Self::from_micros)
            }
        }
    )* };
}

microseconds!(Instant, Duration);

impl<T: Field + Default, const N: usize> Field for [T; N] {
    const KIND: FieldKind = T::KIND;
    const COUNT: usize = N * T::COUNT;
    const WORDS: usize = N * T::WORDS;
    #[inline]
    fn write(&self, words: &mut [u32]) {
        for (value, chunk) in self.iter().zip(words.chunks_exact_mut(T::WORDS)) {
            value.write(chunk);
        }
    }
    #[inline]
    fn read(words: &[u32]) -> Option<Self> {
        let mut out = [T::default(); N];
        for (value, chunk) in out.iter_mut().zip(words.chunks_exact(T::WORDS)) {
            *value = T::read(chunk)?;
        }
        Some(out)
    }
}

impl Field for Vec3 {
    const KIND: FieldKind = FieldKind::F32;
    const COUNT: usize = 3;
    const WORDS: usize = 3;
    #[inline]
    fn write(&self, words: &mut [u32]) {
        if let [x, y, z, ..] = words {
            *x = self.x.to_bits();
            *y = self.y.to_bits();
            *z = self.z.to_bits();
        }
    }
    #[inline]
    fn read(words: &[u32]) -> Option<Self> {
        match words {
            [x, y, z, ..] => Some(Vec3::new(f32::from_bits(*x), f32::from_bits(*y), f32::from_bits(*z))),
            _ => None,
        }
    }
}

/// Stored w, x, y, z. Refused when the norm is not within 1 % of one, so a broken log cannot smuggle in a
/// "unit" quaternion that is none.
impl Field for Quat {
    const KIND: FieldKind = FieldKind::F32;
    const COUNT: usize = 4;
    const WORDS: usize = 4;
    #[inline]
    fn write(&self, words: &mut [u32]) {
        if let [w, x, y, z, ..] = words {
            *w = self.w.to_bits();
            *x = self.i.to_bits();
            *y = self.j.to_bits();
            *z = self.k.to_bits();
        }
    }
    #[inline]
    fn read(words: &[u32]) -> Option<Self> {
        let [w, x, y, z, ..] = words else { return None };
        let [w, x, y, z] = [*w, *x, *y, *z].map(f32::from_bits);
        let norm_squared = w * w + x * x + y * y + z * z;
        (norm_squared - 1.0).abs().lt(&0.02).then(|| Quat::new_unchecked(nalgebra::Quaternion::new(w, x, y, z)))
    }
}

/// Declares a message: a plain struct, its conversion to and from words, its log schema.
///
/// Each field is `name: Type ["unit"]`; a dimensionless field has the unit `"1"`.
///
/// ```
/// use stampfly_types::{Message, Vec3, message};
///
/// message! {
///     /// Wind in the world frame.
///     pub struct Wind {
///         /// Speed towards north, east, down.
///         velocity: Vec3 ["m/s"],
///         /// Was it measured, or is it a guess?
///         measured: bool ["1"],
///     }
/// }
/// assert_eq!(Wind::WORDS, 4);
/// assert_eq!(Wind::FIELDS[0].unit, "m/s");
/// ```
#[macro_export]
macro_rules! message {
    ($(#[$meta:meta])* $vis:vis struct $Name:ident { $($(#[$field_meta:meta])* $field:ident : $type:ty [$unit:literal]),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        $vis struct $Name { $($(#[$field_meta])* pub $field: $type),* }

        impl $crate::Message for $Name {
            type Words = [u32; <Self as $crate::Message>::WORDS];
            const WORDS: usize = 0 $(+ <$type as $crate::Field>::WORDS)*;
            const ZERO: Self::Words = [0; <Self as $crate::Message>::WORDS];
            const NAME: &'static str = stringify!($Name);
            const FIELDS: &'static [$crate::FieldInfo] = &[$($crate::FieldInfo {
                name: stringify!($field),
                unit: $unit,
                kind: <$type as $crate::Field>::KIND,
                count: <$type as $crate::Field>::COUNT,
                words: <$type as $crate::Field>::WORDS,
            }),*];

            #[inline]
            fn to_words(&self) -> Self::Words {
                let mut words = Self::ZERO;
                let mut rest: &mut [u32] = &mut words;
                $(
                    let (here, after) = rest.split_at_mut(<$type as $crate::Field>::WORDS);
                    $crate::Field::write(&self.$field, here);
                    rest = after;
                )*
                let _ = rest;
                words
            }

            #[inline]
            fn from_words(words: &Self::Words) -> Option<Self> {
                let rest: &[u32] = words;
                $(
                    let (here, rest) = rest.split_at(<$type as $crate::Field>::WORDS);
                    let $field = <$type as $crate::Field>::read(here)?;
                )*
                let _ = rest;
                Some(Self { $($field),* })
            }
        }

        $crate::__serde_message!($Name);
    };
}

/// Declares an enumeration that can be a message field. The first variant is the default.
///
/// ```
/// use stampfly_types::message_enum;
/// message_enum! {
///     /// Which way the door is.
///     pub enum Door {
///         /// Nobody gets in.
///         Shut = 0,
///         /// Come in.
///         Open = 1,
///     }
/// }
/// assert_eq!(Door::from_number(1), Some(Door::Open));
/// assert_eq!(Door::Open.name(), "Open");
/// ```
#[macro_export]
macro_rules! message_enum {
    ($(#[$meta:meta])* $vis:vis enum $Name:ident {
        $(#[$first_meta:meta])* $first:ident = $first_value:literal
        $(, $(#[$variant_meta:meta])* $variant:ident = $value:literal)* $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $vis enum $Name { $(#[$first_meta])* #[default] $first = $first_value, $($(#[$variant_meta])* $variant = $value),* }

        impl $Name {
            /// Every variant, in declaration order.
            pub const ALL: &'static [Self] = &[Self::$first, $(Self::$variant),*];
            /// Every variant's name and number.
            pub const NAMES: &'static [(&'static str, u32)] =
                &[(stringify!($first), $first_value), $((stringify!($variant), $value)),*];

            /// The variant with this number.
            #[must_use]
            pub const fn from_number(number: u32) -> Option<Self> {
                match number {
                    $first_value => Some(Self::$first),
                    $($value => Some(Self::$variant),)*
                    _ => None,
                }
            }

            /// The variant's name as written in the source.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { Self::$first => stringify!($first), $(Self::$variant => stringify!($variant)),* }
            }
        }

        impl $crate::Field for $Name {
            const KIND: $crate::FieldKind = $crate::FieldKind::Enum(Self::NAMES);
            const COUNT: usize = 1;
            const WORDS: usize = 1;
            #[inline]
            fn write(&self, words: &mut [u32]) {
                if let Some(word) = words.first_mut() { *word = *self as u32 }
            }
            #[inline]
            fn read(words: &[u32]) -> Option<Self> {
                Self::from_number(*words.first()?)
            }
        }

        $crate::__serde_field!($Name);
    };
}

/// Declares a set of named bits that can be a message field.
///
/// ```
/// use stampfly_types::message_flags;
/// message_flags! {
///     /// What is on the table.
///     pub struct Table {
///         /// A plate.
///         PLATE = 0,
///         /// A glass.
///         GLASS = 1,
///     }
/// }
/// let table = Table::PLATE | Table::GLASS;
/// assert!(table.contains(Table::GLASS));
/// assert_eq!(table.without(Table::PLATE), Table::GLASS);
/// assert_eq!(table.names().collect::<Vec<_>>(), ["PLATE", "GLASS"]);
/// ```
#[macro_export]
macro_rules! message_flags {
    ($(#[$meta:meta])* $vis:vis struct $Name:ident { $($(#[$flag_meta:meta])* $FLAG:ident = $bit:literal),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        $vis struct $Name(u32);

        impl $Name {
            $($(#[$flag_meta])* pub const $FLAG: Self = Self(1 << $bit);)*
            /// Nothing.
            pub const NONE: Self = Self(0);
            /// Every named bit.
            pub const ALL: Self = Self(0 $(| 1 << $bit)*);
            /// Names and bit masks.
            pub const NAMES: &'static [(&'static str, u32)] = &[$((stringify!($FLAG), 1 << $bit)),*];

            /// Does the set hold all of `other`?
            #[must_use]
            pub const fn contains(self, other: Self) -> bool { self.0 & other.0 == other.0 }

            /// Does the set hold any of `other`?
            #[must_use]
            pub const fn intersects(self, other: Self) -> bool { self.0 & other.0 != 0 }

            /// Is the set empty?
            #[must_use]
            pub const fn is_empty(self) -> bool { self.0 == 0 }

            /// The set with `other` added.
            #[must_use]
            pub const fn with(self, other: Self) -> Self { Self(self.0 | other.0) }

            /// The set with `other` removed.
            #[must_use]
            pub const fn without(self, other: Self) -> Self { Self(self.0 & !other.0) }

            /// The set with `other` added or removed.
            #[must_use]
            pub const fn set(self, other: Self, on: bool) -> Self { if on { self.with(other) } else { self.without(other) } }

            /// The raw bits.
            #[must_use]
            pub const fn bits(self) -> u32 { self.0 }

            /// The names in the set, in bit order of declaration.
            pub fn names(self) -> impl Iterator<Item = &'static str> {
                Self::NAMES.iter().filter(move |(_, mask)| self.0 & mask != 0).map(|(name, _)| *name)
            }
        }

        impl core::ops::BitOr for $Name {
            type Output = Self;
            fn bitor(self, other: Self) -> Self { self.with(other) }
        }

        impl core::ops::BitOrAssign for $Name {
            fn bitor_assign(&mut self, other: Self) { *self = self.with(other) }
        }

        impl $crate::Field for $Name {
            const KIND: $crate::FieldKind = $crate::FieldKind::Flags(Self::NAMES);
            const COUNT: usize = 1;
            const WORDS: usize = 1;
            #[inline]
            fn write(&self, words: &mut [u32]) {
                if let Some(word) = words.first_mut() { *word = self.0 }
            }
            #[inline]
            fn read(words: &[u32]) -> Option<Self> {
                let bits = *words.first()?;
                (bits & !Self::ALL.0 == 0).then_some(Self(bits))
            }
        }

        $crate::__serde_field!($Name);
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{ImuData, PowerData, StateEstimate, SystemMode};
    use proptest::prelude::*;

    #[test]
    fn words_that_are_no_value_are_refused() {
        let mut words = SystemMode::default().to_words();
        words[0] = 77;
        assert_eq!(SystemMode::from_words(&words), None, "unknown state");
        let mut words = StateEstimate::default().to_words();
        words[0] = 3.0f32.to_bits();
        assert_eq!(StateEstimate::from_words(&words), None, "quaternion of norm 3");
    }

    #[test]
    fn schema_covers_every_word() {
        fn check<M: Message>() {
            assert_eq!(M::FIELDS.iter().map(|f| f.words).sum::<usize>(), M::WORDS, "{}", M::NAME);
        }
        check::<ImuData>();
        check::<PowerData>();
        check::<StateEstimate>();
        check::<SystemMode>();
    }

    proptest! {
        #[test]
        fn every_bit_pattern_survives(accel: [u32; 3], gyro: [u32; 3], temperature: u32) {
            let words = [accel[0], accel[1], accel[2], gyro[0], gyro[1], gyro[2], temperature];
            let sample = ImuData::from_words(&words).expect("floats accept every word");
            prop_assert_eq!(sample.to_words(), words);
        }

        #[test]
        fn integers_refuse_what_does_not_fit(word: u32) {
            prop_assert_eq!(u8::read(&[word]).is_some(), word < 256);
            prop_assert_eq!(bool::read(&[word]).is_some(), word < 2);
            prop_assert_eq!(i16::read(&[word]), i16::try_from(word as i32).ok());
        }
    }
}
