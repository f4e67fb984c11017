//! What a BMP280 and its driver are told: averages, low-pass, interval. How the registers say it is in
//! [`codec`](super::codec).

use stampfly_types::Duration;

/// What the driver and the chip are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Pressure conversions in a sample.
    pub pressure: Oversampling,
    /// Temperature conversions in a sample.
    pub temperature: Oversampling,
    /// Low-pass over samples.
    pub filter: Filter,
    /// Time between two samples; never less than a conversion takes.
    pub interval: Duration,
}

impl Default for Config {
    /// Four pressure conversions, two of temperature, a light filter, 25 Hz.
    fn default() -> Self {
        Self {
            pressure: Oversampling::X4,
            temperature: Oversampling::X2,
            filter: Filter::C4,
            interval: Duration::from_millis(40),
        }
    }
}

/// Conversions averaged into one, §3.3.1 and §3.3.2.
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

/// Coefficient of the chip's low-pass, §3.3.3: a step has arrived by three quarters after about as many samples.
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
