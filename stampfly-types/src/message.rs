//! Messages: the structs that travel on the bus and are stored in the log.
//!
//! A message is a plain struct with a conversion to and from a fixed number of 32-bit words. The
//! bus moves only words and therefore needs no `unsafe`; the log stores the same words. The
//! [schema](crate::schema) ([`Message::FIELDS`]) is generated from the same declaration and gives
//! the words names and units.
//!
//! Declare messages with [`message!`](crate::message!), enumerations with
//! [`message_enum!`](crate::message_enum!) and sets of flags with
//! [`message_flags!`](crate::message_flags!). Do not implement [`Message`] manually. For bytes on a
//! radio use a codec: words are for use inside the vehicle.

use crate::schema::FieldInfo;

/// A struct that can be stored as words. Implemented only by [`message!`](crate::message!).
pub trait Message: Copy + PartialEq + core::fmt::Debug + 'static {
    /// The type `[u32; Self::WORDS]`.
    type Words: Copy + AsRef<[u32]> + AsMut<[u32]> + core::fmt::Debug + 'static;
    /// Number of words.
    const WORDS: usize;
    /// All words zero.
    const ZERO: Self::Words;
    /// Name of the struct.
    const NAME: &'static str;
    /// The schema, in the order of the words.
    const FIELDS: &'static [FieldInfo];

    /// Converts the message to words.
    fn to_words(&self) -> Self::Words;

    /// Converts words to a message. `None` when the words of a field do not encode a value.
    fn from_words(words: &Self::Words) -> Option<Self>;
}

/// Declares a message: a plain struct with conversions to and from words, and a schema.
///
/// Each field is `name: Type ["unit"]`, or `name: Type` when it has no dimension. Types are those
/// that implement [`Field`](crate::Field): numbers, vectors, instants, named values, other
/// messages, and arrays and options of these.
///
/// ```
/// use stampfly_types::{Message, Vec3, message};
///
/// message! {
///     /// Wind in the world frame.
///     pub struct Wind {
///         /// Speed towards north, east, down.
///         velocity: Vec3 ["m/s"],
///         /// One standard deviation, where it is known.
///         sigma: Option<f32> ["m/s"],
///         /// Was it measured, or is it a guess?
///         measured: bool,
///     }
/// }
/// assert_eq!(Wind::WORDS, 3 + 2 + 1);
/// assert_eq!((Wind::FIELDS[0].unit, Wind::FIELDS[2].unit), ("m/s", ""));
/// let wind = Wind { sigma: Some(0.3), ..Default::default() };
/// assert_eq!(Wind::from_words(&wind.to_words()), Some(wind));
/// ```
///
/// A dimensionless field has no brackets:
///
/// ```compile_fail
/// stampfly_types::message! {
///     /// A share.
///     pub struct Share {
///         /// Of the whole.
///         part: f32 ["1"],
///     }
/// }
/// ```
#[macro_export]
macro_rules! message {
    ($(#[$meta:meta])* $vis:vis struct $Name:ident {
        $($(#[$field_meta:meta])* $field:ident : $type:ty $([$unit:literal])?),* $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis struct $Name { $($(#[$field_meta])* pub $field: $type),* }

        impl Default for $Name {
            fn default() -> Self {
                Self { $($field: <$type as $crate::Field>::initial()),* }
            }
        }

        impl $crate::Message for $Name {
            type Words = [u32; <Self as $crate::Message>::WORDS];
            const WORDS: usize = 0 $(+ <$type as $crate::Field>::SIZE)*;
            const ZERO: Self::Words = [0; <Self as $crate::Message>::WORDS];
            const NAME: &'static str = stringify!($Name);
            const FIELDS: &'static [$crate::FieldInfo] = $crate::schema::checked(&[$($crate::FieldInfo {
                name: stringify!($field),
                unit: concat!($($unit)?),
                kind: <$type as $crate::Field>::KIND,
                count: <$type as $crate::Field>::COUNT,
                words: <$type as $crate::Field>::SIZE,
            }),*]);

            #[inline]
            fn to_words(&self) -> Self::Words {
                let mut words = Self::ZERO;
                $crate::Field::write(self, &mut words);
                words
            }

            #[inline]
            fn from_words(words: &Self::Words) -> Option<Self> {
                $crate::Field::read(words)
            }
        }

        // Evaluated here, so that an invalid schema is an error at the declaration and not only
        // where it is used.
        const _: &[$crate::FieldInfo] = <$Name as $crate::Message>::FIELDS;

        impl $crate::Field for $Name {
            const KIND: $crate::FieldKind = $crate::FieldKind::Message(<Self as $crate::Message>::FIELDS);
            const COUNT: usize = 1;
            const SIZE: usize = <Self as $crate::Message>::WORDS;

            #[inline]
            fn initial() -> Self {
                Self::default()
            }

            #[inline]
            fn write(&self, words: &mut [u32]) {
                let rest = words;
                $(
                    let Some((here, rest)) = rest.split_at_mut_checked(<$type as $crate::Field>::SIZE) else { return };
                    $crate::Field::write(&self.$field, here);
                )*
                let _ = rest;
            }

            #[inline]
            fn read(words: &[u32]) -> Option<Self> {
                let rest = words;
                $(
                    let (here, rest) = rest.split_at_checked(<$type as $crate::Field>::SIZE)?;
                    let $field = <$type as $crate::Field>::read(here)?;
                )*
                let _ = rest;
                Some(Self { $($field),* })
            }
        }

        $crate::__serde_message!($Name);

        $crate::__defmt!($Name);
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{FlightStatus, ImuData, StateEstimate};
    use proptest::prelude::*;

    #[test]
    fn words_that_are_no_value_are_refused() {
        let mut words = FlightStatus::default().to_words();
        words[0] = 77;
        assert_eq!(FlightStatus::from_words(&words), None, "unknown phase");
        let mut words = StateEstimate::default().to_words();
        words[0] = 3.0f32.to_bits();
        assert_eq!(StateEstimate::from_words(&words), None, "quaternion of norm 3");
    }

    proptest! {
        #[test]
        fn every_bit_pattern_survives(words: [u32; 8]) {
            let sample = ImuData::from_words(&words).expect("floats accept every word");
            prop_assert_eq!(sample.to_words(), words);
        }
    }
}
