//! Telemetry: the newest of everything a ground station wants, at a rate a radio can carry.

use crate::config::VehicleConfig;
use crate::messages::TelemetryFrame;
use crate::topics::TelemetryEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_types::frame::roll_pitch_yaw;

/// Telemetry: the newest of everything a ground station wants, at a rate a radio can carry.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Telemetry {
    frame: TelemetryFrame,
}

impl Telemetry {
    /// An empty frame.
    #[must_use]
    pub fn new(_: &VehicleConfig) -> Self {
        Self::default()
    }
}

impl Runnable for Telemetry {
    type Ends<'b> = TelemetryEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut TelemetryEnds<'_>) {
        let frame = &mut self.frame;
        let mode = ends.flight_status.get();
        (frame.phase, frame.mode, frame.armed, frame.blocks) = (mode.phase, mode.mode, mode.armed, mode.blocks);
        frame.alerts = ends.system_alert.get().active;
        // The default of an estimate is an attitude: level. Nothing has been estimated before the first sample.
        if let Some(estimate) = ends.estimate_state.sample() {
            (frame.position, frame.velocity) = (estimate.data.position, estimate.data.velocity);
            frame.attitude = roll_pitch_yaw(&estimate.data.attitude).into();
        }
        let setpoint = ends.setpoint.get();
        (frame.remaining, frame.arrived) = (setpoint.remaining, setpoint.arrived);
        frame.battery = ends.sensor_power.get().voltage;
        ends.telemetry.publish(activation.now(), frame);
    }
}
