//! A packet of the data stream, as a PC reads it.
//!
//! | offset | what |
//! |---|---|
//! | 0 | 0x50 |
//! | 1 | counter of packets, u16 |
//! | 3 | 8, the number of control cycles |
//! | 4 | 8 × 80 bytes, inertial sample and attitude |
//! | 644 | 8 × 28 bytes, position and velocity |
//! | 868 | 8 × 6 bytes, wanted rate |
//! | 916 | number of entries, u8 |
//! | 917 | entries: id u8, length u8, so many bytes |
//! | last | exclusive or of all before |

use super::{CYCLES, LONGEST, StreamCycle, StreamEntry};
use crate::fields::{Fields, exclusive_or};

pub(super) const UNIFIED: u8 = 0x50;
pub(super) const HEADER: usize = 4;
/// Where positions begin.
pub(super) const POSITIONS: usize = HEADER + CYCLES * StreamCycle::INERTIAL;
/// Where wanted rates begin.
pub(super) const WANTED: usize = POSITIONS + CYCLES * StreamCycle::POSITION;
/// Where the number of entries is.
pub(super) const COUNT: usize = WANTED + CYCLES * StreamCycle::WANTED;
/// Where entries begin.
pub(super) const ENTRIES: usize = COUNT + 1;

/// Why bytes are no packet of the data stream, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StreamError {
    /// A length that no such packet has.
    Length,
    /// Another kind of packet.
    Kind,
    /// The check is wrong.
    Check,
    /// Not eight control cycles, or not one status.
    Cycles,
    /// Entries do not end where the packet does.
    Entries,
}

impl core::fmt::Display for StreamError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Length => "not the length of such a packet",
            Self::Kind => "another kind of packet",
            Self::Check => "wrong check",
            Self::Cycles => "another number of samples",
            Self::Entries => "entries do not end with the packet",
        })
    }
}

impl core::error::Error for StreamError {}

/// Looks at what all packets of the vehicle have, and returns the counter of packets and what follows the header.
pub(super) fn open(bytes: &[u8], kind: u8, count: u8) -> Result<(u16, &[u8]), StreamError> {
    let [first, low, high, samples, rest @ .., check] = bytes else { return Err(StreamError::Length) };
    if *first != kind {
        return Err(StreamError::Kind);
    }
    if bytes.split_last().map(|(_, before)| exclusive_or(before)) != Some(*check) {
        return Err(StreamError::Check);
    }
    if *samples != count {
        return Err(StreamError::Cycles);
    }
    Ok((u16::from_le_bytes([*low, *high]), rest))
}

/// Eight control cycles and entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamPacket<'b> {
    /// Counts packets, wraps around.
    pub sequence: u16,
    inertial: &'b [u8],
    positions: &'b [u8],
    wanted: &'b [u8],
    count: u8,
    entries: &'b [u8],
}

impl<'b> StreamPacket<'b> {
    /// Reads it.
    ///
    /// # Errors
    /// When it is none. Entries that are not known here are no error.
    pub fn decode(bytes: &'b [u8]) -> Result<Self, StreamError> {
        if !(ENTRIES < bytes.len() && bytes.len() <= LONGEST) {
            return Err(StreamError::Length);
        }
        let (sequence, rest) = open(bytes, UNIFIED, CYCLES as u8)?;
        let parts = rest.split_at_checked(POSITIONS - HEADER).and_then(|(inertial, rest)| {
            let (positions, rest) = rest.split_at_checked(WANTED - POSITIONS)?;
            let (wanted, rest) = rest.split_at_checked(COUNT - WANTED)?;
            let (count, entries) = rest.split_first()?;
            Some(Self { sequence, inertial, positions, wanted, count: *count, entries })
        });
        let packet = parts.ok_or(StreamError::Length)?;
        let mut entries = packet.entries();
        entries.by_ref().for_each(drop);
        if entries.is_whole() { Ok(packet) } else { Err(StreamError::Entries) }
    }

    /// A control cycle, 0 to 7.
    #[must_use]
    pub fn cycle(&self, index: usize) -> Option<StreamCycle> {
        let inertial = self.inertial.chunks_exact(StreamCycle::INERTIAL).nth(index)?;
        let position = self.positions.chunks_exact(StreamCycle::POSITION).nth(index)?;
        let wanted = self.wanted.chunks_exact(StreamCycle::WANTED).nth(index)?;
        Some(StreamCycle::read(inertial, position, wanted))
    }

    /// All control cycles, the oldest first.
    pub fn cycles(&self) -> impl Iterator<Item = StreamCycle> + use<'b> {
        let packet = *self;
        (0..CYCLES).filter_map(move |index| packet.cycle(index))
    }

    /// All entries.
    #[must_use]
    pub const fn entries(&self) -> StreamEntries<'b> {
        StreamEntries { left: self.count, rest: self.entries }
    }
}

/// Entries of a packet, one after the other.
#[derive(Clone, Debug)]
pub struct StreamEntries<'b> {
    left: u8,
    rest: &'b [u8],
}

impl StreamEntries<'_> {
    /// Have all been read, and no byte is left?
    const fn is_whole(&self) -> bool {
        self.left == 0 && self.rest.is_empty()
    }
}

impl<'b> Iterator for StreamEntries<'b> {
    type Item = StreamEntry<'b>;

    fn next(&mut self) -> Option<Self::Item> {
        let left = self.left.checked_sub(1)?;
        let mut fields = Fields(self.rest);
        if self.rest.len() < 2 {
            return None;
        }
        let [id, size] = fields.array();
        let (data, rest) = fields.0.split_at_checked(size.into())?;
        (self.left, self.rest) = (left, rest);
        Some(StreamEntry::read(id, data))
    }
}
