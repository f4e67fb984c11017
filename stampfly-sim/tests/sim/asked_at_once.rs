//! Simultaneous page requests: limit, and confirmation.

use core::cell::RefCell;
use stampfly_bus::TopicInfo;
use stampfly_flight::newest::{NewestSamples, longest_message};
use stampfly_param::{Parameters, RequestedParameters};
use stampfly_services::link::mavlink::dialects::common::MavType;
use stampfly_services::{Refusal, Request, VehicleActions};
use stampfly_sim::fault::Injector;
use stampfly_sim::ground::{About, Served, TURN};
use stampfly_sim::vehicle::{Client, Heard, Link, Live, PortSpec, Ports};
use stampfly_types::messages::{GuidedCommand, PilotInput};
use stampfly_types::{Duration, Instant};
use std::sync::Arc;

mod topics {
    use stampfly_types::messages::FlightStatus;
    stampfly_bus::topics! {
        outside mode, display;
        /// What it does.
        flight_status: FlightStatus = latest @ 50 Hz from mode => [display];
    }
}

stampfly_param::parameters! {
    /// A raft.
    pub struct Numbers {
        /// Its lamp.
        lamp: Lamp {
            /// Brightness.
            level = 0.5 in [0.0, 1.0] "1";
        }
    }
}

#[derive(Debug)]
struct Closed;

impl Ports for Closed {
    fn receive(&self, _: Option<std::time::Instant>, _: &mut dyn FnMut(Client, Heard<'_>)) {}
    fn send(&self, _: &Client, _: &[u8]) {}
    fn are_closed(&self) -> bool {
        true
    }
}

/// A vehicle that accepts all commands and carries out none.
struct Raft(RequestedParameters<Numbers, 8>);

impl VehicleActions for Raft {
    fn command(&mut self, _: Instant, _: GuidedCommand) -> Result<(), Refusal> {
        Ok(())
    }
    fn sticks(&mut self, _: Instant, _: &PilotInput) -> Result<(), Refusal> {
        Ok(())
    }
    fn parameters(&mut self) -> &mut dyn Parameters {
        &mut self.0
    }
    fn request(&mut self, _: Instant, _: Request) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }
}

const PORTS: &[PortSpec] = &[PortSpec::PAGE];
const TOPICS: &[TopicInfo] = &topics::TOPICS;
const ABOUT: About = About {
    kind: MavType::MAV_TYPE_SURFACE_BOAT,
    version: [1, 0, 0],
    take_off_height: 0.0,
    reach: 2.0,
    card: None,
    ports: PORTS,
    faults: &[],
    topics: TOPICS,
};

#[test]
fn of_many_commands_of_pages_none_is_called_done_that_was_not() {
    let live = Live { ports: Arc::new(Closed), number: 0, limit: Duration::from_secs(1), speed: None };
    let newest = RefCell::new(NewestSamples::<{ topics::COUNT }, { longest_message(TOPICS) }>::new());
    let none = Injector::new(Instant::ZERO, &[]);
    let mut served = Served::new(&ABOUT, &live, &none, Raft(RequestedParameters::new(Numbers::default())), &newest);
    let page = Client { port: 0, address: ([127, 0, 0, 1], 1).into() };
    let mut answers: Vec<String> = Vec::new();
    let ask = |served: &mut Served<'_, _, _>, answers: &mut Vec<String>, id, kind| {
        let text = format!(r#"{{"vehicle":0,"id":{id},"do":"guided","kind":"{kind}"}}"#);
        served.hear(Instant::ZERO, page, Heard::Bytes(text.as_bytes()), &mut |_, said| {
            answers.push(String::from_utf8_lossy(said).into_owned());
        });
    };
    (1..=70).for_each(|id| ask(&mut served, &mut answers, id, "arm"));
    assert_eq!(answers.len(), 6, "{answers:?}");
    let is_refused = |answer: &String, why: &str| answer.contains("\"ok\":false") && answer.contains(why);
    assert!(answers.iter().all(|answer| is_refused(answer, "too many commands at once")), "{answers:?}");
    answers.clear();
    // Requests that end a flight are still accepted.
    ask(&mut served, &mut answers, 71, "kill");
    assert!(answers.len() == 1 && is_refused(&answers[0], "a later command ends the flight"), "{answers:?}");
    answers.clear();
    for ms in (0..2_000).step_by(20) {
        served.answer(Instant::from_millis(ms), TURN, &mut |_, said| {
            answers.push(String::from_utf8_lossy(said).into_owned());
        });
    }
    assert_eq!(answers.len(), 64);
    let done: Vec<_> = answers.iter().filter(|answer| answer.contains("\"ok\":true")).collect();
    assert!(done.len() == 1 && done[0].contains("71"), "{done:?}");
}
