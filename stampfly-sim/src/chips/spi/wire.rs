//! The lines of an SPI bus as levels: clock, MOSI, MISO, and the edges that a controller makes of bytes.
//!
//! A transfer goes edge by edge where polarity matters: when the clock does not have its idle level as the chip select
//! falls, when a device is in a mode that its chip does not know, when bits come in the wrong order. In all other cases
//! [`SpiPort`](super::SpiPort) moves whole bytes, which gives the same and costs less.
//!
//! At an edge everybody looks at the lines as they were before it: a line changes a little after the edge that changes
//! it. So a controller that sets MOSI on the edge on which the chip looks at it is one bit late.

use super::chip_end::ChipEnd;
use crate::chips::SpiChip;
use embedded_hal::spi::{MODE_0, MODE_3, Mode, Phase, Polarity};
use stampfly_types::Instant;

/// When the controller gives the clock the idle level of the device that is next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Controller {
    /// With the device's configuration, before the chip select falls.
    #[default]
    LevelFirst,
    /// When the transfer begins, with the chip already selected: one edge more than bits when the device before idled at
    /// the other level. So do the ESP32-S3 and the ESP32-C6 with a chip select that the program drives: the new level gets
    /// into the unit's clock domain with the command that also starts the transfer (esp-hal 1.2,
    /// `spi/master/low_level/v3.rs`; espressif/esp-idf#12543).
    LevelWithTransfer,
}

/// Which bit of a byte comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitOrder {
    /// The most significant, which all chips here want.
    #[default]
    MostFirst,
    /// The least significant.
    LeastFirst,
}

impl BitOrder {
    /// The place in the byte of the bit that is sent after so many.
    const fn place(self, sent: u32) -> u32 {
        match self {
            Self::MostFirst => 7 - sent,
            Self::LeastFirst => sent,
        }
    }
}

/// The lines that the controller drives, between two transfers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Levels {
    pub clock: bool,
    pub mosi: bool,
}

impl Levels {
    /// After a transfer in this mode that sent this byte last.
    pub fn after(mode: Mode, order: BitOrder, last: u8) -> Self {
        Self { clock: idles_high(mode), mosi: last >> order.place(7) & 1 == 1 }
    }
}

/// The clock's level between transfers.
pub(super) fn idles_high(mode: Mode) -> bool {
    mode.polarity == Polarity::IdleHigh
}

/// Do whole bytes tell what happens? The chips here look at MOSI on rising edges and set MISO on falling ones, which is what
/// modes 0 and 3 are.
pub(super) fn is_plain(levels: Levels, mode: Mode, order: BitOrder) -> bool {
    levels.clock == idles_high(mode) && (mode == MODE_0 || mode == MODE_3) && order == BitOrder::MostFirst
}

/// One selected chip on its lines.
#[derive(Debug)]
pub(super) struct Wire {
    levels: Levels,
    mode: Mode,
    order: BitOrder,
    chip: ChipEnd,
    /// Rising edges of the clock since the select fell.
    pub rising: u64,
}

impl Wire {
    /// The chip select falls.
    pub fn select(levels: Levels, mode: Mode, order: BitOrder) -> Self {
        Self { levels, mode, order, chip: ChipEnd::select(levels.clock), rising: 0 }
    }

    /// Sends a byte and reads one. `at` tells when so many bits of it are over.
    pub fn exchange<C: SpiChip>(&mut self, chip: &mut C, byte: u8, at: impl Fn(u32) -> Instant) -> u8 {
        if self.levels.clock != idles_high(self.mode) {
            // The level comes with the first byte: an edge of its own.
            self.edge(chip, 0, &at);
        }
        (0..8).fold(0, |answer, sent| {
            let place = self.order.place(sent);
            let bit = byte >> place & 1 == 1;
            let read = match self.mode.phase {
                Phase::CaptureOnFirstTransition => {
                    self.levels.mosi = bit;
                    let read = self.chip.miso(chip, sent, &at);
                    self.edge(chip, sent, &at);
                    self.edge(chip, sent, &at);
                    read
                }
                Phase::CaptureOnSecondTransition => {
                    self.edge(chip, sent, &at);
                    self.levels.mosi = bit;
                    let read = self.chip.miso(chip, sent, &at);
                    self.edge(chip, sent, &at);
                    read
                }
            };
            answer | u8::from(read) << place
        })
    }

    fn edge<C: SpiChip>(&mut self, chip: &mut C, sent: u32, at: impl Fn(u32) -> Instant) {
        self.levels.clock = !self.levels.clock;
        if self.levels.clock {
            self.rising += 1;
            self.chip.rise(chip, self.levels.mosi, sent, at);
        } else {
            self.chip.fall();
        }
    }
}
