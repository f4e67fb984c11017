//! A station with the key asks over the radio for parameters and types at the console; one without it is not answered, and counted.

use crate::bench::{Bench, OLD};
use stampfly_board::console::{Command, Console, Newest, Profile};
use stampfly_board::link::Outgoing;
use stampfly_board::parameters::{KEY, PEER};
use stampfly_board::topics::{self, Id};
use stampfly_board::{VehicleConfig, parameters, schedule};
use stampfly_flight::console::Request;
use stampfly_link::Address;
use stampfly_link::secure::{Key, MAX_FRAME, NotTaken, Payload, Refused, Station, Vehicle};
use stampfly_services::association::NAMES;
use stampfly_services::network::Reserved;
use stampfly_services::requests::{QueuedPayload, Room, StationRequests};
use stampfly_types::Message;
use stampfly_types::messages::FlightStatus;
use std::collections::BTreeSet;

const STATION: Address = Address([2, 0, 0, 0, 0, 9]);

fn key(with: u8) -> Key {
    Key::generate(1, core::array::from_fn(|place| place as u8 ^ with)).expect("random enough")
}

/// The vehicle's end as the firmware joins it, and a station.
struct Air<'b> {
    bench: Bench<'b>,
    station: Station,
    questions: StationRequests,
    config: VehicleConfig,
    armed: bool,
    /// What the station has heard.
    heard: Vec<String>,
    requests: Vec<Request<Command>>,
}

impl<'b> Air<'b> {
    fn new(bus: &'b mut topics::Bus, station: Key) -> Self {
        let mut bench = Bench::with_key(bus, Some(OLD), Some(Vehicle::new(key(0x5A))));
        bench.pass(6_000, false, &[]);
        let (config, heard, requests) = (VehicleConfig::default(), Vec::new(), Vec::new());
        let mut air = Self {
            bench,
            station: Station::new(station),
            questions: StationRequests::new(),
            config,
            armed: false,
            heard,
            requests,
        };
        (0..20).for_each(|_| air.turn());
        air
    }

    /// 20 ms: both ends send what is due, and the console answers.
    fn turn(&mut self) {
        self.bench.pass(20, false, &[]);
        for mut frame in core::mem::take(&mut self.bench.said) {
            self.hear(&mut frame);
        }
        let mut room = [0; MAX_FRAME];
        let fresh = [self.heard.len() as u8 + 1; 8];
        if let Some(frame) = self.station.transmit(self.bench.now, fresh, &mut room).map(<[u8]>::to_vec) {
            self.arrive(frame);
        }
        self.answer();
    }

    fn hear(&mut self, frame: &mut [u8]) {
        if let Ok(Some(received)) = self.station.receive(self.bench.now, frame)
            && !matches!(received.payload, Payload::Telemetry(_) | Payload::Sample(_))
        {
            self.heard.push(format!("{:?}", received.payload));
        }
    }

    fn arrive(&mut self, mut frame: Vec<u8>) {
        if let Ok(Some(received)) =
            self.bench.link.receive(&mut self.bench.arbiter, self.bench.now, STATION, &mut frame)
        {
            assert!(self.questions.ask(0, &received.payload), "{:?}", received.payload);
        }
    }

    fn answer(&mut self) {
        let (mut newest, profile) = (Newest::new(), Profile::new(&schedule::ACTIVATIONS));
        let status = FlightStatus { armed: self.armed, ..Default::default() };
        newest.note(Id::flight_status as usize, self.bench.now, &status.to_words());
        let config = &mut self.config;
        let mut vehicle =
            Console { version: "1.0", newest: &newest, sensors: &[], profile: &profile, facts: &[], config };
        let mut room = Room::default();
        let Some(answer) = self.questions.answer(self.bench.now, &mut vehicle, &mut room) else { return };
        let post = QueuedPayload::of(&answer.payload).expect("an answer");
        if answer.request != Request::Nothing {
            self.requests.push(answer.request);
            self.questions.report(&"done");
        }
        let mut frame = [0; MAX_FRAME];
        let sealed = self.bench.link.guarded.seal(self.bench.now, &post.payload(), &mut frame);
        let (to, mut bytes) = sealed.map(|(to, bytes)| (to, bytes.to_vec())).expect("there is a session");
        assert_eq!(to, STATION);
        self.hear(&mut bytes);
    }

    fn ask(&mut self, payload: &Payload<'_>) {
        let frame = self.station.seal(self.bench.now, payload, &mut [0; MAX_FRAME]).expect("sealed").to_vec();
        self.arrive(frame);
        self.turn();
    }
}

#[test]
fn what_a_network_keeps_in_flash_shares_no_key_with_a_parameter() {
    let of_network = NAMES.into_iter().chain([Reserved::NAME]);
    let names: Vec<&str> = parameters::all().map(|info| info.name).chain([PEER, KEY]).chain(of_network).collect();
    let keys: BTreeSet<_> = names.iter().map(|name| stampfly_param::key(name)).collect();
    assert_eq!(keys.len(), names.len());
}

fn place(name: &str) -> u16 {
    parameters::all().position(|info| info.name == name).expect("a parameter") as u16
}

#[test]
fn with_the_key_parameters_are_read_and_written_and_the_console_answers() {
    let mut bus = topics::Bus::new();
    let mut air = Air::new(&mut bus, key(0x5A));
    let index = place("eskf.gate");
    let before = air.config.eskf.gate;
    air.ask(&Payload::ReadParameter { index });
    air.ask(&Payload::WriteParameter { index, value: 3.5 });
    air.ask(&Payload::WriteParameter { index, value: 1e9 });
    let value = |value, taken| format!("{:?}", Payload::Parameter { index, value, taken });
    assert_eq!(air.heard, [value(before, true), value(3.5, true), value(3.5, false)]);
    assert_eq!(air.config.eskf.gate, 3.5);

    air.heard.clear();
    air.ask(&Payload::Line("param list"));
    for _ in 0..300 {
        air.turn();
    }
    let parts = air.heard.iter().filter_map(|part| part.split('"').nth(1));
    let said: String = parts.collect();
    assert!(air.heard.len() > 20 && parameters::all().all(|info| said.contains(info.name)), "{said}");
    assert!(air.heard.last().is_some_and(|text| text.ends_with("last: true }")), "{:?}", air.heard.last());

    // The same by parts, of which every second one is lost: what is missing is asked for.
    let (mut whole, mut turns) = (String::new(), 0);
    while !whole.ends_with("|end") {
        air.heard.clear();
        let from = whole.len() as u16;
        air.ask(&Payload::Question { number: 77, from, line: "param list" });
        air.turn();
        let is_next = |heard: &&String| turns % 2 == 0 && heard.contains(&format!("number: 77, from: {from},"));
        if let Some(part) = air.heard.iter().find(is_next) {
            whole += &part.split('"').nth(1).expect("a text").replace("\\n", "\n").replace("\\t", "\t");
            whole += if part.ends_with("last: true }") { "|end" } else { "" };
        }
        turns += 1;
        assert!(turns < 1_000, "{whole}");
    }
    assert_eq!(whole.trim_end_matches("|end"), said.replace("\\n", "\n").replace("\\t", "\t"));

    // A line that does something does it once, however often its station asks what came of it.
    air.heard.clear();
    let save = Payload::Question { number: 78, from: 0, line: "param save" };
    (0..5).for_each(|_| air.ask(&save));
    assert_eq!(core::mem::take(&mut air.requests), [Request::SaveParameters]);
    let done = Payload::Part { number: 78, from: 0, text: "done", last: true };
    assert!(air.heard.iter().filter(|heard| **heard == format!("{done:?}")).count() > 1, "{:?}", air.heard);

    // Nor does one that changes something by itself: what somebody has changed since then stays.
    let set = Payload::Question { number: 79, from: 0, line: "param set eskf.gate 3.0" };
    air.ask(&set);
    air.ask(&Payload::WriteParameter { index, value: 3.25 });
    air.heard.clear();
    (0..3).for_each(|_| air.ask(&set));
    assert_eq!(air.config.eskf.gate, 3.25);
    assert!(air.heard.last().is_some_and(|heard| heard.contains("eskf.gate") && heard.ends_with("last: true }")));

    air.heard.clear();
    air.ask(&Payload::Line("param save"));
    air.turn();
    assert_eq!(air.requests, [Request::SaveParameters]);
    assert_eq!(air.heard.last(), Some(&format!("{:?}", Payload::Reply { text: "done", last: true })));
}

#[test]
fn an_armed_vehicle_is_read_and_not_changed_over_the_radio() {
    let mut bus = topics::Bus::new();
    let mut air = Air::new(&mut bus, key(0x5A));
    air.armed = true;
    let (index, before) = (place("eskf.gate"), air.config.eskf.gate);
    air.ask(&Payload::ReadParameter { index });
    air.ask(&Payload::WriteParameter { index, value: 3.5 });
    let value = |taken| format!("{:?}", Payload::Parameter { index, value: before, taken });
    assert_eq!((&air.heard[..], air.config.eskf.gate), (&[value(true), value(false)][..], before));
    air.ask(&Payload::Line("param save"));
    assert!(air.requests.is_empty() && air.heard.last().is_some_and(|text| text.contains("armed")));
}

#[test]
fn without_the_key_nothing_is_answered_and_every_frame_is_counted() {
    let mut bus = topics::Bus::new();
    let mut air = Air::new(&mut bus, key(0x5A));
    let before = air.config.eskf.gate;
    let question = Payload::WriteParameter { index: place("eskf.gate"), value: 3.5 };
    let sealed = air.station.seal(air.bench.now, &question, &mut [0; MAX_FRAME]).expect("sealed").to_vec();
    let refused = air.bench.link.guarded.vehicle().expect("it has a key").tally().tag;
    for bit in 0..8 {
        let mut forged = sealed.clone();
        *forged.last_mut().expect("a tag") ^= 1 << bit;
        let heard = air.bench.link.receive(&mut air.bench.arbiter, air.bench.now, STATION, &mut forged).map(drop);
        assert_eq!(heard, Err(NotTaken::Secure(Refused::Tag)));
        air.bench.pass(5, false, &[]);
    }
    air.turn();
    assert_eq!(air.bench.link.guarded.vehicle().expect("it has a key").tally().tag, refused + 8);
    assert_eq!((air.heard.len(), air.config.eskf.gate), (0, before));

    // Nor of a station with another key, which has no session to begin with.
    let mut bus = topics::Bus::new();
    let mut air = Air::new(&mut bus, key(0x33));
    assert!(air.station.session().is_none());
    assert!(air.station.seal(air.bench.now, &question, &mut [0; MAX_FRAME]).is_err());
    assert!(air.bench.say(air.bench.now, Outgoing::Telemetry).is_none_or(|(to, _)| to != STATION));
}
