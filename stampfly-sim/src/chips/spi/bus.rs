//! Wires and controller of an SPI bus: levels, software latency, and faults common to all chips. A
//! chip's place on the bus is a [`SpiPort`](super::SpiPort).

use super::analyser::{Analyser, Seen};
use super::wire::{BitOrder, Controller, Levels};
use crate::chips::Latency;
use crate::noise::Noise;
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use embedded_hal::spi::Mode;
use stampfly_types::Instant;
use std::rc::Rc;

/// Random stream of bit errors; no sensor uses this number.
const STREAM: u64 = 102;

pub(super) struct State {
    pub clock: Clock,
    pub busy_until: Cell<Instant>,
    pub noise: RefCell<Noise>,
    /// Number of chip selects that are not driven.
    pub floating: Cell<u32>,
    /// The byte read in every transfer while the line from the chips is stuck.
    pub stuck: Cell<Option<u8>>,
    pub controller: Cell<Controller>,
    pub levels: Cell<Levels>,
    /// Simulate every edge, never whole bytes.
    pub edge_by_edge: Cell<bool>,
    pub latency: Cell<Latency>,
    /// Number of chips attached so far.
    pub chips: Cell<usize>,
    pub analyser: RefCell<Option<Analyser>>,
}

/// The wires shared by all chips. A handle: clones are the same bus.
#[derive(Clone)]
pub struct SpiBus(pub(super) Rc<State>);

impl core::fmt::Debug for SpiBus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SpiBus").field("busy_until", &self.0.busy_until).finish_non_exhaustive()
    }
}

impl SpiBus {
    /// A bus without chips, whose controller sets the clock's idle level before selecting a chip.
    /// The clock is low until the first transfer. `seed` draws bit errors and refusals.
    #[must_use]
    pub fn new(clock: &Clock, seed: u64) -> Self {
        let noise = RefCell::new(Noise::new(seed, STREAM));
        Self(Rc::new(State {
            clock: clock.clone(),
            busy_until: Cell::new(clock.now()),
            noise,
            floating: Cell::new(0),
            stuck: Cell::new(None),
            controller: Cell::default(),
            levels: Cell::default(),
            edge_by_edge: Cell::new(false),
            latency: Cell::default(),
            chips: Cell::default(),
            analyser: RefCell::default(),
        }))
    }

    /// Sets the behaviour of the processor's controller.
    pub fn set_controller(&self, controller: Controller) {
        self.0.controller.set(controller);
    }

    /// Sets the software latency.
    pub fn set_latency(&self, latency: Latency) {
        self.0.latency.set(latency);
    }

    /// Starts an analyser, or returns the running one.
    #[must_use]
    pub fn analyse(&self) -> Analyser {
        self.0.analyser.borrow_mut().get_or_insert_default().clone()
    }

    /// Passes an entry to the analyser, if any.
    pub(in crate::chips) fn note(&self, seen: Seen) {
        if let Some(analyser) = &*self.0.analyser.borrow() {
            analyser.note(seen);
        }
    }

    /// Sends a zero byte in this mode without a selected chip. Afterwards the clock idles at the
    /// level of that mode, with any controller.
    pub fn send_to_nobody(&self, mode: Mode) {
        self.0.levels.set(Levels::after(mode, BitOrder::MostFirst, 0));
    }

    /// Simulates every edge from now on instead of whole bytes. This is slower and gives the same
    /// results; it serves to verify that.
    pub fn go_edge_by_edge(&self) {
        self.0.edge_by_edge.set(true);
    }

    /// Makes the line from the chips stick high or low, or releases it with `None`. Sent bytes
    /// still arrive.
    pub fn hold_miso(&self, level: Option<bool>) {
        self.0.stuck.set(level.map(|high| if high { 0xFF } else { 0 }));
    }
}
