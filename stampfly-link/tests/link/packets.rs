//! Every packet round trips, and nothing that is not exactly a packet is taken for one.

use proptest::prelude::*;
use stampfly_link::{
    Address, ControlError, ControlPacket, LinkState, PairingError, PairingPacket, TelemetryError, TelemetryPacket,
};
use stampfly_types::Vec3;
use stampfly_types::messages::{FlightMode, PilotInput};

const VEHICLE: Address = Address([0x34, 0x85, 0x18, 0xAB, 0xCD, 0xEF]);

fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte))
}

/// Built by hand from the table of offsets, not by the code under test.
fn by_hand(sticks: [u16; 4], switches: u8, reserved: u8) -> [u8; 14] {
    let mut bytes = [0; 14];
    bytes[..3].copy_from_slice(&[0xAB, 0xCD, 0xEF]);
    for (place, stick) in bytes[3..11].chunks_exact_mut(2).zip(sticks) {
        place.copy_from_slice(&stick.to_le_bytes());
    }
    (bytes[11], bytes[12]) = (switches, reserved);
    bytes[13] = sum(&bytes[..13]);
    bytes
}

#[test]
fn a_control_packet_has_the_bytes_of_the_table() {
    let packet = ControlPacket {
        throttle: 4095,
        roll: 0,
        pitch: 1,
        yaw: 0x0102,
        arm: true,
        hold_place: true,
        ..ControlPacket::centred(VEHICLE)
    };
    assert_eq!(packet.to_bytes(), by_hand([4095, 0, 1, 0x0102], 0b1_0001, 0));
    assert_eq!(ControlPacket::decode(&by_hand([4095, 0, 1, 0x0102], 0b1_0001, 0xFF), VEHICLE), Ok(packet));
}

#[test]
fn sticks_mean_what_the_table_says() {
    let input = |sticks, switches| {
        ControlPacket::decode(&by_hand(sticks, switches, 0), VEHICLE).expect("well-formed").pilot_input()
    };
    let centred = PilotInput { mode: FlightMode::Stabilize, ..Default::default() };
    assert_eq!(input([2048; 4], 0), centred);
    // Throttle up, roll right, pitch back, yaw right; and all the other way.
    let all = |share: f32| PilotInput { throttle: share, roll: share, pitch: -share, yaw: share, ..centred };
    assert_eq!(input([4095; 4], 0), all(1.0));
    assert_eq!(input([0; 4], 0), all(-1.0));
    let modes = [
        (0, FlightMode::Stabilize),
        (4, FlightMode::Acro),
        (8, FlightMode::AltHold),
        (12, FlightMode::AltHold),
        (16, FlightMode::PosHold),
        (28, FlightMode::PosHold),
    ];
    for (switches, mode) in modes {
        assert_eq!(input([2048; 4], switches).mode, mode, "switches {switches:05b}");
        assert!(!input([2048; 4], switches).arm && input([2048; 4], switches | 1).arm);
    }
}

#[test]
fn each_flaw_of_a_control_packet_has_its_name() {
    let good = by_hand([2048; 4], 1, 0);
    let decode = |bytes: &[u8]| ControlPacket::decode(bytes, VEHICLE);
    assert!(decode(&good).is_ok());
    for length in (0..=250).filter(|length| *length != good.len()) {
        let bytes: Vec<u8> = good.iter().copied().cycle().take(length).collect();
        assert_eq!(decode(&bytes), Err(ControlError::Length), "{length} bytes");
    }
    assert_eq!(ControlPacket::decode(&good, Address([0; 6])), Err(ControlError::OtherVehicle));
    assert_eq!(decode(&by_hand([4096, 0, 0, 0], 0, 0)), Err(ControlError::Range));
    assert_eq!(decode(&by_hand([0, 0, 0, u16::MAX], 0, 0)), Err(ControlError::Range));
    for bit in 5..8 {
        assert_eq!(decode(&by_hand([0; 4], 1 << bit, 0)), Err(ControlError::Switches));
    }
    // Meant for somebody else comes before a wrong sum, so that neighbours' packets do not look like errors.
    let mut both = good;
    both[0] ^= 0xFF;
    assert_eq!(decode(&both), Err(ControlError::OtherVehicle));
}

#[test]
fn no_single_flipped_bit_of_a_packet_is_taken() {
    let control = by_hand([1, 2000, 4000, 2048], 0b1_1001, 7);
    let telemetry = TelemetryPacket { battery: 3.9, height: 0.5, ..Default::default() }.to_bytes();
    for bit in 0..control.len() * 8 {
        let mut bytes = control;
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(ControlPacket::decode(&bytes, VEHICLE).is_err(), "bit {bit}");
    }
    for bit in 0..telemetry.len() * 8 {
        let mut bytes = telemetry;
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(TelemetryPacket::decode(&bytes).is_err(), "bit {bit}");
    }
}

#[test]
fn a_pairing_packet_has_the_bytes_of_the_table_and_its_flaws_have_names() {
    let good = [6, 0x34, 0x85, 0x18, 0xAB, 0xCD, 0xEF, 0xAA, 0x55, 0x16, 0x88];
    let packet = PairingPacket { channel: 6, vehicle: VEHICLE };
    assert_eq!(packet.to_bytes(), good);
    assert_eq!(PairingPacket::decode(&good), Ok(packet));
    let with = |index: usize, value: u8| {
        let mut bytes = good;
        bytes[index] = value;
        PairingPacket::decode(&bytes)
    };
    assert_eq!(PairingPacket::decode(&good[..10]), Err(PairingError::Length));
    assert_eq!(with(10, 0x87), Err(PairingError::Mark));
    assert_eq!(with(0, 0), Err(PairingError::Channel));
    assert_eq!(with(0, 14), Err(PairingError::Channel));
    assert_eq!(with(1, 0x35), Err(PairingError::Vehicle), "a group's address");
}

#[test]
fn a_telemetry_packet_has_the_bytes_of_the_table_and_its_flaws_have_names() {
    let packet = TelemetryPacket {
        counter: 7,
        battery: 3.8,
        height: -0.12,
        velocity: Vec3::new(1.0, -1.0, 0.001),
        attitude: Vec3::new(0.0, core::f32::consts::FRAC_PI_2, -core::f32::consts::PI),
        state: LinkState::Landing,
        low_battery: true,
        calibrating: true,
        ..Default::default()
    };
    let mut by_hand = vec![0xAA, 1, 7];
    by_hand.extend(3800u16.to_le_bytes());
    for value in [-12i16, 1000, -1000, 1, 0, 900, -1800] {
        by_hand.extend(value.to_le_bytes());
    }
    by_hand.extend([4, 0b1001]);
    by_hand.push(sum(&by_hand));
    assert_eq!(packet.to_bytes().as_slice(), by_hand);

    let fixed = |index: usize, value: u8| {
        let mut bytes = packet.to_bytes();
        bytes[index] = value;
        bytes[21] = sum(&bytes[..21]);
        TelemetryPacket::decode(&bytes)
    };
    assert_eq!(TelemetryPacket::decode(&by_hand[..21]), Err(TelemetryError::Length));
    assert_eq!(fixed(0, 0xAB), Err(TelemetryError::Mark));
    assert_eq!(fixed(19, 6), Err(TelemetryError::State));
    assert_eq!(fixed(20, 0x10), Err(TelemetryError::State));
    by_hand[21] ^= 1;
    assert_eq!(TelemetryPacket::decode(&by_hand), Err(TelemetryError::Checksum));
}

#[test]
fn hostile_numbers_become_harmless_packets() {
    let endless = Vec3::new(f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
    let packet = TelemetryPacket { battery: -1.0, height: f32::NAN, velocity: endless, ..Default::default() };
    let read = TelemetryPacket::decode(&packet.to_bytes()).expect("well-formed");
    assert_eq!((read.battery, read.height), (0.0, 0.0));
    assert_eq!(read.velocity, Vec3::new(0.0, 32.767, -32.768));
    let pilot = PilotInput { roll: f32::NAN, pitch: 9.0, yaw: f32::NEG_INFINITY, ..Default::default() };
    let packet = ControlPacket::from_pilot(VEHICLE, &pilot);
    assert_eq!((packet.roll, packet.pitch, packet.yaw), (2048, 0, 2048));
}

#[test]
fn a_mode_is_received_as_one_whose_throttle_means_the_same() {
    for &mode in FlightMode::ALL {
        let sent = ControlPacket::from_pilot(VEHICLE, &PilotInput { mode, ..Default::default() });
        assert_eq!(sent.pilot_input().mode.is_manual(), mode.is_manual(), "{mode:?}");
    }
}

proptest! {
    #[test]
    fn control_round_trips(sticks in prop::array::uniform4(0u16..4096), switches in 0u8..32) {
        let bytes = by_hand(sticks, switches, 0);
        let packet = ControlPacket::decode(&bytes, VEHICLE).expect("well-formed");
        prop_assert_eq!(packet.to_bytes(), bytes);
        let again = ControlPacket::from_pilot(VEHICLE, &packet.pilot_input());
        prop_assert_eq!([again.throttle, again.roll, again.pitch, again.yaw], sticks, "to the very step");
    }

    #[test]
    fn telemetry_round_trips(bytes in prop::array::uniform19(any::<u8>()), state in 0u8..6, warnings in 0u8..16) {
        let mut packet = [0; 22];
        packet[..19].copy_from_slice(&bytes);
        (packet[0], packet[1], packet[19], packet[20]) = (0xAA, 1, state, warnings);
        packet[21] = sum(&packet[..21]);
        let read = TelemetryPacket::decode(&packet).expect("well-formed");
        prop_assert_eq!(read.to_bytes(), packet);
    }

    #[test]
    fn anything_at_all_is_looked_at_without_harm(bytes in prop::collection::vec(any::<u8>(), 0..251)) {
        if let Ok(packet) = ControlPacket::decode(&bytes, VEHICLE) {
            prop_assert_eq!(&packet.to_bytes()[..12], &bytes[..12]);
        }
        if let Ok(packet) = PairingPacket::decode(&bytes) {
            prop_assert_eq!(packet.to_bytes().to_vec(), bytes.clone());
        }
        if let Ok(packet) = TelemetryPacket::decode(&bytes) {
            prop_assert_eq!(packet.to_bytes().to_vec(), bytes.clone());
        }
    }
}
