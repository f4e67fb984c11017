//! Times, heights and stick positions at which the [mode machine](crate::machine) decides.

use stampfly_types::Duration;

/// Configuration of the [`ModeMachine`](crate::ModeMachine).
///
/// ```
/// use stampfly_mode::{ModeConfig, ModeMachine};
/// use stampfly_types::Duration;
/// // A vehicle that flies over water hovers longer before it lands.
/// let config = ModeConfig { hover_without_link: Duration::from_secs(20), ..ModeConfig::default() };
/// let machine = ModeMachine::new(config);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ModeConfig {
    /// Largest tilt on the ground with which the motors may be armed, rad.
    pub arming_tilt: f32,
    /// Largest throttle with which the motors may be armed in a manual mode, share of full throttle.
    pub throttle_rest: f32,
    /// Throttle above which an armed vehicle takes off in a manual mode, share of full throttle.
    pub throttle_take_off: f32,
    /// Time between arming and take-off when the vehicle takes off by itself.
    pub spool: Duration,
    /// An armed vehicle that is not told to take off is disarmed after this long.
    pub armed_timeout: Duration,
    /// How long the vehicle hovers without a link before it lands.
    pub hover_without_link: Duration,
    /// Height above the ground over which a disarmed vehicle has been lifted by somebody, m.
    pub held_height: f32,
    /// Height above the ground below which a vehicle that was lifted stands again, m.
    pub standing_height: f32,
    /// After a press has stopped the motors, gestures are ignored until the button has been released for this long.
    pub button_release: Duration,
}

impl Default for ModeConfig {
    /// Values that are safe for any multirotor. They are chosen, not measured; each line says by what.
    fn default() -> Self {
        Self {
            // 20°. The floor may slope and the vehicle may stand on a cable; it must not lean against a wall.
            arming_tilt: 0.35,
            // A stick at rest is off by a few hundredths: its trim and its noise.
            throttle_rest: 0.05,
            // Twice that, so that a stick that counts as at rest never takes off.
            throttle_take_off: 0.1,
            // Some time constants of a small motor, which are 20 ms each, with a margin for larger ones.
            spool: Duration::from_millis(300),
            // Time to look at the vehicle once more. One that was forgotten must not stay armed.
            armed_timeout: Duration::from_secs(10),
            // A link that is gone for longer seldom comes back by itself, and indoors the vehicle blocks a room.
            hover_without_link: Duration::from_secs(3),
            // The range finder of a standing vehicle reads some centimetres; a hand lifts it higher than that.
            held_height: 0.15,
            standing_height: 0.08,
            // A person in a hurry presses more than once, with less than this between.
            button_release: Duration::from_secs(2),
        }
    }
}
