//! Hardware in the loop: bytes on the line to a vehicle.

use stampfly_board::VehicleConfig;
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::{Bus, TOPICS};
use stampfly_flight::Assembled;
use stampfly_flight::golden::tables;
use stampfly_flight::hil::{
    Decoder, Encoder, Flight, Greeting, LONGEST, LONGEST_FRAME, Line, Reply, Request, VERSION, greet,
};
use stampfly_types::{Duration, Instant};
use std::mem::MaybeUninit;

/// The vehicle's clock between two bytes.
const BYTE: Duration = Duration::from_micros(10);

/// Bytes on the line: as they are to a decoder and to a vehicle before its flight, and as the payloads of sound frames to one
/// that flies. A frame's payload is its length, its kind, and that many bytes.
pub fn hil_frames(data: &[u8]) {
    as_they_are(data);
    let (mut incoming, mut happened, mut reply) = ([0; LONGEST], [0; LONGEST], [0; LONGEST_FRAME]);
    let mut line = Line::new(&mut incoming, &mut happened, &mut reply);
    let mut config = VehicleConfig::default();
    for byte in data {
        greet::<Runnables>(&mut line, *byte, Instant::ZERO, &mut config);
    }
    let hello = Request::Hello { version: VERSION, tables: tables::<Runnables>() };
    let mut sequence = 1;
    let mut greeted = Greeting::Incomplete;
    for request in [hello, Request::Start(Instant::from_secs(1))] {
        let mut wire = [0; 64];
        let length = request.write(&mut wire, sequence).expect("room");
        for byte in &wire[..length] {
            greeted = greet::<Runnables>(&mut line, *byte, Instant::ZERO, &mut config);
        }
        sequence += 1;
    }
    assert_eq!(greeted, Greeting::Starts(Instant::from_secs(1)), "whatever came before");
    let (mut place, mut bus) = (Box::new(MaybeUninit::uninit()), Box::new(Bus::new()));
    let vehicle = Assembled::in_place(&mut *place, &mut *bus, None, &config, Instant::from_secs(1));
    frames(&mut Flight::<Runnables>::new(&mut line, vehicle, Instant::from_secs(1)), data, sequence);
}

/// What a decoder finds is written again as the same bytes' content.
fn as_they_are(data: &[u8]) {
    let mut decoder = Decoder::new([0; 256]);
    for byte in data {
        let Some(body) = decoder.feed(*byte) else { continue };
        let mut wire = [0; 512];
        let mut frame = Encoder::new(&mut wire, body.sequence, body.kind);
        frame.put(body.payload);
        let length = frame.finish().expect("it came from less");
        let mut again = Decoder::new([0; 256]);
        let same = wire[..length].iter().any(|byte| again.feed(*byte) == Some(body));
        assert!(same, "a frame does not mean the same when it is sent again");
    }
}

/// Sound frames with these payloads.
fn frames(flight: &mut Flight<'_, '_, '_, Runnables>, mut data: &[u8], mut sequence: u16) {
    let mut now = Instant::ZERO;
    while let [length, kind, rest @ ..] = data {
        let (payload, rest) = rest.split_at(rest.len().min(usize::from(*length)));
        data = rest;
        let mut wire = [0; 512];
        let mut frame = Encoder::new(&mut wire, sequence, *kind);
        frame.put(payload);
        let length = frame.finish().expect("room");
        let mut answers = 0;
        for byte in &wire[..length] {
            now += BYTE;
            answers += u32::from(flight.feed(*byte, || now));
        }
        assert_eq!(answers, 1, "one frame, one answer");
        let mut decoder = Decoder::new(vec![0; LONGEST_FRAME]);
        let mut sound = false;
        for byte in flight.reply() {
            let Some(body) = decoder.feed(*byte) else { continue };
            let reply = Reply::read(body.kind, body.payload, &TOPICS).expect("the vehicle's own words");
            assert_eq!(body.sequence, sequence);
            if let Reply::Stepped(stepped) = reply {
                assert!(stepped.entries.into_iter().all(|entry| entry.is_ok()));
                sequence = sequence.wrapping_add(1);
            }
            sound = true;
        }
        assert!(sound, "an answer that is no frame");
    }
}
