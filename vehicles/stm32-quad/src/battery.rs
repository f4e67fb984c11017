//! Battery: counts to a voltage that is filtered, because motors pull it down for moments, and to two levels with hysteresis (Schmitt triggers).
//!
//! The original's filter begins at 0 V, so a full battery is empty for the first two seconds. Here it begins with the first sample.

use crate::messages::BatteryState;
use crate::parameters::BatteryParameters;
use serde::{Deserialize, Serialize};
use stampfly_control::filter::LowPass;

/// Share of the difference that is taken, eight times a second.
const SHARE: f32 = 0.1;
/// A flag goes when the battery is this far above its level, V, however many cells there are.
const HYSTERESIS: f32 = 0.1;
/// Of the converter.
const COUNTS: f32 = 4_096.0;

/// The battery as it was last seen.
///
/// ```
/// use stampfly_stm32_quad::{Parameters, battery::Battery};
/// let parameters = Parameters::default().battery;
/// let mut battery = Battery::default();
/// // 4.2 V behind the divider.
/// let state = battery.step(2_177, &parameters);
/// assert!((state.voltage - 4.2).abs() < 2e-3 && !state.low && !state.empty);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Battery {
    voltage: Option<LowPass>,
    low: bool,
    empty: bool,
}

impl Battery {
    /// A battery whose filter begins at this voltage.
    #[must_use]
    pub fn at(voltage: f32) -> Self {
        let mut filter = LowPass::with_alpha(SHARE);
        filter.reset(voltage);
        Self { voltage: Some(filter), low: false, empty: false }
    }

    /// Takes what the converter counts.
    pub fn step(&mut self, counts: u32, parameters: &BatteryParameters) -> BatteryState {
        let counts = counts.min(4_095) as f32;
        self.measure(counts * parameters.scale * parameters.reference / COUNTS, parameters)
    }

    /// Takes a voltage.
    pub fn measure(&mut self, voltage: f32, parameters: &BatteryParameters) -> BatteryState {
        let filter =
            self.voltage.get_or_insert_with(|| Self::at(voltage).voltage.unwrap_or(LowPass::with_alpha(SHARE)));
        let voltage = filter.step(voltage);
        let trigger = |flag: bool, level: f32| {
            let level = level * parameters.cells;
            if flag { voltage <= level + HYSTERESIS } else { voltage <= level }
        };
        self.low = trigger(self.low, parameters.warning);
        self.empty = trigger(self.empty, parameters.critical);
        BatteryState { voltage, low: self.low, empty: self.empty }
    }
}
