//! Chip side of an SPI bus: a shift register that converts edges to bytes and bytes to edges.
//!
//! It samples MOSI on rising clock edges and changes MISO on falling ones, most significant bit
//! first, as the PMW3901 does (PixArt's data sheet R1.10, section 6.5). Bosch's chips do the same
//! in both modes that they support: when the chip select falls they take mode 0 if the clock is low
//! and mode 3 if it is high (BST-BMI270-DS000, BST-BMP280-DS001, BST-BMM150-DS001, "automatic
//! selection"). The mode determines when the first bit is driven: at the select, or at the first
//! falling edge.
//!
//! Every rising edge counts as a bit, whether or not the controller intended it. Bits of an
//! incomplete byte are lost when the select rises.

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
    /// Number and value of the byte being shifted out.
    answer: Option<(usize, u8)>,
}

impl ChipEnd {
    /// The chip select falls while the clock has the level `clock`.
    pub fn select(clock: bool) -> Self {
        Self { taken: 0, register: 0, shown: (!clock).then_some(0), answer: None }
    }

    /// A rising edge, after `sent` bits of the controller's byte.
    pub fn rise<C: SpiChip>(&mut self, chip: &mut C, mosi: bool, sent: u32, at: impl Fn(u32) -> Instant) {
        self.register = self.register << 1 | u8::from(mosi);
        self.taken += 1;
        if self.taken.is_multiple_of(BITS) {
            let (index, now) = (number(self.taken) - 1, at(sent + 1));
            self.answer(chip, index, now);
            chip.take(index, self.register, now);
        }
    }

    /// A falling edge: the next bit appears on MISO.
    pub fn fall(&mut self) {
        self.shown = Some(self.taken);
    }

    /// Level of MISO after `sent` bits of the controller's byte; high if it is not driven.
    ///
    /// The chip supplies a byte when its first bit is sampled, not when it is due, so a byte that
    /// is not read is not taken from the chip.
    pub fn miso<C: SpiChip>(&mut self, chip: &mut C, sent: u32, at: impl Fn(u32) -> Instant) -> bool {
        let Some(shown) = self.shown else { return true };
        let bit = shown % BITS;
        // Evaluated at the end of the byte, as when whole bytes are moved.
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

/// Number of the byte that contains this bit.
const fn number(bit: u32) -> usize {
    (bit / BITS) as usize
}
