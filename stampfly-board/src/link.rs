//! The vehicle's end of the radio: frames in, sticks and commands on the bus; telemetry and calls out.
//!
//! Everything but moving the bytes: firmware, which has the radio, gives [`Link`] what it has received and sends what [`Link::transmit`] returns. Stations with the vehicle's key speak in sealed frames,
//! others, where the configuration lets them, in the ecosystem's packets. The link follows `flight_status`, and publishes the transmitter it is paired with.
//!
//! Who commands is the [`CommandArbiter`]'s decision, the same one that services ask: a station has a requester of its own, [`Requester::Link`], and the paired transmitter
//! [`Requester::Transmitter`]. A station whose command or sticks are refused is told who commands, and a station in session is told what others ask of the vehicle.
//!
//! A command is acknowledged when the vehicle's state shows that it has happened, as at a cable,
//! and refused with the reason when it does not: see [`goal`](stampfly_services::goal).

use crate::messages::TelemetryFrame;
use crate::topics::{Id, LinkEnds};
use core::fmt::{Display, Write as _};
use heapless::String;
use stampfly_link::secure::{Guarded, Heard, Held, MAX_FRAME, NotTaken, Payload, Received, Sample, put};
use stampfly_link::{Address, TelemetryPacket};
use stampfly_services::goal::{CommandGoal, OVERTAKEN, TOO_MANY, Waited};
use stampfly_services::{CommandArbiter, CommandNotice, Passed, Refusal, Requester};
use stampfly_types::messages::{Alerts, ArmBlocks, FlightStatus, GuidedCommand, PilotInput};
use stampfly_types::{Duration, Instant, Message};

/// How often everything in [`Outgoing::ALL`] is asked for: how late a call or an answer may be.
pub const PERIOD: Duration = Duration::from_millis(20);

/// What the transmitter shows as a sensor's error.
const SENSOR_ERROR: Alerts =
    Alerts::IMU_DEGRADED.with(Alerts::IMU_LOST).with(Alerts::TOF_LOST).with(Alerts::POWER_LOST);

/// Stations whose requesters are remembered: one that comes back is the same again.
const STATIONS: usize = 4;
/// Between two answers to sticks that are refused: they come fifty times a second.
const STICKS_AGAIN: Duration = Duration::from_secs(2);
/// How often a notice is said, because frames are lost, and how many turns lie between.
const NOTICES: u8 = 3;
const NOTICE_TURNS: u8 = 5;
/// Characters of a refusal or notice: the longest names two numbers of 32 bits.
const TEXT: usize = 96;

/// Commands that wait to be seen done. A station says one after the other, and a kill before all.
const WAITS: usize = 4;

/// Why a frame of the station was not obeyed, or a command came to nothing.
#[derive(Clone, Debug)]
struct Refused {
    counter: u32,
    why: String<TEXT>,
    /// How often it is still said, and turns since it was.
    left: u8,
    turns: u8,
}

impl Refused {
    fn new(counter: u32, why: &dyn Display, times: u8) -> Self {
        Self { counter, why: text(why), left: times, turns: NOTICE_TURNS }
    }
}

/// The newest request of another client, for the station.
#[derive(Clone, Copy, Debug, Default)]
struct Notice {
    /// The number of the newest one in the arbiter that was taken, and what it is.
    number: u32,
    told: Option<CommandNotice>,
    /// How often it was said, and turns since then.
    said: u8,
    turns: u8,
}

/// The vehicle's end of the radio. `tests/board` has `pairing.rs`, `secured.rs` and `air.rs`.
pub struct Link<'b> {
    /// Whom it listens to, and what it has refused.
    pub guarded: Guarded,
    pub(crate) ends: LinkEnds<'b>,
    counter: u8,
    /// Where stations are, and their requesters, the newest first.
    stations: [Option<(Address, Requester)>; STATIONS],
    refused: Option<Refused>,
    /// The newest command with a number that was refused, and why: it is refused again when it is
    /// said again.
    denied: Option<(u32, String<TEXT>)>,
    waits: [Option<(Held, Waited)>; WAITS],
    sticks_refused: Option<Instant>,
    notice: Notice,
}

/// What there may be to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outgoing {
    /// A call for an unauthenticated transmitter, to everybody.
    Call,
    /// A part of the secure session's handshake, to everybody.
    Handshake,
    /// What became of a command, why it was refused, or that it is not done while armed, to the station that sent it.
    Acknowledgement,
    /// Telemetry, to who flies: sealed, by turns for a display and for a program.
    Telemetry,
}

impl Outgoing {
    /// All of it, in the order to be asked for.
    pub const ALL: [Self; 4] = [Self::Call, Self::Handshake, Self::Acknowledgement, Self::Telemetry];
}

impl<'b> Link<'b> {
    /// A link whose sessions are at their beginning.
    #[must_use]
    pub const fn new(guarded: Guarded, ends: LinkEnds<'b>) -> Self {
        let (stations, notice) = ([None; STATIONS], Notice { number: 0, told: None, said: 0, turns: 0 });
        Self {
            guarded,
            ends,
            counter: 0,
            stations,
            refused: None,
            denied: None,
            waits: [None; WAITS],
            sticks_refused: None,
            notice,
        }
    }

    /// Takes what a station has sent, `at` the instant it came in, and publishes sticks and commands as far as the arbiter lets them through. What else a station with the
    /// key has sent is returned, for a `RadioRequests` of `stampfly-services`, whose answers `guarded` seals.
    ///
    /// # Errors
    /// When it is refused. The session has counted it; nothing is published.
    pub fn receive<'f>(
        &mut self,
        arbiter: &mut CommandArbiter,
        at: Instant,
        source: Address,
        bytes: &'f mut [u8],
    ) -> Result<Option<Received<'f>>, NotTaken> {
        let before = self.guarded.session().peer();
        let is_led = self.status().armed && arbiter.commander() == Some(Requester::Transmitter);
        self.guarded.set_led(is_led);
        match self.guarded.receive(at, source, bytes)? {
            Heard::Authentic(received) => Ok(self.obey(arbiter, at, source, received)),
            Heard::Unauthenticated(input) => {
                // It has no ear for an answer.
                _ = self.steer(arbiter, at, Requester::Transmitter, &input);
                if let Some(peer) = self.guarded.session().peer().filter(|peer| Some(*peer) != before) {
                    self.ends.link_peer.publish(at, &peer.into());
                }
                Ok(None)
            }
            Heard::Handshake => Ok(None),
        }
    }

    /// The same for what has come over a network, where there is nothing but sealed frames.
    ///
    /// # Errors
    /// When it is none of a station with the key.
    pub fn receive_sealed<'f>(
        &mut self,
        arbiter: &mut CommandArbiter,
        at: Instant,
        source: Address,
        frame: &'f mut [u8],
    ) -> Result<Option<Received<'f>>, NotTaken> {
        match self.guarded.receive_sealed(at, source, frame)? {
            Heard::Authentic(received) => Ok(self.obey(arbiter, at, source, received)),
            Heard::Unauthenticated(_) | Heard::Handshake => Ok(None),
        }
    }

    /// Publishes what a station with the key has sent, if the arbiter lets it through, and returns what is no command.
    fn obey<'f>(
        &mut self,
        arbiter: &mut CommandArbiter,
        at: Instant,
        source: Address,
        received: Received<'f>,
    ) -> Option<Received<'f>> {
        let requester = self.requester(arbiter, source);
        let counter = match received.payload {
            Payload::Numbered { number, .. } => number,
            _ => received.counter,
        };
        if let Payload::Sticks(input) = received.payload {
            let is_due = self.sticks_refused.is_none_or(|last| at.since(last) >= STICKS_AGAIN);
            match self.steer(arbiter, at, requester, &input) {
                // The refusal of a command waits to be sent, and is not overwritten.
                Err(why) if is_due && self.refused.is_none() => {
                    (self.sticks_refused, self.refused) = (Some(at), Some(Refused::new(counter, &why, 1)));
                }
                Err(_) => {}
                Ok(()) => self.sticks_refused = None,
            }
            return None;
        }
        let Some(command) = received.payload.command() else { return Some(received) };
        match CommandGoal::of(command.kind) {
            // A sign of life, which takes nothing over. The commander's is passed on as it comes.
            None => {
                let taken = arbiter.alive(at, requester) && self.command(at, command);
                self.guarded.acknowledge(&received, taken);
            }
            Some(goal) => self.guide(arbiter, (at, requester), (counter, goal), &received, command),
        }
        None
    }

    /// A command: is refused with the reason, or waits to be seen done.
    fn guide(
        &mut self,
        arbiter: &mut CommandArbiter,
        (at, requester): (Instant, Requester),
        (counter, goal): (u32, CommandGoal),
        received: &Received<'_>,
        command: GuidedCommand,
    ) {
        let is_numbered = matches!(received.payload, Payload::Numbered { .. });
        let denied = self.denied.as_ref().filter(|(denied, _)| is_numbered && *denied == counter);
        // A command that ends a flight is done whenever it arrives.
        if let Some((_, why)) = denied.filter(|_| !goal.ends_a_flight()) {
            // The station repeats it until it receives the refusal. The refusal stands when the
            // vehicle's state has changed since: it may be on its way.
            self.refused = Some(Refused::new(counter, why, 1));
            return;
        }
        // The refusal names the commander rather than the state of the vehicle.
        if let Some(holder) = arbiter.holder(at).filter(|holder| *holder != requester && !goal.ends_a_flight()) {
            return self.deny(counter, is_numbered, &Refusal::Occupied(holder));
        }
        let mut words = String::<TEXT>::new();
        if goal.refuse(&self.status(), &mut words) {
            return self.deny(counter, is_numbered, &words);
        }
        if !goal.ends_a_flight() && self.waits.iter().all(Option::is_some) {
            return self.deny(counter, is_numbered, &TOO_MANY);
        }
        let waited = Waited::with(at, goal, self.refusals());
        match arbiter.guide(at, requester, command, &mut |passed| self.pass(at, passed)) {
            Ok(()) => {
                // A free place, or the oldest one's.
                let place = self.waits.iter_mut().min_by_key(|place| place.map(|(_, waited)| waited.since()));
                let held = self.guarded.hold(received);
                let before = place.and_then(|place| core::mem::replace(place, held.map(|held| (held, waited))));
                if let Some((overtaken, _)) = before {
                    self.guarded.settle(overtaken, false);
                    self.refused = Some(Refused::new(overtaken.counter(), &OVERTAKEN, NOTICES));
                }
            }
            // It is said again: there may be room then.
            Err(Refusal::Full) => self.guarded.acknowledge(received, false),
            Err(why) => self.deny(counter, is_numbered, &why),
        }
    }

    fn deny(&mut self, counter: u32, is_numbered: bool, why: &dyn Display) {
        if is_numbered {
            self.denied = Some((counter, text(why)));
        }
        self.refused = Some(Refused::new(counter, why, 1));
    }

    /// Acknowledges a command that is seen to have happened, or says of one why it did not: one in
    /// a turn.
    fn settle(&mut self, now: Instant) {
        let (status, refusals) = (self.status(), self.refusals());
        let settled = self.waits.iter_mut().find_map(|place| {
            let (held, waited) = (*place)?;
            let result = waited.look_at(now, &status, refusals)?;
            *place = None;
            Some((held, result))
        });
        let Some((held, result)) = settled else { return };
        self.guarded.settle(held, result.is_ok());
        if let Err(why) = result {
            let mut words = String::<TEXT>::new();
            // A longer text is cut.
            _ = write!(words, "refused: {why}");
            if held.is_numbered() {
                self.denied = Some((held.counter(), words.clone()));
            }
            // The station no longer repeats the command, so the vehicle repeats the refusal.
            self.refused = Some(Refused::new(held.counter(), &words, NOTICES));
        }
    }

    /// How often the vehicle has refused to arm.
    fn refusals(&mut self) -> u32 {
        self.ends.arm_refusals.latest().map_or(0, |sample| sample.data.attempts)
    }

    /// Follows the vehicle's state, and passes the signs of life of the requester that has the lease on. The firmware's radio calls it every 20 ms, beside the console's
    /// services, which may have to wait.
    pub fn keep(&mut self, arbiter: &mut CommandArbiter, now: Instant) {
        let armed = self.status().armed;
        arbiter.keep(now, armed, &mut |passed| self.pass(now, passed));
    }

    /// The requester of a station that is there.
    fn requester(&mut self, arbiter: &mut CommandArbiter, source: Address) -> Requester {
        let known = self.stations.iter().flatten().find(|(station, _)| *station == source);
        if let Some((_, requester)) = known {
            return *requester;
        }
        let requester = Requester::Link(arbiter.connection());
        self.stations.rotate_right(1);
        let [newest, ..] = &mut self.stations;
        *newest = Some((source, requester));
        requester
    }

    fn steer(
        &mut self,
        arbiter: &mut CommandArbiter,
        at: Instant,
        requester: Requester,
        input: &PilotInput,
    ) -> Result<(), Refusal> {
        let status = self.status();
        arbiter.steer(at, requester, input, &status, &mut |passed| self.pass(at, passed))
    }

    fn pass(&mut self, at: Instant, passed: Passed) -> Result<(), Refusal> {
        match passed {
            Passed::Command(command) if self.command(at, command) => Ok(()),
            Passed::Command(_) => Err(Refusal::Full),
            Passed::Sticks(input) => {
                self.sticks(at, &input);
                Ok(())
            }
        }
    }

    fn status(&mut self) -> FlightStatus {
        self.ends.flight_status.latest().map(|sample| sample.data).unwrap_or_default()
    }

    /// Seals what the station is to be told of what was asked of the vehicle, and by whom. Ask every 20 ms or so.
    pub fn notice<'r>(
        &mut self,
        arbiter: &CommandArbiter,
        now: Instant,
        room: &'r mut [u8; MAX_FRAME],
    ) -> Option<(Address, &'r [u8])> {
        let notice = &mut self.notice;
        notice.turns = notice.turns.saturating_add(1);
        let is_over = notice.said >= NOTICES || notice.told.is_none();
        if let Some((number, told)) = arbiter.told(notice.number).filter(|_| is_over || notice.said > 0) {
            // What is new goes before what is said again.
            *notice = Notice { number, told: Some(told), said: 0, turns: NOTICE_TURNS };
        }
        if notice.said >= NOTICES || notice.turns < NOTICE_TURNS {
            return None;
        }
        let text = text(&notice.told?);
        (notice.said, notice.turns) = (notice.said + 1, 0);
        let notice = Payload::Notice { number: notice.number, text: &text };
        self.guarded.seal(now, &notice, room)
    }

    /// Seals why a frame of the station was refused.
    fn refusal<'r>(&mut self, now: Instant, room: &'r mut [u8; MAX_FRAME]) -> Option<(Address, &'r [u8])> {
        let Refused { counter, why, left, .. } = self.refused.take()?;
        let sealed = self.guarded.seal(now, &Payload::Refusal { counter, why: &why }, room);
        self.refused = (left > 1).then_some(Refused { counter, why, left: left - 1, turns: 0 });
        sealed
    }

    /// Is there a refusal to be said in this turn?
    fn is_refusal_due(&self) -> bool {
        self.refused.as_ref().is_some_and(|refused| refused.turns >= NOTICE_TURNS)
    }

    /// Publishes a command, of a station with the key or of a service. Was there room for it?
    pub fn command(&mut self, at: Instant, command: GuidedCommand) -> bool {
        self.ends.command_guided.publish(at, command).is_ok()
    }

    /// Publishes sticks, of a station with the key or of a service.
    pub fn sticks(&mut self, at: Instant, input: &PilotInput) {
        self.ends.command_pilot.publish(at, input);
    }

    /// Follows the mode machine, and returns what is to be sent now, and where. `random` are eight new bytes of a generator.
    pub fn transmit<'r>(
        &mut self,
        now: Instant,
        what: Outgoing,
        random: [u8; 8],
        room: &'r mut [u8; MAX_FRAME],
    ) -> Option<(Address, &'r [u8])> {
        match what {
            Outgoing::Call => {
                let mode = self.status();
                self.guarded.follow(now, mode.armed, mode.pairing);
                Some((Address::BROADCAST, put(room, &self.guarded.beacon(now)?)?))
            }
            Outgoing::Handshake => Some((Address::BROADCAST, self.guarded.transmit(now, random, room)?)),
            Outgoing::Acknowledgement => {
                if let Some(refused) = &mut self.refused {
                    refused.turns = refused.turns.saturating_add(1);
                }
                if !self.is_refusal_due() {
                    self.settle(now);
                }
                if self.is_refusal_due() {
                    return self.refusal(now, room);
                }
                self.guarded.seal_acknowledgement(now, room)
            }
            Outgoing::Telemetry => {
                self.counter = self.counter.wrapping_add(1);
                let (at, frame) = self.ends.telemetry.latest().map(|new| (new.at, new.data)).unwrap_or_default();
                let packet = packet(self.counter, &frame);
                if let Some(peer) = self.guarded.open_peer(now) {
                    return Some((peer, put(room, &packet.to_bytes())?));
                }
                if self.counter.is_multiple_of(2) {
                    return self.guarded.seal(now, &Payload::Telemetry(packet), room);
                }
                let words = frame.to_words().map(u32::to_le_bytes);
                self.guarded.seal(now, &Payload::Sample(Sample::new(Id::telemetry as u16, at, &words)), room)
            }
        }
    }
}

/// A text for people, as far as there is room for it.
fn text(what: &dyn Display) -> String<TEXT> {
    let mut text = String::new();
    // The rest of a text that is too long is left out.
    _ = write!(text, "{what}");
    text
}

fn packet(counter: u8, frame: &TelemetryFrame) -> TelemetryPacket {
    TelemetryPacket {
        counter,
        battery: frame.battery,
        height: -frame.position.z,
        velocity: frame.velocity,
        attitude: frame.attitude,
        state: frame.phase.into(),
        low_battery: frame.alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY),
        sensor_error: frame.alerts.intersects(SENSOR_ERROR),
        link_lost: frame.alerts.intersects(Alerts::COMM_LOST),
        calibrating: frame.blocks.contains(ArmBlocks::CALIBRATING),
    }
}
