//! Notification: state and alerts in, lights and sound out.

use crate::config::VehicleConfig;
use crate::topics::NotificationEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::Signaller;

/// Notification: state and alerts in, lights and sound out.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Notification {
    signaller: Signaller,
}

impl Notification {
    /// Lights and sound of a vehicle that has just been switched on.
    #[must_use]
    pub fn new(_: &VehicleConfig) -> Self {
        Self::default()
    }
}

impl Runnable for Notification {
    type Ends<'b> = NotificationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut NotificationEnds<'_>) {
        let alerts = ends.system_alert.get().active;
        let signal = self.signaller.step(activation.now(), ends.flight_status.get(), alerts);
        ends.signal.publish(activation.now(), &signal);
    }
}
