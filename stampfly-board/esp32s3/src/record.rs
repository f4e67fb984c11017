//! The compact flight record on its way from the core that flies to whoever asks for it: over USB, or by radio.
//!
//! With the feature `record`. Nothing is recorded as long as nobody asks. The ring holds a key frame and a tenth of a second beside it, which the other core takes out as it comes; what
//! finds no room is lost, and counted, and the record goes on from the next key frame.

use core::cell::RefCell;
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::Id;
use stampfly_flight::compact::{Compact, Kept, Ring, RingReader, RingWriter, Streamer};
use stampfly_services::RecordSubscription;
use stampfly_types::{Duration, Instant};
use static_cell::ConstStaticCell;

/// Is there a record? It takes memory that the black box has otherwise.
const IS_THERE: bool = cfg!(feature = "record");
/// A key frame has some 14 kB, a second in the air 28.
const WORDS: usize = if IS_THERE { 4 * 1024 } else { 2 };
/// By what a replay is judged. A key frame takes 0.7 ms right after the motors were written, so there are few.
pub const KEPT: Kept<'_> = Kept {
    topics: &[
        Id::actuator_motor as usize,
        Id::control_output as usize,
        Id::flight_status as usize,
        Id::estimate_state as usize,
    ],
    every: 80,
    key_frames: Duration::from_secs(10),
};
/// Of the vehicle, as programs on a PC know it.
pub const NAME: &str = "stampfly";

/// The flight core's half.
pub type Record = Compact<'static, 'static, Runnables, WORDS>;
/// What it writes into.
pub type Writer = RingWriter<'static, WORDS>;

/// Where a station is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// At the USB port.
    Cable,
    /// On the radio, with the key.
    Radio,
}

/// The other core's half: who has the record, and what comes out of the ring.
pub struct Taken {
    subscription: RecordSubscription<Line>,
    streamer: Streamer<'static, WORDS>,
}

/// The two ends of the ring. Once only.
pub fn ring() -> (Writer, RingReader<'static, WORDS>) {
    static RING: ConstStaticCell<Ring<WORDS>> = ConstStaticCell::new(Ring::new());
    RING.take().split()
}

impl Taken {
    /// Nobody has it yet.
    pub fn new(mut reader: RingReader<'static, WORDS>) -> RefCell<Self> {
        reader.want(false);
        RefCell::new(Self { subscription: RecordSubscription::new(), streamer: Streamer::new(reader) })
    }

    /// What a station has said of it, if it has.
    pub fn ask(&mut self, now: Instant, line: Line, wanted: Option<bool>) {
        if let Some(wanted) = wanted.filter(|_| IS_THERE) {
            self.subscription.ask(now, line, wanted);
        }
    }

    /// Tells the flight core whether somebody wants it.
    pub fn poll(&mut self, now: Instant) {
        self.subscription.poll(now, &mut self.streamer);
    }

    /// The next chunk for a station there, of at least so many bytes.
    pub fn chunk<'r>(&mut self, line: Line, room: &'r mut [u8], least: usize) -> Option<&'r [u8]> {
        self.subscription.chunk(line, &mut self.streamer, room, least)
    }
}
