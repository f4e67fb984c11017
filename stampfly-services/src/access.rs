//! The interface between a service and a vehicle: newest samples, commands, parameters, requests.
//!
//! A vehicle implements [`VehicleAccess`] on a struct that borrows its newest samples, the publishers
//! of its commands and its parameters; [`ArbitratedAccess`](crate::ArbitratedAccess) is the
//! implementation of all vehicles here. A [`Refusal`] means that a command did not reach the vehicle.
//! A command that did may still be refused by the mode machine, which shows in the
//! [`view`](VehicleAccess::view).

use crate::arbiter::CommandNotice;
use crate::lease::is_sane;
use crate::refusal::{Connection, Refusal, Requester};
use crate::view::View;
use stampfly_param::Parameters;
use stampfly_types::Instant;
use stampfly_types::Origin;
use stampfly_types::messages::{CalibrationKind, CalibrationReport, GuidedCommand, GuidedKind, PilotInput};

/// What a board does for a disarmed vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Request {
    /// Keep the parameters over a restart.
    SaveParameters,
    /// Give every parameter its default.
    ResetParameters,
    /// Look for a transmitter that binds.
    Bind,
    /// Turn one motor for a moment.
    TestMotor {
        /// From 1.
        motor: u8,
        /// Share of the full duty.
        duty: f32,
    },
    /// Stop a motor test.
    StopMotor,
    /// Restart, with the parameters that were kept.
    Restart,
    /// Begin a calibration; [`CalibrationKind::None`] ends the one that is under way.
    Calibrate(CalibrationKind),
    /// Take what a calibration has found as parameters, and keep them.
    AcceptCalibration(CalibrationReport),
}

/// The two commands that go to a place at once: the first forgets the route.
pub(crate) fn fly_to(way_point: GuidedCommand) -> [GuidedCommand; 2] {
    let hold = GuidedCommand { kind: GuidedKind::Hold, ..Default::default() };
    [hold, GuidedCommand { kind: GuidedKind::WayPoint, ..way_point }]
}

/// A vehicle, as services see it.
pub trait VehicleAccess {
    /// What it has published.
    fn view(&self) -> View<'_>;

    /// A number for a connection that has come. No other that is there has it.
    fn connection(&mut self) -> Connection;

    /// A connection has ended, or a page is gone: these do not sit there any more.
    fn leave(&mut self, has_left: &dyn Fn(Requester) -> bool);

    /// What was asked of the vehicle after this number, and by whom: to be told to everybody. Begin
    /// with 0.
    fn told(&self, _after: u32) -> Option<(u32, CommandNotice)> {
        None
    }

    /// Asks for something.
    ///
    /// # Errors
    /// When it does not get to the mode machine.
    fn guide(&mut self, now: Instant, requester: Requester, command: GuidedCommand) -> Result<(), Refusal>;

    /// Forgets the route, and goes to a place.
    ///
    /// # Errors
    /// When it does not get to the mode machine.
    fn fly_to(&mut self, now: Instant, requester: Requester, way_point: GuidedCommand) -> Result<(), Refusal> {
        // A place that is none must not cost the route.
        if !is_sane(&way_point) {
            return Err(Refusal::Range);
        }
        let [hold, way_point] = fly_to(way_point);
        self.guide(now, requester, hold)?;
        self.guide(now, requester, way_point)
    }

    /// Hands over a frame of sticks and switches, as a transmitter would.
    ///
    /// # Errors
    /// When another program commands.
    fn steer(&mut self, now: Instant, requester: Requester, input: &PilotInput) -> Result<(), Refusal>;

    /// A sign of life of who sits there: what keeps the vehicle from taking its link for lost.
    fn alive(&mut self, now: Instant, requester: Requester);

    /// Its parameters.
    fn parameters(&mut self) -> &mut dyn Parameters;

    /// Where on Earth its local frame begins, if the vehicle itself knows.
    fn origin(&self) -> Option<Origin> {
        None
    }

    /// Asks the board for something. A vehicle does none of it unless it says so.
    ///
    /// # Errors
    /// When it is armed, or does not do that.
    fn request(&mut self, _now: Instant, _request: Request) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }
}
