//! The part of a [`Cockpit`] that is the same for every vehicle: who commands, and what everybody
//! is told of it.
//!
//! A vehicle implements [`Hands`]: how its commands and sticks are published, where its parameters
//! are, what its board does. [`Seated`] is its cockpit for one call of a service, in firmware and
//! in simulation alike.

use crate::cockpit::{Cockpit, Request, fly_to};
use crate::lease::Lease;
use crate::refusal::{Connection, Refusal, Seat};
use crate::view::View;
use core::fmt;
use stampfly_flight::parameters::Parameters;
use stampfly_types::messages::{CalibrationKind, GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Duration, Instant, Origin};

/// The same command of the same program is told once in this time: some say it ten times a second.
const AGAIN: Duration = Duration::from_secs(1);
/// What was asked and not told yet: as much as comes between two turns of a service.
const TELLS: usize = 8;

/// What a vehicle does for its services.
pub trait Hands {
    /// Publishes a command.
    ///
    /// # Errors
    /// [`Refusal::Full`] when there is no room for it, [`Refusal::Unsupported`] of a vehicle that
    /// takes commands from its transmitter alone.
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

    /// What a board does. An armed vehicle is asked for nothing but to stop a motor, or to end a
    /// calibration.
    ///
    /// # Errors
    /// When it does not do that, or not with these numbers.
    fn request(&mut self, now: Instant, request: Request) -> Result<(), Refusal>;

    /// Called with every [`Helm::poll`]: publishes what was changed of the parameters and may be in
    /// use now, takes over what others have changed. Nothing by default.
    fn poll(&mut self, _now: Instant, _armed: bool) {}
}

/// What was asked of the vehicle, and by whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Told {
    /// Who.
    pub seat: Seat,
    /// What.
    pub what: Asked,
}

/// What was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// A command.
    Command(GuidedKind),
    /// To fly by its sticks.
    Sticks,
    /// Nothing more: it is gone, and had the lease.
    Left,
}

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seat, what } = self;
        match what {
            Asked::Command(kind) => write!(f, "{seat}: {}", word(*kind)),
            Asked::Sticks => write!(f, "{seat}: flies by hand"),
            Asked::Left => write!(f, "{seat} is gone, none commands"),
        }
    }
}

const fn word(kind: GuidedKind) -> &'static str {
    match kind {
        GuidedKind::None => "is there",
        GuidedKind::Arm => "arm",
        GuidedKind::Disarm => "disarm",
        GuidedKind::TakeOff => "take off",
        GuidedKind::WayPoint => "go there",
        GuidedKind::Hold => "hold",
        GuidedKind::Land => "land",
        GuidedKind::Kill => "KILL",
        GuidedKind::FlipLeft | GuidedKind::FlipRight | GuidedKind::FlipForward | GuidedKind::FlipBack => "flip",
        GuidedKind::AutotuneRoll | GuidedKind::AutotunePitch | GuidedKind::AutotuneYaw => "autotune",
    }
}

/// Who commands, and what everybody is told of it.
#[derive(Clone, Debug, Default)]
pub struct Helm {
    lease: Lease,
    /// Connections that have come.
    connections: Connection,
    tells: [Option<Told>; TELLS],
    /// How many there have been.
    told: u32,
    /// When the newest one was asked last.
    asked: Instant,
}

impl Helm {
    /// No program commands.
    #[must_use]
    pub const fn new() -> Self {
        Self { lease: Lease::new(), connections: 0, tells: [None; TELLS], told: 0, asked: Instant::ZERO }
    }

    /// Who commands.
    #[must_use]
    pub fn holder(&self, now: Instant) -> Option<Seat> {
        self.lease.holder(now)
    }

    /// What is to be done now and then, whichever programs are connected: call it at least every
    /// 100 ms.
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

    fn tell(&mut self, now: Instant, told: Told) {
        let newest = self.tells.get((self.told as usize).wrapping_sub(1) % TELLS).copied().flatten();
        let is_new = newest != Some(told) || now.since(self.asked) >= AGAIN;
        self.asked = now;
        if is_new {
            if let Some(place) = self.tells.get_mut(self.told as usize % TELLS) {
                *place = Some(told);
            }
            self.told = self.told.wrapping_add(1);
        }
    }

    /// What comes after this number. What a service has not looked at for too long is gone.
    fn told(&self, after: u32) -> Option<(u32, Told)> {
        let waiting = self.told.wrapping_sub(after);
        if waiting == 0 {
            return None;
        }
        let place = if waiting as usize > TELLS { self.told.wrapping_sub(TELLS as u32) } else { after };
        let told = self.tells.get(place as usize % TELLS).copied().flatten()?;
        Some((place.wrapping_add(1), told))
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

    fn connection(&mut self) -> Connection {
        self.helm.connections = self.helm.connections.wrapping_add(1);
        self.helm.connections
    }

    fn leave(&mut self, has_left: &dyn Fn(Seat) -> bool) {
        let holder = self.helm.lease.commander();
        self.helm.lease.leave(has_left);
        if let Some(seat) = holder.filter(|_| self.helm.lease.commander().is_none()) {
            let at = self.helm.asked;
            self.helm.tell(at, Told { seat, what: Asked::Left });
        }
    }

    fn told(&self, after: u32) -> Option<(u32, Told)> {
        self.helm.told(after)
    }

    fn guide(&mut self, now: Instant, seat: Seat, command: GuidedCommand) -> Result<(), Refusal> {
        self.helm.lease.ask(now, seat, &command)?;
        self.hands.command(now, command)?;
        if command.kind != GuidedKind::None {
            self.helm.tell(now, Told { seat, what: Asked::Command(command.kind) });
        }
        Ok(())
    }

    fn fly_to(&mut self, now: Instant, seat: Seat, way_point: GuidedCommand) -> Result<(), Refusal> {
        let [hold, way_point] = fly_to(way_point);
        self.helm.lease.ask(now, seat, &way_point)?;
        self.hands.command(now, hold)?;
        self.guide(now, seat, way_point)
    }

    fn steer(&mut self, now: Instant, seat: Seat, input: &PilotInput) -> Result<(), Refusal> {
        // A kill is everybody's.
        if !input.kill {
            self.helm.lease.steer(now, seat)?;
        }
        self.hands.sticks(now, &input.cleaned())?;
        if self.view.state().armed {
            let what = if input.kill { Asked::Command(GuidedKind::Kill) } else { Asked::Sticks };
            self.helm.tell(now, Told { seat, what });
        }
        Ok(())
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
