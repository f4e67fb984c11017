//! Vehicles in one world, moved on by so much time.
//!
//! A flight can be flown again with other parameters: the same world, the same asks at the same instants. Both vehicles fly
//! side by side then, the first with the new parameters, the second with the old ones.

use crate::flight::Flight;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_ground::ask::{Ask, Asked, Incoming, NAMES, Reply};
use stampfly_ground::{Client, Connection, Feed, Hub, VehicleCard};
use stampfly_sim::recorder::Recorder;
use stampfly_sim::vehicle::{Options, Vehicle, Verdict};
use stampfly_types::Instant;
use std::sync::Arc;
use std::time::Duration;

/// The server's clock. Page and vehicle are in one place here: nothing is held up between them.
const NOW: Duration = Duration::ZERO;

/// Flights, and what the page is told of them.
pub struct Demo {
    seed: u64,
    hub: Arc<Hub>,
    page: Connection,
    feed: Feed,
    flights: Vec<Flight>,
    /// What was asked of the first vehicle, and when.
    asked: Vec<(Instant, Vec<u8>)>,
    /// What of an earlier flight is still to be asked again, of both vehicles.
    again: std::collections::VecDeque<(Instant, Vec<u8>)>,
    /// Parameters of the first vehicle that are not the vehicle's own.
    changed: Vec<(String, f32)>,
    texts: Vec<String>,
}

impl Demo {
    /// One vehicle.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self::with(seed, vec![Vec::new()], Vec::new())
    }

    /// A vehicle for each set of parameters, and asks to be put to all of them.
    fn with(seed: u64, parameters: Vec<Vec<(String, f32)>>, again: Vec<(Instant, Vec<u8>)>) -> Self {
        let setups: Vec<_> = parameters.iter().map(|changed| setup(seed, changed)).collect();
        let names = ["StampFly", "as it flew before"];
        let cards = setups
            .iter()
            .zip(names)
            .map(|(setup, name)| VehicleCard::of::<StampFly>(name, StampFly::config(setup)).offering(NAMES));
        let hub = Hub::new(cards.collect());
        let (page, feed) = (hub.connect(), Feed::new(hub.clone()));
        let flights = setups
            .iter()
            .enumerate()
            .filter_map(|(number, setup)| Some(Flight::new(setup, number, hub.witness(number)?)))
            .collect();
        let texts = vec![hub.hello(page.client(), "", NOW)];
        let changed = parameters.into_iter().next().unwrap_or_default();
        Self { seed, hub, page, feed, flights, asked: Vec::new(), again: again.into(), changed, texts }
    }

    /// Takes an ask of the page. Besides those of `stampfly serve`: `{"id":1,"do":"fly_again"}`.
    pub fn hear(&mut self, text: &[u8]) {
        let Ok(text) = std::str::from_utf8(text) else { return };
        if text.contains("\"fly_again\"") {
            return self.fly_again();
        }
        match Incoming::parse(text) {
            Ok(Incoming::Subscribe { id, topics, .. }) => {
                self.feed.subscribe(topics);
                self.hub.answer_to(self.page.client(), None, id, Ok(Reply::default()));
            }
            Ok(Incoming::Ask(asked)) => {
                let asked = Asked { at: None, ..asked };
                if let Err(why) = self.hub.ask(self.page.client(), asked.clone(), NOW) {
                    self.hub.answer(self.page.client(), &asked, Err(why.to_string()));
                }
            }
            // There is one page, and its connection does not break.
            Ok(Incoming::Resume { id, .. }) => {
                self.hub.answer_to(self.page.client(), None, id, Err("no such session".into()));
            }
            Err((id, error)) => self.hub.answer_to(self.page.client(), None, id, Err(error.to_string())),
        }
    }

    /// The flight again from power-on, with the parameters that were set meanwhile, beside what it was.
    fn fly_again(&mut self) {
        let before = self.changed.clone();
        let mut changed = before.clone();
        for (_, text) in &self.asked {
            if let Ok(Asked { ask: Ask::ParamSet { name, value }, .. }) =
                Asked::parse(std::str::from_utf8(text).unwrap_or_default())
            {
                changed.retain(|(other, _)| *other != name);
                changed.push((name, value));
            }
        }
        let asked = std::mem::take(&mut self.asked);
        *self = Self::with(self.seed, vec![changed, before], asked);
    }

    /// Flies for so long, in the vehicle's time.
    pub fn go_on(&mut self, microseconds: u64) {
        let until = Instant::from_micros(self.now().as_micros() + microseconds);
        for (client, asked) in self.hub.asks(0, NOW).into_iter().chain(self.hub.asks(1, NOW)) {
            let text = serde_json::to_vec(&asked).unwrap_or_default();
            if asked.vehicle == 0 {
                self.asked.push((self.now(), text.clone()));
            }
            if let Some(flight) = self.flights.get(asked.vehicle) {
                flight.hear(client.number(), text);
            }
        }
        while let Some((at, text)) = self.again.front().cloned().filter(|(at, _)| *at < until) {
            self.again.pop_front();
            self.flights.iter_mut().for_each(|flight| {
                flight.go_on(at);
                // Nobody waits for these answers.
                flight.hear(0, text.clone());
            });
            self.asked.push((at, text));
        }
        for (number, flight) in self.flights.iter_mut().enumerate() {
            flight.go_on(until);
            flight.answers().iter().for_each(|(client, text)| self.hub.send(Client::of(*client), text));
            if let (Some(setup), Some(watch)) = (flight.again(), self.hub.witness(number)) {
                *flight = Flight::new(&setup, number, watch);
                // What was asked before belongs to a flight that is over.
                self.asked.clear();
            }
        }
    }

    fn now(&self) -> Instant {
        self.flights.first().map_or(Instant::ZERO, Flight::now)
    }

    /// Texts for the page, one a line.
    pub fn say(&mut self) -> String {
        let mut texts = std::mem::take(&mut self.texts);
        texts.extend(self.page.take().iter().map(ToString::to_string));
        texts.push(self.feed.text(NOW));
        texts.join("\n")
    }

    /// The log of a vehicle so far.
    #[must_use]
    pub fn log(&self, vehicle: usize) -> Vec<u8> {
        self.flights.get(vehicle).map(Flight::log).unwrap_or_default()
    }
}

/// The vehicle of this seed, with these parameters.
fn setup(seed: u64, changed: &[(String, f32)]) -> Setup {
    let param = changed.iter().map(|(name, value)| format!("{name}={value}")).collect();
    StampFly::setup(&Options { param, ..Options::default() }, seed).unwrap_or_else(|_| Setup::reference(seed))
}

/// The reference mission: what `stampfly fly --seed SEED` says of it.
pub(crate) fn reference(seed: u64) -> String {
    let setup = Setup::reference(seed);
    let mut recorder = Recorder::<StampFly>::hash_only();
    let ended = StampFly::fly(&setup, &mut recorder, &mut |_, _| {});
    let hash = format!("{:016x}", recorder.hash());
    let (duration_s, sentence) = (ended.duration.seconds_f64(), ended.outcome.sentence());
    serde_json::json!({ "log_hash": hash, "duration_s": duration_s, "sentence": sentence }).to_string()
}
