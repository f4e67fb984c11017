//! What services see of the simulated StampFly, and what they may ask of it.

use super::Seen;
use crate::VehicleConfig;
use crate::console::{Command, Newest, TEST_DUTY};
use crate::simulation::radio::Radio;
use crate::topics::ConsoleEnds;
use stampfly_flight::parameters::Parameters;
use stampfly_services::{Cockpit, Lease, Places, Refusal, Request, Seat, View};
use stampfly_types::messages::{GuidedCommand, PilotInput};
use stampfly_types::{Duration, Instant};

/// A transmitter that was not heard for this long is off; then somebody else may take the sticks.
const TRANSMITTER: Duration = Duration::from_millis(500);

/// What lives as long as the vehicle is on.
pub(super) struct Controls<'b> {
    pub radio: Radio<'b>,
    pub console: ConsoleEnds<'b>,
    pub lease: Lease,
    pub places: Places,
    /// The configuration of the next start.
    pub config: VehicleConfig,
    /// Who has the sticks, and when they were last heard.
    pub sticks: Option<(Seat, Instant)>,
}

impl Controls<'_> {
    /// What is to be done now and then, whoever is connected.
    pub fn poll(&mut self, now: Instant, newest: &Newest) {
        if !View::new(newest, &self.places).state().armed {
            self.lease.release();
        }
        if self.lease.is_sign_due(now) {
            // A vehicle whose queue is full hears enough.
            _ = self.radio.command(GuidedCommand::default());
        }
    }
}

/// The vehicle, for one call of a service.
pub(super) struct Seats<'s, 'b> {
    pub controls: &'s mut Controls<'b>,
    pub newest: &'s Newest,
    pub seen: &'s Seen,
}

impl Cockpit for Seats<'_, '_> {
    fn view(&self) -> View<'_> {
        View::new(self.newest, &self.controls.places)
    }

    fn guide(&mut self, now: Instant, seat: Seat, command: GuidedCommand) -> Result<(), Refusal> {
        self.controls.lease.ask(now, seat, &command)?;
        if self.controls.radio.command(command) { Ok(()) } else { Err(Refusal::Full) }
    }

    fn steer(&mut self, now: Instant, seat: Seat, input: &PilotInput) -> Result<(), Refusal> {
        let other = self.controls.sticks.filter(|(other, at)| *other != seat && now.since(*at) < TRANSMITTER);
        // A kill is everybody's.
        if other.is_some() && !input.kill {
            return Err(Refusal::PilotFlies);
        }
        if other.is_none() {
            self.controls.sticks = Some((seat, now));
        }
        self.controls.radio.sticks(&input.cleaned());
        Ok(())
    }

    fn alive(&mut self, now: Instant, seat: Seat) {
        self.controls.lease.alive(now, seat);
    }

    fn parameters(&mut self) -> &mut dyn Parameters {
        &mut self.controls.config
    }

    fn request(&mut self, now: Instant, request: Request) -> Result<(), Refusal> {
        let command = match request {
            Request::StopMotor => Command::StopMotor,
            _ if self.view().state().armed => return Err(Refusal::Armed),
            Request::TestMotor { motor: motor @ 1..=4, duty } if (0.0..=TEST_DUTY).contains(&duty) => {
                Command::TestMotor { motor, duty }
            }
            Request::TestMotor { .. } => return Err(Refusal::Range),
            Request::SaveParameters => {
                self.seen.kept.replace(Some(self.controls.config.clone()));
                return Ok(());
            }
            Request::Restart => {
                self.seen.restarts.set(true);
                return Ok(());
            }
            _ => return Err(Refusal::Unsupported),
        };
        command.publish(now, &mut self.controls.console);
        Ok(())
    }
}
