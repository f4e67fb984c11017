//! The vehicle's end of hardware in the loop, question by question, with a rover.

use crate::common::Rover;
use crate::common::topics::{Bus, Id, TOPICS};
use core::mem::MaybeUninit;
use stampfly_flight::Assembled;
use stampfly_flight::golden::tables;
use stampfly_flight::hil::{
    Bands, Decoder, Entries, Entry, Flight, Greeting, LONGEST, LONGEST_FRAME, Line, Log, Over, Refusal, Reply, Request,
    SILENCE, VERSION, greet,
};
use stampfly_param::{ParameterError, ParameterInfo, Parameters};
use stampfly_types::messages::{MotorOutput, TofData};
use stampfly_types::{Duration, Instant, Message};

/// A rover has none.
struct NoParameters;

impl Parameters for NoParameters {
    fn describe(&self, _: usize) -> Option<ParameterInfo<'_>> {
        None
    }
    fn get(&self, _: usize) -> Option<f32> {
        None
    }
    fn set(&mut self, _: usize, _: f32) -> Result<(), ParameterError> {
        Err(ParameterError::Unknown)
    }
}

fn framed(request: Request<'_>, sequence: u16) -> Vec<u8> {
    let mut wire = vec![0; 1024];
    let length = request.write(&mut wire, sequence).expect("room");
    wire.truncate(length);
    wire
}

/// What a frame says, as text where it has a payload.
fn said(frame: &[u8]) -> (u16, String) {
    let mut decoder = Decoder::new([0; LONGEST]);
    for byte in frame {
        if let Some(body) = decoder.feed(*byte) {
            let reply = Reply::read(body.kind, body.payload, &TOPICS).expect("an answer");
            let text = match reply {
                Reply::Stepped(stepped) => {
                    let duties = stepped.entries.filter_map(|entry| match entry {
                        Ok(Entry::Sample { topic, words, .. }) if topic == Id::actuator_motor as usize => {
                            MotorOutput::from_words(words[..].try_into().ok()?).map(|motors| motors.duty[0])
                        }
                        _ => None,
                    });
                    format!("{:?}", duties.collect::<Vec<_>>())
                }
                Reply::Refused(why) => format!("{why:?}"),
                Reply::Taken => "Taken".to_owned(),
            };
            return (body.sequence, text);
        }
    }
    panic!("no frame")
}

fn greeted(requests: &[(Request<'_>, u16)]) -> Vec<(u16, String)> {
    let (mut incoming, mut happened, mut reply) = ([0; LONGEST], [0; LONGEST], [0; LONGEST_FRAME]);
    let mut line = Line::new(&mut incoming, &mut happened, &mut reply);
    let mut answers = Vec::new();
    for (request, sequence) in requests {
        for byte in framed(*request, *sequence) {
            if greet::<Rover>(&mut line, byte, Instant::ZERO, &mut NoParameters) != Greeting::Incomplete {
                answers.push(said(line.reply()));
            }
        }
    }
    answers
}

#[test]
fn nobody_is_switched_on_by_a_stranger_or_out_of_turn() {
    let tables = tables::<Rover>();
    let hello = Request::Hello { version: VERSION, tables };
    let start = Request::Start(Instant::ZERO);
    let parameter = Request::Parameter { name: "gain", value: 1.0 };
    let requests = [
        (start, 1),
        (Request::Hello { version: VERSION + 1, tables }, 1),
        (Request::Hello { version: VERSION, tables: tables ^ 1 }, 1),
        (start, 2),
        (hello, 5),
        (start, 7),
        (parameter, 6),
        (parameter, 6),
        (Request::Start(Instant::from_micros(u64::MAX)), 7),
        (start, 7),
    ];
    let expected = [
        "OutOfOrder",
        "OtherVersion",
        "OtherTables",
        "OutOfOrder",
        "Taken",
        "OutOfOrder",
        "UnknownParameter",
        "UnknownParameter",
        "Nonsense",
        "Taken",
    ];
    let answers = greeted(&requests);
    assert_eq!(answers.iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>(), expected);
    assert!(answers.iter().zip(&requests).all(|((answered, _), (_, asked))| answered == asked));
}

/// A rover that has been switched on at zero, by question 2. `ask` gets a question's frame and the rover's own clock.
fn with_rover(
    ask: impl FnOnce(&mut dyn FnMut(&[u8], Instant) -> Option<(u16, String)>, &dyn Fn(Instant) -> Option<Over>),
) {
    use std::cell::RefCell;
    let (mut incoming, mut happened, mut reply) = ([0; LONGEST], [0; LONGEST], [0; LONGEST_FRAME]);
    let mut line = Line::new(&mut incoming, &mut happened, &mut reply);
    let hello = Request::Hello { version: VERSION, tables: tables::<Rover>() };
    for byte in [framed(hello, 1), framed(Request::Start(Instant::ZERO), 2)].concat() {
        greet::<Rover>(&mut line, byte, Instant::ZERO, &mut NoParameters);
    }
    let (mut place, mut bus) = (MaybeUninit::uninit(), Bus::new());
    let rover = Assembled::in_place(&mut place, &mut bus, None, &0.5, Instant::ZERO);
    let flight = RefCell::new(Flight::<Rover>::new(&mut line, rover, Instant::ZERO));
    let mut feed = |frame: &[u8], clock: Instant| {
        let mut flight = flight.borrow_mut();
        let answers = frame.iter().filter(|byte| flight.feed(**byte, || clock)).count();
        (answers > 0).then(|| said(flight.reply()))
    };
    ask(&mut feed, &|now| flight.borrow_mut().over(now));
}

const BOTH: Bands = Bands { flight: true, background: true };

/// The step at this instant, with a range of so many metres that is as old as told.
fn step(sequence: u16, now: Instant, distance: f32, at: Instant) -> Vec<u8> {
    let mut memory = [0; 64];
    let mut log = Log::new(&mut memory);
    log.sample(Id::sensor_range as usize, at, &TofData { distance, valid: true, ..Default::default() }.to_words());
    let samples = Entries::new(log.bytes().expect("room"), &TOPICS);
    framed(Request::Step { now, bands: BOTH, samples }, sequence)
}

#[test]
fn a_question_asked_twice_is_done_once() {
    with_rover(|ask, _| {
        let now = Instant::from_millis(20);
        let first = ask(&step(3, now, 1.0, now), now).expect("an answer");
        assert_eq!(first, (3, "[0.5]".into()));
        // Another distance would show that it was done.
        assert_eq!(ask(&step(3, now, 1.5, now), now), Some(first));
        assert_eq!(ask(&step(5, now, 1.5, now), now), Some((5, "OutOfOrder".into())), "one is missing");
        assert_eq!(ask(&step(4, now, 1.5, now), now), Some((4, "[0.75]".into())));
    });
}

#[test]
fn a_garbled_frame_has_no_answer_and_costs_nothing() {
    with_rover(|ask, _| {
        let now = Instant::from_millis(20);
        let mut garbled = step(3, now, 1.0, now);
        garbled[9] ^= 4;
        assert_eq!(ask(&garbled, now), None);
        assert_eq!(ask(&step(3, now, 1.0, now), now), Some((3, "[0.5]".into())));
    });
}

#[test]
fn steps_lead_on_and_not_too_far() {
    with_rover(|ask, _| {
        let wall = Instant::ZERO;
        let at = Instant::from_secs;
        assert_eq!(ask(&step(3, at(11), 1.0, at(11)), wall), Some((3, "Nonsense".into())), "eleven seconds");
        assert_eq!(ask(&step(4, at(2), 1.0, at(13)), wall), Some((4, "Nonsense".into())), "a sample from the future");
        assert_eq!(ask(&step(5, at(2), 1.0, at(2)), wall).map(|said| said.0), Some(5));
        assert_eq!(ask(&step(6, at(1), 1.0, at(1)), wall), Some((6, "Nonsense".into())), "back");
        let motors = framed(Request::Step { now: at(2), bands: BOTH, samples: Entries::new(&[1; 80], &TOPICS) }, 7);
        assert_eq!(ask(&motors, wall), Some((7, "Nonsense".into())), "nobody outside publishes duties");
    });
}

#[test]
fn silence_ends_the_flight_and_nothing_runs_after_it() {
    with_rover(|ask, over| {
        let now = Instant::from_millis(20);
        assert!(ask(&step(3, now, 1.0, now), Instant::from_secs(1)).is_some());
        let quiet = Instant::from_secs(1) + SILENCE;
        assert_eq!(over(quiet), None);
        let late = quiet + Duration::from_micros(1);
        // It is found by the frame that comes too late, too.
        assert_eq!(ask(&step(4, now, 1.0, now), late), Some((4, format!("{:?}", Refusal::Silence))));
        assert_eq!(over(Instant::ZERO), Some(Over::Silence), "for good");
        assert_eq!(ask(&step(3, now, 1.0, now), late), Some((3, format!("{:?}", Refusal::Silence))));
    });
    with_rover(|ask, over| {
        assert_eq!(ask(&framed(Request::End, 3), Instant::ZERO), Some((3, "Taken".into())));
        assert_eq!(over(Instant::ZERO), Some(Over::Ended));
        let now = Instant::from_millis(20);
        assert_eq!(ask(&step(4, now, 1.0, now), Instant::ZERO), Some((4, "OutOfOrder".into())));
    });
}
