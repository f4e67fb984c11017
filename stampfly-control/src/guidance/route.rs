//! The way-points ahead.
//!
//! A short queue with a rule for overflow: a way-point that does not fit is given back and counted, never dropped
//! silently. Programs with longer missions feed it as it empties ([`Setpoint::remaining`] tells them).
//!
//! [`Setpoint::remaining`]: stampfly_types::messages::Setpoint::remaining

use heapless::Deque;
use stampfly_types::Vec3;
use stampfly_types::messages::GuidedCommand;

/// A place to go to, and for how long to stay.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WayPoint {
    /// World frame, relative to the origin, m.
    pub position: Vec3,
    /// Heading, rad.
    pub yaw: f32,
    /// Highest speed on the way, m/s.
    pub speed: f32,
    /// Time to stay, s.
    pub dwell: f32,
}

/// Why a command was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// The route is full.
    Full,
    /// A number of the command is none.
    NotFinite,
}

/// A command that was refused, with the reason.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refused {
    /// The command, given back.
    pub command: GuidedCommand,
    /// Why.
    pub reason: Refusal,
}

impl core::fmt::Display for Refused {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let reason = match self.reason {
            Refusal::Full => "the route is full",
            Refusal::NotFinite => "not a finite number",
        };
        write!(f, "{} refused: {reason}", self.command.kind.name())
    }
}

impl core::error::Error for Refused {}

/// The queue of way-points.
///
/// ```
/// use stampfly_control::guidance::{Route, WayPoint};
/// use stampfly_types::Vec3;
/// let mut route = Route::default();
/// let point = WayPoint { position: Vec3::zeros(), yaw: 0.0, speed: 0.5, dwell: 0.0 };
/// for _ in 0..Route::CAPACITY {
///     assert_eq!(route.append(point), Ok(()));
/// }
/// assert_eq!(route.append(point), Err(point), "full: given back");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Route {
    ahead: Deque<WayPoint, { Route::CAPACITY }>,
}

impl Route {
    /// How many way-points fit.
    pub const CAPACITY: usize = 16;

    /// Appends a way-point.
    ///
    /// # Errors
    /// Gives the way-point back when the route is full.
    pub fn append(&mut self, way_point: WayPoint) -> Result<(), WayPoint> {
        self.ahead.push_back(way_point)
    }

    /// The way-point being flown to.
    #[must_use]
    pub fn first(&self) -> Option<&WayPoint> {
        self.ahead.front()
    }

    /// The way-point being flown to is done.
    pub fn advance(&mut self) {
        let _ = self.ahead.pop_front();
    }

    /// Forgets all way-points.
    pub fn clear(&mut self) {
        self.ahead.clear();
    }

    /// How many way-points are ahead, the present one included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ahead.len()
    }

    /// Is there none?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ahead.is_empty()
    }
}
