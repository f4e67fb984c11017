//! A stranger's program: a second of driving.

use stampfly_rover::{Parameters, messages::VehicleState, models};
use stampfly_types::Duration;

fn main() {
    let (parameters, dt) = (Parameters::default(), Duration::from_millis(10));
    let mut state = VehicleState::default();
    for _ in 0..100 {
        let drive = models::drive_acceleration(0.5, false, &parameters.engine);
        state = models::step_longitudinal(&state, dt, drive, 0.0, false, &parameters.vehicle);
        state = models::step_lateral(&state, dt, 0.1, &parameters.vehicle);
    }
    assert!(state.v > 0.99 && state.yaw > 0.0, "{state:?}");
}
