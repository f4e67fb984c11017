//! Thresholds, times and filter weights of the [failsafe](super).

use stampfly_types::{Duration, GRAVITY};

/// Thresholds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FailsafeConfig {
    /// Impact, m/s².
    pub impact: f32,
    /// Impact while landing, m/s²: a firm touchdown reaches 4 g.
    pub landing_impact: f32,
    /// Impact, in standard deviations of the vibration.
    pub impact_sigmas: f32,
    /// Angular rate, rad/s.
    pub rate: f32,
    /// Tilt of a vehicle that tumbles, rad.
    pub tumble_tilt: f32,
    /// For how long it is tilted so far.
    pub tumble_time: Duration,
    /// Silence of the inertial sensor after which it is degraded.
    pub imu_degraded: Duration,
    /// Silence of the inertial sensor after which it is lost.
    pub imu_lost: Duration,
    /// Silence of the command link.
    pub link_silence: Duration,
    /// Voltage of a low battery, V.
    pub battery_low: f32,
    /// Voltage of a battery with which the vehicle lands, V.
    pub battery_critical: f32,
    /// Below this a disarmed vehicle has no battery, V.
    pub usb: f32,
    /// Below this no meter is fitted, V.
    pub no_meter: f32,
    /// Hysteresis of the battery thresholds, V.
    pub battery_hysteresis: f32,
    /// Time constant of the battery low-pass, s.
    pub battery_time: f32,
    /// Silence of the battery monitor.
    pub power_silence: Duration,
    /// Silence of range and flow in the air.
    pub aiding_silence: Duration,
    /// Disagreement of gravity and tilt on the ground, rad.
    pub tilt_mismatch: f32,
    /// For how long they disagree.
    pub tilt_mismatch_time: Duration,
    /// Weight of an inertial sample in the specific force that is compared with the impact thresholds. A blow lasts some
    /// 10 ms, a propeller's shaking averages out.
    pub blow_weight: f32,
    /// Weight of an inertial sample in mean and variance of the vibration.
    pub vibration_weight: f32,
    /// Weight of an inertial sample in the gravity that is compared with the tilt on the ground.
    pub gravity_weight: f32,
    /// Samples running above a threshold of force or rate that are an alert: one alone is a glitch.
    pub motion_samples: u32,
}

impl Default for FailsafeConfig {
    /// For one lithium cell and an inertial sensor at 400 Hz: voltages grow with the number of cells, and weights of samples
    /// shrink with their rate.
    fn default() -> Self {
        Self {
            impact: 3.0 * GRAVITY,
            landing_impact: 6.0 * GRAVITY,
            impact_sigmas: 6.0,
            rate: 13.96,
            tumble_tilt: 1.05,
            tumble_time: Duration::from_millis(300),
            imu_degraded: Duration::from_millis(10),
            imu_lost: Duration::from_millis(25),
            link_silence: Duration::from_millis(500),
            battery_low: 3.4,
            battery_critical: 3.0,
            usb: 3.3,
            no_meter: 0.1,
            battery_hysteresis: 0.1,
            battery_time: 2.0,
            power_silence: Duration::from_secs(1),
            aiding_silence: Duration::from_secs(1),
            tilt_mismatch: 0.1745,
            tilt_mismatch_time: Duration::from_millis(500),
            // Time constants of about 10 ms, 100 ms and a second at 400 Hz.
            blow_weight: 0.3,
            vibration_weight: 0.02,
            gravity_weight: 0.0025,
            motion_samples: 2,
        }
    }
}
