//! Monitor: samples and what the estimator made of them in, the state of every sensor out.

use crate::config::VehicleConfig;
use crate::topics::MonitorEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_monitor::MonitorInput;
use stampfly_types::messages::{Alerts, SensorFindings};

/// With these the accelerometer says nothing about the motion.
const NOT_FELT: Alerts = Alerts::ACCEL_FAULTY.with(Alerts::FORCE_IMPLAUSIBLE);

/// Monitor: samples and what the estimator made of them in, the state of every sensor out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Monitor {
    monitor: stampfly_monitor::Monitor,
    published: SensorFindings,
    corrections: u32,
}

impl Monitor {
    /// Nothing seen yet.
    #[inline(never)]
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        let monitor = stampfly_monitor::Monitor::new(config.monitor);
        Self { monitor, published: SensorFindings::default(), corrections: 0 }
    }
}

impl Runnable for Monitor {
    type Ends<'b> = MonitorEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut MonitorEnds<'_>) {
        let now = activation.now();
        let command = ends.estimator_command.get();
        self.monitor.step(
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
                felt: !ends.system_alert.get().active.intersects(NOT_FELT),
                restarts: command.full_resets,
            },
        );
        let findings = self.monitor.findings();
        if *findings != self.published {
            self.published = *findings;
            ends.findings.publish(now, findings);
        }
        let correction = self.monitor.correction();
        if correction.number != self.corrections {
            self.corrections = correction.number;
            ends.estimate_correction.publish(now, correction);
        }
    }
}
