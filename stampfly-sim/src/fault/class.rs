//! Outcome classes of a flight with faults.

use core::fmt;

/// Outcome of a flight, from best to worst.
///
/// The first five may be acceptable, depending on the fault; the other three never are. The vehicle
/// defines the limits between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// The vehicle refused to fly.
    Refused,
    /// The mission was flown without visible effect.
    Transparent,
    /// The mission was flown to its end with an alert, another mode or larger errors.
    Degraded,
    /// The vehicle landed before the end of the mission.
    Landed,
    /// The motors were stopped immediately.
    Cut,
    /// The vehicle hit the ground.
    Crashed,
    /// The vehicle left its intended area.
    FlownAway,
    /// The motors were still armed at the end.
    KeptOn,
}

impl Class {
    /// Every class, best first.
    pub const ALL: [Self; 8] = [
        Self::Refused,
        Self::Transparent,
        Self::Degraded,
        Self::Landed,
        Self::Cut,
        Self::Crashed,
        Self::FlownAway,
        Self::KeptOn,
    ];

    /// Its name in tables and scripts.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Refused => "refused",
            Self::Transparent => "transparent",
            Self::Degraded => "degraded",
            Self::Landed => "landed",
            Self::Cut => "cut",
            Self::Crashed => "crashed",
            Self::FlownAway => "flown-away",
            Self::KeptOn => "kept-on",
        }
    }

    /// True for classes that can be acceptable.
    #[must_use]
    pub const fn may_be_acceptable(self) -> bool {
        !matches!(self, Self::Crashed | Self::FlownAway | Self::KeptOn)
    }

    /// True if this class is acceptable and no worse than `worst`.
    #[must_use]
    pub fn is_within(self, worst: Self) -> bool {
        self.may_be_acceptable() && self <= worst
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
