//! The packet of M5Stack's own transmitter: its bytes, its meaning, and that nothing else is taken for one.

use proptest::prelude::*;
use stampfly_link::{Address, ArmButton, JoystickError, JoystickPacket};
use stampfly_types::messages::{FlightMode, PilotInput};

const VEHICLE: Address = Address([0x34, 0x85, 0x18, 0xAB, 0xCD, 0xEF]);

/// Built by hand from the table of offsets: rudder, throttle, aileron, elevator; buttons and modes.
fn by_hand(sticks: [f32; 4], rest: [u8; 5]) -> Vec<u8> {
    let mut bytes = vec![0xAB, 0xCD, 0xEF];
    bytes.extend(sticks.iter().flat_map(|stick| stick.to_le_bytes()));
    bytes.extend(rest);
    bytes.push(bytes.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)));
    bytes
}

fn decode(bytes: &[u8]) -> Result<JoystickPacket, JoystickError> {
    JoystickPacket::decode(bytes, VEHICLE)
}

#[test]
fn a_joystick_packet_has_the_bytes_of_the_table() {
    let packet = JoystickPacket {
        rudder: -0.25,
        throttle: 1.0,
        aileron: 0.5,
        elevator: -1.5,
        arm: true,
        rates: true,
        ..JoystickPacket::centred(VEHICLE)
    };
    let bytes = by_hand([-0.25, 1.0, 0.5, -1.5], [1, 0, 1, 4, 0]);
    assert_eq!(packet.to_bytes().to_vec(), bytes);
    assert_eq!(bytes.len(), JoystickPacket::LENGTH);
    assert_eq!(decode(&bytes), Ok(packet));
    let last = JoystickPacket { flip: true, hold_height: false, level: true, ..JoystickPacket::centred(VEHICLE) };
    assert_eq!(decode(&by_hand([0.0; 4], [0, 1, 0, 5, 1])), Ok(last));
}

#[test]
fn sticks_mean_what_the_table_says() {
    let input = |sticks, rest, arm| decode(&by_hand(sticks, rest)).expect("well-formed").pilot_input(arm);
    // Rudder right, throttle up, aileron right, elevator back.
    let expected = PilotInput {
        yaw: 0.1,
        throttle: 0.2,
        roll: 0.3,
        pitch: -0.4,
        mode: FlightMode::AltHold,
        arm: true,
        kill: false,
    };
    assert_eq!(input([0.1, 0.2, 0.3, 0.4], [0, 0, 0, 4, 0], true), expected);
    // A stick that had rested off its centre reaches farther at one end.
    assert_eq!(input([0.0, 0.0, 1.07, -2.0], [0, 0, 0, 4, 0], false).cleaned().roll, 1.0);
    for (rest, mode) in [
        ([0, 0, 0, 5, 0], FlightMode::Stabilize),
        ([0, 0, 1, 5, 0], FlightMode::Acro),
        ([0, 0, 0, 4, 0], FlightMode::AltHold),
        ([0, 0, 1, 4, 0], FlightMode::AltHold),
    ] {
        assert_eq!(input([0.0; 4], rest, false).mode, mode, "{rest:?}");
    }
}

#[test]
fn each_flaw_has_its_name_and_the_first_one_is_said() {
    let good = by_hand([0.0; 4], [0, 0, 0, 4, 0]);
    assert!(decode(&good).is_ok());
    for length in (0..=250).filter(|length| *length != good.len()) {
        let bytes: Vec<u8> = good.iter().copied().cycle().take(length).collect();
        assert_eq!(decode(&bytes), Err(JoystickError::Length), "{length} bytes");
    }
    let stranger = Address([0; 6]);
    assert_eq!(JoystickPacket::decode(&good, stranger), Err(JoystickError::OtherVehicle));
    let mut wrong = good.clone();
    wrong[24] ^= 1;
    assert_eq!(JoystickPacket::decode(&wrong, stranger), Err(JoystickError::Checksum), "before the address");
    for place in 0..4 {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2.0f32.next_up(), -(2.0f32.next_up()), 1e30] {
            let mut sticks = [0.0; 4];
            sticks[place] = bad;
            assert_eq!(decode(&by_hand(sticks, [9; 5])), Err(JoystickError::Range), "{bad}: before the content");
            let other = JoystickPacket::decode(&by_hand(sticks, [9; 5]), stranger);
            assert_eq!(other, Err(JoystickError::OtherVehicle), "before the range");
        }
        let mut sticks = [0.0; 4];
        sticks[place] = -2.0;
        assert!(decode(&by_hand(sticks, [0, 0, 0, 4, 0])).is_ok());
    }
    for place in 0..5 {
        for value in 0..=u8::MAX {
            let mut rest = [0, 0, 0, 4, 0];
            rest[place] = value;
            let known = if place == 3 { [4, 5] } else { [0, 1] }.contains(&value);
            assert_eq!(decode(&by_hand([0.0; 4], rest)).is_ok(), known, "{rest:?}");
            if !known {
                assert_eq!(decode(&by_hand([0.0; 4], rest)), Err(JoystickError::Content));
            }
        }
    }
}

#[test]
fn a_press_is_seen_although_most_packets_are_lost_and_only_once() {
    let mut switch = ArmButton::default();
    // A second of packets; pressed for 0.2 s at 0.3 s and at 0.7 s. One in seven arrives.
    let down = |packet: u32| (30..50).contains(&packet) || (70..90).contains(&packet);
    let arm: Vec<bool> = (0..100).step_by(7).map(|packet| switch.step(down(packet))).collect();
    assert_eq!(arm.iter().filter(|arm| **arm).count(), 5, "{arm:?}");
    assert!(!arm[14] && !switch.step(false));

    let mut held = ArmButton::default();
    assert!(!held.step(true) && !held.step(true), "pressed before anybody listened");
    assert!(!held.step(false) && held.step(true));
    held.release();
    assert!(!held.step(true), "the same press does not arm again");
    assert!(!held.step(false) && held.step(true));
}

proptest! {
    #[test]
    fn joystick_packets_round_trip(sticks in prop::array::uniform4(-2.0f32..=2.0), bits in 0u8..32) {
        let bit = |place: u8| bits >> place & 1;
        let bytes = by_hand(sticks, [bit(0), bit(1), bit(2), 4 + bit(3), bit(4)]);
        prop_assert_eq!(decode(&bytes).expect("well-formed").to_bytes().to_vec(), bytes);
    }

    #[test]
    fn what_is_taken_is_usable(mut bytes in prop::array::uniform25(any::<u8>()), content in 0u8..2) {
        bytes[..3].copy_from_slice(&VEHICLE.tail());
        bytes[19..24].copy_from_slice(&[content, 0, 1, 4, 0]);
        bytes[24] = bytes[..24].iter().fold(0, |sum, byte| sum.wrapping_add(*byte));
        if let Ok(packet) = decode(&bytes) {
            let input = packet.pilot_input(false);
            prop_assert_eq!(input, input.cleaned());
            prop_assert_eq!(packet.to_bytes(), bytes);
        }
    }
}
