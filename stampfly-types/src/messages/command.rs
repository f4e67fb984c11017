//! Commands of pilots and programs, from raw input to set-point.
//!
//! [`PilotInput`] and [`GuidedCommand`] come from links, [`ButtonEvent`] from the board's button.
//! Arbitration turns them into one [`CommandSetpoint`]; the navigator turns goals into a
//! jerk-limited [`Setpoint`].

use super::system::{CommandSource, FlightMode};
use crate::{Vec3, message, message_enum, message_flags};

message! {
    /// One authenticated frame of a pilot's transmitter, normalised.
    pub struct PilotInput {
        /// Roll stick, −1 to 1, right positive.
        roll: f32,
        /// Pitch stick, −1 to 1, forward positive (nose down, flying forward).
        pitch: f32,
        /// Yaw stick, −1 to 1, clockwise seen from above positive.
        yaw: f32,
        /// Throttle stick, −1 to 1, up positive, spring centred: zero holds height in the modes
        /// that hold it.
        throttle: f32,
        /// The flight mode the switches select.
        mode: FlightMode,
        /// Arm switch. Arming needs a rising edge that the vehicle has seen.
        arm: bool,
        /// Emergency stop: motors off now, in every state.
        kill: bool,
    }
}

/// A stick deflection limited to ±1; zero when it is not finite. Call it before using a stick,
/// because a radio, a program or a log may contain any value.
///
/// ```
/// use stampfly_types::messages::stick;
/// assert_eq!([0.3, -1.5, f32::NAN].map(stick), [0.3, -1.0, 0.0]);
/// ```
#[must_use]
pub fn stick(deflection: f32) -> f32 {
    if deflection.is_finite() { deflection.clamp(-1.0, 1.0) } else { 0.0 }
}

impl PilotInput {
    /// The same frame with every stick passed through [`stick`].
    ///
    /// ```
    /// use stampfly_types::messages::PilotInput;
    /// let frame = PilotInput { roll: f32::NAN, throttle: 1.5, arm: true, ..Default::default() };
    /// assert_eq!(frame.cleaned(), PilotInput { throttle: 1.0, arm: true, ..Default::default() });
    /// ```
    #[must_use]
    pub fn cleaned(&self) -> Self {
        Self {
            roll: stick(self.roll),
            pitch: stick(self.pitch),
            yaw: stick(self.yaw),
            throttle: stick(self.throttle),
            ..*self
        }
    }

    /// Whether all sticks are finite. If one is not, only the switches of the frame are usable: no
    /// substitute for the stick is safe in every flight mode.
    #[must_use]
    pub fn is_readable(&self) -> bool {
        [self.roll, self.pitch, self.yaw, self.throttle].iter().all(|stick| stick.is_finite())
    }
}

message_enum! {
    /// Kind of a guided command.
    pub enum GuidedKind {
        /// Nothing.
        #[default]
        None = 0,
        /// Allow the motors to turn.
        Arm = 1,
        /// Land if flying, then stop the motors.
        Disarm = 2,
        /// Climb to `position.z` (negative is up) above the present position.
        TakeOff = 3,
        /// Append a way-point to the route.
        WayPoint = 4,
        /// Delete the route and hold the present position.
        Hold = 5,
        /// Land at the present position.
        Land = 6,
        /// Motors off now.
        Kill = 7,
        /// Flip once to the left.
        FlipLeft = 8,
        /// Flip once to the right.
        FlipRight = 9,
        /// Flip once forward, nose down.
        FlipForward = 10,
        /// Flip once backward, nose up.
        FlipBack = 11,
        /// Tune the roll rate loop, from a hover. Any other command ends the tuning.
        AutotuneRoll = 12,
        /// Tune the pitch rate loop, as above.
        AutotunePitch = 13,
        /// Tune the yaw rate loop, as above.
        AutotuneYaw = 14,
    }
}

message_enum! {
    /// Direction of a flip.
    pub enum FlipDirection {
        /// Left wing down: negative roll.
        #[default]
        Left = 0,
        /// Right wing down: positive roll.
        Right = 1,
        /// Nose down: negative pitch.
        Forward = 2,
        /// Nose up: positive pitch.
        Back = 3,
    }
}

impl GuidedKind {
    /// Direction of the flip, when the command is a flip.
    ///
    /// ```
    /// use stampfly_types::messages::{FlipDirection, GuidedKind};
    /// assert_eq!(GuidedKind::FlipBack.flip(), Some(FlipDirection::Back));
    /// assert_eq!(GuidedKind::Hold.flip(), None);
    /// ```
    #[must_use]
    pub const fn flip(self) -> Option<FlipDirection> {
        match self {
            Self::FlipLeft => Some(FlipDirection::Left),
            Self::FlipRight => Some(FlipDirection::Right),
            Self::FlipForward => Some(FlipDirection::Forward),
            Self::FlipBack => Some(FlipDirection::Back),
            Self::None
            | Self::Arm
            | Self::Disarm
            | Self::TakeOff
            | Self::WayPoint
            | Self::Hold
            | Self::Land
            | Self::Kill
            | Self::AutotuneRoll
            | Self::AutotunePitch
            | Self::AutotuneYaw => None,
        }
    }
}

message! {
    /// A command of a program: a ground station, a mission file, a script.
    pub struct GuidedCommand {
        /// Kind of the command.
        kind: GuidedKind,
        /// Goal in the world frame, relative to the origin.
        position: Vec3 ["m"],
        /// Goal heading.
        yaw: f32 ["rad"],
        /// Highest speed on the way; zero selects the default.
        speed: f32 ["m/s"],
        /// Time to stay at the goal before the next way-point.
        dwell: f32 ["s"],
    }
}

message_enum! {
    /// Gesture on the button.
    pub enum ButtonGesture {
        /// Nothing.
        #[default]
        None = 0,
        /// Pressed and released.
        Click = 1,
        /// Two clicks within the double-click time.
        DoubleClick = 2,
        /// Held for three seconds: pair.
        HoldPair = 3,
        /// Held for five seconds: restart.
        HoldReset = 4,
        /// Pressed just now. A further event follows once the gesture is known.
        Press = 5,
    }
}

message! {
    /// Event of the board's button: one at every press, and one for the gesture it became.
    pub struct ButtonEvent {
        /// Kind of the event.
        gesture: ButtonGesture,
        /// Time for which the button is, or was, pressed.
        held: f32 ["s"],
    }
}

message! {
    /// The arbitrated command: from one source, with normalised sticks and the dead band applied.
    pub struct CommandSetpoint {
        /// −1 to 1. The flight mode defines its meaning.
        throttle: f32,
        /// −1 to 1, right positive.
        roll: f32,
        /// −1 to 1, forward positive.
        pitch: f32,
        /// −1 to 1, clockwise positive.
        yaw: f32,
        /// Source of the command.
        source: CommandSource,
    }
}

message_flags! {
    /// The commanded parts of a set-point.
    pub struct SetpointAxes {
        /// North and east position, with velocity and acceleration as feed-forward.
        POSITION_XY = 0,
        /// Down position, with velocity and acceleration as feed-forward.
        POSITION_Z = 1,
        /// North and east velocity only.
        VELOCITY_XY = 2,
        /// Down velocity only.
        VELOCITY_Z = 3,
        /// Heading.
        YAW = 4,
        /// Heading rate only.
        YAW_RATE = 5,
        /// Turn over once to the left, while in [`FlightPhase::Flip`](super::FlightPhase::Flip).
        FLIP_LEFT = 6,
        /// Turn over once to the right.
        FLIP_RIGHT = 7,
        /// Turn over once forward.
        FLIP_FORWARD = 8,
        /// Turn over once backward.
        FLIP_BACK = 9,
        /// Tune the roll rate loop, while in [`FlightPhase::Flying`](super::FlightPhase::Flying).
        AUTOTUNE_ROLL = 10,
        /// Tune the pitch rate loop.
        AUTOTUNE_PITCH = 11,
        /// Tune the yaw rate loop.
        AUTOTUNE_YAW = 12,
    }
}

impl SetpointAxes {
    const FLIPS: [(Self, FlipDirection); 4] = [
        (Self::FLIP_LEFT, FlipDirection::Left),
        (Self::FLIP_RIGHT, FlipDirection::Right),
        (Self::FLIP_FORWARD, FlipDirection::Forward),
        (Self::FLIP_BACK, FlipDirection::Back),
    ];

    /// The set-point of a flip in this direction.
    ///
    /// ```
    /// use stampfly_types::messages::{FlipDirection, SetpointAxes};
    /// assert_eq!(SetpointAxes::turn_over(FlipDirection::Back).flip(), Some(FlipDirection::Back));
    /// assert_eq!(SetpointAxes::YAW.flip(), None);
    /// ```
    #[must_use]
    pub const fn turn_over(direction: FlipDirection) -> Self {
        match direction {
            FlipDirection::Left => Self::FLIP_LEFT,
            FlipDirection::Right => Self::FLIP_RIGHT,
            FlipDirection::Forward => Self::FLIP_FORWARD,
            FlipDirection::Back => Self::FLIP_BACK,
        }
    }

    /// Direction of the flip, when one is commanded.
    #[must_use]
    pub fn flip(self) -> Option<FlipDirection> {
        Self::FLIPS.iter().find(|(flag, _)| self.contains(*flag)).map(|(_, direction)| *direction)
    }
}

message! {
    /// Present target of the vehicle: a point on a jerk-limited path.
    pub struct Setpoint {
        /// Position, world NED.
        position: Vec3 ["m"],
        /// Velocity, world NED.
        velocity: Vec3 ["m/s"],
        /// Acceleration, world NED.
        acceleration: Vec3 ["m/s^2"],
        /// Heading.
        yaw: f32 ["rad"],
        /// Heading rate.
        yaw_rate: f32 ["rad/s"],
        /// The quantities above that are commanded.
        axes: SetpointAxes,
        /// Number of way-points ahead, the present one included.
        remaining: u32,
        /// Whether the last way-point has been reached and its dwell time has passed.
        arrived: bool,
    }
}
