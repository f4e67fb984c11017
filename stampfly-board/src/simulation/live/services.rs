//! The services of the simulated StampFly, each at its port.

use super::cable::Cable;
use super::handling::Handling;
use super::requesters::{Board, Controls, obey};
use super::sealed::Sealed;
use super::{ABOUT, CONSOLE, SEALED, STREAM, Seen, TELEMETRY, TELLO, TELLO_STATE, USB, USB_TCP};
use crate::VehicleConfig;
use crate::console::{Newest, Profile};
use crate::simulation::radio::Radio;
use crate::simulation::sensing::{Healths, Sensing};
use crate::simulation::terminal::{StationRequests, Terminal};
use crate::topics::ConsoleEnds;
use stampfly_param::ChangeDetector;
use stampfly_services::tello::Destination;
use stampfly_services::{Tello, View};
use stampfly_sim::World;
use stampfly_sim::ask::Reply;
use stampfly_sim::fault::Injector;
use stampfly_sim::ground::{Ground, TURN};
use stampfly_sim::vehicle::{Client, Heard, Link, Live, Put};
use stampfly_types::Instant;
use std::rc::Rc;
use std::vec::Vec;

/// What the simulated vehicle calls itself.
const VERSION: &str = concat!("stampfly ", env!("CARGO_PKG_VERSION"), ", simulated");
/// Ticks between two turns of a cable: 10 ms.
const CABLE: u32 = 2;

/// The services.
pub struct Services<'b> {
    controls: Controls<'b>,
    seen: &'b Seen,
    sensing: Sensing,
    health: &'b Healths,
    profile: &'b Profile,
    cables: Vec<(Client, Cable)>,
    sealed: Sealed,
    tello: Tello<Client>,
    /// Number of the port that a Tello's state is sent to.
    tello_state: Option<u16>,
    telemetry: Option<Client>,
    terminals: Vec<(Client, Terminal)>,
    handling: Rc<Handling>,
}

impl<'b> Services<'b> {
    /// Those of this vehicle, which can be broken by these faults.
    pub fn new(
        live: &Live,
        radio: Radio<'b>,
        console: ConsoleEnds<'b>,
        (config, sensing): (&VehicleConfig, Sensing),
        (faults, world): (&Injector, &World),
        (seen, health, profile): (&'b Seen, &'b Healths, &'b Profile),
    ) -> Self {
        let actions =
            Board { radio, console, config: config.clone(), detector: ChangeDetector::new(config.clone()), seen };
        let mut controls = Ground::new(&ABOUT, live, faults, actions);
        if let Some(signing) = live.ports.signing() {
            Sealed::open(signing.key, &mut controls);
        }
        Self {
            controls,
            seen,
            sensing,
            health,
            profile,
            cables: Vec::new(),
            sealed: Sealed::new(config),
            tello: Tello::new(),
            tello_state: None,
            telemetry: None,
            terminals: Vec::new(),
            handling: Rc::new(Handling::new(world)),
        }
    }

    /// What every command line of the vehicle shares.
    fn requests<'d>(&self, newest: &'d Newest) -> StationRequests<'d>
    where
        Self: 'd,
    {
        let Self { sensing, health, profile, ref handling, .. } = *self;
        let beside = Some(handling.clone());
        StationRequests { version: VERSION, newest, sensing, health, profile, facts: &[], beside }
    }

    /// A cable's turn: what has come over it, and whether it is late; or what is due.
    fn plug(&mut self, now: Instant, from: Client, bytes: Option<(&[u8], bool)>, put: Put<'_>) {
        let seen = self.seen;
        let newest = seen.newest.borrow();
        let requests = self.requests(&newest);
        let Some((_, cable)) = self.cables.iter_mut().find(|(client, _)| *client == from) else { return };
        // One write a turn, however many frames.
        let mut sent = Vec::new();
        let mut send = |bytes: &[u8]| sent.extend_from_slice(bytes);
        match bytes {
            Some(bytes) => cable.hear(now, bytes, &mut self.controls, &requests, &mut send),
            None => cable.poll(now, from, &mut self.controls, &requests, &mut send),
        }
        if !sent.is_empty() {
            put(&from, &sent);
        }
    }

    fn type_in(&mut self, now: Instant, from: Client, keys: &[u8], put: Put<'_>) {
        let seen = self.seen;
        let newest = seen.newest.borrow();
        let requests = self.requests(&newest);
        let Some((_, terminal)) = self.terminals.iter_mut().find(|(client, _)| *client == from) else { return };
        let Board { config, console, .. } = &mut self.controls.actions;
        terminal.send(now, keys, &requests, (config, console), |request, config| obey(request, seen, config));
        put(&from, core::mem::take(&mut terminal.screen).as_bytes());
    }
}

impl Link for Services<'_> {
    fn hear(&mut self, now: Instant, from: Client, heard: Heard<'_>, put: Put<'_>) {
        let newest = self.seen.newest.borrow();
        match (from.port, heard) {
            (TELLO, Heard::Bytes(text) | Heard::Late(text)) => {
                let tello_state = self.tello_state;
                let mut access = self.controls.seated(&*newest);
                let answer = &mut |to: &Client, what, bytes: &[u8]| {
                    destination(*to, what, tello_state).into_iter().for_each(|to| put(&to, bytes));
                };
                match heard {
                    Heard::Late(_) => self.tello.hear_late(now, from, text, &mut access, answer),
                    _ => self.tello.hear(now, from, text, &mut access, answer),
                }
            }
            (TELLO_STATE, Heard::Opened) => self.tello_state = Some(from.address.port()),
            (TELEMETRY, Heard::Opened) => self.telemetry = Some(from),
            (STREAM, Heard::Bytes(request) | Heard::Late(request)) => {
                self.seen.stream.borrow_mut().hear(now, from, request)
            }
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
            (CONSOLE, Heard::Late(_)) => {
                let terminal = self.terminals.iter_mut().find(|(client, _)| *client == from);
                terminal.into_iter().for_each(|(_, terminal)| terminal.expire());
            }
            (USB | USB_TCP, Heard::Opened) => {
                let config = &self.controls.actions.config;
                self.cables.push((from, Cable::new(self.controls.identity(), config)));
            }
            (USB | USB_TCP, Heard::Bytes(bytes) | Heard::Late(bytes)) => {
                drop(newest);
                self.plug(now, from, Some((bytes, matches!(heard, Heard::Late(_)))), put);
            }
            (USB | USB_TCP, Heard::Closed) => {
                if let Some((_, cable)) = self.cables.iter_mut().find(|(client, _)| *client == from) {
                    cable.close(&mut self.controls.seated(&*newest));
                }
                self.seen.subscription.borrow_mut().ask(now, from, false);
                self.cables.retain(|(client, _)| *client != from);
            }
            // Frames have times of their own.
            (SEALED, Heard::Bytes(bytes) | Heard::Late(bytes)) => {
                self.sealed.hear(now, from, bytes, &mut self.controls, put)
            }
            (CONSOLE, Heard::Closed) => self.terminals.retain(|(client, _)| *client != from),
            (_, heard) => {
                let (requests, seen) = (self.requests(&newest), self.seen);
                let console = &mut |Board { config, console, .. }: &mut Board<'_>, line: &str| {
                    let mut terminal = Terminal::new();
                    let keys = std::format!("{line}\r");
                    let board = |request: &_, config: &_| obey(request, seen, config);
                    terminal.send(now, keys.as_bytes(), &requests, (config, console), board);
                    // Without the echo and the prompt.
                    let screen = terminal.screen.strip_prefix(line).unwrap_or(&terminal.screen);
                    Ok(Reply::text(screen.trim_end_matches("> ").trim()))
                };
                self.controls.hear(now, from, heard, &*newest, console, put);
            }
        }
    }

    fn answer(&mut self, now: Instant, tick: u32, put: Put<'_>) {
        let newest = self.seen.newest.borrow();
        self.controls.poll(now, &*newest);
        self.handling.poll(now);
        for (client, terminal) in &mut self.terminals {
            terminal.tell(&newest);
            if !terminal.screen.is_empty() {
                put(client, core::mem::take(&mut terminal.screen).as_bytes());
            }
        }
        let view = View::new(&*newest, &self.seen.places);
        self.seen.stream.borrow_mut().poll(now, &view, put);
        if let Some(to) = &self.telemetry {
            self.seen.telemetry.borrow_mut().poll(now, &view, &mut |packet| put(to, packet));
        }
        if tick.is_multiple_of(CABLE) {
            drop(newest);
            for place in 0..self.cables.len() {
                if let Some(client) = self.cables.get(place).map(|(client, _)| *client) {
                    self.plug(now, client, None, put);
                }
            }
        }
        if !tick.is_multiple_of(TURN) {
            return;
        }
        let newest = self.seen.newest.borrow();
        let requests = self.requests(&newest);
        self.sealed.poll(now, &mut self.controls, &requests, put);
        self.controls.answer(now, &*newest, put);
        let mut access = self.controls.seated(&*newest);
        let tello_state = self.tello_state;
        self.tello.poll(now, &mut access, &mut |to, what, bytes| {
            destination(*to, what, tello_state).into_iter().for_each(|to| put(&to, bytes));
        });
    }
}

/// A Tello's state goes to another port of the program's machine, and nowhere while that is closed:
/// where answers are awaited it would be taken for one.
fn destination(program: Client, what: Destination, state: Option<u16>) -> Option<Client> {
    match what {
        Destination::Program => Some(program),
        Destination::State => {
            let address = (program.address.ip(), state?).into();
            Some(Client { port: TELLO_STATE, address })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tellos_state_goes_to_its_port_or_nowhere() {
        let program = Client { port: TELLO, address: ([127, 0, 0, 1], 50_000).into() };
        let state = Client { port: TELLO_STATE, address: ([127, 0, 0, 1], 8_890).into() };
        assert_eq!(destination(program, Destination::Program, None), Some(program));
        assert_eq!(destination(program, Destination::State, Some(8_890)), Some(state));
        assert_eq!(destination(program, Destination::State, None), None);
    }
}
