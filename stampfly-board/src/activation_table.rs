//! Who runs when: the vehicle's activations, one line each.
//!
//! The flight band runs in the order shown, as one task, so a silent inertial sensor still activates failsafe and
//! control. Budgets are for the ESP32-S3 at 240 MHz: at least twice the most instructions that `cargo xtask qemu` counts
//! on any emulated core, at one a cycle. From them follow [`plan::RESPONSE_TIMES`], while compiling.

use crate::runnables::*;
use crate::wiring;
use stampfly_bus::schedule;

schedule! {
    /// The StampFly's activations.
    pub mod plan on wiring;

    /// State estimation.
    estimation = Estimation: on sensor_imu, flight, 320 us;
    /// Anomaly detection.
    failsafe = FailsafeMonitor: after estimation or at latest 5 ms, flight, 40 us;
    /// Take-off and landing manager.
    landing = LandingManager: after failsafe, flight, 20 us;
    /// State management: the only place where the vehicle changes state.
    mode = ModeManager: after landing, flight, 60 us;
    /// Navigator: every set-point there is.
    navigation = Navigation: after mode, flight, 240 us;
    /// Control.
    control = Control: after navigation or at latest 10 ms, flight, 100 us;
    /// Mixer, motor curve, motor output.
    actuation = Actuation: after control, flight, 40 us;

    /// Still-calibration.
    calibration = Calibration: every 20 ms, background, 100 us;
    /// Command arbitration.
    command = Command: every 20 ms, background, 30 us;
    /// Button gestures.
    button = ButtonReader: every 20 ms, background, 10 us;
    /// Lights and sound.
    notification = Notification: every 33 ms, background, 20 us;
    /// Downlink.
    telemetry = Telemetry: every 20 ms, background, 30 us;
}
