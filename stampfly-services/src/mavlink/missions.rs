//! The mission protocol: upload, download, clear, and what stations are told while a mission is flown.
//!
//! From [Mission Protocol](https://mavlink.io/en/services/mission.html). One partner uploads at a
//! time, told apart by its connection, system and component, because routers put several stations
//! on one connection; others are denied meanwhile. The vehicle asks for one item after the other.
//! It asks again when none comes in time, and never because of an item that it did not wait for: an
//! answer to each duplicate would double the questions with every item. The time that it waits is
//! twice the round trip that was seen last, doubles with each question that stays unanswered, and
//! the upload is given up after as many questions as the protocol says.
//!
//! The mission that is in force is replaced when the last item of the new one has come, and not
//! while it is flown. A partner that sends its last item again has not heard that it was accepted,
//! and is told again. Geofences and rally points are kinds of missions that this vehicle does not
//! have: their lists are empty, and uploads of them refused.

use super::client::{Client, Put};
use super::identity::{Identity, Own};
use super::item::Item;
use super::said::Said;
use super::streams::text;
use crate::access::VehicleAccess;
use crate::mission::{Event, Runner, Step};
use core::fmt::Write;
use heapless::{String, Vec};
use stampfly_link::mavlink::dialects::common::*;
use stampfly_types::{Duration, Instant};

/// Items of a mission, unless a vehicle has room for another number.
pub const ITEMS: usize = 64;
/// An item that has not come is asked for again after this long at the soonest, and so many times:
/// the protocol's own figures.
const SOONEST: Duration = Duration::from_millis(250);
const RETRIES: u8 = 5;
/// And after this long while no round trip was seen: a link of 1.2 s that delays some frames by half
/// as much brings the first item before the third question.
const FIRST: Duration = Duration::from_millis(900);
/// And after this long at the latest: a partner that is gone holds the others up for 15 s, or 18 s
/// where a round trip takes more than a second.
const LATEST: Duration = Duration::from_secs(3);

type Kind = MavMissionType;
type Answer = MavMissionResult;
const MISSION: Kind = Kind::MAV_MISSION_TYPE_MISSION;

/// Who uploads or has uploaded: a connection, and the system and component there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Partner<C> {
    client: C,
    address: [u8; 2],
}

/// An upload that is going on.
#[derive(Clone, Debug)]
struct Upload<C, const ITEMS: usize> {
    partner: Partner<C>,
    count: u16,
    items: Vec<Item, ITEMS>,
    /// When the item that is missing was asked for last, and how many times.
    asked: Instant,
    questions: u8,
    /// It is asked for again after this long.
    patience: Duration,
    /// The shortest round trip that was seen, from the only question for an item until it came;
    /// zero before the first.
    round_trip: Duration,
}

impl<C, const ITEMS: usize> Upload<C, ITEMS> {
    /// The item that was asked for has come. Only one that was asked for once tells how long a
    /// round trip takes: another may be the answer to any of the questions.
    fn has_come(&mut self, now: Instant) {
        if self.questions == 1 {
            let round_trip = now.since(self.asked);
            let is_shorter = self.round_trip == Duration::ZERO || round_trip < self.round_trip;
            self.round_trip = if is_shorter { round_trip } else { self.round_trip };
            self.patience = (round_trip * 2).max(SOONEST).min(LATEST);
        }
        (self.asked, self.questions) = (now, 1);
    }

    /// It is asked for again.
    fn asks_again(&mut self, now: Instant) {
        self.patience = (self.patience * 2).min(LATEST);
        (self.asked, self.questions) = (now, self.questions.saturating_add(1));
    }
}

/// The upload that was accepted last, and how long a round trip took.
#[derive(Clone, Copy, Debug)]
struct Accepted<C> {
    partner: Partner<C>,
    count: u16,
    at: Instant,
    round_trip: Duration,
}

/// The mission, who uploads the next one, and how far it is flown.
#[derive(Clone, Debug)]
pub(super) struct Missions<C, const ITEMS: usize> {
    items: Vec<Item, ITEMS>,
    upload: Option<Upload<C, ITEMS>>,
    accepted: Option<Accepted<C>>,
    pub runner: Runner,
    /// A number that changes with the mission; zero is none.
    id: u32,
}

fn acknowledge<C>(
    client: &mut Client<C>,
    target: [u8; 2],
    (mavtype, mission_type, id): (Answer, Kind, u32),
    put: Put<'_, C>,
) {
    let [target_system, target_component] = target;
    let data = MISSION_ACK_DATA { target_system, target_component, mavtype, mission_type, opaque_id: id };
    client.send(&data.into(), put);
}

fn ask<C>(client: &mut Client<C>, [target_system, target_component]: [u8; 2], seq: usize, put: Put<'_, C>) {
    let seq = u16::try_from(seq).unwrap_or(u16::MAX);
    let data = MISSION_REQUEST_INT_DATA { seq, target_system, target_component, mission_type: MISSION };
    client.send(&data.into(), put);
}

impl<C: Copy + PartialEq, const ITEMS: usize> Missions<C, ITEMS> {
    pub const fn new(identity: &Identity) -> Self {
        let runner = Runner::new(identity.take_off_height, identity.reach);
        Self { items: Vec::new(), upload: None, accepted: None, runner, id: 0 }
    }

    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Are its places on Earth, so that another origin would move them?
    pub fn is_global(&self) -> bool {
        self.items.iter().any(Item::is_global)
    }

    /// The step at this place.
    fn step(items: &[Item], own: &Own, place: usize) -> Option<Step> {
        items.get(place)?.step(own.origin.as_ref(), own.identity.take_off_height).ok()
    }

    /// Another partner than this one uploads.
    fn is_busy(&self, partner: &Partner<C>) -> bool {
        self.upload.as_ref().is_some_and(|upload| upload.partner != *partner)
    }

    /// Has this partner said so already, and is the first item still to come? The timer asks for it.
    fn is_begun(&self, partner: &Partner<C>, count: u16) -> bool {
        let upload = self.upload.as_ref().filter(|upload| upload.partner == *partner && upload.count == count);
        upload.is_some_and(|upload| upload.items.is_empty())
    }

    /// A station wants to upload so many items. One that says so during its own upload begins
    /// again, once an item has come.
    pub fn count(
        &mut self,
        now: Instant,
        client: &mut Client<C>,
        address: [u8; 2],
        request: &MISSION_COUNT_DATA,
        put: Put<'_, C>,
    ) {
        let (partner, count) = (Partner { client: client.id, address }, request.count);
        let refusal = match request.mission_type {
            Kind::MAV_MISSION_TYPE_MISSION if self.is_busy(&partner) => Answer::MAV_MISSION_DENIED,
            Kind::MAV_MISSION_TYPE_MISSION if self.is_begun(&partner, count) => return,
            Kind::MAV_MISSION_TYPE_MISSION if self.is_echo(now, &partner, count) => {
                return acknowledge(client, address, (Answer::MAV_MISSION_ACCEPTED, MISSION, self.id), put);
            }
            Kind::MAV_MISSION_TYPE_MISSION => match self.begin(now, partner, count) {
                Ok(0) => return self.replace(client, address, put),
                Ok(_) => return ask(client, address, 0, put),
                Err(refusal) => refusal,
            },
            _ => Answer::MAV_MISSION_UNSUPPORTED,
        };
        acknowledge(client, address, (refusal, request.mission_type, 0), put);
    }

    /// Is this count the one of the upload that was accepted just now, come twice? A station that
    /// begins another upload has read the acknowledgement before: that takes a round trip, and
    /// half of the shortest is left for stations that read faster than they write.
    fn is_echo(&self, now: Instant, partner: &Partner<C>, count: u16) -> bool {
        let last = self.accepted.as_ref().filter(|_| self.upload.is_none());
        last.is_some_and(|last| {
            last.partner == *partner && last.count == count && now.since(last.at) < last.round_trip / 2
        })
    }

    /// Begins an upload, or says why not. Without items it is over at once.
    fn begin(&mut self, now: Instant, partner: Partner<C>, count: u16) -> Result<u16, Answer> {
        // Begun again, the first item may be the answer to an earlier question.
        let begins_again = self.upload.is_some();
        (self.upload, self.accepted) = (None, None);
        if self.runner.is_running() {
            return Err(Answer::MAV_MISSION_DENIED);
        }
        if usize::from(count) > ITEMS {
            return Err(Answer::MAV_MISSION_NO_SPACE);
        }
        if count == 0 {
            self.items.clear();
            return Ok(0);
        }
        self.upload = Some(Upload {
            partner,
            count,
            items: Vec::new(),
            asked: now,
            questions: 1 + u8::from(begins_again),
            patience: FIRST,
            round_trip: Duration::ZERO,
        });
        Ok(count)
    }

    /// An item has come.
    pub fn item(
        &mut self,
        now: Instant,
        client: &mut Client<C>,
        own: &Own,
        address: [u8; 2],
        (seq, kind, item): (u16, Kind, Option<Item>),
        put: Put<'_, C>,
    ) {
        let partner = Partner { client: client.id, address };
        let known = self.upload.as_mut().filter(|upload| upload.partner == partner && kind == MISSION);
        let Some(upload) = known else {
            return self.stray(client, &partner, (seq, kind), put);
        };
        if usize::from(seq) != upload.items.len() {
            // It came twice, or before another one. The timer asks for the one that is missing.
            return;
        }
        // One that could not be read is of a command or frame that is not known here.
        let item = item.ok_or(Answer::MAV_MISSION_UNSUPPORTED);
        let sound = item.and_then(|item| item.step(own.origin.as_ref(), own.identity.take_off_height).map(|_| item));
        let stored = sound.and_then(|item| upload.items.push(item).map_err(|_| Answer::MAV_MISSION_NO_SPACE));
        if let Err(refusal) = stored {
            self.upload = None;
            return acknowledge(client, address, (refusal, MISSION, 0), put);
        }
        upload.has_come(now);
        let next = upload.items.len();
        if next < usize::from(upload.count) {
            return ask(client, address, next, put);
        }
        let (count, round_trip) = (upload.count, upload.round_trip);
        if self.runner.is_running() {
            self.upload = None;
            return acknowledge(client, address, (Answer::MAV_MISSION_DENIED, MISSION, 0), put);
        }
        let is_new = self.items.len() != next || !self.items.iter().zip(&upload.items).all(|(old, new)| old.is(new));
        core::mem::swap(&mut self.items, &mut upload.items);
        self.upload = None;
        self.accepted = Some(Accepted { partner, count, at: now, round_trip });
        // A mission that was there already keeps its number.
        if is_new {
            return self.replace(client, address, put);
        }
        self.runner.reset();
        acknowledge(client, address, (Answer::MAV_MISSION_ACCEPTED, MISSION, self.id), put);
    }

    /// An item that belongs to no upload of its sender.
    fn stray(&self, client: &mut Client<C>, partner: &Partner<C>, (seq, kind): (u16, Kind), put: Put<'_, C>) {
        let accepted = self.accepted.as_ref().filter(|accepted| accepted.partner == *partner && kind == MISSION);
        let answer = match accepted {
            // Its partner was denied, and must not think that the upload of another one has failed.
            _ if self.is_busy(partner) => return,
            Some(accepted) if seq.checked_add(1) == Some(accepted.count) => {
                (Answer::MAV_MISSION_ACCEPTED, MISSION, self.id)
            }
            // One that was on its way for long.
            Some(accepted) if seq < accepted.count => return,
            _ => (Answer::MAV_MISSION_ERROR, kind, 0),
        };
        acknowledge(client, partner.address, answer, put);
    }

    fn replace(&mut self, client: &mut Client<C>, target: [u8; 2], put: Put<'_, C>) {
        self.runner.reset();
        self.id = if self.items.is_empty() { 0 } else { self.id.wrapping_add(1).max(1) };
        acknowledge(client, target, (Answer::MAV_MISSION_ACCEPTED, MISSION, self.id), put);
        client.send(&self.state(), put);
    }

    /// A station wants something that is not done with missions.
    pub fn refuse(&self, client: &mut Client<C>, to: [u8; 2], kind: Kind, put: Put<'_, C>) {
        acknowledge(client, to, (Answer::MAV_MISSION_UNSUPPORTED, kind, 0), put);
    }

    /// A station wants to know how many there are.
    pub fn list(
        &self,
        client: &mut Client<C>,
        [target_system, target_component]: [u8; 2],
        kind: Kind,
        put: Put<'_, C>,
    ) {
        let is_mission = kind == MISSION;
        let data = MISSION_COUNT_DATA {
            count: if is_mission { self.items.len() as u16 } else { 0 },
            target_system,
            target_component,
            mission_type: kind,
            opaque_id: if is_mission { self.id } else { 0 },
        };
        client.send(&data.into(), put);
    }

    /// A station wants one, in any order and as often as it likes.
    pub fn request(&self, client: &mut Client<C>, to: [u8; 2], (seq, kind): (u16, Kind), put: Put<'_, C>) {
        match self.items.get(usize::from(seq)).filter(|_| kind == MISSION) {
            Some(item) => {
                let message = item.message(seq, usize::from(seq) == self.runner.current(), to);
                client.send(&message, put);
            }
            None => acknowledge(client, to, (Answer::MAV_MISSION_INVALID_SEQUENCE, kind, 0), put),
        }
    }

    /// A station wants none. One that is flown, or that another partner is about to replace, is not
    /// taken away.
    pub fn clear(&mut self, client: &mut Client<C>, address: [u8; 2], kind: Kind, put: Put<'_, C>) {
        let partner = Partner { client: client.id, address };
        let is_mission = matches!(kind, Kind::MAV_MISSION_TYPE_MISSION | Kind::MAV_MISSION_TYPE_ALL);
        if is_mission && (self.runner.is_running() || self.is_busy(&partner)) {
            return acknowledge(client, address, (Answer::MAV_MISSION_DENIED, kind, 0), put);
        }
        if is_mission {
            self.items.clear();
            (self.upload, self.accepted, self.id) = (None, None, 0);
            self.runner.reset();
        }
        // Of other kinds there are none.
        acknowledge(client, address, (Answer::MAV_MISSION_ACCEPTED, kind, 0), put);
    }

    /// A station has all, or breaks its upload off.
    pub fn acknowledged(&mut self, client: &Client<C>, address: [u8; 2], ack: &MISSION_ACK_DATA) {
        let partner = Partner { client: client.id, address };
        let breaks_off = ack.mavtype != Answer::MAV_MISSION_ACCEPTED && ack.mission_type == MISSION;
        if breaks_off && !self.is_busy(&partner) {
            self.upload = None;
        }
    }

    /// A connection is gone, and an upload over it.
    pub fn forget(&mut self, client: C) {
        if self.upload.as_ref().is_some_and(|upload| upload.partner.client == client) {
            self.upload = None;
        }
    }

    /// Flies on with the item at this place. Says whether there is one.
    pub fn set_current(&mut self, place: usize) -> bool {
        let is_there = place < self.items.len();
        if is_there {
            self.runner.set_current(place);
        }
        is_there
    }

    /// How far it is flown.
    pub fn state(&self) -> Said {
        let last = self.items.len().saturating_sub(1);
        let (mission_state, mission_mode) = match &self.runner {
            _ if self.items.is_empty() => (MissionState::MISSION_STATE_NO_MISSION, 2),
            runner if runner.is_running() => (MissionState::MISSION_STATE_ACTIVE, 1),
            runner if runner.is_finished() => (MissionState::MISSION_STATE_COMPLETE, 2),
            runner if runner.is_halted() => (MissionState::MISSION_STATE_PAUSED, 2),
            _ => (MissionState::MISSION_STATE_NOT_STARTED, 2),
        };
        let data = MISSION_CURRENT_DATA {
            seq: self.runner.current().min(last) as u16,
            total: self.items.len() as u16,
            mission_state,
            mission_mode,
            mission_id: self.id,
            ..Default::default()
        };
        data.into()
    }

    /// Asks again for an item that did not come, or gives the upload up.
    fn ask_again(&mut self, now: Instant, clients: &mut [Client<C>], put: Put<'_, C>) {
        let Some(upload) = self.upload.as_mut().filter(|upload| now.since(upload.asked) >= upload.patience) else {
            return;
        };
        let Partner { client, address } = upload.partner;
        let client = clients.iter_mut().find(|known| known.id == client);
        match client {
            Some(client) if upload.questions <= RETRIES => {
                upload.asks_again(now);
                ask(client, address, upload.items.len(), put);
            }
            Some(client) => {
                acknowledge(client, address, (Answer::MAV_MISSION_OPERATION_CANCELLED, MISSION, 0), put);
                self.upload = None;
            }
            None => self.upload = None,
        }
    }

    /// Asks again for items that did not come, flies on, and tells everybody. Call it about fifty times a second.
    pub fn poll(
        &mut self,
        now: Instant,
        own: &Own,
        clients: &mut [Client<C>],
        access: &mut dyn VehicleAccess,
        put: Put<'_, C>,
    ) {
        self.ask_again(now, clients, put);
        let items = &self.items;
        let Some(event) = self.runner.poll(now, access, &|place| Self::step(items, own, place)) else { return };
        let mut words = String::<50>::new();
        let told: Said = match event {
            Event::Reached(place) => MISSION_ITEM_REACHED_DATA { seq: place as u16 }.into(),
            Event::Finished => text(MavSeverity::MAV_SEVERITY_INFO, "mission complete", ""),
            // What does not fit is cut off.
            Event::Halted(why) => {
                _ = write!(words, "{why}");
                text(MavSeverity::MAV_SEVERITY_WARNING, "mission halted: ", &words)
            }
        };
        let state = self.state();
        for client in clients.iter_mut().filter(|client| client.is_served()) {
            client.send(&told, put);
            client.send(&state, put);
        }
    }
}
