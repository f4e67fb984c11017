//! Why a frame is not taken, and how often that was so.

use core::fmt;

/// Why a frame is not taken, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refused {
    /// Shorter or longer than any frame.
    Length,
    /// Another version, or no frame of this format.
    Version,
    /// Of a kind nobody knows, or that only this end sends.
    Kind,
    /// Sealed with a key of another number.
    KeyId,
    /// Of no session that this end is in, or an answer to an announcement that is not in force.
    Session,
    /// Not newer than the newest that was taken.
    Old,
    /// Too many bad frames in this tick: it was not looked at.
    Flood,
    /// The tag is wrong: damaged, or made by someone without the key.
    Tag,
    /// Authentic, but not of its kind's length, or with a value that must not be used.
    Content,
    /// Sealed in the future of the vehicle, whose clock has lost time: it offers a new session.
    Future,
    /// Sealed too long ago.
    Stale,
    /// Not with motors armed.
    Armed,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Length => "not the length of a frame",
            Self::Version => "another version",
            Self::Kind => "not a kind that is for this end",
            Self::KeyId => "another key",
            Self::Session => "another session",
            Self::Old => "older than the newest",
            Self::Flood => "too many bad frames",
            Self::Tag => "wrong tag",
            Self::Stale => "sealed too long ago",
            Self::Future => "sealed in the future",
            Self::Content => "a length or a value that must not be used",
            Self::Armed => "not with motors armed",
        })
    }
}

impl core::error::Error for Refused {}

/// What came in since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Taken, with something in it for the caller.
    pub accepted: u32,
    /// Taken, with nothing in it for the caller: a part of the handshake, or a command that is said again.
    pub handshakes: u32,
    /// [`Refused::Length`].
    pub length: u32,
    /// [`Refused::Version`].
    pub version: u32,
    /// [`Refused::Kind`].
    pub kind: u32,
    /// [`Refused::KeyId`].
    pub key_id: u32,
    /// [`Refused::Session`].
    pub session: u32,
    /// [`Refused::Old`].
    pub old: u32,
    /// [`Refused::Flood`].
    pub flood: u32,
    /// [`Refused::Tag`].
    pub tag: u32,
    /// [`Refused::Stale`].
    pub stale: u32,
    /// [`Refused::Future`].
    pub future: u32,
    /// [`Refused::Content`].
    pub content: u32,
    /// [`Refused::Armed`].
    pub armed: u32,
}

impl Tally {
    /// All that was refused. Wraps around, as every counter does.
    #[must_use]
    pub fn refused(&self) -> u32 {
        let Self { accepted: _, handshakes: _, length, version, kind, key_id, session, old, flood, .. } = *self;
        let Self { tag, stale, future, content, armed, .. } = *self;
        [length, version, kind, key_id, session, old, flood, tag, stale, future, content, armed]
            .iter()
            .fold(0, |sum: u32, count| sum.wrapping_add(*count))
    }

    /// Counts what became of a frame.
    pub(super) fn count<T>(&mut self, outcome: &Result<Option<T>, Refused>) {
        let counter = match outcome {
            Ok(Some(_)) => &mut self.accepted,
            Ok(None) => &mut self.handshakes,
            Err(Refused::Length) => &mut self.length,
            Err(Refused::Version) => &mut self.version,
            Err(Refused::Kind) => &mut self.kind,
            Err(Refused::KeyId) => &mut self.key_id,
            Err(Refused::Session) => &mut self.session,
            Err(Refused::Old) => &mut self.old,
            Err(Refused::Flood) => &mut self.flood,
            Err(Refused::Tag) => &mut self.tag,
            Err(Refused::Stale) => &mut self.stale,
            Err(Refused::Future) => &mut self.future,
            Err(Refused::Content) => &mut self.content,
            Err(Refused::Armed) => &mut self.armed,
        };
        *counter = counter.wrapping_add(1);
    }
}

/// Why nothing was sealed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SealError {
    /// There is no session yet: the handshake has not been.
    NoSession,
    /// The counter has come to its end: this session seals nothing more, and the next is asked for.
    Exhausted,
    /// Only the other end sends this.
    Direction,
    /// A number that is not finite or out of its range, or a text with control characters: what must not be used is not sent.
    Value,
    /// Longer than a frame.
    Length,
}

impl fmt::Display for SealError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoSession => "there is no session",
            Self::Exhausted => "the session's counter has come to its end",
            Self::Direction => "only the other end sends this",
            Self::Value => "a value that must not be used",
            Self::Length => "longer than a frame",
        })
    }
}

impl core::error::Error for SealError {}
