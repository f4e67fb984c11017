//! All frames that are checked by a sum, an exclusive or or a CRC: no wrong bit is taken, and of random bytes nothing that is not a frame.
//!
//! One table has every protocol. A row has frames, which places are not covered by the check, and how a frame is read; what is read is
//! written again, so that a frame that is taken can be compared with what came.

use stampfly_link::hisky::{HiskyBinding, HiskyLink};
use stampfly_link::msp::{Direction, MspDecoder, MspFrame, Version};
use stampfly_link::serial::Channels;
use stampfly_link::serial::crsf::{
    Attitude, Battery, CrsfDecoder, CrsfFrame, FlightModeName, Gps, LinkStatistics, Message, Vario,
};
use stampfly_link::serial::ibus::{IbusDecoder, IbusFrame};
use stampfly_link::stream::{
    StreamBuilder, StreamCycle, StreamEntry, StreamGains, StreamPacket, StreamRequest, StreamStatus,
};
use stampfly_link::tello::TelloCommand;
use stampfly_link::{
    Address, BroadcastPacket, ControlPacket, Datagram, JoystickPacket, PairingPacket, SlotBeacon, TelemetryPacket,
    datagrams,
};
use stampfly_types::{Instant, Vec3, message};

const VEHICLE: Address = Address([0x34, 0x85, 0x18, 0xAB, 0xCD, 0xEF]);
const RANDOM: usize = 100_000;

message! {
    /// A place.
    pub struct Place {
        /// Where it is.
        position: Vec3 ["m"],
        /// Its number.
        number: u32,
    }
}

datagrams! {
    /// The table of this test.
    pub enum Table, magic b"TEST";

    /// A place.
    Place = 1, valid if |_| true;
}

/// A protocol.
struct Row {
    name: &'static str,
    frames: Vec<Vec<u8>>,
    /// Bytes that the check does not cover, or that nobody looks at.
    free: &'static [usize],
    /// What is read, written again.
    read: fn(&[u8]) -> Option<Vec<u8>>,
}

fn stick(place: usize) -> u16 {
    (place * 197 + 300) as u16
}

fn control(bytes: &[u8]) -> Option<Vec<u8>> {
    let packet = ControlPacket::decode(bytes, VEHICLE).ok()?;
    let mut again = packet.to_bytes().to_vec();
    // A byte that is not looked at.
    (again[12], again[13]) = (bytes[12], bytes[13]);
    Some(again)
}

fn stream(bytes: &[u8]) -> Option<Vec<u8>> {
    let packet = StreamPacket::decode(bytes).ok()?;
    let mut builder = StreamBuilder::new(packet.sequence);
    packet.cycles().for_each(|cycle| builder.cycle(&cycle).expect("eight fit"));
    packet.entries().for_each(|entry| builder.entry(&entry).expect("they came from no more"));
    builder.finish().ok().map(<[u8]>::to_vec)
}

fn status(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut again = [0; StreamStatus::LONGEST];
    let length = StreamStatus::decode(bytes).ok()?.write(&mut again)?;
    Some(again[..length].to_vec())
}

fn crsf(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut again = [0; CrsfFrame::LONGEST];
    let length = CrsfFrame::decode(bytes).ok()?.write(&mut again)?;
    Some(again[..length].to_vec())
}

/// Any frame that the decoder finds in them.
fn msp(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut decoder = MspDecoder::<512>::new();
    bytes.iter().find_map(|byte| decoder.feed(*byte).map(written))
}

fn written(frame: MspFrame<'_>) -> Vec<u8> {
    let mut bytes = vec![0; frame.payload.len() + 16];
    let length = frame.write(&mut bytes).expect("there is room");
    bytes[..length].to_vec()
}

fn message(message: Message) -> Vec<u8> {
    let mut bytes = [0; CrsfFrame::LONGEST];
    let length = message.write(&mut bytes).expect("there is room");
    bytes[..length].to_vec()
}

fn streamed(entries: &[StreamEntry<'_>]) -> Vec<u8> {
    let mut builder = StreamBuilder::new(0x1234);
    for cycle in 0..8 {
        let rate = Vec3::new(cycle as f32, 0.1, -0.1);
        builder
            .cycle(&StreamCycle { time: 2_500 * cycle, rate, wanted_rate: rate, ..Default::default() })
            .expect("fits");
    }
    entries.iter().for_each(|entry| builder.entry(entry).expect("fits"));
    builder.finish().expect("whole").to_vec()
}

fn rows() -> Vec<Row> {
    let sticks = Channels(core::array::from_fn(stick));
    let statuses = [None, Some(None), Some(Some(812.0))].map(|gains| {
        let gains = gains.map(|current| StreamGains { rate: [[0.5, 0.7, 0.01]; 3], current });
        let (mut bytes, status) = ([0; 57], StreamStatus { sequence: 7, voltage: 3.8, gains, ..Default::default() });
        let length = status.write(&mut bytes).expect("there is room");
        bytes[..length].to_vec()
    });
    let control_packet = ControlPacket { arm: true, throttle: 3_001, ..ControlPacket::centred(VEHICLE) };
    let joystick = JoystickPacket { arm: true, rudder: -0.3, aileron: 1.25, ..JoystickPacket::centred(VEHICLE) };
    let telemetry = TelemetryPacket { battery: 3.9, height: 0.5, low_battery: true, ..Default::default() };
    let place = Datagram { sequence: 5, time: Instant::from_secs(3), body: Table::Place(Place::default()) };
    let asked = MspFrame::request(108);
    let two = MspFrame { version: Version::Two, flag: 3, ..MspFrame::request(0x2001) };
    let link =
        HiskyLink { address: [0x12, 0x34, 0x56, 0x78, 0x58], hops: core::array::from_fn(|hop| 2 + 3 * hop as u8) };
    vec![
        Row { name: "control packet", frames: vec![control_packet.to_bytes().to_vec()], free: &[], read: control },
        Row {
            name: "joystick packet",
            frames: vec![joystick.to_bytes().to_vec()],
            free: &[],
            read: |bytes| Some(JoystickPacket::decode(bytes, VEHICLE).ok()?.to_bytes().to_vec()),
        },
        Row {
            name: "telemetry packet",
            frames: vec![telemetry.to_bytes().to_vec()],
            free: &[],
            read: |bytes| Some(TelemetryPacket::decode(bytes).ok()?.to_bytes().to_vec()),
        },
        Row {
            name: "datagram",
            frames: vec![place.write(&mut [0; 64]).expect("valid").to_vec()],
            free: &[],
            read: |bytes| {
                let datagram = Datagram::<Table>::read(bytes).ok()?;
                Some(datagram.write(&mut [0; 64]).expect("it was valid").to_vec())
            },
        },
        Row {
            name: "data stream",
            frames: vec![
                streamed(&[]),
                streamed(&[
                    StreamEntry::Flow { time: 5, counts: [3, -4], surface_quality: 77 },
                    StreamEntry::Duty([[0.25; 4]; 8]),
                    StreamEntry::Other { id: 0x60, data: &[1, 2, 3] },
                ]),
            ],
            free: &[],
            read: stream,
        },
        Row { name: "status of the data stream", frames: statuses.to_vec(), free: &[], read: status },
        Row {
            name: "CRSF",
            frames: vec![
                message(Message::Channels(sticks)),
                message(Message::LinkStatistics(LinkStatistics { up_quality: 99, ..Default::default() })),
                message(Message::Battery(Battery { voltage: 3.7, current: 1.5, used: 120, remaining: 55 })),
                message(Message::Attitude(Attitude { pitch: 0.1, roll: -0.2, yaw: 3.0 })),
                message(Message::FlightMode(FlightModeName::new("ALT HOLD").expect("short"))),
                message(Message::Gps(Gps { latitude: 357_000_000, satellites: 9, ..Default::default() })),
                message(Message::Vario(Vario { climb: -0.5 })),
            ],
            // Whom it is for.
            free: &[0],
            read: crsf,
        },
        Row {
            name: "iBUS",
            frames: vec![IbusFrame { channels: core::array::from_fn(stick), ..Default::default() }.to_bytes().to_vec()],
            free: &[],
            read: |bytes| Some(IbusFrame::decode(bytes.try_into().ok()?).ok()?.to_bytes().to_vec()),
        },
        Row {
            name: "MSP",
            frames: vec![
                written(asked),
                written(asked.answer(Direction::Reply, &[1, 0, 2, 0, 3, 0])),
                written(asked.answer(Direction::Reply, &[7; 300])),
                written(two),
                written(two.answer(Direction::Error, &[1, 2, 3])),
            ],
            // The direction: `<` and `>` differ by a bit, and no check covers it.
            free: &[2],
            read: msp,
        },
        Row {
            // Its first packet has no sum, and the sum is of the address alone.
            name: "HiSKY, second bind packet",
            frames: vec![link.bind_packets()[1].to_vec()],
            free: &[3, 4, 5, 6, 7, 8, 9],
            read: |bytes| {
                let address = [0x12, 0x34, 0x56, 0x78, 0x58];
                let link = HiskyLink { address, hops: core::array::from_fn(|hop| 2 + 3 * hop as u8) };
                let [first, _, third, fourth] = link.bind_packets();
                let mut binding = HiskyBinding::default();
                let heard = [first, bytes.try_into().ok()?, third, fourth].map(|packet| binding.take(&packet));
                heard.into_iter().flatten().next().map(|link| link.bind_packets()[1].to_vec())
            },
        },
    ]
}

#[test]
fn no_single_wrong_bit_is_taken() {
    let mut count = 0;
    for Row { name, frames, free, read } in rows() {
        assert!(!frames.is_empty());
        for frame in frames {
            assert_eq!(read(&frame).as_ref(), Some(&frame), "{name}: the frame itself");
            for bit in (0..frame.len() * 8).filter(|bit| !free.contains(&(bit / 8))) {
                let mut wrong = frame.clone();
                wrong[bit / 8] ^= 1 << (bit % 8);
                assert_eq!(read(&wrong), None, "{name}, {} bytes: bit {bit}", frame.len());
                count += 1;
            }
        }
    }
    assert!(count > 20_000, "{count}");
}

#[test]
fn no_frame_that_is_cut_short_or_has_something_added_is_taken() {
    // What stands in a stream is found there, and what is cut short is waited for.
    for Row { name, frames, read, .. } in rows().into_iter().filter(|row| row.name != "MSP") {
        for frame in frames {
            for length in 0..frame.len() {
                assert_eq!(read(&frame[..length]), None, "{name}: {length} of {} bytes", frame.len());
            }
            let longer = [&frame[..], &[0]].concat();
            assert_eq!(read(&longer), None, "{name}: a byte more than {}", frame.len());
        }
    }
}

/// Always the same numbers, so that a failure repeats.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 >> 8
    }

    fn bytes(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.next() as u8).collect()
    }
}

#[test]
fn of_random_bytes_of_any_length_only_frames_are_taken() {
    let rows = rows();
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let mut taken = 0;
    for round in 0..RANDOM {
        let row = &rows[round % rows.len()];
        let frame = &row.frames[round / rows.len() % row.frames.len()];
        // Every other one has a frame's length and its first bytes, where random ones are refused at once.
        let like = round / 2 % 2 == 0;
        let length = if like { frame.len() } else { (random.next() % 200) as usize };
        let mut bytes = random.bytes(length);
        if like {
            let start = (random.next() % 8) as usize;
            let start = start.min(frame.len());
            bytes[..start].copy_from_slice(&frame[..start]);
        }
        for Row { name, read, .. } in &rows {
            // MSP's stands somewhere in them.
            if let Some(again) = read(&bytes) {
                let found = bytes == again || *name == "MSP" && bytes.windows(again.len()).any(|part| part == again);
                assert!(found, "{name} takes {bytes:x?}");
                taken += 1;
            }
        }
        // Nothing is checked in these but their form.
        if let Ok(packet) = PairingPacket::decode(&bytes) {
            assert_eq!(packet.to_bytes().to_vec(), bytes);
        }
        if let Ok(packet) = BroadcastPacket::decode(&bytes) {
            assert!(packet.write(&mut [0; BroadcastPacket::LONGEST]).is_some());
        }
        assert!(StreamRequest::decode(&bytes).is_none_or(|request| request.to_bytes().to_vec() == bytes));
        assert!(SlotBeacon::decode(&bytes).is_none_or(|beacon| beacon.to_bytes().to_vec() == bytes));
        let _ = TelloCommand::parse(&bytes);
    }
    // A check of eight bits lets one of 256 through, and the test has to be able to see that.
    assert!(taken > 10, "{taken}");
}

#[test]
fn a_random_stream_is_decoded_without_harm() {
    let mut random = Random(7);
    let (mut crsf, mut ibus, mut msp) = (CrsfDecoder::new(), IbusDecoder::new(), MspDecoder::<64>::new());
    let mut newest = Vec::new();
    for _ in 0..RANDOM * 10 {
        let byte = match random.next() % 8 {
            0 => b'$',
            1 => b'M',
            2 => b'<',
            3 => 0x20,
            4 => 0x40,
            5 => 3,
            _ => random.next() as u8,
        };
        newest.push(byte);
        if newest.len() > 1_000 {
            newest.drain(..500);
        }
        if let Some(frame) = crsf.feed(byte) {
            let mut bytes = [0; CrsfFrame::LONGEST];
            let length = frame.write(&mut bytes).expect("it came from no more");
            assert!(newest.windows(length).rev().take(200).any(|part| part == &bytes[..length]));
        }
        if let Some(frame) = ibus.feed(byte) {
            assert!(newest.ends_with(&frame.to_bytes()));
        }
        if let Some(frame) = msp.feed(byte) {
            assert!(newest.windows(frame.payload.len()).rev().take(200).any(|part| part == frame.payload));
        }
    }
    assert!(crsf.discarded() > 0 && ibus.discarded() > 0 && msp.discarded() > 0);
}
