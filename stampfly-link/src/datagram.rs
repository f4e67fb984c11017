//! Messages as datagrams: one message of a vehicle's table per UDP packet, little-endian, with a checksum.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | u32 | magic of the protocol |
//! | 4 | u8 | version of this format, 1 |
//! | 5 | u8 | kind: which message of the table |
//! | 6 | u16 | length of the message, bytes |
//! | 8 | u32 | sequence number of the sender, wraps |
//! | 12 | u64 | time of the sender, µs since its start |
//! | 20 | … | the fields of the message in order: 4 bytes each, 8 for a time |
//! | end | u32 | CRC-32 (IEEE 802.3, as in zlib) of everything before |
//!
//! Numbers are IEEE 754 singles, truth values 0 or 1, enumerations their number. Use it between processes and over a network of
//! your own: a ground station, a component of the vehicle in another process. [`datagrams!`](crate::datagrams!) declares the
//! table; [`json`](crate::json) is the same datagram as a line of text. A datagram is valid as a whole or not used: length,
//! checksum, every number finite and in the range the table gives.
//!
//! It is not authenticated and not compact. Do not put it on a radio or an open network; for those use a link with keys.

use core::fmt;
use stampfly_types::{Instant, Message};

/// Version of the format.
pub const VERSION: u8 = 1;
const HEADER: usize = 20;
const CHECKSUM: usize = 4;

/// Length of the datagram of this message, bytes.
#[must_use]
pub const fn length<M: Message>() -> usize {
    HEADER + 4 * M::WORDS + CHECKSUM
}

/// Why something is no datagram. Nothing of it may be used then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DatagramError {
    /// Shorter or longer than its kind; when writing: longer than the buffer.
    Length,
    /// Of another protocol.
    Magic,
    /// Of another version of the format.
    Version,
    /// Not in the table.
    Kind,
    /// Damaged on the way.
    Checksum,
    /// Not one flat JSON object.
    Syntax,
    /// A JSON member is missing, unknown, or there twice.
    Member,
    /// No value of its field: a truth value of 2, an unknown enumerator, text for a number.
    Value,
    /// A number that is not finite or outside its range.
    Range,
}

impl fmt::Display for DatagramError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Length => "not the length of its kind",
            Self::Magic => "another protocol",
            Self::Version => "another version",
            Self::Kind => "unknown kind",
            Self::Checksum => "wrong checksum",
            Self::Syntax => "not one flat JSON object",
            Self::Member => "a member is missing, unknown or there twice",
            Self::Value => "no value of its field",
            Self::Range => "a number is not finite or out of range",
        })
    }
}

impl core::error::Error for DatagramError {}

/// A table of messages that travel as datagrams. Implemented by [`datagrams!`](crate::datagrams!).
pub trait Body: Sized {
    /// Tells this protocol from others.
    const MAGIC: [u8; 4];
    /// Kind and name of every message.
    const KINDS: &'static [(u8, &'static str)];

    /// Are all numbers finite and in their ranges?
    fn is_valid(&self) -> bool;

    /// Calls the visitor with the kind and the message.
    fn visit<V: Visitor>(&self, visitor: V) -> V::Output;

    /// Has the source give the message of this kind.
    ///
    /// # Errors
    /// When there is no such kind, the source has no such message, or the message is not [valid](Self::is_valid).
    fn build(kind: u8, source: impl Source) -> Result<Self, DatagramError>;
}

/// Something done with the message of a datagram, whatever its type.
pub trait Visitor {
    /// What comes out.
    type Output;
    /// Does it.
    fn message<M: Message>(self, kind: u8, message: &M) -> Self::Output;
}

/// Something a message of any type is read from.
pub trait Source {
    /// The message.
    ///
    /// # Errors
    /// When it is not this message.
    fn message<M: Message>(self) -> Result<M, DatagramError>;
}

/// One datagram of the table `B`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Datagram<B> {
    /// Sequence number of the sender.
    pub sequence: u32,
    /// Time of the sender since its start.
    pub time: Instant,
    /// The message.
    pub body: B,
}

impl<B: Body> Datagram<B> {
    /// Writes the datagram to the buffer and returns the bytes to send.
    ///
    /// # Errors
    /// When the buffer is shorter than [`length`], or the message is not valid: what must not be used is not sent.
    pub fn write<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], DatagramError> {
        if !self.body.is_valid() {
            return Err(DatagramError::Range);
        }
        self.body.visit(Writer { magic: B::MAGIC, sequence: self.sequence, time: self.time, buffer })
    }

    /// Reads a datagram.
    ///
    /// # Errors
    /// When it is none.
    pub fn read(bytes: &[u8]) -> Result<Self, DatagramError> {
        let (rest, checksum) = bytes.split_last_chunk::<CHECKSUM>().ok_or(DatagramError::Length)?;
        let (header, body) = rest.split_first_chunk::<HEADER>().ok_or(DatagramError::Length)?;
        let [m0, m1, m2, m3, version, kind, l0, l1, s0, s1, s2, s3, time @ ..] = *header;
        if [m0, m1, m2, m3] != B::MAGIC {
            return Err(DatagramError::Magic);
        }
        if version != VERSION {
            return Err(DatagramError::Version);
        }
        if body.len() != usize::from(u16::from_le_bytes([l0, l1])) {
            return Err(DatagramError::Length);
        }
        if crc32(rest) != u32::from_le_bytes(*checksum) {
            return Err(DatagramError::Checksum);
        }
        let (sequence, time) = (u32::from_le_bytes([s0, s1, s2, s3]), Instant::from_micros(u64::from_le_bytes(time)));
        Ok(Self { sequence, time, body: B::build(kind, Words(body))? })
    }
}

struct Writer<'b> {
    magic: [u8; 4],
    sequence: u32,
    time: Instant,
    buffer: &'b mut [u8],
}

impl<'b> Visitor for Writer<'b> {
    type Output = Result<&'b [u8], DatagramError>;

    fn message<M: Message>(self, kind: u8, message: &M) -> Self::Output {
        let bytes = self.buffer.get_mut(..length::<M>()).ok_or(DatagramError::Length)?;
        let (rest, checksum) = bytes.split_last_chunk_mut::<CHECKSUM>().ok_or(DatagramError::Length)?;
        let [l0, l1, ..] = (4 * M::WORDS).to_le_bytes();
        let words = message.to_words();
        let header = self.magic.into_iter().chain([VERSION, kind, l0, l1]).chain(self.sequence.to_le_bytes());
        let header = header.chain(self.time.as_micros().to_le_bytes());
        let all = header.chain(words.as_ref().iter().flat_map(|word| word.to_le_bytes()));
        rest.iter_mut().zip(all).for_each(|(to, from)| *to = from);
        *checksum = crc32(&*rest).to_le_bytes();
        Ok(bytes)
    }
}

/// The words of a message as bytes.
struct Words<'b>(&'b [u8]);

impl Source for Words<'_> {
    fn message<M: Message>(self) -> Result<M, DatagramError> {
        let (chunks, rest) = self.0.as_chunks::<4>();
        if chunks.len() != M::WORDS || !rest.is_empty() {
            return Err(DatagramError::Length);
        }
        let mut words = M::ZERO;
        words.as_mut().iter_mut().zip(chunks).for_each(|(word, bytes)| *word = u32::from_le_bytes(*bytes));
        M::from_words(&words).ok_or(DatagramError::Value)
    }
}

/// CRC-32 of IEEE 802.3: reflected polynomial 0xEDB8_8320. Bit by bit, because a datagram has some 100 bytes.
pub(crate) fn crc32<'b>(bytes: impl IntoIterator<Item = &'b u8>) -> u32 {
    !bytes.into_iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg()))
    })
}

/// Declares a table of messages that travel as datagrams: kind, name of the message, and what its values must satisfy beside
/// being finite.
///
/// ```
/// use stampfly_link::{datagrams, Datagram, DatagramError};
/// use stampfly_types::{Instant, messages::PowerData};
///
/// datagrams! {
///     /// What a charger sends.
///     pub enum ChargerBody, magic b"CHG1";
///
///     /// Its output.
///     PowerData = 1, valid if |power| power.voltage >= 0.0;
/// }
///
/// let body = PowerData { voltage: 4.2, current: 1.0, power: 4.2 }.into();
/// let datagram: Datagram<ChargerBody> = Datagram { sequence: 7, time: Instant::from_millis(20), body };
/// let mut buffer = [0; 64];
/// let length = datagram.write(&mut buffer)?.len();
/// assert_eq!(Datagram::read(&buffer[..length]), Ok(datagram));
/// buffer[21] ^= 1;
/// assert_eq!(Datagram::<ChargerBody>::read(&buffer[..length]), Err(DatagramError::Checksum));
/// # Ok::<(), DatagramError>(())
/// ```
#[macro_export]
macro_rules! datagrams {
    (
        $(#[$table_doc:meta])* $vis:vis enum $Table:ident, magic $magic:literal;
        $($(#[$doc:meta])* $Name:ident = $kind:literal, valid if |$message:pat_param| $valid:expr;)+
    ) => {
        $(#[$table_doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis enum $Table { $(#[doc = concat!("Kind ", $kind, ". ")] $(#[$doc])* $Name($Name)),+ }

        impl $crate::datagram::Body for $Table {
            const MAGIC: [u8; 4] = *$magic;
            const KINDS: &'static [(u8, &'static str)] = &[$(($kind, stringify!($Name))),+];

            fn is_valid(&self) -> bool {
                match self {
                    $(Self::$Name(message) => $crate::types::text::is_finite(message) && {
                        let $message = message;
                        $valid
                    }),+
                }
            }

            fn visit<V: $crate::datagram::Visitor>(&self, visitor: V) -> V::Output {
                match self { $(Self::$Name(message) => visitor.message($kind, message)),+ }
            }

            fn build(kind: u8, source: impl $crate::datagram::Source) -> Result<Self, $crate::DatagramError> {
                let body = match kind {
                    $($kind => Self::$Name(source.message()?),)+
                    _ => return Err($crate::DatagramError::Kind),
                };
                if Self::is_valid(&body) { Ok(body) } else { Err($crate::DatagramError::Range) }
            }
        }

        $(impl From<$Name> for $Table {
            fn from(message: $Name) -> Self { Self::$Name(message) }
        })+
    };
}
