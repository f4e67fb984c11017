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
    /// Throttle with which the vehicle hovers in a manual mode, share of full throttle: the airframe's. A manual mode that is
    /// chosen in the air begins when the stick has passed it.
    pub hover_throttle: f32,
    /// Time between arming and take-off when the vehicle takes off by itself.
    pub spool: Duration,
    /// An armed vehicle that is not told to take off is disarmed after this long.
    pub armed_timeout: Duration,
    /// A take-off that takes longer ends in a landing.
    pub take_off_timeout: Duration,
    /// How long the vehicle hovers without a link before it lands.
    pub hover_without_link: Duration,
    /// A link that was lost counts as back when it has been heard for this long; it is lost once in twice this time at most.
    pub link_back: Duration,
    /// How long a mode that holds height goes on without one before the vehicle lands.
    pub blind: Duration,
    /// How long a vehicle that no pilot flies goes on without knowing its horizontal velocity before it lands.
    pub adrift: Duration,
    /// Below this height above the ground an arm switch turned off stops the motors of a landing vehicle, m.
    pub stop_height: f32,
    /// Longest landing without a known height.
    pub landing_blind: Duration,
    /// Longest landing from a known height: this time, and the height at [`Self::landing_slowest`].
    pub landing_spare: Duration,
    /// Slowest descent of a landing that still comes down, m/s.
    pub landing_slowest: f32,
    /// A pilot's switch counts in its new position when frames have shown it there for this long.
    pub switch_debounce: Duration,
    /// Deflection with which a pilot takes over from a program, share.
    pub take_over: f32,
    /// For how long the sticks have to be deflected so far.
    pub take_over_time: Duration,
    /// A vehicle that hears no new transmitter for this long stops looking.
    pub pairing_timeout: Duration,
    /// After this time in pairing, every frame is a new transmitter's.
    pub pairing_settle: Duration,
    /// A lifted vehicle that does not know its height for this long counts as standing.
    pub height_unknown: Duration,
    /// Height above the ground over which a disarmed vehicle has been lifted by somebody, m.
    pub held_height: f32,
    /// Height above the ground below which a vehicle that was lifted stands again, m.
    pub standing_height: f32,
    /// Least height above the surface to turn over, m. Infinite where nothing is known of the airframe: then it never does.
    pub flip_height: f32,
    /// How far a flip rises at most, m.
    pub flip_room: f32,
    /// Largest height over the place of take-off, m, which a flip keeps as well.
    pub ceiling: f32,
    /// A vehicle that is not upside down after this long does not turn over.
    pub flip_start: Duration,
    /// A flip that takes longer counts as over.
    pub flip_timeout: Duration,
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
            // Multirotors are built to hover with about half of their thrust.
            hover_throttle: 0.5,
            // Some time constants of a small motor, which are 20 ms each, with a margin for larger ones.
            spool: Duration::from_millis(300),
            // Time to look at the vehicle once more. One that was forgotten must not stay armed.
            armed_timeout: Duration::from_secs(10),
            // A take-off to three metres at 0.4 m/s takes 8 s. One that takes twice that is none.
            take_off_timeout: Duration::from_secs(15),
            // A link that is gone for longer seldom comes back by itself, and indoors the vehicle blocks a room.
            hover_without_link: Duration::from_secs(3),
            // A jammed link lets bursts of some tenths of a second through.
            link_back: Duration::from_secs(1),
            // A sensor that restarts is back within half of it. Inertial data alone holds a height for about as long.
            blind: Duration::from_secs(1),
            // A few dark tiles are crossed in less. Level, it drifts by some tenths of a metre a second, faster every second.
            adrift: Duration::from_secs(1),
            // The height above which the StampFly's reference firmware calls a vehicle airborne.
            stop_height: 0.15,
            // At 0.15 m/s, the slowest descent of a landing, 9 m. The navigator's ceiling is a third of that.
            landing_blind: Duration::from_secs(60),
            landing_spare: Duration::from_secs(30),
            landing_slowest: 0.15,
            // Four frames at 50 Hz: more than two bad ones, and not felt by a thumb.
            switch_debounce: Duration::from_millis(60),
            take_over: 0.15,
            // Longer than a bump against the transmitter, shorter than a person's reaction to what the vehicle does.
            take_over_time: Duration::from_millis(100),
            // Time to switch on a transmitter and to put it into pairing.
            pairing_timeout: Duration::from_secs(60),
            // The radio follows within 20 ms.
            pairing_settle: Duration::from_millis(200),
            // The range finder gives thirty samples a second, so all of sixty were unusable.
            height_unknown: Duration::from_secs(2),
            // The range finder of a standing vehicle reads some centimetres; a hand lifts it higher than that.
            held_height: 0.15,
            standing_height: 0.08,
            flip_height: f32::INFINITY,
            flip_room: 0.0,
            ceiling: f32::INFINITY,
            // Climb and half a turn take half a second.
            flip_start: Duration::from_millis(1_200),
            // Three times what a vehicle of a palm's size needs: the sequence has time-outs of its own, this is for one that is stuck.
            flip_timeout: Duration::from_secs(5),
            // A person in a hurry presses more than once, with less than this between.
            button_release: Duration::from_secs(2),
        }
    }
}
