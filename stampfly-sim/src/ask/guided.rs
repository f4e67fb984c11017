//! Guided commands and sticks in requests, and their conversion to messages.

use super::AskError;
use serde::{Deserialize, Serialize};
use stampfly_types::Vec3;
use stampfly_types::messages::{FlightMode, GuidedCommand, GuidedKind, PilotInput};

/// A guided command.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Guided {
    /// Arm the motors.
    Arm {},
    /// Land if flying, then stop the motors.
    Disarm {},
    /// Take off.
    TakeOff {
        /// Height above the present position, m, from 0.05 to [`HIGHEST`].
        height: f32,
    },
    /// Discard the route and fly to a position.
    GoTo {
        /// North of the origin, m.
        north: f32,
        /// East of the origin, m.
        east: f32,
        /// Above the origin, m.
        up: f32,
        /// Heading at the target, rad from north, clockwise.
        yaw: f32,
        /// Largest speed, m/s; 0 (the default) selects the vehicle's.
        #[serde(default)]
        speed: f32,
        /// Time to stay at the target, s.
        #[serde(default)]
        dwell: f32,
    },
    /// Discard the route and hold the present position.
    Hold {},
    /// Land at the present position.
    Land {},
    /// Stop the motors immediately.
    Kill {},
    /// Flip once.
    Flip {
        /// Direction.
        direction: Direction,
    },
    /// Tune one rate loop in hover; any other command ends it.
    Autotune {
        /// Axis.
        axis: Axis,
    },
}

/// Largest take-off height, m.
pub const HIGHEST: f32 = 100.0;
/// Largest coordinate of a waypoint along north and east, m.
pub const FARTHEST: f32 = 1000.0;

/// Direction of a flip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Left wing down.
    Left,
    /// Right wing down.
    Right,
    /// Nose down.
    Forward,
    /// Nose up.
    Back,
}

/// An axis of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// About the forward axis.
    Roll,
    /// About the right axis.
    Pitch,
    /// About the down axis.
    Yaw,
}

/// Sticks and switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sticks {
    /// −1 to 1, right positive.
    pub roll: f32,
    /// −1 to 1, forward positive.
    pub pitch: f32,
    /// −1 to 1, clockwise seen from above positive.
    pub yaw: f32,
    /// −1 to 1, up positive, spring centred.
    pub throttle: f32,
    /// The flight mode.
    pub mode: Mode,
    /// Arm switch.
    pub arm: bool,
    /// Motors off now.
    pub kill: bool,
}

/// A flight mode, as sticks name it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Sticks command rates.
    Acro,
    /// Sticks command angles.
    Stabilize,
    /// Throttle commands climb rate.
    AltHold,
    /// Sticks command velocities.
    #[default]
    PosHold,
}

impl From<Mode> for FlightMode {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::Acro => Self::Acro,
            Mode::Stabilize => Self::Stabilize,
            Mode::AltHold => Self::AltHold,
            Mode::PosHold => Self::PosHold,
        }
    }
}

impl From<Sticks> for PilotInput {
    fn from(sticks: Sticks) -> Self {
        let Sticks { roll, pitch, yaw, throttle, mode, arm, kill } = sticks;
        Self { roll, pitch, yaw, throttle, mode: mode.into(), arm, kill }
    }
}

/// ```
/// use stampfly_sim::ask::Guided;
/// use stampfly_types::messages::{GuidedCommand, GuidedKind};
///
/// let command = GuidedCommand::from(Guided::TakeOff { height: 0.5 });
/// assert_eq!((command.kind, command.position.z), (GuidedKind::TakeOff, -0.5));
/// ```
impl From<Guided> for GuidedCommand {
    fn from(guided: Guided) -> Self {
        let plain = |kind| Self { kind, ..Self::default() };
        match guided {
            Guided::Arm {} => plain(GuidedKind::Arm),
            Guided::Disarm {} => plain(GuidedKind::Disarm),
            Guided::TakeOff { height } => Self { position: Vec3::new(0.0, 0.0, -height), ..plain(GuidedKind::TakeOff) },
            Guided::GoTo { north, east, up, yaw, speed, dwell } => {
                Self { kind: GuidedKind::WayPoint, position: Vec3::new(north, east, -up), yaw, speed, dwell }
            }
            Guided::Hold {} => plain(GuidedKind::Hold),
            Guided::Land {} => plain(GuidedKind::Land),
            Guided::Kill {} => plain(GuidedKind::Kill),
            Guided::Flip { direction: Direction::Left } => plain(GuidedKind::FlipLeft),
            Guided::Flip { direction: Direction::Right } => plain(GuidedKind::FlipRight),
            Guided::Flip { direction: Direction::Forward } => plain(GuidedKind::FlipForward),
            Guided::Flip { direction: Direction::Back } => plain(GuidedKind::FlipBack),
            Guided::Autotune { axis: Axis::Roll } => plain(GuidedKind::AutotuneRoll),
            Guided::Autotune { axis: Axis::Pitch } => plain(GuidedKind::AutotunePitch),
            Guided::Autotune { axis: Axis::Yaw } => plain(GuidedKind::AutotuneYaw),
        }
    }
}

impl Guided {
    pub(super) fn check(
        &self,
        within: &dyn Fn(&'static str, f32, f32, f32) -> Result<(), AskError>,
    ) -> Result<(), AskError> {
        match *self {
            Self::TakeOff { height } => within("height", height, 0.05, HIGHEST),
            Self::GoTo { north, east, up, yaw, speed, dwell } => {
                within("north", north, -FARTHEST, FARTHEST)?;
                within("east", east, -FARTHEST, FARTHEST)?;
                within("up", up, -HIGHEST, HIGHEST)?;
                within("yaw", yaw, -7.0, 7.0)?;
                within("speed", speed, 0.0, 100.0)?;
                within("dwell", dwell, 0.0, 3600.0)
            }
            _ => Ok(()),
        }
    }
}
