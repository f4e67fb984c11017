//! Configuration of an MPU-6000: ranges, low-pass filter, rate. The register codes are in
//! [`codec`](super::codec).

use stampfly_types::Duration;

/// Configuration of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Full scale of the accelerometer.
    pub accel_range: AccelRange,
    /// Full scale of the gyroscope.
    pub gyro_range: GyroRange,
    /// Low-pass filter of the chip.
    pub filter: Filter,
    /// Divider of the chip's sample rate, less one (SMPLRT_DIV). The undivided rate is 8 kHz with
    /// [`Filter::Hz256`] and 1 kHz with all others.
    pub divider: u8,
    /// Time between two samples returned by the driver. It returns the chip's newest sample and
    /// skips those before, which requires a low-pass filter: `start` refuses an interval longer
    /// than half a period of the filter's bandwidth.
    pub interval: Duration,
}

impl Default for Config {
    /// ±16 g, ±2000 °/s, 256 Hz, 8 kHz in the chip, 4 kHz returned: the rates of an acrobatic
    /// quadrotor.
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

/// Bandwidth of the low-pass filter for the gyroscope; the accelerometer's is nearly the same. The
/// delays are about 1, 2, 3, 5, 8, 13 and 19 ms (RM 4.3).
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
