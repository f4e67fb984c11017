//! A byte of a stream: our decoders beside the crates `sbus-rs`, `uf-crsf` and `mavlink`, over the same bytes, interleaved in one run.
//!
//! Two streams of each protocol: frames one after the other, and frames with three stray bytes before each and every tenth one broken. Every
//! contender takes a byte at a time, as from a UART, or all that a buffer holds at once, and gives sticks. All of them go into a black box, so
//! nobody gets away with unpacking one. The last lines print the ratios of the best
//! of 31 interleaved rounds, which is the figure to quote: whatever else the machine does can only slow a round down.

use criterion::{Criterion, Throughput, criterion_group};
use stampfly_link::mavlink::dialects::common::{ATTITUDE_DATA, MavMessage};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_link::msp::{Direction, MspDecoder, MspFrame};
use stampfly_link::serial::Channels;
use stampfly_link::serial::crsf::{CrsfDecoder, Message};
use stampfly_link::serial::sbus::{SbusDecoder, SbusFrame};
use stampfly_types::Instant;
use std::hint::black_box;
use uf_crsf::packets::Packet;

/// Frames of a stream.
const FRAMES: usize = 200;

/// Somebody who measures. A trait, so that each contender is measured by code of its own, without a call in between.
trait Measure {
    /// Measures a decoder that returns the sum of the first sticks that it has found in the stream.
    fn contender(&mut self, stream: &Stream, name: &'static str, decode: impl FnMut(&[u8]) -> u32);
}

/// What is decoded.
struct Stream {
    name: &'static str,
    bytes: Vec<u8>,
}

fn sticks(frame: usize) -> Channels {
    Channels(core::array::from_fn(|channel| ((frame * 131 + channel * 97) % 2_048) as u16))
}

/// Frames, as they are and with what happens on a wire.
fn streams(names: [&'static str; 2], written: impl Fn(usize) -> Vec<u8>) -> [Stream; 2] {
    let clean = (0..FRAMES).flat_map(&written).collect();
    let disturbed = (0..FRAMES).flat_map(|frame| {
        let mut bytes = written(frame);
        if frame % 10 == 9 {
            let place = bytes.len() / 2;
            bytes.remove(place);
        }
        [vec![0x55, 0x0F, 0xC8], bytes].concat()
    });
    let [first, second] = names;
    [Stream { name: first, bytes: clean }, Stream { name: second, bytes: disturbed.collect() }]
}

fn sbus() -> [Stream; 2] {
    streams(["SBUS", "SBUS, disturbed"], |frame| SbusFrame::new(sticks(frame)).to_bytes().to_vec())
}

fn crsf() -> [Stream; 2] {
    streams(["CRSF", "CRSF, disturbed"], |frame| {
        let mut bytes = [0; 64];
        let length = Message::Channels(sticks(frame)).write(&mut bytes).expect("there is room");
        bytes[..length].to_vec()
    })
}

fn msp() -> [Stream; 2] {
    streams(["MSP 2", "MSP 2, disturbed"], |frame| {
        let payload: Vec<u8> = sticks(frame).0.iter().flat_map(|stick| stick.to_le_bytes()).collect();
        let asked = MspFrame::request(0x2001);
        let mut bytes = [0; 64];
        let length = asked.answer(Direction::Reply, &payload).write(&mut bytes).expect("there is room");
        bytes[..length].to_vec()
    })
}

fn mavlink() -> [Stream; 2] {
    streams(["MAVLink 2", "MAVLink, disturbed"], |frame| {
        let roll = frame as f32;
        let message = MavMessage::ATTITUDE(ATTITUDE_DATA {
            time_boot_ms: 20 * frame as u32,
            roll,
            yawspeed: 0.5,
            ..Default::default()
        });
        let mut bytes = [0; LONGEST];
        MavlinkWriter::new(1, 1).write(MavlinkVersion::V2, &message, &mut bytes).expect("there is room").to_vec()
    })
}

fn roll(message: &MavMessage) -> u32 {
    if let MavMessage::ATTITUDE(attitude) = black_box(message) { attitude.roll as u32 } else { 0 }
}

/// Gives a reader of the crate `mavlink` so many bytes at once.
struct Pieces<'b> {
    bytes: &'b [u8],
    most: usize,
}

impl embedded_io::ErrorType for Pieces<'_> {
    type Error = core::convert::Infallible;
}

impl embedded_io::Read for Pieces<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
        let count = self.bytes.len().min(buffer.len()).min(self.most);
        let (taken, rest) = self.bytes.split_at(count);
        buffer[..count].copy_from_slice(taken);
        self.bytes = rest;
        Ok(count)
    }
}

/// All messages that the crate `mavlink` finds when it is given so many bytes at once.
fn theirs(bytes: &[u8], most: usize) -> u32 {
    let mut reader = mavlink::MavlinkReader::new(Pieces { bytes, most });
    let mut sum = 0;
    // At the end of the bytes there is an error.
    while let Ok((_, message)) = reader.read_any_message::<MavMessage>() {
        sum += roll(&message);
    }
    sum
}

fn contenders(measure: &mut impl Measure) {
    for stream in &sbus() {
        let mut ours = SbusDecoder::new();
        measure.contender(stream, "ours, by byte", |bytes| {
            let frames = bytes.iter().filter_map(|byte| ours.feed(Instant::ZERO, *byte));
            frames.map(|frame| u32::from(black_box(frame).channels.0[0])).sum()
        });
        let mut ours = SbusDecoder::new();
        measure.contender(stream, "ours, by buffer", |bytes| {
            let mut sum = 0;
            for mut buffer in bytes.chunks(64) {
                while let Some(frame) = ours.read(Instant::ZERO, &mut buffer) {
                    sum += u32::from(black_box(frame).channels.0[0]);
                }
            }
            sum
        });
        let mut theirs = sbus_rs::StreamingParser::new();
        measure.contender(stream, "sbus-rs, by buffer", |bytes| {
            let mut sum = 0;
            for buffer in bytes.chunks(64) {
                let frames = theirs.push_bytes(buffer).flatten();
                sum += frames.map(|frame| u32::from(black_box(frame).channels[0])).sum::<u32>();
            }
            sum
        });
        let mut theirs = sbus_rs::StreamingParser::new();
        measure.contender(stream, "sbus-rs, by byte", |bytes| {
            let frames = bytes.iter().filter_map(|byte| theirs.push_byte(*byte).ok().flatten());
            frames.map(|frame| u32::from(black_box(frame).channels[0])).sum()
        });
    }
    for stream in &crsf() {
        let mut ours = CrsfDecoder::new();
        measure.contender(stream, "ours, by byte", |bytes| {
            let mut sum = 0;
            for byte in bytes {
                if let Some(Message::Channels(channels)) = ours.feed(*byte).map(|frame| frame.message()) {
                    sum += u32::from(black_box(channels).0[0]);
                }
            }
            sum
        });
        let mut ours = CrsfDecoder::new();
        measure.contender(stream, "ours, by buffer", |bytes| {
            let mut sum = 0;
            for mut buffer in bytes.chunks(64) {
                while let Some(frame) = ours.read(&mut buffer) {
                    if let Message::Channels(channels) = frame.message() {
                        sum += u32::from(black_box(channels).0[0]);
                    }
                }
            }
            sum
        });
        let mut theirs = uf_crsf::CrsfParser::new();
        measure.contender(stream, "uf-crsf, by byte", |bytes| {
            let mut sum = 0;
            for byte in bytes {
                let mut one = std::slice::from_ref(byte);
                for packet in theirs.iter_packets(&mut one) {
                    if let Ok(Packet::RCChannels(channels)) = packet {
                        sum += u32::from(black_box(channels).0[0]);
                    }
                }
            }
            sum
        });
        let mut theirs = uf_crsf::CrsfParser::new();
        measure.contender(stream, "uf-crsf, by buffer", |bytes| {
            let mut sum = 0;
            for mut buffer in bytes.chunks(64) {
                for packet in theirs.iter_packets(&mut buffer) {
                    if let Ok(Packet::RCChannels(channels)) = packet {
                        sum += u32::from(black_box(channels).0[0]);
                    }
                }
            }
            sum
        });
    }
    for stream in &mavlink() {
        let mut ours = MavlinkDecoder::<MavMessage>::new();
        measure.contender(stream, "ours, by byte", |bytes| {
            let mut sum = 0;
            for byte in bytes {
                if let Some(Ok(message)) = ours.feed(*byte).map(|frame| frame.message::<MavMessage>()) {
                    sum += roll(&message);
                }
            }
            sum
        });
        let mut ours = MavlinkDecoder::<MavMessage>::new();
        measure.contender(stream, "ours, by buffer", |bytes| {
            let mut sum = 0;
            for mut buffer in bytes.chunks(64) {
                while let Some(frame) = ours.read(&mut buffer) {
                    sum += frame.message::<MavMessage>().map_or(0, |message| roll(&message));
                }
            }
            sum
        });
        measure.contender(stream, "mavlink, by byte", |bytes| theirs(bytes, 1));
        measure.contender(stream, "mavlink, by buffer", |bytes| theirs(bytes, 64));
    }
    for stream in &msp() {
        let mut ours = MspDecoder::<64>::new();
        measure.contender(stream, "ours, by byte", |bytes| {
            let mut sum = 0;
            for byte in bytes {
                sum += ours.feed(*byte).map_or(0, |frame| u32::from(black_box(frame).payload[0]));
            }
            sum
        });
    }
}

struct ByCriterion<'a>(&'a mut Criterion);

impl Measure for ByCriterion<'_> {
    fn contender(&mut self, stream: &Stream, name: &'static str, mut decode: impl FnMut(&[u8]) -> u32) {
        let mut group = self.0.benchmark_group(stream.name);
        group.throughput(Throughput::Bytes(stream.bytes.len() as u64));
        group.bench_function(name, |b| b.iter(|| decode(black_box(&stream.bytes))));
        group.finish();
    }
}

fn bench(c: &mut Criterion) {
    contenders(&mut ByCriterion(c));
}

criterion_group!(benches, bench);

const ROUNDS: usize = 31;
/// Times that a stream is decoded in a round.
const CALLS: usize = 50;

/// A contender at a stream: nanoseconds a byte, one a round, and what it found.
struct Timed {
    stream: &'static str,
    name: &'static str,
    found: u32,
    times: Vec<f64>,
}

#[derive(Default)]
struct Interleaved(Vec<Timed>);

impl Measure for Interleaved {
    fn contender(&mut self, stream: &Stream, name: &'static str, mut decode: impl FnMut(&[u8]) -> u32) {
        // What a stream ends with may be the beginning of a frame.
        decode(&stream.bytes);
        let found = decode(&stream.bytes);
        let started = std::time::Instant::now();
        for _ in 0..CALLS {
            black_box(decode(black_box(&stream.bytes)));
        }
        let nanoseconds = started.elapsed().as_secs_f64() * 1e9 / (CALLS * stream.bytes.len()) as f64;
        let known = self.0.iter_mut().find(|timed| (timed.stream, timed.name) == (stream.name, name));
        match known {
            Some(timed) => timed.times.push(nanoseconds),
            None => self.0.push(Timed { stream: stream.name, name, found, times: vec![nanoseconds] }),
        }
    }
}

/// The best of interleaved rounds, as ratios to ours.
fn ratios() {
    let mut measured = Interleaved::default();
    for _ in 0..ROUNDS {
        contenders(&mut measured);
    }
    println!("\nbest of {ROUNDS} interleaved rounds");
    let mut ours = 1.0;
    for Timed { stream, name, found, times } in &measured.0 {
        let best = times.iter().copied().fold(f64::INFINITY, f64::min);
        if *name == "ours, by byte" {
            ours = best;
        }
        let ratio = best / ours;
        println!("{stream:<18} {name:<18} {best:>6.2} ns a byte, sum {found:>7}; this / ours, by byte = {ratio:.2}");
    }
}

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    ratios();
}
