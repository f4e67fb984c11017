//! Decides which requester commands the vehicle, and reports every command to all of them.
//!
//! A vehicle implements [`VehicleActions`]: it publishes commands and sticks, gives access to its
//! parameters, and carries out requests to its board. [`ArbitratedAccess`] combines these actions,
//! the [`CommandArbiter`] and the vehicle's newest samples to the [`VehicleAccess`] of one call of a
//! service, in firmware and in simulation alike. The vehicle's end of a radio, which is not a service,
//! calls [`CommandArbiter::guide`], [`steer`](CommandArbiter::steer) and
//! [`alive`](CommandArbiter::alive) directly.

use crate::access::{Request, VehicleAccess, fly_to};
use crate::lease::Lease;
use crate::refusal::{Connection, Refusal, Requester};
use crate::stick_source::{StickSource, Verdict};
use crate::view::View;
use core::fmt;
use stampfly_param::Parameters;
use stampfly_types::messages::{CalibrationKind, FlightStatus, GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Duration, Instant, Origin};

/// The same command of the same program is told once in this time: some say it ten times a second.
const AGAIN: Duration = Duration::from_secs(1);
/// What was asked and not told yet: as much as comes between two turns of a service.
const TELLS: usize = 8;

/// What a vehicle does for its services.
pub trait VehicleActions {
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

    /// Called with every [`CommandArbiter::poll`]: publishes what was changed of the parameters and may be in
    /// use now, takes over what others have changed. Nothing by default.
    fn poll(&mut self, _now: Instant, _armed: bool) {}
}

/// What was asked of the vehicle, and by whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommandNotice {
    /// Who.
    pub requester: Requester,
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
    /// Nothing more: it was not heard for three seconds, and had the lease.
    Silent,
}

impl fmt::Display for CommandNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { requester, what } = self;
        match what {
            Asked::Command(kind) => write!(f, "{requester}: {}", word(*kind)),
            Asked::Sticks => write!(f, "{requester}: flies by hand"),
            Asked::Left => write!(f, "{requester} is gone, none commands"),
            Asked::Silent => write!(f, "{requester} is silent, none commands"),
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

/// What the arbiter passes on to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Passed {
    /// A command.
    Command(GuidedCommand),
    /// Sticks.
    Sticks(PilotInput),
}

/// Where it goes. It says when there is no room.
pub type Pass<'p> = &'p mut dyn FnMut(Passed) -> Result<(), Refusal>;

/// Who commands, and what everybody is told of it.
#[derive(Clone, Debug, Default)]
pub struct CommandArbiter {
    lease: Lease,
    sticks: StickSource,
    /// Who has the lease and was heard, when it was looked last.
    heard: Option<Requester>,
    /// Connections that have come.
    connections: Connection,
    tells: [Option<CommandNotice>; TELLS],
    /// How many there have been.
    told: u32,
    /// When the newest one was asked last.
    asked: Instant,
}

impl CommandArbiter {
    /// No program commands.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            lease: Lease::new(),
            sticks: StickSource::new(),
            heard: None,
            connections: 0,
            tells: [None; TELLS],
            told: 0,
            asked: Instant::ZERO,
        }
    }

    /// Who commands.
    #[must_use]
    pub fn holder(&self, now: Instant) -> Option<Requester> {
        self.lease.holder(now)
    }

    /// Who has taken the lease of this flight and has not left, heard or not.
    #[must_use]
    pub fn commander(&self) -> Option<Requester> {
        self.lease.commander()
    }

    /// Who has taken the lease of this flight, heard or not, there or not.
    #[must_use]
    pub const fn taker(&self) -> Option<Requester> {
        self.lease.taker()
    }

    /// Connections have ended. One that had the lease makes room, and everybody is told.
    pub fn leave(&mut self, has_left: impl Fn(Requester) -> bool) {
        let holder = self.lease.commander();
        self.lease.leave(has_left);
        if let Some(requester) = holder.filter(|_| self.lease.commander().is_none()) {
            self.tell(self.asked, CommandNotice { requester, what: Asked::Left });
        }
    }

    /// What is to be done now and then, whichever programs are connected: call it at least every
    /// 100 ms.
    pub fn poll(&mut self, now: Instant, armed: bool, actions: &mut dyn VehicleActions) {
        self.keep(now, armed, &mut |passed| pass(actions, now, passed));
        actions.poll(now, armed);
    }

    /// The part of [`poll`](Self::poll) that needs no hands: the lease ends with the flight, and the
    /// commander's signs of life are passed on.
    pub fn keep(&mut self, now: Instant, armed: bool, pass: Pass<'_>) {
        self.follow(now, armed);
        if self.lease.is_sign_due(now) {
            // A vehicle whose queue is full hears enough.
            _ = pass(Passed::Command(GuidedCommand::default()));
        }
    }

    fn follow(&mut self, now: Instant, armed: bool) {
        if !armed {
            self.lease.release();
        }
        let holder = self.lease.holder(now);
        let before = core::mem::replace(&mut self.heard, holder);
        // Not a requester that has left, or whose flight is over.
        if holder.is_none()
            && let Some(requester) = self.lease.commander().filter(|requester| before == Some(*requester))
        {
            self.tell(now, CommandNotice { requester, what: Asked::Silent });
        }
    }

    /// A number for a connection that has come.
    pub const fn connection(&mut self) -> Connection {
        self.connections = self.connections.wrapping_add(1);
        self.connections
    }

    /// A command: is passed on, if this requester may give it.
    ///
    /// # Errors
    /// When it may not, a number is none, or there is no room.
    pub fn guide(
        &mut self,
        now: Instant,
        requester: Requester,
        command: GuidedCommand,
        pass: Pass<'_>,
    ) -> Result<(), Refusal> {
        self.lease.ask(now, requester, &command)?;
        pass(Passed::Command(command))?;
        if command.kind != GuidedKind::None {
            self.tell(now, CommandNotice { requester, what: Asked::Command(command.kind) });
        }
        Ok(())
    }

    /// A frame of sticks for a vehicle in this state: is passed on, if this requester may fly it by hand.
    ///
    /// # Errors
    /// When another may, or there is no room. A kill is passed on from every requester, and so is an arm
    /// switch that is turned off, as a command to land.
    pub fn steer(
        &mut self,
        now: Instant,
        requester: Requester,
        input: &PilotInput,
        status: &FlightStatus,
        pass: Pass<'_>,
    ) -> Result<(), Refusal> {
        let verdict = self.sticks.judge(now, requester, input, status, &mut self.lease);
        if input.kill {
            pass(Passed::Sticks(input.cleaned()))?;
            if status.armed {
                self.tell(now, CommandNotice { requester, what: Asked::Command(GuidedKind::Kill) });
            }
            return Ok(());
        }
        match verdict {
            Verdict::Flies | Verdict::Passes => {
                pass(Passed::Sticks(input.cleaned()))?;
                if verdict == Verdict::Flies {
                    self.tell(now, CommandNotice { requester, what: Asked::Sticks });
                }
                Ok(())
            }
            Verdict::Lands(holder) => {
                let land = GuidedCommand { kind: GuidedKind::Land, ..GuidedCommand::default() };
                self.guide(now, requester, land, pass)?;
                Err(Refusal::Occupied(holder))
            }
            Verdict::Refused(holder) => Err(Refusal::Occupied(holder)),
        }
    }

    /// A sign of life. Does it count?
    pub fn alive(&mut self, now: Instant, requester: Requester) -> bool {
        self.lease.alive(now, requester);
        self.lease.is_holders(requester)
    }

    fn tell(&mut self, now: Instant, told: CommandNotice) {
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

    /// What was asked of the vehicle after this number, and by whom. What a service has not looked at
    /// for too long is gone.
    #[must_use]
    pub fn told(&self, after: u32) -> Option<(u32, CommandNotice)> {
        let waiting = self.told.wrapping_sub(after);
        if waiting == 0 {
            return None;
        }
        let place = if waiting as usize > TELLS { self.told.wrapping_sub(TELLS as u32) } else { after };
        let told = self.tells.get(place as usize % TELLS).copied().flatten()?;
        Some((place.wrapping_add(1), told))
    }
}

fn pass(actions: &mut dyn VehicleActions, now: Instant, passed: Passed) -> Result<(), Refusal> {
    match passed {
        Passed::Command(command) => actions.command(now, command),
        Passed::Sticks(input) => actions.sticks(now, &input),
    }
}

/// The vehicle, for one call of a service.
pub struct ArbitratedAccess<'s> {
    /// Who commands.
    pub arbiter: &'s mut CommandArbiter,
    /// What it does.
    pub actions: &'s mut dyn VehicleActions,
    /// What it has published.
    pub view: View<'s>,
}

impl VehicleAccess for ArbitratedAccess<'_> {
    fn view(&self) -> View<'_> {
        self.view
    }

    fn connection(&mut self) -> Connection {
        self.arbiter.connection()
    }

    fn leave(&mut self, has_left: &dyn Fn(Requester) -> bool) {
        self.arbiter.leave(has_left);
    }

    fn told(&self, after: u32) -> Option<(u32, CommandNotice)> {
        self.arbiter.told(after)
    }

    fn guide(&mut self, now: Instant, requester: Requester, command: GuidedCommand) -> Result<(), Refusal> {
        let Self { arbiter, actions, .. } = self;
        arbiter.guide(now, requester, command, &mut |passed| pass(*actions, now, passed))
    }

    fn fly_to(&mut self, now: Instant, requester: Requester, way_point: GuidedCommand) -> Result<(), Refusal> {
        let [hold, way_point] = fly_to(way_point);
        self.arbiter.lease.ask(now, requester, &way_point)?;
        self.actions.command(now, hold)?;
        self.guide(now, requester, way_point)
    }

    fn steer(&mut self, now: Instant, requester: Requester, input: &PilotInput) -> Result<(), Refusal> {
        let Self { arbiter, actions, view } = self;
        arbiter.steer(now, requester, input, &view.state(), &mut |passed| pass(*actions, now, passed))
    }

    fn alive(&mut self, now: Instant, requester: Requester) {
        self.arbiter.alive(now, requester);
    }

    fn parameters(&mut self) -> &mut dyn Parameters {
        self.actions.parameters()
    }

    fn origin(&self) -> Option<Origin> {
        self.actions.origin()
    }

    fn request(&mut self, now: Instant, request: Request) -> Result<(), Refusal> {
        let ends_something = matches!(request, Request::StopMotor | Request::Calibrate(CalibrationKind::None));
        if !ends_something && self.view.state().armed {
            return Err(Refusal::Armed);
        }
        self.actions.request(now, request)
    }
}
