//! When a fault begins: at a moment of the flight, or after a time.

use core::fmt;
use stampfly_types::Duration;

/// A moment of a flight. The vehicle's surroundings say when it has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
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
    /// It sinks, in order to land.
    Landing,
    /// It touches the ground, landing.
    Touch,
}

impl Moment {
    /// Every moment, in the order of a flight.
    pub const ALL: [Self; 7] =
        [Self::Ground, Self::Spool, Self::TakeOff, Self::Hover, Self::Move, Self::Landing, Self::Touch];

    /// Its name in texts.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ground => "ground",
            Self::Spool => "spool",
            Self::TakeOff => "takeoff",
            Self::Hover => "hover",
            Self::Move => "move",
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
