//! The StampFly's airframe: the one place where its mass, inertia, rotors and motors stand.
//!
//! The numbers are those of the people who build it, their "flight anchored" set of August 2026: mass, inertia and places
//! of the rotors were weighed and measured, drag torques come from coast-downs, and the motors' curve is anchored to the
//! hover in flight. [`VehicleConfig`](crate::VehicleConfig) derives the flight stack's configuration from [`AIRFRAME`],
//! the simulation its plant from the same constants.
//!
//! Constants are `f64`, for the simulation; the flight stack computes with their nearest `f32`.

use stampfly_control::{Airframe, MotorCurve, MultirotorMixer, Rotor};
use stampfly_types::{Duration, Vec3};

/// Take-off mass, battery included, kg (measured).
pub const MASS: f64 = 0.0368;
/// Moments of inertia about body x, y and z, kg·m² (measured).
pub const INERTIA: [f64; 3] = [9.16e-6, 13.3e-6, 20.4e-6];
/// Distance of each rotor from the body's x and y axis, m (measured).
pub const ROTOR_OFFSET: f64 = 0.023;
/// Thrust over rotor speed squared, N/(rad/s)² (flight anchored).
pub const THRUST_COEFFICIENT: f64 = 1.0e-8;
/// Rotor drag torque over rotor speed squared, N·m/(rad/s)² (coast-down).
pub const TORQUE_COEFFICIENT: f64 = 4.1e-11;
/// Steady motor voltage: coefficients of speed squared, V/(rad/s)², of speed, V/(rad/s), and friction, V (flight anchored).
pub const MOTOR_VOLTAGE: [f64; 3] = [6.0368e-8, 6.699_042e-4, 1.53e-2];
/// Moment of inertia of motor and propeller, kg·m² (coast-down).
pub const ROTOR_INERTIA: f64 = 1.375e-8;
/// Drag along body x and y over speed, N/(m/s) (typical for the size).
pub const DRAG: f64 = 0.015;
/// Thrust that is lost by climbing over climb rate, at the rotors' speed of a hover, N/(m/s): 1.4
/// 1/s of damping (theory).
pub const DRAG_VERTICAL: f64 = 0.0515;
/// Drag of the body over the square of the speed, N/(m/s)² (a flat plate of its size).
pub const DRAG_SQUARE: f64 = 0.004;
/// Height of the body's origin, and of the bottom range finder, when standing, m (range finder logs).
pub const GROUND_HEIGHT: f64 = 0.03;
/// Distance of each foot from the body's x and y axis, m.
pub const FOOT_OFFSET: f64 = 0.030;

/// Longest time without inertial data from which it recovers. A disturbance of four fifths of its
/// torque, 262 rad/s², turns it for 50 ms without an answer, and the last fifth then brakes it: by
/// 262·0.05²/2·5 rad altogether, a quarter of a turn, from which it levels.
pub const LAST_RATES: Duration = Duration::from_millis(50);
/// Motors that get no duties for this long are stopped: what the flight task may be late by, and two
/// of the controller's deadlines of 5 ms.
pub const CUT_OFF: Duration = Duration::from_millis(60);

/// The airframe. One LiHV cell.
pub const AIRFRAME: Airframe = Airframe {
    mass: MASS as f32,
    inertia: Vec3::new(INERTIA[0] as f32, INERTIA[1] as f32, INERTIA[2] as f32),
    rotors: &Rotor::quadrotor_x(ROTOR_OFFSET as f32, (TORQUE_COEFFICIENT / THRUST_COEFFICIENT) as f32),
    motor: MotorCurve {
        ct: THRUST_COEFFICIENT as f32,
        am: MOTOR_VOLTAGE[0] as f32,
        bm: MOTOR_VOLTAGE[1] as f32,
        cm: MOTOR_VOLTAGE[2] as f32,
    },
    // About 18 ms at hover.
    motor_lag: 0.018,
    // At 95 % duty on a full battery.
    motor_thrust_max: 0.168,
    cells: 1,
};

/// The mixer of [`AIRFRAME`].
pub const MIXER: MultirotorMixer = match MultirotorMixer::for_airframe(&AIRFRAME) {
    Ok(mixer) => mixer,
    // While compiling.
    Err(_) => panic!("the rotors cannot control the vehicle"),
};

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_control::CascadeConfig;

    #[test]
    fn hover_needs_the_duty_flown() {
        let hover = AIRFRAME.motor.voltage(AIRFRAME.hover_thrust() / 4.0);
        assert!((hover - 2.57).abs() < 0.01, "{hover} V");
        assert!((AIRFRAME.motor.voltage(AIRFRAME.motor_thrust_max) - 3.77).abs() < 0.01);
        assert!((AIRFRAME.rotors[0].kappa - 4.1e-3).abs() < 1e-9);
    }

    /// What was tuned in flight, before gains followed from the airframe.
    #[test]
    fn the_rules_give_the_gains_flown() {
        let config = CascadeConfig::for_airframe(&AIRFRAME);
        let rate = config.rate;
        let near = |value: f32, flown: f32| (value / flown - 1.0).abs() < 0.035;
        assert!(near(rate.roll.kp, 4.0e-4) && near(rate.pitch.kp, 5.8e-4) && near(rate.yaw.kp, 4.5e-4), "{rate:?}");
        assert!(near(rate.roll.td, 0.016) && near(rate.yaw.td, 0.010), "{rate:?}");
        assert!(near(rate.torque_max.x, 3.0e-3) && near(rate.torque_max.z, 1.0e-3), "{rate:?}");
        assert!(near(config.altitude.thrust_max, 0.62) && near(config.altitude.hover_thrust, 0.361), "{config:?}");
        assert!(near(crate::VehicleConfig::default().landing.hover_thrust, 0.361));
    }
}
