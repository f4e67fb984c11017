//! Where the vehicle should be, moment by moment.
//!
//! [`Axis`] moves one coordinate with bounded speed, acceleration and jerk; [`Path`] moves three of them and the
//! heading; [`Route`] queues way-points; the [`Navigator`] decides where the path goes: take-off, route, sticks,
//! holding, landing.

mod axis;
mod navigator;
mod path;
mod route;

pub use axis::{Axis, Bounds};
pub use navigator::{Navigator, NavigatorConfig, NavigatorInput};
pub use path::{Leg, Path, PathLimits};
pub use route::{Refusal, Refused, Route, WayPoint};
