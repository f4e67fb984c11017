//! What people and programs ask for, on its way from raw input to set-point.
//!
//! [`PilotInput`] and [`GuidedCommand`] come from links, [`ButtonEvent`] from the board's button. Arbitration
//! turns them into one [`CommandSetpoint`]; the navigator turns goals into a jerk-limited [`Setpoint`].

use super::system::{CommandSource, FlightMode};
use crate::{Vec3, message, message_enum, message_flags};

message! {
    /// One authenticated frame of a pilot's transmitter, normalised. Right and up are positive.
    pub struct PilotInput {
        /// Roll stick, −1 to 1, right positive.
        roll: f32,
        /// Pitch stick, −1 to 1, forward positive (nose down, flying forward).
        pitch: f32,
        /// Yaw stick, −1 to 1, clockwise seen from above positive.
        yaw: f32,
        /// Throttle stick, −1 to 1, spring centred: zero holds height in the modes that hold it.
        throttle: f32,
        /// The flight mode the switches select.
        mode: FlightMode,
        /// Arm switch. Arming needs a rising edge seen by the vehicle.
        arm: bool,
        /// Emergency stop: motors off now, whatever the state.
        kill: bool,
    }
}

/// A stick as it may be used: within ±1, and centred when it is no number. Call it before using a stick: a radio, a program or a
/// log may have sent anything.
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
    /// The same frame with sticks that may be used, see [`stick`].
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

    /// Are all sticks numbers? Where one is none, a frame says nothing about what the pilot wants but for its switches: no value
    /// that it could be taken for is safe in every flight mode.
    #[must_use]
    pub fn is_readable(&self) -> bool {
        [self.roll, self.pitch, self.yaw, self.throttle].iter().all(|stick| stick.is_finite())
    }
}

message_enum! {
    /// What a guided command asks for.
    pub enum GuidedKind {
        /// Nothing.
        #[default]
        None = 0,
        /// Allow the motors.
        Arm = 1,
        /// Land if flying, then stop the motors.
        Disarm = 2,
        /// Rise to `position.z` (negative is up) above the present place.
        TakeOff = 3,
        /// Append a way-point to the route.
        WayPoint = 4,
        /// Forget the route and stay here.
        Hold = 5,
        /// Land here.
        Land = 6,
        /// Motors off now.
        Kill = 7,
        /// Turn over once to the left.
        FlipLeft = 8,
        /// Turn over once to the right.
        FlipRight = 9,
        /// Turn over once forward, nose down.
        FlipForward = 10,
        /// Turn over once backward, nose up.
        FlipBack = 11,
        /// Tune the roll rate loop, from a hover; any other command ends it.
        AutotuneRoll = 12,
        /// Tune the pitch rate loop.
        AutotunePitch = 13,
        /// Tune the yaw rate loop.
        AutotuneYaw = 14,
    }
}

message_enum! {
    /// Which way a vehicle turns over.
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
    /// The flip that is asked for, if one is.
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
    /// A command from a program: the ground station, a mission file, a script.
    pub struct GuidedCommand {
        /// What is asked.
        kind: GuidedKind,
        /// Goal in the world frame, relative to the origin.
        position: Vec3 ["m"],
        /// Goal heading.
        yaw: f32 ["rad"],
        /// Highest speed on the way; zero asks for the default.
        speed: f32 ["m/s"],
        /// Time to stay at the goal before going on.
        dwell: f32 ["s"],
    }
}

message_enum! {
    /// What the button did.
    pub enum ButtonGesture {
        /// Nothing.
        #[default]
        None = 0,
        /// Pressed and let go.
        Click = 1,
        /// Two clicks within the double-click time.
        DoubleClick = 2,
        /// Held for three seconds: pair.
        HoldPair = 3,
        /// Held for five seconds: restart.
        HoldReset = 4,
        /// Pressed just now; another gesture follows when it is clear what this press is.
        Press = 5,
    }
}

message! {
    /// What happened on the board's button: every press at once, and what became of it.
    pub struct ButtonEvent {
        /// What happened.
        gesture: ButtonGesture,
        /// How long the button has been down, or was.
        held: f32 ["s"],
    }
}

message! {
    /// The arbitrated command: one authority, sticks normalised, dead band applied.
    pub struct CommandSetpoint {
        /// −1 to 1; meaning depends on the flight mode.
        throttle: f32,
        /// −1 to 1, right positive.
        roll: f32,
        /// −1 to 1, forward positive.
        pitch: f32,
        /// −1 to 1, clockwise positive.
        yaw: f32,
        /// Whose command it is.
        source: CommandSource,
    }
}

message_flags! {
    /// Which parts of a set-point are commanded.
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

    /// Turn over once this way.
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

    /// Which way to turn over, if that is asked for.
    #[must_use]
    pub fn flip(self) -> Option<FlipDirection> {
        Self::FLIPS.iter().find(|(flag, _)| self.contains(*flag)).map(|(_, direction)| *direction)
    }
}

message! {
    /// Where the vehicle should be right now: a point on a jerk-limited path.
    pub struct Setpoint {
        /// World NED.
        position: Vec3 ["m"],
        /// World NED.
        velocity: Vec3 ["m/s"],
        /// World NED.
        acceleration: Vec3 ["m/s^2"],
        /// Heading.
        yaw: f32 ["rad"],
        /// Heading rate.
        yaw_rate: f32 ["rad/s"],
        /// Which of the above are commanded.
        axes: SetpointAxes,
        /// Way-points still ahead, the present one included.
        remaining: u32,
        /// Has the last way-point been reached and its dwell time passed?
        arrived: bool,
    }
}
