//! How a flight with a fault may end.

use core::fmt;

/// The end of a flight, from best to worst.
///
/// The first five are acceptable where the fault's row says so; the other three never are. What separates them in
/// metres and seconds is the vehicle's business.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// The vehicle was not allowed to fly.
    Refused,
    /// The mission was flown as if nothing had happened.
    Transparent,
    /// The mission was flown to its end, with an alert, another mode or a larger error.
    Degraded,
    /// The vehicle landed before the mission was over.
    Landed,
    /// The motors were stopped at once.
    Cut,
    /// The vehicle hit the ground, or fell on it.
    Crashed,
    /// It left the place where it was to be.
    FlownAway,
    /// The motors were still on at the end.
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

    /// Can such an end be acceptable at all?
    #[must_use]
    pub const fn may_be_acceptable(self) -> bool {
        !matches!(self, Self::Crashed | Self::FlownAway | Self::KeptOn)
    }

    /// Is this end no worse than the worst acceptable one?
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
