//! One vehicle of the page: its flight, its only port, its log.

use stampfly_board::schedule::Runnables;
use stampfly_board::simulation::flight::Surroundings;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_board::topics::Bus;
use stampfly_ground::Watch;
use stampfly_sim::recorder::Recorder;
use stampfly_sim::vehicle::{Client, Flying, Heard, Live, Ports, Transport, Vehicle};
use stampfly_types::{Duration, Instant};
use std::collections::VecDeque;
use std::net::{Ipv6Addr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};

/// A page in a browser flies no longer than this.
const LONGEST: Duration = Duration::from_secs(3_600);

/// What a page has said to the vehicle, and what it has answered.
#[derive(Debug, Default)]
struct Mailbox {
    asks: VecDeque<(SocketAddr, Vec<u8>)>,
    answers: Vec<(u64, String)>,
}

/// The vehicle's only port.
#[derive(Debug, Default)]
struct PagePort {
    port: usize,
    mail: Mutex<Mailbox>,
}

impl Ports for PagePort {
    fn receive(&self, _: Option<std::time::Instant>, hear: &mut dyn FnMut(Client, Heard<'_>)) {
        let asks = std::mem::take(&mut self.mail.lock().unwrap_or_else(PoisonError::into_inner).asks);
        for (address, text) in asks {
            hear(Client { port: self.port, address }, Heard::Bytes(&text));
        }
    }

    fn send(&self, to: &Client, bytes: &[u8]) {
        if let (SocketAddr::V6(to), Ok(text)) = (to.address, std::str::from_utf8(bytes)) {
            let mut mail = self.mail.lock().unwrap_or_else(PoisonError::into_inner);
            mail.answers.push((to.ip().to_bits() as u64, text.to_owned()));
        }
    }

    fn are_closed(&self) -> bool {
        false
    }
}

/// One vehicle. Its bus and its world live until the page is closed: a flight borrows them.
pub struct Flight {
    /// `None` once it is over.
    flying: Option<Flying<'static, Runnables, Surroundings>>,
    now: Instant,
    setup: Setup,
    again: Option<Setup>,
    witnesses: (Recorder<StampFly>, Watch),
    port: Arc<PagePort>,
}

impl Flight {
    /// Switches it on.
    pub fn new(setup: &Setup, number: usize, watch: Watch) -> Self {
        let place = StampFly::PORTS.iter().position(|port| port.transport == Transport::Page).unwrap_or_default();
        let port = Arc::new(PagePort { port: place, mail: Mutex::default() });
        let live = Live { ports: port.clone(), number, limit: LONGEST, speed: None };
        let setup = Setup { limit: LONGEST, ..setup.clone() }.flown_by(live);
        let facts = [("ver_sw".to_owned(), env!("CARGO_PKG_VERSION").to_owned())];
        let mut witnesses = (Recorder::<StampFly>::with_log(&setup, &facts), watch);
        let (bus, around) = (Box::leak(Box::new(Bus::new())), Box::leak(Box::new(Surroundings::new(&setup))));
        let options = StampFly::options(&setup);
        let flying = Flying::begin(bus, &setup.vehicle, &options, around, &mut witnesses);
        let now = flying.now();
        Self { flying: Some(flying), now, setup, again: None, witnesses, port }
    }

    /// Gives it what a page has asked.
    pub fn hear(&self, client: u64, text: Vec<u8>) {
        let address = (Ipv6Addr::from_bits(client.into()), 0).into();
        self.port.mail.lock().unwrap_or_else(PoisonError::into_inner).asks.push_back((address, text));
    }

    /// Flies up to then, or until somebody asks for a restart.
    pub fn go_on(&mut self, until: Instant) {
        let Some(flying) = &mut self.flying else { return };
        let goes_on = flying.go_on(until, &mut self.witnesses);
        self.now = flying.now();
        if !goes_on && let Some(flying) = self.flying.take() {
            let ended = flying.end(&mut self.witnesses);
            self.again = StampFly::again(&self.setup, &ended.outcome);
        }
    }

    /// The flight after this one, when it was ended by a restart.
    pub fn again(&mut self) -> Option<Setup> {
        self.again.take()
    }

    /// What its clock shows.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// What it has answered, and to whom.
    pub fn answers(&self) -> Vec<(u64, String)> {
        std::mem::take(&mut self.port.mail.lock().unwrap_or_else(PoisonError::into_inner).answers)
    }

    /// Its log so far.
    pub fn log(&self) -> Vec<u8> {
        self.witnesses.0.so_far().map(|memory| memory.0.clone()).unwrap_or_default()
    }
}
