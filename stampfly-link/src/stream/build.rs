//! A packet that is being filled: control cycles and entries as they come, in any order.

use super::packet::{COUNT, ENTRIES, HEADER, POSITIONS, UNIFIED, WANTED};
use super::{CYCLES, LONGEST, StreamCycle, StreamEntry};
use crate::fields::exclusive_or;

/// Why something was not taken into a packet. The packet is as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StreamBuildError {
    /// It has eight control cycles.
    CyclesFull,
    /// It has fewer than eight control cycles, and no reader would take it.
    CyclesMissing,
    /// The entry does not fit any more.
    NoRoom,
    /// A number that travels in 16 bits is none.
    NotANumber,
    /// The id 0x49, which means something else where it arrives.
    Reserved,
}

impl core::fmt::Display for StreamBuildError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::CyclesFull => "there are eight control cycles",
            Self::CyclesMissing => "there are fewer than eight control cycles",
            Self::NoRoom => "the entry does not fit",
            Self::NotANumber => "a number that travels in 16 bits is none",
            Self::Reserved => "an id that means something else",
        })
    }
}

impl core::error::Error for StreamBuildError {}

/// A packet that is being filled. Its 1400 bytes are all the memory that it needs.
///
/// What did not fit is said for each entry, and [counted](Self::left_out). See [`stream`](super) for an example.
#[derive(Clone, Debug)]
pub struct StreamBuilder {
    bytes: [u8; LONGEST],
    sequence: u16,
    cycles: usize,
    /// Where the next entry begins.
    end: usize,
    entries: u8,
    left_out: u32,
}

impl StreamBuilder {
    /// An empty packet. `sequence` counts packets and wraps around, so that a reader sees what it has missed.
    #[must_use]
    pub const fn new(sequence: u16) -> Self {
        Self { bytes: [0; LONGEST], sequence, cycles: 0, end: ENTRIES, entries: 0, left_out: 0 }
    }

    /// Takes a control cycle.
    ///
    /// # Errors
    /// When there are eight, or a bias or wanted rate is no number.
    pub fn cycle(&mut self, cycle: &StreamCycle) -> Result<(), StreamBuildError> {
        let index = self.cycles;
        if index >= CYCLES {
            return Err(StreamBuildError::CyclesFull);
        }
        let (before, wanted) = self.bytes.split_at_mut(WANTED);
        let (inertial, position) = before.split_at_mut(POSITIONS);
        let inertial = inertial.get_mut(HEADER + StreamCycle::INERTIAL * index..).unwrap_or_default();
        let position = position.get_mut(StreamCycle::POSITION * index..).unwrap_or_default();
        let wanted = wanted.get_mut(StreamCycle::WANTED * index..).unwrap_or_default();
        cycle.write(inertial, position, wanted).ok_or(StreamBuildError::NotANumber)?;
        self.cycles += 1;
        Ok(())
    }

    /// Takes an entry.
    ///
    /// # Errors
    /// When it does not fit, may not be sent, or a number that travels in 16 bits is none.
    pub fn entry(&mut self, entry: &StreamEntry<'_>) -> Result<(), StreamBuildError> {
        let taken = self.place(entry);
        if taken == Err(StreamBuildError::NoRoom) {
            self.left_out = self.left_out.saturating_add(1);
        }
        taken
    }

    fn place(&mut self, entry: &StreamEntry<'_>) -> Result<(), StreamBuildError> {
        let (id, size) = entry.header().ok_or(StreamBuildError::NoRoom)?;
        if id == StreamEntry::RESERVED {
            return Err(StreamBuildError::Reserved);
        }
        let entries = self.entries.checked_add(1).ok_or(StreamBuildError::NoRoom)?;
        let end = self.end + 2 + usize::from(size);
        // The last byte is for the check.
        let Some([id_place, size_place, data @ ..]) = self.bytes.get_mut(self.end..end).filter(|_| end < LONGEST)
        else {
            return Err(StreamBuildError::NoRoom);
        };
        entry.write(data).ok_or(StreamBuildError::NotANumber)?;
        (*id_place, *size_place) = (id, size);
        (self.entries, self.end) = (entries, end);
        Ok(())
    }

    /// Control cycles so far.
    #[must_use]
    pub const fn cycles(&self) -> usize {
        self.cycles
    }

    /// Entries that did not fit so far.
    #[must_use]
    pub const fn left_out(&self) -> u32 {
        self.left_out
    }

    /// The packet as it travels. Entries that come later belong to the [next](Self::restart).
    ///
    /// # Errors
    /// With fewer than eight control cycles.
    pub fn finish(&mut self) -> Result<&[u8], StreamBuildError> {
        if self.cycles < CYCLES {
            return Err(StreamBuildError::CyclesMissing);
        }
        let [low, high] = self.sequence.to_le_bytes();
        if let Some(header) = self.bytes.first_chunk_mut() {
            *header = [UNIFIED, low, high, CYCLES as u8];
        }
        if let Some(count) = self.bytes.get_mut(COUNT) {
            *count = self.entries;
        }
        let (before, rest) = self.bytes.split_at_mut(self.end);
        if let Some(check) = rest.first_mut() {
            *check = exclusive_or(before);
        }
        Ok(self.bytes.get(..=self.end).unwrap_or_default())
    }

    /// Begins the next packet: its number is one more, and it is empty.
    pub fn restart(&mut self) {
        (self.cycles, self.end, self.entries, self.left_out) = (0, ENTRIES, 0, 0);
        self.sequence = self.sequence.wrapping_add(1);
    }
}
