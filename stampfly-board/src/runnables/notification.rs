//! Notification: state and alerts in, lights and sound out.

use crate::wiring;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::Signaller;
use stampfly_types::messages::*;

/// Notification: state and alerts in, lights and sound out.
pub struct Notification<'b> {
    ports: NotificationPorts<'b>,
    signaller: Signaller,
    mode: SystemMode,
    alerts: Alerts,
}

/// The ends it owns.
pub struct NotificationPorts<'b> {
    /// State and mode.
    pub mode: wiring::system_mode::Rx<'b>,
    /// The failsafe's findings.
    pub alert: wiring::system_alert::Rx<'b>,
    /// What to show.
    pub signal: wiring::signal::Tx<'b>,
}

impl<'b> Notification<'b> {
    /// Nothing shown yet.
    #[must_use]
    pub fn new(ports: NotificationPorts<'b>) -> Self {
        Self { ports, signaller: Signaller::default(), mode: SystemMode::default(), alerts: Alerts::NONE }
    }
}

impl Runnable for Notification<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.update(&mut self.ports.mode, &mut self.mode);
        self.alerts = activation.latest(&mut self.ports.alert).map(|s| s.data.active).unwrap_or_default();
    }

    fn run(&mut self, activation: &mut Activation) {
        let signal = self.signaller.step(activation.now(), &self.mode, self.alerts);
        self.ports.signal.publish(activation.now(), &signal);
    }
}
