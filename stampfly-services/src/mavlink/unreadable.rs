//! Messages that the dialect cannot read because a field has a value that it does not know: a command of another dialect, a mission item of one.
//!
//! Their fields stand where they stand in every dialect. A program that gets no answer repeats its question and then gives up on the vehicle, so each
//! of these is answered.

/// Longest of them, with its extensions.
const LONGEST: usize = 53;

/// A message that wants an answer although it cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unreadable {
    /// A sign of life of a kind of system that is new.
    Heartbeat,
    /// `COMMAND_LONG` or `COMMAND_INT` with this number, for this system and component.
    Command { number: u16, target: [u8; 2] },
    /// `MISSION_ITEM_INT` or `MISSION_ITEM` of this kind of mission, for this system and component.
    Item { sequence: u16, kind: u8, target: [u8; 2] },
    /// A set-point for this system and component.
    Target { target: [u8; 2] },
}

impl Unreadable {
    /// What a message of this number is.
    pub fn of(id: u32, payload: &[u8]) -> Option<Self> {
        // Zeros at the end were left out.
        let mut whole = [0; LONGEST];
        for (to, from) in whole.iter_mut().zip(payload) {
            *to = *from;
        }
        // Seven numbers of four bytes come first in commands and items.
        let &[low, high, a, b, c, d, _, _, _, kind] = whole.get(28..)?.first_chunk()?;
        let target = |at: usize| Some(Self::Target { target: *whole.get(at..)?.first_chunk()? });
        let number = u16::from_le_bytes([low, high]);
        match id {
            0 => Some(Self::Heartbeat),
            75 | 76 => Some(Self::Command { number, target: [a, b] }),
            82 => target(36),
            84 | 86 => target(50),
            39 | 73 => Some(Self::Item { sequence: number, kind, target: [c, d] }),
            _ => None,
        }
    }
}
