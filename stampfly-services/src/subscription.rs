//! Streams the compact flight record to one station at a time; the station must renew its request.
//!
//! There is one record: the chunks that come out of the flight core's ring. The first station that
//! requests it gets it, and keeps it until it stops renewing. Without a request nothing is recorded.
//! For samples of single topics a station watches topics instead.

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
/// use stampfly_services::RecordSubscription;
/// use stampfly_types::Instant;
/// let mut ring = Ring::<16>::new();
/// let (mut writer, reader) = ring.split();
/// let (mut streamer, mut subscription, mut room) = (Streamer::new(reader), RecordSubscription::new(), [0; 64]);
/// subscription.poll(Instant::ZERO, &mut streamer);
/// assert!(!writer.is_wanted());
///
/// assert!(subscription.ask(Instant::ZERO, "cable", true) && !subscription.ask(Instant::ZERO, "radio", true));
/// subscription.poll(Instant::ZERO, &mut streamer);
/// assert!(writer.is_wanted());
/// writer.word(7);
/// writer.commit();
/// assert_eq!(subscription.chunk("radio", &mut streamer, &mut room, 1), None);
/// assert!(subscription.chunk("cable", &mut streamer, &mut room, 1).is_some());
///
/// subscription.poll(Instant::from_millis(5_000), &mut streamer);
/// assert!(!writer.is_wanted() && subscription.ask(Instant::from_millis(5_000), "radio", true));
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct RecordSubscription<T> {
    taker: Option<(T, Instant)>,
}

impl<T: Copy + PartialEq> RecordSubscription<T> {
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
