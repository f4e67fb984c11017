//! The mission protocol: upload, download, clear, and what stations are told while a mission is flown.
//!
//! From [Mission Protocol](https://mavlink.io/en/services/mission.html). An upload is one conversation at a time: the vehicle asks for one item after the other,
//! again when none comes, and gives up after a while. The mission that is in force is replaced when the last item of the new one has come, and not while it is
//! flown. Geofences and rally points are kinds of missions that this vehicle does not have: their lists are empty, and uploads of them refused.

use super::client::{Client, Put};
use super::identity::{Identity, Own};
use super::item::Item;
use super::said::Said;
use super::streams::text;
use crate::cockpit::Cockpit;
use crate::mission::{Event, Runner, Step};
use core::fmt::Write;
use heapless::{String, Vec};
use stampfly_link::mavlink::dialects::common::*;
use stampfly_types::{Duration, Instant};

/// Items of a mission, unless a vehicle has room for another number.
pub const ITEMS: usize = 64;
/// An item that has not come is asked for again after this long, and so many times: the protocol's own figures.
const AGAIN: Duration = Duration::from_millis(250);
const RETRIES: u8 = 5;

type Kind = MavMissionType;
type Answer = MavMissionResult;
const MISSION: Kind = Kind::MAV_MISSION_TYPE_MISSION;

/// An upload that is going on.
#[derive(Clone, Debug)]
struct Upload<C, const ITEMS: usize> {
    from: C,
    /// System and component that uploads.
    target: [u8; 2],
    count: usize,
    items: Vec<Item, ITEMS>,
    asked: Instant,
    retries: u8,
}

/// The mission, who uploads the next one, and how far it is flown.
#[derive(Clone, Debug)]
pub(super) struct Missions<C, const ITEMS: usize> {
    items: Vec<Item, ITEMS>,
    upload: Option<Upload<C, ITEMS>>,
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
        Self { items: Vec::new(), upload: None, runner: Runner::new(identity.take_off_height, identity.reach), id: 0 }
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

    /// A station wants to upload so many items.
    pub fn count(
        &mut self,
        now: Instant,
        client: &mut Client<C>,
        from: u8,
        request: &MISSION_COUNT_DATA,
        put: Put<'_, C>,
    ) {
        let (target, count) = ([from, 0], usize::from(request.count));
        let busy = self.upload.as_ref().is_some_and(|upload| upload.from != client.id);
        let refusal = match request.mission_type {
            Kind::MAV_MISSION_TYPE_MISSION if self.runner.is_running() || busy => Answer::MAV_MISSION_DENIED,
            Kind::MAV_MISSION_TYPE_MISSION if count > ITEMS => Answer::MAV_MISSION_NO_SPACE,
            Kind::MAV_MISSION_TYPE_MISSION if count == 0 => {
                self.items.clear();
                return self.replace(client, target, put);
            }
            Kind::MAV_MISSION_TYPE_MISSION => {
                let from = client.id;
                self.upload = Some(Upload { from, target, count, items: Vec::new(), asked: now, retries: 0 });
                return ask(client, target, 0, put);
            }
            _ => Answer::MAV_MISSION_UNSUPPORTED,
        };
        acknowledge(client, target, (refusal, request.mission_type, 0), put);
    }

    /// An item has come.
    pub fn item(
        &mut self,
        now: Instant,
        client: &mut Client<C>,
        own: &Own,
        from: u8,
        (seq, kind, item): (u16, Kind, Option<Item>),
        put: Put<'_, C>,
    ) {
        let target = [from, 0];
        let known = self.upload.as_mut().filter(|upload| upload.from == client.id && kind == MISSION);
        let Some(upload) = known else {
            return acknowledge(client, target, (Answer::MAV_MISSION_ERROR, kind, 0), put);
        };
        let expected = upload.items.len();
        if usize::from(seq) != expected {
            // One that came twice, or too early.
            (upload.asked, upload.target) = (now, target);
            return ask(client, target, expected, put);
        }
        // One that could not be read is of a command or frame that is not known here.
        let item = item.ok_or(Answer::MAV_MISSION_UNSUPPORTED);
        let sound = item.and_then(|item| item.step(own.origin.as_ref(), own.identity.take_off_height).map(|_| item));
        let stored = sound.and_then(|item| upload.items.push(item).map_err(|_| Answer::MAV_MISSION_NO_SPACE));
        if let Err(refusal) = stored {
            self.upload = None;
            return acknowledge(client, target, (refusal, MISSION, 0), put);
        }
        (upload.asked, upload.retries) = (now, 0);
        let next = upload.items.len();
        if next < upload.count {
            return ask(client, target, next, put);
        }
        if self.runner.is_running() {
            acknowledge(client, target, (Answer::MAV_MISSION_DENIED, MISSION, 0), put);
        } else {
            core::mem::swap(&mut self.items, &mut upload.items);
            self.replace(client, target, put);
        }
        self.upload = None;
    }

    fn replace(&mut self, client: &mut Client<C>, target: [u8; 2], put: Put<'_, C>) {
        self.runner.reset();
        self.id = if self.items.is_empty() { 0 } else { self.id.wrapping_add(1).max(1) };
        acknowledge(client, target, (Answer::MAV_MISSION_ACCEPTED, MISSION, self.id), put);
        client.send(&self.state(), put);
    }

    /// A station wants to know how many there are.
    pub fn list(&self, client: &mut Client<C>, from: u8, kind: Kind, put: Put<'_, C>) {
        let is_mission = kind == MISSION;
        let data = MISSION_COUNT_DATA {
            count: if is_mission { self.items.len() as u16 } else { 0 },
            target_system: from,
            target_component: 0,
            mission_type: kind,
            opaque_id: if is_mission { self.id } else { 0 },
        };
        client.send(&data.into(), put);
    }

    /// A station wants one.
    pub fn request(&self, client: &mut Client<C>, from: u8, (seq, kind): (u16, Kind), put: Put<'_, C>) {
        match self.items.get(usize::from(seq)).filter(|_| kind == MISSION) {
            Some(item) => {
                let message = item.message(seq, usize::from(seq) == self.runner.current(), [from, 0]);
                client.send(&message, put);
            }
            None => acknowledge(client, [from, 0], (Answer::MAV_MISSION_INVALID_SEQUENCE, kind, 0), put),
        }
    }

    /// A station wants none. One that is flown is not taken away.
    pub fn clear(&mut self, client: &mut Client<C>, from: u8, kind: Kind, put: Put<'_, C>) {
        match kind {
            Kind::MAV_MISSION_TYPE_MISSION | Kind::MAV_MISSION_TYPE_ALL if self.runner.is_running() => {
                acknowledge(client, [from, 0], (Answer::MAV_MISSION_DENIED, kind, 0), put);
            }
            Kind::MAV_MISSION_TYPE_MISSION | Kind::MAV_MISSION_TYPE_ALL => {
                self.items.clear();
                (self.upload, self.id) = (None, 0);
                self.runner.reset();
                acknowledge(client, [from, 0], (Answer::MAV_MISSION_ACCEPTED, kind, 0), put);
            }
            // There are none.
            _ => acknowledge(client, [from, 0], (Answer::MAV_MISSION_ACCEPTED, kind, 0), put),
        }
    }

    /// A station has all, or breaks its upload off.
    pub fn acknowledged(&mut self, client: &Client<C>, ack: &MISSION_ACK_DATA) {
        let breaks_off = ack.mavtype != Answer::MAV_MISSION_ACCEPTED && ack.mission_type == MISSION;
        if breaks_off && self.upload.as_ref().is_some_and(|upload| upload.from == client.id) {
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

    /// Asks again for items that did not come, flies on, and tells everybody. Call it about fifty times a second.
    pub fn poll(
        &mut self,
        now: Instant,
        own: &Own,
        clients: &mut [Client<C>],
        cockpit: &mut dyn Cockpit,
        put: Put<'_, C>,
    ) {
        if let Some(upload) = self.upload.as_mut().filter(|upload| now.since(upload.asked) >= AGAIN) {
            let (target, next) = (upload.target, upload.items.len());
            let client = clients.iter_mut().find(|client| client.id == upload.from);
            (upload.asked, upload.retries) = (now, upload.retries.saturating_add(1));
            match client {
                Some(client) if upload.retries <= RETRIES => ask(client, target, next, put),
                Some(client) => {
                    acknowledge(client, target, (Answer::MAV_MISSION_OPERATION_CANCELLED, MISSION, 0), put);
                    self.upload = None;
                }
                None => self.upload = None,
            }
        }
        let items = &self.items;
        let Some(event) = self.runner.poll(now, cockpit, &|place| Self::step(items, own, place)) else { return };
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
