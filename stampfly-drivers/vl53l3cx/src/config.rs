//! Configuration of a VL53L3CX and its driver: range, timing, offset. The register codes are in
//! [`codec`](super::codec).

use stampfly_types::Duration;

/// Configuration of the chip and the driver.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Range of the chip.
    pub mode: DistanceMode,
    /// Duration of a measurement, 33 to 500 ms. Doubling it reduces the noise by about a third.
    pub budget: Duration,
    /// Time between the starts of two measurements, at least the budget.
    pub period: Duration,
    /// Correction added to the chip's distance, m: the error of this chip behind its cover.
    pub offset: f32,
    /// Ranging mode.
    pub ranging: Ranging,
}

impl Config {
    /// The default with [`Ranging::Automatic`]. Set `target` if a target is certain to be in range
    /// when the driver is first used.
    ///
    /// ```
    /// use stampfly_vl53l3cx::{Config, Ranging};
    ///     // The sensor faces the floor on which the vehicle stands at power-on.
    /// let config = Config::automatic(true);
    /// assert_eq!(config, Config { ranging: Ranging::Automatic { target: true }, ..Config::default() });
    /// ```
    #[must_use]
    pub const fn automatic(target: bool) -> Self {
        Self {
            mode: DistanceMode::Long,
            budget: Duration::from_micros(33_000),
            period: Duration::from_micros(33_333),
            offset: 0.0,
            ranging: Ranging::Automatic { target },
        }
    }
}

impl Default for Config {
    /// 4 m, 33 ms, 30 Hz, the factory's calibration, the light mode.
    fn default() -> Self {
        Self { ranging: Ranging::Light, ..Self::automatic(false) }
    }
}

/// Ranging mode. All modes yield the same kind of sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Ranging {
    /// The chip computes the distance, like a VL53L1X: 17 bytes per measurement. No public report
    /// of a VL53L3CX in this mode is known.
    Light,
    /// The driver computes the distance from a photon histogram, like ST's driver: 151 bytes per
    /// measurement, up to 3.2 m in every [`DistanceMode`].
    Histogram,
    /// The light mode, unless its first results are implausible
    /// ([`Implausible`](crate::Implausible)). The driver then changes to histograms, and back if
    /// these find no target either. The mode is settled by the first 24 measurements, within 3 s of
    /// the first one, and never changes afterwards, even at a later start.
    Automatic {
        /// A target is certain to be in range when the driver is first used, such as the floor
        /// under a vehicle. Measurements without a target are then implausible, too.
        target: bool,
    },
}

/// Range of the chip: longer laser periods extend the range but are more sensitive to sunlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DistanceMode {
    /// Up to 1.3 m.
    Short,
    /// Up to 3 m.
    Medium,
    /// Up to 4 m.
    Long,
}
