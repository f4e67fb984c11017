//! Messages and their fields for [defmt](https://defmt.ferrous-systems.com), behind the feature `defmt`.
//!
//! What is sent is the text that `Debug` writes: the macros that declare messages ask nothing of the types of their fields, so another
//! crate's messages compile with and without the feature. Not for the flight record: that has its own format.

/// Makes a message, an enumeration or a set of bits printable where this crate's feature `defmt` is on.
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

/// Sends what `Debug` writes.
#[cfg(feature = "defmt")]
pub fn debug<T: core::fmt::Debug>(value: &T, f: Formatter<'_>) {
    defmt::write!(f, "{}", defmt::Debug2Format(value));
}
