//! Diagnosis: does every signal make sense? Any fault degrades the vehicle.
//!
//! The models keep their outputs in range, so a fault means a component other than ours (another process, a changed
//! model), memory that went bad, or parameters that changed under a signal made with the old ones.
//!
//! ```
//! use stampfly_rover::diag::{Signals, check};
//! use stampfly_rover::{messages::Faults, Parameters};
//! let mut signals = Signals::default();
//! assert!(check(&signals, &Parameters::default()).is_empty());
//! signals.drive.acceleration = f32::NAN;
//! assert_eq!(check(&signals, &Parameters::default()), Faults::DRIVE);
//! ```

use crate::Parameters;
use crate::messages::{BrakeCommand, DriveCommand, DriverInput, Faults, SteeringCommand, VehicleState};

/// The signals of one period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Signals {
    /// Selected input.
    pub input: DriverInput,
    /// Engine.
    pub drive: DriveCommand,
    /// Brake.
    pub brake: BrakeCommand,
    /// Steering.
    pub steering: SteeringCommand,
    /// Motion.
    pub state: VehicleState,
}

/// Largest difference between wheel speed and v / r that is rounding, relative.
const WHEEL_TOLERANCE: f32 = 1e-4;

/// The signals that make no sense. NaN is inside no range, so it is always a fault.
#[must_use]
pub fn check(signals: &Signals, parameters: &Parameters) -> Faults {
    let Signals { input, drive, brake, steering, state } = signals;
    let between = |low: f32, value: f32, high: f32| (low..=high).contains(&value);
    let decel = parameters.brake.max_decel.max(parameters.brake.estop_max_decel);
    let angle = parameters.steering.max_angle;
    let omega = state.v / parameters.vehicle.wheel_radius;
    [
        (between(0.0, input.throttle, 1.0), Faults::DRIVER_INPUT),
        (between(0.0, input.brake, 1.0), Faults::DRIVER_INPUT),
        (between(-1.0, input.steer, 1.0), Faults::DRIVER_INPUT),
        (between(0.0, drive.acceleration, parameters.engine.max_accel), Faults::DRIVE),
        (between(0.0, brake.deceleration, decel), Faults::BRAKE),
        (between(-angle, steering.angle, angle), Faults::STEERING),
        (between(0.0, state.v, parameters.vehicle.max_speed), Faults::SPEED),
        ((state.wheel_omega - omega).abs() <= WHEEL_TOLERANCE * omega.max(1.0), Faults::WHEEL),
        ([state.x, state.y, state.yaw, state.yaw_rate].iter().all(|value| value.is_finite()), Faults::POSE),
    ]
    .into_iter()
    .filter(|(sane, _)| !sane)
    .fold(Faults::NONE, |faults, (_, fault)| faults | fault)
}
