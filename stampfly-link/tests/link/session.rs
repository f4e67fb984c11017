//! A vehicle in a room full of strangers.

use proptest::prelude::*;
use stampfly_link::{Address, ControlPacket, PairingPacket, PairingRefused, Rejected, Session};
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant};

const VEHICLE: Address = Address([0x34, 0x85, 0x18, 0xAB, 0xCD, 0xEF]);
const PILOT: Address = Address([0x30, 1, 2, 3, 4, 5]);
const STRANGER: Address = Address([0x30, 9, 9, 9, 9, 9]);

fn packet() -> [u8; 14] {
    ControlPacket::from_pilot(VEHICLE, &PilotInput { throttle: 0.25, ..Default::default() }).to_bytes()
}

#[test]
fn an_unpaired_vehicle_calls_twice_a_second_and_takes_the_first_that_answers() {
    let mut session = Session::new(VEHICLE, 3, None);
    let calls: Vec<u64> = (0..2_000).filter(|ms| session.beacon(Instant::from_millis(*ms)).is_some()).collect();
    assert_eq!(calls, [0, 500, 1_000, 1_500]);
    let call = session.beacon(Instant::from_secs(9)).expect("long due");
    assert_eq!(PairingPacket::decode(&call), Ok(PairingPacket { channel: 3, vehicle: VEHICLE }));
    assert_eq!(session.beacon(Instant::from_secs(9)), None, "but only once");

    assert!(session.receive(Instant::from_micros(1), PILOT, &packet()).is_ok());
    assert_eq!((session.peer(), session.is_pairing()), (Some(PILOT), false));
    assert_eq!(session.beacon(Instant::from_secs(60)), None);
    assert_eq!(session.receive(Instant::from_micros(2), STRANGER, &packet()), Err(Rejected::Stranger));
}

#[test]
fn a_paired_vehicle_looks_only_when_told_and_never_armed() {
    let mut session = Session::new(VEHICLE, 1, Some(PILOT));
    session.set_armed(true);
    assert_eq!(session.start_pairing(Instant::ZERO), Err(PairingRefused));
    session.set_armed(false);
    assert!(!session.is_pairing());
    assert_eq!(session.start_pairing(Instant::ZERO), Ok(()));
    session.stop_pairing();
    assert!(!session.is_pairing() && session.peer() == Some(PILOT), "changed its mind");
    assert_eq!(session.start_pairing(Instant::ZERO), Ok(()));
    assert!(session.receive(Instant::from_micros(1), STRANGER, &packet()).is_ok());
    assert_eq!(session.peer(), Some(STRANGER));
    assert_eq!(session.receive(Instant::from_micros(2), PILOT, &packet()), Err(Rejected::Stranger));
}

#[test]
fn the_present_transmitter_wins_only_after_a_silence() {
    let mut session = Session::new(VEHICLE, 1, Some(PILOT));
    assert_eq!(session.start_pairing(Instant::from_millis(10)), Ok(()));
    for ms in (20..5_000).step_by(20) {
        assert_eq!(session.receive(Instant::from_millis(ms), PILOT, &packet()), Err(Rejected::Stranger), "still on");
    }
    let mut other = session.clone();
    assert!(other.receive(Instant::from_millis(5_001), STRANGER, &packet()).is_ok());
    assert_eq!(other.peer(), Some(STRANGER));
    assert!(session.receive(Instant::from_millis(6_100), PILOT, &packet()).is_ok(), "switched off and on again");
    assert!(!session.is_pairing() && session.peer() == Some(PILOT));
}

#[test]
fn an_armed_vehicle_that_never_had_a_transmitter_gets_none() {
    let mut session = Session::new(VEHICLE, 1, None);
    session.set_armed(true);
    assert!(!session.is_pairing());
    for ms in (0..5_000).step_by(20) {
        let now = Instant::from_millis(ms);
        session.set_armed(true);
        assert_eq!(session.beacon(now), None, "it does not call");
        assert_eq!(session.receive(now, STRANGER, &packet()), Err(Rejected::Stranger));
    }
    assert_eq!((session.peer(), session.age(Instant::from_secs(5))), (None, None));
    session.set_armed(false);
    assert!(session.is_pairing(), "it goes on looking");
    assert!(session.beacon(Instant::from_secs(5)).is_some());
    assert_eq!(session.beacon(Instant::from_secs(5)), None, "at its old pace");
    assert!(session.receive(Instant::from_secs(5), PILOT, &packet()).is_ok());
}

#[test]
fn who_is_armed_while_looking_goes_back_to_the_present_transmitter() {
    let mut session = Session::new(VEHICLE, 1, Some(PILOT));
    assert_eq!(session.start_pairing(Instant::ZERO), Ok(()));
    assert!(session.beacon(Instant::ZERO).is_some());
    session.set_armed(true);
    assert!(!session.is_pairing());
    assert_eq!(session.beacon(Instant::from_secs(1)), None);
    assert_eq!(session.receive(Instant::from_secs(1), STRANGER, &packet()), Err(Rejected::Stranger));
    assert!(session.receive(Instant::from_secs(1), PILOT, &packet()).is_ok(), "without a silence first");
    session.set_armed(false);
    assert!(!session.is_pairing(), "for good");
    assert_eq!(session.receive(Instant::from_secs(2), STRANGER, &packet()), Err(Rejected::Stranger));
}

#[test]
fn nobody_pairs_with_half_a_packet_or_from_a_group() {
    let mut session = Session::new(VEHICLE, 1, None);
    session.stop_pairing();
    assert!(session.is_pairing(), "without a transmitter there is nothing to go back to");
    assert!(session.receive(Instant::ZERO, PILOT, &packet()[..13]).is_err());
    assert!(session.receive(Instant::ZERO, PILOT, &[0; 14]).is_err());
    assert_eq!(session.receive(Instant::ZERO, Address::BROADCAST, &packet()), Err(Rejected::Stranger));
    assert_eq!(session.receive(Instant::ZERO, Address([0; 6]), &packet()), Err(Rejected::Stranger));
    let armed = ControlPacket { arm: true, ..ControlPacket::centred(VEHICLE) }.to_bytes();
    assert_eq!(session.receive(Instant::ZERO, PILOT, &armed), Err(Rejected::ArmSwitch));
    assert_eq!((session.peer(), session.age(Instant::ZERO)), (None, None));
    assert!(session.receive(Instant::ZERO, PILOT, &packet()).is_ok());
    assert!(session.receive(Instant::from_micros(1), PILOT, &armed).is_ok_and(|input| input.arm), "its own may arm");
}

#[test]
fn the_newest_wins() {
    let mut session = Session::new(VEHICLE, 1, Some(PILOT));
    assert!(session.receive(Instant::from_micros(100), PILOT, &packet()).is_ok());
    assert_eq!(session.receive(Instant::from_micros(99), PILOT, &packet()), Err(Rejected::Old));
    assert!(
        session.receive(Instant::from_micros(100), PILOT, &packet()).is_ok(),
        "two in one microsecond came in order"
    );
    assert_eq!(session.age(Instant::from_micros(150)), Some(Duration::from_micros(50)));
}

proptest! {
    /// Whatever a room of strangers sends, at whatever time: nothing gets through, nothing is a sign of life, everything
    /// is counted, and the pilot's next packet is taken.
    #[test]
    fn strangers_change_nothing(
        frames in prop::collection::vec(
            (any::<u64>(), any::<[u8; 6]>(), prop::collection::vec(any::<u8>(), 0..60), any::<bool>()),
            0..200,
        ),
    ) {
        let mut session = Session::new(VEHICLE, 1, Some(PILOT));
        for (at, source, bytes, well_formed) in &frames {
            let bytes = if *well_formed { packet().to_vec() } else { bytes.clone() };
            prop_assume!(Address(*source) != PILOT);
            prop_assert_eq!(session.receive(Instant::from_micros(*at), Address(*source), &bytes), Err(Rejected::Stranger));
        }
        prop_assert_eq!(session.age(Instant::from_micros(1)), None);
        prop_assert_eq!(session.peer(), Some(PILOT));
        prop_assert_eq!(session.counters().strangers as usize, frames.len());
        prop_assert!(session.receive(Instant::from_micros(5), PILOT, &packet()).is_ok());
    }

    /// A forged source gets as far as the packet's own checks.
    #[test]
    fn damaged_packets_from_the_pilots_address_are_no_sign_of_life(flip in 0usize..112, second in 0usize..112) {
        let mut session = Session::new(VEHICLE, 1, Some(PILOT));
        let mut bytes = packet();
        bytes[flip / 8] ^= 1 << (flip % 8);
        if second / 8 == flip / 8 && second != flip {
            bytes[second / 8] ^= 1 << (second % 8);
        }
        prop_assert!(session.receive(Instant::ZERO, PILOT, &bytes).is_err());
        prop_assert_eq!(session.age(Instant::ZERO), None);
        let counters = session.counters();
        prop_assert_eq!(counters.other_vehicles + counters.checksum, 1);
    }
}
