//! The vehicle's end of MSP against answers that another implementation has written, and what it does with gains.

use crate::common::{Id, Vehicle};
use serde_json::Value;
use stampfly_services::Request;
use stampfly_services::msp::{Card, Misc, Msp, PidRow, PidTerm, Scale};
use stampfly_types::messages::*;
use stampfly_types::{Instant, Quat, Vec3};

const CARD: Card = Card {
    variant: *b"TEST",
    board: *b"BORD",
    version: [1, 2, 3],
    name: "tester",
    kind: 3,
    motors: 8,
    cycle: 250,
    long_analog: false,
    rows: &[
        PidRow {
            name: "ROLL",
            terms: [
                Some(PidTerm { parameter: "gain", scale: Scale::Times(20.0) }),
                Some(PidTerm { parameter: "a.name.that.is.longer.than.sixteen", scale: Scale::Over(20.0) }),
                None,
            ],
        },
        PidRow { name: "YAW", terms: [Some(PidTerm { parameter: "not there", scale: Scale::Times(1.0) }), None, None] },
    ],
    misc: Some(Misc {
        least_command: PidTerm { parameter: "gain", scale: Scale::Times(1000.0) },
        battery_scale: PidTerm { parameter: "a.name.that.is.longer.than.sixteen", scale: Scale::Times(70.0) },
        battery_warning: PidTerm { parameter: "a.name.that.is.longer.than.sixteen", scale: Scale::Times(10.0) },
        battery_critical: PidTerm { parameter: "not there", scale: Scale::Times(10.0) },
    }),
};

fn framed(direction: u8, id: u8, payload: &[u8]) -> Vec<u8> {
    let mut bytes = vec![b'$', b'M', direction, payload.len() as u8, id];
    bytes.extend(payload);
    bytes.push(bytes[3..].iter().fold(0, |all, byte| all ^ byte));
    bytes
}

fn ask(vehicle: &mut Vehicle, bytes: &[u8]) -> Vec<u8> {
    let (mut msp, mut answer) = (Msp::new(&CARD), Vec::new());
    msp.hear(Instant::ZERO, bytes, vehicle, &mut |frame| answer.extend(frame));
    answer
}

fn asked(vehicle: &mut Vehicle, id: u8, payload: &[u8]) -> Vec<u8> {
    ask(vehicle, &framed(b'<', id, payload))
}

/// The answer that the vectors have under this name.
fn expected(name: &str) -> Vec<u8> {
    let vectors: Value =
        serde_json::from_str(include_str!("../../../stampfly-link/tests/vectors/msp.json")).expect("JSON");
    let mut responses = vectors["responses"].as_array().expect("a list").iter();
    let found = responses.find(|response| response["name"].as_str().is_some_and(|other| other.starts_with(name)));
    let hex = found.unwrap_or_else(|| panic!("no {name}"))["hex"].as_str().expect("text");
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal")).collect()
}

#[test]
fn answers_are_those_that_another_implementation_has_written() {
    let mut vehicle = Vehicle::standing();
    vehicle.status(|status| (status.armed, status.mode) = (true, FlightMode::Stabilize));
    let rate = |number: f32| (number / 4.1).to_radians();
    vehicle.publish(
        Id::sensor_imu,
        &ImuData {
            accel: Vec3::new(0.0, 0.0, -9.806_65),
            gyro: Vec3::new(rate(4.0), rate(-5.0), rate(6.0)),
            ..Default::default()
        },
    );
    assert_eq!(asked(&mut vehicle, 101, &[]), expected("STATUS"));
    assert_eq!(asked(&mut vehicle, 102, &[]), expected("RAW_IMU"));
    vehicle.publish(
        Id::actuator_motor,
        &MotorOutput { duty: [0.0, 0.1, 0.2, 0.3, 0.5, 0.5, 0.5, 0.5], ..Default::default() },
    );
    assert_eq!(asked(&mut vehicle, 104, &[]), expected("MOTOR"));
    let [roll, pitch, yaw] = [-12.3, -4.5, 180.0].map(f32::to_radians);
    let attitude = Quat::from_euler_angles(roll, pitch, yaw);
    let estimate = StateEstimate {
        attitude,
        position: Vec3::new(0.0, 0.0, -12.34),
        velocity: Vec3::new(0.0, 0.0, 0.05),
        ..Default::default()
    };
    vehicle.publish(Id::estimate_state, &estimate);
    assert_eq!(asked(&mut vehicle, 108, &[]), expected("ATTITUDE"));
    assert_eq!(asked(&mut vehicle, 109, &[]), expected("ALTITUDE"));
    vehicle.publish(Id::sensor_power, &PowerData { voltage: 3.7, ..Default::default() });
    assert_eq!(asked(&mut vehicle, 110, &[]), expected("ANALOG7"));
    assert_eq!(asked(&mut vehicle, 116, &[]), expected("BOXNAMES"));
    assert_eq!(asked(&mut vehicle, 119, &[]), expected("BOXIDS"));
    assert_eq!(asked(&mut vehicle, 99, &[]), expected("error unknown"));
    vehicle.status(|status| status.armed = false);
    assert_eq!(asked(&mut vehicle, 250, &[]), expected("ack EEPROM_WRITE"));
    assert_eq!(vehicle.requests, [Request::SaveParameters]);
}

#[test]
fn headings_go_round_at_north() {
    let mut vehicle = Vehicle::standing();
    for (yaw, heading) in [(0.0, 0), (0.4, 0), (-0.2, 0), (-0.6, 359), (-1.0, 359), (-90.0, 270), (179.8, 180)] {
        let attitude = Quat::from_euler_angles(0.0, 0.0, f32::to_radians(yaw));
        vehicle.publish(Id::estimate_state, &StateEstimate { attitude, ..Default::default() });
        let answer = asked(&mut vehicle, 108, &[]);
        // Behind the head of three, length, command, roll and pitch.
        assert_eq!(answer.get(9..11), Some(&i16::to_le_bytes(heading)[..]), "{yaw}");
    }
}

#[test]
fn all_that_multiwiiconf_asks_in_one_piece_is_answered_in_order() {
    let mut vehicle = Vehicle::standing();
    let ids = [116, 111, 112, 113, 114, 100, 115, 101, 102, 103, 104, 105, 106, 107, 109, 110, 253, 254, 108];
    let bytes: Vec<u8> = ids.iter().flat_map(|id| framed(b'<', *id, &[])).collect();
    let mut answers = ask(&mut vehicle, &bytes).as_slice().to_vec();
    for id in ids {
        assert_eq!((answers[0], answers[4]), (b'$', id));
        let unknown = [103, 106, 107, 111, 253].contains(&id);
        assert_eq!(answers[2], if unknown { b'!' } else { b'>' }, "{id}");
        assert_eq!(answers[3] == 0, unknown, "{id}");
        answers.drain(..6 + usize::from(answers[3]));
    }
    assert!(answers.is_empty());
}

#[test]
fn a_gain_is_changed_within_its_range_on_the_ground_and_others_keep_what_a_byte_cannot_say() {
    let mut vehicle = Vehicle::standing();
    vehicle.parameters.0 = [1.013, 3.001];
    let mut row = [0; 30];
    // 1.013 × 20, and 20 ÷ 3.001.
    (row[0], row[1]) = (20, 7);
    assert_eq!(asked(&mut vehicle, 112, &[]), framed(b'>', 112, &row));

    row[0] = 30;
    assert_eq!(asked(&mut vehicle, 202, &row), framed(b'>', 202, &[]));
    assert_eq!(vehicle.parameters.0, [1.5, 3.001], "the second one was not touched");
    row[1] = 5;
    asked(&mut vehicle, 202, &row);
    assert_eq!(vehicle.parameters.0, [1.5, 4.0]);
    row[1] = 0;
    asked(&mut vehicle, 202, &row[..2]);
    assert_eq!(vehicle.parameters.0, [1.5, 10.0], "no integral gain is the longest time; rows that are not sent stay");

    // One of them is out of range: nothing is changed. A parameter that is not there cannot be, nor anything in flight.
    (row[0], row[1]) = (255, 10);
    assert_eq!(asked(&mut vehicle, 202, &row), framed(b'!', 202, &[]));
    (row[0], row[1], row[3]) = (30, 2, 1);
    assert_eq!(asked(&mut vehicle, 202, &row), framed(b'!', 202, &[]));
    vehicle.status(|status| status.armed = true);
    assert_eq!(asked(&mut vehicle, 202, &[40]), framed(b'!', 202, &[]));
    assert_eq!(asked(&mut vehicle, 250, &[]), framed(b'!', 250, &[]));
    assert_eq!(vehicle.parameters.0, [1.5, 10.0]);
}

#[test]
fn a_question_of_version_2_is_answered_in_version_2_and_an_answer_is_no_question() {
    let mut vehicle = Vehicle::standing();
    // Of the vectors: "$X<", flag, id 1, no payload, CRC-8/DVB-S2.
    let crc = |bytes: &[u8]| {
        bytes.iter().fold(0_u8, |crc, byte| {
            (0..8).fold(crc ^ byte, |crc, _| if crc & 0x80 != 0 { crc << 1 ^ 0xD5 } else { crc << 1 })
        })
    };
    let checked = |head: &[u8], rest: &[u8]| [head, rest, &[crc(rest)]].concat();
    let answer = ask(&mut vehicle, &checked(b"$X<", &[0, 1, 0, 0, 0]));
    assert_eq!(answer, checked(b"$X>", &[0, 1, 0, 3, 0, 0, 1, 40]));
    assert!(ask(&mut vehicle, &framed(b'>', 108, &[0; 6])).is_empty());
}

#[test]
fn what_lay_in_a_queue_changes_nothing_and_is_answered() {
    let mut vehicle = Vehicle::standing();
    let before = vehicle.parameters.0;
    for (id, payload) in [(202, &[40][..]), (207, &[0; 22]), (208, &[]), (241, &[]), (68, &[]), (250, &[]), (210, &[0])]
    {
        let (mut msp, mut answer) = (Msp::new(&CARD), Vec::<u8>::new());
        let question = framed(b'<', id, payload);
        msp.hear_late(Instant::ZERO, &question, &mut vehicle, &mut |frame| answer.extend(frame));
        assert_eq!(answer, framed(b'!', id, &[]), "{id}");
        // What only asks is answered as ever.
        answer.clear();
        msp.hear_late(Instant::ZERO, &framed(b'<', 2, &[]), &mut vehicle, &mut |frame| answer.extend(frame));
        assert_eq!(answer, framed(b'>', 2, b"TEST"));
    }
    assert_eq!((vehicle.parameters.0, vehicle.requests), (before, vec![]));
}

#[test]
fn a_question_that_was_cut_short_is_forgotten_after_a_silence() {
    let (mut msp, mut vehicle, mut answer) = (Msp::new(&CARD), Vehicle::standing(), Vec::<u8>::new());
    msp.hear(Instant::ZERO, b"$M<\x20\xCA", &mut vehicle, &mut |frame| answer.extend(frame));
    msp.hear(Instant::from_millis(600), &framed(b'<', 2, &[]), &mut vehicle, &mut |frame| answer.extend(frame));
    assert_eq!(answer, framed(b'>', 2, b"TEST"));
}

#[test]
fn of_misc_only_what_is_sent_changes() {
    let mut vehicle = Vehicle::standing();
    vehicle.parameters.0 = [1.013, 3.0];
    let mut payload = [0; 22];
    payload[6..8].copy_from_slice(&1013_u16.to_le_bytes());
    (payload[18], payload[20]) = (210, 30);
    assert_eq!(asked(&mut vehicle, 114, &[]), framed(b'>', 114, &payload));
    // Older programs send the power trigger alone.
    assert_eq!(asked(&mut vehicle, 207, &payload[..2]), framed(b'>', 207, &[]));
    assert_eq!(vehicle.parameters.0, [1.013, 3.0]);
    payload[6..8].copy_from_slice(&1500_u16.to_le_bytes());
    assert_eq!(asked(&mut vehicle, 207, &payload[..8]), framed(b'>', 207, &[]));
    assert_eq!(vehicle.parameters.0, [1.5, 3.0]);
    // A parameter that there is not cannot be changed, so nothing is.
    (payload[18], payload[21]) = (140, 1);
    assert_eq!(asked(&mut vehicle, 207, &payload), framed(b'!', 207, &[]));
    assert_eq!(vehicle.parameters.0, [1.5, 3.0]);
    assert_eq!(asked(&mut vehicle, 208, &[]), framed(b'>', 208, &[]));
    assert_eq!(asked(&mut vehicle, 241, &[]), framed(b'>', 241, &[]));
    assert_eq!(vehicle.requests, [Request::ResetParameters, Request::Bind]);
    vehicle.status(|status| status.armed = true);
    for id in [207, 208, 241] {
        assert_eq!(asked(&mut vehicle, id, &[]), framed(b'!', id, &[]), "armed");
    }
}

#[test]
fn a_question_that_there_is_no_room_for_is_answered_with_an_error_and_the_next_one_is_understood() {
    let mut vehicle = Vehicle::standing();
    let jumbo = {
        let mut bytes = vec![b'$', b'M', b'<', 255, 199, 0x2C, 1];
        bytes.extend([0x24; 300]);
        bytes.push(bytes[3..].iter().fold(0, |all, byte| all ^ byte));
        bytes
    };
    let second = {
        let mut bytes = [0; 400];
        let frame = stampfly_services::link::msp::MspFrame {
            version: stampfly_services::link::msp::Version::Two,
            payload: &[9; 300],
            ..stampfly_services::link::msp::MspFrame::request(0x1234)
        };
        let length = frame.write(&mut bytes).expect("there is room");
        bytes[..length].to_vec()
    };
    for (question, error) in [
        (framed(b'<', 199, &[0; 200]), framed(b'!', 199, &[])),
        (framed(b'<', 199, &[0; 59]), framed(b'!', 199, &[])),
        (jumbo, framed(b'!', 199, &[])),
        (second, vec![b'$', b'X', b'!', 0, 0x34, 0x12, 0, 0, 0xB5]),
        (framed(b'>', 199, &[0; 200]), vec![]),
    ] {
        let attitude = asked(&mut vehicle, 108, &[]);
        let mut answer = ask(&mut vehicle, &question);
        if question[1] == b'X' {
            // Its check is another crate's business.
            answer.pop();
            assert_eq!(answer, error[..8]);
        } else {
            assert_eq!(answer, error);
        }
        let mut both = question.clone();
        both.extend(framed(b'<', 108, &[]));
        assert!(ask(&mut vehicle, &both).ends_with(&attitude));
        // One that is not whole, and one that is spoiled.
        let cut = &question[..question.len() - 1];
        assert_eq!(ask(&mut vehicle, cut), Vec::<u8>::new());
        let mut spoiled = question;
        *spoiled.last_mut().expect("a check") ^= 1;
        assert_eq!(ask(&mut vehicle, &spoiled), Vec::<u8>::new());
    }
}
