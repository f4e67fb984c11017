//! The data stream: bytes by hand from the tables, what does not fit, and that nothing else is taken for a packet.

use crate::hex::hex;
use proptest::prelude::*;
use serde_json::Value;
use stampfly_link::stream::{
    CYCLES, LONGEST, StreamBuildError, StreamBuilder, StreamCycle, StreamEntry, StreamError, StreamGains, StreamOutput,
    StreamPacket, StreamPhase, StreamRequest, StreamSink, StreamStatus,
};
use stampfly_types::{Instant, Quat, Vec3};

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn words(numbers: &[i16]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn checked(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.push(bytes.iter().fold(0, |all, byte| all ^ byte));
    bytes
}

/// The cycle with this number, and its three blocks by hand.
fn cycle(index: u32) -> (StreamCycle, [Vec<u8>; 3]) {
    let base = index as f32 * 100.0;
    let vector = |first: f32| Vec3::new(base + first, base + first + 1.0, base + first + 2.0);
    let cycle = StreamCycle {
        time: 2_500 * index,
        rate: vector(1.0),
        force: vector(4.0),
        raw_rate: vector(7.0),
        raw_force: vector(10.0),
        attitude: Quat::new_unchecked(base + 13.0, base + 14.0, base + 15.0, base + 16.0),
        rate_bias: Vec3::new(0.0123, -0.0123, 0.00004),
        force_bias: Vec3::new(9.0, -9.0, f32::INFINITY),
        position_time: 2_500 * index + 7,
        position: vector(20.0),
        velocity: vector(23.0),
        wanted_rate: Vec3::new(1.5, -1.5, 0.0006),
    };
    let numbers: Vec<f32> = (1..=16).map(|number| base + number as f32).collect();
    let inertial = [
        (2_500 * index).to_le_bytes().to_vec(),
        floats(&numbers),
        words(&[123, -123, 0]),
        words(&[i16::MAX, i16::MIN, i16::MAX]),
    ];
    let numbers: Vec<f32> = (20..=25).map(|number| base + number as f32).collect();
    let position = [(2_500 * index + 7).to_le_bytes().to_vec(), floats(&numbers)];
    (cycle, [inertial.concat(), position.concat(), words(&[1_500, -1_500, 1])])
}

/// A packet by hand, with these entries.
fn by_hand(sequence: u16, count: u8, entries: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0x50];
    bytes.extend(sequence.to_le_bytes());
    bytes.push(8);
    for block in 0..3 {
        (0..8).for_each(|index| bytes.extend(&cycle(index).1[block]));
    }
    bytes.push(count);
    bytes.extend(entries);
    checked(bytes)
}

fn filled(sequence: u16) -> StreamBuilder {
    let mut builder = StreamBuilder::new(sequence);
    (0..8).for_each(|index| builder.cycle(&cycle(index).0).expect("eight fit"));
    builder
}

/// Each kind of entry, and its bytes by hand.
fn entries() -> Vec<(StreamEntry<'static>, Vec<u8>)> {
    let time = 0x0403_0201;
    let with = |id: u8, rest: Vec<u8>| {
        let mut bytes = vec![id, rest.len() as u8 + 4, 1, 2, 3, 4];
        bytes.extend(rest);
        bytes
    };
    let duty: Vec<u8> = (0..32_u32).flat_map(|index| (index as u16 * 2_114).to_le_bytes()).collect();
    let duty: Vec<u8> = [0x4A, 64].into_iter().chain(duty).collect();
    let outputs: Vec<f32> = (0..32).map(|number| number as f32 - 7.0).collect();
    let output = [vec![0x4B, 128], floats(&outputs)].concat();
    let phases: Vec<u8> = (0..8u8)
        .flat_map(|cycle| [[cycle, 2, 3].to_vec(), (i16::from(cycle) * 500 - 1_000).to_le_bytes().to_vec()].concat())
        .collect();
    let phase = [vec![0x4C, 40], phases].concat();
    let at = |cycle: usize, motor: usize| outputs[cycle * 4 + motor];
    vec![
        (
            StreamEntry::Pilot { time, throttle: 0.1, roll: 0.2, pitch: 0.3, yaw: 0.4 },
            with(0x42, floats(&[0.1, 0.2, 0.3, 0.4])),
        ),
        (
            StreamEntry::Flow { time, counts: [-2, 300], surface_quality: 90 },
            with(0x43, [words(&[-2, 300]), vec![90]].concat()),
        ),
        (StreamEntry::Below { time, distance: 0.5, status: 1 }, with(0x44, [floats(&[0.5]), vec![1]].concat())),
        (StreamEntry::InFront { time, distance: 2.5, status: 0 }, with(0x47, [floats(&[2.5]), vec![0]].concat())),
        (StreamEntry::Barometer { time, height: 1.25, pressure: 1013.25 }, with(0x45, floats(&[1.25, 1013.25]))),
        (StreamEntry::Magnetometer { time, field: Vec3::new(1.0, 2.0, 3.0) }, with(0x46, floats(&[1.0, 2.0, 3.0]))),
        (
            StreamEntry::Wanted { time, mode: 3, angle: [0.5, -0.25], thrust: 0.35, duty: [0.1, 0.2, 0.3, 0.4] },
            with(0x48, [vec![3, 0], words(&[5_000, -2_500]), floats(&[0.35, 0.1, 0.2, 0.3, 0.4])].concat()),
        ),
        (
            StreamEntry::Duty(core::array::from_fn(|cycle| {
                core::array::from_fn(|motor| f32::from((cycle * 4 + motor) as u16 * 2_114) / 65_535.0)
            })),
            duty,
        ),
        (
            StreamEntry::Output(core::array::from_fn(|cycle| StreamOutput {
                thrust: at(cycle, 0),
                torque: Vec3::new(at(cycle, 1), at(cycle, 2), at(cycle, 3)),
            })),
            output,
        ),
        (
            StreamEntry::Phase(core::array::from_fn(|cycle| StreamPhase {
                state: cycle as u8,
                flip: 2,
                result: 3,
                angle: cycle as f32 * 0.5 - 1.0,
            })),
            phase,
        ),
        (StreamEntry::Flags { time, buttons: 5, flags: 6, blocked: 7, arming: 8 }, with(0x4D, vec![5, 6, 7, 8])),
        (StreamEntry::Other { id: 0x60, data: &[9, 8, 7] }, vec![0x60, 3, 9, 8, 7]),
    ]
}

#[test]
fn a_packet_has_the_bytes_of_the_tables() {
    let mut builder = filled(0xFFFE);
    let mut hand = Vec::new();
    for (entry, bytes) in entries() {
        builder.entry(&entry).expect("they fit");
        hand.extend(bytes);
    }
    let bytes = builder.finish().expect("whole").to_vec();
    assert_eq!(bytes, by_hand(0xFFFE, 12, &hand));

    let packet = StreamPacket::decode(&bytes).expect("well-formed");
    assert_eq!(packet.sequence, 0xFFFE);
    assert!(packet.entries().eq(entries().into_iter().map(|(entry, _)| entry)));
    assert_eq!((packet.cycles().count(), packet.cycle(8)), (CYCLES, None));
    for (index, read) in packet.cycles().enumerate() {
        let (sent, _) = cycle(index as u32);
        let force_bias = Vec3::new(3.2767, -3.2768, 3.2767);
        let rate_bias = Vec3::new(0.0123, -0.0123, 0.0);
        let wanted_rate = Vec3::new(1.5, -1.5, 0.001);
        assert_eq!(read, StreamCycle { force_bias, rate_bias, wanted_rate, ..sent });
    }
    // The next packet counts on, over the end.
    builder.restart();
    builder.restart();
    (0..8).for_each(|index| builder.cycle(&cycle(index).0).expect("eight fit"));
    assert_eq!(builder.finish().expect("whole"), by_hand(0, 0, &[]));
}

#[test]
fn a_packet_is_never_too_long_and_says_what_did_not_fit() {
    let mut builder = filled(1);
    assert_eq!(builder.cycle(&cycle(0).0), Err(StreamBuildError::CyclesFull));
    let large = StreamEntry::Output([StreamOutput::default(); CYCLES]);
    // 917 bytes, and the check: 482 are left for entries of 130.
    assert_eq!((0..10).filter(|_| builder.entry(&large).is_ok()).count(), 3);
    assert_eq!((builder.entry(&large), builder.left_out()), (Err(StreamBuildError::NoRoom), 8));
    assert!(builder.entry(&StreamEntry::Other { id: 1, data: &[0; 91] }).is_err(), "one too many");
    builder.entry(&StreamEntry::Other { id: 1, data: &[0; 90] }).expect("to the last byte");
    assert_eq!(builder.finish().map(<[u8]>::len), Ok(LONGEST));
    assert!(StreamPacket::decode(builder.finish().expect("whole")).is_ok());
    assert!(builder.entry(&StreamEntry::Other { id: 1, data: &[] }).is_err());
    assert_eq!(filled(1).entry(&StreamEntry::Other { id: 1, data: &[0; 256] }), Err(StreamBuildError::NoRoom));

    // Short entries end by their number.
    let mut builder = filled(1);
    let count = (0..300).filter(|_| builder.entry(&StreamEntry::Other { id: 1, data: &[] }).is_ok()).count();
    let bytes = builder.finish().expect("whole").to_vec();
    assert_eq!((count, StreamPacket::decode(&bytes).expect("well-formed").entries().count()), (241, 241));
}

#[test]
fn what_no_reader_could_use_is_refused_and_leaves_the_packet_as_it_was() {
    let mut builder = StreamBuilder::new(1);
    (0..7).for_each(|index| builder.cycle(&cycle(index).0).expect("eight fit"));
    assert_eq!(builder.finish(), Err(StreamBuildError::CyclesMissing));
    for bad in 0..3 {
        let mut none = cycle(7).0;
        [&mut none.rate_bias, &mut none.force_bias, &mut none.wanted_rate][bad].z = f32::NAN;
        assert_eq!((builder.cycle(&none), builder.cycles()), (Err(StreamBuildError::NotANumber), 7));
    }
    builder.cycle(&cycle(7).0).expect("eight fit");
    let mut duty = [[0.5; 4]; CYCLES];
    duty[7][3] = f32::NAN;
    assert_eq!(builder.entry(&StreamEntry::Duty(duty)), Err(StreamBuildError::NotANumber));
    let angle = [0.0, f32::NAN];
    let wanted = StreamEntry::Wanted { time: 0, mode: 0, angle, thrust: 0.0, duty: [0.0; 4] };
    assert_eq!(builder.entry(&wanted), Err(StreamBuildError::NotANumber));
    assert_eq!(builder.entry(&StreamEntry::Other { id: 0x49, data: &[0; 64] }), Err(StreamBuildError::Reserved));
    assert_eq!(builder.left_out(), 0);
    assert_eq!(builder.finish().expect("whole"), by_hand(1, 0, &[]));

    // Other numbers travel as they are, and a duty ends at its limits.
    duty[7] = [-1.0, 0.0, 2.0, f32::INFINITY];
    builder.entry(&StreamEntry::Duty(duty)).expect("fits");
    let barometer = StreamEntry::Barometer { time: 0, height: f32::NAN, pressure: f32::INFINITY };
    builder.entry(&barometer).expect("fits");
    let bytes = builder.finish().expect("whole").to_vec();
    let mut entries = StreamPacket::decode(&bytes).expect("well-formed").entries();
    let Some(StreamEntry::Duty(read)) = entries.next() else { panic!("a duty") };
    assert_eq!(read[7], [0.0, 0.0, 1.0, 1.0]);
    assert!(matches!(entries.next(), Some(StreamEntry::Barometer { height, .. }) if height.is_nan()));
}

#[test]
fn each_flaw_of_a_packet_has_its_name() {
    let good = by_hand(3, 2, &[0x60, 1, 9, 0x61, 0]);
    let changed = |place: usize, value: u8| {
        let mut bytes = good.clone();
        bytes[place] = value;
        bytes.pop();
        StreamPacket::decode(&checked(bytes)).map(|packet| packet.entries().count())
    };
    assert_eq!(changed(1, 9), Ok(2));
    assert_eq!(changed(0, 0x4F), Err(StreamError::Kind));
    assert_eq!(changed(3, 7), Err(StreamError::Cycles));
    for count in (0..=u8::MAX).filter(|count| *count != 2) {
        assert_eq!(changed(916, count), Err(StreamError::Entries), "{count} entries");
    }
    assert_eq!(changed(918, 0), Err(StreamError::Entries), "an entry that is shorter");
    assert_eq!(changed(918, 200), Err(StreamError::Entries), "an entry that is longer than the packet");
    let mut wrong = good.clone();
    wrong[500] ^= 1;
    assert_eq!(StreamPacket::decode(&wrong), Err(StreamError::Check));
    for length in (0..918).chain(1401..1500) {
        assert_eq!(StreamPacket::decode(&vec![0x50; length]), Err(StreamError::Length), "{length} bytes");
    }
    // Entries of a length that is not known are handed over as they are.
    let longer = by_hand(3, 1, &[0x43, 10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
    let other = StreamEntry::Other { id: 0x43, data: &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10] };
    assert_eq!(StreamPacket::decode(&longer).expect("well-formed").entries().next(), Some(other));
}

#[test]
fn a_status_has_three_lengths_and_each_means_something_else() {
    let rate = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];
    let status = StreamStatus {
        sequence: 0x0201,
        uptime: 0x0605_0403,
        voltage: 3.7,
        state: 7,
        health: 8,
        estimator: 9,
        reset_reason: 10,
        gains: Some(StreamGains { rate, current: Some(-1_234.5) }),
    };
    let mut hand = vec![0x4F, 1, 2, 1, 3, 4, 5, 6];
    hand.extend(floats(&[3.7]));
    hand.extend([7, 8, 9, 10]);
    let gains: Vec<f32> = (1..=9).map(|number| number as f32).collect();
    let with_gains = [hand.clone(), floats(&gains)].concat();
    let present = [with_gains.clone(), floats(&[-1_234.5])].concat();
    let versions = [
        (17, StreamStatus { gains: None, ..status }, hand),
        (53, StreamStatus { gains: Some(StreamGains { rate, current: None }), ..status }, with_gains),
        (57, status, present),
    ];
    for (length, status, bytes) in versions {
        let (mut out, bytes) = ([0; 60], checked(bytes));
        assert_eq!(status.write(&mut out), Some(length));
        assert_eq!(out[..length], bytes);
        assert_eq!(StreamStatus::decode(&bytes), Ok(status));
        assert_eq!(status.write(&mut out[..length - 1]), None);
        let mut wrong = bytes.clone();
        wrong[0] = 0x50;
        assert_eq!(StreamStatus::decode(&wrong), Err(StreamError::Kind));
        wrong[0] = 0x4F;
        wrong[length - 2] ^= 1;
        assert_eq!(StreamStatus::decode(&wrong), Err(StreamError::Check));
    }
    for length in (0..100).filter(|length| ![17, 53, 57].contains(length)) {
        assert_eq!(StreamStatus::decode(&vec![0x4F; length]), Err(StreamError::Length));
    }
}

#[test]
fn the_stream_goes_to_who_asked_last_and_ends_by_itself() {
    let at = Instant::from_millis;
    let mut sink = StreamSink::new();
    assert_eq!(sink.address(at(0)), None);
    sink.take(at(0), 1, StreamRequest::Heartbeat);
    assert_eq!(sink.address(at(0)), None, "nobody has asked");
    sink.take(at(0), 1, StreamRequest::Start);
    for second in 1..30 {
        sink.take(at(1_000 * second), 1, StreamRequest::Heartbeat);
        sink.take(at(1_000 * second), 2, StreamRequest::Stop);
    }
    assert_eq!(sink.address(at(33_999)), Some(1));
    assert_eq!(sink.address(at(34_000)), None);
    sink.take(at(34_000), 1, StreamRequest::Heartbeat);
    assert_eq!(sink.address(at(34_000)), None, "it has to ask again");
    sink.take(at(35_000), 1, StreamRequest::Start);
    sink.take(at(35_001), 2, StreamRequest::Start);
    assert_eq!(sink.address(at(35_001)), Some(2));
    sink.take(at(35_002), 2, StreamRequest::Stop);
    assert_eq!(sink.address(at(35_002)), None);
    for byte in 0..=u8::MAX {
        assert_eq!(StreamRequest::decode(&[byte]).is_some(), (0xF0..=0xF2).contains(&byte));
        assert!(StreamRequest::decode(&[byte]).is_none_or(|request| request.to_bytes() == [byte]));
    }
}

proptest! {
    /// Any packet that is read is built again bit for bit.
    #[test]
    fn packets_round_trip(
        fixed in prop::collection::vec(any::<u8>(), 912),
        entries in prop::collection::vec((prop_oneof![0x40u8..0x49, 0x4Au8..0x50], prop::sample::select(&[0, 8, 9, 12, 16, 20, 30, 40, 64][..]), any::<u8>()), 0..6),
        sequence: u16,
    ) {
        let mut bytes = vec![0x50];
        bytes.extend(sequence.to_le_bytes());
        bytes.push(8);
        bytes.extend(fixed);
        bytes.push(entries.len() as u8);
        for (id, length, fill) in entries {
            bytes.extend([id, length]);
            let start = bytes.len();
            bytes.extend((0..length).map(|index| fill.wrapping_add(index.wrapping_mul(37))));
            if (id, length) == (0x48, 30) {
                bytes[start + 5] = 0;
            }
        }
        let bytes = checked(bytes);
        let packet = StreamPacket::decode(&bytes).expect("well-formed");
        let mut builder = StreamBuilder::new(packet.sequence);
        packet.cycles().for_each(|cycle| builder.cycle(&cycle).expect("eight fit"));
        packet.entries().for_each(|entry| builder.entry(&entry).expect("they came from no more"));
        prop_assert_eq!(builder.finish().expect("whole"), bytes);
    }
}

/// Packed by another program, with the format strings of the one that reads these packets on a PC.
#[test]
fn packets_that_another_program_has_packed_mean_what_it_meant() {
    let vectors: Value = serde_json::from_str(include_str!("../vectors/stream.json")).expect("well-formed");
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("a number")).collect()
    };
    let same = |numbers: &[f32], expected: &[f64], steps: f64| {
        assert_eq!(numbers.len(), expected.len());
        for (number, expected) in numbers.iter().zip(expected) {
            assert!((f64::from(*number) - expected / steps).abs() < 1e-6 * expected.abs().max(1.0), "{number}");
        }
    };
    let bytes = hex(&vectors["unified"]);
    let packet = StreamPacket::decode(&bytes).expect("well-formed");
    assert_eq!(packet.sequence, 513);
    for (index, cycle) in packet.cycles().enumerate() {
        let imu = numbers(&vectors["imu"][index]);
        assert_eq!(u64::from(cycle.time), imu[0] as u64 % (1 << 32));
        let vectors_of = [cycle.rate, cycle.force, cycle.raw_rate, cycle.raw_force];
        same(&vectors_of.map(|vector| vector.to_array()).concat(), &imu[1..13], 1.0);
        same(&cycle.attitude.wxyz(), &imu[13..17], 1.0);
        same(&[cycle.rate_bias.to_array(), cycle.force_bias.to_array()].concat(), &imu[17..], 1e4);
        let position = numbers(&vectors["posvel"][index]);
        assert_eq!(f64::from(cycle.position_time), position[0]);
        same(&[cycle.position.to_array(), cycle.velocity.to_array()].concat(), &position[1..], 1.0);
        same(&cycle.wanted_rate.to_array(), &numbers(&vectors["rate_ref"][index]), 1e3);
    }
    let expected = vectors["entries"].as_array().expect("entries");
    assert_eq!(packet.entries().count(), expected.len());
    for (entry, expected) in packet.entries().zip(expected) {
        let (id, numbers) = (expected[0].as_u64().expect("an id"), numbers(&expected[1]));
        let floats: Vec<f32> = numbers.iter().map(|number| *number as f32).collect();
        let four = |start: usize| [0, 1, 2, 3].map(|place| floats[start + place]);
        let time = numbers[0] as u32;
        let meant = match id {
            0x42 => {
                let [throttle, roll, pitch, yaw] = four(1);
                StreamEntry::Pilot { time, throttle, roll, pitch, yaw }
            }
            0x43 => StreamEntry::Flow { time, counts: [-300, 17], surface_quality: 99 },
            0x44 => StreamEntry::Below { time, distance: floats[1], status: 0 },
            0x47 => StreamEntry::InFront { time, distance: floats[1], status: 255 },
            0x45 => StreamEntry::Barometer { time, height: floats[1], pressure: floats[2] },
            0x46 => StreamEntry::Magnetometer { time, field: Vec3::new(floats[1], floats[2], floats[3]) },
            0x48 => StreamEntry::Wanted { time, mode: 3, angle: [0.25, -0.25], thrust: floats[5], duty: four(6) },
            0x4A => StreamEntry::Duty(core::array::from_fn(|cycle| four(cycle * 4).map(|duty| duty / 65_535.0))),
            0x4B => StreamEntry::Output(core::array::from_fn(|cycle| {
                let [thrust, roll, pitch, yaw] = four(cycle * 4);
                StreamOutput { thrust, torque: Vec3::new(roll, pitch, yaw) }
            })),
            _ => panic!("{id:x}"),
        };
        assert_eq!(entry, meant);
    }
    let statuses = vectors["status"].as_array().expect("statuses");
    let [oldest, with_gains, present] =
        [0, 1, 2].map(|version| StreamStatus::decode(&hex(&statuses[version])).expect("well-formed"));
    assert_eq!((present.sequence, present.uptime, present.voltage, present.reset_reason), (300, 123_456, 3.75, 9));
    let rate = core::array::from_fn(|axis| core::array::from_fn(|gain| (axis * 3 + gain + 1) as f32 / 8.0));
    assert_eq!(present.gains, Some(StreamGains { rate, current: Some(812.5) }));
    assert_eq!(with_gains, StreamStatus { gains: Some(StreamGains { rate, current: None }), ..present });
    assert_eq!(oldest, StreamStatus { gains: None, ..present });
}
