//! What runs when.
//!
//! The original calls five functions from five timers: sensor and controller 4000 times a second, receiver 10000, system 8, and the serial line once a byte.
//! Here the first two are the flight band, in this order, so the controller always has the sample that was just taken. The receiver polls a chip and the serial
//! line waits for bytes: both are input and output, so they are drivers outside the table, which wait for an interrupt and publish what came. What the receiver
//! *decides* (is it offline?) the controller decides by the age of its newest packet, to a quarter of a millisecond.
//!
//! A third band would have been for the receiver alone, at 10 kHz, and every response time below would count it twice in a period of the flight band.

use crate::Parameters;
pub use crate::rate_loops::{PERIOD, RATE};
use crate::runnables::*;
use serde::{Deserialize, Serialize};
use stampfly_bus::Trigger;

stampfly_bus::schedule! {
    /// The quadcopter's runnables: the state of the vehicle.
    #[derive(Clone, Debug, Serialize, Deserialize)]
    pub struct Runnables on crate::topics from Parameters;

    /// Sample to attitude; calibration.
    sensor = Sensor: on sensor_imu, flight, 50 us;
    /// What samples show to have gone wrong. That there are none is the controller's matter.
    failsafe = Failsafe: after sensor, flight, 40 us;
    /// Sticks and attitude to motors. Without samples it still stops them.
    controller = Controller: after failsafe or at latest 500 us, flight, 45 us;
    /// Parameters.
    storage = Storage: every 10 ms, background, 40 us;
    /// What services on the serial line are told.
    communication = Communication: every 20 ms, background, 20 us;
    /// Battery and lights; the period is one bit of a light's pattern.
    system = System: every 125 ms, background, 20 us;
}

// An eighth of a second is eight bits in a second.
const _: () = match ACTIVATIONS[Id::system as usize].trigger {
    Trigger::Every(period) => assert!(period.as_micros() * 8 == 1_000_000),
    _ => panic!("the lights have no period"),
};
