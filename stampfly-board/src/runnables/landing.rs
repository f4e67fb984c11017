//! Take-off and landing manager: the estimate in, contact with the ground out.

use crate::wiring;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::{LandingInput, TakeoffLanding};
use stampfly_types::messages::*;

/// Take-off and landing manager: the estimate in, contact with the ground out.
pub struct LandingManager<'b> {
    ports: LandingPorts<'b>,
    manager: TakeoffLanding,
    estimate: StateEstimate,
    mode: SystemMode,
    setpoint: Setpoint,
    demand: ControlOutput,
}

/// The ends it owns.
pub struct LandingPorts<'b> {
    /// The state.
    pub estimate: wiring::estimate_state::Rx<'b>,
    /// State and mode one step ago.
    pub mode: wiring::system_mode::Rx<'b>,
    /// The path one step ago.
    pub setpoint: wiring::setpoint::Rx<'b>,
    /// The demand one step ago.
    pub demand: wiring::control_output::Rx<'b>,
    /// What was found.
    pub status: wiring::vehicle_status::Tx<'b>,
}

impl<'b> LandingManager<'b> {
    /// A manager of a vehicle that stands.
    #[must_use]
    pub fn new(ports: LandingPorts<'b>) -> Self {
        Self {
            ports,
            manager: TakeoffLanding::default(),
            estimate: StateEstimate::default(),
            mode: SystemMode::default(),
            setpoint: Setpoint::default(),
            demand: ControlOutput::default(),
        }
    }
}

impl Runnable for LandingManager<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.update(&mut self.ports.estimate, &mut self.estimate);
        activation.update(&mut self.ports.mode, &mut self.mode);
        activation.update(&mut self.ports.setpoint, &mut self.setpoint);
        activation.update(&mut self.ports.demand, &mut self.demand);
    }

    fn run(&mut self, activation: &mut Activation) {
        let input = LandingInput {
            estimate: &self.estimate,
            state: self.mode.state,
            setpoint: &self.setpoint,
            demand: &self.demand,
        };
        self.ports.status.publish(activation.now(), &self.manager.step(activation.now(), &input));
    }
}
