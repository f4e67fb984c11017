//! One serial line for people and programs: which bytes are typed text, and which are frames of MAVLink.
//!
//! A frame begins with a byte that no text has: 0xFD and 0xFE are in no UTF-8, and no terminal sends them for a key. Its header says how long it
//! is, and what comes after it is text again. Whether the frame is sound, its decoder says; here a wrong one costs at most the text that its header claims, or
//! as much as comes within [`PAUSE`] of it.
//!
//! Layouts are from [MAVLink's description](https://mavlink.io/en/guide/serialization.html). Not for lines that carry MAVLink alone: a decoder finds its frames by itself.

use stampfly_types::{Duration, Instant};

/// First byte of a frame of version 1, and of version 2.
const STX: [u8; 2] = [0xFE, 0xFD];
/// Bytes of a frame around its payload, of version 1 and 2: header, checksum.
const AROUND: [u16; 2] = [8, 12];
/// A signature of version 2, which a bit of the third byte announces.
const SIGNATURE: u16 = 13;
const SIGNED: u8 = 1;
/// Programs write a frame at once. After a pause of this length within one, it was none: what comes is text again.
pub const PAUSE: Duration = Duration::from_millis(100);

/// What a byte belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// What a person has typed.
    Text,
    /// A frame.
    Frame,
}

/// Tells text from frames, byte by byte.
///
/// ```
/// use stampfly_services::cable::{Part, Split};
/// use stampfly_types::Instant;
/// let mut split = Split::new();
/// let line = [b"status\r".as_slice(), &[0xFE, 1, 0, 1, 1, 0, b'x', 0, 0], b"help\r"].concat();
/// let text: Vec<u8> = line.iter().copied().filter(|byte| split.feed(Instant::ZERO, *byte) == Part::Text).collect();
/// assert_eq!(text, b"status\rhelp\r");
/// ```
#[derive(Clone, Debug, Default)]
pub struct Split {
    /// Bytes of the frame so far; zero in text.
    count: u16,
    /// Bytes that it has, as far as is known.
    length: u16,
    /// Its version's place.
    version: usize,
    heard: Instant,
}

impl Split {
    /// In text.
    #[must_use]
    pub const fn new() -> Self {
        Self { count: 0, length: 0, version: 0, heard: Instant::ZERO }
    }

    /// Takes a byte.
    pub fn feed(&mut self, now: Instant, byte: u8) -> Part {
        if now.since(self.heard) >= PAUSE {
            self.count = 0;
        }
        self.heard = now;
        match (self.count, self.version) {
            (0, _) => {
                let Some(version) = STX.iter().position(|first| *first == byte) else { return Part::Text };
                (self.version, self.length) = (version, u16::MAX);
            }
            (1, version) => self.length = u16::from(byte) + AROUND.get(version).copied().unwrap_or_default(),
            (2, 1) if byte & SIGNED != 0 => self.length += SIGNATURE,
            _ => {}
        }
        self.count += 1;
        if self.count >= self.length {
            self.count = 0;
        }
        Part::Frame
    }
}
