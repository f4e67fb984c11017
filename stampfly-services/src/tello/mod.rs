//! The text commands of a Tello, carried out and answered, and the state that programs listen for.
//!
//! As a Tello does it: a program says `command`, then commands are answered with `ok` when they have been carried out, and the state
//! is sent to the program ten times a second. A program that says nothing for fifteen seconds has gone; its vehicle loses its
//! link, and what it does then is the failsafe's business.
//!
//! | file | what it does |
//! |---|---|
//! | `action.rs` | what takes its time: taking off, landing, moving, turning |
//! | `answers.rs` | questions, and the state |
//! | `burst.rs` | whether what comes now was held up on its way |
//!
//! A datagram has no time. What lay in a queue of this machine for more than a second, and what comes
//! with many sticks in one moment after a silence, is answered `error expired` and not done; `emergency`, `land` and `stop`
//! are, and questions are answered.
//!
//! One program at a time: the last that said `command`. `emergency`, `land` and `stop` interrupt what goes on; anything else waits for nothing and is answered `error busy`.

mod action;
mod answers;
mod burst;

use crate::access::VehicleAccess;
use crate::refusal::{Connection, Requester};
use action::{Action, Outcome};
use burst::Burst;
use stampfly_link::tello::{TelloCommand, TelloReply, TelloState};
use stampfly_types::messages::{FlightMode, GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Duration, Instant};

/// Without a command for this long, a Tello lands.
const SILENCE: Duration = Duration::from_secs(15);
/// Between two states.
const STATE: Duration = Duration::from_millis(100);
/// Sticks that do not come again are centred after this long: a program sends them ten times a second at least.
const STICKS: Duration = Duration::from_millis(500);
/// For so long they are centred first: a pilot takes over who moves the sticks, and those that a
/// program begins with never moved.
const CENTRED: Duration = Duration::from_millis(100);
/// A move that is asked for while sticks are out of their centre waits this long, until the program
/// has the vehicle again: sticks end the route that they find.
const LETS_GO: Duration = Duration::from_millis(100);
/// Speed of moves without one of their own, m/s, as a Tello's.
const SPEED: f32 = 0.5;

/// Where a datagram goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Destination {
    /// To the program's port, from which it asked.
    Program,
    /// To the port of the program's machine where states are heard.
    State,
}

/// The vehicle's end of a Tello's conversation. `C` tells programs apart: an address.
///
/// Give it datagrams with [`hear`](Self::hear) and call [`poll`](Self::poll) about fifty times a second.
#[derive(Clone, Debug)]
pub struct Tello<C> {
    /// Who commands, since when at which connection, and when it was last heard.
    program: Option<(C, Instant)>,
    burst: Burst,
    connection: Connection,
    action: Option<Action>,
    speed: f32,
    /// Sticks as they were last sent, and when; and when the first of them were.
    sticks: Option<(Instant, PilotInput)>,
    sticks_begun: Instant,
    /// What is begun when the sticks are let go, and since when it waits.
    waits: Option<(Instant, TelloCommand)>,
    next_state: Instant,
    /// Since when the motors are on, and how long they were when they went off.
    took_off: Option<Instant>,
    in_air: Duration,
}

/// Where datagrams go.
type Put<'p, C> = &'p mut dyn FnMut(&C, Destination, &[u8]);

impl<C> Default for Tello<C> {
    fn default() -> Self {
        Self::new()
    }
}

impl<C> Tello<C> {
    /// Nobody has said anything.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            program: None,
            burst: Burst::new(Instant::ZERO),
            connection: 0,
            action: None,
            speed: SPEED,
            sticks: None,
            sticks_begun: Instant::ZERO,
            waits: None,
            next_state: Instant::ZERO,
            took_off: None,
            in_air: Duration::ZERO,
        }
    }
}

impl<C: Copy + PartialEq> Tello<C> {
    const fn requester(&self) -> Requester {
        Requester::Tello(self.connection)
    }

    /// Takes a datagram.
    pub fn hear(&mut self, now: Instant, from: C, datagram: &[u8], access: &mut dyn VehicleAccess, put: Put<'_, C>) {
        self.hear_any(now, from, false, datagram, access, put);
    }

    /// Takes a datagram that lay in the caller's queue for more than a second.
    pub fn hear_late(
        &mut self,
        now: Instant,
        from: C,
        datagram: &[u8],
        access: &mut dyn VehicleAccess,
        put: Put<'_, C>,
    ) {
        self.hear_any(now, from, true, datagram, access, put);
    }

    fn hear_any(
        &mut self,
        now: Instant,
        from: C,
        lay: bool,
        datagram: &[u8],
        access: &mut dyn VehicleAccess,
        put: Put<'_, C>,
    ) {
        let mut say = |reply: TelloReply<'_>| send(&from, &reply, put);
        let command = match TelloCommand::parse(datagram) {
            Ok(command) => command,
            Err(error) => return say(TelloReply::Refused(error)),
        };
        let is_program = self.program.is_some_and(|(program, _)| program == from);
        let is_sticks = matches!(command, TelloCommand::Sticks { .. });
        let is_held = is_program && self.burst.hear(now, is_sticks);
        if (lay || is_held) && !is_never_late(&command) {
            if is_sticks {
                // Those before it are as old. A stranger's are nothing.
                return if is_program {
                    self.let_go(now, access)
                };
            }
            return say(TelloReply::Error("expired"));
        }
        if command == TelloCommand::Command {
            let taken = self.program.filter(|(program, heard)| *program != from && now.since(*heard) < SILENCE);
            if taken.is_some() {
                return say(TelloReply::Error("another program commands"));
            }
            if !is_program {
                self.waits = None;
                let before = self.requester();
                access.leave(&|requester| requester == before);
                self.connection = access.connection();
            }
            self.program = Some((from, now));
            self.burst = Burst::new(now);
            return say(TelloReply::Ok);
        }
        // Motors off is everybody's.
        if command == TelloCommand::Emergency {
            (self.action, self.waits) = (None, None);
            let killed =
                access.guide(now, self.requester(), GuidedCommand { kind: GuidedKind::Kill, ..Default::default() });
            return say(if killed.is_ok() { TelloReply::Ok } else { TelloReply::Error("not taken") });
        }
        if !is_program {
            return say(TelloReply::Error("say command first"));
        }
        self.program = Some((from, now));
        access.alive(now, self.requester());
        match command {
            TelloCommand::KeepAlive => say(TelloReply::Ok),
            TelloCommand::Speed { speed } => {
                self.speed = speed;
                say(TelloReply::Ok);
            }
            TelloCommand::Query(query) => say(answers::answer(query, self.speed, self.in_air, &access.view())),
            // Not answered, as a Tello does not.
            TelloCommand::Sticks { right, forward, up, clockwise } => {
                let input = PilotInput {
                    roll: right,
                    pitch: forward,
                    throttle: up,
                    yaw: clockwise,
                    mode: FlightMode::PosHold,
                    arm: access.view().state().armed,
                    kill: false,
                };
                let centred = input.roll == 0.0 && input.pitch == 0.0 && input.throttle == 0.0 && input.yaw == 0.0;
                // Programs that do not fly by hand send centred sticks to be sure: they take nothing over.
                if self.sticks.is_some() || !centred {
                    self.sticks_begun = if self.sticks.is_some() { self.sticks_begun } else { now };
                    self.sticks = Some((now, input));
                }
            }
            command => self.begin(now, &from, command, access, put),
        }
    }

    /// Begins what takes its time.
    fn begin(
        &mut self,
        now: Instant,
        from: &C,
        command: TelloCommand,
        access: &mut dyn VehicleAccess,
        put: Put<'_, C>,
    ) {
        let interrupts = matches!(command, TelloCommand::Stop | TelloCommand::Land);
        if self.action.is_some() || self.waits.is_some() {
            if !interrupts {
                return send(from, &TelloReply::Error("busy"), put);
            }
            (self.action, self.waits) = (None, None);
            send(from, &TelloReply::Error("interrupted"), put);
        }
        if self.sticks.is_some() && !interrupts {
            self.let_go(now, access);
            self.waits = Some((now, command));
            return;
        }
        self.sticks = None;
        match Action::begin(now, self.requester(), command, self.speed, access) {
            Ok(Some(action)) => self.action = Some(action),
            Ok(None) => send(from, &TelloReply::Ok, put),
            Err(why) => send(from, &TelloReply::Error(why), put),
        }
    }

    /// Goes on with what takes its time, and sends the state. Call it about fifty times a second.
    pub fn poll(&mut self, now: Instant, access: &mut dyn VehicleAccess, put: Put<'_, C>) {
        let status = access.view().state();
        self.took_off = self.took_off.filter(|_| status.armed).or_else(|| status.armed.then_some(now));
        self.in_air = self.took_off.map_or(self.in_air, |took_off| now.since(took_off));
        let Some((program, heard)) = self.program else { return };
        if now.since(heard) >= SILENCE {
            // It may be there, and wait for what it has asked for.
            if self.action.take().is_some() || self.waits.take().is_some() {
                send(&program, &TelloReply::Error("no command for 15 s"), put);
            }
            self.sticks = None;
            return;
        }
        access.alive(now, self.requester());
        if let Some((_, command)) = self.waits.take_if(|(since, _)| now.since(*since) >= LETS_GO) {
            self.begin(now, &program, command, access, put);
        }
        let requester = self.requester();
        if let Some(action) = &mut self.action {
            let outcome = action.go_on(now, requester, access);
            let reply = match outcome {
                Outcome::GoesOn => None,
                Outcome::Done => Some(TelloReply::Ok),
                Outcome::Failed(why) => Some(TelloReply::Error(why)),
            };
            if let Some(reply) = reply {
                self.action = None;
                send(&program, &reply, put);
            }
        }
        self.fly_by_hand(now, access);
        if now >= self.next_state {
            self.next_state = now + STATE;
            let state = answers::state(self.in_air, &access.view());
            let mut line = [0; TelloState::LONGEST];
            if let Some(line) = state.write(&mut line).and_then(|length| line.get(..length)) {
                put(&program, Destination::State, line);
            }
        }
    }

    /// The vehicle holds its place under the program's command, if it was flown by sticks.
    fn let_go(&mut self, now: Instant, access: &mut dyn VehicleAccess) {
        if self.sticks.take().is_some() {
            _ = access.guide(now, self.requester(), GuidedCommand { kind: GuidedKind::Hold, ..Default::default() });
        }
    }

    /// Passes on the sticks. When they stop coming, the vehicle holds its place under the program's command again.
    fn fly_by_hand(&mut self, now: Instant, access: &mut dyn VehicleAccess) {
        let Some((at, input)) = self.sticks else { return };
        if now.since(at) < STICKS {
            let centred = PilotInput { mode: input.mode, ..PilotInput::default() };
            let input = if now.since(self.sticks_begun) > CENTRED { input } else { centred };
            _ = access.steer(now, self.requester(), &PilotInput { arm: access.view().state().armed, ..input });
        } else {
            self.let_go(now, access);
        }
    }
}

/// Is it done whatever its age? What ends a flight or a move is; a question does nothing.
const fn is_never_late(command: &TelloCommand) -> bool {
    matches!(command, TelloCommand::Emergency | TelloCommand::Land | TelloCommand::Stop | TelloCommand::Query(_))
}

fn send<C>(to: &C, reply: &TelloReply<'_>, put: Put<'_, C>) {
    let mut bytes = [0; 2 * TelloReply::LONGEST];
    if let Some(text) = reply.write(&mut bytes).and_then(|length| bytes.get(..length)) {
        put(to, Destination::Program, text);
    }
}
