//! Guidance and control of a fixed-wing aircraft, from a list of way-points to deflections and throttle.
//!
//! ```text
//!  Follower ─► Track ┐          ┌─► Steering ─► bank  ┐
//!                    ├─► Demand ┤                     ├─► WingLoops ─► SurfaceDemand ─► surfaces
//!   altitude, speed ─┘          └─► Energy ───► pitch ┘
//!                                      └──────► throttle
//! ```
//!
//! | part | what it does |
//! |---|---|
//! | [`WayPoints`], [`Follower`] | the list, which leg of it is flown, and the arc from one to the next |
//! | [`WayPointEdit`] | changes of the list in flight |
//! | [`runway`], [`Approach`] | places on Earth, the strip, and the way down to it |
//! | [`Track`] | the course that leads to a line or an orbit and along it, and the bank that turns there |
//! | [`Demand`], [`Autopilot`] | what is wanted, as a message, and all that follows from it |
//! | [`Energy`] | altitude and airspeed together: throttle makes energy, pitch divides it |
//! | [`WingLoops`] | bank and pitch to roll, pitch and yaw |
//!
//! Each is a plain struct that is told the time and can be used alone. Airspeeds are true unless they are said to be indicated; courses are directions over the
//! ground and headings directions of the nose, radians east of north. Sources: Beard and McLain, "Small Unmanned Aircraft" (Princeton, 2012), chapters 6, 10 and 11; for
//! the energy loops Lambregts, "Vertical flight path and speed control autopilot design using total energy principles" (AIAA 83-2239, 1983). Not for a vehicle that can stand in the air.

mod approach;
mod autopilot;
mod demand;
mod edit;
mod energy;
mod loops;
pub mod runway;
mod track;
mod way_points;

pub use approach::{Approach, ApproachConfig};
pub use autopilot::{Autopilot, AutopilotConfig, Flown};
pub use demand::{Demand, Lateral, Thrust, Vertical};
pub use edit::{EditKind, EditRefusal, WayPointEdit};
pub use energy::{Energy, EnergyConfig, EnergyDemand, EnergyInput, EnergyOutput};
pub use loops::{Wing, WingConfig, WingDemand, WingLoops};
pub use track::{Steering, Track, TrackConfig};
pub use way_points::{EditError, Followed, Follower, WayPoint, WayPoints};
