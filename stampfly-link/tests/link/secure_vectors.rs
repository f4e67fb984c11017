//! The secure session against another implementation: `secure_vectors.py` made the frames, of OpenSSL's ciphers.

use crate::hex::hex;
use chacha20poly1305::aead::AeadInOut;
use chacha20poly1305::{ChaCha20Poly1305, KeyInit, Nonce};
use serde_json::Value;
use stampfly_link::secure::{Key, MAX_FRAME, Payload, Received, Sample, Station, Vehicle};
use stampfly_link::{LinkState, TelemetryPacket};
use stampfly_types::messages::{FlightMode, GuidedCommand, GuidedKind, PilotInput};
use stampfly_types::{Instant, Vec3};

const NOW: Instant = Instant::from_millis(20);
const WAY_POINT: GuidedCommand = GuidedCommand {
    kind: GuidedKind::WayPoint,
    position: Vec3::new(1.0, -2.0, -1.5),
    yaw: 0.75,
    speed: 0.5,
    dwell: 2.0,
};

fn vectors() -> Value {
    serde_json::from_str(include_str!("../vectors/secure.json")).expect("the vectors")
}

fn number(value: &Value) -> [u8; 8] {
    hex(value).try_into().expect("eight bytes")
}

fn key(vectors: &Value) -> Key {
    Key::from_uri(vectors["uri"].as_str().expect("a key")).expect("a key")
}

/// What the frames of the file say.
fn payload(name: &str) -> Payload<'static> {
    const TEXT: &str = "höhe 1.5 m\n";
    const WORDS: [[u8; 4]; 3] = [[1, 0, 0, 0], [0xFF; 4], [0, 0, 0x80, 0x3F]];
    match name {
        "sticks" => Payload::Sticks(PilotInput {
            roll: 0.25,
            pitch: -1.0,
            throttle: 0.5,
            mode: FlightMode::from_number(2).expect("a mode"),
            arm: true,
            ..Default::default()
        }),
        "guided" => Payload::Guided(WAY_POINT),
        "numbered" => Payload::Numbered { number: 0xDEAD_BEEF, command: WAY_POINT },
        "kill" => Payload::Kill,
        "read parameter" => Payload::ReadParameter { index: 513 },
        "write parameter" => Payload::WriteParameter { index: 513, value: -0.125 },
        "line" => Payload::Line(TEXT),
        "question" => Payload::Question { number: 0xDEAD_BEEF, from: 240, line: TEXT },
        "part" => Payload::Part { number: 0xDEAD_BEEF, from: 240, text: TEXT, last: true },
        "telemetry" => {
            let degrees = core::f32::consts::PI / 180.0;
            Payload::Telemetry(TelemetryPacket {
                counter: 7,
                battery: 3.85,
                height: 1.2,
                velocity: Vec3::new(0.1, -0.2, 0.3),
                attitude: Vec3::new(1.0, -2.0, 90.0) * degrees,
                state: LinkState::Flying,
                low_battery: true,
                ..Default::default()
            })
        }
        "parameter" => Payload::Parameter { index: 513, value: -0.125, taken: false },
        "reply" => Payload::Reply { text: TEXT, last: true },
        "sample" => Payload::Sample(Sample::new(12, Instant::from_micros(1_234_567_890_123), &WORDS)),
        "acknowledgement" => Payload::Acknowledgement { counter: 4, taken: true },
        "longest reply" => Payload::Reply { text: Box::leak("x".repeat(218).into_boxed_str()), last: false },
        other => panic!("{other} is in no test"),
    }
}

/// As far as a packet of telemetry tells them apart.
fn same(one: &Received<'_>, other: &Payload<'_>) -> bool {
    match (&one.payload, other) {
        (Payload::Telemetry(one), Payload::Telemetry(other)) => one.to_bytes() == other.to_bytes(),
        (one, other) => one == other,
    }
}

#[test]
fn the_text_of_a_key_is_as_another_program_writes_it() {
    let vectors = vectors();
    let key = key(&vectors);
    assert_eq!(key.bytes()[..], hex(&vectors["key"]));
    assert_eq!(u64::from(key.id()), vectors["key_id"].as_u64().expect("a number"));
    assert_eq!(key.uri().to_string(), vectors["uri"].as_str().expect("text"));
}

#[test]
fn a_handshake_and_every_kind_of_frame_are_those_of_another_implementation_bit_for_bit() {
    let vectors = vectors();
    let (mut vehicle, mut station) = (Vehicle::new(key(&vectors)), Station::new(key(&vectors)));
    let (of_vehicle, of_station) = (number(&vectors["of_vehicle"]), number(&vectors["of_station"]));
    let mut room = [0; MAX_FRAME];

    let announcement = vehicle.transmit(NOW, of_vehicle, &mut room).expect("an announcement").to_vec();
    assert_eq!(announcement, hex(&vectors["announcement"]));
    assert_eq!(station.receive(NOW, &mut announcement.clone()), Ok(None));
    let join = station.transmit(NOW, of_station, &mut room).expect("an answer").to_vec();
    assert_eq!(join, hex(&vectors["join"]));
    assert_eq!(vehicle.receive(NOW, &mut join.clone()), Ok(None));

    for vector in vectors["frames"].as_array().expect("frames") {
        let (name, expected) = (vector["name"].as_str().expect("a name"), hex(&vector["frame"]));
        let sealed = match name {
            "welcome" => vehicle.transmit(NOW, [0; 8], &mut room).expect("a welcome"),
            "ready" => station.transmit(NOW, [0; 8], &mut room).expect("ready"),
            _ if vector["to_vehicle"] == true => station.seal(NOW, &payload(name), &mut room).expect("sealed"),
            _ => vehicle.seal(NOW, &payload(name), &mut room).expect("sealed"),
        };
        assert_eq!(sealed, expected, "{name}");
        let mut frame = expected.clone();
        let received = match vector["to_vehicle"] == true {
            true => vehicle.receive(NOW, &mut frame),
            false => station.receive(NOW, &mut frame),
        };
        match received.unwrap_or_else(|refused| panic!("{name}: {refused}")) {
            None => assert!(matches!(name, "welcome" | "ready")),
            Some(received) => {
                assert!(same(&received, &payload(name)), "{name}: {received:?}");
                let mut body = [0; 250];
                let length = received.payload.encode(&mut body).expect("encoded");
                assert_eq!(body[..length], hex(&vector["body"]), "{name}");
            }
        }
    }
}

/// What is put together of the parts is what the crate of the whole does, for every length.
#[test]
fn frames_of_every_length_are_those_of_the_crate_that_has_cipher_and_authenticator_in_one() {
    let vectors = vectors();
    let shared = key(&vectors);
    let purpose = [hex(&vectors["of_vehicle"]), hex(&vectors["of_station"])].concat();
    let purpose: [u8; 16] = purpose.try_into().expect("two numbers");
    let session = chacha20::hchacha::<chacha20::R20>(&(*shared.bytes()).into(), &purpose.into());
    let cipher = ChaCha20Poly1305::new(&session);
    let (mut vehicle, mut station, mut room) = (Vehicle::new(shared.clone()), Station::new(shared), [0; MAX_FRAME]);
    let mut frame = vehicle.transmit(NOW, number(&vectors["of_vehicle"]), &mut room).expect("announces").to_vec();
    station.receive(NOW, &mut frame).expect("an announcement");
    let mut frame = station.transmit(NOW, number(&vectors["of_station"]), &mut room).expect("answers").to_vec();
    vehicle.receive(NOW, &mut frame).expect("an answer");
    let mut frame = vehicle.transmit(NOW, [0; 8], &mut room).expect("welcomes").to_vec();
    station.receive(NOW, &mut frame).expect("a welcome");
    for length in 0..=219 {
        let text = "y".repeat(length);
        let mut frame = station.seal(NOW, &Payload::Line(&text), &mut room).expect("sealed").to_vec();
        let (head, rest) = frame.split_at_mut(11);
        let (text, tag) = rest.split_at_mut(length + 4);
        let mut nonce = [0; 12];
        nonce[0] = 1;
        nonce[4..].copy_from_slice(&head[3..]);
        let tag: [u8; 16] = (&*tag).try_into().expect("a tag");
        let opened = cipher.decrypt_inout_detached(&Nonce::from(nonce), head, (&mut *text).into(), &tag.into());
        assert!(opened.is_ok() && text[4..].iter().all(|byte| *byte == b'y'), "{length}");
    }
    assert!(station.seal(NOW, &Payload::Line(&"y".repeat(220)), &mut room).is_err(), "longer than any");
}

/// The derivation is that of the draft.
#[test]
fn the_derivation_of_keys_gives_the_drafts_vector() {
    let draft = &vectors()["draft"];
    let key: [u8; 32] = hex(&draft["key"]).try_into().expect("a key");
    let purpose: [u8; 16] = hex(&draft["purpose"]).try_into().expect("sixteen bytes");
    let derived = chacha20::hchacha::<chacha20::R20>(&key.into(), &purpose.into());
    assert_eq!(derived[..], hex(&draft["derived"]));
}
