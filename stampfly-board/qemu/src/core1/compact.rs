//! The flight core's compact record: what it holds at the end is printed, and replayed on a PC. `cargo xtask record`.

use core::cell::RefCell;
use stampfly_board::schedule::{ACTIVATIONS, Runnables};
use stampfly_board::topics::{COUNT, Id, TOPICS};
use stampfly_flight::compact::{Compact, Ring};
use stampfly_flight::{FlightLoop, key_frame};
use stampfly_types::{Duration, Instant};
use static_cell::StaticCell;

/// Bytes that the emulated board has for it.
const MEMORY: usize = 1024 * 1024;
/// Room for a key frame.
const FRAME: usize = 64 * 1024;
/// Between two key frames.
const PERIOD: Duration = Duration::from_secs(4);
/// Bytes in a printed line.
const LINE: usize = 64;

type Record = Compact<Ring<'static>, COUNT, { ACTIVATIONS.len() }>;

static RECORD: StaticCell<RefCell<Record>> = StaticCell::new();
static SHARED: Shared = Shared(core::cell::Cell::new(None));

/// What is printed at the end.
struct Shared(core::cell::Cell<Option<&'static RefCell<Record>>>);

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
        Some(Id::actuator_motor) => 20,
        Some(Id::estimate_state) => 40,
        Some(Id::flight_status | Id::control_output) => 40,
        _ => 0,
    }
}

/// At power-on.
pub fn begin() -> Writer {
    static BYTES: StaticCell<[u8; MEMORY]> = StaticCell::new();
    static SCRATCH: StaticCell<[u8; FRAME]> = StaticCell::new();
    let ring = Ring::new(BYTES.init_with(|| [0; MEMORY]));
    let record = RECORD.init_with(|| RefCell::new(Compact::new(ring, &TOPICS, every)));
    SHARED.0.set(Some(record));
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
        record.pass(flight_loop.heads());
        if now >= self.due {
            self.due = now + PERIOD;
            crate::marks::aside_begins();
            if let Ok(length) = key_frame::encode(flight_loop, now, self.frame) {
                record.key_frame(self.frame.get(..length).unwrap_or_default());
            }
            crate::marks::aside_ends();
        }
    }
}

/// Prints it.
pub fn print() {
    let Some(record) = SHARED.0.get() else { return };
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
    outln!("compact: {} bytes kept of {}, {} lost", ring.len(), ring.taken(), record.lost());
}
