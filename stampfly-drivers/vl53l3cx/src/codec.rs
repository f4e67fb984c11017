//! Registers, formulas and the result block of the VL53L3CX.
//!
//! The data sheet (ST DS13204) documents only the identification, the start-up and the electrical
//! interface. Everything else here is **unverified** against it: names and addresses of the
//! register map that ST publishes for this family with its VL53L1 and VL53LX drivers, and values
//! that public drivers of the family write. The times of the two ranging parts are from a formula
//! of this crate that matches the published values at 33 ms.

use super::config::Config;
pub use super::config::DistanceMode;
use stampfly_types::Duration;

/// Register addresses.
pub mod register {
    /// Reset: [`HOLD`](super::HOLD), a pause, [`LET_GO`](super::LET_GO), as in public drivers of
    /// the VL53L1X.
    pub const SOFT_RESET: u16 = 0x0000;
    /// I2C address of the chip, 7 bits.
    pub const I2C_SLAVE_DEVICE_ADDRESS: u16 = 0x0001;
    /// Bounds of the search for the detector's bias voltage.
    pub const VHV_CONFIG_TIMEOUT_MACROP_LOOP_BOUND: u16 = 0x0008;
    /// Start value of that search.
    pub const VHV_CONFIG_INIT: u16 = 0x000B;
    /// Correction added to every distance, quarters of a millimetre, 2 bytes:
    /// [`range_offset`](super::range_offset).
    pub const ALGO_PART_TO_PART_RANGE_OFFSET_MM: u16 = 0x001E;
    /// The factory's correction for this chip, mm, 2 bytes.
    pub const MM_CONFIG_OUTER_OFFSET_MM: u16 = 0x0022;
    /// Polarity of the interrupt, [`ACTIVE_HIGH`](super::ACTIVE_HIGH), followed by its status in
    /// bit 0.
    pub const GPIO_HV_MUX_CTRL: u16 = 0x0030;
    /// Duration of the phase calibration, macro periods.
    pub const PHASECAL_CONFIG_TIMEOUT_MACROP: u16 = 0x004B;
    /// Duration and laser period of the first ranging part, the same for the second, then limits.
    pub const RANGE_CONFIG_TIMEOUT_MACROP_A: u16 = 0x005E;
    /// Time between the starts of two measurements, 4 bytes.
    pub const SYSTEM_INTERMEASUREMENT_PERIOD: u16 = 0x006C;
    /// Windows and phases of the distance mode.
    pub const SD_CONFIG_WOI_SD0: u16 = 0x0078;
    /// [`CLEAR`](super::CLEAR) clears the interrupt, which enables the next one.
    pub const SYSTEM_INTERRUPT_CLEAR: u16 = 0x0086;
    /// Start and stop: [`RANGING`](super::RANGING), [`STANDBY`](super::STANDBY).
    pub const SYSTEM_MODE_START: u16 = 0x0087;
    /// First register of the result.
    pub const RESULT_RANGE_STATUS: u16 = 0x0089;
    /// Ticks of the slow oscillator per millisecond, 10 bits.
    pub const RESULT_OSC_CALIBRATE_VAL: u16 = 0x00DE;
    /// Bit 0: the firmware has started.
    pub const FIRMWARE_SYSTEM_STATUS: u16 = 0x00E5;
    /// Model, followed by the module type.
    pub const IDENTIFICATION_MODEL_ID: u16 = 0x010F;
}

/// Models of the family with module type [`MODULE_TYPE`] that are this part.
pub const MODELS: [u8; 3] = [0xEA, 0xEB, 0xEC];
/// Module type of the VL53L3CX.
pub const MODULE_TYPE: u8 = 0xAA;
/// Address of every chip of the family after a start.
pub const BOOT_ADDRESS: u8 = 0x29;
/// Holds the chip in reset.
pub const HOLD: u8 = 0x00;
/// Starts the chip.
pub const LET_GO: u8 = 0x01;
/// The interrupt is high when a measurement is ready. After a reset the bit is zero, which
/// identifies a chip that restarted.
pub const ACTIVE_HIGH: u8 = 0x01;
/// Measures continuously with the inter-measurement period.
pub const RANGING: u8 = 0x40;
/// Stops measuring.
pub const STANDBY: u8 = 0x00;
/// The measurement has been read.
pub const CLEAR: u8 = 0x01;
/// Bound of the bias search after the first one: two steps.
pub const SHORT_BIAS_SEARCH: u8 = 0x09;
/// Start of the bias search at the last result.
pub const FROM_LAST_BIAS: u8 = 0x00;
/// Length of the result, from the status to distance and signal rate, starting at
/// [`register::RESULT_RANGE_STATUS`].
pub const RESULT_BYTES: usize = 17;
/// Duration of the two calibrations and the detector selection before a measurement, µs, fitted to
/// the published values.
const PREPARATION: u64 = 12_000;
/// Duration of a macro period per clock of the laser period: 2304 periods of the nominal
/// oscillator.
const NANOS_PER_MACRO_CLOCK: u64 = 3_051;
/// One millisecond, ns.
const PHASE_CALIBRATION: u64 = 1_000_000;
/// Time budgets, µs, for which the formula of the ranging parts holds.
const BUDGETS: core::ops::RangeInclusive<u64> = 33_000..=500_000;

/// Settings that do not depend on the configuration: values of consecutive registers from an
/// address on.
pub const FIXED: [(u16, &[u8]); 5] = [
    // Pads at the supply voltage instead of 1.8 V; interrupt on a new sample, active high.
    (0x002E, &[0x01, 0x01, ACTIVE_HIGH, 0x02, 0x00, 0x02, 0x08, 0x00, 0x08, 0x10, 0x01, 0x01, 0x00, 0x00, 0x00, 0x00]),
    (0x003E, &[0xFF, 0x00, 0x0F, 0x00, 0x00, 0x00, 0x00, 0x00, 0x20, 0x0B, 0x00, 0x00, 0x02]),
    // The chip selects detectors from the whole array. The mode corrections are disabled; their
    // times are those of ST's preset (`VL53LX_preset_mode_standard_ranging`).
    (
        0x004C,
        &[0x21, 0x00, 0x00, 0x05, 0x00, 0x00, 0x00, 0x00, 0xC8, 0x00, 0x00, 0x38, 0xFF, 0x01, 0x00, 0x1A, 0x00, 0x20],
    ),
    (0x0070, &[0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01]),
    // Whole field of view; the steps of a measurement: bias, phase, detectors twice, range.
    (0x007C, &[0x00, 0x00, 0x02, 0xC7, 0xFF, 0x9B, 0x00, 0x00, 0x00, 0x01]),
];

impl DistanceMode {
    /// Codes of the laser periods of the two ranging parts. A target beyond the unambiguous range
    /// of one part appears at another distance in the other part, by which the chip detects it.
    const fn periods(self) -> [u8; 2] {
        match self {
            Self::Short => [0x07, 0x05],
            Self::Medium => [0x0B, 0x09],
            Self::Long => [0x0F, 0x0D],
        }
    }

    const fn highest_phase(self) -> u8 {
        match self {
            Self::Short => 0x38,
            Self::Medium => 0x78,
            Self::Long => 0xB8,
        }
    }

    const fn initial_phase(self) -> u8 {
        match self {
            Self::Short => 6,
            Self::Medium => 10,
            Self::Long => 14,
        }
    }

    /// Largest valid distance, m.
    #[must_use]
    pub const fn reach(self) -> f32 {
        match self {
            Self::Short => 1.3,
            Self::Medium => 3.0,
            Self::Long => 4.0,
        }
    }

    /// [`register::SD_CONFIG_WOI_SD0`] and the following three registers.
    #[must_use]
    pub const fn windows(self) -> [u8; 4] {
        let [first, second] = self.periods();
        [first, second, self.initial_phase(), self.initial_phase()]
    }
}

/// Whether the configuration is valid.
#[must_use]
pub fn is_possible(config: &Config) -> bool {
    BUDGETS.contains(&config.budget.as_micros())
        && config.period >= config.budget
        && config.period <= Duration::from_secs(10)
        && config.offset.is_finite()
}

const fn nanos_per_macro_period(code: u8) -> u64 {
    NANOS_PER_MACRO_CLOCK * 2 * (code as u64 + 1)
}

const fn rounded(dividend: u64, divisor: u64) -> u64 {
    match dividend.saturating_add(divisor / 2).checked_div(divisor) {
        Some(quotient) => quotient,
        None => 0,
    }
}

/// A number of macro periods in the chip's encoding: eight bits and a binary exponent.
#[must_use]
pub const fn encode_timeout(macro_periods: u64) -> u16 {
    // The chip adds one when it decodes the value.
    let mut mantissa = macro_periods.saturating_sub(1);
    let mut exponent = 0;
    while mantissa > 0xFF {
        mantissa >>= 1;
        exponent += 1;
    }
    (exponent << 8) | mantissa as u16
}

/// [`register::PHASECAL_CONFIG_TIMEOUT_MACROP`] for one millisecond.
#[must_use]
pub const fn phase_calibration(mode: DistanceMode) -> u8 {
    let [first, _] = mode.periods();
    match PHASE_CALIBRATION.checked_div(nanos_per_macro_period(first)) {
        Some(periods) => periods as u8,
        None => 0,
    }
}

/// [`register::RANGE_CONFIG_TIMEOUT_MACROP_A`] and the registers that follow: times, limits of 90
/// mm for the standard deviation and of one million counts a second for the signal, and the
/// accepted phases of a target.
#[must_use]
pub const fn ranging(config: &Config) -> [u8; 12] {
    // The rest of the budget, less a tenth, in two equal parts.
    let part = config.budget.as_micros().saturating_sub(PREPARATION).saturating_mul(450);
    let [first, second] = config.mode.periods();
    let [a1, a0] = encode_timeout(rounded(part, nanos_per_macro_period(first))).to_be_bytes();
    let [b1, b0] = encode_timeout(rounded(part, nanos_per_macro_period(second))).to_be_bytes();
    [a1, a0, first, b1, b0, second, 0x01, 0x68, 0x00, 0x80, 0x08, config.mode.highest_phase()]
}

/// [`register::SYSTEM_INTERMEASUREMENT_PERIOD`] for this period and a chip with this oscillator.
/// The factor of 1.075 is from the published drivers.
#[must_use]
pub const fn inter_measurement(period: Duration, oscillator: u16) -> [u8; 4] {
    // 43/40 is 1.075; the remaining factor of 1000 converts µs to ms.
    let ticks = (oscillator as u64 & 0x3FF).saturating_mul(period.as_micros()).saturating_mul(43) / 40_000;
    (if ticks > u32::MAX as u64 { u32::MAX } else { ticks as u32 }).to_be_bytes()
}

/// [`register::ALGO_PART_TO_PART_RANGE_OFFSET_MM`] from the factory's correction in register
/// [`MM_CONFIG_OUTER_OFFSET_MM`](register::MM_CONFIG_OUTER_OFFSET_MM).
///
/// The chip applies the factory's correction only with the mode corrections, which [`FIXED`]
/// disables. ST's core (`vl53lx_api_core.c`) then copies it to this register, as do public drivers
/// of the VL53L1X.
#[must_use]
pub const fn range_offset(outer: [u8; 2]) -> [u8; 2] {
    i16::from_be_bytes(outer).wrapping_mul(4).to_be_bytes()
}

/// Whether the 13 bits that the chip stores of [`range_offset`] are equal.
#[must_use]
pub const fn is_offset_kept(wanted: [u8; 2], kept: [u8; 2]) -> bool {
    (u16::from_be_bytes(wanted) ^ u16::from_be_bytes(kept)) & 0x1FFF == 0
}

/// Status of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RangeStatus {
    /// A target at this distance.
    Valid,
    /// The standard deviation is above its limit.
    SigmaTooHigh,
    /// No target: the signal is below its limit.
    SignalTooLow,
    /// A target closer than the minimum distance.
    TooClose,
    /// The phase is outside the limits of the distance mode.
    OutOfBounds,
    /// The two ranging parts disagree: a target beyond the range that appears at a shorter
    /// distance.
    WrapAround,
    /// A target that could not be checked for wrap-around.
    NotCheckedForWrap,
    /// Two targets that cannot be separated.
    MergedTargets,
    /// The signal does not exceed the reflection of the cover glass.
    CoverGlass,
    /// The first measurement after a start, without a result.
    Starting,
    /// A laser or bias test failed.
    Hardware,
    /// The chip could not compute a distance.
    Processing,
    /// No measurement available.
    NoUpdate,
}

impl RangeStatus {
    /// Decodes the low five bits of the status register.
    #[must_use]
    pub const fn decode(code: u8) -> Self {
        match code & 0x1F {
            0 => Self::NoUpdate,
            1..=3 => Self::Hardware,
            4 | 21 | 23 => Self::SignalTooLow,
            5 => Self::OutOfBounds,
            6 => Self::SigmaTooHigh,
            7 | 20 => Self::WrapAround,
            8 => Self::TooClose,
            9 => Self::Valid,
            12 => Self::CoverGlass,
            18 => Self::Starting,
            19 => Self::NotCheckedForWrap,
            22 => Self::MergedTargets,
            _ => Self::Processing,
        }
    }

    /// A code of the status register that [`decode`](Self::decode) maps to this status.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::NoUpdate => 0,
            Self::Hardware => 3,
            Self::SignalTooLow => 4,
            Self::OutOfBounds => 5,
            Self::SigmaTooHigh => 6,
            Self::WrapAround => 7,
            Self::TooClose => 8,
            Self::Valid => 9,
            Self::Processing => 10,
            Self::CoverGlass => 12,
            Self::Starting => 18,
            Self::NotCheckedForWrap => 19,
            Self::MergedTargets => 22,
        }
    }

    /// Whether the chip has completed a measurement, with or without a target.
    #[must_use]
    pub const fn is_measurement(self) -> bool {
        !matches!(self, Self::Starting | Self::Hardware | Self::Processing | Self::NoUpdate)
    }

    /// Number of the status in ST's drivers and in
    /// [`TofData::status`](stampfly_types::messages::TofData).
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::Valid => 0,
            Self::SigmaTooHigh => 1,
            Self::SignalTooLow => 2,
            Self::OutOfBounds => 4,
            Self::Hardware => 5,
            Self::NotCheckedForWrap => 6,
            Self::WrapAround => 7,
            Self::Processing => 8,
            Self::CoverGlass => 9,
            Self::Starting => 10,
            Self::MergedTargets => 11,
            Self::TooClose => 13,
            Self::NoUpdate => 255,
        }
    }
}

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reading {
    /// Code of the status register.
    pub code: u8,
    /// Number of the measurement since the start; 255 is followed by 128.
    pub count: u8,
    /// Number of detectors in use.
    pub detectors: f32,
    /// Rate of photons of the laser, 10⁶/s.
    pub signal_rate: f32,
    /// Rate of photons of ambient light, 10⁶/s.
    pub ambient_rate: f32,
    /// Standard deviation of the distance, m.
    pub sigma: f32,
    /// Distance as reported by the chip, m. Negative values result from the error of its
    /// calibration.
    pub distance: f32,
}

impl Reading {
    /// Decodes the result block. `None` when no chip drives the bus: all bytes ones or all zeros.
    ///
    /// Rates have seven fractional bits, detectors eight, the standard deviation two.
    #[must_use]
    pub fn decode(block: &[u8; RESULT_BYTES]) -> Option<Self> {
        if *block == [0xFF; RESULT_BYTES] || *block == [0; RESULT_BYTES] {
            return None;
        }
        let [status, _report, count, d1, d0, _, _, a1, a0, s1, s0, _, _, mm1, mm0, r1, r0] = *block;
        let fixed = |high, low, scale: f32| f32::from(u16::from_be_bytes([high, low])) / scale;
        Some(Self {
            code: status & 0x1F,
            count,
            detectors: fixed(d1, d0, 256.0),
            signal_rate: fixed(r1, r0, 128.0),
            ambient_rate: fixed(a1, a0, 128.0),
            sigma: fixed(s1, s0, 4_000.0),
            distance: f32::from(i16::from_be_bytes([mm1, mm0])) / 1_000.0,
        })
    }

    /// The status that corresponds to the code.
    #[must_use]
    pub const fn status(&self) -> RangeStatus {
        RangeStatus::decode(self.code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(mode: DistanceMode, millis: u64) -> Config {
        Config {
            mode,
            budget: Duration::from_millis(millis),
            period: Duration::from_millis(millis),
            ..Config::default()
        }
    }

    #[test]
    fn ranging_parts_meet_the_published_values_at_33_ms() {
        let bytes = ranging(&config(DistanceMode::Long, 33));
        assert_eq!(bytes, [0x00, 0x60, 0x0F, 0x00, 0x6E, 0x0D, 0x01, 0x68, 0x00, 0x80, 0x08, 0xB8]);
        assert_eq!([DistanceMode::Short, DistanceMode::Long].map(phase_calibration), [0x14, 0x0A]);
        assert_eq!(DistanceMode::Long.windows(), [0x0F, 0x0D, 0x0E, 0x0E]);
        assert_eq!(DistanceMode::Short.windows(), [0x07, 0x05, 0x06, 0x06]);
    }

    #[test]
    fn ranging_parts_stay_within_the_budget_in_every_mode() {
        for mode in [DistanceMode::Short, DistanceMode::Medium, DistanceMode::Long] {
            for millis in 33..=500 {
                let [a1, a0, first, b1, b0, second, ..] = ranging(&config(mode, millis));
                let time = |high, low: u8, code| (u64::from(low) << high) * nanos_per_macro_period(code);
                let total = (time(a1, a0, first) + time(b1, b0, second)) / 1_000;
                assert!(
                    total < millis * 1_000 - 12_000 && total > (millis * 1_000 - 12_000) * 8 / 10,
                    "{mode:?} {millis}"
                );
            }
        }
    }

    #[test]
    fn timeouts_have_eight_bits_and_an_exponent() {
        assert_eq!([1, 256, 257, 409, 2_289].map(encode_timeout), [0x0000, 0x00FF, 0x0180, 0x01CC, 0x048F]);
        assert_eq!(encode_timeout(0), 0);
    }

    #[test]
    fn the_period_is_in_ticks_of_the_chips_own_clock() {
        assert_eq!(u32::from_be_bytes(inter_measurement(Duration::from_millis(100), 1_000)), 107_500);
        assert_eq!(inter_measurement(Duration::from_millis(100), 0xFC00 | 1_000), 107_500u32.to_be_bytes(), "10 bits");
        assert_eq!(inter_measurement(Duration::from_micros(u64::MAX), 1_023), u32::MAX.to_be_bytes());
    }

    #[test]
    fn impossible_configurations_are_told() {
        assert!(is_possible(&Config::default()));
        assert!(!is_possible(&config(DistanceMode::Long, 20)) && !is_possible(&config(DistanceMode::Long, 501)));
        assert!(!is_possible(&Config { period: Duration::from_micros(32_999), ..Config::default() }));
        assert!(!is_possible(&Config { offset: f32::NAN, ..Config::default() }));
    }

    #[test]
    fn the_result_is_taken_apart() {
        let mut block = [0; RESULT_BYTES];
        block[0] = 0xE9;
        block[2] = 200;
        block[3..5].copy_from_slice(&[0x10, 0x80]);
        block[7..9].copy_from_slice(&[0x00, 0xC0]);
        block[9..11].copy_from_slice(&[0x00, 0x0A]);
        block[13..15].copy_from_slice(&1_234u16.to_be_bytes());
        block[15..17].copy_from_slice(&[0x02, 0x40]);
        let reading = Reading::decode(&block).expect("a result");
        assert_eq!((reading.status(), reading.code, reading.count), (RangeStatus::Valid, 9, 200));
        assert_eq!((reading.detectors, reading.signal_rate, reading.ambient_rate), (16.5, 4.5, 1.5));
        assert_eq!((reading.sigma, reading.distance), (0.0025, 1.234));
        block[13..15].copy_from_slice(&(-7i16).to_be_bytes());
        assert_eq!(Reading::decode(&block).expect("a result").distance, -0.007);
        assert_eq!(Reading::decode(&[0xFF; RESULT_BYTES]), None);
        assert_eq!(Reading::decode(&[0; RESULT_BYTES]), None);
    }

    #[test]
    fn every_status_has_a_number_of_its_own_and_valid_is_zero() {
        let mut numbers: std::vec::Vec<u8> = (0..32).map(|code| RangeStatus::decode(code).number()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers, [0, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 13, 255]);
        assert_eq!(RangeStatus::decode(9).number(), 0);
    }

    #[test]
    fn every_status_has_a_code_that_is_read_as_it() {
        for status in (0..32).map(RangeStatus::decode) {
            assert_eq!(RangeStatus::decode(status.code()), status);
        }
    }

    #[test]
    fn a_chip_without_a_target_has_measured_and_one_without_a_laser_has_not() {
        let measured: std::vec::Vec<u8> = (0..32).filter(|code| RangeStatus::decode(*code).is_measurement()).collect();
        assert_eq!(measured, [4, 5, 6, 7, 8, 9, 12, 19, 20, 21, 22, 23]);
    }

    #[test]
    fn only_one_code_is_a_valid_range() {
        let valid: std::vec::Vec<u8> =
            (0..=255).filter(|code| RangeStatus::decode(*code) == RangeStatus::Valid).collect();
        assert!(valid.iter().all(|code| code & 0x1F == 9) && valid.len() == 8);
        assert_eq!([4, 5, 6, 7].map(RangeStatus::decode), {
            use RangeStatus::{OutOfBounds, SigmaTooHigh, SignalTooLow, WrapAround};
            [SignalTooLow, OutOfBounds, SigmaTooHigh, WrapAround]
        });
        assert_eq!([2, 19, 22].map(RangeStatus::decode), {
            use RangeStatus::{Hardware, MergedTargets, NotCheckedForWrap};
            [Hardware, NotCheckedForWrap, MergedTargets]
        });
    }
}
