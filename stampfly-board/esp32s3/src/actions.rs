//! What services do with this vehicle: commands and sticks go through the radio's [`Link`], everything else to the console's topics and tasks.

use core::cell::RefCell;
use stampfly_board::VehicleConfig;
use stampfly_board::console::Command;
use stampfly_board::link::Link;
use stampfly_board::topics::ConsoleEnds;
use stampfly_flight::console::calibrate::Calibrate;
use stampfly_param::Parameters;
use stampfly_services::{Refusal, Request, VehicleActions as Vehicle};
use stampfly_types::Instant;
use stampfly_types::messages::{GuidedCommand, PilotInput};

/// What takes longer than a service may wait: the console does it next, if the vehicle is disarmed then.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Later {
    /// Keep the parameters.
    Save,
    /// Restart.
    Restart,
}

/// The vehicle, for one call of a service.
pub struct VehicleActions<'c> {
    pub link: &'static RefCell<Link<'static>>,
    pub ends: &'c mut ConsoleEnds<'static>,
    /// The configuration of the next start.
    pub config: &'c mut VehicleConfig,
    /// What was asked for.
    pub later: &'c mut Option<Later>,
}

impl Vehicle for VehicleActions<'_> {
    fn command(&mut self, now: Instant, command: GuidedCommand) -> Result<(), Refusal> {
        self.link.borrow_mut().command(now, command).then_some(()).ok_or(Refusal::Full)
    }

    fn sticks(&mut self, now: Instant, input: &PilotInput) -> Result<(), Refusal> {
        self.link.borrow_mut().sticks(now, input);
        Ok(())
    }

    fn parameters(&mut self) -> &mut dyn Parameters {
        self.config
    }

    fn request(&mut self, now: Instant, request: Request) -> Result<(), Refusal> {
        let command = match request {
            Request::StopMotor => Command::StopMotor,
            Request::TestMotor { motor, duty } => Command::test(motor, duty).ok_or(Refusal::Range)?,
            Request::SaveParameters => {
                *self.later = Some(Later::Save);
                return Ok(());
            }
            Request::Restart => {
                *self.later = Some(Later::Restart);
                return Ok(());
            }
            Request::Calibrate(kind) => Command::Calibrate(Calibrate::Begin(kind)),
            Request::AcceptCalibration(report) if self.config.corrections.accept(&report) => {
                *self.later = Some(Later::Save);
                return Ok(());
            }
            Request::AcceptCalibration(_) => return Err(Refusal::Range),
            _ => return Err(Refusal::Unsupported),
        };
        command.publish(now, self.ends);
        Ok(())
    }
}
