//! The chip's end of an SPI bus: a shift register that makes bytes of edges, and edges of bytes.
//!
//! It looks at MOSI on rising edges of the clock and sets MISO on falling ones, most significant bit first. So does the PMW3901 (PixArt's
//! data sheet R1.10, section 6.5). Bosch's chips do the same in both modes that they know: when the chip select falls they take mode 0 if
//! the clock is low and mode 3 if it is high (BST-BMI270-DS000, BST-BMP280-DS001, BST-BMM150-DS001, "automatic selection"). The choice
//! says from when on the first bit is driven: from the select, or from the first falling edge.
//!
//! Every rising edge is a bit, whatever the controller meant by it. Bits that are no whole byte when the select rises are
//! lost.

use crate::chips::SpiChip;
use stampfly_types::Instant;

const BITS: u32 = 8;

#[derive(Debug)]
pub(super) struct ChipEnd {
    /// Rising edges since the select fell.
    taken: u32,
    register: u8,
    /// The bit on MISO, counted from the select; `None` while the chip does not drive the line.
    shown: Option<u32>,
    /// The byte that is shifted out, and its number.
    answer: Option<(usize, u8)>,
}

impl ChipEnd {
    /// The chip select falls while the clock has this level.
    pub fn select(clock: bool) -> Self {
        Self { taken: 0, register: 0, shown: (!clock).then_some(0), answer: None }
    }

    /// A rising edge, after so many bits of the controller's byte.
    pub fn rise<C: SpiChip>(&mut self, chip: &mut C, mosi: bool, sent: u32, at: impl Fn(u32) -> Instant) {
        self.register = self.register << 1 | u8::from(mosi);
        self.taken += 1;
        if self.taken.is_multiple_of(BITS) {
            let (index, now) = (number(self.taken) - 1, at(sent + 1));
            self.answer(chip, index, now);
            chip.take(index, self.register, now);
        }
    }

    /// A falling edge: the next bit is shown.
    pub fn fall(&mut self) {
        self.shown = Some(self.taken);
    }

    /// The level of MISO, after so many bits of the controller's byte; high when nobody drives it.
    ///
    /// The chip is asked for a byte when its first bit is looked at, not when it is due: what nobody reads is not taken from the chip.
    pub fn miso<C: SpiChip>(&mut self, chip: &mut C, sent: u32, at: impl Fn(u32) -> Instant) -> bool {
        let Some(shown) = self.shown else { return true };
        let bit = shown % BITS;
        // The instant at which the byte is over, as when whole bytes are moved.
        let answer = self.answer(chip, number(shown), at(sent + BITS - bit));
        answer << bit & 0x80 != 0
    }

    fn answer<C: SpiChip>(&mut self, chip: &mut C, index: usize, now: Instant) -> u8 {
        match self.answer {
            Some((known, answer)) if known == index => answer,
            _ => self.answer.insert((index, chip.answer(index, now))).1,
        }
    }
}

/// The number of the byte that this bit is in.
const fn number(bit: u32) -> usize {
    (bit / BITS) as usize
}
