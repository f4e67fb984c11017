//! Monitor: samples and what the estimator made of them in, the state of every sensor out.

use crate::config::VehicleConfig;
use crate::topics::MonitorEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::decision::UNFELT;
use stampfly_monitor::MonitorInput;

/// Monitor: samples and what the estimator made of them in, the state of every sensor out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Monitor(stampfly_monitor::Monitor);

impl Monitor {
    /// Nothing seen yet.
    #[inline(never)]
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self(stampfly_monitor::Monitor::new(config.monitor))
    }
}

impl Runnable for Monitor {
    type Ends<'b> = MonitorEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut MonitorEnds<'_>) {
        let now = activation.now();
        let command = ends.estimator_command.get();
        let Self(monitor) = self;
        let before = *monitor.findings();
        let correction = monitor.step(
            now,
            &MonitorInput {
                imu: &ends.sensor_imu,
                flow: &ends.sensor_flow,
                tof: &ends.sensor_tof,
                baro: &ends.sensor_baro,
                estimate: ends.estimate_state.get(),
                status: ends.estimate_status.get(),
                stands: command.on_ground,
                flies: command.flying,
                felt: !ends.system_alert.get().active.intersects(UNFELT),
                restarts: command.full_resets,
            },
        );
        if *monitor.findings() != before {
            ends.findings.publish(now, monitor.findings());
        }
        if let Some(correction) = &correction {
            ends.estimate_correction.publish(now, correction);
        }
    }
}
