//! What runs when.
//!
//! The path manager of the document runs as fast as it can; here it has 50 Hz, a third of a metre of flight. What must be fast, from the gyro to the surfaces, is the flight band.

use crate::Parameters;
use crate::runnables::*;
use serde::{Deserialize, Serialize};

stampfly_bus::schedule! {
    /// The aircraft's runnables: the state of the vehicle.
    #[derive(Clone, Debug, Serialize, Deserialize)]
    pub struct Runnables on crate::topics from Parameters;

    /// Sensors to state, wind and airspeed.
    estimation = Estimation: on sensor_imu, flight, 400 us;
    /// Every inertial sample to what is wrong: a blow, a sensor that does not measure.
    failsafe = Failsafe: after estimation or at latest 10 ms, flight, 60 us;
    /// Demand and state to surfaces and throttle. Without samples it still closes the throttle.
    control = Control: after failsafe or at latest 10 ms, flight, 100 us;
    /// What is wrong.
    watch = Watching: every 20 ms, background, 40 us;
    /// The path manager.
    path = Path: every 20 ms, background, 200 us;
    /// Parameters.
    storage = Storage: every 20 ms, background, 40 us;
}
