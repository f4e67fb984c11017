//! Reading logs of any origin, without copying, panics or endless loops.
//!
//! The reader yields messages in file order. Damage is an item of the iteration and does not end
//! it: a message with an invalid payload is skipped, and after damage to the framing the reader
//! continues at the next [`Message::Sync`] or at the next appended part. A program that needs an
//! intact log stops at the first error. All others continue and report [`Reader::end`].

use super::{End, FlagBits, HEADER, MAGIC, Message, SYNC_MAGIC, Take};
use core::fmt;
use stampfly_types::Instant;

/// Kind of damage in a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReadErrorKind {
    /// The file does not begin with the header of a ULog.
    NotULog,
    /// The log uses features that this reader does not support and must not ignore.
    Incompatible,
    /// A message does not have the structure of its type, which is given. It was skipped.
    Malformed(u8),
    /// The file, or the part before appended data, ends inside a message. Or the size of the
    /// message is damaged: it extends beyond that end or across a sync mark.
    Truncated,
    /// ULog has no message of this type, so the boundary between messages is lost.
    LostFraming(u8),
    /// No message begins after this one, so it may lack bytes of its own and contain bytes of the
    /// next.
    NotFollowed,
}

/// Position and kind of damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadError {
    /// Byte offset of the message.
    pub offset: usize,
    /// Kind of the damage.
    pub kind: ReadErrorKind,
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let offset = self.offset;
        match self.kind {
            ReadErrorKind::NotULog => write!(f, "not a ULog"),
            ReadErrorKind::Incompatible => write!(f, "the log at byte {offset} needs features that are not known"),
            ReadErrorKind::Malformed(kind) => {
                write!(f, "the message at byte {offset} is no valid `{}`", kind.escape_ascii())
            }
            ReadErrorKind::Truncated => write!(f, "the message at byte {offset} is cut off"),
            ReadErrorKind::LostFraming(kind) => {
                write!(f, "no message begins at byte {offset} (type {kind:#04x})")
            }
            ReadErrorKind::NotFollowed => {
                write!(f, "the message at byte {offset} may be missing bytes: no message begins behind it")
            }
        }
    }
}

impl core::error::Error for ReadError {}

/// Iterator over the messages of a log.
///
/// ```
/// use stampfly_log::ulog::{Definitions, Message, Ram, Reader};
/// use stampfly_types::Instant;
///
/// let mut memory = [0; 256];
/// let mut log = Definitions::start(Ram::new(&mut memory), Instant::ZERO)?;
/// log.info("sys_name", "StampFly")?;
/// let log = log.data(&[][..])?;
/// let infos = Reader::new(log.sink().written()).expect("a ULog").filter_map(|message| match message {
///     Ok(Message::Info { key, value }) => Some((key.name, value)),
///     _ => None,
/// });
/// assert!(infos.eq([("sys_name", &b"StampFly"[..])]));
/// # Ok::<(), stampfly_log::ulog::WriteError<stampfly_log::ulog::Full>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    started: Instant,
    flags: FlagBits,
    end: End,
}

impl<'a> Reader<'a> {
    /// Checks the header. The iteration begins with the first message.
    ///
    /// # Errors
    /// When `bytes` is not a ULog, or uses features that this reader does not support and must not
    /// ignore.
    pub fn new(bytes: &'a [u8]) -> Result<Self, ReadError> {
        let not_ulog = ReadError { offset: 0, kind: ReadErrorKind::NotULog };
        let mut take = Take(bytes.strip_prefix(&MAGIC).ok_or(not_ulog)?);
        let _version = take.u8().ok_or(not_ulog)?;
        let started = Instant::from_micros(take.u64().ok_or(not_ulog)?);
        let mut reader = Self { bytes, at: HEADER, started, flags: FlagBits::default(), end: End::Whole };
        // The flags come first. A clone reads them, so that the iteration still yields them.
        if let Some(Ok(Message::FlagBits(flags))) = reader.clone().next() {
            if !flags.is_readable() {
                return Err(ReadError { offset: HEADER, kind: ReadErrorKind::Incompatible });
            }
            reader.flags = flags;
        }
        Ok(reader)
    }

    /// Time at which the log was started.
    #[must_use]
    pub const fn started(&self) -> Instant {
        self.started
    }

    /// Byte offset of the next message.
    #[must_use]
    pub const fn offset(&self) -> usize {
        self.at
    }

    /// How much of the log could be read so far. Final when the iterator has ended.
    ///
    /// ```
    /// use stampfly_log::ulog::{Definitions, End, Ram, Reader};
    /// use stampfly_types::Instant;
    ///
    /// let mut memory = [0; 256];
    /// let mut log = Definitions::start(Ram::new(&mut memory), Instant::ZERO)?;
    /// log.info("sys_name", "StampFly")?;
    /// let log = log.data(&[][..])?;
    /// let whole = log.sink().written();
    /// let mut reader = Reader::new(&whole[..whole.len() - 1]).expect("a ULog");
    /// assert_eq!(reader.by_ref().filter(Result::is_err).count(), 1);
    /// assert_eq!(reader.end().to_string(), "cut off at byte 59: the last 27 bytes are no whole message");
    /// # Ok::<(), stampfly_log::ulog::WriteError<stampfly_log::ulog::Full>>(())
    /// ```
    #[must_use]
    pub const fn end(&self) -> End {
        self.end
    }

    /// Continues after damage, and adds it to [`end`](Self::end).
    fn skip(&mut self, to: usize, kind: ReadErrorKind) -> Option<Result<Message<'a>, ReadError>> {
        let offset = core::mem::replace(&mut self.at, to);
        let skipped = to - offset;
        self.end = match self.end {
            End::Whole if kind == ReadErrorKind::Truncated && to == self.bytes.len() => {
                End::Cut { at: offset, rest: skipped }
            }
            End::Whole => End::Damaged { at: offset, places: 1, skipped },
            // A cut is the end of the file, so nothing can follow it.
            End::Cut { at, rest } => End::Cut { at, rest },
            End::Damaged { at, places, skipped: before } => {
                End::Damaged { at, places: places + 1, skipped: before + skipped }
            }
        };
        Some(Err(ReadError { offset, kind }))
    }

    /// End of the part that contains offset `at`: the next appended part, or the end of the file.
    fn part_end(&self, at: usize) -> usize {
        // Without this flag the offsets have no meaning.
        let is_appended = self.flags.incompatible[0] & FlagBits::DATA_APPENDED != 0;
        let offsets = self.flags.appended.iter().filter(|_| is_appended);
        let offsets = offsets.filter_map(|offset| usize::try_from(*offset).ok());
        offsets.filter(|offset| *offset > at).min().unwrap_or(usize::MAX).min(self.bytes.len())
    }

    /// Where to continue after damage at `at`: the next sync mark in this part, or the next part.
    fn resume(&self, at: usize) -> usize {
        let end = self.part_end(at);
        // From the byte after the damage on, so that every resumption makes progress.
        let rest = self.bytes.get(at + 1..end).unwrap_or_default();
        find_mark(rest).map_or(end, |skipped| at + 1 + skipped)
    }
}

/// Payloads of at least this size are searched for sync marks, because a damaged size can include
/// some.
const SUSPICIOUS: usize = 256;

/// Offset of the first complete sync message.
fn find_mark(bytes: &[u8]) -> Option<usize> {
    let [s0, s1, s2, s3, s4, s5, s6, s7] = SYNC_MAGIC;
    let mark = [8, 0, b'S', s0, s1, s2, s3, s4, s5, s6, s7];
    bytes.windows(mark.len()).position(|window| window == mark)
}

impl<'a> Iterator for Reader<'a> {
    type Item = Result<Message<'a>, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        let offset = self.at;
        if offset >= self.bytes.len() {
            return None;
        }
        let part = self.bytes.get(offset..self.part_end(offset))?;
        let mut take = Take(part);
        let (size, kind) = (take.u16(), take.u8());
        let payload = size
            .and_then(|size| take.bytes(usize::from(size)))
            .filter(|payload| payload.len() < SUSPICIOUS || find_mark(payload).is_none());
        let (Some(kind), Some(payload)) = (kind, payload) else {
            return self.skip(self.resume(offset), ReadErrorKind::Truncated);
        };
        // Future types will be letters or digits as well; any other byte is not the type of a
        // message.
        if !kind.is_ascii_alphanumeric() {
            return self.skip(self.resume(offset), ReadErrorKind::LostFraming(kind));
        }
        // `B` and `S` have a fixed length. Without its flags, a log could be interpreted wrongly.
        let is_followed = take.0.get(2).is_none_or(u8::is_ascii_alphanumeric);
        if !is_followed && !matches!(kind, b'B' | b'S') {
            return self.skip(self.resume(offset), ReadErrorKind::NotFollowed);
        }
        let behind = offset + part.len() - take.0.len();
        let Some(message) = Message::parse(kind, payload) else {
            return self.skip(behind, ReadErrorKind::Malformed(kind));
        };
        self.at = behind;
        Some(Ok(message))
    }
}
