//! The chip as ST's own driver runs it: each measurement is a histogram of photons over time, whose pulse the processor finds.
//!
//! It is the second way to range ([`Ranging::Histogram`](crate::Ranging)), for a part that makes nonsense of the first. Every public program that is known to
//! range with a VL53L3CX does it this way; none is known that does it like a VL53L1X, which [`codec`] describes. It costs the bus 3.7 ms a
//! measurement instead of 0.6, and the processor what [`bins`](crate::bins) does. Not for several targets: the strongest one counts.
//!
//! **Unverified** on a chip. Addresses, values and their order are those that ST's core writes (VL53LX bare driver, BSD-3-Clause:
//! `vl53lx_register_map.h`, `VL53LX_load_patch`, `VL53LX_init_and_start_range` and `VL53LX_clear_interrupt_and_enable_next_range` in
//! `vl53lx_api_core.c`, `VL53LX_preset_mode_histogram_long_range` in `vl53lx_api_preset_modes.c`), seen by running that core over registers
//! that only store.

use crate::bins::{BLOCK_BYTES, Exposure, Histogram, Part};
use crate::codec::{self, RangeStatus, Reading};
use crate::{REPETITIONS, Vl53l3cx, Xshut, early};
use embedded_hal_async::i2c::I2c;
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::ChipError;
use stampfly_types::Instant;

/// The fast oscillator as the factory measured it, 2 bytes: MHz with 12 bits after the point.
const FAST_OSCILLATOR: u16 = 0x0006;
/// What the factory found to be missing from every distance, as it is there after a start: quarters of a millimetre, 13 bits with a sign in 2
/// bytes. ST's core takes it from here, not from [`codec::register::MM_CONFIG_OUTER_OFFSET_MM`] (`VL53LX_get_customer_nvm_managed`).
const FACTORY_OFFSET: u16 = codec::register::ALGO_PART_TO_PART_RANGE_OFFSET_MM;
/// Where the laser starts in its period while the chip finds its own reference pulse, bins.
const LASER_START: u8 = 9;
/// Oscillators that there can be: a third from the nominal 11.8 MHz.
const OSCILLATORS: core::ops::RangeInclusive<u16> = 32_000..=64_000;
/// What of a measurement is neither of its six parts, µs, and how many parts (`VL53LX_SetMeasurementTimingBudgetMicroSeconds`).
const OVERHEAD: u32 = 1_700;
const PARTS: u32 = 6;
/// Time of the phase calibration, 9 ms as ST's core rounds them, and of the mode's corrections, µs.
const PHASE_CALIBRATION: u32 = 9_030;
const CORRECTIONS: u32 = 2_000;
/// A histogram begins here.
const BLOCK: u16 = 0x0088;
/// Where [`STATIC`] and the settings begin, and where in the latter the times do.
const STATIC_FROM: u16 = 0x0024;
const SETTINGS_FROM: u16 = 0x0044;
const TIMES_FROM: u16 = 0x005A;
const TIMES: usize = 0x5A - 0x44;
/// Where in the settings the number of their group is, and its bit.
const GROUP: [usize; 3] = [0x71 - 0x44, 0x7C - 0x44, 0x82 - 0x44];
const GROUP_ID: u8 = 2;
/// Bytes in one write.
const RUN: usize = 32;
/// Codes of the laser's periods: 20 and 24 bins.
const PERIODS: [u8; 2] = [0x09, 0x0B];

/// Stops the firmware, diverts it in three places, and lets it go again. What for is not published; the one number of it that ST has a name for
/// is the power of the phase calibration. These are settings, twenty bytes of them; there is no program among them.
const PATCH: [(u16, &[u8]); 8] = [
    (0x0085, &[0x00]),
    (0x0083, &[0x01]),
    (0x0476, &[0x29, 0xC9, 0x0E, 0x40, 0x28, 0x00]),
    (0x0496, &[0x03, 0x6D, 0x03, 0x6F, 0x07, 0x29]),
    (0x0472, &[0x00, 0x07]),
    (0x0474, &[0x00, 0x07]),
    (0x0470, &[0x01]),
    (0x0085, &[0x01]),
];

/// What does not change from one measurement to the next, from 0x0024: 40 Mcps wanted from the detectors chosen, pads and interrupt as in
/// [`codec::FIXED`], and which bins are counted: of the first part ambient light (7) and the groups 0 to 4, of the second 0 to 5.
const STATIC: [u8; 32] = [
    0x14,
    0x00,
    0x00,
    0x00,
    0x00,
    0x00,
    0x00,
    0x00,
    0x00,
    0x00,
    0x01,
    0x01,
    codec::ACTIVE_HIGH,
    0x02,
    0x00,
    0x02,
    0x08,
    0x00,
    0x07,
    0x21,
    0x43,
    0x10,
    0x32,
    0x54,
    0x07,
    0x21,
    0x43,
    0x10,
    0x02,
    0x43,
    0x05,
    0x00,
];

/// The state of a histogram's rhythm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Session {
    exposure: Exposure,
    /// The settings, as often as they are sent, from 0x0044: see [`settings`].
    settings: [u8; 68],
    /// What the factory found to be missing, m.
    offset: f32,
    /// How many bins the light travelled last time.
    before: Option<f32>,
    /// The number of the last measurement.
    count: Option<u8>,
}

/// How many macro periods of this many bins are so many µs.
const fn macro_periods(micros: u32, bins: u32, oscillator: u16) -> u32 {
    // 2304 laser periods; a bin is 64 of the oscillator's 4096ths.
    let period = 147_456 * bins as u64;
    (micros as u64 * oscillator as u64 + period / 2).saturating_div(period) as u32
}

/// What is sent before each measurement, from 0x0044 to the start at 0x0087, and the macro periods that it asks for.
#[inline(never)]
fn settings(budget: u32, oscillator: u16) -> ([u8; 68], [u16; 2]) {
    let part = budget.saturating_sub(OVERHEAD) / PARTS;
    let bins = [Part::First, Part::Second].map(|part| part.period() as u32);
    let time = |micros| bins.map(|bins| codec::encode_timeout(u64::from(macro_periods(micros, bins, oscillator))));
    let [corrections_a, corrections_b] = time(CORRECTIONS).map(u16::to_be_bytes);
    let ranging = time(part);
    let [range_a, range_b] = ranging.map(u16::to_be_bytes);
    let [first, second] = PERIODS;
    let calibration = macro_periods(PHASE_CALIBRATION, bins[0], oscillator).min(0xFF) as u8;
    let settings = [
        // Interrupt at a new sample; laser start and width; phase calibration; detectors chosen by the chip.
        0x00,
        0x00,
        0x20,
        LASER_START,
        0x00,
        0x00,
        0x02,
        calibration,
        0x21,
        0x00,
        0x00,
        0x01,
        0x00,
        0x00,
        0x00,
        0x00,
        0x8C,
        0x00,
        0x00,
        0x38,
        0xFF,
        0x01,
        // Times and periods.
        corrections_a[0],
        corrections_a[1],
        corrections_b[0],
        corrections_b[1],
        range_a[0],
        range_a[1],
        first,
        range_b[0],
        range_b[1],
        second,
        // Bins in low light; no pause between measurements.
        0x07,
        0x21,
        0x43,
        0x10,
        0x32,
        0x54,
        0x00,
        0x00,
        0x00,
        0x00,
        0x00,
        0x00,
        0x00,
        // From the first hold of a group to the last: ambient limits, seed, windows, phases, field of view, steps of a measurement.
        0x03,
        0xFF,
        0xFF,
        0xFF,
        0xFF,
        0x00,
        0x02,
        first,
        second,
        0x09,
        0x06,
        0x03,
        0x00,
        0x02,
        0xC7,
        0xFF,
        0x9B,
        0x02,
        // Power on, no division of the count, firmware on, interrupt taken back, histograms of both detectors, one after the other.
        0x01,
        0x00,
        0x01,
        codec::CLEAR,
        0x26,
    ];
    // As the chip takes them apart again.
    (settings, ranging.map(|code| ((code & 0xFF) << (code >> 8)) + 1))
}

impl<I: I2c, X: Xshut, T: Timebase> Vl53l3cx<'_, I, X, T> {
    /// Sets a chip up that has just been woken. It measures when it is asked to.
    pub(crate) async fn start_histogram(&mut self) -> Result<(), ChipError<I::Error>> {
        let oscillator = u16::from_be_bytes(self.port.read_twice(FAST_OSCILLATOR).await?);
        if !OSCILLATORS.contains(&oscillator) {
            return Err(ChipError::Data);
        }
        let missing = i16::from_be_bytes(self.port.read_twice(FACTORY_OFFSET).await?);
        let (settings, macro_periods) = settings(self.config.budget.as_micros() as u32, oscillator);
        let times: [u8; 10] = core::array::from_fn(|index| settings.get(TIMES + index).copied().unwrap_or(0));
        for (register, values) in PATCH.into_iter().chain([(STATIC_FROM, &STATIC[..]), (TIMES_FROM, &times)]) {
            self.port.write(register, values).await?;
        }
        // A wrong bit in here would not be noticed as anything but wrong distances.
        let kept: [u8; 10] = self.port.read(TIMES_FROM).await?;
        if kept != times {
            return Err(ChipError::Configuration { status: kept[6] });
        }
        self.session = Some(Session {
            exposure: Exposure { oscillator, macro_periods, laser_start: LASER_START },
            settings,
            offset: f32::from((missing << 3) >> 3) / 4_000.0,
            before: None,
            count: None,
        });
        self.stale = true;
        Ok(())
    }

    /// Sends the settings, which takes the interrupt back and starts a measurement.
    async fn arm(&mut self) -> Result<(), ChipError<I::Error>> {
        let Some(session) = &mut self.session else { return Err(ChipError::NoSample) };
        for (place, run) in (SETTINGS_FROM..).step_by(RUN).zip(session.settings.chunks(RUN)) {
            self.port.write(place, run).await?;
        }
        // A group of settings has one of two numbers, in turn.
        for place in GROUP {
            if let Some(hold) = session.settings.get_mut(place) {
                *hold ^= GROUP_ID;
            }
        }
        self.stale = false;
        self.due = self.port.now() + early(self.config.budget);
        Ok(())
    }

    /// A measurement, and when it was there: one that runs already, because a call for it was dropped, or one of its own.
    pub(crate) async fn histogram(&mut self) -> Result<(Instant, Reading), ChipError<I::Error>> {
        // The first one after a start is of nothing.
        for _ in 0..=REPETITIONS + 1 {
            // One that nobody came for in time is too old.
            if self.stale || self.port.now() > self.due + self.config.period / 4 {
                // A chip that lost its power does not answer here any more.
                self.look().await?;
                self.arm().await?;
            }
            let seen = self.ready().await?;
            let block: [u8; BLOCK_BYTES] = self.read(BLOCK).await?;
            self.stale = true;
            let histogram = Histogram::decode(&block).ok_or(ChipError::Data)?;
            let Some(session) = &mut self.session else { break };
            if RangeStatus::decode(histogram.code) == RangeStatus::Starting
                || session.count.replace(histogram.count) == Some(histogram.count)
            {
                continue;
            }
            let (reading, travelled) = histogram.reading(&session.exposure, session.offset, session.before);
            session.before = travelled;
            return Ok((seen, reading));
        }
        self.ranging = false;
        Err(ChipError::NoSample)
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
        assert_eq!(SETTINGS_FROM as usize + TIMES, TIMES_FROM as usize);
    }
}
