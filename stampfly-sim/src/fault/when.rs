//! Begin of a fault: at a moment of the flight, or after a time.

use core::fmt;
use stampfly_types::Duration;

/// A moment of a flight. The vehicle's surroundings report when it has come.
///
/// [`USUAL`](Self::USUAL) moments come in every flight that takes off, flies to a position and
/// lands. The others come with the action of pilot or program that they are named after.
/// [`Vehicle::moments`](crate::vehicle::Vehicle::moments) lists the moments of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// Start of the calibration at rest after power-on.
    Calibration,
    /// On the ground and ready to arm. Arming follows two seconds later, so that a fault can be
    /// detected before.
    Ground,
    /// The motors start.
    Spool,
    /// Climbing, off the ground.
    TakeOff,
    /// One second after take-off.
    Hover,
    /// Flying to another position.
    Move,
    /// Start of a flip.
    Flip,
    /// Change of the flight mode in the air.
    Mode,
    /// Throttle stick at its lowest in the air.
    Chop,
    /// Change of a parameter.
    Parameter,
    /// Descending to land.
    Landing,
    /// Ground contact when landing.
    Touch,
}

impl Moment {
    /// All moments in the order of a flight.
    pub const ALL: [Self; 12] = [
        Self::Calibration,
        Self::Ground,
        Self::Spool,
        Self::TakeOff,
        Self::Hover,
        Self::Move,
        Self::Flip,
        Self::Mode,
        Self::Chop,
        Self::Parameter,
        Self::Landing,
        Self::Touch,
    ];

    /// Moments of every flight that takes off, flies to a position and lands, in order.
    pub const USUAL: [Self; 7] =
        [Self::Ground, Self::Spool, Self::TakeOff, Self::Hover, Self::Move, Self::Landing, Self::Touch];

    /// Name in texts.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Calibration => "calibration",
            Self::Ground => "ground",
            Self::Spool => "spool",
            Self::TakeOff => "takeoff",
            Self::Hover => "hover",
            Self::Move => "move",
            Self::Flip => "flip",
            Self::Mode => "mode",
            Self::Chop => "chop",
            Self::Parameter => "parameter",
            Self::Landing => "landing",
            Self::Touch => "touch",
        }
    }
}

/// Begin of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// At a moment of the flight.
    Moment(Moment),
    /// After this time since power-on.
    After(Duration),
}

impl When {
    /// Parses the name of a moment or a number of seconds.
    pub(super) fn parse(text: &str) -> Option<Self> {
        match Moment::ALL.into_iter().find(|moment| moment.name() == text) {
            Some(moment) => Some(Self::Moment(moment)),
            None => super::seconds(text).map(Self::After),
        }
    }
}

impl fmt::Display for When {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Moment(moment) => f.write_str(moment.name()),
            Self::After(time) => write!(f, "{}", super::shown(*time)),
        }
    }
}
