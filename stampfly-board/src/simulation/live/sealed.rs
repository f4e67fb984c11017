//! The simulated StampFly's secure link in a network: the firmware's [`Link`](crate::link::Link), with this machine's datagrams in place of a radio.
//!
//! A station with the key flies, asks and watches as on the vehicle's own Wi-Fi, and asks the same arbiter for the lease as programs at the other ports. Without a key
//! the port is not there.

use super::requesters::{Board, Controls, obey};
use super::{SEALED, Seen};
use crate::VehicleConfig;
use crate::link::Outgoing;
use crate::simulation::terminal::{StationRequests, said};
use crate::topics::TOPICS;
use core::hash::BuildHasher as _;
use core::net::{SocketAddr, SocketAddrV4};
use stampfly_flight::console::Request;
use stampfly_link::Address;
use stampfly_link::secure::{Key, MAX_FRAME, MIN_FRAME, Payload, Sample, Vehicle};
use stampfly_services::RadioRequests;
use stampfly_services::cable::fingerprint;
use stampfly_services::network::Routes;
use stampfly_services::radio_requests::NETWORK_SAMPLES;
use stampfly_services::requests::{Answer, Room};
use stampfly_sim::vehicle::{Client, Put};
use stampfly_types::Instant;
use std::hash::RandomState;

/// The number of the key: the firmware's.
const KEY_ID: u8 = 1;
/// Answers of the desk in a turn, as the firmware's radio has room for.
const ANSWERS: usize = 2;

/// The vehicle's end.
pub(super) struct Sealed {
    routes: Routes,
    requests: RadioRequests,
}

impl Sealed {
    pub fn new(config: &VehicleConfig) -> Self {
        Self { routes: Routes::new(), requests: RadioRequests::new(fingerprint(&TOPICS, config)) }
    }

    /// Takes what has come.
    pub fn hear(&mut self, now: Instant, from: Client, bytes: &[u8], controls: &mut Controls<'_>, put: Put<'_>) {
        let (arbiter, actions) = controls.arbiter();
        if !actions.radio.is_open() {
            return;
        }
        let (SocketAddr::V4(place), Some(link)) = (from.address, actions.radio.link()) else { return };
        let mut room = [0; MAX_FRAME];
        // Nothing is noted of those who ask for an offer: no number of them keeps a station out.
        if bytes.is_empty() {
            link.guarded.announcement(&mut room).into_iter().for_each(|offer| put(&from, offer));
            return;
        }
        let source = self.routes.source(now, place, link.guarded.station());
        let Some(frame) = room.get_mut(..bytes.len()).filter(|frame| frame.len() >= MIN_FRAME) else { return };
        frame.copy_from_slice(bytes);
        if let Ok(Some(received)) = link.receive_sealed(arbiter, now, source, frame) {
            // A station asks again for what there is no room for.
            self.requests.ask(now, &received.payload);
        }
    }

    /// Sends what is due. Call it every 20 ms.
    pub fn poll(&mut self, now: Instant, controls: &mut Controls<'_>, requests: &StationRequests<'_>, put: Put<'_>) {
        let (arbiter, actions) = controls.arbiter();
        let Board { radio, console, config, seen, .. } = actions;
        let is_open = radio.is_open();
        let Some(link) = radio.link() else { return };
        let Self { routes, requests: asked } = self;
        let mut send = |to: Address, frame: &[u8]| {
            // The vehicle does not know that nobody hears it.
            if !is_open {
                return;
            }
            let mut send = |place: SocketAddrV4| put(&Client { port: SEALED, address: place.into() }, frame);
            if to == Address::BROADCAST {
                routes.recent(now).for_each(send);
            } else if let Some(place) = routes.place(to) {
                send(place);
            }
        };
        let mut room = [0; MAX_FRAME];
        for what in Outgoing::ALL {
            if let Some((to, frame)) = link.transmit(now, what, fresh(), &mut room) {
                send(to, frame);
            }
        }
        if let Some((to, frame)) = link.notice(arbiter, now, &mut room) {
            send(to, frame);
        }
        let station = link.guarded.station().and_then(|station| routes.place(station));
        let station = station.map(|place| Client { port: SEALED, address: place.into() });
        let mut say = |payload: &Payload<'_>| {
            if let Some((to, frame)) = link.guarded.seal(now, payload, &mut room) {
                send(to, frame);
            }
        };
        let mut answer = Room::default();
        for _ in 0..ANSWERS {
            let next = requests.console(config, |vehicle| {
                let Answer { payload, request, .. } = asked.questions.answer(now, vehicle, &mut answer)?;
                say(&payload);
                Some(request)
            });
            match next {
                None => break,
                Some(Request::Nothing) => {}
                Some(Request::Vehicle(command)) => {
                    command.publish(now, console);
                    asked.questions.report(&said(command));
                }
                Some(request) => asked.questions.report(&obey(&request, seen, config)),
            }
        }
        let mut words = [[0; 4]; Sample::MAX_WORDS];
        for _ in 0..NETWORK_SAMPLES {
            let Some(payload) = asked.next(now, requests.newest, &mut words) else { break };
            say(&payload);
        }
        let Seen { subscription, chunks, .. } = seen;
        if let Some((wanted, station)) = asked.questions.record().zip(station) {
            subscription.borrow_mut().ask(now, station, wanted);
        }
        if station.is_some() && subscription.borrow().line() == station {
            chunks.borrow_mut().drain(..).for_each(|chunk| say(&Payload::Chunk(&chunk)));
        }
    }

    /// From now on stations with this key are heard.
    pub fn open(key: [u8; 32], controls: &mut Controls<'_>) {
        if let (Ok(key), Some(link)) = (Key::generate(KEY_ID, key), controls.actions.radio.link()) {
            link.guarded.set_vehicle(Vehicle::new(key));
        }
    }
}

/// Eight bytes that were not there before, in no run of the program: an old station's frames are good for none of its sessions. They are the
/// operating system's; nothing of them comes to the bus.
fn fresh() -> [u8; 8] {
    RandomState::new().hash_one(0_u8).to_le_bytes()
}
