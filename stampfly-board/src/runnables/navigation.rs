//! Navigator: commands and state in, the vehicle's path out.

use super::command::present;
use crate::config::VehicleConfig;
use crate::topics::NavigationEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::guidance::{Navigator, NavigatorInput};

/// Navigator: commands and state in, the vehicle's path out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Navigation {
    navigator: Navigator,
}

impl Navigation {
    /// Without a route.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self { navigator: Navigator::new(&config.navigator) }
    }
}

impl Runnable for Navigation {
    type Ends<'b> = NavigationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut NavigationEnds<'_>) {
        for command in ends.command_guided.iter() {
            // The navigator counts a refusal; the sender sees it in `remaining`.
            let _ = self.navigator.accept(&command.data);
        }
        let command = present(ends.command_setpoint.sample(), activation.now());
        let input = NavigatorInput {
            flight_status: ends.flight_status.get(),
            estimate: ends.estimate_state.get(),
            land_detected: ends.land_detected.get(),
            command: &command,
        };
        let setpoint = self.navigator.step(activation.now(), &input);
        ends.setpoint.publish(activation.now(), &setpoint);
    }
}
