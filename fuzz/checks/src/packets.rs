//! Frames from the radio.

use crate::Input;
use stampfly_link::{
    Address, BroadcastPacket, ControlPacket, JoystickPacket, PairingPacket, Session, SlotBeacon, SlotTurn, Slots,
    TelemetryPacket,
};
use stampfly_types::{Duration, Instant};

const VEHICLE: Address = Address([0x34, 0x85, 0x18, 0xAB, 0xCD, 0xEF]);
/// Stations that send.
const STATIONS: [Address; 4] = [
    Address([0x30, 1, 2, 3, 4, 5]),
    Address([0x30, 9, 9, 9, 9, 9]),
    // A group's address and the vehicle's own.
    Address([0x31, 1, 2, 3, 4, 5]),
    VEHICLE,
];

/// What happens: events of a link's life, each with a time step. The first byte says whether the vehicle is paired.
pub fn radio_packets(data: &[u8]) {
    let mut input = Input(data);
    let peer = (input.byte() & 1 == 1).then_some(STATIONS[0]);
    let mut session = Session::new(VEHICLE, 1, peer);
    let (mut now, mut armed) = (0u64, false);
    while !input.is_empty() {
        let (event, step) = (input.byte(), input.byte());
        now += u64::from(step) * 10_000;
        let at = Instant::from_micros(now);
        let before = session.peer();
        match event % 8 {
            0 => armed = true,
            1 => armed = false,
            2 => assert_eq!(session.start_pairing(at).is_err(), armed),
            3 => session.stop_pairing(),
            4 => {
                if let Some(call) = session.beacon(at) {
                    assert!(!armed);
                    assert_eq!(PairingPacket::decode(&call).map(|packet| packet.vehicle), Ok(VEHICLE));
                }
            }
            _ => receive(&mut session, at, event, &mut input),
        }
        session.set_armed(armed);
        if armed {
            assert!(session.peer() == before && !session.is_pairing(), "an armed vehicle keeps its transmitter");
        }
        assert!(session.age(at).is_none_or(|age| age <= at.since(Instant::ZERO)));
    }
}

/// A frame: its length and its bytes, or a valid packet with a byte changed.
fn receive(session: &mut Session, at: Instant, event: u8, input: &mut Input<'_>) {
    let source = STATIONS[usize::from(event >> 3) % STATIONS.len()];
    let mut valid = ControlPacket::centred(VEHICLE).to_bytes();
    let bytes = if event % 8 == 5 {
        let (place, change) = (usize::from(input.byte()), input.byte());
        let place = place % valid.len();
        valid[place] ^= change;
        if event & 0x80 != 0 {
            repair(&mut valid);
        }
        &valid[..]
    } else {
        let length = usize::from(input.byte());
        input.bytes(length)
    };
    decode(bytes);
    let counted = |session: &Session| {
        let counters = session.counters();
        let refused = [
            counters.old,
            counters.strangers,
            counters.length,
            counters.other_vehicles,
            counters.checksum,
            counters.content,
        ];
        (counters.accepted, refused.iter().sum::<u32>())
    };
    let (accepted, refused) = counted(session);
    match session.receive(at, source, bytes) {
        Ok(pilot) => {
            assert_eq!(counted(session), (accepted + 1, refused));
            assert_eq!(session.peer(), Some(source));
            assert_eq!(session.age(at), Some(Duration::ZERO));
            let sticks = [pilot.roll, pilot.pitch, pilot.yaw, pilot.throttle];
            assert!(sticks.iter().all(|stick| (-1.0..=1.0).contains(stick)), "{pilot:?}");
        }
        Err(_) => assert_eq!(counted(session), (accepted, refused + 1)),
    }
}

/// Puts the checksum right: the last byte is the sum of the others.
fn repair(packet: &mut [u8]) {
    if let Some((sum, rest)) = packet.split_last_mut() {
        *sum = rest.iter().fold(0, |sum, byte| sum.wrapping_add(*byte));
    }
}

/// Whatever is a packet is the same packet when it is sent again.
fn decode(bytes: &[u8]) {
    if let Ok(packet) = ControlPacket::decode(bytes, VEHICLE) {
        assert_eq!(packet.to_bytes()[..12], bytes[..12]);
    }
    if let Ok(packet) = PairingPacket::decode(bytes) {
        assert_eq!(packet.to_bytes(), bytes);
    }
    if let Ok(packet) = TelemetryPacket::decode(bytes) {
        assert_eq!(packet.to_bytes(), bytes);
    }
    // Random bytes hardly ever have the right sum: with it put right, too.
    let mut repaired = bytes.to_vec();
    repair(&mut repaired);
    for bytes in [bytes, &repaired] {
        if let Ok(packet) = JoystickPacket::decode(bytes, VEHICLE) {
            assert_eq!(packet.to_bytes(), bytes);
            let input = packet.pilot_input(false);
            assert_eq!(input, input.cleaned());
        }
    }
    if let Ok(packet) = BroadcastPacket::decode(bytes) {
        let mut again = [0; BroadcastPacket::LONGEST];
        assert_eq!(packet.write(&mut again), Some(bytes.len()));
        // Two places that are not looked at.
        let looked_at = |place: &usize| !(101..104).contains(place) && !(122..124).contains(place);
        assert!((0..bytes.len()).filter(looked_at).all(|place| again[place] == bytes[place]));
    }
    slots(bytes);
}

/// The bytes as a life among other transmitters: the first one is the slot, the others are the time until the next beacon. Packets leave,
/// whatever is heard.
fn slots(bytes: &[u8]) {
    let mut input = Input(bytes);
    let Some(mut slots) = Slots::new(input.byte(), Instant::ZERO) else { return };
    let (mut now, mut sent) = (Instant::ZERO, Instant::ZERO);
    while !input.is_empty() {
        let next = now + Duration::from_micros(u64::from(input.byte()) * 150);
        while slots.due() < next {
            let due = slots.due();
            if slots.poll(due) == Some(SlotTurn::Packet) {
                assert!(due.since(sent) <= Duration::from_millis(40), "silenced");
                sent = due;
            }
        }
        now = next;
        slots.heard(now, SlotBeacon);
        assert!(!slots.is_lost(now) && slots.due() <= now + Duration::from_millis(40));
    }
}
