//! What runs when: the document's runnables, one line each, in its order.
//!
//! The tick of 10 ms is a chain from driver input to diagnosis. The supervisor runs before it, whenever the operator or a
//! replay says something, so an emergency stop acts in the tick that follows it.

use crate::Parameters;
pub use crate::models::TICK;
use crate::runnables::*;
use serde::{Deserialize, Serialize};
use stampfly_bus::Trigger;

stampfly_bus::schedule! {
    /// The rover's runnables: the state of the vehicle.
    #[derive(Clone, Debug, Serialize, Deserialize)]
    pub struct Runnables on crate::topics from Parameters;

    /// Heartbeats, faults and the emergency stop; every 100 ms even when nothing is said.
    safety_supervisor = SafetySupervisorSwc: on operator_command | replay_record or at latest 100 ms, flight, 40 us;
    /// Parameters: validated changes take effect here, between two ticks.
    nvm = NvmSwc: every 10 ms, flight, 40 us;
    /// The driver's input.
    driver_input = DriverInputSwc: every 10 ms, flight, 20 us;
    /// Throttle to acceleration.
    engine = EngineSwc: after driver_input, flight, 10 us;
    /// Pedal to deceleration.
    brake = BrakeSwc: after engine, flight, 10 us;
    /// Wheel to steering angle, with its lag.
    steering = SteeringSwc: after brake, flight, 20 us;
    /// Motion of the vehicle.
    vehicle_dynamics = VehicleDynamicsSwc: after steering, flight, 40 us;
    /// One line of the log.
    logging = LoggingSwc: after vehicle_dynamics, flight, 20 us;
    /// Do the signals make sense?
    diag = DiagSwc: after logging, flight, 20 us;
    /// Are all components in other processes heard?
    com = ComSwc: every 20 ms, background, 10 us;
}

// The models advance by a tick whenever the chain runs.
const _: () = match ACTIVATIONS[Id::driver_input as usize].trigger {
    Trigger::Every(period) => assert!(period.as_micros() == TICK.as_micros()),
    _ => panic!("the driver's input has no period"),
};
