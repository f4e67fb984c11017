//! The log as text: hexadecimal digits, which every terminal lets through, and a last line that tells how many they were.

use super::{Changed, Record, open};
use crate::VehicleConfig;
use core::cell::RefCell;
use core::fmt::{self, Write};
use heapless::{String, Vec};
use stampfly_log::ulog::{Full, Level, Sample, Sink, WriteError};

/// Bytes of the log in a line.
const LINE: usize = 32;
/// Bytes of the log that are made at once.
const PIECE: usize = 512;

/// The terminal did not take a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused;

/// How much was sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dumped {
    /// Lines, but for the last one that tells of them.
    pub lines: u32,
    /// Bytes of the log in them.
    pub bytes: usize,
    /// Samples that were no samples.
    pub left_out: u32,
}

/// Why the log ended early, and after how much.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DumpError {
    /// Nothing is remembered.
    Empty,
    /// The log could not be begun.
    Unwritable,
    /// The terminal takes no more.
    Refused(Dumped),
    /// The vehicle was armed.
    Changed(Dumped),
}

impl fmt::Display for Dumped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} lines, {} bytes", self.lines, self.bytes)?;
        if self.left_out > 0 {
            write!(f, ", {} damaged samples left out", self.left_out)?;
        }
        Ok(())
    }
}

impl fmt::Display for DumpError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => f.write_str("no flight yet"),
            Self::Unwritable => f.write_str("the log cannot be written"),
            Self::Refused(dumped) => write!(f, "INCOMPLETE log, the terminal was too slow: {dumped}"),
            Self::Changed(dumped) => write!(f, "INCOMPLETE log, a new flight has begun: {dumped}"),
        }
    }
}

impl core::error::Error for DumpError {}

/// Sends the log of what `next` tells, line by line, to `show`; each line ends with a carriage return and a line feed.
///
/// `config` is what the vehicle has flown with, `version` says which firmware it was. Half a kilobyte is made at a time, so
/// this needs no room for the log. The last line is `end of log: ` and how many lines and bytes came before it.
///
/// ```
/// use stampfly_board::black_box::{BlackBox, dump};
/// use stampfly_board::{VehicleConfig, wiring};
/// use stampfly_drivers::blocking::block_on;
/// use stampfly_types::messages::SystemMode;
/// use stampfly_types::{Instant, Message};
/// let mut black_box = BlackBox::<256>::new();
/// let armed = SystemMode { armed: true, ..Default::default() };
/// black_box.note(wiring::Id::system_mode, Instant::from_micros(1_000), 1, &armed.to_words());
///
/// let (mut cursor, mut text) = (black_box.begin(), String::new());
/// let show = async |line: &str| {
///     text.push_str(line);
///     Ok(())
/// };
/// block_on(dump(|| black_box.next(&mut cursor), &VehicleConfig::default(), "1.0", show))?;
/// assert!(text.starts_with("554c6f67"), "ULog");
/// assert!(text.lines().last().unwrap().starts_with("end of log: "));
/// # Ok::<(), stampfly_board::black_box::DumpError>(())
/// ```
///
/// # Errors
/// When nothing is remembered, the terminal takes no more, or a new flight has begun meanwhile. What was sent then is the
/// beginning of a log.
pub async fn dump(
    mut next: impl FnMut() -> Result<Option<Record>, Changed>,
    config: &VehicleConfig,
    version: &str,
    show: impl AsyncFnMut(&str) -> Result<(), Refused>,
) -> Result<(), DumpError> {
    let mut lines = Lines { show, pending: Vec::new(), dumped: Dumped::default() };
    let mut record = next().ok().flatten().ok_or(DumpError::Empty)?;
    let bytes = RefCell::new(Vec::new());
    let mut made = 0;
    // The head is much longer than a piece. It is made again and again, each time from another place on.
    let mut log = loop {
        let begun = open(Window { skip: made, bytes: &bytes }, record.at, config)
            .and_then(|mut log| log.text(Level::Info, record.at, version).map(|()| log));
        let piece = bytes.take();
        made += piece.len();
        lines.send(&piece).await?;
        match begun {
            Ok(log) => break log,
            Err(WriteError::Sink(Full)) if !piece.is_empty() => {}
            Err(_) => return Err(DumpError::Unwritable),
        }
    };
    loop {
        let sample = Sample { at: record.at, generation: record.generation, words: record.words() };
        if log.sample(record.topic, &sample).is_err() {
            lines.dumped.left_out += 1;
        }
        lines.send(&bytes.take()).await?;
        match next() {
            Ok(Some(following)) => record = following,
            Ok(None) => return lines.end().await,
            Err(Changed) => return Err(DumpError::Changed(lines.dumped)),
        }
    }
}

/// Collects the bytes of a log from a place on, until its room is full.
struct Window<'b> {
    skip: usize,
    bytes: &'b RefCell<Vec<u8, PIECE>>,
}

impl Sink for Window<'_> {
    type Error = Full;

    fn write(&mut self, bytes: &[u8]) -> Result<(), Full> {
        let wanted = bytes.get(self.skip..).unwrap_or_default();
        self.skip = self.skip.saturating_sub(bytes.len());
        // Nobody looks into it while it is written.
        let mut room = self.bytes.try_borrow_mut().map_err(|_| Full)?;
        let fits = wanted.len().min(PIECE - room.len());
        room.extend_from_slice(wanted.get(..fits).unwrap_or_default()).map_err(|_| Full)?;
        if fits == wanted.len() { Ok(()) } else { Err(Full) }
    }
}

/// Bytes → lines of digits.
struct Lines<S> {
    show: S,
    pending: Vec<u8, LINE>,
    dumped: Dumped,
}

impl<S: AsyncFnMut(&str) -> Result<(), Refused>> Lines<S> {
    async fn send(&mut self, bytes: &[u8]) -> Result<(), DumpError> {
        for byte in bytes {
            if self.pending.push(*byte).is_err() {
                self.flush().await?;
                let _ = self.pending.push(*byte);
            }
        }
        Ok(())
    }

    async fn flush(&mut self) -> Result<(), DumpError> {
        let mut line = String::<{ 2 * LINE + 2 }>::new();
        for byte in &self.pending {
            let _ = write!(line, "{byte:02x}");
        }
        let _ = line.push_str("\r\n");
        (self.show)(&line).await.map_err(|Refused| DumpError::Refused(self.dumped))?;
        self.dumped.lines += 1;
        self.dumped.bytes += self.pending.len();
        self.pending.clear();
        Ok(())
    }

    async fn end(mut self) -> Result<(), DumpError> {
        if !self.pending.is_empty() {
            self.flush().await?;
        }
        let mut line = String::<96>::new();
        let _ = write!(line, "end of log: {}\r\n", self.dumped);
        (self.show)(&line).await.map_err(|Refused| DumpError::Refused(self.dumped))
    }
}
