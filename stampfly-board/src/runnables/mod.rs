//! The runnables: one a file, each steps one component on its topics.

mod actuation;
mod button;
mod calibration;
mod command;
mod control;
mod estimation;
mod failsafe;
mod landing;
mod mode;
mod monitor;
mod navigation;
mod notification;
mod telemetry;

pub use actuation::Actuation;
pub use button::Button;
pub use calibration::Calibration;
pub use command::Command;
pub use control::Control;
pub use estimation::Estimation;
pub use failsafe::Failsafe;
pub use landing::Landing;
pub use mode::Mode;
pub use monitor::Monitor;
pub use navigation::Navigation;
pub use notification::Notification;
pub use telemetry::Telemetry;
