//! Configuration of a BMI270: full scales and rate. The register codes are in
//! [`codec`](super::codec).

/// Configuration of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Full scale of the accelerometer.
    pub accel_range: AccelRange,
    /// Full scale of the gyroscope.
    pub gyro_range: GyroRange,
    /// Rate of the samples returned by the driver.
    pub rate: Rate,
}

impl Default for Config {
    /// ±8 g, ±2000 °/s, 400 Hz.
    fn default() -> Self {
        Self { accel_range: AccelRange::G8, gyro_range: GyroRange::Dps2000, rate: Rate::Hz400 }
    }
}

/// Full scale of the accelerometer, register 0x41.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum AccelRange {
    G2,
    G4,
    G8,
    G16,
}

/// Full scale of the gyroscope, °/s, register 0x43.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum GyroRange {
    Dps125,
    Dps250,
    Dps500,
    Dps1000,
    Dps2000,
}

/// Rate of the samples returned by the driver. The chip samples at four times this rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Rate {
    Hz400,
    Hz200,
    Hz100,
}
