//! The lights: one of seven patterns, a bit every eighth of a second, the highest first.
//!
//! | pattern | meaning |
//! |---|---|
//! | 10000000 | no transmitter |
//! | 11011010 | the sensors are being calibrated |
//! | 11001000 | disarmed, ACRO |
//! | 11001100 | disarmed, ANGLE |
//! | 10101010 | battery empty |
//! | 11111100 | battery low |
//! | 11111111 | armed |

use crate::messages::{BatteryState, ControlState};
use serde::{Deserialize, Serialize};

const OFFLINE: u8 = 0b1000_0000;
const CALIBRATING: u8 = 0b1101_1010;
const ACRO: u8 = 0b1100_1000;
const ANGLE: u8 = 0b1100_1100;
const EMPTY: u8 = 0b1010_1010;
const LOW: u8 = 0b1111_1100;
const ARMED: u8 = 0b1111_1111;

/// The pattern of a state: the first that fits, from the top.
#[must_use]
pub const fn pattern(state: &ControlState, battery: &BatteryState) -> u8 {
    if !state.online {
        OFFLINE
    } else if state.calibrating {
        CALIBRATING
    } else if !state.armed {
        if state.angle_mode { ANGLE } else { ACRO }
    } else if battery.empty {
        EMPTY
    } else if battery.low {
        LOW
    } else {
        ARMED
    }
}

/// Which bit is shown.
///
/// ```
/// use stampfly_stm32_quad::lamps::Lamps;
/// let mut lamps = Lamps::default();
/// let shown: Vec<bool> = (0..5).map(|_| lamps.step(0b1100_0000)).collect();
/// assert_eq!(shown, [false, true, true, false, false], "dark for the first eighth");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lamps(u8);

impl Default for Lamps {
    /// Behind the last bit: the first tick after power-on is dark.
    fn default() -> Self {
        Self(8)
    }
}

impl Lamps {
    /// Is the light on in this tick? The pattern may change within a second.
    pub fn step(&mut self, pattern: u8) -> bool {
        let is_on = pattern.checked_shl(self.0.into()).is_some_and(|bits| bits & 0x80 != 0);
        self.0 = if self.0 >= 7 { 0 } else { self.0 + 1 };
        is_on
    }
}
