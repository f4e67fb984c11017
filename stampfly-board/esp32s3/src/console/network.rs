//! Programs in the network, and what a person at the cable says about it.

use super::served::Served;
use super::{Console, IDENTITY, newest_mode};
use crate::actions::VehicleActions;
use crate::clock::Clock;
use crate::wifi::Ports;
use core::fmt::Write as _;
use heapless::String;
use stampfly_drivers::Timebase;
use stampfly_services::association::{Credentials, USAGE, Wish};
use stampfly_services::{ArbitratedAccess, View};

impl Console {
    /// Hears and answers programs in the network.
    #[inline(never)]
    pub(super) fn serve(&mut self) {
        let Self { known, link, ends, config, later, arbiter, places, network: Served { network, ports, .. }, .. } =
            self;
        let mut network = network.borrow_mut();
        let (Some(ports), Some(stack)) = (ports, &mut network.stack) else { return };
        let now = Clock.now();
        let mut memory = known.memory.borrow_mut();
        memory.catch_up();
        let view = View::new(&memory.newest, places);
        let actions = &mut VehicleActions { link, ends, config, later };
        ports.turn(now, stack, &mut ArbitratedAccess { arbiter: &mut arbiter.borrow_mut(), actions, view });
    }

    /// Reserves times of signatures, and opens the ports when there are some. Flash is written on a disarmed vehicle alone.
    pub(super) async fn open_ports(&mut self) {
        let Self { known, storage, storage_ends, network: Served { network, ports, reserved }, key, .. } = self;
        let Some(key) = key.as_ref().filter(|_| network.borrow().is_wanted()) else { return };
        let time = ports.as_ref().map_or(reserved.epoch(), |ports| ports.signature_time(Clock.now()));
        if let Some(until) = reserved.due(time) {
            let busy = &mut storage_ends.storage_busy;
            if storage.save_reserved(until, busy, || newest_mode(known.memory)).await.is_ok() {
                reserved.kept(until);
            }
        }
        if ports.is_none() && reserved.covers(time) {
            *ports = Some(Ports::new(IDENTITY, key, reserved.epoch()));
        }
    }

    /// Does what a line says about the network. `false`: it says nothing about it.
    pub(super) async fn obey_wish(&mut self, line: &str) -> bool {
        let Some(wish) = Wish::of(line) else { return false };
        let mut said = String::<128>::new();
        // What is too long is cut.
        match wish {
            Ok(Wish::Show) => _ = write!(said, "{}", self.network.network.borrow().show()),
            Ok(Wish::Join(known)) => self.keep_network(Some(known), &mut said).await,
            Ok(Wish::Forget) => self.keep_network(None, &mut said).await,
            Ok(Wish::Usage) => _ = said.push_str(USAGE),
            Err(error) => _ = write!(said, "{error}; {USAGE}"),
        }
        self.screen.show(&said).await;
        self.screen.show("\r\n").await;
        true
    }

    async fn keep_network(&mut self, known: Option<Credentials>, said: &mut String<128>) {
        let memory = self.known.memory;
        let busy = &mut self.storage_ends.storage_busy;
        let kept = self.storage.save_network(known.as_ref(), busy, || newest_mode(memory)).await;
        _ = match kept {
            Ok(()) => {
                let word = if known.is_some() { "stored; 'wifi' says whether it is joined" } else { "forgotten" };
                self.network.network.borrow_mut().want(known);
                said.push_str(word)
            }
            Err(error) => write!(said, "{error}").map_err(|_| heapless::CapacityError::default()),
        };
    }
}
