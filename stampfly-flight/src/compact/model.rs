//! What both ends of a compact record know already: the record holds only what differs from it.
//!
//! A sample is expected as long after the one before it as that one was after its own predecessor, with the same words. An
//! activation is expected to have read as much further in each of its inputs as it did the last time. Both ends forget all of
//! it at a key frame, so that a reader may begin at each.

use stampfly_types::activation::MAX_INPUTS;
use stampfly_types::{ActivationRecord, InputRecord, Instant};

/// Words of a message that are compared with those of the sample before; those behind them are stored against zero. No sensor of
/// a vehicle at hand has more.
pub(super) const WORDS: usize = 16;

/// What an entry is, in its first byte: this bit an activation, else a sample of the topic in the low bits.
pub(super) const ACTIVATION: u8 = 0x80;
/// An activation was told another instant than the one before it.
pub(super) const NOW: u8 = 0x40;
/// An activation has read its inputs in another way than expected.
pub(super) const INPUTS: u8 = 0x20;
/// The line of an activation.
pub(super) const LINE: u8 = 0x1f;
/// The last activation of the line that follows has been refused something.
pub(super) const REFUSED: u8 = 0x7d;
/// All samples that a pass has seen are in the record.
pub(super) const PASS: u8 = 0x7e;
/// A key frame, with its length.
pub(super) const FRAME: u8 = 0x7f;
/// Something is missing before the key frame that comes next.
pub(super) const LOST: u8 = 0x7c;
/// Topics there may be at most.
pub(super) const TOPICS: usize = LOST as usize;

/// A topic so far.
#[derive(Clone, Copy)]
pub(super) struct Topic {
    pub at: u64,
    pub step: u64,
    pub generation: u32,
    pub words: [u32; WORDS],
}

impl Topic {
    pub const NEW: Self = Self { at: 0, step: 0, generation: 0, words: [0; WORDS] };

    /// The instant that is expected.
    pub const fn expected(&self) -> u64 {
        self.at.wrapping_add(self.step)
    }

    /// The word that is expected.
    pub fn word(&self, index: usize) -> u32 {
        self.words.get(index).copied().unwrap_or_default()
    }

    /// There is a sample.
    pub fn set(&mut self, at: u64, generation: u32) {
        self.step = at.wrapping_sub(self.at);
        (self.at, self.generation) = (at, generation);
    }

    /// With this word.
    pub fn set_word(&mut self, index: usize, word: u32) {
        if let Some(place) = self.words.get_mut(index) {
            *place = word;
        }
    }
}

/// A line of the activation table so far.
#[derive(Clone, Copy)]
pub(super) struct Line {
    inputs: [InputRecord; MAX_INPUTS],
    steps: [u32; MAX_INPUTS],
}

impl Line {
    pub const NEW: Self =
        Self { inputs: [InputRecord { generation: 0, taken: 0 }; MAX_INPUTS], steps: [0; MAX_INPUTS] };

    /// What is expected of an input.
    #[cfg(feature = "replay")]
    pub fn expected(&self, input: usize) -> InputRecord {
        let (last, step) = (self.inputs.get(input), self.steps.get(input));
        let (last, step) = (last.copied().unwrap_or_default(), step.copied().unwrap_or_default());
        InputRecord { generation: last.generation.wrapping_add(step), taken: last.taken }
    }

    /// An activation of this line has read its inputs. Returns a bit for each that was not read as expected; how much farther
    /// than that it was read is in `beyond` then.
    #[inline]
    pub fn set(&mut self, record: &ActivationRecord, beyond: &mut [u32; MAX_INPUTS]) -> u16 {
        let (mut unexpected, mut bit) = (0, 1);
        let places = self.inputs.iter_mut().zip(&mut self.steps).zip(beyond);
        for (input, ((last, step), beyond)) in record.inputs().iter().zip(places) {
            let moved = input.generation.wrapping_sub(last.generation);
            last.generation = input.generation;
            if moved != *step || input.taken != last.taken {
                unexpected |= bit;
                *beyond = moved.wrapping_sub(*step);
                *step = moved;
                last.taken = input.taken;
            }
            bit <<= 1;
        }
        unexpected
    }
}

/// Instants that activations are told.
#[derive(Clone, Copy)]
pub(super) struct Now {
    last: u64,
    step: u64,
}

impl Now {
    pub const NEW: Self = Self { last: 0, step: 0 };

    /// The one that the last activation was told.
    pub const fn last(&self) -> u64 {
        self.last
    }

    /// The next one that is expected, when it is another.
    pub const fn expected(&self) -> u64 {
        self.last.wrapping_add(self.step)
    }

    /// It is another.
    pub const fn set(&mut self, now: Instant) {
        self.step = now.as_micros().wrapping_sub(self.last);
        self.last = now.as_micros();
    }
}

/// A signed difference as an unsigned number, small when the difference is.
pub(super) const fn zigzag(difference: u64) -> u64 {
    (difference << 1) ^ ((difference as i64 >> 63) as u64)
}

/// The same, of 32 bits: [`unzigzag`] gives it back as a difference of 64.
pub(super) const fn zigzag32(difference: u32) -> u32 {
    (difference << 1) ^ ((difference as i32 >> 31) as u32)
}

/// The way back.
#[cfg(any(test, feature = "replay"))]
pub(super) const fn unzigzag(number: u64) -> u64 {
    (number >> 1) ^ (number & 1).wrapping_neg()
}

/// How many bytes a word takes against the one expected, as a nibble: 0 to 4 low bytes of the difference.
pub(super) const fn width(difference: u32) -> u8 {
    let signed = difference as i32;
    match signed {
        0 => 0,
        -0x80..=0x7f => 1,
        -0x8000..=0x7fff => 2,
        -0x80_0000..=0x7f_ffff => 3,
        _ => 4,
    }
}
