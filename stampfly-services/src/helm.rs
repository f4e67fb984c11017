//! The part of a [`Cockpit`] that is the same for every vehicle: who commands, and who has the sticks.
//!
//! A vehicle implements [`Hands`]: how its commands and sticks are published, where its parameters are, what its board does. [`Seated`] is its cockpit for one
//! call of a service, in firmware and in simulation alike.

use crate::cockpit::{Cockpit, Request};
use crate::lease::Lease;
use crate::refusal::{Refusal, Seat};
use crate::view::View;
use stampfly_flight::parameters::Parameters;
use stampfly_types::messages::{CalibrationKind, GuidedCommand, PilotInput};
use stampfly_types::{Duration, Instant, Origin};

/// A transmitter that was not heard for this long is off; then somebody else may take the sticks.
const TRANSMITTER: Duration = Duration::from_millis(500);

/// What a vehicle does for its services.
pub trait Hands {
    /// Publishes a command.
    ///
    /// # Errors
    /// [`Refusal::Full`] when there is no room for it, [`Refusal::Unsupported`] of a vehicle that takes commands from its transmitter alone.
    fn command(&mut self, now: Instant, command: GuidedCommand) -> Result<(), Refusal>;

    /// Publishes sticks.
    ///
    /// # Errors
    /// [`Refusal::Unsupported`] of a vehicle that has no other sticks than its transmitter's.
    fn sticks(&mut self, now: Instant, input: &PilotInput) -> Result<(), Refusal>;

    /// The configuration of the next start.
    fn parameters(&mut self) -> &mut dyn Parameters;

    /// Where on Earth its local frame begins, if the vehicle itself knows. It does not by default.
    fn origin(&self) -> Option<Origin> {
        None
    }

    /// What a board does. An armed vehicle is asked for nothing but to stop a motor, or to end a calibration.
    ///
    /// # Errors
    /// When it does not do that, or not with these numbers.
    fn request(&mut self, now: Instant, request: Request) -> Result<(), Refusal>;

    /// Called with every [`Helm::poll`]: publishes what was changed of the parameters and may be in use now, takes over what others have changed. Nothing by default.
    fn poll(&mut self, _now: Instant, _armed: bool) {}
}

/// Who commands, and who has the sticks.
#[derive(Clone, Debug, Default)]
pub struct Helm {
    lease: Lease,
    /// Who has the sticks, and when they were last heard.
    sticks: Option<(Seat, Instant)>,
}

impl Helm {
    /// Nobody.
    #[must_use]
    pub const fn new() -> Self {
        Self { lease: Lease::new(), sticks: None }
    }

    /// What is to be done now and then, whoever is connected: call it at least every 100 ms.
    pub fn poll(&mut self, now: Instant, armed: bool, hands: &mut dyn Hands) {
        if !armed {
            self.lease.release();
        }
        if self.lease.is_sign_due(now) {
            // A vehicle whose queue is full hears enough.
            _ = hands.command(now, GuidedCommand::default());
        }
        hands.poll(now, armed);
    }
}

/// The vehicle, for one call of a service.
pub struct Seated<'s> {
    /// Who commands.
    pub helm: &'s mut Helm,
    /// What it does.
    pub hands: &'s mut dyn Hands,
    /// What it has published.
    pub view: View<'s>,
}

impl Cockpit for Seated<'_> {
    fn view(&self) -> View<'_> {
        self.view
    }

    fn guide(&mut self, now: Instant, seat: Seat, command: GuidedCommand) -> Result<(), Refusal> {
        self.helm.lease.ask(now, seat, &command)?;
        self.hands.command(now, command)
    }

    fn steer(&mut self, now: Instant, seat: Seat, input: &PilotInput) -> Result<(), Refusal> {
        let other = self.helm.sticks.filter(|(other, at)| *other != seat && now.since(*at) < TRANSMITTER);
        // A kill is everybody's.
        if other.is_some() && !input.kill {
            return Err(Refusal::PilotFlies);
        }
        if other.is_none() {
            self.helm.sticks = Some((seat, now));
        }
        self.hands.sticks(now, &input.cleaned())
    }

    fn alive(&mut self, now: Instant, seat: Seat) {
        self.helm.lease.alive(now, seat);
    }

    fn parameters(&mut self) -> &mut dyn Parameters {
        self.hands.parameters()
    }

    fn origin(&self) -> Option<Origin> {
        self.hands.origin()
    }

    fn request(&mut self, now: Instant, request: Request) -> Result<(), Refusal> {
        let ends_something = matches!(request, Request::StopMotor | Request::Calibrate(CalibrationKind::None));
        if !ends_something && self.view.state().armed {
            return Err(Refusal::Armed);
        }
        self.hands.request(now, request)
    }
}
