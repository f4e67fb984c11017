//! Registers, timing and compensation of the BMP280, from Bosch BST-BMP280-DS001 revision 1.23.

use super::config::Config;
pub use super::config::{Filter, Oversampling};
use stampfly_types::Duration;
pub use stampfly_types::pressure_altitude;

/// Register addresses, §4.2.
pub mod register {
    /// Factory calibration, 24 bytes, §3.11.2.
    pub const CALIBRATION: u8 = 0x88;
    /// Identification, §4.3.1.
    pub const ID: u8 = 0xD0;
    /// Reset, §4.3.2.
    pub const RESET: u8 = 0xE0;
    /// Status, §4.3.3; first register of the [`Reading`](super::Reading) burst.
    pub const STATUS: u8 = 0xF3;
    /// Oversampling and mode, §4.3.4.
    pub const CTRL_MEAS: u8 = 0xF4;
    /// Filter, §4.3.5.
    pub const CONFIG: u8 = 0xF5;
}

/// Values of [`register::ID`]: BMP280, and BME280, which measures pressure in the same way.
pub const IDENTIFICATIONS: [u8; 2] = [0x58, 0x60];
/// Value that [`register::RESET`] takes for a reset.
pub const SOFT_RESET: u8 = 0xB6;
/// One conversion followed by sleep, §3.6.2.
pub const FORCED: u8 = 0x01;
/// Mask of the mode in [`register::CTRL_MEAS`]. The chip returns to sleep, zero, after a forced
/// conversion, §4.3.4.
pub const MODE: u8 = 0x03;
/// A conversion is in progress, §4.3.3.
pub const MEASURING: u8 = 0x08;
/// The chip copies its calibration, §4.3.3.
pub const COPYING: u8 = 0x01;

impl Oversampling {
    const fn code(self) -> u8 {
        self as u8 + 1
    }

    const fn conversions(self) -> u64 {
        1 << self as u8
    }
}

/// CTRL_MEAS without the mode.
#[must_use]
pub const fn oversampling_bits(config: &Config) -> u8 {
    config.temperature.code() << 5 | config.pressure.code() << 2
}

/// CONFIG with the filter. The standby time is not used, and bit 0 stays zero for four-wire SPI.
#[must_use]
pub const fn filter_bits(config: &Config) -> u8 {
    (config.filter as u8) << 2
}

/// Maximum duration of a conversion, §3.8.1 table 13.
#[must_use]
pub const fn conversion_limit(config: &Config) -> Duration {
    Duration::from_micros(1_250 + 2_300 * (config.temperature.conversions() + config.pressure.conversions()) + 575)
}

/// Time from the start of a typical conversion to the middle of its pressure part, which follows
/// the temperature part, §3.8.1 and §3.3.
#[must_use]
pub const fn pressure_instant(config: &Config) -> Duration {
    Duration::from_micros(
        1_000 + 2_000 * config.temperature.conversions() + 1_000 * config.pressure.conversions() + 250,
    )
}

/// Status, configuration and data: registers 0xF3 to 0xFC, read in one burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// A conversion is in progress, §4.3.3.
    pub measuring: bool,
    /// CTRL_MEAS without the mode, as read back from the chip.
    pub oversampling_bits: u8,
    /// CONFIG without the standby time, as read back from the chip.
    pub filter_bits: u8,
    /// Uncompensated pressure, 20 bits, §4.3.6.
    pub pressure: i32,
    /// Uncompensated temperature, 20 bits, §4.3.7.
    pub temperature: i32,
}

impl Reading {
    /// Value of a measurement that has not been made, §4.3.6.
    pub const SKIPPED: i32 = 0x8_0000;

    /// Decodes the burst.
    #[must_use]
    pub const fn decode(burst: &[u8; 10]) -> Self {
        let [status, control, config, _, p2, p1, p0, t2, t1, t0] = *burst;
        Self {
            measuring: status & MEASURING != 0,
            oversampling_bits: control & 0xFC,
            filter_bits: config & 0x1C,
            pressure: i32::from_be_bytes([0, p2, p1, p0]) >> 4,
            temperature: i32::from_be_bytes([0, t2, t1, t0]) >> 4,
        }
    }
}

/// Factory calibration of an individual chip, §3.11.2 table 17.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Calibration {
    /// dig_T1.
    pub t1: u16,
    /// dig_T2 and dig_T3.
    pub t: [i16; 2],
    /// dig_P1.
    pub p1: u16,
    /// dig_P2 to dig_P9.
    pub p: [i16; 8],
}

/// Temperature and pressure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Compensated {
    /// Temperature, hundredths of a degree Celsius.
    pub temperature: i32,
    /// Pressure, Pa, with eight fractional bits.
    pub pressure: u32,
}

impl Calibration {
    /// Decodes the calibration registers; `None` when they are empty.
    #[must_use]
    pub fn decode(bytes: &[u8; 24]) -> Option<Self> {
        let (words, _) = bytes.as_chunks::<2>();
        let mut words = words.iter().map(|word| i16::from_le_bytes(*word));
        let mut next = || words.next().unwrap_or(0);
        let t1 = next() as u16;
        let t = [next(), next()];
        let p1 = next() as u16;
        let p = core::array::from_fn(|_| next());
        (t1 != 0 && t1 != u16::MAX && p1 != 0 && p1 != u16::MAX).then_some(Self { t1, t, p1, p })
    }

    /// Compensates a reading with 64-bit integers, §3.11.3. `None` when the result cannot be
    /// represented.
    ///
    /// Keeps the intermediate steps of the data sheet, so that the result is bit-identical.
    #[must_use]
    pub fn compensate(&self, raw_temperature: i32, raw_pressure: i32) -> Option<Compensated> {
        let [t2, t3] = self.t.map(i64::from);
        let [p2, p3, p4, p5, p6, p7, p8, p9] = self.p.map(i64::from);
        let (t1, p1) = (i64::from(self.t1), i64::from(self.p1));
        // Temperature. The input has 20 bits, so no intermediate value exceeds 2³⁵.
        let raw = i64::from(raw_temperature & 0xF_FFFF);
        let linear = (((raw >> 3) - (t1 << 1)) * t2) >> 11;
        let offset = (raw >> 4) - t1;
        let fine = linear + ((((offset * offset) >> 12) * t3) >> 14);
        // Pressure: an offset and a sensitivity that depend on temperature, then a parabola.
        let warmth = fine - 128_000;
        let offset = warmth * warmth * p6 + ((warmth * p5) << 17) + (p4 << 35);
        let slope = ((warmth * warmth * p3) >> 8) + ((warmth * p2) << 12);
        let sensitivity = ((1i64 << 47) + slope).checked_mul(p1)? >> 33;
        let raw = i64::from(0x10_0000 - (raw_pressure & 0xF_FFFF));
        let scaled = ((raw << 31) - offset).checked_mul(3_125)?.checked_div(sensitivity)?;
        // Four times the range of the chip. Beyond it the calibration is invalid, and the parabola
        // could overflow.
        if !(0..1 << 34).contains(&scaled) {
            return None;
        }
        let square = (p9 * (scaled >> 13) * (scaled >> 13)) >> 25;
        let linear = (p8 * scaled) >> 19;
        let pressure = ((scaled + square + linear) >> 8) + (p7 << 4);
        let temperature = (fine * 5 + 128) >> 8;
        Some(Compensated { temperature: i32::try_from(temperature).ok()?, pressure: u32::try_from(pressure).ok()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of §3.12.
    const EXAMPLE: Calibration = Calibration {
        t1: 27_504,
        t: [26_435, -1_000],
        p1: 36_477,
        p: [-10_685, 3_024, 2_855, 140, -7, 15_500, -14_600, 6_000],
    };

    #[test]
    fn the_data_sheets_example_comes_out() {
        let Compensated { temperature, pressure } = EXAMPLE.compensate(519_888, 415_148).expect("a result");
        assert_eq!(temperature, 2_508, "25.08 °C");
        // The figure prints 25 767 236 (100 653.27 Pa), the result in floating point. The integer
        // formula next to it yields three units less, a hundredth of a pascal.
        assert_eq!(pressure, 25_767_233);
    }

    #[test]
    fn the_calibration_is_read_in_its_order() {
        let words: [i16; 12] =
            [27_504, 26_435, -1_000, 36_477u16 as i16, -10_685, 3_024, 2_855, 140, -7, 15_500, -14_600, 6_000];
        let mut bytes = [0; 24];
        for (pair, word) in bytes.chunks_mut(2).zip(words) {
            pair.copy_from_slice(&word.to_le_bytes());
        }
        assert_eq!(Calibration::decode(&bytes), Some(EXAMPLE));
        assert_eq!(Calibration::decode(&[0; 24]), None);
        assert_eq!(Calibration::decode(&[0xFF; 24]), None);
    }

    #[test]
    fn no_reading_and_no_calibration_can_break_the_arithmetic() {
        let extremes = [i16::MIN, -1, 0, 1, i16::MAX];
        let raw = [0, 1, 0x8_0000, 0xF_FFFF, -1, i32::MIN];
        let mut refused = 0;
        for number in 0..5u32.pow(6) {
            let pick = |place: u32| extremes[(number / 5u32.pow(place) % 5) as usize];
            let calibration = Calibration {
                t1: pick(0) as u16,
                t: [pick(1), pick(2)],
                p1: pick(3) as u16,
                p: [pick(4), pick(5), pick(0), pick(1), pick(2), pick(3), pick(4), pick(5)],
            };
            for temperature in raw {
                for pressure in raw {
                    refused += u32::from(calibration.compensate(temperature, pressure).is_none());
                }
            }
        }
        assert!(refused > 0);
    }

    #[test]
    fn the_times_are_those_of_the_table() {
        use Oversampling::{X1, X2, X4, X8, X16};
        // Table 13: oversampling of pressure and temperature, maximum time in ms.
        for (pressure, temperature, limit) in
            [(X1, X1, 6.4), (X2, X1, 8.7), (X4, X1, 13.3), (X8, X1, 22.5), (X16, X2, 43.2)]
        {
            let config = Config { pressure, temperature, ..Config::default() };
            assert!((conversion_limit(&config).seconds() * 1e3 - limit).abs() < 0.06);
            assert!(pressure_instant(&config) < conversion_limit(&config));
        }
    }

    #[test]
    fn registers_are_put_together_and_taken_apart() {
        let config = Config { pressure: Oversampling::X4, temperature: Oversampling::X2, ..Config::default() };
        assert_eq!(oversampling_bits(&config), 0b0100_1100);
        assert_eq!(filter_bits(&Config { filter: Filter::C16, ..config }), 0b0001_0000);
        let reading = Reading::decode(&[0x08, 0x4D, 0x08, 0, 0x65, 0x5A, 0xC0, 0x7E, 0xED, 0x00]);
        assert!(reading.measuring);
        assert_eq!((reading.oversampling_bits, reading.filter_bits), (0x4C, 0x08));
        assert_eq!((reading.pressure, reading.temperature), (415_148, 519_888), "the example's");
    }

    #[test]
    fn altitudes_are_those_of_the_standard_atmosphere() {
        // ICAO doc 7488: 0, 500 and 1000 m.
        for (pascals, metres) in [(101_325.0, 0.0), (95_460.8, 500.0), (89_874.6, 1_000.0)] {
            assert!((pressure_altitude(pascals) - metres).abs() < 0.5, "{}", pressure_altitude(pascals));
        }
    }
}
