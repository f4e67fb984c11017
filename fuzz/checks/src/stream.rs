//! The data stream: packets that a PC reads, and packets that a vehicle fills.

use crate::Input;
use stampfly_link::stream::{
    CYCLES, LONGEST, StreamBuildError, StreamBuilder, StreamCycle, StreamEntry, StreamPacket, StreamPhase,
    StreamRequest, StreamSink, StreamStatus,
};
use stampfly_types::{Instant, Quat};

/// The first byte says what the rest is: a packet, one whose check is put right, what a packet is filled with, or requests.
pub fn data_stream(data: &[u8]) {
    let mut input = Input(data);
    match input.byte() % 4 {
        0 => read(input.0),
        1 => {
            let mut bytes = input.0.to_vec();
            bytes.push(bytes.iter().fold(0, |all, byte| all ^ byte));
            read(&bytes);
        }
        2 => fill(&mut input),
        _ => ask(&mut input),
    }
}

/// What is accepted is the same packet when it is sent again.
fn read(bytes: &[u8]) {
    if let Ok(packet) = StreamPacket::decode(bytes) {
        assert_eq!(packet.cycles().count(), CYCLES);
        let mut builder = StreamBuilder::new(packet.sequence);
        packet.cycles().for_each(|cycle| builder.cycle(&cycle).expect("eight fit"));
        let written: Vec<_> = packet.entries().map(|entry| builder.entry(&entry)).collect();
        // Only what means something else where it arrives is not sent.
        assert!(written.iter().all(|entry| matches!(entry, Ok(()) | Err(StreamBuildError::Reserved))));
        let again = builder.finish().expect("whole");
        let packet_again = StreamPacket::decode(again).expect("our own packet");
        assert_eq!(packet_again.entries().count(), written.iter().filter(|entry| entry.is_ok()).count());
        // The fixed part, bit for bit.
        assert_eq!(again[..916], bytes[..916]);
    }
    if let Ok(status) = StreamStatus::decode(bytes) {
        let mut again = [0; StreamStatus::LONGEST];
        let length = status.write(&mut again).expect("there is room");
        assert_eq!(again[..length], *bytes);
    }
}

/// Whatever is offered, the packet is never too long, and holds what was taken.
fn fill(input: &mut Input<'_>) {
    let mut builder = StreamBuilder::new(u16::from(input.byte()) << 8);
    let (mut cycles, mut entries, mut left_out) = (0, 0, 0);
    while !input.is_empty() {
        let time = u32::from(input.byte()) << 24;
        let taken = match input.byte() % 8 {
            0 => {
                let cycle = StreamCycle {
                    time,
                    rate: input.vector(10.0),
                    attitude: Quat::new_unchecked(input.number(1.0), input.number(1.0), 0.0, 0.0),
                    rate_bias: input.vector(10.0),
                    force_bias: input.vector(10.0),
                    wanted_rate: input.vector(100.0),
                    ..Default::default()
                };
                let numbers = [cycle.rate_bias, cycle.force_bias, cycle.wanted_rate];
                let readable = numbers.iter().all(|vector| vector.iter().all(|number| !number.is_nan()));
                let taken = builder.cycle(&cycle);
                let expected = match (cycles < CYCLES, readable) {
                    (false, _) => Err(StreamBuildError::CyclesFull),
                    (true, false) => Err(StreamBuildError::NotANumber),
                    (true, true) => Ok(()),
                };
                assert_eq!(taken, expected);
                cycles += usize::from(taken.is_ok());
                continue;
            }
            1 => builder.entry(&StreamEntry::Barometer { time, height: input.number(1e3), pressure: 1e3 }),
            2 => builder.entry(&StreamEntry::Duty([[input.number(2.0); 4]; CYCLES])),
            3 => {
                let phase = StreamPhase { state: 1, flip: 2, result: 3, angle: input.number(100.0) };
                builder.entry(&StreamEntry::Phase([phase; CYCLES]))
            }
            4 => {
                let angle = [input.number(4.0), input.number(4.0)];
                builder.entry(&StreamEntry::Wanted { time, mode: 9, angle, thrust: 0.0, duty: [0.0; 4] })
            }
            _ => {
                let (id, length) = (input.byte(), usize::from(input.byte()) * 2);
                builder.entry(&StreamEntry::Other { id, data: input.bytes(length) })
            }
        };
        entries += usize::from(taken.is_ok());
        left_out += u32::from(taken == Err(StreamBuildError::NoRoom));
    }
    assert_eq!((builder.cycles(), builder.left_out()), (cycles, left_out));
    match builder.finish() {
        Ok(bytes) => {
            assert!(cycles == CYCLES && bytes.len() <= LONGEST);
            let packet = StreamPacket::decode(bytes).expect("our own packet");
            assert_eq!(packet.entries().count(), entries);
        }
        Err(error) => assert!(cycles < CYCLES && error == StreamBuildError::CyclesMissing),
    }
}

/// Nobody is sent to who has not asked within five seconds.
fn ask(input: &mut Input<'_>) {
    let (mut sink, mut now) = (StreamSink::new(), Instant::ZERO);
    let mut newest = [None; 3];
    while !input.is_empty() {
        let from = usize::from(input.byte() % 3);
        now += stampfly_types::Duration::from_millis(u64::from(input.byte()) * 20);
        let length = usize::from(input.byte() % 3);
        let bytes = input.bytes(length);
        if let Some(request) = StreamRequest::decode(bytes) {
            assert_eq!(request.to_bytes(), bytes);
            sink.take(now, from, request);
            newest[from] = Some(now);
        }
        if let Some(sink) = sink.address(now) {
            assert!(newest[sink].is_some_and(|heard| now.since(heard).as_millis() < 5_000));
        }
    }
}
