//! The vehicle's end of MAVLink: heartbeat, streams, commands, parameters, for several clients at once.
//!
//! | file | what it does |
//! |---|---|
//! | `identity.rs` | what a vehicle is, and which messages are for it |
//! | `client.rs` | one client: what it was heard to send, what it wants and how often |
//! | `streams.rs` | what is sent by itself: the messages that are made of a [`View`](crate::View) |
//! | `commands.rs` | commands, and what becomes of each |
//! | `parameters.rs` | the parameter protocol; names of at most 16 characters |
//!
//! Implemented from the protocol's description: [heartbeat](https://mavlink.io/en/services/heartbeat.html),
//! [commands](https://mavlink.io/en/services/command.html), [parameters](https://mavlink.io/en/services/parameter.html),
//! [mission](https://mavlink.io/en/services/mission.html) as far as "there is none". Positions are local, north east down, because nothing here
//! knows where on Earth it is; `MAV_CMD_NAV_TAKEOFF` takes its altitude as height above the ground.
//!
//! Several clients may be connected; the [lease](crate::lease) says who commands. Their frames are not signed here.

mod client;
mod commands;
mod identity;
mod parameters;
mod streams;

use crate::cockpit::Cockpit;
use crate::refusal::Seat;
use client::{Client, Put};
use heapless::Vec;
pub use identity::Identity;
use identity::{AUTOPILOT, is_ours};
pub use parameters::short_name;
use stampfly_link::mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_COUNT_DATA, MavMessage, MavMissionResult, TIMESYNC_DATA,
};
use stampfly_types::messages::{FlightMode, PilotInput};
use stampfly_types::{Duration, Instant};

/// Clients that can be connected at once.
pub const CLIENTS: usize = 8;
/// A client of datagrams that was not heard for this long is forgotten, unless the vehicle was told to send to it.
const FORGOTTEN: Duration = Duration::from_secs(30);

/// The vehicle's end of MAVLink. `C` tells its clients apart: an address, a number.
///
/// Give it what is heard with [`hear`](Self::hear) and call [`poll`](Self::poll) about fifty times a second; it hands what is to be sent to
/// `put`. `stampfly-board`'s simulation connects it to sockets.
#[derive(Clone, Debug)]
pub struct Mavlink<C> {
    identity: Identity,
    clients: Vec<Client<C>, CLIENTS>,
    notices: streams::Notices,
    refused: u32,
}

impl<C: Copy + PartialEq> Mavlink<C> {
    /// A vehicle with this identity.
    #[must_use]
    pub const fn new(identity: Identity) -> Self {
        Self { identity, clients: Vec::new(), notices: streams::Notices::new(), refused: 0 }
    }

    /// Clients that were turned away because there were too many. Wraps around.
    #[must_use]
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Somebody is there to be sent to, whether or not it says anything. With `stays` it is never forgotten.
    pub fn open(&mut self, now: Instant, client: C, stays: bool) {
        if !self.clients.iter().any(|known| known.id == client)
            && self.clients.push(Client::new(self.identity.system, client, now, stays)).is_err()
        {
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
        let identity = self.identity;
        let Some(client) = self.clients.iter_mut().find(|known| known.id == from) else { return };
        client.heard = now;
        for byte in bytes {
            let Some((system, message)) = client.feed(*byte) else { continue };
            answer(now, &identity, client, system, &message, cockpit, put);
        }
    }

    /// Sends what is due. Call it about fifty times a second.
    pub fn poll(&mut self, now: Instant, cockpit: &mut dyn Cockpit, put: Put<'_, C>) {
        self.clients.retain(|client| client.stays || now.since(client.heard) < FORGOTTEN);
        let notices = self.notices.new_ones(&cockpit.view());
        for client in &mut self.clients {
            for notice in &notices {
                client.send(notice, put);
            }
            client.send_due(now, &self.identity, &cockpit.view(), put);
            parameters::send_next(client, cockpit.parameters(), put);
        }
    }
}

/// Answers one message of a client's system.
fn answer<C: Copy + PartialEq>(
    now: Instant,
    identity: &Identity,
    client: &mut Client<C>,
    system: u8,
    message: &MavMessage,
    cockpit: &mut dyn Cockpit,
    put: Put<'_, C>,
) {
    let seat = Seat::Mavlink(system);
    match message {
        MavMessage::HEARTBEAT(_) => cockpit.alive(now, seat),
        MavMessage::COMMAND_LONG(command) if is_ours(identity, command.target_system, command.target_component) => {
            let command = commands::Command::from(command);
            commands::obey(now, identity, client, seat, &command, cockpit, put);
        }
        MavMessage::COMMAND_INT(command) if is_ours(identity, command.target_system, command.target_component) => {
            let command = commands::Command::from(command);
            commands::obey(now, identity, client, seat, &command, cockpit, put);
        }
        MavMessage::SET_POSITION_TARGET_LOCAL_NED(target)
            if is_ours(identity, target.target_system, target.target_component) =>
        {
            commands::go_to(now, client, seat, target, cockpit);
        }
        MavMessage::MANUAL_CONTROL(sticks) if is_ours(identity, sticks.target, AUTOPILOT) => {
            let share = |axis: i16| if axis == i16::MAX { 0.0 } else { f32::from(axis) / 1000.0 };
            let input = PilotInput {
                pitch: share(sticks.x),
                roll: share(sticks.y),
                // A lever from 0 to 1000, at rest in its middle.
                throttle: 2.0 * share(sticks.z) - 1.0,
                yaw: share(sticks.r),
                mode: FlightMode::PosHold,
                arm: cockpit.view().state().armed,
                kill: false,
            };
            _ = cockpit.steer(now, seat, &input.cleaned());
        }
        MavMessage::PARAM_REQUEST_LIST(request)
            if is_ours(identity, request.target_system, request.target_component) =>
        {
            client.next_parameter = Some(0);
        }
        MavMessage::PARAM_REQUEST_READ(request)
            if is_ours(identity, request.target_system, request.target_component) =>
        {
            parameters::read(client, request, cockpit.parameters(), put);
        }
        MavMessage::PARAM_SET(request) if is_ours(identity, request.target_system, request.target_component) => {
            parameters::set(client, request, cockpit, put);
        }
        MavMessage::MISSION_REQUEST_LIST(request)
            if is_ours(identity, request.target_system, request.target_component) =>
        {
            let answer = MISSION_COUNT_DATA { count: 0, target_system: system, target_component: 0 };
            client.send(&MavMessage::MISSION_COUNT(answer), put);
        }
        MavMessage::MISSION_COUNT(request) if is_ours(identity, request.target_system, request.target_component) => {
            let result = MavMissionResult::MAV_MISSION_UNSUPPORTED;
            let answer = MISSION_ACK_DATA { target_system: system, target_component: 0, mavtype: result };
            client.send(&MavMessage::MISSION_ACK(answer), put);
        }
        MavMessage::TIMESYNC(sync) if sync.tc1 == 0 => {
            let answer = TIMESYNC_DATA { tc1: (now.as_micros() as i64).saturating_mul(1000), ..sync.clone() };
            client.send(&MavMessage::TIMESYNC(answer), put);
        }
        _ => {}
    }
}
