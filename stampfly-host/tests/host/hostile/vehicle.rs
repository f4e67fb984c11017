//! A vehicle at the other end of a line that says whatever a test has it say.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use stampfly_board::simulation::StampFly;
use stampfly_bus::{Schedule, TopicInfo, TopicTable};
use stampfly_link::mavlink::dialects::common::MavMessage;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkWriter, Tunnel};
use stampfly_link::secure::{Payload, Sample};
use stampfly_services::cable::{Envelope, TYPE};
use stampfly_sim::vehicle::Vehicle as _;
use stampfly_types::Instant as At;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Bytes of a kind of nonsense: as many as are said in some milliseconds.
const BLOCK: usize = 64 << 10;

pub fn topics() -> &'static [TopicInfo] {
    <<<StampFly as stampfly_sim::vehicle::Vehicle>::Runnables as Schedule>::Topics as TopicTable>::TOPICS
}

pub fn parameters() -> usize {
    StampFly::parameters(&StampFly::default_config()).len()
}

/// What the station says: the fingerprint of its tables, the number of its question, the question.
pub struct Heard {
    table: u16,
    pub number: u16,
    pub what: String,
}

/// What ends with this byte.
fn said(decoder: &mut MavlinkDecoder<MavMessage>, byte: u8) -> Option<Heard> {
    let tunnel = decoder.feed(byte).and_then(|frame| Tunnel::read(frame.payload))?;
    let (Envelope { table, number, kind, .. }, body) = Envelope::read(&tunnel.bytes)?;
    Some(Heard { table, number, what: format!("{:?}", Payload::decode(kind, body)?) })
}

/// The last question in these bytes: the fingerprint of its tables, and its number.
pub fn question(bytes: &[u8]) -> (u16, u16) {
    let mut decoder = MavlinkDecoder::new();
    let last = bytes.iter().filter_map(|byte| said(&mut decoder, *byte)).last().expect("a question");
    (last.table, last.number)
}

/// The frames of a vehicle with these tables that answers this question.
pub fn frames(table: u16, number: u16, payload: &Payload<'_>) -> Vec<u8> {
    let (mut writer, mut frames) = (MavlinkWriter::new(1, 1), Vec::new());
    for part in parts(table, number, payload) {
        frames.extend(tunnel(&mut writer, &part));
    }
    frames
}

/// The bytes in the tunnels of a payload.
fn parts(table: u16, number: u16, payload: &Payload<'_>) -> Vec<Vec<u8>> {
    let mut parts = Vec::new();
    assert!(Envelope::write(table, number, None, payload, &mut |part| parts.push(part.to_vec())));
    parts
}

/// A tunnel with these bytes.
fn tunnel(writer: &mut MavlinkWriter, bytes: &[u8]) -> Vec<u8> {
    let (tunnel, mut room) = (Tunnel::new(TYPE, [0; 2], bytes).expect("it is short"), [0; LONGEST]);
    writer.write_payload::<MavMessage>(Tunnel::ID, &tunnel.payload(), &mut room).expect("room").to_vec()
}

pub struct Vehicle {
    stream: TcpStream,
    writer: MavlinkWriter,
    /// The fingerprint that the station takes for its own.
    table: u16,
    pub heard: Receiver<Heard>,
}

impl Vehicle {
    /// At the other end of this line. Everything that the station says is read.
    pub fn new(stream: TcpStream) -> Self {
        let (tell, heard) = channel();
        let (first, table) = channel();
        let mut line = stream.try_clone().expect("a handle");
        thread::spawn(move || {
            let (mut decoder, mut part) = (MavlinkDecoder::new(), [0; 4096]);
            while let Ok(length @ 1..) = line.read(&mut part) {
                for heard in part[..length].iter().filter_map(|byte| said(&mut decoder, *byte)) {
                    _ = first.send(heard.table);
                    _ = tell.send(heard);
                }
            }
        });
        let table = table.recv_timeout(Duration::from_secs(10)).expect("the station says what it wants to see");
        Self { stream, writer: MavlinkWriter::new(1, 1), table, heard }
    }

    /// Says this at once.
    pub fn say(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).expect("the station listens");
    }

    /// Says this again and again, as fast as the station takes it, for so long. Bytes of it.
    pub fn says(&self, bytes: Vec<u8>, time: Duration) -> JoinHandle<usize> {
        let (mut stream, until) = (self.stream.try_clone().expect("a handle"), Instant::now() + time);
        thread::spawn(move || {
            let mut said = 0;
            while Instant::now() < until {
                stream.write_all(&bytes).expect("the station listens");
                said += bytes.len();
            }
            said
        })
    }

    /// A frame of MAVLink with a sound check sum around these bytes.
    pub fn message(&mut self, id: u32, payload: &[u8]) -> Vec<u8> {
        let mut room = [0; LONGEST];
        self.writer.write_payload::<MavMessage>(id, payload, &mut room).expect("it is short").to_vec()
    }

    /// An answer to this question.
    pub fn answer(&self, number: u16, payload: &Payload<'_>) -> Vec<u8> {
        frames(self.table, number, payload)
    }

    /// What is said of these.
    fn all(&self, payloads: impl IntoIterator<Item = Payload<'static>>) -> Vec<u8> {
        payloads.into_iter().flat_map(|payload| self.answer(0, &payload)).collect()
    }

    pub fn sample(&self, topic: usize, at: At, words: &[u32]) -> Vec<u8> {
        let words: Vec<_> = words.iter().map(|word| word.to_le_bytes()).collect();
        self.answer(0, &Payload::Sample(Sample::new(topic as u16, at, &words)))
    }

    /// Every parameter has this value.
    fn list(&self, value: f32) -> Vec<u8> {
        let indices = 0..parameters() as u16;
        self.all(indices.map(|index| Payload::Parameter { index, value, taken: true }))
    }

    /// The kinds of nonsense, each in words and as bytes.
    pub fn nonsense(&mut self, random: &mut ChaCha8Rng) -> Vec<(&'static str, Vec<u8>)> {
        let mut noise = vec![0; BLOCK];
        random.fill_bytes(&mut noise);
        let mut kinds = vec![
            ("random bytes", noise.clone()),
            ("random text", noise.iter().map(|byte| b' ' + byte % 94).collect()),
            ("text without an end", vec![b'A'; BLOCK]),
            ("lines without an end", b"a\n".repeat(BLOCK / 2)),
            ("beginnings of frames", [0xFD, 0xFE].repeat(BLOCK / 2)),
            ("frames that are longer than they say", [&[0xFD, 0, 0, 0, 0, 1, 1, 0x81, 1, 0][..], &[7; 300]].concat()),
            ("frames that are shorter than they say", b"\xfd\xff\0\0\0\x01\x01\x81\x01\0".repeat(BLOCK / 10)),
        ];
        let lengths = (0..=255_usize).flat_map(|length| [0, 22, 30, 77, 253, 385].map(|id| (id, vec![0xFF; length])));
        kinds.push(("messages of every length", lengths.flat_map(|(id, bytes)| self.message(id, &bytes)).collect()));
        kinds.push(("damaged payloads in sound frames", self.damaged(random)));
        let behind = (0..4_000).chain([u16::MAX]).map(|index| Payload::Parameter { index, value: 1.0, taken: true });
        kinds.push(("a list of parameters that does not end", self.all(behind)));
        kinds.push(("parameters that change without an end", [1.0, f32::MAX].map(|value| self.list(value)).concat()));
        kinds.push(("what is no number", self.no_numbers()));
        let times = [u64::MAX, 0, 1 << 53, 1, u64::MAX - 1].map(|at| self.sample(0, At::from_micros(at), &[0; 64]));
        kinds.push(("samples of no topic's length", times.concat()));
        kinds.push(("a clock that goes back", self.back()));
        kinds.push(("answers without a question", self.answers()));
        kinds
    }

    /// Payloads of every kind with some of their bytes changed.
    fn damaged(&mut self, random: &mut ChaCha8Rng) -> Vec<u8> {
        let text = "a line that is too long for one part".repeat(4);
        let words = [[0x7F; 4]; 40];
        let payloads = [
            Payload::Parameter { index: 3, value: 1.0, taken: true },
            Payload::Reply { text: &text, last: false },
            Payload::Notice { number: 7, text: &text },
            Payload::Sample(Sample::new(1, At::from_micros(5), &words)),
            Payload::Chunk(&[5; 300]),
            Payload::Acknowledgement { counter: 1, taken: true },
        ];
        let sound: Vec<_> = payloads.iter().flat_map(|payload| parts(self.table, 1, payload)).collect();
        let mut frames = Vec::new();
        while frames.len() < BLOCK {
            for part in &sound {
                let mut part = part.clone();
                for _ in 0..random.next_u32() % 8 {
                    let place = random.next_u32() as usize % part.len();
                    part[place] = random.next_u32() as u8;
                }
                frames.extend(tunnel(&mut self.writer, &part));
            }
        }
        frames
    }

    /// Samples of every topic, and of those that there are not, with words that are no numbers.
    fn no_numbers(&self) -> Vec<u8> {
        let mut frames = Vec::new();
        for topic in 0..2 * topics().len() {
            let count = topics().get(topic).map_or(9, |topic| topic.words);
            for (at, word) in (1..).zip([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0]) {
                frames.extend(self.sample(topic, At::from_micros(at), &vec![word.to_bits(); count]));
            }
            frames.extend(self.sample(topic, At::from_micros(9), &vec![u32::MAX; count]));
        }
        frames
    }

    /// The vehicle starts anew, and says all its parameters, again and again.
    fn back(&self) -> Vec<u8> {
        let words = vec![0; topics()[0].words];
        let times = [u64::MAX, 0, 1 << 62, 1_000_000, 1].map(At::from_micros);
        times.into_iter().flat_map(|at| [self.sample(0, at, &words), self.list(1.0)].concat()).collect()
    }

    fn answers(&mut self) -> Vec<u8> {
        let mut frames = Vec::new();
        for number in 0..200 {
            for payload in [
                Payload::Reply { text: "more", last: false },
                Payload::Reply { text: "", last: true },
                Payload::Part { number: number.into(), from: u16::MAX, text: "more", last: false },
                Payload::Acknowledgement { counter: u32::MAX, taken: false },
                Payload::Refusal { counter: number.into(), why: "no" },
                Payload::Parameter { index: u16::MAX, value: f32::MIN, taken: false },
                Payload::Tables { fingerprint: number },
                Payload::Chunk(b"no chunk"),
            ] {
                frames.extend(self.answer(number, &payload));
            }
            // COMMAND_ACK of a motor test, for everybody.
            frames.extend(self.message(77, &[209, 0, 4, 0, 0, 0, 0, 0, 0, 0]));
        }
        frames
    }
}
