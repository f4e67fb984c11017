//! Scalar values as people and tools read them: numbers, truth values, names.
//!
//! [`FieldKind::value`](super::FieldKind::value) makes a [`Value`] from words. Not for computations
//! in flight, where a runnable has the message itself.

use core::fmt;

/// A scalar of a sample, with the names its kind defines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Single precision.
    F32(f32),
    /// Double precision.
    F64(f64),
    /// Unsigned integer of any size.
    Unsigned(u64),
    /// Signed integer of any size.
    Signed(i64),
    /// A truth value.
    Bool(bool),
    /// One of a list of named values, or a number without a name.
    Enum {
        /// The number.
        number: u32,
        /// Names and numbers of the list.
        names: &'static [(&'static str, u32)],
    },
    /// A set of named bits.
    Flags {
        /// The bits.
        bits: u32,
        /// Names and masks of the flags.
        names: &'static [(&'static str, u32)],
    },
}

impl Value {
    /// The value as a number. Exact, except for 64-bit integers beyond 2⁵³.
    #[must_use]
    pub fn as_f64(self) -> f64 {
        match self {
            Self::F32(value) => value.into(),
            Self::F64(value) => value,
            Self::Unsigned(value) => value as f64,
            Self::Signed(value) => value as f64,
            Self::Bool(value) => f64::from(u8::from(value)),
            Self::Enum { number, .. } => number.into(),
            Self::Flags { bits, .. } => bits.into(),
        }
    }
}

/// Enumerations and flags as names: `Flying`, `IMPACT LOW_BATTERY`, `none`; `7?` for a number
/// without a name.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::F32(value) => write!(f, "{value}"),
            Self::F64(value) => write!(f, "{value}"),
            Self::Unsigned(value) => write!(f, "{value}"),
            Self::Signed(value) => write!(f, "{value}"),
            Self::Bool(value) => write!(f, "{value}"),
            Self::Enum { number, names } => match names.iter().find(|(_, known)| known == number) {
                Some((name, _)) => f.write_str(name),
                None => write!(f, "{number}?"),
            },
            Self::Flags { bits: 0, .. } => f.write_str("none"),
            Self::Flags { bits, names } => {
                let set = names.iter().filter(|(_, mask)| bits & mask != 0);
                set.enumerate().try_for_each(|(place, (name, _))| {
                    let space = if place == 0 { "" } else { " " };
                    write!(f, "{space}{name}")
                })
            }
        }
    }
}
