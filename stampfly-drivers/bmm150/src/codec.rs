//! Registers, timing and compensation of the BMM150, from Bosch BST-BMM150-DS001. Register
//! addresses refer to its chapter "Register description".
//!
//! The data sheet refers to Bosch's sensor API for the compensation. Both forms here use its
//! formulas (`bmm150.c`, BSD-3) and agree within the rounding of the integer form. Flight code uses
//! the floating-point form.

use super::config::Config;
pub use super::config::{Preset, Rate};
use stampfly_types::{Duration, Vec3};

/// Register addresses.
pub mod register {
    /// Identification, readable only when the chip is powered on.
    pub const CHIP_ID: u8 = 0x40;
    /// Data, status and modes up to 0x4C, read in one burst: see [`Reading`](super::Reading).
    pub const DATA_X_LSB: u8 = 0x42;
    /// Power control and reset.
    pub const POWER: u8 = 0x4B;
    /// Rate, mode, self test.
    pub const MODE: u8 = 0x4C;
    /// Number of repetitions of x and y.
    pub const REPETITIONS_XY: u8 = 0x51;
    /// Number of repetitions of z.
    pub const REPETITIONS_Z: u8 = 0x52;
    /// Factory trim, 21 bytes.
    pub const TRIM: u8 = 0x5D;
}

/// Value of [`register::CHIP_ID`].
pub const CHIP_ID_VALUE: u8 = 0x32;
/// Power on and four-wire SPI, in [`register::POWER`].
pub const POWER_ON: u8 = 0x01;
/// Reset without a change of the power control, in [`register::POWER`].
pub const SOFT_RESET: u8 = 0x83;
/// Sleep mode and start of the self test, in [`register::MODE`]. The chip clears the lowest bit at
/// the end of the test.
pub const SELF_TEST: u8 = 0x07;

impl Preset {
    /// Registers 0x51 (a) and 0x52 (b): 1 + 2 a repetitions of x and y, 1 + b of z.
    #[must_use]
    pub const fn codes(self) -> [u8; 2] {
        match self {
            Self::LowPower => [1, 2],
            Self::Regular => [4, 14],
            Self::Enhanced => [7, 26],
            Self::HighAccuracy => [23, 82],
        }
    }

    /// Duration of a measurement: 145 µs per repetition of x and y, 500 µs per repetition of z, and
    /// 980 µs.
    #[must_use]
    pub const fn duration(self) -> Duration {
        let [xy, z] = self.codes();
        Duration::from_micros(145 * (1 + 2 * xy as u64) + 500 * (1 + z as u64) + 980)
    }
}

impl Rate {
    const fn code(self) -> u8 {
        match self {
            Self::Hz10 => 0,
            Self::Hz2 => 1,
            Self::Hz6 => 2,
            Self::Hz8 => 3,
            Self::Hz15 => 4,
            Self::Hz20 => 5,
            Self::Hz25 => 6,
            Self::Hz30 => 7,
        }
    }

    /// Time between two samples.
    #[must_use]
    pub const fn period(self) -> Duration {
        let hertz = match self {
            Self::Hz2 => 2,
            Self::Hz6 => 6,
            Self::Hz8 => 8,
            Self::Hz10 => 10,
            Self::Hz15 => 15,
            Self::Hz20 => 20,
            Self::Hz25 => 25,
            Self::Hz30 => 30,
        };
        Duration::from_micros(1_000_000 / hertz)
    }
}

/// MODE for this rate and normal operation.
#[must_use]
pub const fn mode_bits(config: &Config) -> u8 {
    config.rate.code() << 3
}

/// Data and status: registers 0x42 to 0x4C, read in one burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// x and y with 13 bits, z with 15 bits, in counts.
    pub raw: [i16; 3],
    /// Hall resistance, 14 bits.
    pub hall: u16,
    /// The data is new. This flag is part of the burst, so no sample is missed or repeated.
    pub ready: bool,
    /// POWER as read back from the chip.
    pub power: u8,
    /// MODE as read back from the chip.
    pub mode: u8,
}

impl Reading {
    /// Decodes the burst.
    #[must_use]
    pub const fn decode(burst: &[u8; 11]) -> Self {
        let [x0, x1, y0, y1, z0, z1, r0, r1, _interrupt, power, mode] = *burst;
        Self {
            raw: [
                i16::from_le_bytes([x0, x1]) >> 3,
                i16::from_le_bytes([y0, y1]) >> 3,
                i16::from_le_bytes([z0, z1]) >> 1,
            ],
            hall: u16::from_le_bytes([r0, r1]) >> 2,
            ready: r0 & 1 != 0,
            power,
            mode,
        }
    }

    /// Whether no axis has overflowed. An axis that has reads its most negative number.
    #[must_use]
    pub fn is_in_range(&self) -> bool {
        let [x, y, z] = self.raw;
        x != -4096 && y != -4096 && z != -16_384 && self.hall != 0
    }
}

/// Whether all three axes passed the self test. The lowest data bit of each axis holds its result.
#[must_use]
pub const fn passes_self_test(data: &[u8; 6]) -> bool {
    let [x, _, y, _, z, _] = *data;
    x & y & z & 1 != 0
}

/// Factory trim of an individual chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names are the sensor API's, without dig_")]
pub struct Trim {
    pub x1: i8,
    pub y1: i8,
    pub x2: i8,
    pub y2: i8,
    pub z1: u16,
    pub z2: i16,
    pub z3: i16,
    pub z4: i16,
    pub xy1: u8,
    pub xy2: i8,
    pub xyz1: u16,
}

impl Trim {
    /// Decodes the trim registers; `None` when they are empty.
    #[must_use]
    pub fn decode(bytes: &[u8; 21]) -> Option<Self> {
        let [x1, y1, _, _, _, z4l, z4h, x2, y2, _, _, z2l, z2h, z1l, z1h, xyz1l, xyz1h, z3l, z3h, xy2, xy1] = *bytes;
        let trim = Self {
            x1: x1 as i8,
            y1: y1 as i8,
            x2: x2 as i8,
            y2: y2 as i8,
            z1: u16::from_le_bytes([z1l, z1h]),
            z2: i16::from_le_bytes([z2l, z2h]),
            z3: i16::from_le_bytes([z3l, z3h]),
            z4: i16::from_le_bytes([z4l, z4h]),
            xy1,
            xy2: xy2 as i8,
            xyz1: u16::from_le_bytes([xyz1l, xyz1h & 0x7F]),
        };
        (trim.xyz1 != 0 && trim.z1 != 0 && trim.z2 != 0 && *bytes != [0xFF; 21]).then_some(trim)
    }

    /// Flux density along the chip's axes, µT. `None` on overflow or when the trim does not yield a
    /// finite value.
    #[must_use]
    pub fn compensate(&self, reading: &Reading) -> Option<Vec3> {
        if !reading.is_in_range() {
            return None;
        }
        let [x, y, z] = reading.raw.map(f32::from);
        let hall = f32::from(reading.hall);
        // Deviation of the Hall resistance, and thus of the temperature, from the factory's.
        let drift = f32::from(self.xyz1) * 16_384.0 / hall - 16_384.0;
        let gain =
            f32::from(self.xy2) * (drift * drift / 268_435_456.0) + drift * f32::from(self.xy1) / 16_384.0 + 256.0;
        let lateral = |raw: f32, offset: i8, sensitivity: i8| {
            (raw * gain * (f32::from(sensitivity) + 160.0) / 8_192.0 + f32::from(offset) * 8.0) / 16.0
        };
        let numerator = (z - f32::from(self.z4)) * 131_072.0 - f32::from(self.z3) * (hall - f32::from(self.xyz1));
        let denominator = (f32::from(self.z2) + f32::from(self.z1) * hall / 32_768.0) * 4.0;
        let field =
            Vec3::new(lateral(x, self.x1, self.x2), lateral(y, self.y1, self.y2), numerator / denominator / 16.0);
        field.iter().all(|value| value.is_finite()).then_some(field)
    }

    /// The same with integers, in sixteenths of a µT, for processors without floating point.
    #[must_use]
    pub fn compensate_integer(&self, reading: &Reading) -> Option<[i32; 3]> {
        if !reading.is_in_range() {
            return None;
        }
        let [x, y, z] = reading.raw.map(i64::from);
        let (hall, xyz1) = (i64::from(reading.hall), i64::from(self.xyz1));
        let drift = xyz1 * 16_384 / hall - 16_384;
        let curve = i64::from(self.xy2) * (drift * drift / 128) + drift * i64::from(self.xy1) * 128;
        let gain = curve / 512 + 0x10_0000;
        let lateral = |raw: i64, offset: i8, sensitivity: i8| {
            raw * (gain * (i64::from(sensitivity) + 160) / 4_096) / 8_192 + i64::from(offset) * 8
        };
        let numerator = (z - i64::from(self.z4)) * 32_768 - i64::from(self.z3) * (hall - xyz1) / 4;
        let denominator = i64::from(self.z2) + (i64::from(self.z1) * hall * 2 + 32_768) / 65_536;
        let [x, y] = [lateral(x, self.x1, self.x2), lateral(y, self.y1, self.y2)].map(i32::try_from);
        Some([x.ok()?, y.ok()?, i32::try_from(numerator.checked_div(denominator)?).ok()?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trim of typical size.
    const TRIM: Trim =
        Trim { x1: 0, y1: -3, x2: 26, y2: 24, z1: 24_747, z2: 763, z3: 0, z4: 0, xy1: 29, xy2: -3, xyz1: 7_053 };

    fn reading(raw: [i16; 3], hall: u16) -> Reading {
        Reading { raw, hall, ready: true, power: 1, mode: 0 }
    }

    #[test]
    fn at_the_factorys_temperature_the_scale_is_the_trims_alone() {
        // Without drift: x · 256 · 186 / 8192 / 16 and z · 131072 / (763 + 24747 · 7053 / 32768) /
        // 4 / 16.
        let field = TRIM.compensate(&reading([100, 0, 500], 7_053)).expect("in range");
        assert!((field.x - 36.328_125).abs() < 1e-4, "{field}");
        assert!((field.y - -1.5).abs() < 1e-4, "{field}");
        assert!((field.z - 168.156_8).abs() < 1e-3, "{field}");
    }

    #[test]
    fn integers_and_floats_agree_at_every_temperature_and_field() {
        let trims = [TRIM, Trim { x1: -20, y1: 30, x2: -25, y2: 60, z3: -900, z4: 120, xy2: -20, xy1: 60, ..TRIM }];
        for trim in trims {
            for hall in (5_500..9_000).step_by(250) {
                for raw in (-2_000i16..2_000).step_by(117) {
                    let reading = reading([raw, -raw, 4 * raw], hall);
                    let float = trim.compensate(&reading).expect("in range");
                    let integer = trim.compensate_integer(&reading).expect("in range");
                    for (float, integer) in float.iter().zip(integer) {
                        let difference = float - integer as f32 / 16.0;
                        // The integer form rounds the slopes to a few parts in ten thousand.
                        assert!(difference.abs() < 0.15 + 0.002 * float.abs(), "{hall} {raw}: {float} {integer}");
                    }
                }
            }
        }
    }

    #[test]
    fn overflow_and_nonsense_are_no_field() {
        for raw in [[-4096, 0, 0], [0, -4096, 0], [0, 0, -16_384]] {
            assert_eq!(TRIM.compensate(&reading(raw, 7_053)), None);
            assert_eq!(TRIM.compensate_integer(&reading(raw, 7_053)), None);
        }
        assert_eq!(TRIM.compensate(&reading([1, 1, 1], 0)), None);
        // A zero denominator.
        let broken = Trim { z1: 32_768, z2: -7_053, ..TRIM };
        assert_eq!(broken.compensate(&reading([1, 1, 1], 7_053)), None);
        assert_eq!(broken.compensate_integer(&reading([1, 1, 1], 7_053)), None);
        for trim in [Trim { z2: i16::MIN, z1: 1, xy2: -128, xy1: 255, x2: 127, ..TRIM }, TRIM] {
            for hall in [1, 2, 16_383] {
                let _ = trim.compensate_integer(&reading([-4_095, 4_095, 16_383], hall));
                let field = trim.compensate(&reading([-4_095, 4_095, 16_383], hall));
                assert!(field.is_none_or(|field| field.iter().all(|value| value.is_finite())));
            }
        }
    }

    #[test]
    fn the_burst_and_the_trim_are_read_in_their_order() {
        let reading = Reading::decode(&[0xF8, 0xFF, 0x08, 0x00, 0xFE, 0x7F, 0x35, 0x6E, 0, 1, 0x30]);
        assert_eq!(reading.raw, [-1, 1, 16_383]);
        assert_eq!((reading.hall, reading.ready, reading.power, reading.mode), (0x1B8D, true, 1, 0x30));
        let bytes = [0, 0xFD, 9, 9, 9, 0, 0, 26, 24, 9, 9, 0xFB, 0x02, 0xAB, 0x60, 0x8D, 0x1B, 0, 0, 0xFD, 29];
        assert_eq!(Trim::decode(&bytes), Some(TRIM));
        assert_eq!(Trim::decode(&[0; 21]), None);
        assert_eq!(Trim::decode(&[0xFF; 21]), None);
    }

    #[test]
    fn the_presets_are_those_of_the_table() {
        // Recommended presets: repetitions, and the rate they allow.
        for (preset, xy, z, hertz) in [
            (Preset::LowPower, 3, 3, 300.0),
            (Preset::Regular, 9, 15, 100.0),
            (Preset::Enhanced, 15, 27, 60.0),
            (Preset::HighAccuracy, 47, 83, 20.0),
        ] {
            let [a, b] = preset.codes();
            assert_eq!((1 + 2 * a, 1 + b), (xy, z));
            let rate = 1.0 / preset.duration().seconds();
            assert!(rate > hertz && rate < 1.2 * hertz, "{rate}");
        }
    }
}
