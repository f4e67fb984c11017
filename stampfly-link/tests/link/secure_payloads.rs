//! What is inside frames: every payload comes out as it went in, and bytes that are taken are the only form of what they say.

use crate::air::{Air, TICK, To};
use proptest::prelude::*;
use stampfly_link::secure::{Key, KeyError, Kind, MAX_BODY, Payload, Refused, Sample, SealError};
use stampfly_link::{LinkState, TelemetryPacket};
use stampfly_types::messages::{FlightMode, GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Instant, Vec3};

fn stick() -> impl Strategy<Value = f32> {
    prop_oneof![-1.0f32..=1.0, Just(1.0), Just(-1.0), Just(0.0)].prop_map(normal)
}

fn normal(number: f32) -> f32 {
    if number.is_normal() { number } else { 0.0 }
}

fn vector(size: f32) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-size..=size).prop_map(|[x, y, z]| Vec3::new(normal(x), normal(y), normal(z)))
}

fn text(length: usize) -> impl Strategy<Value = &'static str> {
    // Kept for the life of the test, so that a payload can point to it.
    prop::collection::vec(any::<char>().prop_filter("text", |c| !c.is_control()), 0..=length / 4)
        .prop_map(|text| &*Box::leak(text.into_iter().collect::<String>().into_boxed_str()))
}

fn telemetry() -> impl Strategy<Value = TelemetryPacket> {
    let numbers = (0u8.., 0.0f32..65.0, -300.0f32..300.0, vector(30.0), vector(3.0), any::<[bool; 4]>());
    numbers.prop_map(|(counter, battery, height, velocity, attitude, on)| {
        let [low_battery, sensor_error, link_lost, calibrating] = on;
        let state = LinkState::Flying;
        let packet = TelemetryPacket { counter, battery, height, velocity, attitude, state, ..Default::default() };
        let packet = TelemetryPacket { low_battery, sensor_error, link_lost, calibrating, ..packet };
        // As it is after a journey: numbers are rounded once.
        TelemetryPacket::decode(&packet.to_bytes()).expect("a packet")
    })
}

fn payload() -> impl Strategy<Value = Payload<'static>> {
    let sticks = (prop::array::uniform4(stick()), prop::sample::select(FlightMode::ALL), any::<[bool; 2]>());
    let guided = (
        prop::sample::select(GuidedKind::ALL),
        vector(10_000.0),
        -core::f32::consts::TAU..=core::f32::consts::TAU,
        0.0f32..=100.0,
        0.0f32..=3_600.0,
    );
    let guided = guided.prop_map(|(kind, position, yaw, speed, dwell)| {
        let (yaw, speed, dwell) = (normal(yaw), normal(speed), normal(dwell));
        GuidedCommand { kind, position, yaw, speed, dwell }
    });
    let value = any::<f32>().prop_filter("finite", |value| value.is_finite()).prop_map(normal);
    let words = prop::collection::vec(any::<[u8; 4]>(), 0..=Sample::MAX_WORDS).prop_map(|words| &*words.leak());
    prop_oneof![
        any::<bool>().prop_map(|wanted| Payload::Record { wanted }),
        prop::collection::vec(any::<u8>(), 0..=MAX_BODY).prop_map(|chunk| Payload::Chunk(chunk.leak())),
        sticks.prop_map(|([roll, pitch, yaw, throttle], mode, [arm, kill])| {
            Payload::Sticks(PilotInput { roll, pitch, yaw, throttle, mode, arm, kill })
        }),
        (any::<Option<u32>>(), guided).prop_map(|(number, command)| match number {
            None => Payload::Guided(command),
            Some(number) => Payload::Numbered { number, command },
        }),
        Just(Payload::Kill),
        any::<u16>().prop_map(|index| Payload::ReadParameter { index }),
        (any::<u16>(), value.clone()).prop_map(|(index, value)| Payload::WriteParameter { index, value }),
        text(MAX_BODY).prop_map(Payload::Line),
        (any::<u32>(), any::<u16>(), text(MAX_BODY - 6)).prop_map(|(number, from, line)| Payload::Question {
            number,
            from,
            line
        }),
        (any::<u32>(), any::<u16>(), text(MAX_BODY - 7), any::<bool>())
            .prop_map(|(number, from, text, last)| Payload::Part { number, from, text, last }),
        (any::<u16>(), any::<u16>()).prop_map(|(topic, period)| Payload::Watch { topic, period }),
        telemetry().prop_map(Payload::Telemetry),
        (any::<u16>(), value, any::<bool>()).prop_map(|(index, value, taken)| Payload::Parameter {
            index,
            value,
            taken
        }),
        (text(MAX_BODY - 1), any::<bool>()).prop_map(|(text, last)| Payload::Reply { text, last }),
        (any::<u16>(), any::<u64>(), words).prop_map(|(topic, at, words)| Payload::Sample(Sample::new(
            topic,
            Instant::from_micros(at),
            words
        ))),
        any::<u16>().prop_map(|fingerprint| Payload::Tables { fingerprint }),
        (any::<u32>(), any::<bool>()).prop_map(|(counter, taken)| Payload::Acknowledgement { counter, taken }),
        (any::<u32>(), text(MAX_BODY - 4)).prop_map(|(counter, why)| Payload::Refusal { counter, why }),
        (any::<u32>(), text(MAX_BODY - 4)).prop_map(|(number, text)| Payload::Notice { number, text }),
    ]
}

/// Seals it at the end that may send it.
fn seal(air: &mut Air, payload: &Payload<'_>) -> (To, Vec<u8>) {
    let mut room = [0; 250];
    if payload.kind().is_from_vehicle() {
        (To::Station, air.vehicle.seal(air.now, payload, &mut room).expect("sealed").to_vec())
    } else {
        (To::Vehicle, air.station.seal(air.now, payload, &mut room).expect("sealed").to_vec())
    }
}

proptest! {
    #[test]
    fn every_payload_comes_out_as_it_went_in(payload in payload()) {
        let mut air = Air::joined(1);
        let (to, frame) = seal(&mut air, &payload);
        prop_assert_eq!(frame[1], payload.kind() as u8);
        let mut frame = frame.clone();
        let received = match to {
            To::Vehicle => air.vehicle.receive(air.now, &mut frame),
            To::Station => air.station.receive(air.now, &mut frame),
        };
        prop_assert_eq!(received.expect("taken").expect("a payload").payload, payload);
    }

    #[test]
    fn every_flip_of_a_bit_of_every_frame_is_refused(payload in payload()) {
        let mut air = Air::joined(2);
        let (to, frame) = seal(&mut air, &payload);
        for bit in 0..8 * frame.len() {
            let mut frame = frame.clone();
            frame[bit / 8] ^= 1 << (bit % 8);
            air.now += TICK;
            prop_assert!(air.deliver(to, &frame).is_err(), "bit {}", bit);
        }
        let outcome = air.deliver(to, &frame);
        prop_assert!(outcome == Ok(true) || outcome == Err(Refused::Stale), "{:?}", outcome);
    }

    #[test]
    fn a_body_that_is_taken_is_the_only_form_of_what_it_says(
        kind in prop::sample::select(&Kind::ALL[..]),
        body in prop::collection::vec(prop_oneof![Just(0u8), Just(1), any::<u8>()], 0..=MAX_BODY),
        payload in payload(),
        change in any::<(u8, u8)>(),
    ) {
        let mut place = [0; 250];
        if let Some(decoded) = Payload::decode(kind, &body) {
            let length = decoded.encode(&mut place).expect("what is read can be written");
            prop_assert_eq!(&place[..length], &body[..]);
        }
        // What is nearly right gets farther.
        let mut near = [0; 250];
        let length = payload.encode(&mut near).expect("encoded");
        if let Some(byte) = near[..length].get_mut(usize::from(change.0) % length.max(1)) {
            *byte ^= change.1;
        }
        if let Some(decoded) = Payload::decode(payload.kind(), &near[..length]) {
            let again = decoded.encode(&mut place).expect("what is read can be written");
            prop_assert_eq!(&place[..again], &near[..length]);
        }
    }

    #[test]
    fn the_text_of_a_key_is_read_and_nothing_else_is(id in any::<u8>(), bytes in any::<[u8; 32]>(), cut in any::<u8>()) {
        let key = Key::generate(id, bytes).expect("random");
        let text = key.uri().to_string();
        prop_assert!(text.is_ascii() && text.len() <= 110);
        let read = Key::from_uri(&format!("  {text}\r\n")).expect("a key");
        prop_assert_eq!((read.id(), read.bytes()), (id, &bytes));
        let place = usize::from(cut) % text.len();
        prop_assert!(Key::from_uri(&text[..place]).is_err() && Key::from_uri(&text[place + 1..]).is_err());
        let mut wrong = text.into_bytes();
        wrong[place] ^= 1;
        prop_assert!(Key::from_uri(core::str::from_utf8(&wrong).expect("text")).is_err());
    }
}

#[test]
fn what_does_not_fit_is_not_sent() {
    let mut air = Air::joined(3);
    let mut room = [0; 250];
    let long = "x".repeat(MAX_BODY);
    assert_eq!(air.station.seal(air.now, &Payload::Line(&long), &mut room).map(<[u8]>::len), Ok(250));
    let longer = "x".repeat(MAX_BODY + 1);
    assert_eq!(air.station.seal(air.now, &Payload::Line(&longer), &mut room), Err(SealError::Length));
    let words = [[0; 4]; Sample::MAX_WORDS + 1];
    let sample = Payload::Sample(Sample::new(0, Instant::ZERO, &words));
    assert_eq!(air.vehicle.seal(air.now, &sample, &mut room), Err(SealError::Length));
}

#[test]
fn a_mistake_in_the_text_of_a_key_is_named() {
    let text = Key::generate(7, core::array::from_fn(|place| place as u8)).expect("random").uri().to_string();
    let cases = [
        (text.replace("stampfly", "starfly"), KeyError::Form),
        (text.replace("id=7", "id=256"), KeyError::Id),
        (text.replace("id=7", "id="), KeyError::Id),
        (text.replace("id=7", "id=07"), KeyError::Id),
        (text.replace("id=7", "id=-7"), KeyError::Form),
        (text.replace("id=7", "id=8"), KeyError::Checksum),
        (text.replace("key=00", "key=0g"), KeyError::Digit),
        (text.replace("key=00", "key=0A"), KeyError::Digit),
        (text.replace("key=00", "key=0é"), KeyError::Form),
        (format!("{text}0"), KeyError::Form),
        (text.replace("&sum", "&Sum"), KeyError::Form),
        (String::new(), KeyError::Form),
    ];
    for (text, expected) in cases {
        assert_eq!(Key::from_uri(&text).err(), Some(expected), "{text}");
    }
}
