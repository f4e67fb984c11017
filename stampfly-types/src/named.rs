//! Enumerations and sets of flags with names, for fields of messages.
//!
//! Their names are part of the schema, so a log and a console show `Flying` and `LOW_BATTERY`
//! instead of numbers. Logs store the numbers: add new ones, and never change or reuse old ones.

/// Declares an enumeration for a message field. `#[default]` marks the value in a new message.
///
/// ```
/// use stampfly_types::message_enum;
/// message_enum! {
///     /// Which way the door is.
///     pub enum Door {
///         /// It lets people pass.
///         Open = 0,
///         /// It does not.
///         #[default]
///         Shut = 1,
///     }
/// }
/// assert_eq!(Door::default(), Door::Shut);
/// assert_eq!(Door::from_number(0), Some(Door::Open));
/// assert_eq!(Door::Open.name(), "Open");
/// ```
#[macro_export]
macro_rules! message_enum {
    ($(#[$meta:meta])* $vis:vis enum $Name:ident {
        $($(#[$variant_meta:meta])* $variant:ident = $value:literal),* $(,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $vis enum $Name { $($(#[$variant_meta])* $variant = $value),* }

        impl $Name {
            /// Every variant, in declaration order.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];
            /// Every variant's name and number.
            pub const NAMES: &'static [(&'static str, u32)] = &[$((stringify!($variant), $value)),*];

            /// The variant with this number.
            #[must_use]
            pub const fn from_number(number: u32) -> Option<Self> {
                match number {
                    $($value => Some(Self::$variant),)*
                    _ => None,
                }
            }

            /// The variant's name as written in the source.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => stringify!($variant)),* }
            }
        }

        $crate::__field!(
            $Name,
            $crate::FieldKind::Enum($Name::NAMES),
            1,
            |variant| [variant as u32],
            |[number]| Self::from_number(number)
        );

        $crate::__serde_field!($Name);

        $crate::__defmt!($Name);
    };
}

/// Declares a set of named bits for a message field.
///
/// The documentation of each flag is also its text in `MEANINGS`.
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
    ($(#[$meta:meta])* $vis:vis struct $Name:ident { $($(#[doc = $doc:literal])* $FLAG:ident = $bit:literal),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        $vis struct $Name(u32);

        impl $Name {
            $($(#[doc = $doc])* pub const $FLAG: Self = Self(1 << $bit);)*
            /// The empty set.
            pub const NONE: Self = Self(0);
            /// The set of all named bits.
            pub const ALL: Self = Self(0 $(| 1 << $bit)*);
            /// Every named bit as a set of its own, in declaration order.
            pub const EACH: &'static [Self] = &[$(Self::$FLAG),*];
            /// Name and bit mask of every flag.
            pub const NAMES: &'static [(&'static str, u32)] = &[$((stringify!($FLAG), 1 << $bit)),*];
            /// Name and documentation of every flag.
            pub const MEANINGS: &'static [(&'static str, &'static str)] = &[$((stringify!($FLAG), concat!($($doc),*))),*];

            /// Whether the set contains all of `other`.
            #[must_use]
            pub const fn contains(self, other: Self) -> bool { self.0 & other.0 == other.0 }

            /// Whether the set contains any of `other`.
            #[must_use]
            pub const fn intersects(self, other: Self) -> bool { self.0 & other.0 != 0 }

            /// Whether the set is empty.
            #[must_use]
            pub const fn is_empty(self) -> bool { self.0 == 0 }

            /// The set with `other` added.
            #[must_use]
            pub const fn with(self, other: Self) -> Self { Self(self.0 | other.0) }

            /// The set with `other` removed.
            #[must_use]
            pub const fn without(self, other: Self) -> Self { Self(self.0 & !other.0) }

            /// The set with `other` added when `on`, or removed.
            #[must_use]
            pub const fn set(self, other: Self, on: bool) -> Self { if on { self.with(other) } else { self.without(other) } }

            /// The raw bits.
            #[must_use]
            pub const fn bits(self) -> u32 { self.0 }

            /// The names in the set, in declaration order.
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

        $crate::__field!(
            $Name,
            $crate::FieldKind::Flags($Name::NAMES),
            1,
            |set| [set.0],
            |[bits]| (bits & !Self::ALL.0 == 0).then_some(Self(bits))
        );

        $crate::__serde_field!($Name);

        $crate::__defmt!($Name);
    };
}

#[cfg(test)]
mod tests {
    use crate::Field;
    use crate::messages::{Alerts, FlightMode};
    use proptest::prelude::*;

    #[test]
    fn the_default_need_not_come_first() {
        assert_eq!(FlightMode::default(), FlightMode::Stabilize);
        assert_eq!(FlightMode::ALL[0], FlightMode::Acro);
        assert!(FlightMode::NAMES.is_sorted_by_key(|(_, number)| *number));
    }

    proptest! {
        #[test]
        fn numbers_and_bits_without_a_name_are_refused(word: u32) {
            prop_assert_eq!(FlightMode::read(&[word]).map(|mode| mode as u32), (word < 4).then_some(word));
            let known = word & !Alerts::ALL.bits() == 0;
            prop_assert_eq!(Alerts::read(&[word]).map(Alerts::bits), known.then_some(word));
        }
    }
}
