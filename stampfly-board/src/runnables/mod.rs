//! The runnables: one a file, each reads its topics, steps one component and publishes.

mod actuation;
mod button;
mod calibration;
mod command;
mod control;
mod estimation;
mod failsafe;
mod landing;
mod mode;
mod navigation;
mod notification;
mod telemetry;

pub use actuation::{Actuation, ActuationPorts};
pub use button::{ButtonPorts, ButtonReader};
pub use calibration::{Calibration, CalibrationPorts};
pub use command::{Command, CommandPorts};
pub use control::{Control, ControlPorts};
pub use estimation::{Estimation, EstimationPorts};
pub use failsafe::{FailsafeMonitor, FailsafePorts};
pub use landing::{LandingManager, LandingPorts};
pub use mode::{ModeManager, ModePorts};
pub use navigation::{Navigation, NavigationPorts};
pub use notification::{Notification, NotificationPorts};
pub use telemetry::{Telemetry, TelemetryPorts};
