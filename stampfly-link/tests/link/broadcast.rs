//! What a vehicle tells every program: the bytes of both versions, and that nothing else is taken for one.

use proptest::prelude::*;
use stampfly_link::{BroadcastError, BroadcastPacket, BroadcastSensors};
use stampfly_types::{Duration, Vec3};

/// Numbers 1, 2, 3 … in the order of the table, which is not that of the structure's fields by chance alone.
fn by_hand(version: u8) -> Vec<u8> {
    let mut bytes = vec![0xFE, 0xCA, version, 1];
    bytes.extend(0xFFFF_FFF0_u32.to_le_bytes());
    bytes.extend((1..=23).flat_map(|number| (number as f32).to_le_bytes()));
    bytes.extend([7, 0, 0, 0]);
    if version == 2 {
        bytes.extend([3.7f32, 0.25, -1.0].iter().flat_map(|number| number.to_le_bytes()));
        bytes.extend([65_535_u16, 3].iter().flat_map(|number| number.to_le_bytes()));
        bytes.extend([90, 0b10_0101, 0, 0]);
        bytes.extend([31.0f32, -32.0, 33.0, 0.5].iter().flat_map(|number| number.to_le_bytes()));
    }
    bytes
}

fn packet() -> BroadcastPacket {
    let vector = |first: f32| Vec3::new(first, first + 1.0, first + 2.0);
    BroadcastPacket {
        time: 0xFFFF_FFF0,
        attitude: vector(1.0),
        rate: vector(4.0),
        force: vector(7.0),
        position: vector(10.0),
        velocity: vector(13.0),
        thrust: 16.0,
        torque: vector(17.0),
        duty: [20.0, 21.0, 22.0, 23.0],
        state: 7,
        sensors: None,
    }
}

const SENSORS: BroadcastSensors = BroadcastSensors {
    voltage: 3.7,
    below: 0.25,
    in_front: -1.0,
    flow: [65_535, 3],
    surface_quality: 90,
    valid: BroadcastSensors::BELOW | BroadcastSensors::FLOW | BroadcastSensors::VOLTAGE,
    field: Vec3::new(31.0, -32.0, 33.0),
    height: 0.5,
};

fn written(packet: &BroadcastPacket) -> Vec<u8> {
    let mut bytes = [0xEE; 200];
    let length = packet.write(&mut bytes).expect("there is room");
    assert!(bytes[length..].iter().all(|byte| *byte == 0xEE));
    assert_eq!(packet.write(&mut bytes[..length - 1]), None);
    bytes[..length].to_vec()
}

#[test]
fn both_versions_have_the_bytes_of_the_table() {
    let versions = [(1, 104, packet()), (2, 140, BroadcastPacket { sensors: Some(SENSORS), ..packet() })];
    for (version, length, packet) in versions {
        let bytes = by_hand(version);
        assert_eq!((bytes.len(), written(&packet)), (length, bytes.clone()));
        assert_eq!(BroadcastPacket::decode(&bytes), Ok(packet));
    }
}

#[test]
fn each_flaw_has_its_name() {
    for version in [1, 2] {
        let good = by_hand(version);
        let with = |place: usize, value: u8| {
            let mut bytes = good.clone();
            bytes[place] = value;
            BroadcastPacket::decode(&bytes)
        };
        assert_eq!(with(0, 0xCA), Err(BroadcastError::Mark));
        assert_eq!(with(1, 0xFE), Err(BroadcastError::Mark));
        assert_eq!(with(3, 2), Err(BroadcastError::Kind));
        for other in 0..=u8::MAX {
            assert_eq!(with(2, other).is_ok(), other == version, "version {other} in {} bytes", good.len());
        }
        for length in (0..300).filter(|length| ![104, 140].contains(length)) {
            let bytes: Vec<u8> = good.iter().copied().cycle().take(length).collect();
            assert_eq!(BroadcastPacket::decode(&bytes), Err(BroadcastError::Length), "{length} bytes");
        }
        assert!(with(101, 9).is_ok(), "not used");
    }
}

#[test]
fn counters_wrap_around() {
    let (old, new) = (packet(), BroadcastPacket { time: 0x10, ..packet() });
    assert_eq!(new.since(&old), Duration::from_micros(0x20));
    let moved = BroadcastSensors { flow: [10, 65_530], ..SENSORS };
    assert_eq!(moved.flow_since(&SENSORS), [11, -9]);
}

proptest! {
    #[test]
    fn broadcast_packets_round_trip(bytes in prop::collection::vec(any::<u8>(), 140), long: bool) {
        let mut bytes = bytes[..if long { 140 } else { 104 }].to_vec();
        bytes[..4].copy_from_slice(&[0xFE, 0xCA, 1 + u8::from(long), 1]);
        bytes[101..104].fill(0);
        if long {
            bytes[122..124].fill(0);
        }
        let packet = BroadcastPacket::decode(&bytes).expect("well-formed");
        // Bit for bit, what is no number as well.
        prop_assert_eq!(written(&packet), bytes);
    }
}
