//! Configuration of a BMM150: repetitions and rate. The register codes are in
//! [`codec`](super::codec).

/// Configuration of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Number of repetitions per sample.
    pub preset: Preset,
    /// Sample rate. A rate that is too high for the preset is
    /// [`ChipError::InvalidConfiguration`](crate::ChipError::InvalidConfiguration).
    pub rate: Rate,
}

impl Default for Config {
    /// Nine repetitions of x and y, fifteen of z, 25 Hz.
    fn default() -> Self {
        Self { preset: Preset::Regular, rate: Rate::Hz25 }
    }
}

/// Number of repetitions of each axis in a sample (table "Recommended presets").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Preset {
    LowPower,
    Regular,
    Enhanced,
    HighAccuracy,
}

/// Sample rate, Hz.
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
