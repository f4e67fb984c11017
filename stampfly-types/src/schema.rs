//! Schemas: what the words of a message mean.
//!
//! [`message!`](crate::message!) generates one [`FieldInfo`] for each field. A field may be a message itself, an option
//! or an array of such, so a schema is a tree. Tools that work on words (a log, a console, a plot) ask for its
//! [`leaves`]: scalars, and arrays of scalars, in word order, each with a flat name.
//!
//! | declaration | leaves |
//! |---|---|
//! | `height: f32` | `height` |
//! | `accel: Vec3` | `accel`, three elements |
//! | `range: Option<f32>` | `range_present`, `range` |
//! | `wind: Wind`, a message with `speed` and `sigma` | `wind_speed`, `wind_sigma` |
//! | `wheels: [Wheel; 2]`, a message with `rate` | `wheels_0_rate`, `wheels_1_rate` |
//!
//! Flat names are what logs and plots can hold: a ULog field name is letters, digits and underscores. Two fields whose
//! flat names are the same (`wind_speed: f32` beside that `wind`) cannot be told apart in a log.

mod leaf;
mod value;

pub use leaf::{Leaf, LeafName, Leaves, leaves};
pub use value::Value;

/// How one element of a field is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FieldKind {
    /// IEEE 754 single.
    F32,
    /// IEEE 754 double in two words, low first.
    F64,
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
    /// Signed 8 bits in one word.
    I8,
    /// Truth value in one word, 0 or 1.
    Bool,
    /// Unsigned 64 bits in two words, low first.
    U64,
    /// Signed 64 bits in two words, low first.
    I64,
    /// One of a list of named values, in one word.
    Enum(&'static [(&'static str, u32)]),
    /// A set of named bits, in one word.
    Flags(&'static [(&'static str, u32)]),
    /// A message with this schema.
    Message(&'static [FieldInfo]),
    /// A value that may be absent: one word, 0 or 1, then the words of the value, zero when it is absent.
    Option {
        /// How one element of the value is stored.
        kind: &'static FieldKind,
        /// How many elements the value has.
        count: usize,
    },
}

impl FieldKind {
    /// Number of words of one element.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::F64 | Self::U64 | Self::I64 => 2,
            Self::Message(fields) => {
                let (mut size, mut index) = (0, 0);
                while index < fields.len() {
                    size += fields[index].words;
                    index += 1;
                }
                size
            }
            Self::Option { kind, count } => 1 + count * kind.size(),
            _ => 1,
        }
    }

    /// The value in the words of one element; `None` when it is no scalar, or when words are missing.
    #[must_use]
    pub fn value(self, words: &[u32]) -> Option<Value> {
        let word = *words.first()?;
        let long = || words.get(1).map(|high| u64::from(word) | u64::from(*high) << 32);
        Some(match self {
            Self::F32 => Value::F32(f32::from_bits(word)),
            Self::F64 => Value::F64(f64::from_bits(long()?)),
            Self::U32 | Self::U16 | Self::U8 => Value::Unsigned(word.into()),
            Self::I32 | Self::I16 | Self::I8 => Value::Signed(word.cast_signed().into()),
            Self::U64 => Value::Unsigned(long()?),
            Self::I64 => Value::Signed(long()?.cast_signed()),
            Self::Bool => Value::Bool(word != 0),
            Self::Enum(names) => Value::Enum { number: word, names },
            Self::Flags(names) => Value::Flags { bits: word, names },
            Self::Message(_) | Self::Option { .. } => return None,
        })
    }

    /// How many levels of messages and options it has.
    const fn depth(self) -> usize {
        match self {
            Self::Message(fields) => 1 + depth(fields),
            Self::Option { kind, .. } => 1 + kind.depth(),
            _ => 0,
        }
    }
}

/// One line of a message's schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldInfo {
    /// The field's name.
    pub name: &'static str,
    /// SI unit, empty where there is none.
    pub unit: &'static str,
    /// Storage of one element.
    pub kind: FieldKind,
    /// Number of elements.
    pub count: usize,
    /// Number of words the field takes.
    pub words: usize,
}

/// Most levels of messages and options in each other, the outermost message included.
pub const MAX_DEPTH: usize = 6;

const fn depth(fields: &[FieldInfo]) -> usize {
    let (mut deepest, mut index) = (0, 0);
    while index < fields.len() {
        let depth = fields[index].kind.depth();
        if depth > deepest {
            deepest = depth;
        }
        index += 1;
    }
    deepest
}

/// Refuses at compile time what [`message!`](crate::message!) cannot refuse by its syntax.
#[doc(hidden)]
#[must_use]
pub const fn checked(fields: &'static [FieldInfo]) -> &'static [FieldInfo] {
    assert!(depth(fields) < MAX_DEPTH, "messages and options are nested deeper than stampfly_types::schema::MAX_DEPTH");
    let mut index = 0;
    while index < fields.len() {
        let dimensionless = matches!(fields[index].unit.as_bytes(), b"" | b"1");
        assert!(!dimensionless || fields[index].unit.is_empty(), "a field without a unit is declared without brackets");
        index += 1;
    }
    fields
}
