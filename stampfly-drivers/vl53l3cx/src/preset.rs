//! Settings of the histogram mode, as in ST's core: patch, fixed settings, settings of each
//! measurement.
//!
//! Data and arithmetic without a bus; `histogram.rs` sends them. Not for the light mode, whose
//! registers are in [`codec`].
//!
//! **Unverified** on a chip. Addresses, values and order are those that ST's core writes (VL53LX
//! bare driver, BSD-3-Clause: `vl53lx_register_map.h`, `VL53LX_load_patch`,
//! `VL53LX_init_and_start_range` and `VL53LX_clear_interrupt_and_enable_next_range` in
//! `vl53lx_api_core.c`, `VL53LX_preset_mode_histogram_long_range` in `vl53lx_api_preset_modes.c`),
//! obtained by running that core on registers that only store.

use crate::bins::{Exposure, Histogram, Part};
use crate::codec::{self, RangeStatus, Reading};

/// Frequency of the fast oscillator as measured by the factory, 2 bytes: MHz with 12 fractional
/// bits.
pub(crate) const FAST_OSCILLATOR: u16 = 0x0006;
/// The factory's correction of every distance, as found after a start: quarters of a millimetre, 13
/// signed bits in 2 bytes. ST's core reads it from here and not from
/// [`codec::register::MM_CONFIG_OUTER_OFFSET_MM`] (`VL53LX_get_customer_nvm_managed`).
pub(crate) const FACTORY_OFFSET: u16 = codec::register::ALGO_PART_TO_PART_RANGE_OFFSET_MM;
/// First register of a histogram.
pub(crate) const BLOCK: u16 = 0x0088;
/// Times and laser periods of both parts.
pub(crate) const TIMES: u16 = 0x005A;
pub(crate) const TIMES_BYTES: usize = 10;
/// Plausible oscillator frequencies: the nominal 11.8 MHz within a third.
const OSCILLATORS: core::ops::RangeInclusive<u16> = 32_000..=64_000;
/// Start of the laser pulse within its period during the reference measurement, bins.
const LASER_START: u8 = 9;
/// Time of a measurement outside its six parts, µs, and the number of these parts
/// (`VL53LX_SetMeasurementTimingBudgetMicroSeconds`).
const OVERHEAD: u32 = 1_700;
const PARTS: u32 = 6;
/// Duration of the phase calibration, 9 ms as ST's core rounds them, and of the mode corrections,
/// µs.
const PHASE_CALIBRATION: u32 = 9_030;
const CORRECTIONS: u32 = 2_000;
/// Codes of the laser periods: 20 and 24 bins.
const PERIODS: [u8; 2] = [0x09, 0x0B];
/// First register of the settings, and bytes per write.
const SETTINGS_FROM: u16 = 0x0044;
const RUN: usize = 32;
/// Indices in the settings of the phase calibration time and of the times of both parts.
const CALIBRATION: usize = 0x4B - 0x44;
const TIMES_AT: usize = 0x5A - 0x44;
/// Indices in the settings of the group number, and its bit.
const GROUP: [usize; 3] = [0x71 - 0x44, 0x7C - 0x44, 0x82 - 0x44];
const GROUP_ID: u8 = 2;

/// Sent once, before everything else. First the patch, which stops the firmware, diverts it in
/// three places and restarts it. Its purpose is not published; the only value in it that ST names
/// is the power of the phase calibration. It consists of twenty bytes of settings and contains no
/// program. The settings that are the same for all measurements follow.
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

/// 40 Mcps as target rate for the detector selection; pads and interrupt as in [`codec::FIXED`];
/// the bins that are counted in bright and in medium light: ambient light (7) and the groups 0 to 4
/// in the first part, 0 to 5 in the second.
const STATIC: [u8; 32] = [
    0x14, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x01, 0x01, 0x02, 0x00, 0x02, 0x08, 0x00, 0x07,
    0x21, 0x43, 0x10, 0x32, 0x54, 0x07, 0x21, 0x43, 0x10, 0x02, 0x43, 0x05, 0x00,
];

/// Sent before each measurement, from 0x0044 to the start at 0x0087. The times are for 33 ms and
/// 11.8 MHz.
///
/// From 0x0044: interrupt on a new sample, laser start and width, phase calibration, detector
/// selection by the chip. From 0x005A: times and laser periods of both parts, bins in low light, no
/// pause. From 0x0071: a group of settings, held: ambient limits, seed, windows, phases, field of
/// view, steps of a measurement. From 0x0083: power on, no division of the count, firmware on,
/// interrupt cleared, histograms back to back.
const SETTINGS: [u8; 68] = [
    0x00, 0x00, 0x20, 0x09, 0x00, 0x00, 0x02, 0x94, 0x21, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x8C, 0x00, 0x00,
    0x38, 0xFF, 0x01, 0x00, 0x20, 0x00, 0x1A, 0x00, 0x54, 0x09, 0x00, 0x46, 0x0B, 0x07, 0x21, 0x43, 0x10, 0x32, 0x54,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x03, 0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0x02, 0x09, 0x0B, 0x09, 0x06, 0x03,
    0x00, 0x02, 0xC7, 0xFF, 0x9B, 0x02, 0x01, 0x00, 0x01, 0x01, 0x26,
];

/// Number of macro periods in `micros`, with a laser period of `bins`.
const fn macro_periods(micros: u32, bins: u32, oscillator: u16) -> u32 {
    // 2304 laser periods; a bin is 64 of the oscillator's 4096ths.
    let period = 147_456 * bins as u64;
    (micros as u64 * oscillator as u64 + period / 2).saturating_div(period) as u32
}

/// Settings for this time budget, µs, and this oscillator, with the macro periods of each part.
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
    // As the chip decodes them, which includes the rounding of the encoding.
    (settings, ranging.map(|code| ((code & 0xFF) << (code >> 8)) + 1))
}

/// State of the histogram mode since a start: the next settings, and results of the last
/// measurement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Session {
    exposure: Exposure,
    settings: [u8; 68],
    /// The factory's correction, m.
    offset: f32,
    /// Time of flight of the last measurement, bins.
    before: Option<f32>,
    /// Number of the last measurement.
    count: Option<u8>,
}

impl Session {
    /// For measurements of `budget` µs by a chip with these values of [`FAST_OSCILLATOR`] and
    /// [`FACTORY_OFFSET`]. `None` when the oscillator frequency is implausible.
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

    /// The values of [`TIMES`] that will be sent.
    pub(crate) fn times(&self) -> [u8; TIMES_BYTES] {
        core::array::from_fn(|index| self.settings.get(TIMES_AT + index).copied().unwrap_or(0))
    }

    /// The settings that clear the interrupt and start a measurement, in runs of registers.
    pub(crate) fn runs(&self) -> impl Iterator<Item = (u16, &[u8])> {
        (SETTINGS_FROM..).step_by(RUN).zip(self.settings.chunks(RUN))
    }

    /// Prepares the next settings after these have been sent: groups have two alternating numbers.
    pub(crate) fn sent(&mut self) {
        for place in GROUP {
            if let Some(hold) = self.settings.get_mut(place) {
                *hold ^= GROUP_ID;
            }
        }
    }

    /// Evaluates a histogram. `None` for the first one after a start, which is empty, and for one
    /// that has been evaluated before.
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
        // `VL53LX_init_and_start_range` of ST's core, long range, 33 ms, on a chip whose register
        // 0x0006 is 0xBCCC, except for the pause between measurements, which is zero here.
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
