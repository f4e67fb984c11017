//! What a VL53L3CX and its driver are told: reach, time, rhythm, offset. How the registers say it is in
//! [`codec`](super::codec).

use stampfly_types::Duration;

/// What the chip and the driver are told.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// How far to look.
    pub mode: DistanceMode,
    /// How long to measure, 33 to 500 ms. Twice the time is a third less noise.
    pub budget: Duration,
    /// From one measurement to the next, no less than the budget.
    pub period: Duration,
    /// Added to what the chip says, m: the error of this chip behind this cover.
    pub offset: f32,
    /// Which way to measure.
    pub ranging: Ranging,
}

impl Config {
    /// The default with [`Ranging::Automatic`]. `target`: is something in reach for sure when the driver is first used?
    ///
    /// ```
    /// use stampfly_vl53l3cx::{Config, Ranging};
    /// // It looks at the floor that the vehicle stands on when it is switched on.
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
    /// 4 m, 33 ms, 30 Hz, as it comes from the factory; the light mode.
    fn default() -> Self {
        Self { ranging: Ranging::Light, ..Self::automatic(false) }
    }
}

/// Which way to measure. Both give the same kind of sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Ranging {
    /// The chip computes a distance, as a VL53L1X does: 17 bytes a measurement. Nobody is known to have seen a VL53L3CX do it.
    Light,
    /// The driver computes it from a histogram of photons, as ST's driver does: 151 bytes a measurement, up to 3.2 m whatever the
    /// [`DistanceMode`].
    Histogram,
    /// The light mode, unless its first results cannot be right ([`Implausible`](crate::Implausible)): then the histogram's, unless that
    /// sees nothing either. It is settled by the first 24 measurements, within 3 s of the first; after that nothing changes any more, also not at
    /// a later start.
    Automatic {
        /// Is something in reach for sure when the driver is first used, such as the floor under a vehicle? Then seeing nothing is not
        /// right either.
        target: bool,
    },
}

/// How far the chip looks: a longer light pulse period sees further, but not so well in sunlight.
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
