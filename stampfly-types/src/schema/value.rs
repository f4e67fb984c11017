//! A scalar of a sample as a person or a tool sees it: a number, a truth value, a name.
//!
//! [`FieldKind::value`](super::FieldKind::value) makes one of words. Not for computing in flight: a runnable has the message
//! itself.

use core::fmt;

/// A scalar of a sample, with what its kind says about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A single.
    F32(f32),
    /// A double.
    F64(f64),
    /// An unsigned integer of any size.
    Unsigned(u64),
    /// A signed integer of any size.
    Signed(i64),
    /// A truth value.
    Bool(bool),
    /// One of the named values, or a number that has no name.
    Enum {
        /// The number.
        number: u32,
        /// All names and numbers.
        names: &'static [(&'static str, u32)],
    },
    /// A set of named bits.
    Flags {
        /// The bits.
        bits: u32,
        /// All names and masks.
        names: &'static [(&'static str, u32)],
    },
}

impl Value {
    /// The value as a number: exact for everything but 64-bit integers beyond 2⁵³.
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

/// Names for what has names: `Flying`, `IMPACT LOW_BATTERY`, `none`; `7?` for a number without one.
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
