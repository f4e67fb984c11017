//! Configuration of a BMP280 and its driver: oversampling, filter, interval. The register codes are
//! in [`codec`](super::codec).

use stampfly_types::Duration;

/// Configuration of the chip and the driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Number of pressure conversions per sample.
    pub pressure: Oversampling,
    /// Number of temperature conversions per sample.
    pub temperature: Oversampling,
    /// Low-pass filter of the chip, over samples.
    pub filter: Filter,
    /// Time between two samples. The driver extends it to the duration of a conversion if
    /// necessary.
    pub interval: Duration,
}

impl Default for Config {
    /// Four conversions of pressure, two of temperature, filter coefficient 4, 25 Hz.
    fn default() -> Self {
        Self {
            pressure: Oversampling::X4,
            temperature: Oversampling::X2,
            filter: Filter::C4,
            interval: Duration::from_millis(40),
        }
    }
}

/// Number of conversions averaged into one, §3.3.1 and §3.3.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Oversampling {
    X1,
    X2,
    X4,
    X8,
    X16,
}

/// Coefficient of the chip's low-pass filter, §3.3.3. After this number of samples the output has
/// reached about three quarters of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Filter {
    Off,
    C2,
    C4,
    C8,
    C16,
}
