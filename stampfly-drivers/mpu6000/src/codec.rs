//! Registers and values of the MPU-6000, from InvenSense's register map RM-MPU-6000A-00 revision
//! 4.2 ("RM") and product specification PS-MPU-6000A-00 revision 3.4 ("PS").

use crate::{AccelRange, Config, Filter, GyroRange};

/// Register addresses (RM 3).
pub mod register {
    /// Factory responses to the self test, four registers.
    pub const SELF_TEST: u8 = 0x0D;
    /// Divider of the sample rate, followed by the low-pass filter and the two ranges.
    pub const SMPLRT_DIV: u8 = 0x19;
    /// Low-pass filter.
    pub const CONFIG: u8 = 0x1A;
    /// Gyroscope: self test and range.
    pub const GYRO_CONFIG: u8 = 0x1B;
    /// Accelerometer: self test and range.
    pub const ACCEL_CONFIG: u8 = 0x1C;
    /// Interrupt status; first register that may be read at the fast clock.
    pub const INT_STATUS: u8 = 0x3A;
    /// Accelerometer x, y, z, temperature, gyroscope x, y, z, high byte first.
    pub const ACCEL_XOUT_H: u8 = 0x3B;
    /// Last register of the data.
    pub const GYRO_ZOUT_L: u8 = 0x48;
    /// Reset of the signal paths.
    pub const SIGNAL_PATH_RESET: u8 = 0x68;
    /// Configuration of the interfaces.
    pub const USER_CTRL: u8 = 0x6A;
    /// Reset, sleep, clock.
    pub const PWR_MGMT_1: u8 = 0x6B;
    /// Identification: [`IDENTITY`](super::IDENTITY).
    pub const WHO_AM_I: u8 = 0x75;
}

/// Value of [`register::WHO_AM_I`], also on SPI (RM 4.34).
pub const IDENTITY: u8 = 0x68;
/// PWR_MGMT_1: DEVICE_RESET, bit 7 (RM 4.30). Not 0x08, which is TEMP_DIS: it disables the
/// thermometer and wakes the chip without a reset.
pub const RESET: u8 = 0x80;
/// PWR_MGMT_1: awake, thermometer on, clock from the gyroscope's z axis, which is more stable than
/// the internal oscillator (RM 4.30).
pub const AWAKE: u8 = 0x03;
/// SIGNAL_PATH_RESET: gyroscope, accelerometer, thermometer (RM 4.27).
pub const ALL_PATHS: u8 = 0x07;
/// USER_CTRL: I2C_IF_DIS, so that the chip does not take traffic for other devices as I2C (RM
/// 4.29).
pub const SPI_ONLY: u8 = 0x10;
/// Self test of x, y and z, in GYRO_CONFIG and in ACCEL_CONFIG (RM 4.4, 4.5).
pub const TEST_ALL: u8 = 0xE0;

impl AccelRange {
    /// The value of the register.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::G2 => 0x00,
            Self::G4 => 0x08,
            Self::G8 => 0x10,
            Self::G16 => 0x18,
        }
    }

    /// Counts per standard gravity (PS 6.2).
    #[must_use]
    pub const fn counts_per_g(self) -> f32 {
        match self {
            Self::G2 => 16_384.0,
            Self::G4 => 8_192.0,
            Self::G8 => 4_096.0,
            Self::G16 => 2_048.0,
        }
    }
}

impl GyroRange {
    /// The value of the register.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Dps250 => 0x00,
            Self::Dps500 => 0x08,
            Self::Dps1000 => 0x10,
            Self::Dps2000 => 0x18,
        }
    }

    /// Counts per degree per second (PS 6.1).
    #[must_use]
    pub const fn counts_per_dps(self) -> f32 {
        match self {
            Self::Dps250 => 131.0,
            Self::Dps500 => 65.5,
            Self::Dps1000 => 32.8,
            Self::Dps2000 => 16.4,
        }
    }
}

impl Filter {
    /// The value of the register.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Hz256 => 0,
            Self::Hz188 => 1,
            Self::Hz98 => 2,
            Self::Hz42 => 3,
            Self::Hz20 => 4,
            Self::Hz10 => 5,
            Self::Hz5 => 6,
        }
    }

    /// The larger bandwidth of the two sensors, Hz (RM 4.3).
    #[must_use]
    pub const fn bandwidth(self) -> u64 {
        match self {
            Self::Hz256 => 260,
            Self::Hz188 => 188,
            Self::Hz98 => 98,
            Self::Hz42 => 44,
            Self::Hz20 => 21,
            Self::Hz10 => 10,
            Self::Hz5 => 5,
        }
    }

    /// Sample rate of the gyroscope before the divider, Hz (RM 4.2). The accelerometer always has
    /// 1000 Hz.
    #[must_use]
    pub const fn rate(self) -> u64 {
        match self {
            Self::Hz256 => 8_000,
            _ => 1_000,
        }
    }
}

/// SMPLRT_DIV, CONFIG, GYRO_CONFIG and ACCEL_CONFIG.
#[must_use]
pub const fn settings(config: &Config) -> [u8; 4] {
    [config.divider, config.filter.code(), config.gyro_range.code(), config.accel_range.code()]
}

/// Whether the low-pass filter prevents aliasing, both at the chip's sample rate and at the rate of
/// the driver's samples.
#[must_use]
pub const fn is_sampled_often_enough(config: &Config) -> bool {
    let chip = config.filter.rate() / (config.divider as u64 + 1);
    let interval = config.interval.as_micros();
    let least = 2 * config.filter.bandwidth();
    chip >= least && interval > 0 && interval * least <= 1_000_000
}

/// The data burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Accelerometer x, y, z, counts.
    pub accel: [i16; 3],
    /// Thermometer, counts.
    pub temperature: i16,
    /// Gyroscope x, y, z, counts.
    pub gyro: [i16; 3],
}

impl Sample {
    /// Decodes the burst. `None` when no awake chip drives the bus: all bytes ones or all zeros.
    #[must_use]
    pub fn decode(burst: &[u8; 14]) -> Option<Self> {
        if *burst == [0xFF; 14] || *burst == [0; 14] {
            return None;
        }
        let [ax0, ax1, ay0, ay1, az0, az1, t0, t1, gx0, gx1, gy0, gy1, gz0, gz1] = *burst;
        Some(Self {
            accel: [[ax0, ax1], [ay0, ay1], [az0, az1]].map(i16::from_be_bytes),
            temperature: i16::from_be_bytes([t0, t1]),
            gyro: [[gx0, gx1], [gy0, gy1], [gz0, gz1]].map(i16::from_be_bytes),
        })
    }

    /// Die temperature, °C (RM 4.18).
    #[must_use]
    pub fn celsius(&self) -> f32 {
        f32::from(self.temperature) / 340.0 + 36.53
    }
}

/// Factory responses to the self test, in counts at ±8 g and ±250 °/s: accelerometer x, y, z,
/// gyroscope x, y, z (RM 4.1). Zero where the factory has stored none.
#[must_use]
pub fn factory_answers(registers: [u8; 4]) -> [f32; 6] {
    let [x, y, z, rest] = registers;
    // A code of the accelerometer has five bits: the upper three are in the register of the axis,
    // the lower two in the last register.
    let accel = [x >> 5 << 2 | rest >> 4 & 3, y >> 5 << 2 | rest >> 2 & 3, z >> 5 << 2 | rest & 3];
    let gyro = [x & 0x1F, y & 0x1F, z & 0x1F];
    // The factor is (0.92 / 0.34)^(1/30); the exponents are integers.
    let [ax, ay, az] = accel.map(|code| grown(4096.0 * 0.34, 1.033_736, code));
    let [gx, gy, gz] = gyro.map(|code| grown(25.0 * 131.0, 1.046, code));
    // The factory response of the gyroscope's y axis is negative (RM 4.1).
    [ax, ay, az, gx, -gy, gz]
}

fn grown(first: f32, factor: f32, code: u8) -> f32 {
    match code.checked_sub(1) {
        None => 0.0,
        Some(times) => (0..times).fold(first, |value, _| value * factor),
    }
}

/// Whether each response is within 14 % of the factory's (RM 4.1; PS 6.1, 6.2). Without a factory
/// value, a response of more than 100 counts passes.
#[must_use]
pub fn passes_self_test(answers: &[f32; 6], factory: &[f32; 6]) -> bool {
    answers.iter().zip(factory).all(|(answer, factory)| {
        if *factory == 0.0 { answer.abs() > 100.0 } else { (answer / factory - 1.0).abs() <= 0.14 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::Duration;

    #[test]
    fn the_default_configuration_is_what_the_registers_say() {
        assert_eq!(settings(&Config::default()), [0x00, 0x00, 0x18, 0x18]);
        assert!(is_sampled_often_enough(&Config::default()));
    }

    #[test]
    fn samples_that_are_skipped_have_to_be_filtered() {
        let often = |filter, divider, micros| {
            let interval = Duration::from_micros(micros);
            is_sampled_often_enough(&Config { filter, divider, interval, ..Config::default() })
        };
        assert!(often(Filter::Hz256, 0, 125) && often(Filter::Hz256, 7, 1_000) && often(Filter::Hz188, 0, 2_500));
        assert!(!often(Filter::Hz256, 0, 2_500), "260 Hz at 400 Hz");
        assert!(!often(Filter::Hz256, 15, 1_000), "500 Hz in the chip");
        assert!(often(Filter::Hz42, 4, 5_000) && !often(Filter::Hz42, 0, 0));
    }

    #[test]
    fn a_burst_is_big_endian_and_what_nobody_says_is_none() {
        let burst = [0, 1, 0xFF, 0xFE, 0x80, 0, 0xF6, 0x44, 0x7F, 0xFF, 0, 2, 0xFF, 0xFF];
        let sample = Sample::decode(&burst).expect("a sample");
        assert_eq!((sample.accel, sample.gyro), ([1, -2, i16::MIN], [i16::MAX, 2, -1]));
        assert!((sample.celsius() - 29.2).abs() < 0.01, "−2492 counts");
        assert_eq!([[0xFF; 14], [0; 14]].map(|burst| Sample::decode(&burst)), [None; 2]);
    }

    #[test]
    fn the_factorys_answers_are_those_of_the_formulas() {
        // Accelerometer codes 1, 16, 31; gyroscope codes 1, 16, 31.
        let registers = [0b000_00001, 0b100_10000, 0b111_11111, 0b00_01_00_11];
        let [ax, ay, az, gx, gy, gz] = factory_answers(registers);
        assert_eq!((ax, gx), (1392.64, 3275.0));
        assert!((ay - 2290.8).abs() < 1.0 && (az - 3768.3).abs() < 1.0, "{ay} {az}");
        assert!((gy + 6429.3).abs() < 2.0 && (gz - 12621.0).abs() < 5.0, "{gy} {gz}");
        let answers = [ax, ay, az, gx, gy, gz];
        assert!(passes_self_test(&answers.map(|answer| 1.13 * answer), &answers));
        assert!(!passes_self_test(&answers.map(|answer| 0.85 * answer), &answers));
        assert!(!passes_self_test(&[0.0; 6], &factory_answers([0; 4])));
    }
}
