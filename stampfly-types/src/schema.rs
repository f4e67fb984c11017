//! Schemas: names, types and units of the words of a message.
//!
//! [`message!`](crate::message!) generates one [`FieldInfo`] for each field. A field may itself be
//! a message, or an option or an array of messages, so a schema is a tree. Tools that work on words
//! (a log, a console, a plot) use its [`leaves`]: scalars and arrays of scalars, in word order,
//! each with a flat name.
//!
//! | declaration | leaves |
//! |---|---|
//! | `height: f32` | `height` |
//! | `accel: Vec3` | `accel`, three elements |
//! | `range: Option<f32>` | `range_present`, `range` |
//! | `wind: Wind`, a message with `speed` and `sigma` | `wind_speed`, `wind_sigma` |
//! | `wheels: [Wheel; 2]`, a message with `rate` | `wheels_0_rate`, `wheels_1_rate` |
//!
//! Logs and plots need flat names: a ULog field name consists of letters, digits and underscores.
//! Two fields with the same flat name (`wind_speed: f32` next to that `wind`) cannot be
//! distinguished in a log.

mod leaf;
mod value;

pub use leaf::{Leaf, LeafName, Leaves, leaves};
pub use value::Value;

/// Storage of one element of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FieldKind {
    /// IEEE 754 single precision, one word.
    F32,
    /// IEEE 754 double precision in two words, low word first.
    F64,
    /// Unsigned 32 bits, one word.
    U32,
    /// Signed 32 bits, one word.
    I32,
    /// Unsigned 16 bits in one word.
    U16,
    /// Signed 16 bits in one word, sign-extended.
    I16,
    /// Unsigned 8 bits in one word.
    U8,
    /// Signed 8 bits in one word, sign-extended.
    I8,
    /// Truth value in one word, 0 or 1.
    Bool,
    /// Unsigned 64 bits in two words, low word first.
    U64,
    /// Signed 64 bits in two words, low word first.
    I64,
    /// One of a list of named values, in one word.
    Enum(&'static [(&'static str, u32)]),
    /// A set of named bits, in one word.
    Flags(&'static [(&'static str, u32)]),
    /// A message with this schema.
    Message(&'static [FieldInfo]),
    /// A value that may be absent: one word, 0 or 1, then the words of the value, which are zero
    /// when it is absent.
    Option {
        /// Storage of one element of the value.
        kind: &'static FieldKind,
        /// Number of elements of the value.
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
                // A loop with an index, because iterators cannot be used in a `const fn`.
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

    /// The value of one element. `None` when the kind is a message or an option, or when words are
    /// missing.
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

    /// Number of nested levels of messages and options.
    const fn depth(self) -> usize {
        match self {
            Self::Message(fields) => 1 + depth(fields),
            Self::Option { kind, .. } => 1 + kind.depth(),
            _ => 0,
        }
    }
}

/// Schema of one field of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldInfo {
    /// The field's name.
    pub name: &'static str,
    /// SI unit, empty for dimensionless fields.
    pub unit: &'static str,
    /// Storage of one element.
    pub kind: FieldKind,
    /// Number of elements.
    pub count: usize,
    /// Number of words the field takes.
    pub words: usize,
}

/// Maximum number of nested levels of messages and options, the outermost message included.
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

/// Checks at compile time the rules that the syntax of [`message!`](crate::message!) cannot
/// express.
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
