//! What an MPU-6000 is told: ranges, low-pass, rate. How the registers say it is in [`codec`](super::codec).

use stampfly_types::Duration;

/// What the chip is told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Full scale of the accelerometer.
    pub accel_range: AccelRange,
    /// Full scale of the gyroscope.
    pub gyro_range: GyroRange,
    /// The chip's own low-pass.
    pub filter: Filter,
    /// The chip measures at 8 kHz with [`Filter::Hz256`] and at 1 kHz with the others, divided by this and one (SMPLRT_DIV).
    pub divider: u8,
    /// Time between two samples as delivered. The newest of the chip's is taken; those in between are skipped, which the low-pass has to allow:
    /// `start` refuses an interval in which its bandwidth turns more than half a period.
    pub interval: Duration,
}

impl Default for Config {
    /// ±16 g, ±2000 °/s, 256 Hz, 8 kHz in the chip, 4 kHz delivered: what an acrobatic quadrotor uses.
    fn default() -> Self {
        Self {
            accel_range: AccelRange::G16,
            gyro_range: GyroRange::Dps2000,
            filter: Filter::Hz256,
            divider: 0,
            interval: Duration::from_micros(250),
        }
    }
}

/// Full scale of the accelerometer (RM 4.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum AccelRange {
    G2,
    G4,
    G8,
    G16,
}

/// Full scale of the gyroscope, °/s (RM 4.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum GyroRange {
    Dps250,
    Dps500,
    Dps1000,
    Dps2000,
}

/// Bandwidth of the low-pass, by the gyroscope's; the accelerometer's is nearly the same. It delays by about 1, 2, 3, 5, 8, 13 and 19 ms (RM 4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Filter {
    Hz256,
    Hz188,
    Hz98,
    Hz42,
    Hz20,
    Hz10,
    Hz5,
}
