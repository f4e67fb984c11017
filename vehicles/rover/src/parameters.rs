//! The parameters: one line each with default, range and unit, in one group per component. The defaults of engine, brake, steering and
//! vehicle are the architecture document's.
//!
//! ```
//! use stampfly_param::{ParameterError, parameters};
//! use stampfly_rover::Parameters;
//! let mut parameters = Parameters::default();
//! parameters::set(&mut parameters, "engine.max_accel", 1.5)?;
//! assert_eq!(parameters.engine.max_accel, 1.5);
//! # Ok::<(), ParameterError>(())
//! ```

use stampfly_param::parameters;
use stampfly_types::Duration;

/// A change of parameters is rolled back when the diagnosis finds a fault within this time of it.
pub const PROBATION: Duration = Duration::from_secs(1);

parameters! {
    /// Every parameter of the rover.
    pub struct Parameters {
        /// Engine.
        engine: EngineParameters {
            /// Acceleration at full throttle.
            max_accel = 2.0 in [0.1, 10.0] "m/s^2";
        }
        /// Brake.
        brake: BrakeParameters {
            /// Deceleration at full brake.
            max_decel = 4.0 in [0.5, 10.0] "m/s^2";
            /// Deceleration of the brake in an emergency stop.
            estop_max_decel = 4.0 in [0.5, 10.0] "m/s^2";
        }
        /// Steering.
        steering: SteeringParameters {
            /// Steering angle at the stop, either way.
            max_angle = 0.4 in [0.05, 1.0] "rad";
            /// Time constant of the steering's lag.
            time_constant = 0.15 in [0.0, 2.0] "s";
        }
        /// Vehicle dynamics.
        vehicle: VehicleParameters {
            /// Radius of the wheels.
            wheel_radius = 0.03 in [0.005, 1.0] "m";
            /// Distance between the axles.
            wheelbase = 0.2 in [0.05, 5.0] "m";
            /// Deceleration per speed.
            linear_drag = 0.0 in [0.0, 5.0] "1/s";
            /// Largest speed.
            max_speed = 3.0 in [0.1, 20.0] "m/s";
            /// Deceleration in an emergency stop in addition to the brake's.
            estop_decel = 6.0 in [0.5, 20.0] "m/s^2";
        }
        /// Driver input.
        input: InputParameters {
            /// An operator's command older than this is no input: the vehicle brakes.
            timeout = 0.5 in [0.02, 5.0] "s";
            /// Largest speed while degraded.
            degraded_speed = 1.0 in [0.05, 20.0] "m/s";
            /// The throttle closes, and beyond the limit the brake comes on, over this difference in speed.
            degraded_band = 0.2 in [0.01, 5.0] "m/s";
            /// Largest steering input while degraded.
            degraded_steer = 0.5 in [0.0, 1.0] "1";
        }
        /// Safety supervisor. The document gives no numbers, its public descriptions 0.3 s and 1 s; the shorter counts.
        safety: SafetyParameters {
            /// The engine's heartbeat: the reaction comes within this time of the last one. The same for the next five.
            engine_timeout = 0.3 in [0.15, 5.0] "s";
            /// The brake's heartbeat.
            brake_timeout = 0.3 in [0.15, 5.0] "s";
            /// The steering's heartbeat.
            steering_timeout = 0.3 in [0.15, 5.0] "s";
            /// The dynamics' heartbeat.
            dynamics_timeout = 0.3 in [0.15, 5.0] "s";
            /// Com's heartbeat.
            com_timeout = 0.3 in [0.15, 5.0] "s";
            /// The time base's heartbeat.
            time_base_timeout = 0.3 in [0.15, 5.0] "s";
            /// Watchdog: every component stops by itself when the supervisor has been silent for longer.
            watchdog = 0.3 in [0.15, 5.0] "s";
        }
    }
    where p:
    "input.degraded_speed" "vehicle.max_speed" p.input.degraded_speed <= p.vehicle.max_speed => "it would be faster degraded than when it works";
    "vehicle.wheel_radius" "vehicle.wheelbase" 2.0 * p.vehicle.wheel_radius < p.vehicle.wheelbase => "the wheels would touch one another";
}
