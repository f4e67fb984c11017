//! The flight core's compact record: what it streams is printed at the end, and replayed on a PC. `cargo xtask record`.

use crate::machine::{self, Ticks};
use core::cell::{Cell, RefCell};
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::Id;
use stampfly_bus::{Activation, Band};
use stampfly_flight::compact::{Compact, Kept, MAGIC, Ring, Streamer, Watching};
use stampfly_flight::flight_loop::{Ended, Positions};
use stampfly_flight::{FlightLoop, Observer};
use stampfly_types::{Duration, Instant};
use static_cell::StaticCell;

/// Words between the core that flies and the one that streams, as in the firmware: a key frame, and a tenth of a second beside it.
const WORDS: usize = 4 * 1024;
/// Bytes that the emulated board keeps of what was streamed.
const MEMORY: usize = 2 * 1024 * 1024;
/// A datagram.
const CHUNK: usize = 1024;
/// Bytes in a printed line.
const LINE: usize = 64;
/// One sample in so many passes of what runnables publish is kept for comparison.
const KEPT: Kept<'_> = Kept {
    topics: &[
        Id::actuator_motor as usize,
        Id::control_output as usize,
        Id::flight_status as usize,
        Id::estimate_state as usize,
    ],
    every: 80,
    key_frames: Duration::from_secs(10),
};

type Record = Compact<'static, 'static, Runnables, WORDS>;

static SHARED: Shared = Shared { record: Cell::new(None), cost: Cost::new() };

/// What is printed at the end.
struct Shared {
    record: Cell<Option<&'static RefCell<Record>>>,
    cost: Cost,
}

/// Instructions.
struct Cost {
    /// For the record, in this pass of the flight band, and altogether, the background's and looking for nothing included.
    recording: Cell<u64>,
    recordings: Cell<u64>,
    /// The most for the record in a pass of the flight band, key frames apart.
    most: Cell<u64>,
    /// Passes of the flight band, without the record.
    chain: Cell<u64>,
    passes: Cell<u64>,
    /// When the pass began.
    begun: Cell<Option<Ticks>>,
    /// Key frames, and the dearest.
    frames: Cell<u64>,
    frame: Cell<u64>,
    bytes: Cell<usize>,
    /// What looking at the counter takes by itself.
    looking: Cell<u64>,
}

impl Cost {
    const fn new() -> Self {
        let [recording, recordings, most, chain, passes, frames, frame, looking] = [const { Cell::new(0) }; 8];
        let (begun, bytes) = (Cell::new(None), Cell::new(0));
        Self { recording, recordings, most, chain, passes, begun, frames, frame, bytes, looking }
    }

    fn of_record<T>(&self, what: impl FnOnce() -> T) -> T {
        let begun = machine::ticks();
        let result = what();
        let ticks = begun.until(machine::ticks()).saturating_sub(self.looking.get());
        self.recording.set(self.recording.get() + ticks);
        self.recordings.set(self.recordings.get() + ticks);
        result
    }

    /// A pass is over, of the record too.
    fn pass(&self) {
        if let Some(begun) = self.begun.take() {
            let (all, recording) = (begun.until(machine::ticks()), self.recording.get());
            self.chain.set(self.chain.get() + all.saturating_sub(recording));
            self.passes.set(self.passes.get() + 1);
            self.most.set(self.most.get().max(recording));
        }
    }
}

/// Observes for the record, and counts what that takes.
#[derive(Clone, Copy)]
pub struct Counted(pub &'static RefCell<Record>);

impl Observer for Counted {
    fn pass_begins(&mut self, band: Band, clock: Instant) {
        if band == Band::Flight {
            SHARED.cost.recording.set(0);
            SHARED.cost.begun.set(Some(machine::ticks()));
        }
        SHARED.cost.of_record(|| Watching(self.0).pass_begins(band, clock));
    }

    fn finished(&mut self, activation: &Activation) {
        SHARED.cost.of_record(|| Watching(self.0).finished(activation));
    }

    fn pass_ends(&mut self, band: Band, ended: Ended, positions: &mut dyn Positions) {
        SHARED.cost.of_record(|| Watching(self.0).pass_ends(band, ended, positions));
    }

    fn resumes(&mut self, index: usize) {
        Watching(self.0).resumes(index);
    }
}

// SAFETY: this machine has one core and no interrupts.
#[expect(unsafe_code, reason = "one core, no interrupts")]
unsafe impl Sync for Shared {}

/// The flight core's half.
pub struct Writer {
    record: &'static RefCell<Record>,
}

/// The other core's half: takes the record out of the ring.
pub struct Reader {
    streamer: Streamer<'static, WORDS>,
    bytes: &'static mut [u8; MEMORY],
    used: usize,
}

/// At power-on.
pub fn begin(flight_loop: &FlightLoop<'static, Runnables>) -> (Writer, Reader) {
    static RING: StaticCell<Ring<WORDS>> = StaticCell::new();
    static RECORD: StaticCell<RefCell<Record>> = StaticCell::new();
    static BYTES: StaticCell<[u8; MEMORY]> = StaticCell::new();
    let (writer, reader) = RING.init_with(Ring::new).split();
    let record = RECORD.init_with(|| RefCell::new(Compact::new(writer, flight_loop.heads(), "stampfly", KEPT)));
    SHARED.record.set(Some(record));
    let look = |_| machine::ticks().until(machine::ticks());
    SHARED.cost.looking.set((0..16).map(look).min().unwrap_or(0));
    let bytes = BYTES.init_with(|| [0; MEMORY]);
    if let Some(magic) = bytes.first_chunk_mut() {
        *magic = MAGIC;
    }
    let reader = Reader { streamer: Streamer::new(reader), bytes, used: MAGIC.len() };
    (Writer { record }, reader)
}

impl Writer {
    /// The record, for the observer.
    pub const fn shared(&self) -> &'static RefCell<Record> {
        self.record
    }

    /// A pass is over.
    pub fn pass(&mut self, flight_loop: &FlightLoop<'_, Runnables>) {
        let cost = &SHARED.cost;
        cost.pass();
        let mut record = self.record.borrow_mut();
        if record.wants_key_frame() {
            let begun = machine::ticks();
            let length = record.key_frame(flight_loop);
            let ticks = begun.until(machine::ticks());
            cost.frames.set(cost.frames.get() + ticks);
            cost.frame.set(cost.frame.get().max(ticks));
            cost.bytes.set(length.unwrap_or(cost.bytes.get()));
        }
    }
}

impl Reader {
    /// Takes what fills a datagram.
    pub fn take(&mut self, least: usize) {
        while let Some((head, room)) = self.bytes.get_mut(self.used..).and_then(<[u8]>::split_first_chunk_mut::<2>) {
            let room = room.get_mut(..CHUNK).unwrap_or_default();
            let Some(length) = self.streamer.chunk(room, least) else { break };
            *head = (length as u16).to_le_bytes();
            self.used += 2 + length;
        }
    }

    /// What fills most of a datagram.
    pub fn take_datagrams(&mut self) {
        self.take(CHUNK / 2);
    }

    /// Prints it all.
    pub fn print(&mut self) {
        self.take(1);
        let bytes = self.bytes.get(..self.used).unwrap_or_default();
        let mut line = heapless::String::<{ 2 * LINE }>::new();
        for (place, byte) in bytes.iter().enumerate() {
            for digit in [byte >> 4, byte & 15] {
                _ = line.push(char::from_digit(digit.into(), 16).unwrap_or('?'));
            }
            if place % LINE == LINE - 1 {
                outln!("record {line}");
                line.clear();
            }
        }
        outln!("record {line}");
        let Some(record) = SHARED.record.get() else { return };
        let Cost { recordings, most, chain, passes, frames, frame, bytes: frame_bytes, .. } = &SHARED.cost;
        let of = |all: u64| machine::instructions(all) / passes.get().max(1);
        outln!(
            "instructions of a pass: chain {} record {} of {} passes; of it key frames {}; record at most {}, key frame of {} bytes at most {}",
            of(chain.get()),
            of(recordings.get() + frames.get()),
            passes.get(),
            of(frames.get()),
            machine::instructions(most.get()),
            frame_bytes.get(),
            machine::instructions(frame.get())
        );
        outln!("compact: {} bytes, {} lost", self.used, record.borrow().lost());
    }
}
