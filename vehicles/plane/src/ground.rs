//! What programs at the other end of the link may do: command it, change its parameters, ask where home is.

use crate::parameters::Parameters;
use crate::topics::{COUNT, LinkEnds, TOPICS};
use stampfly_fixed_wing::messages::Home;
use stampfly_flight::newest::{NewestSamples, longest_message};
use stampfly_param::{Parameters as ByNumber, RequestedParameters};
use stampfly_services::{Refusal, Request, VehicleActions};
use stampfly_types::messages::{GuidedCommand, PilotInput};
use stampfly_types::{Instant, Origin};

/// The newest sample of every topic.
pub type Newest = NewestSamples<COUNT, { longest_message(&TOPICS) }>;

/// The aircraft's end of the link. It is flown by commands alone: there are no sticks.
pub struct Board<'b> {
    parameters: RequestedParameters<Parameters, 64>,
    /// As a new vehicle has them.
    defaults: Parameters,
    home: Home,
    ends: LinkEnds<'b>,
}

impl<'b> Board<'b> {
    /// With the parameters at power-on, and those of a new vehicle.
    #[must_use]
    pub fn new(parameters: &Parameters, defaults: &Parameters, ends: LinkEnds<'b>) -> Self {
        Self { parameters: RequestedParameters::new(*parameters), defaults: *defaults, home: Home::default(), ends }
    }
}

impl VehicleActions for Board<'_> {
    fn command(&mut self, now: Instant, command: GuidedCommand) -> Result<(), Refusal> {
        self.ends.command_guided.publish(now, command).map(|_| ()).map_err(|_| Refusal::Full)
    }

    fn sticks(&mut self, _: Instant, _: &PilotInput) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }

    fn parameters(&mut self) -> &mut dyn ByNumber {
        &mut self.parameters
    }

    fn origin(&self) -> Option<Origin> {
        self.home.origin()
    }

    fn request(&mut self, _: Instant, request: Request) -> Result<(), Refusal> {
        match request {
            Request::ResetParameters => Ok(self.parameters.set_all(&self.defaults)?),
            _ => Err(Refusal::Unsupported),
        }
    }

    /// Changes of an armed aircraft wait until it is disarmed.
    fn poll(&mut self, now: Instant, armed: bool) {
        let Self { parameters, ends, home, .. } = self;
        if let Some(newest) = ends.home.has_new().then(|| ends.home.latest()).flatten() {
            *home = newest.data;
        }
        if !armed {
            parameters.send(|request| ends.parameter_request.publish(now, request).is_ok());
        }
        if let Some(newest) = ends.parameters.has_new().then(|| ends.parameters.latest()).flatten() {
            parameters.adopt(newest.data);
        }
    }
}
