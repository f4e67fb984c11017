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
}

impl Default for Config {
    /// 4 m, 33 ms, 30 Hz, as it comes from the factory.
    fn default() -> Self {
        Self {
            mode: DistanceMode::Long,
            budget: Duration::from_micros(33_000),
            period: Duration::from_micros(33_333),
            offset: 0.0,
        }
    }
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
