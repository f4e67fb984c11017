//! The services of a vehicle, from any bytes at their ports, while the vehicle does whatever it likes.
//!
//! Messages are mostly framed soundly here, because a checksum stops nearly all bytes that are drawn, and what is behind it would not be reached.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../../../stampfly-services/tests/services/common.rs"]
mod common;

use crate::Input;
use common::{Board, Id, Vehicle, topics};
use stampfly_flight::console::Request as ConsoleRequest;
use stampfly_link::mavlink::dialects::common::{MavMessage, MavType};
use stampfly_link::mavlink::signing::{Signer, SigningKey};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkFrame, MavlinkWriter, Tunnel};
use stampfly_link::msp::{Direction, MspDecoder, MspFrame, Version};
use stampfly_link::secure::Kind;
use stampfly_services::cable::{Cable, Envelope, PAUSE, TYPE, fingerprint};
use stampfly_services::mavlink::{Identity, Mavlink};
use stampfly_services::msp::{Card, Msp, PidRow, PidTerm, Scale};
use stampfly_services::{Request, Tello};
use stampfly_types::messages::*;
use stampfly_types::{Duration, Instant};

const IDENTITY: Identity =
    Identity { system: 1, kind: MavType::MAV_TYPE_QUADROTOR, take_off_height: 0.5, reach: 0.25, version: [0, 2, 0] };
/// What stations send: heartbeat, mode, parameters, missions, sticks, commands, targets, origin.
const MESSAGES: [u32; 27] =
    [0, 11, 20, 21, 23, 39, 40, 41, 43, 44, 45, 47, 48, 51, 69, 70, 73, 75, 76, 84, 86, 111, 4, 37, 38, 82, 117];
/// So many bytes a message has at most here.
const PAYLOAD: usize = 60;

/// What the vehicle does of itself.
fn change(vehicle: &mut Vehicle, input: &mut Input<'_>) {
    let (phase, bits) = (input.byte(), input.byte());
    vehicle.status(|status| {
        status.phase = [
            FlightPhase::Init,
            FlightPhase::IdleGround,
            FlightPhase::IdleHeld,
            FlightPhase::Armed,
            FlightPhase::TakeOff,
            FlightPhase::Flying,
            FlightPhase::Landing,
            FlightPhase::Flip,
        ][usize::from(phase % 8)];
        status.armed = bits & 1 != 0;
        status.blocks = if bits & 2 != 0 { ArmBlocks::TILTED } else { ArmBlocks::NONE };
        status.commander = [CommandSource::None, CommandSource::Pilot, CommandSource::Guided, CommandSource::Failsafe]
            [usize::from(bits >> 2 & 3)];
    });
    if bits & 16 != 0 {
        let valid = Validity::TILT | Validity::POSITION_XY | Validity::POSITION_Z;
        let (position, velocity) = (input.vector(3.0), input.vector(3.0));
        vehicle.publish(Id::estimate_state, &StateEstimate { valid, position, velocity, ..Default::default() });
    }
    if bits & 64 != 0 {
        // A path that is none, once in a while.
        let (position, mut velocity) = (input.vector(3.0), input.vector(3.0));
        velocity.x = if input.byte() == 0 { f32::NAN } else { velocity.x };
        let axes = SetpointAxes::POSITION_XY | SetpointAxes::POSITION_Z;
        vehicle.publish(Id::setpoint, &Setpoint { position, velocity, axes, ..Default::default() });
    }
    if bits & 32 != 0 {
        let (voltage, current) = (input.number(5.0), input.number(5.0));
        vehicle.publish(Id::sensor_power, &PowerData { voltage, current, ..Default::default() });
    }
}

/// What no service may have done, whatever it was told.
fn check(vehicle: &Vehicle, before: &[f32; 2], armed: bool) {
    assert!(vehicle.parameters.0.iter().all(|value| (0.0..=10.0).contains(value)), "{:?}", vehicle.parameters);
    if armed {
        assert_eq!(vehicle.parameters.0, *before, "changed while armed");
    }
    for command in vehicle.guided.iter().filter(|command| command.kind != GuidedKind::Kill) {
        let GuidedCommand { position, yaw, speed, dwell, .. } = command;
        let numbers = position.iter().chain([yaw, speed, dwell]);
        assert!(numbers.into_iter().all(|number| number.is_finite() && number.abs() <= 1_000.0), "{command:?}");
    }
}

/// A station's end: everything that comes has to be sound.
fn read(bytes: &[u8], mut look: impl FnMut(MavlinkFrame<'_>)) {
    let mut decoder = MavlinkDecoder::<MavMessage>::new();
    for byte in bytes {
        if let Some(frame) = decoder.feed(*byte) {
            look(frame);
        }
    }
    assert_eq!(decoder.discarded(), 0, "it sends what is no frame");
}

/// Messages and noise of three clients, time, and a vehicle that changes. The first byte says whether a key is asked for.
pub fn services_mavlink(data: &[u8]) {
    let mut input = Input(data);
    let key = SigningKey::new([7; 32]);
    let must_sign = input.byte() & 1 == 1;
    let mut mavlink = match must_sign {
        true => Mavlink::new(IDENTITY).with_key(key.clone(), 0),
        false => Mavlink::new(IDENTITY),
    };
    let mut signer = Signer::new(key, 0, 0);
    let (mut vehicle, mut now) = (Vehicle::flying(), Instant::ZERO);
    let mut writers = [0, 1, 2].map(|number| MavlinkWriter::new(250 + number, 190));
    let mut noisy = [false; 3];
    while !input.is_empty() {
        let (kind, client) = (input.byte(), input.byte() % 3);
        let (before, asked) = (vehicle.parameters.0, vehicle.guided.len());
        let mut sent = Vec::new();
        match kind % 8 {
            0 => change(&mut vehicle, &mut input),
            1 => {
                now += Duration::from_micros(1_000 * u64::from(input.byte()));
                mavlink.poll(now, &mut vehicle, &mut |_, frame| sent.extend(frame));
            }
            2 => {
                let length = usize::from(input.byte());
                noisy[usize::from(client)] = true;
                mavlink.hear(now, client, input.bytes(length), &mut vehicle, &mut |_, frame| sent.extend(frame));
            }
            _ => {
                let id = MESSAGES[usize::from(input.byte()) % MESSAGES.len()];
                let length = usize::from(input.byte()) % PAYLOAD;
                let mut payload = [0; PAYLOAD];
                let drawn = input.bytes(length);
                payload[..drawn.len()].copy_from_slice(drawn);
                // Most of them are for this vehicle: where its number stands in what is asked for most.
                if kind & 0x80 == 0 {
                    let place = match id {
                        75 | 76 => Some(30),
                        39 | 73 => Some(32),
                        84 | 86 => Some(50),
                        82 => Some(36),
                        70 => Some(16),
                        40 | 44 | 51 | 41 => Some(2),
                        23 | 37 | 38 | 117 => Some(4),
                        _ => None,
                    };
                    for (place, value) in place.into_iter().flat_map(|place| [(place, 1), (place + 1, 1)]) {
                        payload[place] = value;
                    }
                }
                let signs = must_sign && kind & 0x40 == 0;
                let mut bytes = [0; LONGEST];
                let writer = &mut writers[usize::from(client)];
                let frame = match signs {
                    true => writer.write_payload_signed::<MavMessage>(now, id, &payload, &mut signer, &mut bytes),
                    false => writer.write_payload::<MavMessage>(id, &payload, &mut bytes),
                };
                let frame = frame.expect("there is room").to_vec();
                mavlink.hear(now, client, &frame, &mut vehicle, &mut |_, frame| sent.extend(frame));
                let mut acknowledged = 0;
                read(&sent, |frame| acknowledged += usize::from(frame.id == 77));
                let believed = signs || !must_sign;
                let is_command = matches!(id, 75 | 76) && kind & 0x80 == 0;
                // Noise may have begun a frame that this one is taken for a part of.
                if !noisy[usize::from(client)] && (is_command || !believed) {
                    // What changes the vehicle's state is acknowledged when it has happened.
                    assert!(acknowledged <= usize::from(believed), "message {id}");
                }
                // And what was signed before may have been a part of the noise until now.
                if !believed && !noisy[usize::from(client)] {
                    assert_eq!(vehicle.guided.len(), asked, "a stranger is obeyed");
                }
            }
        }
        read(&sent, |frame| assert_eq!(frame.signature.is_some(), must_sign));
        // A parameter is taken from an armed vehicle's station, too: some change in flight, others wait.
        check(&vehicle, &before, false);
    }
}

fn vehicle_is_armed(vehicle: &Vehicle) -> bool {
    use stampfly_services::VehicleAccess as _;
    vehicle.view().state().armed
}

/// Lines of text of three programs, time, and a vehicle that changes.
pub fn services_tello(data: &[u8]) {
    let mut input = Input(data);
    let (mut tello, mut vehicle, mut now) = (Tello::new(), Vehicle::standing(), Instant::ZERO);
    while !input.is_empty() {
        let kind = input.byte();
        let (before, armed) = (vehicle.parameters.0, vehicle_is_armed(&vehicle));
        let mut look = |_: &u8, _: stampfly_services::tello::Destination, bytes: &[u8]| {
            assert!(std::str::from_utf8(bytes).is_ok_and(|text| !text.is_empty() && text.len() < 512), "{bytes:?}");
        };
        match kind % 4 {
            0 => change(&mut vehicle, &mut input),
            1 => {
                now += Duration::from_micros(1_000 * u64::from(input.byte()) * u64::from(1 + kind / 16));
                tello.poll(now, &mut vehicle, &mut look);
            }
            _ => {
                let rest = input.0;
                let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
                let line = input.bytes(length);
                _ = input.byte();
                tello.hear(now, kind / 4 % 3, line, &mut vehicle, &mut look);
            }
        }
        check(&vehicle, &before, armed);
    }
}

const CARD: Card = Card {
    variant: *b"FUZZ",
    board: *b"FUZZ",
    version: [0, 2, 0],
    name: "fuzz",
    kind: 3,
    motors: 4,
    cycle: 2_500,
    long_analog: true,
    misc: None,
    rows: &[PidRow {
        name: "ROLL",
        terms: [
            Some(PidTerm { parameter: "gain", scale: Scale::Times(20.0) }),
            Some(PidTerm { parameter: "a.name.that.is.longer.than.sixteen", scale: Scale::Over(50.0) }),
            None,
        ],
    }],
};

/// Questions and noise of one configurator, time, and a vehicle that changes.
pub fn services_msp(data: &[u8]) {
    let mut input = Input(data);
    let (mut msp, mut vehicle, mut now) = (Msp::new(&CARD), Vehicle::standing(), Instant::ZERO);
    while !input.is_empty() {
        let kind = input.byte();
        let (before, armed, asked) = (vehicle.parameters.0, vehicle_is_armed(&vehicle), vehicle.requests.len());
        let mut answers = Vec::new();
        match kind % 4 {
            0 => change(&mut vehicle, &mut input),
            1 => {
                let length = usize::from(input.byte());
                msp.hear(now, input.bytes(length), &mut vehicle, &mut |bytes| answers.extend(bytes));
            }
            _ => {
                now += Duration::from_micros(10_000 * u64::from(input.byte()));
                let version = if kind & 0x80 == 0 { Version::One } else { Version::Two };
                let (id, length) = (input.byte(), usize::from(input.byte() % 48));
                let payload = input.bytes(length);
                let id = u16::from(if version == Version::One { id.min(254) } else { id });
                let frame = MspFrame { version, direction: Direction::Request, flag: 0, id, payload };
                let mut bytes = [0; 64];
                let length = frame.write(&mut bytes).expect("there is room");
                msp.hear(now, &bytes[..length], &mut vehicle, &mut |bytes| answers.extend(bytes));
            }
        }
        let mut decoder = MspDecoder::<200>::new();
        for byte in &answers {
            let Some(frame) = decoder.feed(*byte) else { continue };
            assert_ne!(frame.direction, Direction::Request);
            assert!(frame.direction == Direction::Reply || frame.payload.is_empty());
        }
        assert_eq!(decoder.discarded(), 0, "it sends what is no frame");
        check(&vehicle, &before, armed);
        assert!(!armed || vehicle.requests.len() == asked, "an armed vehicle is asked for something");
        assert_eq!(vehicle.guided, []);
        let asked_for = |request: &Request| {
            matches!(request, Request::SaveParameters | Request::ResetParameters | Request::Bind | Request::Restart)
        };
        assert!(vehicle.requests.iter().all(asked_for), "{:?}", vehicle.requests);
    }
}

/// A serial line: text, noise, sound frames of MAVLink and of a station, time, and a vehicle that changes.
pub fn services_cable(data: &[u8]) {
    let mut input = Input(data);
    let (mut vehicle, mut now) = (Vehicle::standing(), Instant::from_secs(1));
    let table = fingerprint(&topics::TOPICS, &vehicle.parameters);
    let mut cable = Cable::<4>::new(IDENTITY, table);
    let mut writer = MavlinkWriter::new(250, 190);
    let mut sent = Vec::new();
    while !input.is_empty() {
        let (kind, before, armed) = (input.byte(), vehicle.parameters.0, vehicle_is_armed(&vehicle));
        let mut typed = Vec::new();
        let mut expected = None;
        let mut bytes = [0; LONGEST];
        let heard = match kind % 6 {
            0 => {
                change(&mut vehicle, &mut input);
                continue;
            }
            1 => {
                now += Duration::from_micros(1_000 * u64::from(input.byte()));
                let newest = vehicle.samples();
                cable.poll(now, &mut vehicle, &newest, &mut |frame| sent.extend(frame));
                let request =
                    cable.answer(now, &mut Board(&mut vehicle.parameters, armed), &mut |frame| sent.extend(frame));
                assert!(request == ConsoleRequest::Nothing || !armed, "an armed vehicle is asked for {request:?}");
                if kind & 0x80 == 0 {
                    cable.report(&"done");
                }
                // The first one changes in flight, the second waits for the ground.
                assert!(!armed || vehicle.parameters.0[1] == before[1], "changed while armed");
                check(&vehicle, &before, false);
                continue;
            }
            2 => {
                let length = usize::from(input.byte());
                input.bytes(length)
            }
            3 => {
                // After a pause a line is whole, whatever was before it.
                now += PAUSE;
                let length = usize::from(input.byte());
                let line = input.bytes(length);
                expected = line.iter().all(|byte| *byte < 0xFD).then_some(line);
                line
            }
            4 => {
                let id = MESSAGES[usize::from(input.byte()) % MESSAGES.len()];
                let length = usize::from(input.byte()) % PAYLOAD;
                writer.write_payload::<MavMessage>(id, input.bytes(length), &mut bytes).expect("there is room")
            }
            _ => {
                // A station's envelope: mostly of the same tables.
                let own = if kind & 0x80 == 0 { table } else { !table };
                let kinds = Kind::ALL;
                let of = kinds[usize::from(input.byte()) % kinds.len()];
                let (number, length) = (input.byte(), usize::from(input.byte()) % 120);
                let ([t0, t1], last) = (own.to_le_bytes(), 0x80);
                let envelope = [&[t0, t1, number, 0, of as u8, last], input.bytes(length)].concat();
                let tunnel = Tunnel::new(TYPE, [0; 2], &envelope).expect("there is room");
                writer.write_payload::<MavMessage>(Tunnel::ID, &tunnel.payload(), &mut bytes).expect("there is room")
            }
        };
        cable.hear(now, heard, &mut vehicle, &mut |frame| sent.extend(frame), &mut |key| typed.push(key));
        assert!(typed.len() <= heard.len());
        assert!(expected.is_none_or(|expected| expected == typed), "a line is not what was typed");
        // A parameter is taken from an armed vehicle's station, too: some change in flight, others wait.
        check(&vehicle, &before, false);
    }
    read(&sent, |frame| {
        if frame.id == Tunnel::ID {
            let tunnel = Tunnel::read(frame.payload).expect("a tunnel");
            assert!(Envelope::read(&tunnel.bytes).is_some_and(|(envelope, _)| envelope.table == table));
        }
    });
}
