//! What a BMM150 is told: repetitions and rate. How the registers say it is in [`codec`](super::codec).

/// What the chip is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Repetitions in a sample.
    pub preset: Preset,
    /// Samples per second. What the preset cannot do is
    /// [`ChipError::InvalidConfiguration`](crate::ChipError::InvalidConfiguration).
    pub rate: Rate,
}

impl Default for Config {
    /// Nine repetitions of x and y, fifteen of z, 25 Hz.
    fn default() -> Self {
        Self { preset: Preset::Regular, rate: Rate::Hz25 }
    }
}

/// How often the axes are measured for one sample (table "Recommended presets").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Preset {
    LowPower,
    Regular,
    Enhanced,
    HighAccuracy,
}

/// Samples per second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Rate {
    Hz2,
    Hz6,
    Hz8,
    Hz10,
    Hz15,
    Hz20,
    Hz25,
    Hz30,
}
