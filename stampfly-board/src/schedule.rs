//! What runs when: the vehicle's activations, one line each.
//!
//! The flight band runs in the order shown, as one task, so a silent inertial sensor still activates failsafe and
//! control. Budgets are for the ESP32-S3 at 240 MHz: at least twice the most instructions that `cargo xtask qemu` counts
//! on any emulated core, at one a cycle. From them follow [`RESPONSE_TIMES`], while compiling.

use crate::config::VehicleConfig;
use crate::runnables::*;
use stampfly_flight::live::Adjust;

stampfly_bus::schedule! {
    /// The StampFly's runnables: the state of the vehicle.
    #[derive(Clone)]
    #[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
    pub struct Runnables on crate::topics from VehicleConfig;

    /// State estimation.
    estimation = Estimation: on sensor_imu, flight, 480 us;
    /// Judges the sensors; without it all of them are used.
    monitor = Monitor: after estimation, flight, 120 us;
    /// Anomaly detection.
    failsafe = Failsafe: after estimation or at latest 5 ms, flight, 86 us;
    /// Take-off and landing manager.
    landing = Landing: after failsafe, flight, 50 us;
    /// State management: the only place where the vehicle changes state.
    mode = Mode: after landing, flight, 132 us;
    /// Navigator: every set-point there is.
    navigation = Navigation: after mode, flight, 228 us;
    /// Control.
    control = Control: after navigation or at latest 10 ms, flight, 198 us;
    /// Mixer, motor curve, motor output.
    actuation = Actuation: after control, flight, 40 us;

    // It takes all samples since its last run. With each sample it would always be due, and starve the lines below.
    /// Still-calibration.
    calibration = Calibration: every 20 ms, background, 144 us;
    /// Command arbitration.
    command = Command: every 20 ms, background, 42 us;
    /// Button gestures.
    button = Button: every 20 ms, background, 24 us;
    /// Lights and sound.
    notification = Notification: every 33 ms, background, 86 us;
    /// Downlink.
    telemetry = Telemetry: every 20 ms, background, 88 us;
}

/// The controller's gains change in flight. The estimator, of 6 kB, begins again in its place.
impl Adjust for Runnables {
    fn adjust(&mut self, config: &VehicleConfig) {
        self.control.set_gains(config);
    }

    const IN_PLACE: u64 = 1 << Id::estimation as usize;

    fn begin_again(&mut self, _: usize, config: &VehicleConfig) {
        self.estimation.begin_again(config);
    }
}
