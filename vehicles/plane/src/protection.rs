//! What this airframe bears, and what its inertial sensor must show: the numbers of the family's
//! detectors for an aeroplane.
//!
//! | found in inertial samples | alert | what follows |
//! |---|---|---|
//! | a blow from the front, the side or above; from below with more sink than the wheels bear | `IMPACT`, `STRUCK` | it has crashed |
//! | a rate that no surface makes | `GYRO_ANOMALY` | it has crashed |
//! | stuck, at full scale, garbage | `IMU_FAULTY`, `ACCEL_FAULTY` | its attitude is not known |
//! | silent | `IMU_LOST` | the estimate is too old to fly by, which nothing else has to say |
//!
//! Attitudes say nothing here: an aeroplane may be in any. What lies, and what has a wing tip on
//! the ground, [`stampfly_fixed_wing::crash`] finds.

use crate::Parameters;
use stampfly_mode::FailsafeConfig;
use stampfly_types::messages::{Alerts, StateEstimate, Validity};
use stampfly_types::{Duration, GRAVITY};

/// The propeller stops, and does not start again by itself.
pub const BLOW: Alerts = Alerts::IMPACT.with(Alerts::STRUCK).with(Alerts::GYRO_ANOMALY);
/// The inertial sensor shows no attitude.
pub const BLIND: Alerts = Alerts::IMU_FAULTY.with(Alerts::ACCEL_FAULTY);
/// A blow, m/s². Along and across, thrust, brakes and tyres make a weight at most; at cruise the
/// wing makes 3.1 of them before it stalls, and a landing's wheels push from below, which counts
/// for nothing.
const IMPACT: f32 = 5.0 * GRAVITY;
/// A tilt that nothing exceeds.
const NEVER: f32 = core::f32::consts::PI;
/// Full deflection rolls it with 5 rad/s at cruising speed, and nothing turns it faster.
const RATE: f32 = 14.0;
/// Three cells.
const CELLS: f32 = 3.0;

/// The detectors' numbers.
#[must_use]
pub fn config(p: &Parameters) -> FailsafeConfig {
    FailsafeConfig {
        impact: IMPACT,
        landing_impact: IMPACT,
        // Wherever it comes down there may be ground, and with less sink than this its wheels bear
        // it.
        touch_height: f32::INFINITY,
        touch_speed: stampfly_fixed_wing::crash::CrashConfig::default().sink,
        // Far above what the propeller shakes; a blow that rises slowly would raise its own limit.
        impact_sigmas: 0.0,
        // A gust in a dive is as sharp as a blow.
        sharp: f32::INFINITY,
        rate: RATE,
        flip_rate: RATE,
        tumble_tilt: NEVER,
        tip_tilt: NEVER,
        armed_tilt: NEVER,
        acro_tilt: NEVER,
        lift_height: 0.0,
        // A propeller of 30 cm shakes it less than rotors of a palm's size do; it turns more
        // slowly.
        angular_acceleration: 3_000.0,
        link_silence: Duration::from_micros((p.link.lost * 1e6) as u64),
        battery_low: p.battery.warning,
        battery_critical: 3.0 * CELLS,
        usb: 2.5 * CELLS,
        voltage_range: [2.4 * CELLS, 4.5 * CELLS],
        voltage_step: 0.35 * CELLS,
        ..FailsafeConfig::default()
    }
}

/// The estimate as the detectors ask for it: of the height above what is below it says nothing, and
/// there may be ground wherever it is.
#[must_use]
pub fn above_any_ground(estimate: &StateEstimate) -> StateEstimate {
    StateEstimate { height: 0.0, valid: estimate.valid.set(Validity::HEIGHT, true), ..*estimate }
}
