//! Take-off and landing manager: the estimate in, contact with the ground out.

use crate::config::VehicleConfig;
use crate::topics::LandingEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::{LandingInput, TakeoffLanding};
use stampfly_types::messages::Alerts;

/// Take-off and landing manager: the estimate in, contact with the ground out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Landing {
    manager: TakeoffLanding,
}

impl Landing {
    /// Standing.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self { manager: TakeoffLanding::new(config.landing) }
    }
}

impl Runnable for Landing {
    type Ends<'b> = LandingEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut LandingEnds<'_>) {
        let input = LandingInput {
            estimate: ends.estimate_state.get(),
            felt: !ends.system_alert.get().active.contains(Alerts::ACCEL_FAULTY),
            phase: ends.flight_status.get().phase,
            setpoint: ends.setpoint.get(),
            demand: ends.control_output.get(),
            unmet: ends.actuator_motor.get().unmet[3],
        };
        let land_detected = self.manager.step(activation.now(), &input);
        ends.land_detected.publish(activation.now(), &land_detected);
    }
}
