//! What services may ask of the simulated StampFly.

use super::Seen;
use crate::VehicleConfig;
use crate::console::Command;
use crate::simulation::radio::Radio;
use crate::simulation::settings::tell;
use crate::topics::ConsoleEnds;
use stampfly_flight::console;
use stampfly_flight::console::calibrate::Calibrate;
use stampfly_param::{ChangeDetector, Parameters};
use stampfly_services::{Refusal, Request, VehicleActions};
use stampfly_sim::ground::Ground;
use stampfly_types::Instant;
use stampfly_types::messages::{GuidedCommand, PilotInput};

/// What lives as long as the vehicle is on.
pub(super) type Controls<'b> = Ground<Board<'b>>;

/// Its radio, console and flash.
pub(super) struct Board<'b> {
    pub radio: Radio<'b>,
    pub console: ConsoleEnds<'b>,
    /// The configuration of the next start, and of this one as far as runnables hold it, as soon as the vehicle is disarmed.
    pub config: VehicleConfig,
    /// Finds what has changed in it.
    pub detector: ChangeDetector<VehicleConfig>,
    pub seen: &'b Seen,
}

impl VehicleActions for Board<'_> {
    fn command(&mut self, _: Instant, command: GuidedCommand) -> Result<(), Refusal> {
        self.radio.command(command).then_some(()).ok_or(Refusal::Full)
    }

    fn sticks(&mut self, _: Instant, input: &PilotInput) -> Result<(), Refusal> {
        self.radio.sticks(input);
        Ok(())
    }

    fn parameters(&mut self) -> &mut dyn Parameters {
        &mut self.config
    }

    fn request(&mut self, now: Instant, request: Request) -> Result<(), Refusal> {
        let command = match request {
            Request::StopMotor => Command::StopMotor,
            Request::TestMotor { motor, duty } => Command::test(motor, duty).ok_or(Refusal::Range)?,
            Request::SaveParameters => {
                self.seen.kept.replace(Some(self.config.clone()));
                return Ok(());
            }
            Request::Restart => {
                self.seen.restarts.set(true);
                return Ok(());
            }
            Request::Calibrate(kind) => Command::Calibrate(Calibrate::Begin(kind)),
            Request::AcceptCalibration(report) if self.config.corrections.accept(&report) => {
                self.seen.kept.replace(Some(self.config.clone()));
                return Ok(());
            }
            Request::AcceptCalibration(_) => return Err(Refusal::Range),
            _ => return Err(Refusal::Unsupported),
        };
        command.publish(now, &mut self.console);
        Ok(())
    }

    /// Tells what of the parameters has changed, whoever has changed it.
    fn poll(&mut self, now: Instant, _: bool) {
        let Self { detector, config, console, seen, .. } = self;
        tell(now, detector, config, console, &seen.changed);
    }
}

/// What a board would do, as far as a simulated one does it. The console hands it out only while the vehicle is disarmed.
pub(super) fn obey(request: &console::Request<Command>, seen: &Seen, config: &VehicleConfig) -> &'static str {
    match request {
        console::Request::SaveParameters => {
            seen.kept.replace(Some(config.clone()));
            "saved, for the next start"
        }
        console::Request::ResetParameters => {
            seen.kept.replace(Some(VehicleConfig::default()));
            "erased; the next start has the vehicle's own"
        }
        console::Request::Reboot => {
            seen.restarts.set(true);
            "restarting"
        }
        _ => "not of a simulated vehicle",
    }
}
