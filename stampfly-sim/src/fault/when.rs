//! When a fault begins: at a moment of the flight, or after a time.

use core::fmt;
use stampfly_types::Duration;

/// A moment of a flight. The vehicle's surroundings say when it has come.
///
/// [`USUAL`](Self::USUAL) ones come in every flight that takes off, flies to a place and lands.
/// Another one comes when the pilot or the program does the thing that it is named after.
/// [`Vehicle::moments`](crate::vehicle::Vehicle::moments) lists those of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// The still calibration after power-on begins.
    Calibration,
    /// It stands and may be armed. It is armed two seconds later, so that a fault can be noticed before.
    Ground,
    /// The motors begin to turn.
    Spool,
    /// It climbs and has left the ground.
    TakeOff,
    /// It has flown for a second.
    Hover,
    /// It flies to another place.
    Move,
    /// It begins to turn over.
    Flip,
    /// The flight mode changes in the air.
    Mode,
    /// The throttle stick is pulled to its lowest in the air.
    Chop,
    /// A parameter is changed.
    Parameter,
    /// It sinks, in order to land.
    Landing,
    /// It touches the ground, landing.
    Touch,
}

impl Moment {
    /// Every moment, in the order of a flight.
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

    /// Those of a flight that takes off, flies to a place and lands, in their order.
    pub const USUAL: [Self; 7] =
        [Self::Ground, Self::Spool, Self::TakeOff, Self::Hover, Self::Move, Self::Landing, Self::Touch];

    /// Its name in texts.
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

/// When a fault begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// At a moment of the flight.
    Moment(Moment),
    /// This long after power-on.
    After(Duration),
}

impl When {
    /// Reads a moment's name or a number of seconds.
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
