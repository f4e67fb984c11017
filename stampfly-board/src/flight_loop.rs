//! The flight loop: runs what is due, in table order, and lets somebody watch.
//!
//! Shared by every executor. On a microcontroller it is called by the task that the bus's hook wakes; on a host by
//! the virtual clock. It reads no clock: the caller says what time it is.

use crate::plan;
use crate::wiring;
use stampfly_bus::{Activation, AnyTopic, Band, Runnables, Scheduler};
use stampfly_types::Instant;

/// Somebody who wants to know about activations: the log, a profiler.
pub trait Observer {
    /// A runnable is about to read its inputs.
    fn starts(&mut self, _index: usize) {}

    /// A runnable has read its inputs. The order of these calls is the order a replay repeats.
    fn has_read(&mut self, index: usize, activation: &Activation);

    /// A runnable has published.
    fn finished(&mut self, _index: usize, _activation: &Activation) {}
}

/// Nobody watches.
impl Observer for () {
    fn has_read(&mut self, _: usize, _: &Activation) {}
}

/// A background activation that has read its inputs and not yet run.
#[derive(Debug)]
pub struct Pending {
    index: usize,
    activation: Activation,
}

/// The vehicle's runnables with the scheduler that drives them.
pub struct FlightLoop<'b> {
    vehicle: plan::Vehicle<'b>,
    scheduler: Scheduler<{ plan::COUNT }, { wiring::COUNT }>,
    heads: [&'b dyn AnyTopic; wiring::COUNT],
}

impl<'b> FlightLoop<'b> {
    /// A vehicle at power-on.
    #[must_use]
    pub(crate) fn new(vehicle: plan::Vehicle<'b>, heads: [&'b dyn AnyTopic; wiring::COUNT], start: Instant) -> Self {
        Self { vehicle, scheduler: Scheduler::new(&plan::ACTIVATIONS, start), heads }
    }

    /// Is anything due in this band?
    #[must_use]
    pub fn is_due(&self, band: Band, clock: Instant) -> bool {
        self.scheduler.due(band, 0, clock, &self.heads).is_some()
    }

    /// Runs everything that is due in this band, in one pass through the table. Returns whether anything ran.
    pub fn run_band(&mut self, band: Band, clock: Instant, observer: &mut impl Observer) -> bool {
        let mut next = 0;
        while let Some((index, now)) = self.scheduler.due(band, next, clock, &self.heads) {
            let mut activation = Activation::live(now);
            self.start(index, &mut activation, clock, observer);
            self.complete(index, &mut activation, observer);
            next = index + 1;
        }
        next > 0
    }

    #[inline]
    fn start(&mut self, index: usize, activation: &mut Activation, clock: Instant, observer: &mut impl Observer) {
        observer.starts(index);
        self.scheduler.started(index, activation.now(), clock, &self.heads);
        self.vehicle.read(index, activation);
        observer.has_read(index, activation);
    }

    #[inline]
    fn complete(&mut self, index: usize, activation: &mut Activation, observer: &mut impl Observer) {
        self.vehicle.run(index, activation);
        self.scheduler.finished(index);
        observer.finished(index, activation);
    }

    /// Lets the next due activation of this band read its inputs. Whatever is published before
    /// [`finish`](Self::finish) belongs to its next activation, as if it had been interrupted.
    pub fn start_next(&mut self, band: Band, clock: Instant, observer: &mut impl Observer) -> Option<Pending> {
        let (index, now) = self.scheduler.due(band, 0, clock, &self.heads)?;
        let mut activation = Activation::live(now);
        self.start(index, &mut activation, clock, observer);
        Some(Pending { index, activation })
    }

    /// Runs what has read its inputs.
    pub fn finish(&mut self, mut pending: Pending, observer: &mut impl Observer) {
        self.complete(pending.index, &mut pending.activation, observer);
    }

    /// Repeats a recorded activation. Returns it as it went this time.
    pub fn replay(&mut self, index: usize, mut activation: Activation) -> Activation {
        self.vehicle.read(index, &mut activation);
        self.vehicle.run(index, &mut activation);
        activation
    }

    /// How many inputs each runnable reads. To be asked before anything has been published: reading is how they are
    /// counted.
    #[must_use]
    pub fn count_inputs(&mut self) -> [usize; plan::COUNT] {
        core::array::from_fn(|index| {
            let mut activation = Activation::live(Instant::ZERO);
            self.vehicle.read(index, &mut activation);
            activation.inputs().len()
        })
    }

    /// The next instant at which a period or a deadline makes something due.
    #[must_use]
    pub fn next_tick(&self) -> Option<Instant> {
        self.scheduler.next_tick()
    }
}
