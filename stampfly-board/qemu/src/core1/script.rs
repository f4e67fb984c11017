//! What the flight core is given during a flight: what its two chips answered, when their pin rose, what the other core published.
//!
//! Written on a PC, where the chips are emulated ([`Writer`]), read where there are none ([`Script`]). Numbers are little-endian.
//!
//! | part | an entry |
//! |---|---|
//! | head | magic, start, number of bytes of each part |
//! | image | the inertial sensor's configuration file |
//! | transfers | chip, whether the processor waited, length of what was read, a hash of what was written, when it ended, what was read |
//! | pin | when a task that waited saw it high |
//! | samples | when they came, their own instant, topic, words |

use stampfly_board::topics::TOPICS;
use stampfly_types::Instant;

const MAGIC: u32 = u32::from_le_bytes(*b"SFC1");

/// A hash of what a driver writes (FNV-1a): whether it says the same to its chip.
pub fn hash_of(bytes: impl Iterator<Item = u8>) -> u32 {
    bytes.fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}

/// A transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer<'s> {
    /// 0 is the inertial sensor, 1 the flow sensor.
    pub chip: u8,
    /// Did the processor wait for its end?
    pub blocked: bool,
    /// [Hash](hash_of) of what was written.
    pub wrote: u32,
    /// When it was over.
    pub ended: Instant,
    /// What was read.
    pub read: &'s [u8],
}

/// A sample of somebody else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample<'s> {
    /// When it came.
    pub came: Instant,
    /// The instant it is valid for.
    pub at: Instant,
    /// Its topic.
    pub topic: usize,
    /// Its words, as bytes.
    words: &'s [u8],
}

impl Sample<'_> {
    /// Its words.
    pub fn words(&self) -> impl Iterator<Item = u32> {
        self.words.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word))
    }
}

/// A part of a script, from which entries are taken.
#[derive(Clone, Copy)]
pub struct Part<'s>(&'s [u8]);

impl<'s> Part<'s> {
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (array, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*array)
    }

    fn bytes(&mut self, length: usize) -> Option<&'s [u8]> {
        let (bytes, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(bytes)
    }

    fn instant(&mut self) -> Option<Instant> {
        self.array().map(u64::from_le_bytes).map(Instant::from_micros)
    }

    /// Takes a transfer.
    pub fn transfer(&mut self) -> Option<Transfer<'s>> {
        let [chip, blocked, low, high] = self.array()?;
        let wrote = u32::from_le_bytes(self.array()?);
        let ended = self.instant()?;
        let read = self.bytes(usize::from(u16::from_le_bytes([low, high])))?;
        Some(Transfer { chip, blocked: blocked != 0, wrote, ended, read })
    }

    /// Takes an instant at which the pin was seen high.
    pub fn pin(&mut self) -> Option<Instant> {
        self.instant()
    }

    /// Takes a sample.
    pub fn sample(&mut self) -> Option<Sample<'s>> {
        let (came, at) = (self.instant()?, self.instant()?);
        let [topic] = self.array()?;
        let topic = usize::from(topic);
        let words = self.bytes(4 * TOPICS.get(topic)?.words)?;
        Some(Sample { came, at, topic, words })
    }
}

/// A script.
pub struct Script<'s> {
    /// When the vehicle was switched on.
    pub start: Instant,
    /// The inertial sensor's configuration file.
    pub image: &'s [u8],
    /// Transfers on the SPI.
    pub transfers: Part<'s>,
    /// When the pin was seen high.
    pub pin: Part<'s>,
    /// Samples of everybody else.
    pub samples: Part<'s>,
}

impl<'s> Script<'s> {
    /// Opens a script. `None` when it is none.
    pub fn open(bytes: &'s [u8]) -> Option<Self> {
        let mut rest = Part(bytes);
        (u32::from_le_bytes(rest.array()?) == MAGIC).then_some(())?;
        let start = rest.instant()?;
        let [image, transfers, pin, samples] =
            [(); 4].map(|()| rest.array().map(u32::from_le_bytes).unwrap_or(u32::MAX) as usize);
        Some(Self {
            start,
            image: rest.bytes(image)?,
            transfers: Part(rest.bytes(transfers)?),
            pin: Part(rest.bytes(pin)?),
            samples: Part(rest.bytes(samples)?),
        })
    }
}

/// Writes a script.
#[cfg(not(target_os = "none"))]
#[derive(Default)]
#[allow(dead_code, reason = "by the program that records")]
pub struct Writer {
    transfers: Vec<u8>,
    pin: Vec<u8>,
    samples: Vec<u8>,
}

#[cfg(not(target_os = "none"))]
#[allow(dead_code, reason = "by the program that records")]
impl Writer {
    /// A transfer.
    pub fn transfer(&mut self, transfer: &Transfer<'_>) {
        let Transfer { chip, blocked, wrote, ended, read } = transfer;
        self.transfers.extend([*chip, u8::from(*blocked)]);
        self.transfers.extend((read.len() as u16).to_le_bytes());
        self.transfers.extend(wrote.to_le_bytes());
        self.transfers.extend(ended.as_micros().to_le_bytes());
        self.transfers.extend(*read);
    }

    /// The pin was seen high.
    pub fn pin(&mut self, at: Instant) {
        self.pin.extend(at.as_micros().to_le_bytes());
    }

    /// A sample of this topic came.
    pub fn sample(&mut self, came: Instant, at: Instant, topic: usize, words: &[u32]) {
        self.samples.extend(came.as_micros().to_le_bytes());
        self.samples.extend(at.as_micros().to_le_bytes());
        self.samples.push(topic as u8);
        self.samples.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    }

    /// The script.
    pub fn finish(self, start: Instant, image: &[u8]) -> Vec<u8> {
        let parts = [image, &self.transfers, &self.pin, &self.samples];
        let mut script = MAGIC.to_le_bytes().to_vec();
        script.extend(start.as_micros().to_le_bytes());
        script.extend(parts.iter().flat_map(|part| (part.len() as u32).to_le_bytes()));
        script.extend(parts.concat());
        script
    }
}
