//! Failsafe: everything that can go wrong in, alerts out. Runs on a deadline when the inertial sensor is silent.

use crate::config::VehicleConfig;
use crate::topics::FailsafeEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::FailsafeInput;
use stampfly_types::Instant;

/// Failsafe: everything that can go wrong in, alerts out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Failsafe {
    failsafe: stampfly_mode::Failsafe,
    last_command: Option<Instant>,
    last_tof: Option<Instant>,
    last_flow: Option<Instant>,
}

impl Failsafe {
    /// Nothing wrong yet.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self {
            failsafe: stampfly_mode::Failsafe::new(config.failsafe),
            last_command: None,
            last_tof: None,
            last_flow: None,
        }
    }
}

impl Runnable for Failsafe {
    type Ends<'b> = FailsafeEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut FailsafeEnds<'_>) {
        let now = activation.now();
        // A stamp in the future must not stand for samples that never come.
        let newest = |last: Option<Instant>, at: Option<Instant>| last.max(at.map(|at| at.min(now)));
        let range = ends.sensor_tof.iter().filter(|sample| sample.data.valid).map(|sample| sample.at).max();
        self.last_tof = newest(self.last_tof, range);
        let flow = ends.sensor_flow.iter().filter(|sample| sample.data.valid).map(|sample| sample.at).max();
        self.last_flow = newest(self.last_flow, flow);
        let pilot = ends.command_pilot.last().map(|sample| sample.at);
        let guided = ends.command_guided.last().map(|sample| sample.at);
        self.last_command = newest(newest(self.last_command, pilot), guided);

        let alert = self.failsafe.step(
            now,
            &FailsafeInput {
                imu: &ends.sensor_imu,
                estimate: ends.estimate_state.get(),
                status: ends.estimate_status.get(),
                power: ends.sensor_power.sample().map(|sample| (sample.at, &sample.data)),
                command: self.last_command,
                tof: self.last_tof,
                flow: self.last_flow,
                self_test: ends.self_test.get().verdict,
                flight_status: ends.flight_status.get(),
            },
        );
        ends.system_alert.publish(now, &alert);
    }
}
