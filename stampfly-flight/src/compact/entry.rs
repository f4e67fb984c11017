//! The first word of an entry.

/// Bits of the second number.
const B: u32 = 20;
/// The largest second number.
pub(super) const MOST: u32 = (1 << B) - 1;
/// For [`Kind::Sample`]: every line of the pass saw it.
pub(super) const WHOLE_PASS: u32 = 63;
/// Bits of a line in there.
pub(super) const LINE: u32 = 6;
/// How entries are written. A reader of another version refuses them.
pub(super) const VERSION: u32 = 1;

/// What an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Kind {
    Sample = 1,
    Pass = 2,
    LatePass = 3,
    Started = 4,
    Resumed = 5,
    Refused = 6,
    Kept = 7,
    Part = 8,
    Position = 9,
    Frame = 10,
}

impl Kind {
    /// The first word.
    #[inline(always)]
    pub const fn word(self, a: u32, b: u32) -> u32 {
        (self as u32) << 28 | a << B | b
    }

    /// What a first word says. `None` when it is none.
    #[cfg(feature = "replay")]
    pub fn read(word: u32) -> Option<(Self, usize, u32)> {
        const ALL: [Kind; 10] = [
            Kind::Sample,
            Kind::Pass,
            Kind::LatePass,
            Kind::Started,
            Kind::Resumed,
            Kind::Refused,
            Kind::Kept,
            Kind::Part,
            Kind::Position,
            Kind::Frame,
        ];
        let kind = *ALL.get((word >> 28).checked_sub(1)? as usize)?;
        Some((kind, (word >> B & 0xff) as usize, word & MOST))
    }
}

/// A number of a pass's sample: the line that saw it first, and the low bits of its generation.
#[inline(always)]
pub(super) const fn seen_by(line: u32, generation: u32) -> u32 {
    line | generation << LINE & MOST
}
