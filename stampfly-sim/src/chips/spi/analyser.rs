//! Logic analyser of an SPI bus: records every transfer with its bytes and instants, and when a
//! task saw the interrupt pin high.
//!
//! Use it to inspect the traffic between driver and chip, or to replay it: given these entries a
//! driver behaves the same on a machine without the chips. The record grows by about 100 kB per
//! simulated second. To count clock edges only use
//! [`SpiPort::rising_edges`](super::SpiPort::rising_edges).
use stampfly_types::Instant;
use std::cell::RefCell;
use std::rc::Rc;

/// An entry of the analyser's record.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Seen {
    /// A transfer.
    Transfer {
        /// Number of the chip on the bus, in the order of attachment.
        chip: usize,
        /// Instant at which the chip select fell.
        begun: Instant,
        /// Instant at which the software had the data.
        ended: Instant,
        /// True if the processor did not yield, so that no other task ran meanwhile.
        blocked: bool,
        /// Bytes written by the driver, without the padding sent while reading.
        wrote: Vec<u8>,
        /// Bytes read.
        read: Vec<u8>,
    },
    /// A task waiting for the interrupt pin saw it high.
    PinHigh(Instant),
}

/// The record, shared with the bus.
#[derive(Clone, Debug, Default)]
pub struct Analyser(Rc<RefCell<Vec<Seen>>>);

impl Analyser {
    pub(in crate::chips) fn note(&self, seen: Seen) {
        self.0.borrow_mut().push(seen);
    }

    /// Takes all entries so far, in the order of their ends.
    #[must_use]
    pub fn take(&self) -> Vec<Seen> {
        self.0.take()
    }
}
