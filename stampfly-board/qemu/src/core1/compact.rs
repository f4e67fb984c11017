//! The flight core's compact record: what it holds at the end is printed, and replayed on a PC. `cargo xtask record`.

use crate::machine::{self, Ticks};
use core::cell::{Cell, RefCell};
use stampfly_board::schedule::{ACTIVATIONS, Runnables};
use stampfly_board::topics::{COUNT, Id, TOPICS};
use stampfly_bus::{Activation, Band};
use stampfly_flight::compact::{Compact, Ring, Watching};
use stampfly_flight::{FlightLoop, Observer, key_frame};
use stampfly_types::{Duration, Instant};
use static_cell::StaticCell;

/// Bytes that the emulated board has for it.
const MEMORY: usize = 1024 * 1024;
/// Room for a key frame.
const FRAME: usize = 64 * 1024;
/// Between two key frames.
const PERIOD: Duration = Duration::from_secs(6);
/// Bytes in a printed line.
const LINE: usize = 64;

type Record = Compact<Ring<'static>, COUNT, { ACTIVATIONS.len() }>;

static RECORD: StaticCell<RefCell<Record>> = StaticCell::new();
static SHARED: Shared = Shared { record: Cell::new(None), cost: Cost::new() };

/// What is printed at the end.
struct Shared {
    record: Cell<Option<&'static RefCell<Record>>>,
    cost: Cost,
}

/// Instructions.
struct Cost {
    /// For the record, since the pass began, and in all passes.
    recording: Cell<u64>,
    recordings: Cell<u64>,
    /// Passes of the flight band, without the record.
    chain: Cell<u64>,
    passes: Cell<u64>,
    /// When the pass began.
    begun: Cell<Option<Ticks>>,
    /// The dearest key frame.
    frame: Cell<u64>,
}

impl Cost {
    const fn new() -> Self {
        let [recording, recordings, chain, passes, frame] = [const { Cell::new(0) }; 5];
        Self { recording, recordings, chain, passes, begun: Cell::new(None), frame }
    }

    fn of_record<T>(&self, what: impl FnOnce() -> T) -> T {
        let begun = machine::ticks();
        let result = what();
        self.recording.set(self.recording.get() + begun.until(machine::ticks()));
        result
    }

    /// A pass is over, of the record too.
    fn pass(&self) {
        let recording = self.recording.take();
        if let Some(begun) = self.begun.take() {
            let all = begun.until(machine::ticks());
            self.chain.set(self.chain.get() + all.saturating_sub(recording));
            self.passes.set(self.passes.get() + 1);
        }
        self.recordings.set(self.recordings.get() + recording);
    }
}

/// Observes for the record, and counts what that takes.
#[derive(Clone, Copy)]
pub struct Counted(pub &'static RefCell<Record>);

impl Observer for Counted {
    fn starts(&mut self, _: usize) {
        if SHARED.cost.begun.get().is_none() {
            SHARED.cost.begun.set(Some(machine::ticks()));
        }
    }

    fn has_read(&mut self, activation: &Activation) {
        SHARED.cost.of_record(|| Watching(self.0).has_read(activation));
    }

    fn finished(&mut self, activation: &Activation) {
        SHARED.cost.of_record(|| Watching(self.0).finished(activation));
        // Background activations are no part of the chain.
        if ACTIVATIONS.get(usize::from(activation.record().index)).is_some_and(|info| info.band == Band::Background) {
            SHARED.cost.begun.set(None);
        }
    }
}

// SAFETY: this machine has one core and no interrupts.
#[expect(unsafe_code, reason = "one core, no interrupts")]
unsafe impl Sync for Shared {}

/// Writes the record.
pub struct Writer {
    record: &'static RefCell<Record>,
    frame: &'static mut [u8; FRAME],
    due: Instant,
}

/// One in so many samples that a runnable publishes is kept for comparison.
fn every(topic: usize) -> u32 {
    match Id::ALL.get(topic) {
        Some(Id::actuator_motor | Id::control_output | Id::flight_status) => 40,
        Some(Id::estimate_state) => 200,
        _ => 0,
    }
}

/// At power-on.
pub fn begin() -> Writer {
    static BYTES: StaticCell<[u8; MEMORY]> = StaticCell::new();
    static SCRATCH: StaticCell<[u8; FRAME]> = StaticCell::new();
    let ring = Ring::new(BYTES.init_with(|| [0; MEMORY]));
    let record = RECORD.init_with(|| RefCell::new(Compact::new(ring, &TOPICS, every)));
    SHARED.record.set(Some(record));
    Writer { record, frame: SCRATCH.init_with(|| [0; FRAME]), due: Instant::ZERO }
}

impl Writer {
    /// The record, for the observer.
    pub const fn shared(&self) -> &'static RefCell<Record> {
        self.record
    }

    /// A pass is over.
    pub fn pass(&mut self, now: Instant, flight_loop: &FlightLoop<'_, Runnables>) {
        let mut record = self.record.borrow_mut();
        SHARED.cost.of_record(|| record.pass(flight_loop.heads()));
        SHARED.cost.pass();
        if now >= self.due {
            self.due = now + PERIOD;
            let begun = machine::ticks();
            if let Ok(length) = key_frame::encode(flight_loop, now, self.frame) {
                record.key_frame(self.frame.get(..length).unwrap_or_default());
            }
            SHARED.cost.frame.set(SHARED.cost.frame.get().max(begun.until(machine::ticks())));
        }
    }
}

/// Prints it.
pub fn print() {
    let Some(record) = SHARED.record.get() else { return };
    let record = record.borrow();
    let ring = record.store();
    let mut line = heapless::String::<{ 2 * LINE }>::new();
    for (place, byte) in ring.bytes().enumerate() {
        for digit in [byte >> 4, byte & 15] {
            _ = line.push(char::from_digit(digit.into(), 16).unwrap_or('?'));
        }
        if place % LINE == LINE - 1 {
            outln!("record {line}");
            line.clear();
        }
    }
    outln!("record {line}");
    let Cost { recordings, chain, passes, frame, .. } = &SHARED.cost;
    let of = |all: &Cell<u64>| machine::instructions(all.get()) / passes.get().max(1);
    outln!(
        "instructions of a pass: chain {} record {} of {} passes, key frame at most {}",
        of(chain),
        of(recordings),
        passes.get(),
        machine::instructions(frame.get())
    );
    outln!("compact: {} bytes kept of {}, {} lost", ring.len(), ring.taken(), record.lost());
}
