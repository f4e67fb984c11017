//! Activation state of the faults of one flight, and how often each has acted.

use super::{Fault, Moment, When};
use core::cell::Cell;
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

#[derive(Debug)]
struct Entry {
    fault: Fault,
    begun: Cell<Option<Instant>>,
    lasts: Cell<Option<Duration>>,
    changed: Cell<u64>,
}

/// The faults of one flight. A handle: clones share the state. Each part on which faults can act
/// holds a clone.
///
/// ```
/// use stampfly_sim::fault::{Class, Fault, FaultKind, Injector, Moment};
/// use stampfly_types::{Duration, Instant};
/// const TABLE: &[FaultKind] = &[FaultKind::plain("tof-silent", Class::Degraded, "No range comes.")];
/// let fault = Fault::parse("tof-silent@hover+2", TABLE)?;
/// let injector = Injector::new(Instant::ZERO, &[fault]);
/// assert!(!injector.is_active(0, Instant::from_secs(3)), "it does not hover yet");
/// injector.reached(Moment::Hover, Instant::from_secs(4));
/// assert!(injector.is_active(0, Instant::from_secs(5)) && !injector.is_active(0, Instant::from_secs(6)));
/// # Ok::<(), stampfly_sim::fault::FaultError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Injector(Rc<[Entry]>);

impl Injector {
    /// The faults of a flight that begins at `start`.
    #[must_use]
    pub fn new(start: Instant, faults: &[Fault]) -> Self {
        let entry = |fault: &Fault| {
            let begun = match fault.when {
                When::After(time) => Some(start + time),
                When::Moment(_) => None,
            };
            Entry { fault: *fault, begun: Cell::new(begun), lasts: Cell::new(fault.lasts), changed: Cell::new(0) }
        };
        Self(faults.iter().map(entry).collect())
    }

    /// The faults in the order given; the other functions take this index as `place`.
    pub fn faults(&self) -> impl Iterator<Item = &Fault> {
        self.0.iter().map(|entry| &entry.fault)
    }

    /// True if a fault begins at this moment, whether or not the moment has come.
    #[must_use]
    pub fn wants(&self, moment: Moment) -> bool {
        self.faults().any(|fault| fault.when == When::Moment(moment))
    }

    /// Reports that a moment has come. Only the first time counts.
    pub fn reached(&self, moment: Moment, now: Instant) {
        for entry in self.0.iter().filter(|entry| entry.fault.when == When::Moment(moment)) {
            // Keeps the first instant.
            entry.begun.set(entry.begun.get().or(Some(now)));
        }
    }

    /// Begins a fault now, regardless of its own begin, on request of a user.
    pub fn begin(&self, place: usize, now: Instant, lasts: Option<Duration>) {
        if let Some(entry) = self.0.get(place) {
            entry.begun.set(Some(now));
            entry.lasts.set(lasts);
        }
    }

    /// Ends a fault that has begun.
    pub fn end(&self, place: usize, now: Instant) {
        if let Some((entry, begun)) = self.0.get(place).and_then(|entry| Some((entry, entry.begun.get()?)))
            && begun <= now
        {
            entry.lasts.set(Some(now.since(begun)));
        }
    }

    /// Begin of a fault; `None` if its moment has not come.
    #[must_use]
    pub fn begins(&self, place: usize) -> Option<Instant> {
        self.0.get(place)?.begun.get()
    }

    /// Begin of the first fault that has begun by `now`.
    #[must_use]
    pub fn first_begun(&self, now: Instant) -> Option<Instant> {
        self.0.iter().filter_map(|entry| entry.begun.get()).filter(|begun| *begun <= now).min()
    }

    /// True while the fault acts.
    #[must_use]
    pub fn is_active(&self, place: usize, now: Instant) -> bool {
        self.0.get(place).is_some_and(|entry| {
            entry
                .begun
                .get()
                .is_some_and(|begun| begun <= now && entry.lasts.get().is_none_or(|lasts| now < begun + lasts))
        })
    }

    /// Counts an action of the fault.
    pub fn note_change(&self, place: usize) {
        if let Some(entry) = self.0.get(place) {
            entry.changed.set(entry.changed.get() + 1);
        }
    }

    /// Number of times that the fault has acted.
    #[must_use]
    pub fn changes(&self, place: usize) -> u64 {
        self.0.get(place).map_or(0, |entry| entry.changed.get())
    }
}
