//! How long the processor of a bench takes: virtual time stands still while code runs, so this counts instead.

use crate::console::Profile;
use core::cell::Cell;
use stampfly_bus::{Activation, ActivationInfo};
use stampfly_flight::doctor::FlashAccess;
use stampfly_flight::{Observer, Profile as AnyProfile, Stopwatch};
use stampfly_types::{Duration, Instant};
use std::boxed::Box;
use std::rc::Rc;

/// Share of its budget that an activation takes from a fast flash and undisturbed. *Unverified*: the budgets have not been
/// measured on the chip.
const SHARE: f32 = 0.35;

/// Fills a profile with the time that activations would have taken.
pub(super) struct Processor<'p> {
    stopwatch: Stopwatch<'p, Box<dyn Fn() -> Instant>, { crate::schedule::COUNT }>,
    table: &'static [ActivationInfo],
    now: Rc<Cell<Instant>>,
    /// Times the budget.
    takes: f32,
    running: usize,
}

impl<'p> Processor<'p> {
    /// A processor that other work makes so many times slower, and that waits for this flash.
    pub fn new(profile: &'p Profile, table: &'static [ActivationInfo], load: f32, flash: FlashAccess) -> Self {
        let now = Rc::new(Cell::new(Instant::ZERO));
        let shown = now.clone();
        let clock: Box<dyn Fn() -> Instant> = Box::new(move || shown.get());
        let profile: &AnyProfile<{ crate::schedule::COUNT }> = profile;
        // A line of the cache comes over so many wires at so many megahertz; four at 80 are what `SHARE` is about.
        let wires = match flash.mode {
            "QIO" | "QOUT" => 4,
            "DIO" | "DOUT" => 2,
            _ => 1,
        };
        let wait = 320.0 / (wires * flash.megahertz).max(1) as f32;
        Self { stopwatch: Stopwatch::new(profile, clock), table, now, takes: SHARE * load * wait, running: 0 }
    }
}

impl Observer for Processor<'_> {
    fn starts(&mut self, index: usize) {
        self.running = index;
        self.stopwatch.starts(index);
    }

    fn finished(&mut self, activation: &Activation) {
        let budget = self.table.get(self.running).map_or(Duration::ZERO, |info| info.budget);
        self.now.set(self.now.get() + Duration::from_seconds(budget.seconds() * self.takes));
        self.stopwatch.finished(activation);
    }
}
