//! The simulated StampFly's USB port: a terminal and a ground station on one line, as the firmware's.

use super::Seen;
use super::seats::{Board, Controls, obey};
use crate::VehicleConfig;
use crate::simulation::terminal::{Desk, Terminal, said};
use crate::topics::TOPICS;
use stampfly_flight::console::Request;
use stampfly_services::Cockpit;
use stampfly_services::cable::{self, fingerprint};
use stampfly_services::mavlink::Identity;
use stampfly_sim::vehicle::Client;
use stampfly_types::Instant;

/// One line.
pub(super) struct Cable {
    line: cable::Cable<{ TOPICS.len() }>,
    terminal: Terminal,
}

impl Cable {
    pub fn new(identity: Identity, config: &VehicleConfig) -> Self {
        Self { line: cable::Cable::new(identity, fingerprint(&TOPICS, config)), terminal: Terminal::new() }
    }

    /// Takes what has come.
    pub fn hear(
        &mut self,
        now: Instant,
        (bytes, is_late): (&[u8], bool),
        controls: &mut Controls<'_>,
        desk: &Desk<'_>,
        put: &mut dyn FnMut(&[u8]),
    ) {
        let mut typed = std::vec::Vec::new();
        let mut cockpit = controls.seated(desk.newest);
        if !is_late {
            self.line.hear(now, bytes, &mut cockpit, put, &mut |key| typed.push(key));
        } else if self.line.hear_late(now, bytes, &mut cockpit, put) {
            self.terminal.expire();
        }
        let Board { config, console, seen, .. } = &mut controls.hands;
        self.terminal.send(now, &typed, desk, (config, console), |request, config| obey(request, seen, config));
        if !self.terminal.screen.is_empty() {
            put(core::mem::take(&mut self.terminal.screen).as_bytes());
        }
        self.answer(now, controls, desk, put);
    }

    /// The line is gone.
    pub fn close(&mut self, cockpit: &mut dyn Cockpit) {
        self.line.close(cockpit);
    }

    /// Sends what is due.
    pub fn poll(
        &mut self,
        now: Instant,
        client: Client,
        controls: &mut Controls<'_>,
        desk: &Desk<'_>,
        put: &mut dyn FnMut(&[u8]),
    ) {
        let Seen { tape, chunks, .. } = controls.hands.seen;
        if let Some(wanted) = self.line.record() {
            tape.borrow_mut().ask(now, client, wanted);
        }
        if tape.borrow().line() == Some(client) {
            chunks.borrow_mut().drain(..).for_each(|chunk| self.line.send_chunk(&chunk, put));
        }
        self.line.poll(now, &mut controls.seated(desk.newest), desk.newest, put);
        self.answer(now, controls, desk, put);
    }

    fn answer(&mut self, now: Instant, controls: &mut Controls<'_>, desk: &Desk<'_>, put: &mut dyn FnMut(&[u8])) {
        let Board { config, console, seen, .. } = &mut controls.hands;
        match desk.console(config, |vehicle| self.line.answer(now, vehicle, put)) {
            Request::Nothing => {}
            Request::Vehicle(command) => {
                command.publish(now, console);
                self.line.report(&said(command));
            }
            request => self.line.report(&obey(&request, seen, config)),
        }
    }
}
