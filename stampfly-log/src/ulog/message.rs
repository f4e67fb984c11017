//! [`Message`]: one message of a log, borrowed from its bytes.

use super::{Declaration, Format, SYNC_MAGIC, Take};
use stampfly_types::Instant;

/// Compatibility flags, and offsets of data that was appended after the flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlagBits {
    /// Features that a reader may ignore.
    pub compatible: [u8; 8],
    /// Features that a reader must support. Bit 0 of the first byte: data was appended.
    pub incompatible: [u8; 8],
    /// Byte offsets of appended data, zero where unused.
    pub appended: [u64; 3],
}

impl FlagBits {
    /// Bit of the first incompatible byte: data was appended, see `appended`.
    pub const DATA_APPENDED: u8 = 1;

    /// Whether this crate supports all incompatible features.
    #[must_use]
    pub fn is_readable(&self) -> bool {
        let [first, rest @ ..] = self.incompatible;
        first & !Self::DATA_APPENDED == 0 && rest == [0; 7]
    }

    pub(super) fn parse(payload: &[u8]) -> Option<Self> {
        let mut take = Take(payload);
        Some(Self {
            compatible: take.array()?,
            incompatible: take.array()?,
            appended: [take.u64()?, take.u64()?, take.u64()?],
        })
    }
}

/// The value of a parameter. ULog supports only these two types.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterValue {
    /// `float`
    Float(f32),
    /// `int32_t`
    Int32(i32),
}

impl From<f32> for ParameterValue {
    fn from(value: f32) -> Self {
        Self::Float(value)
    }
}

impl From<i32> for ParameterValue {
    fn from(value: i32) -> Self {
        Self::Int32(value)
    }
}

/// Severity of a line of text, with the levels of the Linux kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// The vehicle is unusable.
    Emergency = 0,
    /// Act immediately.
    Alert = 1,
    /// Critical condition.
    Critical = 2,
    /// Error.
    Error = 3,
    /// Warning.
    Warning = 4,
    /// Normal but significant.
    Notice = 5,
    /// Information.
    Info = 6,
    /// For developers.
    Debug = 7,
}

impl Level {
    const ALL: [Self; 8] = [
        Self::Emergency,
        Self::Alert,
        Self::Critical,
        Self::Error,
        Self::Warning,
        Self::Notice,
        Self::Info,
        Self::Debug,
    ];

    pub(super) fn to_char(self) -> u8 {
        b'0' + self as u8
    }

    /// PX4 writes the digit as a character; other writers store the number itself.
    fn from_char(byte: u8) -> Option<Self> {
        let number = if byte < 8 { byte } else { byte.checked_sub(b'0')? };
        Self::ALL.get(usize::from(number)).copied()
    }
}

/// One message of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Message<'a> {
    /// Compatibility flags.
    FlagBits(FlagBits),
    /// The layout of a kind of sample.
    Format(Format<'a>),
    /// A fact about the flight.
    Info {
        /// Type, number of elements and name.
        key: Declaration<'a>,
        /// The bytes of the value.
        value: &'a [u8],
    },
    /// A fact in several parts.
    MultiInfo {
        /// Whether this part continues the previous one with the same name.
        continued: bool,
        /// Type, number of elements and name.
        key: Declaration<'a>,
        /// The bytes of the value.
        value: &'a [u8],
    },
    /// The value of a parameter at the start of the log, or from this message on.
    Parameter {
        /// The parameter's name.
        name: &'a str,
        /// Its value.
        value: ParameterValue,
    },
    /// The default of a parameter.
    ParameterDefault {
        /// Bit 0: default of the system, bit 1: default of the present configuration.
        types: u8,
        /// The parameter's name.
        name: &'a str,
        /// Its default.
        value: ParameterValue,
    },
    /// Assigns a number to a topic. Data messages with this number that follow are its samples.
    Subscription {
        /// The number assigned.
        id: u16,
        /// Distinguishes topics with the same name.
        instance: u8,
        /// Name of the topic's format.
        topic: &'a str,
    },
    /// Ends the data with this number.
    Unsubscription {
        /// The number of the topic.
        id: u16,
    },
    /// One sample.
    Data {
        /// The number assigned by a subscription.
        id: u16,
        /// The sample, in the layout of its format. Trailing padding may be missing.
        payload: &'a [u8],
    },
    /// A line of text.
    Text {
        /// Severity.
        level: Level,
        /// Tag of the source, if the log has one.
        tag: Option<u16>,
        /// Time of the line.
        at: Instant,
        /// The line.
        text: &'a str,
    },
    /// A mark at which a reader resynchronises after damage.
    Sync,
    /// Data is missing because the log could not keep up.
    Dropout {
        /// Length of the gap, ms.
        duration: u16,
    },
    /// A type that this crate does not support.
    Unknown {
        /// The message's type.
        kind: u8,
        /// Its payload.
        payload: &'a [u8],
    },
}

impl<'a> Message<'a> {
    /// Parses a payload; `None` when it does not have the structure of its type.
    pub(super) fn parse(kind: u8, payload: &'a [u8]) -> Option<Self> {
        let mut take = Take(payload);
        Some(match kind {
            b'B' => Self::FlagBits(FlagBits::parse(payload)?),
            b'F' => {
                let (name, fields) = take.text()?.split_once(':')?;
                Self::Format(Format { name, fields })
            }
            b'I' => {
                let key = key(&mut take)?;
                Self::Info { key, value: take.0 }
            }
            b'M' => {
                let continued = take.u8()? != 0;
                let key = key(&mut take)?;
                Self::MultiInfo { continued, key, value: take.0 }
            }
            b'P' => {
                let (name, value) = parameter(&mut take)?;
                Self::Parameter { name, value }
            }
            b'Q' => {
                let types = take.u8()?;
                let (name, value) = parameter(&mut take)?;
                Self::ParameterDefault { types, name, value }
            }
            b'A' => {
                let (instance, id) = (take.u8()?, take.u16()?);
                Self::Subscription { id, instance, topic: take.text()? }
            }
            b'R' => Self::Unsubscription { id: take.u16()? },
            b'D' => Self::Data { id: take.u16()?, payload: take.0 },
            b'L' => {
                let (level, at) = (Level::from_char(take.u8()?)?, Instant::from_micros(take.u64()?));
                Self::Text { level, tag: None, at, text: take.text()? }
            }
            b'C' => {
                let (level, tag, at) =
                    (Level::from_char(take.u8()?)?, Some(take.u16()?), Instant::from_micros(take.u64()?));
                Self::Text { level, tag, at, text: take.text()? }
            }
            b'S' => (payload == SYNC_MAGIC).then_some(Self::Sync)?,
            b'O' => Self::Dropout { duration: take.u16()? },
            _ => Self::Unknown { kind, payload },
        })
    }
}

fn key<'a>(take: &mut Take<'a>) -> Option<Declaration<'a>> {
    let length = take.u8()?;
    Declaration::parse(core::str::from_utf8(take.bytes(usize::from(length))?).ok()?)
}

fn parameter<'a>(take: &mut Take<'a>) -> Option<(&'a str, ParameterValue)> {
    let key = key(take)?;
    let value = take.u32()?;
    match key.type_name {
        "float" => Some((key.name, ParameterValue::Float(f32::from_bits(value)))),
        "int32_t" => Some((key.name, ParameterValue::Int32(value.cast_signed()))),
        _ => None,
    }
}
