//! Reading a log of any origin, borrowed, without a way to panic or to loop for ever.
//!
//! The reader yields messages in file order. Damage is an item of its own and not the end: a
//! message whose inside is broken is skipped, and after damage to the framing reading goes on at
//! the next [`Message::Sync`] or at the next appended part. A program that wants intact logs alone
//! stops at the first error; all others read on and say with [`Reader::end`] how far the log is
//! whole.

use super::{End, FlagBits, HEADER, MAGIC, Message, SYNC_MAGIC, Take};
use core::fmt;
use stampfly_types::Instant;

/// What is wrong with a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReadErrorKind {
    /// The file does not begin as a ULog does.
    NotULog,
    /// The log uses features this reader does not know and must not ignore.
    Incompatible,
    /// A message of this type is not what its type promises. It was skipped.
    Malformed(u8),
    /// The file, or the part before appended data, ends inside a message; or the message's size is damaged, for it
    /// reaches that end or over a sync mark.
    Truncated,
    /// No message of ULog has this type, so the place where messages begin has been lost.
    LostFraming(u8),
    /// Nothing that is a message begins behind this one, so bytes of it may be missing, and those
    /// of the next be in it.
    NotFollowed,
}

/// Where and how a log is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadError {
    /// Byte offset of the message.
    pub offset: usize,
    /// What is wrong with it.
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
    /// Checks the header and stands before the first message.
    ///
    /// # Errors
    /// When this is no ULog, or one that must not be read by those who do not know its features.
    pub fn new(bytes: &'a [u8]) -> Result<Self, ReadError> {
        let not_ulog = ReadError { offset: 0, kind: ReadErrorKind::NotULog };
        let mut take = Take(bytes.strip_prefix(&MAGIC).ok_or(not_ulog)?);
        let _version = take.u8().ok_or(not_ulog)?;
        let started = Instant::from_micros(take.u64().ok_or(not_ulog)?);
        let mut reader = Self { bytes, at: HEADER, started, flags: FlagBits::default(), end: End::Whole };
        if let Some(Ok(Message::FlagBits(flags))) = reader.clone().next() {
            if !flags.is_readable() {
                return Err(ReadError { offset: HEADER, kind: ReadErrorKind::Incompatible });
            }
            reader.flags = flags;
        }
        Ok(reader)
    }

    /// The instant the log was started.
    #[must_use]
    pub const fn started(&self) -> Instant {
        self.started
    }

    /// Byte offset of the next message.
    #[must_use]
    pub const fn offset(&self) -> usize {
        self.at
    }

    /// How far the log is whole, as far as it has been read: complete when the iterator has ended.
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

    /// Goes on behind damage, and remembers what it cost.
    fn skip(&mut self, to: usize, kind: ReadErrorKind) -> Option<Result<Message<'a>, ReadError>> {
        let offset = core::mem::replace(&mut self.at, to);
        let skipped = to - offset;
        self.end = match self.end {
            End::Whole if kind == ReadErrorKind::Truncated && to == self.bytes.len() => {
                End::Cut { at: offset, rest: skipped }
            }
            End::Whole => End::Damaged { at: offset, places: 1, skipped },
            // Nothing follows a cut.
            End::Cut { at, rest } => End::Cut { at, rest },
            End::Damaged { at, places, skipped: before } => {
                End::Damaged { at, places: places + 1, skipped: before + skipped }
            }
        };
        Some(Err(ReadError { offset, kind }))
    }

    /// End of the part that holds offset `at`: the nearest appended part behind it, or the end of the file.
    fn part_end(&self, at: usize) -> usize {
        let is_appended = self.flags.incompatible[0] & FlagBits::DATA_APPENDED != 0;
        let offsets = self.flags.appended.iter().filter(|_| is_appended);
        let offsets = offsets.filter_map(|offset| usize::try_from(*offset).ok());
        offsets.filter(|offset| *offset > at).min().unwrap_or(usize::MAX).min(self.bytes.len())
    }

    /// Where to go on after damage at `at`: the next sync mark in this part, or the next part.
    fn resume(&self, at: usize) -> usize {
        let end = self.part_end(at);
        let rest = self.bytes.get(at + 1..end).unwrap_or_default();
        find_mark(rest).map_or(end, |skipped| at + 1 + skipped)
    }
}

/// Payloads from this size on are searched for sync marks: a damaged size swallows them.
const SUSPICIOUS: usize = 256;

/// Where a whole sync message begins.
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
        // Types to come will be letters as well; anything else means that this is no message.
        if !kind.is_ascii_alphanumeric() {
            return self.skip(self.resume(offset), ReadErrorKind::LostFraming(kind));
        }
        // Flags and marks are of one length, and a log without its flags could be another than it
        // seems.
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
