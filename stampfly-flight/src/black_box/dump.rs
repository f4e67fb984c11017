//! A recording as text: a log in hexadecimal digits, which every terminal transmits, and a last line that counts them.

use super::{Changed, Record};
use core::cell::RefCell;
use core::fmt::{self, Write};
use heapless::{String, Vec};
use stampfly_log::ulog::{Full, Sample, Schema, Sink, WriteError, Writer};
use stampfly_types::Instant;

/// Bytes of the log in a line.
const LINE: usize = 32;
/// Bytes of the log that are made at once. A sample is shorter: a message of at most 64 words, with its head.
const PIECE: usize = 512;

/// The terminal did not take a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused;

/// How much was sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dumped {
    /// Lines, without the last one that counts them.
    pub lines: u32,
    /// Bytes of the log in them.
    pub bytes: usize,
    /// Records that could not be written as samples.
    pub left_out: u32,
}

/// Why a dump ended early, and after how much.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DumpError {
    /// Nothing is recorded.
    Empty,
    /// The log could not be opened.
    Unwritable,
    /// The terminal took no more.
    Refused(Dumped),
    /// The vehicle was armed, or recorded for another reason.
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
            Self::Empty => f.write_str("no flight recorded"),
            Self::Unwritable => f.write_str("the log cannot be written"),
            Self::Refused(dumped) => write!(f, "INCOMPLETE log, the terminal was too slow: {dumped}"),
            Self::Changed(dumped) => write!(f, "INCOMPLETE log, a new flight has begun: {dumped}"),
        }
    }
}

impl core::error::Error for DumpError {}

/// Sends a recording as a log, line by line, to `show`; each line ends with a carriage return and a line feed.
///
/// `next` gives the records, oldest first. `open` starts the vehicle's log, with whatever explains it: topics, parameters,
/// firmware. It is called several times and must write the same each time: half a kilobyte is made at a time, so that no
/// memory is needed for the log. The last line is `end of log: ` and how many lines and bytes came before it.
///
/// ```
/// # mod rover { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/flight/common/mod.rs")); }
/// use rover::topics; // the rover of `tests/flight/common`
/// use stampfly_flight::black_box::{BlackBox, LogRate, Retention, dump};
/// use stampfly_log::ulog::{Definitions, Topic};
/// use stampfly_types::{Instant, messages::TofData, Message};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// const RETENTION: Retention =
///     Retention { topics: &topics::TOPICS, rate: |_| LogRate::EverySample, armed: |_, _| Some(true) };
/// let log_topics = topics::TOPICS.map(|info| Topic { name: info.name, fields: info.fields });
/// let mut black_box = BlackBox::<256, { topics::COUNT }>::new(RETENTION);
/// black_box.note(topics::Id::sensor_range as usize, Instant::from_millis(1), 1, &TofData::default().to_words());
///
/// let (mut cursor, mut text) = (black_box.begin(), String::new());
/// let finished = dump(
///     || black_box.next(&mut cursor),
///     |sink, at| Definitions::start(sink, at)?.data(&log_topics[..]),
///     async |line| Ok(text.push_str(line)),
/// );
/// # use std::{future::Future, pin::pin, task::{Context, Poll, Waker}};
/// # let Poll::Ready(result) = pin!(finished).poll(&mut Context::from_waker(Waker::noop())) else { panic!() };
/// # result?; // finished.await?;
/// assert!(text.starts_with("554c6f67"), "ULog");
/// assert!(text.lines().last().unwrap().starts_with("end of log: "));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// When nothing is recorded, the terminal takes no more, or the recording changes meanwhile. What was sent by then is the
/// beginning of a log.
///
/// # Cancellation
/// Dropping the future leaves the terminal with the beginning of a log and no last line. Nothing else is affected.
pub async fn dump<T: Schema>(
    mut next: impl FnMut() -> Result<Option<Record>, Changed>,
    mut open: impl for<'b> FnMut(DumpSink<'b>, Instant) -> Result<Writer<DumpSink<'b>, T>, WriteError<Full>>,
    show: impl AsyncFnMut(&str) -> Result<(), Refused>,
) -> Result<(), DumpError> {
    let mut lines = Lines { show, pending: Vec::new(), dumped: Dumped::default() };
    let mut record = next().ok().flatten().ok_or(DumpError::Empty)?;
    let bytes = RefCell::new(Vec::new());
    let mut made = 0;
    // The head of a log is much longer than a piece: it is made again for each piece, and what came before is skipped.
    // One place for it: a future keeps each that it has across a wait.
    let mut log = None;
    while log.is_none() {
        begin(&mut open, DumpSink { skip: made, bytes: &bytes }, record.at, &mut log)?;
        let piece = bytes.take();
        if log.is_none() && piece.is_empty() {
            return Err(DumpError::Unwritable);
        }
        made += piece.len();
        lines.send(&piece).await?;
    }
    loop {
        let sample = Sample { at: record.at, generation: record.generation, words: &record.words };
        if log.as_mut().is_none_or(|log| log.sample(record.topic, &sample).is_err()) {
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

/// Makes a piece of the head of a log, or with the last piece the log. Apart, so that a log on its way to its place is on the stack no longer than that takes.
#[inline(never)]
fn begin<'b, T: Schema>(
    open: &mut impl FnMut(DumpSink<'b>, Instant) -> Result<Writer<DumpSink<'b>, T>, WriteError<Full>>,
    sink: DumpSink<'b>,
    at: Instant,
    log: &mut Option<Writer<DumpSink<'b>, T>>,
) -> Result<(), DumpError> {
    match open(sink, at) {
        Ok(begun) => *log = Some(begun),
        Err(WriteError::Sink(Full)) => {}
        Err(_) => return Err(DumpError::Unwritable),
    }
    Ok(())
}

/// Collects one piece of a log: skips what was sent before, and refuses what does not fit.
pub struct DumpSink<'b> {
    skip: usize,
    bytes: &'b RefCell<Vec<u8, PIECE>>,
}

impl Sink for DumpSink<'_> {
    type Error = Full;

    fn write(&mut self, bytes: &[u8]) -> Result<(), Full> {
        let wanted = bytes.get(self.skip..).unwrap_or_default();
        self.skip = self.skip.saturating_sub(bytes.len());
        let mut piece = self.bytes.try_borrow_mut().map_err(|_| Full)?;
        let fits = wanted.len().min(PIECE - piece.len());
        piece.extend_from_slice(wanted.get(..fits).unwrap_or_default()).map_err(|_| Full)?;
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
