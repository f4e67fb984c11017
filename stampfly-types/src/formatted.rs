//! [defmt](https://defmt.ferrous-systems.com) support for messages and their fields, behind the
//! feature `defmt`.
//!
//! The output is the text of `Debug`, so the macros that declare messages require nothing of the
//! fields' types, and messages of other crates compile with and without the feature. Not for the
//! flight record, which has a format of its own.

/// Implements `defmt::Format` for a message, an enumeration or a set of flags when the feature
/// `defmt` of this crate is on.
#[cfg(feature = "defmt")]
#[doc(hidden)]
#[macro_export]
macro_rules! __defmt {
    ($Name:ident) => {
        impl $crate::formatted::Format for $Name {
            fn format(&self, f: $crate::formatted::Formatter<'_>) {
                $crate::formatted::debug(self, f);
            }
        }
    };
}

#[cfg(not(feature = "defmt"))]
#[doc(hidden)]
#[macro_export]
macro_rules! __defmt {
    ($Name:ident) => {};
}

#[cfg(feature = "defmt")]
pub use defmt::{Format, Formatter};

/// Formats a value with its `Debug` implementation.
#[cfg(feature = "defmt")]
pub fn debug<T: core::fmt::Debug>(value: &T, f: Formatter<'_>) {
    defmt::write!(f, "{}", defmt::Debug2Format(value));
}
