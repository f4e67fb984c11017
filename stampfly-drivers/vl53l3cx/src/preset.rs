//! What the chip is told to make histograms, as ST's core tells it: patch, fixed settings, settings of each measurement.
//!
//! Data and arithmetic without a bus; `histogram.rs` sends them. Not for the light mode, whose registers are in
//! [`codec`].
//!
//! **Unverified** on a chip. Addresses, values and their order are those that ST's core writes (VL53LX bare driver, BSD-3-Clause:
//! `vl53lx_register_map.h`, `VL53LX_load_patch`, `VL53LX_init_and_start_range` and `VL53LX_clear_interrupt_and_enable_next_range` in
//! `vl53lx_api_core.c`, `VL53LX_preset_mode_histogram_long_range` in `vl53lx_api_preset_modes.c`), seen by running that core over registers
//! that only store.

use crate::bins::{Exposure, Histogram, Part};
use crate::codec::{self, RangeStatus, Reading};

/// The fast oscillator as the factory measured it, 2 bytes: MHz with 12 bits after the point.
pub(crate) const FAST_OSCILLATOR: u16 = 0x0006;
/// What the factory found to be missing from every distance, as it is there after a start: quarters of a millimetre, 13 bits with a sign in 2
/// bytes. ST's core takes it from here, not from [`codec::register::MM_CONFIG_OUTER_OFFSET_MM`] (`VL53LX_get_customer_nvm_managed`).
pub(crate) const FACTORY_OFFSET: u16 = codec::register::ALGO_PART_TO_PART_RANGE_OFFSET_MM;
/// A histogram begins here.
pub(crate) const BLOCK: u16 = 0x0088;
/// Times and periods of both parts.
pub(crate) const TIMES: u16 = 0x005A;
pub(crate) const TIMES_BYTES: usize = 10;
/// Oscillators that there can be: a third from the nominal 11.8 MHz.
const OSCILLATORS: core::ops::RangeInclusive<u16> = 32_000..=64_000;
/// Where the laser starts in its period while the chip finds its own reference pulse, bins.
const LASER_START: u8 = 9;
/// What of a measurement is neither of its six parts, µs, and how many parts (`VL53LX_SetMeasurementTimingBudgetMicroSeconds`).
const OVERHEAD: u32 = 1_700;
const PARTS: u32 = 6;
/// Time of the phase calibration, 9 ms as ST's core rounds them, and of the mode's corrections, µs.
const PHASE_CALIBRATION: u32 = 9_030;
const CORRECTIONS: u32 = 2_000;
/// Codes of the laser's periods: 20 and 24 bins.
const PERIODS: [u8; 2] = [0x09, 0x0B];
/// Where the settings begin, and bytes in one write.
const SETTINGS_FROM: u16 = 0x0044;
const RUN: usize = 32;
/// Where in the settings the phase calibration's time is, and the times of both parts.
const CALIBRATION: usize = 0x4B - 0x44;
const TIMES_AT: usize = 0x5A - 0x44;
/// Where in the settings the number of their group is, and its bit.
const GROUP: [usize; 3] = [0x71 - 0x44, 0x7C - 0x44, 0x82 - 0x44];
const GROUP_ID: u8 = 2;

/// Sent once, before anything else. The patch first: it stops the firmware, diverts it in three places, and lets it go again. What for is not
/// published; the one number of it that ST has a name for is the power of the phase calibration. These are settings, twenty bytes of them;
/// there is no program among them. Then what does not change from one measurement to the next.
pub(crate) const ONCE: [(u16, &[u8]); 9] = [
    (0x0085, &[0x00]),
    (0x0083, &[0x01]),
    (0x0476, &[0x29, 0xC9, 0x0E, 0x40, 0x28, 0x00]),
    (0x0496, &[0x03, 0x6D, 0x03, 0x6F, 0x07, 0x29]),
    (0x0472, &[0x00, 0x07]),
    (0x0474, &[0x00, 0x07]),
    (0x0470, &[0x01]),
    (0x0085, &[0x01]),
    (0x0024, &STATIC),
];

/// 40 Mcps wanted from the detectors chosen; pads and interrupt as in [`codec::FIXED`]; which bins are counted in bright and in middling light:
/// of the first part ambient light (7) and the groups 0 to 4, of the second 0 to 5.
const STATIC: [u8; 32] = [
    0x14, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x01, 0x01, 0x02, 0x00, 0x02, 0x08, 0x00, 0x07,
    0x21, 0x43, 0x10, 0x32, 0x54, 0x07, 0x21, 0x43, 0x10, 0x02, 0x43, 0x05, 0x00,
];

/// Sent before each measurement, from 0x0044 to the start at 0x0087. Times are those of 33 ms and 11.8 MHz.
///
/// From 0x0044: interrupt at a new sample, laser start and width, phase calibration, detectors chosen by the chip. From 0x005A: times and periods
/// of both parts, bins in low light, no pause. From 0x0071: a group of settings, held: ambient limits, seed, windows, phases, field of view,
/// steps of a measurement. From 0x0083: power on, no division of the count, firmware on, interrupt taken back, histograms one after the other.
const SETTINGS: [u8; 68] = [
    0x00, 0x00, 0x20, 0x09, 0x00, 0x00, 0x02, 0x94, 0x21, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x8C, 0x00, 0x00,
    0x38, 0xFF, 0x01, 0x00, 0x20, 0x00, 0x1A, 0x00, 0x54, 0x09, 0x00, 0x46, 0x0B, 0x07, 0x21, 0x43, 0x10, 0x32, 0x54,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x03, 0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0x02, 0x09, 0x0B, 0x09, 0x06, 0x03,
    0x00, 0x02, 0xC7, 0xFF, 0x9B, 0x02, 0x01, 0x00, 0x01, 0x01, 0x26,
];

/// How many macro periods of this many bins are so many µs.
const fn macro_periods(micros: u32, bins: u32, oscillator: u16) -> u32 {
    // 2304 laser periods; a bin is 64 of the oscillator's 4096ths.
    let period = 147_456 * bins as u64;
    (micros as u64 * oscillator as u64 + period / 2).saturating_div(period) as u32
}

/// The settings of so many µs and an oscillator that is so fast, and the macro periods of each part.
#[inline(never)]
fn settings(budget: u32, oscillator: u16) -> ([u8; 68], [u16; 2]) {
    let bins = [Part::First, Part::Second].map(|part| part.period() as u32);
    let time = |micros| bins.map(|bins| codec::encode_timeout(u64::from(macro_periods(micros, bins, oscillator))));
    let ranging = time(budget.saturating_sub(OVERHEAD) / PARTS);
    let [[c3, c2], [c1, c0]] = time(CORRECTIONS).map(u16::to_be_bytes);
    let [[a1, a0], [b1, b0]] = ranging.map(u16::to_be_bytes);
    let [first, second] = PERIODS;
    let times: [u8; TIMES_BYTES] = [c3, c2, c1, c0, a1, a0, first, b1, b0, second];
    let mut settings = SETTINGS;
    for (place, byte) in settings.iter_mut().skip(TIMES_AT).zip(times) {
        *place = byte;
    }
    if let Some(calibration) = settings.get_mut(CALIBRATION) {
        *calibration = macro_periods(PHASE_CALIBRATION, bins[0], oscillator).min(0xFF) as u8;
    }
    // As the chip takes them apart again.
    (settings, ranging.map(|code| ((code & 0xFF) << (code >> 8)) + 1))
}

/// Histograms since a start: what the next one is told, and what of the last ones has to be known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Session {
    exposure: Exposure,
    settings: [u8; 68],
    /// What the factory found to be missing, m.
    offset: f32,
    /// How many bins the light travelled last time.
    before: Option<f32>,
    /// The number of the last measurement.
    count: Option<u8>,
}

impl Session {
    /// For measurements of so many µs by a chip whose registers [`FAST_OSCILLATOR`] and [`FACTORY_OFFSET`] say this; `None` when the former cannot be.
    pub(crate) fn new(budget: u32, oscillator: u16, factory: i16) -> Option<Self> {
        let (settings, macro_periods) = settings(budget, oscillator);
        OSCILLATORS.contains(&oscillator).then_some(Self {
            exposure: Exposure { oscillator, macro_periods, laser_start: LASER_START },
            settings,
            offset: f32::from((factory << 3) >> 3) / 4_000.0,
            before: None,
            count: None,
        })
    }

    /// [`TIMES`] as they will be sent.
    pub(crate) fn times(&self) -> [u8; TIMES_BYTES] {
        core::array::from_fn(|index| self.settings.get(TIMES_AT + index).copied().unwrap_or(0))
    }

    /// What takes the interrupt back and starts a measurement, in runs of registers.
    pub(crate) fn runs(&self) -> impl Iterator<Item = (u16, &[u8])> {
        (SETTINGS_FROM..).step_by(RUN).zip(self.settings.chunks(RUN))
    }

    /// They have been sent. A group of settings has one of two numbers, in turn.
    pub(crate) fn sent(&mut self) {
        for place in GROUP {
            if let Some(hold) = self.settings.get_mut(place) {
                *hold ^= GROUP_ID;
            }
        }
    }

    /// What a histogram says; `None` for the first after a start, which is of nothing, and for one that has been taken before.
    pub(crate) fn take(&mut self, histogram: &Histogram) -> Option<Reading> {
        let nothing = RangeStatus::decode(histogram.code) == RangeStatus::Starting;
        if nothing || self.count.replace(histogram.count) == Some(histogram.count) {
            return None;
        }
        let (reading, travelled) = histogram.reading(&self.exposure, self.offset, self.before);
        self.before = travelled;
        Some(reading)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_settings_are_those_that_st_writes_for_33_ms() {
        let (settings, macro_periods) = settings(33_000, 48_332);
        // `VL53LX_init_and_start_range` of ST's core, long range, 33 ms, on a chip whose register 0x0006 says 0xBCCC, but for the pause
        // between measurements, which there is none of.
        let of_st = [
            0x00, 0x00, 0x20, 0x09, 0x00, 0x00, 0x02, 0x94, 0x21, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x8C, 0x00,
            0x00, 0x38, 0xFF, 0x01, 0x00, 0x20, 0x00, 0x1A, 0x00, 0x54, 0x09, 0x00, 0x46, 0x0B, 0x07, 0x21, 0x43, 0x10,
            0x32, 0x54, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x03, 0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0x02, 0x09, 0x0B,
            0x09, 0x06, 0x03, 0x00, 0x02, 0xC7, 0xFF, 0x9B, 0x02, 0x01, 0x00, 0x01, 0x01, 0x26,
        ];
        assert_eq!(settings, of_st);
        assert_eq!(macro_periods, [85, 71]);
    }

    #[test]
    fn the_groups_numbers_are_where_they_are_sent() {
        let (settings, _) = settings(33_000, 48_332);
        assert_eq!(GROUP.map(|place| settings[place]), [3, 3, 2]);
        assert_eq!(GROUP.map(|place| SETTINGS_FROM as usize + place), [0x71, 0x7C, 0x82]);
        assert_eq!(SETTINGS_FROM as usize + settings.len() - 1, 0x87);
        assert_eq!(SETTINGS_FROM as usize + TIMES_AT, TIMES as usize);
    }
}
