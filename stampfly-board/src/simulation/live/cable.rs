//! The simulated StampFly's USB port: a terminal and a ground station on one line, as the firmware's.

use super::Seen;
use super::requesters::{Board, Controls, obey};
use crate::VehicleConfig;
use crate::simulation::terminal::{StationRequests, Terminal, said};
use crate::topics::TOPICS;
use stampfly_flight::console::Request;
use stampfly_services::VehicleAccess;
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
        requests: &StationRequests<'_>,
        put: &mut dyn FnMut(&[u8]),
    ) {
        let mut typed = std::vec::Vec::new();
        let mut access = controls.seated(requests.newest);
        if !is_late {
            self.line.hear(now, bytes, &mut access, put, &mut |key| typed.push(key));
        } else if self.line.hear_late(now, bytes, &mut access, put) {
            self.terminal.expire();
        }
        let Board { config, console, seen, .. } = &mut controls.actions;
        self.terminal.send(now, &typed, requests, (config, console), |request, config| obey(request, seen, config));
        if !self.terminal.screen.is_empty() {
            put(core::mem::take(&mut self.terminal.screen).as_bytes());
        }
        self.answer(now, controls, requests, put);
    }

    /// The line is gone.
    pub fn close(&mut self, access: &mut dyn VehicleAccess) {
        self.line.close(access);
    }

    /// Sends what is due.
    pub fn poll(
        &mut self,
        now: Instant,
        client: Client,
        controls: &mut Controls<'_>,
        requests: &StationRequests<'_>,
        put: &mut dyn FnMut(&[u8]),
    ) {
        let Seen { subscription, chunks, .. } = controls.actions.seen;
        if let Some(wanted) = self.line.record() {
            subscription.borrow_mut().ask(now, client, wanted);
        }
        if subscription.borrow().line() == Some(client) {
            chunks.borrow_mut().drain(..).for_each(|chunk| self.line.send_chunk(&chunk, put));
        }
        self.line.poll(now, &mut controls.seated(requests.newest), requests.newest, put);
        self.answer(now, controls, requests, put);
    }

    fn answer(
        &mut self,
        now: Instant,
        controls: &mut Controls<'_>,
        requests: &StationRequests<'_>,
        put: &mut dyn FnMut(&[u8]),
    ) {
        let Board { config, console, seen, .. } = &mut controls.actions;
        match requests.console(config, |vehicle| self.line.answer(now, vehicle, put)) {
            Request::Nothing => {}
            Request::Vehicle(command) => {
                command.publish(now, console);
                self.line.report(&said(command));
            }
            request => self.line.report(&obey(&request, seen, config)),
        }
    }
}
