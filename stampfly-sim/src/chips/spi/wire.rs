//! Edge-level simulation of an SPI bus: clock, MOSI and MISO.
//!
//! Used where polarity matters: when the clock does not have its idle level as the chip select
//! falls, in a mode that the chip does not support, or with the wrong bit order. In all other cases
//! [`SpiPort`](super::SpiPort) moves whole bytes, with the same result at lower cost.
//!
//! At an edge both sides sample the lines as they were before it, since a line changes shortly
//! after the edge that changes it. A controller that sets MOSI on the edge on which the chip
//! samples it is therefore one bit late.

use super::chip_end::ChipEnd;
use crate::chips::SpiChip;
use embedded_hal::spi::{MODE_0, MODE_3, Mode, Phase, Polarity};
use stampfly_types::Instant;

/// When the controller sets the clock to the idle level of the next device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Controller {
    /// With the device's configuration, before the chip select falls.
    #[default]
    LevelFirst,
    /// When the transfer begins, with the chip already selected: one edge more than bits if the
    /// previous device idled at the other level. The ESP32-S3 and the ESP32-C6 do this with a chip
    /// select driven by software, because the new level enters the unit's clock domain with the
    /// command that also starts the transfer (esp-hal 1.2, `spi/master/low_level/v3.rs`;
    /// espressif/esp-idf#12543).
    LevelWithTransfer,
}

/// Order of the bits of a byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitOrder {
    /// Most significant bit first, as all chips here require.
    #[default]
    MostFirst,
    /// Least significant bit first.
    LeastFirst,
}

impl BitOrder {
    /// Position in the byte of the bit that is sent after `sent` bits.
    const fn place(self, sent: u32) -> u32 {
        match self {
            Self::MostFirst => 7 - sent,
            Self::LeastFirst => sent,
        }
    }
}

/// Levels driven by the controller between two transfers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Levels {
    pub clock: bool,
    pub mosi: bool,
}

impl Levels {
    /// Levels after a transfer in this mode that sent the byte `last` last.
    pub fn after(mode: Mode, order: BitOrder, last: u8) -> Self {
        Self { clock: idles_high(mode), mosi: last >> order.place(7) & 1 == 1 }
    }
}

/// Idle level of the clock.
pub(super) fn idles_high(mode: Mode) -> bool {
    mode.polarity == Polarity::IdleHigh
}

/// True if whole bytes represent the transfer. The chips here sample MOSI on rising edges and
/// change MISO on falling ones, which is modes 0 and 3.
pub(super) fn is_plain(levels: Levels, mode: Mode, order: BitOrder) -> bool {
    levels.clock == idles_high(mode) && (mode == MODE_0 || mode == MODE_3) && order == BitOrder::MostFirst
}

/// One selected chip and its lines.
#[derive(Debug)]
pub(super) struct Wire {
    levels: Levels,
    mode: Mode,
    order: BitOrder,
    chip: ChipEnd,
    /// Rising clock edges since the select fell.
    pub rising: u64,
}

impl Wire {
    /// The chip select falls.
    pub fn select(levels: Levels, mode: Mode, order: BitOrder) -> Self {
        Self { levels, mode, order, chip: ChipEnd::select(levels.clock), rising: 0 }
    }

    /// Sends a byte and reads one. `at` gives the instant after a number of its bits.
    pub fn exchange<C: SpiChip>(&mut self, chip: &mut C, byte: u8, at: impl Fn(u32) -> Instant) -> u8 {
        if self.levels.clock != idles_high(self.mode) {
            // The idle level changes with the first byte, which is an additional edge.
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
