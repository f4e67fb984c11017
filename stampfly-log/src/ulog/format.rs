//! Formats: the layout of samples, as declared in the file.
//!
//! [`Format::columns`] gives access to the numbers of a sample for plots: one [`Column`] per
//! scalar, arrays expanded. [`Format::unfolded`] does the same for formats that contain other
//! formats. To get the exact words of a message of the stack back, use
//! [`Topic::decode`](super::Topic::decode).

use core::fmt;

/// A basic ULog type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    /// `int8_t`
    I8,
    /// `uint8_t`
    U8,
    /// `int16_t`
    I16,
    /// `uint16_t`
    U16,
    /// `int32_t`
    I32,
    /// `uint32_t`
    U32,
    /// `int64_t`
    I64,
    /// `uint64_t`
    U64,
    /// `float`
    F32,
    /// `double`
    F64,
    /// `bool`
    Bool,
    /// `char`
    Char,
}

impl Scalar {
    const ALL: [(Self, &'static str, usize); 12] = [
        (Self::I8, "int8_t", 1),
        (Self::U8, "uint8_t", 1),
        (Self::I16, "int16_t", 2),
        (Self::U16, "uint16_t", 2),
        (Self::I32, "int32_t", 4),
        (Self::U32, "uint32_t", 4),
        (Self::I64, "int64_t", 8),
        (Self::U64, "uint64_t", 8),
        (Self::F32, "float", 4),
        (Self::F64, "double", 8),
        (Self::Bool, "bool", 1),
        (Self::Char, "char", 1),
    ];

    /// The type with this ULog name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known, _)| *known == name).map(|(scalar, ..)| *scalar)
    }

    fn row(self) -> (&'static str, usize) {
        Self::ALL.iter().find(|(scalar, ..)| *scalar == self).map_or(("", 0), |(_, name, size)| (*name, *size))
    }

    /// The type's ULog name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// Bytes of one value.
    #[must_use]
    pub fn size(self) -> usize {
        self.row().1
    }

    /// Reads one value from the front of `bytes` as `f64`. Exact, except for 64-bit integers beyond
    /// 2⁵³.
    #[must_use]
    pub fn read(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::I8 => f64::from(i8::from_le_bytes(*bytes.first_chunk()?)),
            Self::U8 | Self::Bool | Self::Char => f64::from(*bytes.first()?),
            Self::I16 => f64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
            Self::U16 => f64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            Self::I32 => f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
            Self::U32 => f64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
            Self::I64 => i64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Self::U64 => u64::from_le_bytes(*bytes.first_chunk()?) as f64,
            Self::F32 => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
            Self::F64 => f64::from_le_bytes(*bytes.first_chunk()?),
        })
    }
}

/// Reason why a format has no valid layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FieldError<'a> {
    /// Not of the form `type name` or `type[count] name`.
    Syntax(&'a str),
    /// A type that is not a basic one: a nested format or an unknown type.
    Nested(&'a str),
    /// This field makes the sample longer than a message can be.
    TooLong(&'a str),
    /// A type that is neither a basic one nor a format of the log.
    Unknown(&'a str),
    /// A format that contains itself, or is nested too deeply.
    TooDeep(&'a str),
    /// More fields than a sample can have.
    TooMany,
}

impl fmt::Display for FieldError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Syntax(text) => write!(f, "`{text}` is no field declaration"),
            Self::Nested(name) => write!(f, "type `{name}` is not a basic one"),
            Self::TooLong(text) => write!(f, "with `{text}` a sample is longer than a message"),
            Self::Unknown(name) => write!(f, "type `{name}` is neither a basic one nor a format of the log"),
            Self::TooDeep(name) => write!(f, "`{name}` holds itself, or formats are too deep in one another"),
            Self::TooMany => f.write_str("its fields are too many"),
        }
    }
}

impl core::error::Error for FieldError<'_> {}

/// The declaration of one field, such as `float[3] position`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Declaration<'a> {
    /// Name of the type, without brackets.
    pub type_name: &'a str,
    /// Number of elements of an array; `None` for a scalar.
    pub count: Option<usize>,
    /// Field name.
    pub name: &'a str,
}

impl<'a> Declaration<'a> {
    /// Parses `type name` or `type[count] name`. The keys of infos and parameters have the same
    /// syntax.
    #[must_use]
    pub fn parse(text: &'a str) -> Option<Self> {
        let (type_text, name) = text.trim_ascii().split_once(' ')?;
        let name = name.trim_ascii();
        let (type_name, count) = match type_text.split_once('[') {
            Some((type_name, rest)) => (type_name, Some(rest.strip_suffix(']')?.parse().ok()?)),
            None => (type_text, None),
        };
        (!type_name.is_empty() && !name.is_empty()).then_some(Self { type_name, count, name })
    }
}

/// The layout of one kind of sample.
///
/// ```
/// use stampfly_log::ulog::{Format, Scalar};
/// let format = Format { name: "wind", fields: "uint64_t timestamp;float[2] speed;uint8_t[4] _padding0;bool ok;" };
/// let columns: Vec<_> = format.columns().collect::<Result<_, _>>()?;
/// assert_eq!(columns.iter().map(|c| (c.field, c.index, c.offset)).collect::<Vec<_>>(), [
///     ("timestamp", None, 0), ("speed", Some(0), 8), ("speed", Some(1), 12), ("ok", None, 20),
/// ]);
/// # Ok::<(), stampfly_log::ulog::FieldError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format<'a> {
    /// Name of the format, to which topics refer.
    pub name: &'a str,
    /// `type field;type field;…`
    pub fields: &'a str,
}

impl<'a> Format<'a> {
    /// The declared fields, padding included.
    pub fn declarations(&self) -> impl Iterator<Item = Result<Declaration<'a>, FieldError<'a>>> + use<'a> {
        self.fields
            .split(';')
            .filter(|text| !text.trim_ascii().is_empty())
            .map(|text| Declaration::parse(text).ok_or(FieldError::Syntax(text)))
    }

    /// One column per scalar, in byte order, without padding. Ends after the first error, because
    /// the offsets after a field of unknown size are unknown.
    #[must_use]
    pub fn columns(&self) -> Columns<'a> {
        Columns { rest: self.fields, field: None, offset: 0 }
    }
}

/// Location and type of one scalar in a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column<'a> {
    /// The field's name.
    pub field: &'a str,
    /// Index in the array; `None` for a scalar field.
    pub index: Option<usize>,
    /// Type of the value.
    pub scalar: Scalar,
    /// Byte offset in the sample.
    pub offset: usize,
}

impl Column<'_> {
    /// The value in a sample's payload; `None` when the payload is too short.
    #[must_use]
    pub fn read(&self, payload: &[u8]) -> Option<f64> {
        self.scalar.read(payload.get(self.offset..)?)
    }
}

/// Iterator returned by [`Format::columns`].
#[derive(Clone, Debug)]
pub struct Columns<'a> {
    rest: &'a str,
    field: Option<(Declaration<'a>, Scalar, usize)>,
    offset: usize,
}

impl<'a> Columns<'a> {
    fn end(&mut self, error: FieldError<'a>) -> Option<Result<Column<'a>, FieldError<'a>>> {
        self.rest = "";
        self.field = None;
        Some(Err(error))
    }
}

impl<'a> Iterator for Columns<'a> {
    type Item = Result<Column<'a>, FieldError<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some((declaration, scalar, index)) = self.field {
                if index < declaration.count.unwrap_or(1) {
                    let offset = self.offset;
                    self.offset += scalar.size();
                    self.field = Some((declaration, scalar, index + 1));
                    let index = declaration.count.map(|_| index);
                    return Some(Ok(Column { field: declaration.name, index, scalar, offset }));
                }
                self.field = None;
            }
            if self.rest.is_empty() {
                return None;
            }
            let (text, rest) = self.rest.split_once(';').unwrap_or((self.rest, ""));
            self.rest = rest;
            if text.trim_ascii().is_empty() {
                continue;
            }
            let Some(declaration) = Declaration::parse(text) else { return self.end(FieldError::Syntax(text)) };
            let Some(scalar) = Scalar::from_name(declaration.type_name) else {
                return self.end(FieldError::Nested(declaration.type_name));
            };
            // Bounds the number of columns, which a damaged file may claim to be arbitrarily large.
            let count = declaration.count.unwrap_or(1);
            let size = count.saturating_mul(scalar.size());
            if self.offset.saturating_add(size) > usize::from(u16::MAX) {
                return self.end(FieldError::TooLong(text));
            }
            // ULog's own convention for bytes that hold no data.
            if declaration.name.starts_with("_padding") {
                self.offset += size;
            } else {
                self.field = Some((declaration, scalar, 0));
            }
        }
    }
}
