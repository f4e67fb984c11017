//! The wires of an SPI bus and the processor's end of them: controller, levels, software, and what may go wrong for all chips
//! alike. A chip's place on it is [`SpiPort`](super::SpiPort).

use super::analyser::{Analyser, Seen};
use super::wire::{BitOrder, Controller, Levels};
use crate::chips::Latency;
use crate::noise::Noise;
use crate::time::Clock;
use core::cell::{Cell, RefCell};
use embedded_hal::spi::Mode;
use stampfly_types::Instant;
use std::rc::Rc;

/// Stream of the bit errors; no sensor has this number.
const STREAM: u64 = 102;

pub(super) struct State {
    pub clock: Clock,
    pub busy_until: Cell<Instant>,
    pub noise: RefCell<Noise>,
    /// How many chip selects nobody drives.
    pub floating: Cell<u32>,
    /// The byte that every transfer reads, when the line from the chips is stuck.
    pub stuck: Cell<Option<u8>>,
    pub controller: Cell<Controller>,
    pub levels: Cell<Levels>,
    /// No transfer moves whole bytes.
    pub edge_by_edge: Cell<bool>,
    pub latency: Cell<Latency>,
    /// Chips soldered so far.
    pub chips: Cell<usize>,
    pub analyser: RefCell<Option<Analyser>>,
}

/// The wires that all chips share.
#[derive(Clone)]
pub struct SpiBus(pub(super) Rc<State>);

impl core::fmt::Debug for SpiBus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SpiBus").field("busy_until", &self.0.busy_until).finish_non_exhaustive()
    }
}

impl SpiBus {
    /// A bus without chips, whose controller sets the clock's level first. The clock is low until the first transfer. The seed decides
    /// on bit errors and refusals.
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

    /// From now on the processor's controller is such a one.
    pub fn set_controller(&self, controller: Controller) {
        self.0.controller.set(controller);
    }

    /// From now on the software takes so long.
    pub fn set_latency(&self, latency: Latency) {
        self.0.latency.set(latency);
    }

    /// From now on an analyser writes down what goes over the bus.
    #[must_use]
    pub fn analyse(&self) -> Analyser {
        self.0.analyser.borrow_mut().get_or_insert_default().clone()
    }

    /// Shows something to the analyser, if there is one.
    pub(in crate::chips) fn note(&self, seen: Seen) {
        if let Some(analyser) = &*self.0.analyser.borrow() {
            analyser.note(seen);
        }
    }

    /// Sends a zero in this mode while no chip is selected. Afterwards the clock idles at the level of that mode, whatever the controller.
    pub fn send_to_nobody(&self, mode: Mode) {
        self.0.levels.set(Levels::after(mode, BitOrder::MostFirst, 0));
    }

    /// From now on no transfer moves whole bytes. It takes longer and changes nothing, which is what it is for: to see that
    /// both ways are the same.
    pub fn go_edge_by_edge(&self) {
        self.0.edge_by_edge.set(true);
    }

    /// The line from the chips is stuck: high, low, or free again with `None`. What is sent still arrives.
    pub fn hold_miso(&self, level: Option<bool>) {
        self.0.stuck.set(level.map(|high| if high { 0xFF } else { 0 }));
    }
}
