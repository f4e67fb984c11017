//! Topics: lossless conversion between the words of a message and the bytes of a sample.
//!
//! A ULog field is a scalar or an array of scalars, so a message is stored as the
//! [leaves](stampfly_types::schema) of its schema: an `Option<f32>` named `range` as
//! `range_present` and `range`, a message named `wind` as `wind_speed` and so on. ULog's nested
//! formats are not used, because few tools read them.

use super::cursor::Cursor;
use super::{Scalar, TOPIC_HEAD, TOPIC_HEAD_SIZE, Take};
use core::fmt::{self, Write};
use stampfly_types::{FieldInfo, FieldKind, Instant, Leaf, leaves};

/// A topic in a log: a name and the schema of its message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Name of the topic: letters, digits and underscores.
    pub name: &'static str,
    /// Schema, [`Message::FIELDS`](stampfly_types::Message::FIELDS).
    pub fields: &'static [FieldInfo],
}

/// One published message, as input of the writer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample<'a> {
    /// The instant the data is valid for.
    pub at: Instant,
    /// Sequence number of the sample on its topic.
    pub generation: u32,
    /// The words of the message.
    pub words: &'a [u32],
}

/// Time and sequence number of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// The instant the data is valid for.
    pub at: Instant,
    /// Sequence number of the sample on its topic.
    pub generation: u32,
}

/// Reason why words are not a sample of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WordsError {
    /// Too many or too few words.
    Count,
    /// A word is out of range for the field of this name.
    Range(&'static str),
}

impl Topic {
    /// Number of words of the topic's message.
    #[must_use]
    pub fn words(&self) -> usize {
        self.fields.iter().map(|field| field.words).sum()
    }

    /// Whether samples of both topics have the same bytes, names and units.
    pub(super) fn is_stored_as(&self, other: &Self) -> bool {
        // Compares the leaves, since schemas contain each other and a comparison of them would
        // recurse.
        let mut theirs = leaves(other.fields);
        let same = leaves(self.fields).all(|leaf| {
            theirs.next().is_some_and(|other| {
                leaf.name == other.name && leaf.unit == other.unit && stored(&leaf) == stored(&other)
            })
        });
        same && theirs.next().is_none()
    }

    /// Number of bytes of a sample in the log.
    #[must_use]
    pub fn size(&self) -> usize {
        TOPIC_HEAD_SIZE
            + leaves(self.fields).map(|leaf| stored(&leaf)).map(|(scalar, count)| scalar.size() * count).sum::<usize>()
    }

    /// Reads a sample from its payload, and returns exactly the words that were written.
    ///
    /// `None` when the payload or `words` does not have the size of this topic; `words` is
    /// unspecified then. Check with [`is_format`](Self::is_format) first that the log's format is
    /// that of this topic.
    pub fn decode(&self, payload: &[u8], words: &mut [u32]) -> Option<Stamp> {
        // The sizes are equal from here on, so every read below succeeds.
        if payload.len() != self.size() || words.len() != self.words() {
            return None;
        }
        let mut take = Take(payload);
        let stamp = Stamp { at: Instant::from_micros(take.u64()?), generation: take.u32()? };
        let mut words = words.iter_mut();
        for leaf in leaves(self.fields) {
            let (scalar, count) = stored(&leaf);
            for _ in 0..count {
                let word = words.next()?;
                match scalar {
                    Scalar::U8 => *word = u32::from(take.u8()?),
                    Scalar::U16 => *word = u32::from(take.u16()?),
                    Scalar::I8 => *word = i32::from(take.u8()?.cast_signed()).cast_unsigned(),
                    Scalar::I16 => *word = i32::from(take.u16()?.cast_signed()).cast_unsigned(),
                    Scalar::U64 | Scalar::I64 | Scalar::F64 => {
                        *word = take.u32()?;
                        *words.next()? = take.u32()?;
                    }
                    _ => *word = take.u32()?,
                }
            }
        }
        Some(stamp)
    }

    /// Whether the format is the one that this crate writes for this topic.
    #[must_use]
    pub fn is_format(&self, format: &super::Format<'_>) -> bool {
        let mut rest = Expect(format.fields);
        format.name == self.name && self.write_fields(&mut rest).is_ok() && rest.0.is_empty()
    }

    /// Writes `uint64_t timestamp;uint32_t generation;…`.
    pub(super) fn write_fields(&self, out: &mut impl Write) -> fmt::Result {
        out.write_str(TOPIC_HEAD)?;
        leaves(self.fields).try_for_each(|leaf| match stored(&leaf) {
            (scalar, 1) => write!(out, "{} {};", scalar.name(), leaf.name),
            (scalar, count) => write!(out, "{}[{count}] {};", scalar.name(), leaf.name),
        })
    }

    /// Writes the payload of a sample.
    #[inline]
    pub(super) fn encode(&self, sample: &Sample<'_>, out: &mut Cursor<'_>) -> Result<(), WordsError> {
        out.put(&sample.at.as_micros().to_le_bytes());
        out.put(&sample.generation.to_le_bytes());
        let mut rest = sample.words;
        for leaf in leaves(self.fields) {
            let (words, after) = rest.split_at_checked(leaf.size()).ok_or(WordsError::Count)?;
            rest = after;
            match stored(&leaf).0 {
                Scalar::U8 => put_narrow(out, words, |word| u8::try_from(word).ok().map(u8::to_le_bytes)),
                Scalar::U16 => put_narrow(out, words, |word| u16::try_from(word).ok().map(u16::to_le_bytes)),
                Scalar::I8 => put_narrow(out, words, |word| i8::try_from(word.cast_signed()).ok().map(i8::to_le_bytes)),
                Scalar::I16 => {
                    put_narrow(out, words, |word| i16::try_from(word.cast_signed()).ok().map(i16::to_le_bytes))
                }
                // The two words of a 64-bit number are stored low word first, which is
                // little-endian.
                _ => put_narrow(out, words, |word| Some(word.to_le_bytes())),
            }
            .ok_or(WordsError::Range(leaf.name.field()))?;
        }
        if rest.is_empty() { Ok(()) } else { Err(WordsError::Count) }
    }
}

#[inline]
fn put_narrow<const N: usize>(
    out: &mut Cursor<'_>,
    words: &[u32],
    bytes: impl Fn(u32) -> Option<[u8; N]>,
) -> Option<()> {
    words.iter().try_for_each(|word| bytes(*word).map(|bytes| out.put(&bytes)))
}

/// Type and number of elements with which a leaf is stored.
#[inline]
fn stored(leaf: &Leaf) -> (Scalar, usize) {
    let scalar = match leaf.kind {
        FieldKind::F32 => Scalar::F32,
        FieldKind::F64 => Scalar::F64,
        FieldKind::U32 | FieldKind::Flags(_) => Scalar::U32,
        FieldKind::I32 => Scalar::I32,
        FieldKind::U16 => Scalar::U16,
        FieldKind::I16 => Scalar::I16,
        FieldKind::U8 | FieldKind::Bool => Scalar::U8,
        FieldKind::I8 => Scalar::I8,
        FieldKind::U64 => Scalar::U64,
        FieldKind::I64 => Scalar::I64,
        FieldKind::Enum(names) => match names.iter().map(|(_, number)| *number).max() {
            Some(0x1_0000..) => Scalar::U32,
            Some(0x100..) => Scalar::U16,
            _ => Scalar::U8,
        },
        // A kind that was added after this code: stores its words unchanged.
        _ => return (Scalar::U32, leaf.size()),
    };
    (scalar, leaf.count)
}

/// Accepts exactly the text it contains, in pieces.
struct Expect<'a>(&'a str);

impl Write for Expect<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0 = self.0.strip_prefix(text).ok_or(fmt::Error)?;
        Ok(())
    }
}
