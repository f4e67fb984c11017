//! What a board says of itself, judged: why it was restarted, and how its processor reads its flash.
//!
//! Firmware fills these from registers; they are here so that a board that is emulated says the same in the same words.

use super::finding::Verdict;
use core::fmt;

/// Why the processor started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Restart {
    /// Power came.
    #[default]
    PowerOn,
    /// The program, the console or the tool that flashes asked for it.
    Asked,
    /// The supply fell below what the processor needs.
    BrownOut,
    /// A watchdog, or an exception nobody handled.
    Watchdog,
    /// Something else.
    Other,
}

impl Restart {
    /// From the number in an Espressif chip's register (ESP32-S3 technical reference manual, "Reset and Clock", table of reset
    /// sources; other chips of the family have the same numbers for these).
    #[must_use]
    pub const fn from_register(code: u32) -> Self {
        match code {
            0x01 => Self::PowerOn,
            // Software, and the USB unit, by which the chip is flashed.
            0x03 | 0x0C | 0x15 | 0x16 => Self::Asked,
            0x0F => Self::BrownOut,
            0x07..=0x09 | 0x0B | 0x0D | 0x10..=0x12 => Self::Watchdog,
            _ => Self::Other,
        }
    }

    /// Is that how a vehicle should start, and what to do if not?
    #[must_use]
    pub const fn judge(self) -> (Verdict, &'static str) {
        match self {
            Self::PowerOn | Self::Asked => (Verdict::Pass, ""),
            Self::BrownOut => (Verdict::Fail, "its supply broke down: another battery, another cable"),
            Self::Watchdog => (Verdict::Fail, "its program hung: please report what it printed before"),
            Self::Other => (Verdict::Look, "please report it"),
        }
    }
}

impl fmt::Display for Restart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PowerOn => "power-on",
            Self::Asked => "asked for",
            Self::BrownOut => "brown-out",
            Self::Watchdog => "watchdog",
            Self::Other => "other",
        })
    }
}

/// How an Espressif chip reads the flash from which its program runs: as its memory controller (SPI0) is set.
///
/// Program code that is not in the cache waits for it: over four wires at 80 MHz a line of the cache takes about a quarter of the
/// time it takes over two at 40 MHz.
///
/// ```
/// use stampfly_flight::doctor::{FlashAccess, Verdict};
/// let slow = FlashAccess::from_registers(1 << 23, 0x0001_0001);
/// assert_eq!(slow.to_string(), "DIO at 40 MHz");
/// assert_eq!(slow.judge().0, Verdict::Fail);
/// assert_eq!(FlashAccess::from_registers(1 << 24, 1 << 31).judge().0, Verdict::Pass);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashAccess {
    /// `QIO`, `QOUT`, `DIO`, `DOUT` or `SPI`.
    pub mode: &'static str,
    /// Clock of the flash, MHz.
    pub megahertz: u32,
}

/// Clock of the memory controller, MHz (ESP32-S3 technical reference manual, "SPI Controller").
const CORE: u32 = 80;
/// Names of the modes by the bit of the control register that chooses them (esp-idf, `soc/spi_mem_reg.h`).
const MODES: [(u32, &str); 4] = [(24, "QIO"), (20, "QOUT"), (23, "DIO"), (14, "DOUT")];

impl FlashAccess {
    /// From the controller's registers `SPI_MEM_CTRL` and `SPI_MEM_CLOCK`. Bit 31 of the second is the controller's own
    /// clock, else bits 23 to 16 are its divisor less one.
    #[must_use]
    pub fn from_registers(control: u32, clock: u32) -> Self {
        let mode = MODES.iter().find(|(bit, _)| control >> bit & 1 != 0).map_or("SPI", |(_, name)| name);
        let megahertz = if clock >> 31 != 0 { CORE } else { CORE / ((clock >> 16 & 0xFF) + 1) };
        Self { mode, megahertz }
    }

    /// Is it fast enough to fly from?
    #[must_use]
    pub fn judge(self) -> (Verdict, &'static str) {
        if self.mode == "QIO" && self.megahertz >= CORE {
            (Verdict::Pass, "")
        } else {
            (Verdict::Fail, "too slow to fly from: flash it again with --flash-mode qio --flash-freq 80mhz")
        }
    }
}

impl fmt::Display for FlashAccess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at {} MHz", self.mode, self.megahertz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_four_wires_at_full_speed_are_fast_enough() {
        let read = |control: u32, clock: u32| FlashAccess::from_registers(control, clock);
        for (access, shown, verdict) in [
            (read(1 << 24 | 1 << 13, 1 << 31), "QIO at 80 MHz", Verdict::Pass),
            (read(1 << 24, 0x0001_0001), "QIO at 40 MHz", Verdict::Fail),
            (read(1 << 23, 1 << 31), "DIO at 80 MHz", Verdict::Fail),
            (read(1 << 14, 0x0003_0003), "DOUT at 20 MHz", Verdict::Fail),
            (read(0, 1 << 31), "SPI at 80 MHz", Verdict::Fail),
        ] {
            assert_eq!((std::format!("{access}").as_str(), access.judge().0), (shown, verdict));
        }
    }

    #[test]
    fn a_vehicle_starts_because_power_came_or_somebody_asked() {
        let judged = |code| Restart::from_register(code).judge().0;
        assert_eq!([1, 3, 0x15].map(judged), [Verdict::Pass; 3]);
        assert_eq!([0x0F, 7, 0x12].map(judged), [Verdict::Fail; 3]);
        assert_eq!(judged(0x13), Verdict::Look);
    }
}
