//! A logic analyser on an SPI bus: every transfer with its bytes and instants, and when a waited-for interrupt pin was seen high.
//!
//! Use it to look at what a driver really says to its chip, or to replay one end of the bus without the other: with these entries a
//! driver does the same again on a machine that has no chips. What it writes down grows with the flight, 100 kB a second. Not for
//! counting edges: [`SpiPort::rising_edges`](super::SpiPort::rising_edges) does.

use stampfly_types::Instant;
use std::cell::RefCell;
use std::rc::Rc;

/// What an analyser has seen.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Seen {
    /// A transfer.
    Transfer {
        /// Which chip: its number on the bus, in the order in which they were soldered.
        chip: usize,
        /// When the select fell, and when the software had what was read.
        begun: Instant,
        /// See there.
        ended: Instant,
        /// Did the processor do all of it itself, so that no other task ran meanwhile?
        blocked: bool,
        /// What the driver wrote, without what it sent to read or in place of what it read.
        wrote: Vec<u8>,
        /// What it read.
        read: Vec<u8>,
    },
    /// A task that waited for the interrupt pin saw it high.
    PinHigh(Instant),
}

/// What is written down, shared with the bus.
#[derive(Clone, Debug, Default)]
pub struct Analyser(Rc<RefCell<Vec<Seen>>>);

impl Analyser {
    pub(in crate::chips) fn note(&self, seen: Seen) {
        self.0.borrow_mut().push(seen);
    }

    /// Everything so far, in the order in which it ended. It is forgotten here.
    #[must_use]
    pub fn take(&self) -> Vec<Seen> {
        self.0.take()
    }
}
