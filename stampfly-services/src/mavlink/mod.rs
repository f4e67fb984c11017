//! The vehicle's end of MAVLink: heartbeat, streams, commands, parameters, missions, for several clients at once.
//!
//! | file | what it does |
//! |---|---|
//! | `identity.rs` | what a vehicle is, and which messages are for it |
//! | `client.rs` | one client: what it was heard to send, what it wants and how often, whether it must sign |
//! | `streams.rs` | what is sent by itself: the messages that are made of a [`View`](crate::View) |
//! | `commands.rs` | commands, and what becomes of each |
//! | `unreadable.rs` | commands and items that this dialect does not have, which are answered too |
//! | `parameters.rs` | the parameter protocol; names of at most 16 characters |
//! | `missions.rs` | the mission protocol |
//! | `item.rs` | a mission item, and the [step](crate::mission::Step) that it means |
//!
//! Implemented from the protocol's description: [heartbeat](https://mavlink.io/en/services/heartbeat.html),
//! [commands](https://mavlink.io/en/services/command.html), [parameters](https://mavlink.io/en/services/parameter.html),
//! [mission](https://mavlink.io/en/services/mission.html), [signing](https://mavlink.io/en/guide/message_signing.html). Positions are local, north east down,
//! and global as soon as somebody knows where on Earth the vehicle is: the vehicle itself, or a station that has said so with `SET_GPS_GLOBAL_ORIGIN`.
//! `MAV_CMD_NAV_TAKEOFF` takes its altitude as height above the ground.
//!
//! Several clients may be connected; the [lease](crate::lease) says who commands. Give it a [key](Mavlink::with_key) wherever others than one's own programs can
//! reach it.

#![allow(deprecated, reason = "programs speak what the protocol has superseded for years after")]

mod client;
mod commands;
mod identity;
mod item;
mod missions;
mod parameters;
mod streams;
mod unreadable;

use crate::cockpit::Cockpit;
use crate::mission::Origin;
use crate::refusal::Seat;
use client::{Client, Fed, Guard, Put};
use commands::Turn;
use core::fmt::Write;
use heapless::Vec;
pub use identity::Identity;
use identity::{AUTOPILOT, Own};
pub use missions::ITEMS;
use missions::Missions;
pub use parameters::short_name;
use stampfly_link::mavlink::dialects::common::{MavMessage, MavMissionType, MavSeverity, TIMESYNC_DATA};
use stampfly_link::mavlink::signing::{SigningKey, Verifier};
use stampfly_types::messages::{FlightMode, PilotInput};
use stampfly_types::{Duration, Instant};
use unreadable::Unreadable;

/// Clients that can be connected at once.
pub const CLIENTS: usize = 8;
/// A client of datagrams that was not heard for this long is forgotten, unless the vehicle was told to send to it.
const FORGOTTEN: Duration = Duration::from_secs(30);
/// Stations are told so often how far a mission is.
const TOLD: Duration = Duration::from_secs(1);
/// And at most so often of frames that were not believed.
const COUNTED: Duration = Duration::from_secs(5);

/// The vehicle's end of MAVLink. `C` tells its clients apart: an address, a number.
///
/// Give it what is heard with [`hear`](Self::hear) and call [`poll`](Self::poll) about fifty times a second; it hands what is to be sent to
/// `put`. `stampfly-board`'s simulation connects it to sockets.
#[derive(Clone, Debug)]
pub struct Mavlink<C> {
    own: Own,
    clients: Vec<Client<C>, CLIENTS>,
    missions: Missions<C>,
    notices: streams::Notices,
    guard: Option<Guard>,
    refused: u32,
    untrusted: u32,
    /// How many stations have been told of, and when.
    counted: (u32, Instant),
    told: Instant,
}

impl<C: Copy + PartialEq> Mavlink<C> {
    /// A vehicle with this identity.
    #[must_use]
    pub const fn new(identity: Identity) -> Self {
        Self {
            own: Own { identity, origin: None },
            clients: Vec::new(),
            missions: Missions::new(identity.take_off_height),
            notices: streams::Notices::new(),
            guard: None,
            refused: 0,
            untrusted: 0,
            counted: (0, Instant::ZERO),
            told: Instant::ZERO,
        }
    }

    /// The same, which signs what it sends and believes what is signed with this key alone. `epoch` is the signature time at the clock's zero, in units of
    /// 10 µs since 2015, and must be later than the last one before a restart.
    #[must_use]
    pub fn with_key(mut self, key: SigningKey, epoch: u64) -> Self {
        let verifier = Verifier::new(key.clone(), epoch);
        self.guard = Some(Guard { key, epoch, verifier });
        self
    }

    /// Clients that were turned away because there were too many. Wraps around.
    #[must_use]
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Frames that were not signed as they had to be, and did nothing. Wraps around.
    #[must_use]
    pub const fn untrusted(&self) -> u32 {
        self.untrusted
    }

    /// Somebody is there to be sent to, whether or not it says anything. With `stays` it is never forgotten.
    pub fn open(&mut self, now: Instant, client: C, stays: bool) {
        let guarded = self.guard.is_some();
        self.admit(now, client, stays, guarded);
    }

    /// The same for somebody on the same machine or at the other end of a cable, who need not sign although others must.
    pub fn open_local(&mut self, now: Instant, client: C, stays: bool) {
        self.admit(now, client, stays, false);
    }

    fn admit(&mut self, now: Instant, client: C, stays: bool, guarded: bool) {
        if self.clients.iter().any(|known| known.id == client) {
            return;
        }
        if self.clients.is_full()
            && let Some(place) = self.clients.iter().position(|known| !known.is_served())
        {
            // Strangers must not keep a station out.
            self.clients.swap_remove(place);
        }
        let guard = self.guard.as_ref().filter(|_| guarded);
        if self.clients.push(Client::new(self.own.identity.system, client, now, stays, guard)).is_err() {
            self.refused = self.refused.wrapping_add(1);
        }
    }

    /// Somebody is gone.
    pub fn close(&mut self, client: C) {
        self.clients.retain(|known| known.id != client);
    }

    /// Takes what a client has sent, and answers.
    pub fn hear(&mut self, now: Instant, from: C, bytes: &[u8], cockpit: &mut dyn Cockpit, put: Put<'_, C>) {
        self.open(now, from, false);
        self.own.origin = cockpit.origin().or(self.own.origin);
        let Self { own, clients, missions, guard, untrusted, .. } = self;
        let Some(client) = clients.iter_mut().find(|known| known.id == from) else { return };
        client.at(now);
        for byte in bytes {
            match client.feed(*byte, guard.as_mut()) {
                None => {}
                Some(Fed::Untrusted) => *untrusted = untrusted.wrapping_add(1),
                Some(Fed::Message(system, message)) => {
                    let seat = Seat::Mavlink(system);
                    let turn = Turn {
                        now,
                        own: &*own,
                        client: &mut *client,
                        missions: &mut *missions,
                        seat,
                        cockpit: &mut *cockpit,
                        put: &mut *put,
                    };
                    if let Some(origin) = answer(turn, system, &message) {
                        own.origin = Some(origin);
                    }
                }
                Some(Fed::Unreadable(system, message)) => {
                    let seat = Seat::Mavlink(system);
                    let turn = Turn {
                        now,
                        own: &*own,
                        client: &mut *client,
                        missions: &mut *missions,
                        seat,
                        cockpit: &mut *cockpit,
                        put: &mut *put,
                    };
                    answer_unreadable(turn, system, message);
                }
            }
        }
    }

    /// Sends what is due. Call it about fifty times a second.
    pub fn poll(&mut self, now: Instant, cockpit: &mut dyn Cockpit, put: Put<'_, C>) {
        self.clients.retain(|client| client.stays || now.since(client.heard) < FORGOTTEN);
        self.own.origin = cockpit.origin().or(self.own.origin);
        let notices = self.notices.new_ones(&cockpit.view());
        let not_believed = self.not_believed(now);
        let mission = (now.since(self.told) >= TOLD).then(|| self.missions.state());
        if mission.is_some() {
            self.told = now;
        }
        for client in &mut self.clients {
            client.at(now);
            if !client.is_served() {
                continue;
            }
            for notice in notices.iter().chain(&not_believed).chain(&mission) {
                client.send(notice, put);
            }
            client.send_due(now, &self.own, &cockpit.view(), put);
            parameters::send_next(client, cockpit.parameters(), put);
        }
        self.missions.poll(now, &self.own, &mut self.clients, cockpit, put);
    }

    /// Says to those who are believed that others are not.
    fn not_believed(&mut self, now: Instant) -> Option<MavMessage> {
        let (told, at) = self.counted;
        let new = self.untrusted.wrapping_sub(told);
        let is_heard = self.clients.iter().any(Client::is_served);
        if new == 0 || !is_heard || now.since(at) < COUNTED {
            return None;
        }
        self.counted = (self.untrusted, now);
        let mut words = heapless::String::<50>::new();
        _ = write!(words, "{new} frames not signed with the key, ignored");
        Some(streams::text(MavSeverity::MAV_SEVERITY_WARNING, "", &words))
    }
}

/// Answers one message of a client's system. Returns where on Earth the vehicle is, if it was told.
fn answer<C: Copy + PartialEq>(turn: Turn<'_, '_, C>, system: u8, message: &MavMessage) -> Option<Origin> {
    let (now, own, seat) = (turn.now, turn.own, turn.seat);
    match message {
        MavMessage::HEARTBEAT(_) => sign_of_life(turn),
        MavMessage::COMMAND_LONG(command) if own.is_meant(command.target_system, command.target_component) => {
            commands::obey(turn, &commands::Command::from(command));
        }
        MavMessage::COMMAND_INT(command) if own.is_meant(command.target_system, command.target_component) => {
            commands::obey(turn, &commands::Command::from(command));
        }
        MavMessage::SET_POSITION_TARGET_LOCAL_NED(target)
            if own.is_meant(target.target_system, target.target_component) =>
        {
            commands::go_to(turn, target);
        }
        MavMessage::MANUAL_CONTROL(sticks) if own.is_meant(sticks.target, AUTOPILOT) => {
            let share = |axis: i16| if axis == i16::MAX { 0.0 } else { f32::from(axis) / 1000.0 };
            let input = PilotInput {
                pitch: share(sticks.x),
                roll: share(sticks.y),
                // A lever from 0 to 1000, at rest in its middle.
                throttle: 2.0 * share(sticks.z) - 1.0,
                yaw: share(sticks.r),
                mode: FlightMode::PosHold,
                arm: turn.cockpit.view().state().armed,
                kill: false,
            };
            _ = turn.cockpit.steer(now, seat, &input.cleaned());
        }
        MavMessage::PARAM_REQUEST_LIST(request) if own.is_meant(request.target_system, request.target_component) => {
            turn.client.next_parameter = Some(0);
        }
        MavMessage::PARAM_REQUEST_READ(request) if own.is_meant(request.target_system, request.target_component) => {
            parameters::read(turn.client, request, turn.cockpit.parameters(), turn.put);
        }
        MavMessage::PARAM_SET(request) if own.is_meant(request.target_system, request.target_component) => {
            parameters::set(turn.client, request, turn.cockpit, turn.put);
        }
        MavMessage::SET_GPS_GLOBAL_ORIGIN(request) if own.is_meant(request.target_system, AUTOPILOT) => {
            return set_origin(
                turn,
                Origin { latitude: request.latitude, longitude: request.longitude, altitude: request.altitude },
            );
        }
        MavMessage::TIMESYNC(sync) if sync.tc1 == 0 => {
            let answer = TIMESYNC_DATA { tc1: (now.as_micros() as i64).saturating_mul(1000), ..sync.clone() };
            turn.client.send(&MavMessage::TIMESYNC(answer), turn.put);
        }
        _ => mission_message(turn, system, message),
    }
    None
}

/// The messages of the mission protocol.
fn mission_message<C: Copy + PartialEq>(turn: Turn<'_, '_, C>, system: u8, message: &MavMessage) {
    let Turn { now, own, client, missions, put, .. } = turn;
    match message {
        MavMessage::MISSION_COUNT(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.count(now, client, system, request, put);
        }
        MavMessage::MISSION_ITEM_INT(item) if own.is_meant(item.target_system, item.target_component) => {
            missions.item(now, client, own, system, (item.seq, item.mission_type, Some(item.into())), put);
        }
        MavMessage::MISSION_ITEM(item) if own.is_meant(item.target_system, item.target_component) => {
            missions.item(now, client, own, system, (item.seq, item.mission_type, Some(item.into())), put);
        }
        MavMessage::MISSION_REQUEST_LIST(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.list(client, system, request.mission_type, put);
        }
        MavMessage::MISSION_REQUEST_INT(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.request(client, system, (request.seq, request.mission_type), put);
        }
        // Older programs ask so, and read both kinds of item.
        MavMessage::MISSION_REQUEST(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.request(client, system, (request.seq, request.mission_type), put);
        }
        MavMessage::MISSION_CLEAR_ALL(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.clear(client, system, request.mission_type, put);
        }
        MavMessage::MISSION_SET_CURRENT(request) if own.is_meant(request.target_system, request.target_component) => {
            missions.set_current(usize::from(request.seq));
            client.send(&missions.state(), put);
        }
        MavMessage::MISSION_ACK(ack) if own.is_meant(ack.target_system, ack.target_component) => {
            missions.acknowledged(client, ack);
        }
        _ => {}
    }
}

fn sign_of_life<C>(turn: Turn<'_, '_, C>) {
    turn.cockpit.alive(turn.now, turn.seat);
    turn.missions.runner.alive(turn.now, turn.seat);
}

/// A station says where on Earth the vehicle is. Not while a mission with places on Earth is flown, which would be elsewhere then; and not to a vehicle
/// that knows.
fn set_origin<C: Copy + PartialEq>(turn: Turn<'_, '_, C>, origin: Origin) -> Option<Origin> {
    let Turn { now, own, client, missions, cockpit, put, .. } = turn;
    let moves = missions.is_global() && missions.runner.is_running();
    let taken = (origin.is_sound() && !moves && cockpit.origin().is_none()).then_some(origin);
    // What it is now, so that a station sees whether it was taken.
    let now_own = Own { origin: taken.or(own.origin), ..*own };
    for id in [49, 242] {
        if let Some(message) = streams::make(id, now, &now_own, &cockpit.view()) {
            client.send(&message, put);
        }
    }
    taken
}

/// What cannot be read is answered so that nobody waits for it.
fn answer_unreadable<C: Copy + PartialEq>(turn: Turn<'_, '_, C>, system: u8, message: Unreadable) {
    let own = turn.own;
    match message {
        Unreadable::Heartbeat => sign_of_life(turn),
        Unreadable::Command { number, target: [to, component] } if own.is_meant(to, component) => {
            commands::refuse(turn.client, number, turn.put);
        }
        Unreadable::Item { sequence, kind: 0, target: [to, component] } if own.is_meant(to, component) => {
            let kind = MavMissionType::MAV_MISSION_TYPE_MISSION;
            turn.missions.item(turn.now, turn.client, own, system, (sequence, kind, None), turn.put);
        }
        _ => {}
    }
}
