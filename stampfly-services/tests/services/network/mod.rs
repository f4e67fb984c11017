//! The stack that the firmware has on its radio, on a cable, with a computer at the other end that has a stack of its own.

mod cable;

use crate::common::Vehicle;
use cable::{Computer, End, VEHICLE, cable};
use smoltcp::iface::SocketHandle;
use smoltcp::socket::tcp;
use stampfly_link::mavlink::dialects::common::*;
use stampfly_link::mavlink::signing::{Signer, SigningKey};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkWriter};
use stampfly_link::secure::{Guarded, Heard, Key, MAX_FRAME, Payload, Policy, Station};
use stampfly_link::{Address, Session};
use stampfly_services::mavlink::Identity;
use stampfly_services::network::{Door, MAVLINK_TCP, MAVLINK_UDP, Memory, Ports, Routes, SEALED_UDP, Stack};
use stampfly_types::messages::PilotInput;
use stampfly_types::{Duration, Instant};

const IDENTITY: Identity =
    Identity { system: 1, kind: MavType::MAV_TYPE_QUADROTOR, take_off_height: 0.5, reach: 0.25, version: [1, 2, 3] };
/// As in the firmware.
const ITEMS: usize = 16;
const TURN: Duration = Duration::from_millis(10);
/// In the units of signatures: an hour.
const HOUR: u64 = 3_600 * 100_000;

fn key(with: u8) -> Key {
    Key::generate(1, core::array::from_fn(|place| place as u8 ^ with)).expect("random enough")
}

/// The vehicle's link, and what it was told.
struct Link {
    guarded: Guarded,
    sticks: Vec<PilotInput>,
}

impl Door for Link {
    fn station(&self) -> Option<Address> {
        self.guarded.station()
    }

    fn take(&mut self, now: Instant, source: Address, frame: &mut [u8]) {
        if let Ok(Heard::Authentic(received)) = self.guarded.receive_sealed(now, source, frame)
            && let Payload::Sticks(input) = received.payload
        {
            self.sticks.push(input);
        }
    }

    fn offer<'r>(&self, room: &'r mut [u8; MAX_FRAME]) -> Option<&'r [u8]> {
        self.guarded.announcement(room)
    }
}

/// Everything that the firmware has at its network, and a computer.
struct Place {
    now: Instant,
    end: End,
    stack: Stack,
    ports: Ports<ITEMS>,
    routes: Routes,
    vehicle: Vehicle,
    link: Link,
    computer: Computer,
    is_up: bool,
}

impl Place {
    fn new() -> Self {
        let (mut end, other) = cable();
        let memory = Box::leak(Box::new(Memory::new()));
        let stack = Stack::new(memory, &mut end, [2, 0, 0, 0, 0, 7], 42, Instant::ZERO);
        let session = Session::new(Address([2, 0, 0, 0, 0, 7]), 1, None);
        let secure = stampfly_link::secure::Vehicle::new(key(0x5A));
        Self {
            now: Instant::ZERO,
            end,
            stack,
            ports: Ports::new(IDENTITY, &key(0x5A), HOUR),
            routes: Routes::new(),
            vehicle: Vehicle::standing(),
            link: Link { guarded: Guarded::new(secure, session, Policy::default()), sticks: Vec::new() },
            computer: Computer::new(other),
            is_up: true,
        }
    }

    /// With an address.
    fn with_address() -> Self {
        let mut place = Self::new();
        place.pass(200, |_| {});
        assert_eq!(place.stack.address(), Some(VEHICLE));
        place
    }

    /// One turn of the firmware's tasks, and of the computer.
    fn turn(&mut self) {
        self.now += TURN;
        let Self { now, end, stack, ports, routes, vehicle, link, computer, .. } = self;
        stack.poll(*now, end, self.is_up);
        Ports::<ITEMS>::open(*now, stack, routes, link);
        ports.turn(*now, stack, vehicle);
        if now.as_micros().is_multiple_of(20_000) {
            let mut room = [0; MAX_FRAME];
            // A generator, as far as this has to be one.
            let fresh = (now.as_micros() ^ 0x9E37_79B9_7F4A_7C15).to_le_bytes();
            if let Some(frame) = link.guarded.transmit(*now, fresh, &mut room) {
                assert!(
                    !Ports::<ITEMS>::send_sealed(*now, stack, routes, Address::BROADCAST, frame),
                    "the radio's, too"
                );
            }
            let mut room = [0; MAX_FRAME];
            let telemetry = Payload::Acknowledgement { counter: 7, taken: true };
            if let Some((to, frame)) = link.guarded.seal(*now, &telemetry, &mut room) {
                assert!(Ports::<ITEMS>::send_sealed(*now, stack, routes, to, frame));
            }
        }
        computer.poll(*now);
    }

    /// Lets so many milliseconds pass.
    fn pass(&mut self, ms: u64, mut each: impl FnMut(&mut Self)) {
        for _ in 0..ms / 10 {
            self.turn();
            each(self);
        }
    }
}

/// A ground station that signs, or does not.
struct Program {
    writer: MavlinkWriter,
    signer: Option<Signer>,
    decoder: MavlinkDecoder<MavMessage>,
    /// The latest time that it has seen on a signed frame.
    time: u64,
    heard: Vec<MavMessage>,
}

impl Program {
    fn new(system: u8, key: Option<SigningKey>, time: u64) -> Self {
        let signer = key.map(|key| Signer::new(key, 0, time));
        Self {
            writer: MavlinkWriter::new(system, 190),
            signer,
            decoder: MavlinkDecoder::new(),
            time,
            heard: Vec::new(),
        }
    }

    fn says(&mut self, now: Instant, message: &MavMessage) -> Vec<u8> {
        let mut room = [0; LONGEST];
        let frame = match &mut self.signer {
            Some(signer) => self.writer.write_signed(now, message, signer, &mut room),
            None => self.writer.write(stampfly_link::mavlink::MavlinkVersion::V2, message, &mut room),
        };
        frame.expect("room").to_vec()
    }

    fn hears(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if let Some(frame) = self.decoder.feed(*byte) {
                self.time = self.time.max(frame.signature.expect("the vehicle signs").time);
                self.heard.extend(frame.message::<MavMessage>().ok());
            }
        }
    }

    fn parameters(&self) -> usize {
        self.heard.iter().filter(|message| matches!(message, MavMessage::PARAM_VALUE(_))).count()
    }

    fn heartbeats(&self) -> usize {
        self.heard.iter().filter(|message| matches!(message, MavMessage::HEARTBEAT(_))).count()
    }
}

fn signing(with: u8) -> SigningKey {
    SigningKey::of(&key(with))
}

fn question() -> MavMessage {
    MavMessage::PARAM_REQUEST_READ(PARAM_REQUEST_READ_DATA {
        param_index: 0,
        target_system: 1,
        target_component: 1,
        param_id: [0; 16].into(),
    })
}

/// Asks for a parameter ten times a second for so long.
fn asks(place: &mut Place, program: &mut Program, socket: SocketHandle, ms: u64) {
    place.pass(ms, |place| {
        if place.now.as_micros().is_multiple_of(100_000) {
            let frame = program.says(place.now, &question());
            place.computer.send(socket, MAVLINK_UDP, &frame);
        }
        while let Some(bytes) = place.computer.receive(socket) {
            program.hears(&bytes);
        }
    });
}

#[test]
fn it_has_an_address_as_long_as_it_is_in_the_network() {
    let mut place = Place::with_address();
    place.is_up = false;
    place.turn();
    assert_eq!(place.stack.address(), None);
    place.is_up = true;
    place.pass(200, |_| {});
    assert_eq!(place.stack.address(), Some(VEHICLE));
}

#[test]
fn a_program_that_signs_is_answered_where_it_spoke_and_others_are_told_nothing() {
    let mut place = Place::with_address();
    for (key, answered) in [(None, false), (Some(signing(0x11)), false), (Some(signing(0x5A)), true)] {
        let socket = place.computer.open();
        let mut program = Program::new(250, key, HOUR);
        asks(&mut place, &mut program, socket, 1_000);
        assert_eq!(program.parameters() > 5, answered, "{}", program.parameters());
        assert_eq!(program.heard.is_empty(), !answered);
    }
    assert!(place.ports.untrusted() >= 18, "{}", place.ports.untrusted());
}

#[test]
fn a_program_whose_clock_is_behind_is_told_the_vehicles_time() {
    let mut place = Place::with_address();
    let socket = place.computer.open();
    let mut late = Program::new(250, Some(signing(0x5A)), 5);
    asks(&mut place, &mut late, socket, 3_000);
    assert_eq!(late.parameters(), 0);
    assert!((2..=4).contains(&late.heartbeats()), "{} heartbeats in three seconds", late.heartbeats());
    // As the protocol wants it, and pymavlink does.
    let mut same = Program::new(250, Some(signing(0x5A)), late.time);
    asks(&mut place, &mut same, socket, 1_000);
    assert!(same.parameters() > 5);
    assert!(place.ports.signature_time(place.now) > late.time);
}

#[test]
fn a_program_that_begins_again_at_another_place_is_answered_soon() {
    let mut place = Place::with_address();
    for time in [HOUR, 2 * HOUR, 3 * HOUR] {
        let socket = place.computer.open();
        let mut program = Program::new(250, Some(signing(0x5A)), time);
        asks(&mut place, &mut program, socket, 6_000);
        assert!(program.parameters() >= 9, "{}", program.parameters());
    }
}

#[test]
fn who_connects_is_told_the_state_and_has_to_sign_within_ten_seconds() {
    let mut place = Place::with_address();
    let stranger = place.computer.connect(MAVLINK_TCP);
    let mut told = Program::new(250, None, 0);
    place.pass(9_000, |place| told.hears(&place.computer.read(stranger)));
    assert!(told.heartbeats() >= 8, "{}", told.heartbeats());
    assert!(place.computer.stream(stranger).is_active());
    let second = place.computer.connect(MAVLINK_TCP);
    place.pass(500, |_| {});
    assert!(!place.computer.stream(second).is_active(), "there is one stream");
    place.pass(1_500, |_| {});
    assert!(!place.computer.stream(stranger).is_active(), "it has not signed");

    let own = place.computer.connect(MAVLINK_TCP);
    let mut program = Program::new(250, Some(signing(0x5A)), HOUR);
    place.pass(20_000, |place| {
        if place.now.as_micros().is_multiple_of(1_000_000) {
            let frame = program.says(place.now, &question());
            place.computer.stream(own).send_slice(&frame).expect("connected");
        }
        program.hears(&place.computer.read(own));
    });
    assert_eq!(program.parameters(), 20);
    assert!(place.computer.stream(own).is_active());
    // Whoever hangs up makes room.
    place.computer.stream(own).close();
    place.pass(200, |_| {});
    let next = place.computer.connect(MAVLINK_TCP);
    place.pass(200, |_| {});
    assert_eq!(place.computer.stream(next).state(), tcp::State::Established);
}

#[test]
fn who_never_reads_loses_the_stream_and_holds_up_nobody() {
    let mut place = Place::with_address();
    let lazy = place.computer.connect(MAVLINK_TCP);
    let mut signs = Program::new(251, Some(signing(0x5A)), HOUR);
    place.pass(100, |_| {});
    let frame = signs.says(place.now, &question());
    place.computer.stream(lazy).send_slice(&frame).expect("connected");

    let socket = place.computer.open();
    let mut program = Program::new(250, Some(signing(0x5A)), HOUR);
    asks(&mut place, &mut program, socket, 15_000);
    assert_eq!(place.stack.lost().stuck, 1);
    assert!(!place.computer.stream(lazy).is_active());
    assert!(program.parameters() >= 149, "{}", program.parameters());
    let next = place.computer.connect(MAVLINK_TCP);
    place.pass(200, |_| {});
    assert_eq!(place.computer.stream(next).state(), tcp::State::Established);
}

/// A thousand datagrams a second, from as many places as there are ports, to each port.
fn flood(place: &mut Place, stranger: SocketHandle, seed: &mut u32) {
    for _ in 0..5 {
        for port in [MAVLINK_UDP, SEALED_UDP] {
            let mut garbage = Vec::new();
            for _ in 0..1 + *seed % 300 {
                *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                garbage.push((*seed >> 24) as u8);
            }
            place.computer.rebind(stranger);
            place.computer.send(stranger, port, &garbage);
            place.computer.poll(place.now);
        }
    }
}

#[test]
fn a_flood_of_garbage_delays_answers_and_does_nothing_else() {
    let mut place = Place::with_address();
    let (stranger, socket) = (place.computer.open(), place.computer.open());
    let mut program = Program::new(250, Some(signing(0x5A)), HOUR);
    let mut seed = 1;
    for _ in 0..100 {
        flood(&mut place, stranger, &mut seed);
        asks(&mut place, &mut program, socket, 20);
    }
    // Ten questions a second for two seconds, on a cable that is full.
    assert!(program.parameters() >= 5, "{}", program.parameters());
    assert!(place.vehicle.guided.is_empty() && place.link.sticks.is_empty());
    assert_eq!(place.stack.address(), Some(VEHICLE));
    // And when it is over, it is over.
    let before = program.parameters();
    asks(&mut place, &mut program, socket, 1_000);
    assert!(program.parameters() >= before + 9);
}

/// A station with the vehicle's key, on the network.
struct Sealed {
    station: Station,
    socket: SocketHandle,
    heard: usize,
}

impl Sealed {
    fn turn(&mut self, place: &mut Place) {
        while let Some(mut frame) = place.computer.receive(self.socket) {
            if let Ok(Some(received)) = self.station.receive(place.now, &mut frame) {
                assert_eq!(received.payload, Payload::Acknowledgement { counter: 7, taken: true });
                self.heard += 1;
            }
        }
        if !place.now.as_micros().is_multiple_of(50_000) {
            return;
        }
        let mut room = [0; MAX_FRAME];
        let fresh = (place.now.as_micros() ^ 0x5851_F42D_4C95_7F2D).to_le_bytes();
        let sticks = Payload::Sticks(PilotInput { throttle: 0.25, ..Default::default() });
        let mut again = [0; MAX_FRAME];
        let frame = match self.station.transmit(place.now, fresh, &mut room) {
            Some(frame) => frame,
            // Without a session it asks for an offer.
            None => self.station.seal(place.now, &sticks, &mut again).unwrap_or_default(),
        };
        place.computer.send(self.socket, SEALED_UDP, frame);
    }
}

#[test]
fn a_station_with_the_key_joins_flies_and_is_told_in_sealed_frames_in_a_flood_too() {
    let mut place = Place::with_address();
    let stranger = place.computer.open();
    let mut sealed = Sealed { station: Station::new(key(0x5A)), socket: place.computer.open(), heard: 0 };
    place.pass(2_000, |place| sealed.turn(place));
    assert!(place.link.sticks.len() > 20, "{}", place.link.sticks.len());
    assert!(sealed.heard > 50, "{}", sealed.heard);
    let (before, mut seed) = (place.link.sticks.len(), 1);
    for _ in 0..100 {
        flood(&mut place, stranger, &mut seed);
        place.pass(20, |place| sealed.turn(place));
    }
    assert!(place.link.sticks.len() >= before + 10, "{} of 40", place.link.sticks.len() - before);
    assert!(place.link.sticks.iter().all(|input| (input.throttle - 0.25).abs() < 1e-3));
}

#[test]
fn a_station_with_another_key_is_told_that_there_is_a_vehicle_and_nothing_else() {
    let mut place = Place::with_address();
    let mut sealed = Sealed { station: Station::new(key(0x11)), socket: place.computer.open(), heard: 0 };
    place.pass(2_000, |place| sealed.turn(place));
    assert_eq!((sealed.heard, place.link.sticks.len()), (0, 0));
    assert_eq!(place.link.guarded.station(), None);
}
