//! The services of the simulated StampFly, each at its port.

use super::configurator::CARD;
use super::seats::{Controls, Seats};
use super::{CONSOLE, MAVLINK_TCP, MAVLINK_UDP, MSP, MSP_SERIAL, PAGE, STREAM, Seen, TELEMETRY, TELLO, TELLO_STATE};
use crate::VehicleConfig;
use crate::console::{Command, Newest, Profile};
use crate::simulation::radio::Radio;
use crate::simulation::sensing::{Healths, Sensing};
use crate::simulation::terminal::{Desk, Terminal};
use crate::topics::ConsoleEnds;
use stampfly_flight::console::Request;
use stampfly_link::mavlink::dialects::common::MavType;
use stampfly_link::mavlink::signing::SigningKey;
use stampfly_services::mavlink::{Identity, Mavlink};
use stampfly_services::msp::Msp;
use stampfly_services::tello::Destination;
use stampfly_services::{Lease, Tello, View};
use stampfly_sim::ask::{Ask, Asked};
use stampfly_sim::fault::Injector;
use stampfly_sim::vehicle::{Client, Heard, Link, Live, Ports, Put, Speed};
use stampfly_types::Instant;
use std::sync::Arc;
use std::vec::Vec;

/// What is answered to what only a board can do.
const NOT_SIMULATED: &str = "not of a simulated vehicle";
/// What the simulated vehicle calls itself.
const VERSION: &str = concat!("stampfly ", env!("CARGO_PKG_VERSION"), ", simulated");
/// Ticks between two turns of the services that send by themselves: 20 ms.
const TURN: u32 = 4;

/// The services.
pub struct Services<'b> {
    pub(super) controls: Controls<'b>,
    pub(super) seen: &'b Seen,
    sensing: Sensing,
    health: &'b Healths,
    profile: &'b Profile,
    mavlink: Mavlink<Client>,
    /// Tells which ports are this machine's alone.
    ports: Arc<dyn Ports>,
    msp: Vec<(Client, Msp)>,
    tello: Tello<Client>,
    /// Number of the port that a Tello's state is sent to.
    tello_state: Option<u16>,
    telemetry: Option<Client>,
    terminals: Vec<(Client, Terminal)>,
    pub(super) faults: Injector,
    pub(super) speed: Option<Speed>,
}

impl<'b> Services<'b> {
    /// Those of this vehicle, which can be broken by these faults.
    pub fn new(
        live: &Live,
        radio: Radio<'b>,
        console: ConsoleEnds<'b>,
        (config, sensing): (&VehicleConfig, Sensing),
        faults: &Injector,
        (seen, health, profile): (&'b Seen, &'b Healths, &'b Profile),
    ) -> Self {
        let identity = Identity {
            system: u8::try_from(live.number + 1).unwrap_or(u8::MAX),
            kind: MavType::MAV_TYPE_QUADROTOR,
            take_off_height: 0.5,
            version: [0, 2, 0],
        };
        let controls = Controls {
            radio,
            console,
            lease: Lease::new(),
            places: seen.places.clone(),
            config: config.clone(),
            sticks: None,
        };
        Self {
            controls,
            seen,
            sensing,
            health,
            profile,
            mavlink: match live.ports.signing() {
                Some(signing) => Mavlink::new(identity).with_key(SigningKey::new(signing.key), signing.time),
                None => Mavlink::new(identity),
            },
            ports: live.ports.clone(),
            msp: Vec::new(),
            tello: Tello::new(),
            tello_state: None,
            telemetry: None,
            terminals: Vec::new(),
            faults: faults.clone(),
            speed: live.speed.clone(),
        }
    }

    /// What every command line of the vehicle shares.
    pub(super) fn desk<'d>(&self, newest: &'d Newest) -> Desk<'d>
    where
        Self: 'd,
    {
        Desk { version: VERSION, newest, sensing: self.sensing, health: self.health, profile: self.profile, facts: &[] }
    }

    fn type_in(&mut self, now: Instant, from: Client, keys: &[u8], put: Put<'_>) {
        let seen = self.seen;
        let newest = seen.newest.borrow();
        let desk = self.desk(&newest);
        let Some((_, terminal)) = self.terminals.iter_mut().find(|(client, _)| *client == from) else { return };
        let Controls { config, console, .. } = &mut self.controls;
        terminal.send(now, keys, &desk, (config, console), |request, config| obey(request, seen, config));
        put(&from, core::mem::take(&mut terminal.screen).as_bytes());
    }
}

/// What a board would do, as far as a simulated one does it. The console hands it out only while the vehicle is disarmed.
pub(super) fn obey(request: &Request<Command>, seen: &Seen, config: &VehicleConfig) -> &'static str {
    match request {
        Request::SaveParameters => {
            seen.kept.replace(Some(config.clone()));
            "saved, for the next start"
        }
        Request::ResetParameters => {
            seen.kept.replace(Some(VehicleConfig::default()));
            "erased; the next start has the vehicle's own"
        }
        Request::Reboot => {
            seen.restarts.set(true);
            "restarting"
        }
        _ => NOT_SIMULATED,
    }
}

impl Link for Services<'_> {
    fn hear(&mut self, now: Instant, from: Client, heard: Heard<'_>, put: Put<'_>) {
        let newest = self.seen.newest.borrow();
        let mut cockpit = Seats { controls: &mut self.controls, newest: &newest, seen: self.seen };
        match (from.port, heard) {
            (MAVLINK_UDP | MAVLINK_TCP, Heard::Opened) if self.ports.is_local(from.port) => {
                self.mavlink.open_local(now, from, true);
            }
            (MAVLINK_UDP | MAVLINK_TCP, Heard::Opened) => self.mavlink.open(now, from, true),
            (MAVLINK_UDP | MAVLINK_TCP, Heard::Bytes(bytes)) => {
                if self.ports.is_local(from.port) {
                    self.mavlink.open_local(now, from, false);
                }
                self.mavlink.hear(now, from, bytes, &mut cockpit, put);
            }
            (MAVLINK_UDP | MAVLINK_TCP, Heard::Closed) => self.mavlink.close(from),
            (TELLO, Heard::Bytes(text)) => {
                let tello_state = self.tello_state;
                self.tello.hear(now, from, text, &mut cockpit, &mut |to, what, bytes| {
                    put(&destination(*to, what, tello_state), bytes);
                });
            }
            (TELLO_STATE, Heard::Opened) => self.tello_state = Some(from.address.port()),
            (TELEMETRY, Heard::Opened) => self.telemetry = Some(from),
            (STREAM, Heard::Bytes(request)) => self.seen.stream.borrow_mut().hear(now, from, request),
            (CONSOLE, Heard::Opened) => {
                let mut terminal = Terminal::new();
                terminal.greet(VERSION);
                put(&from, core::mem::take(&mut terminal.screen).as_bytes());
                self.terminals.push((from, terminal));
            }
            (CONSOLE, Heard::Bytes(keys)) => {
                drop(newest);
                self.type_in(now, from, keys, put);
            }
            (PAGE, Heard::Bytes(text)) => {
                drop(newest);
                let asked = core::str::from_utf8(text).ok().and_then(|text| Asked::parse(text).ok());
                let Some(asked) = asked else { return };
                let answer = self.page(now, &asked.ask);
                // What is said again and again needs no answer.
                if !matches!(asked.ask, Ask::Sticks(_) | Ask::Alive {}) {
                    put(&from, asked.answered(answer).as_bytes());
                }
            }
            (MSP | MSP_SERIAL, Heard::Opened) => self.msp.push((from, Msp::new(&CARD))),
            (MSP | MSP_SERIAL, Heard::Bytes(bytes)) => {
                if let Some((_, msp)) = self.msp.iter_mut().find(|(client, _)| *client == from) {
                    msp.hear(now, bytes, &mut cockpit, &mut |frame| put(&from, frame));
                }
            }
            (MSP | MSP_SERIAL, Heard::Closed) => self.msp.retain(|(client, _)| *client != from),
            (CONSOLE, Heard::Closed) => self.terminals.retain(|(client, _)| *client != from),
            _ => {}
        }
    }

    fn answer(&mut self, now: Instant, tick: u32, put: Put<'_>) {
        let newest = self.seen.newest.borrow();
        self.controls.poll(now, &newest);
        let view = View::new(&*newest, &self.seen.places);
        self.seen.stream.borrow_mut().poll(now, &view, put);
        if let Some(to) = &self.telemetry {
            self.seen.telemetry.borrow_mut().poll(now, &view, &mut |packet| put(to, packet));
        }
        if !tick.is_multiple_of(TURN) {
            return;
        }
        let mut cockpit = Seats { controls: &mut self.controls, newest: &newest, seen: self.seen };
        self.mavlink.poll(now, &mut cockpit, put);
        let tello_state = self.tello_state;
        self.tello.poll(now, &mut cockpit, &mut |to, what, bytes| put(&destination(*to, what, tello_state), bytes));
    }
}

/// A Tello's state goes to another port of the program's machine.
fn destination(program: Client, what: Destination, state: Option<u16>) -> Client {
    match (what, state) {
        (Destination::State, Some(number)) => {
            Client { port: TELLO_STATE, address: (program.address.ip(), number).into() }
        }
        _ => program,
    }
}
