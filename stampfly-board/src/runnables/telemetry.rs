//! Telemetry: the newest of everything a ground station wants, at a rate a radio can carry.

use crate::messages::TelemetryFrame;
use crate::wiring;
use stampfly_bus::{Activation, Runnable};
use stampfly_types::frame::roll_pitch_yaw;

/// Telemetry: the newest of everything a ground station wants, at a rate a radio can carry.
pub struct Telemetry<'b> {
    ports: TelemetryPorts<'b>,
    frame: TelemetryFrame,
}

/// The ends it owns.
pub struct TelemetryPorts<'b> {
    /// State and mode.
    pub mode: wiring::system_mode::Rx<'b>,
    /// The failsafe's findings.
    pub alert: wiring::system_alert::Rx<'b>,
    /// The state.
    pub estimate: wiring::estimate_state::Rx<'b>,
    /// The path.
    pub setpoint: wiring::setpoint::Rx<'b>,
    /// Battery.
    pub power: wiring::sensor_power::Rx<'b>,
    /// The frame.
    pub frame: wiring::telemetry::Tx<'b>,
}

impl<'b> Telemetry<'b> {
    /// Nothing sent yet.
    #[must_use]
    pub fn new(ports: TelemetryPorts<'b>) -> Self {
        Self { ports, frame: TelemetryFrame::default() }
    }
}

impl Runnable for Telemetry<'_> {
    fn read(&mut self, activation: &mut Activation) {
        let frame = &mut self.frame;
        if let Some(mode) = activation.latest(&mut self.ports.mode) {
            (frame.state, frame.mode, frame.armed) = (mode.data.state, mode.data.mode, mode.data.armed);
            frame.blocks = mode.data.blocks;
        }
        if let Some(alert) = activation.latest(&mut self.ports.alert) {
            frame.alerts = alert.data.active;
        }
        if let Some(estimate) = activation.latest(&mut self.ports.estimate) {
            (frame.position, frame.velocity) = (estimate.data.position, estimate.data.velocity);
            frame.attitude = roll_pitch_yaw(&estimate.data.attitude).into();
        }
        if let Some(setpoint) = activation.latest(&mut self.ports.setpoint) {
            (frame.remaining, frame.arrived) = (setpoint.data.remaining, setpoint.data.arrived);
        }
        if let Some(power) = activation.latest(&mut self.ports.power) {
            frame.battery = power.data.voltage;
        }
    }

    fn run(&mut self, activation: &mut Activation) {
        self.ports.frame.publish(activation.now(), &self.frame);
    }
}
