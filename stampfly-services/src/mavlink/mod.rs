//! The vehicle's end of MAVLink: heartbeat, streams, commands, parameters, missions, for several
//! clients at once.
//!
//! | file | what it does |
//! |---|---|
//! | `identity.rs` | what a vehicle is, and which messages are for it |
//! | `client.rs` | one client: what it was heard to send, what it wants and how often, whether it must sign |
//! | `heard.rs`, `said.rs` | the messages that a vehicle takes, and those that it sends: a few of the dialect's two hundred |
//! | `answer.rs` | which message goes where |
//! | `pulse.rs` | whether what comes now was held up on its way |
//! | `streams.rs` | what is sent by itself: the messages that are made of a [`View`](crate::View) |
//! | `commands.rs` | commands, and what becomes of each |
//! | `orders.rs` | those that change the vehicle's state, until it is seen that they have happened |
//! | `calibration.rs` | calibrations, which take longer than a command |
//! | `unreadable.rs` | commands and items that this dialect does not have, which are answered too |
//! | `parameters.rs` | the parameter protocol; names of at most 16 characters |
//! | `targets.rs` | set-points: a place to fly to, or how to move |
//! | `leading.rs` | velocities, flown as a way-point that moves |
//! | `unserved.rs` | messages that are refused aloud, once in a while |
//! | `missions.rs` | the mission protocol |
//! | `item.rs` | a mission item, and the [step](crate::mission::Step) that it means |
//!
//! Implemented from the protocol's description:
//! [heartbeat](https://mavlink.io/en/services/heartbeat.html),
//! [commands](https://mavlink.io/en/services/command.html),
//! [parameters](https://mavlink.io/en/services/parameter.html),
//! [mission](https://mavlink.io/en/services/mission.html),
//! [signing](https://mavlink.io/en/guide/message_signing.html). Positions are local, north east
//! down, and global as soon as somebody knows where on Earth the vehicle is: the vehicle itself, or
//! a station that has said so with `SET_GPS_GLOBAL_ORIGIN`. `MAV_CMD_NAV_TAKEOFF` takes its
//! altitude as height above the ground.
//!
//! Several clients may be connected; the [lease](crate::lease) says who commands. Give it a
//! [key](Mavlink::with_key) wherever others than one's own programs can reach it.

#![allow(deprecated, reason = "programs speak what the protocol has superseded for years after")]

mod answer;
mod calibration;
mod client;
mod commands;
mod heard;
mod identity;
mod item;
mod leading;
mod missions;
mod orders;
mod parameters;
mod pulse;
mod said;
mod streams;
mod targets;
mod unreadable;
mod unserved;

use crate::access::VehicleAccess;
use crate::refusal::Requester;
pub use answer::ends_a_flight;
use calibration::Calibrating;
use client::{Client, Fed, Guard, Put};
use commands::Turn;
use core::fmt::Write;
use heapless::Vec;
pub use identity::Identity;
use identity::Own;
use leading::Leading;
pub use missions::ITEMS;
use missions::Missions;
use orders::Orders;
pub use parameters::short_name;
pub use pulse::Pulse;
use said::Said;
use stampfly_link::mavlink::dialects::common::{MavMessage, MavSeverity};
use stampfly_link::mavlink::signing::{self, SigningKey, Untrusted, Verifier};
use stampfly_link::mavlink::{MavlinkDecoder, Tunnel};
use stampfly_types::{Duration, Instant};

/// Clients that can be connected at once.
pub const CLIENTS: usize = 8;
/// A client of datagrams that was not heard for this long is forgotten, unless the vehicle was told
/// to send to it.
const FORGOTTEN: Duration = Duration::from_secs(30);
/// The number of `HEARTBEAT`.
const HEARTBEAT: u32 = 0;
/// And after this long, when there is no room for another. Stations send a heartbeat a second.
const QUIET: Duration = Duration::from_secs(5);
/// Stations are told so often how far a mission is.
const TOLD: Duration = Duration::from_secs(1);
/// And at most so often of frames that were not believed.
const COUNTED: Duration = Duration::from_secs(5);

/// The vehicle's end of MAVLink. `C` tells its clients apart: an address, a number. A mission has
/// at most `ITEMS` items, of which memory is taken twice: for the one in force and for one that is
/// uploaded.
///
/// Give it what is heard with [`hear`](Self::hear) and call [`poll`](Self::poll) about fifty times
/// a second; it hands what is to be sent to `put`. `stampfly-board`'s simulation connects it to
/// sockets.
#[derive(Clone, Debug)]
pub struct Mavlink<C, const N: usize = CLIENTS, const ITEMS: usize = { missions::ITEMS }> {
    own: Own,
    clients: Vec<Client<C>, N>,
    missions: Missions<C, ITEMS>,
    calibrating: Calibrating<C>,
    orders: Orders<C>,
    leading: Leading<C>,
    notices: streams::Notices,
    guard: Option<Guard>,
    /// What was asked of the vehicle, and told.
    asked: u32,
    refused: u32,
    untrusted: u32,
    /// How many stations have been told of, and when.
    counted: (u32, Instant),
    told: Instant,
}

impl<C: Copy + PartialEq> Mavlink<C> {
    /// A vehicle with this identity, for [`CLIENTS`] clients.
    #[must_use]
    pub const fn new(identity: Identity) -> Self {
        Self::for_clients(identity)
    }
}

impl<C: Copy + PartialEq, const N: usize, const ITEMS: usize> Mavlink<C, N, ITEMS> {
    /// A vehicle with this identity, for `N` clients at once and missions of `ITEMS` items.
    #[must_use]
    pub const fn for_clients(identity: Identity) -> Self {
        Self {
            own: Own { identity, origin: None },
            clients: Vec::new(),
            missions: Missions::new(&identity),
            calibrating: Calibrating::new(),
            orders: Orders::new(),
            leading: Leading::new(),
            notices: streams::Notices::new(),
            guard: None,
            asked: 0,
            refused: 0,
            untrusted: 0,
            counted: (0, Instant::ZERO),
            told: Instant::ZERO,
        }
    }

    /// The same, which signs what it sends and believes what is signed with this key alone. `epoch`
    /// is the signature time at the clock's zero, in units of 10 µs since 2015, and must be later
    /// than the last one before a restart.
    #[must_use]
    pub fn with_key(mut self, key: SigningKey, epoch: u64) -> Self {
        let verifier = Verifier::new(key.clone(), epoch);
        self.guard = Some(Guard { key, epoch, verifier });
        self
    }

    /// Clients that were turned away because there were too many, or because they do not speak
    /// MAVLink. Wraps around.
    #[must_use]
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Frames that were not signed as they had to be, and did nothing. Wraps around.
    #[must_use]
    pub const fn untrusted(&self) -> u32 {
        self.untrusted
    }

    /// The latest time of a signature that was believed or made, in units of 10 µs since 2015.
    /// `None` without a key. Keep it over a restart: what was signed before must not be believed
    /// after it.
    #[must_use]
    pub fn signature_time(&self, now: Instant) -> Option<u64> {
        let Guard { epoch, verifier, .. } = self.guard.as_ref()?;
        let made = self.clients.iter().filter_map(Client::signed).max().unwrap_or_default();
        Some(verifier.time().max(made).max(signing::time(*epoch, now)))
    }

    /// Has this client sent a frame that was believed?
    #[must_use]
    pub fn is_believed(&self, client: C) -> bool {
        self.clients.iter().any(|known| known.id == client && known.believed)
    }

    /// Somebody is there to be sent to, whether or not it says anything. With `stays` it is never
    /// forgotten.
    pub fn open(&mut self, now: Instant, client: C, stays: bool) {
        let guarded = self.guard.is_some();
        self.admit(now, client, stays, guarded);
    }

    /// The same for somebody on the same machine or at the other end of a cable, who need not sign
    /// although others must.
    pub fn open_local(&mut self, now: Instant, client: C, stays: bool) {
        self.admit(now, client, stays, false);
    }

    fn admit(&mut self, now: Instant, client: C, stays: bool, guarded: bool) {
        if self.clients.iter().any(|known| known.id == client) {
            return;
        }
        if self.clients.is_full() {
            // Strangers must not keep a station out, nor must one that was there before and has
            // begun again at another place.
            let stranger = self.clients.iter().position(|known| !known.is_served());
            let gone = || self.clients.iter().position(|known| !known.stays && now.since(known.heard) >= QUIET);
            if let Some(place) = stranger.or_else(gone) {
                self.clients.swap_remove(place);
            }
        }
        let guard = self.guard.as_ref().filter(|_| guarded);
        if self.clients.push(Client::new(self.own.identity.system, client, now, stays, guard)).is_err() {
            self.refused = self.refused.wrapping_add(1);
        }
    }

    /// A client is gone. What it commands it has left.
    pub fn close(&mut self, client: C, access: &mut dyn VehicleAccess) {
        let gone = self.clients.iter().find(|known| known.id == client).and_then(|known| known.connection);
        if let Some(connection) = gone {
            access.leave(&|requester| requester.is_at(connection));
        }
        self.missions.forget(client);
        self.clients.retain(|known| known.id != client);
    }

    /// Takes what a client has sent, and answers.
    pub fn hear(&mut self, now: Instant, from: C, bytes: &[u8], access: &mut dyn VehicleAccess, put: Put<'_, C>) {
        self.hear_tunnels(now, from, (bytes, false), access, put, &mut |_, _| {});
    }

    /// The same, which hands every `TUNNEL` for this vehicle to `tunnel`, with who has sent it. The
    /// bytes may be [late](Self::hear_late).
    pub fn hear_tunnels(
        &mut self,
        now: Instant,
        from: C,
        (bytes, is_late): (&[u8], bool),
        access: &mut dyn VehicleAccess,
        put: Put<'_, C>,
        tunnel: &mut dyn FnMut(Requester, Tunnel),
    ) {
        self.hear_any(now, from, (self.guard.is_some(), is_late), bytes, access, put, tunnel);
    }

    /// Takes what a client on the same machine has sent, who need not sign although others must,
    /// and answers.
    pub fn hear_local(&mut self, now: Instant, from: C, bytes: &[u8], access: &mut dyn VehicleAccess, put: Put<'_, C>) {
        self.hear_any(now, from, (false, false), bytes, access, put, &mut |_, _| {});
    }

    /// Takes what lay in the caller's queue for more than a second, of a client that need not sign
    /// if it is on the same machine, and answers. Nothing in it moves the vehicle or changes how it
    /// flies, but for what ends a flight; its sender is told so.
    pub fn hear_late(
        &mut self,
        now: Instant,
        from: C,
        is_local: bool,
        bytes: &[u8],
        access: &mut dyn VehicleAccess,
        put: Put<'_, C>,
    ) {
        let guarded = !is_local && self.guard.is_some();
        self.hear_any(now, from, (guarded, true), bytes, access, put, &mut |_, _| {});
    }

    // A client that is new has a guard, or need not sign. What is late is said of these bytes.
    #[allow(clippy::too_many_arguments, reason = "of one function with several names")]
    fn hear_any(
        &mut self,
        now: Instant,
        from: C,
        (guarded, is_late): (bool, bool),
        bytes: &[u8],
        access: &mut dyn VehicleAccess,
        put: Put<'_, C>,
        tunnel: &mut dyn FnMut(Requester, Tunnel),
    ) {
        // A datagram holds whole frames. What begins otherwise is of no program that speaks
        // MAVLink, and takes no place of one that does.
        if !self.clients.iter().any(|known| known.id == from) {
            if !begins_with_a_frame(bytes) {
                self.refused = self.refused.wrapping_add(1);
                return;
            }
            self.admit(now, from, false, guarded);
        }
        self.own.origin = access.origin().or(self.own.origin);
        let Self { own, clients, missions, calibrating, orders, leading, guard, untrusted, .. } = self;
        let Some(client) = clients.iter_mut().find(|known| known.id == from) else { return };
        client.at(now, guard.as_ref());
        client.pulse.lies(is_late);
        let connection = *client.connection.get_or_insert_with(|| access.connection());
        let requester = |[system, component]: [u8; 2]| Requester::Mavlink { connection, system, component };
        for byte in bytes {
            let (asker, said) = match client.feed(*byte, own.identity.system, guard.as_mut()) {
                None | Some(Fed::Own) => continue,
                Some(Fed::Untrusted(why)) => {
                    *untrusted = untrusted.wrapping_add(1);
                    // It has the key, and its clock is behind the vehicle's: stations take over the
                    // time of whatever is signed with their key. One that sends again what others
                    // have said gets a heartbeat for it.
                    if why == Untrusted::Old
                        && !client.believed
                        && let Some(heartbeat) = streams::make(HEARTBEAT, now, own, &access.view())
                        && client.may_be_told(now)
                    {
                        client.send(&heartbeat, put);
                    }
                    continue;
                }
                Some(Fed::Tunnel(sender, heard)) => {
                    if own.is_meant(heard.target[0], heard.target[1]) {
                        tunnel(requester(sender), heard);
                    }
                    continue;
                }
                Some(Fed::Message(asker, message)) => (asker, Ok(message)),
                Some(Fed::Unreadable(asker, message)) => (asker, Err(message)),
            };
            let turn = Turn {
                now,
                own: &*own,
                client: &mut *client,
                missions: &mut *missions,
                calibrating: &mut *calibrating,
                orders: &mut *orders,
                leading: &mut *leading,
                asker,
                requester: requester(asker),
                access: &mut *access,
                put: &mut *put,
            };
            match said {
                Ok(message) => own.origin = answer::message(turn, &message).or(own.origin),
                Err(message) => answer::unreadable(turn, message),
            }
        }
    }

    /// A client that can tell says that what it sends from now on, for a moment, is late or is not.
    pub(crate) fn mark(&mut self, now: Instant, from: C, is_late: bool) {
        self.clients.iter_mut().filter(|known| known.id == from).for_each(|client| client.pulse.mark(now, is_late));
    }

    /// Sends a client a message by its number and fields. Nothing happens to one that is not
    /// connected.
    pub fn send_payload(&mut self, to: C, id: u32, payload: &[u8], put: Put<'_, C>) {
        if let Some(client) = self.clients.iter_mut().find(|known| known.id == to) {
            client.send_payload(id, payload, put);
        }
    }

    /// Sends what is due. Call it about fifty times a second.
    pub fn poll(&mut self, now: Instant, access: &mut dyn VehicleAccess, put: Put<'_, C>) {
        self.clients.retain(|client| client.stays || now.since(client.heard) < FORGOTTEN);
        self.own.origin = access.origin().or(self.own.origin);
        let notices = self.notices.new_ones(&access.view());
        let not_believed = self.not_believed(now);
        let mut asked = Vec::<Said, 4>::new();
        while let Some((number, told)) = access.told(self.asked).filter(|_| !asked.is_full()) {
            self.asked = number;
            let mut words = heapless::String::<50>::new();
            _ = write!(words, "{told}");
            _ = asked.push(streams::text(MavSeverity::MAV_SEVERITY_INFO, "", &words));
        }
        let mission = (now.since(self.told) >= TOLD).then(|| self.missions.state());
        if mission.is_some() {
            self.told = now;
        }
        for client in &mut self.clients {
            client.at(now, self.guard.as_ref());
            if !client.is_served() {
                continue;
            }
            for notice in &notices {
                client.send(&notice.text(), put);
            }
            for said in not_believed.iter().chain(&mission).chain(&asked) {
                client.send(said, put);
            }
            client.send_due(now, &self.own, &access.view(), put);
            parameters::send_next(client, access.parameters(), put);
        }
        self.orders.poll(now, &mut self.clients, access, &mut self.missions.runner, put);
        self.leading.poll(now, access);
        self.missions.poll(now, &self.own, &mut self.clients, access, put);
        self.calibrating.poll(now, &mut self.clients, access, put);
    }

    /// Says to those who are believed that others are not.
    fn not_believed(&mut self, now: Instant) -> Option<Said> {
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

/// Does a new client speak MAVLink? A place is for one that does.
fn begins_with_a_frame(bytes: &[u8]) -> bool {
    let mut decoder = MavlinkDecoder::<MavMessage>::new();
    bytes.iter().any(|byte| decoder.feed(*byte).is_some()) && decoder.discarded() == 0
}
