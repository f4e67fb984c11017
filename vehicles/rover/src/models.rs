//! Engine, brake, steering and vehicle dynamics as pure functions: inputs and parameters in, outputs out.
//!
//! Use them in the components, in tests, or as a small plant of their own. They need no bus, no clock and no state of
//! their own. The formulas are the architecture document's, in `f32`; where its public code differs (Euler steering,
//! drag 0.15) the document counts. Frame: x forward, y left, yaw counter-clockwise, see the [crate](crate#frame).
//!
//! Inputs outside their range are clamped; one that is not a number counts as 0. The models are kinematic: no slip, no
//! load transfer. Do not use them above the speeds of a small rover.
//!
//! ```
//! use stampfly_rover::{messages::VehicleState, models, Parameters};
//! use stampfly_types::Duration;
//! let (parameters, dt) = (Parameters::default(), Duration::from_millis(10));
//! let mut state = VehicleState::default();
//! for _ in 0..100 {
//!     let drive = models::drive_acceleration(0.5, false, &parameters.engine);
//!     state = models::step_longitudinal(&state, dt, drive, 0.0, false, &parameters.vehicle);
//!     state = models::step_lateral(&state, dt, 0.1, &parameters.vehicle);
//! }
//! assert!((state.v - 1.0).abs() < 1e-5, "1 m/s^2 for 1 s");
//! assert!(state.y > 0.0 && state.yaw > 0.0, "a positive angle turns left");
//! ```

use crate::messages::VehicleState;
use crate::parameters::{BrakeParameters, EngineParameters, SteeringParameters, VehicleParameters};
use stampfly_types::{Duration, math};

/// The document's period: how often the components run, and by how much time a model advances in one run.
pub const TICK: Duration = Duration::from_millis(10);

/// Clamps to 0…1. NaN gives 0, which `f32::clamp` does not promise.
pub(crate) fn fraction(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

/// Clamps to ±`limit`, and a limit that is negative or NaN to 0. Unlike `f32::clamp` it cannot panic.
pub(crate) fn within(value: f32, limit: f32) -> f32 {
    let limit = limit.max(0.0);
    if value.is_nan() { 0.0 } else { value.max(-limit).min(limit) }
}

/// Acceleration of the engine, m/s²: proportional to the throttle (0…1), zero in an emergency stop.
#[must_use]
pub fn drive_acceleration(throttle: f32, estop: bool, parameters: &EngineParameters) -> f32 {
    if estop { 0.0 } else { fraction(throttle) * parameters.max_accel }
}

/// Deceleration of the brake, m/s²: proportional to the pedal (0…1), its emergency value in an emergency stop.
#[must_use]
pub fn brake_deceleration(brake: f32, estop: bool, parameters: &BrakeParameters) -> f32 {
    if estop { parameters.estop_max_decel } else { fraction(brake) * parameters.max_decel }
}

/// Angle the steering moves to, rad: proportional to the input (−1 right … 1 left), centred in an emergency stop.
#[must_use]
pub fn steering_target(steer: f32, estop: bool, parameters: &SteeringParameters) -> f32 {
    if estop { 0.0 } else { within(steer, 1.0) * parameters.max_angle }
}

/// Angle of the wheels after `dt`, rad: a first-order lag towards `target`, which is clamped to the stops.
///
/// The lag is discretised exactly, 1 − exp(−dt/τ), so the result does not depend on the period. τ = 0 has no lag.
#[must_use]
pub fn step_steering(current: f32, target: f32, dt: Duration, parameters: &SteeringParameters) -> f32 {
    let tau = parameters.time_constant;
    let gain = if tau > 0.0 { 1.0 - math::exp(-dt.seconds() / tau) } else { 1.0 };
    let angle = current + gain * (within(target, parameters.max_angle) - current);
    // Matters only after the stops have been moved by a change of parameters.
    within(angle, parameters.max_angle)
}

/// Speed and wheel speed after `dt`. `drive` and `brake` in m/s²; an emergency stop brakes by a further deceleration.
///
/// The speed stays within 0 and its limit; the vehicle does not reverse.
#[must_use]
pub fn step_longitudinal(
    state: &VehicleState,
    dt: Duration,
    drive: f32,
    brake: f32,
    estop: bool,
    parameters: &VehicleParameters,
) -> VehicleState {
    let further = if estop { parameters.estop_decel } else { 0.0 };
    let accel = drive - brake - parameters.linear_drag * state.v - further;
    // `max` first: it turns NaN into 0.
    let v = (state.v + accel * dt.seconds()).max(0.0).min(parameters.max_speed);
    VehicleState { v, wheel_omega: v / parameters.wheel_radius, ..*state }
}

/// Yaw rate, yaw and position after `dt` with the front wheels at `angle`, rad: the kinematic bicycle.
///
/// Yaw is updated before the position (semi-implicit), as in the document, and is not wrapped.
#[must_use]
pub fn step_lateral(state: &VehicleState, dt: Duration, angle: f32, parameters: &VehicleParameters) -> VehicleState {
    let yaw_rate = state.v / parameters.wheelbase * math::tan(angle);
    let yaw = state.yaw + yaw_rate * dt.seconds();
    let (sin, cos) = math::sin_cos(yaw);
    let distance = state.v * dt.seconds();
    VehicleState { yaw_rate, yaw, x: state.x + distance * cos, y: state.y + distance * sin, ..*state }
}
