//! Who is sent the compact flight record: one station at a time, as long as it says that it wants it.
//!
//! The record comes out of the flight core's ring chunk by chunk, and there is one of it. Whoever asks first has it, and has to ask again every few seconds; a
//! station that is gone leaves it to the next. As long as nobody asks, nothing is recorded. Not for a log of samples: a station watches topics for that.

use stampfly_flight::compact::Chunks;
use stampfly_link::secure::MAX_BODY;
use stampfly_types::{Duration, Instant};

/// A station that has not asked again for this long is gone.
const SILENCE: Duration = Duration::from_secs(5);

/// Chunks in a turn of a radio of 20 ms, a frame each: 40 kB a second, where a flight has 28. What the air does not take finds no room in the ring, and is counted there.
pub const RADIO_CHUNKS: usize = 4;

/// A chunk of at least this length is sent by a radio: its packet is nearly full.
pub const RADIO_CHUNK: usize = MAX_BODY - 32;

/// Who has the record. `T` tells the lines of a vehicle apart.
///
/// ```
/// use stampfly_flight::compact::{Ring, Streamer};
/// use stampfly_services::Tape;
/// use stampfly_types::Instant;
/// let mut ring = Ring::<16>::new();
/// let (mut writer, reader) = ring.split();
/// let (mut streamer, mut tape, mut room) = (Streamer::new(reader), Tape::new(), [0; 64]);
/// tape.poll(Instant::ZERO, &mut streamer);
/// assert!(!writer.is_wanted());
///
/// assert!(tape.ask(Instant::ZERO, "cable", true) && !tape.ask(Instant::ZERO, "radio", true));
/// tape.poll(Instant::ZERO, &mut streamer);
/// assert!(writer.is_wanted());
/// writer.word(7);
/// writer.commit();
/// assert_eq!(tape.chunk("radio", &mut streamer, &mut room, 1), None);
/// assert!(tape.chunk("cable", &mut streamer, &mut room, 1).is_some());
///
/// tape.poll(Instant::from_millis(5_000), &mut streamer);
/// assert!(!writer.is_wanted() && tape.ask(Instant::from_millis(5_000), "radio", true));
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Tape<T> {
    taker: Option<(T, Instant)>,
}

impl<T: Copy + PartialEq> Tape<T> {
    /// Nobody has it.
    #[must_use]
    pub const fn new() -> Self {
        Self { taker: None }
    }

    /// Whoever is at this line wants the record, or does not want it any more. Is it theirs now?
    pub fn ask(&mut self, now: Instant, line: T, wanted: bool) -> bool {
        if self.taker.is_some_and(|(taker, _)| taker != line) {
            return false;
        }
        self.taker = wanted.then_some((line, now));
        wanted
    }

    /// Whose it is.
    #[must_use]
    pub fn line(&self) -> Option<T> {
        self.taker.map(|(line, _)| line)
    }

    /// Tells the flight core whether there is somebody. Call it at least ten times a second.
    pub fn poll(&mut self, now: Instant, chunks: &mut dyn Chunks) {
        self.taker = self.taker.filter(|(_, at)| now.since(*at) < SILENCE);
        chunks.want(self.taker.is_some());
    }

    /// The next chunk for this line, as long as `room`. `None` when it is not theirs, or there are less than `least` bytes.
    pub fn chunk<'r>(&self, line: T, chunks: &mut dyn Chunks, room: &'r mut [u8], least: usize) -> Option<&'r [u8]> {
        self.taker.filter(|(taker, _)| *taker == line)?;
        let length = chunks.next(room, least)?;
        room.get(..length)
    }
}
