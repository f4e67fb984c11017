//! Execution times of the runnables, against their budgets.
//!
//! A [`Stopwatch`] observes the flight loop and fills a [`Profile`], which another context, on another core if there is
//! one, reads at any time. Each runnable has a histogram whose classes are shares of its budget in the activation table,
//! because the question is not how long an activation takes but whether it takes too long. An activation costs two looks
//! at the clock and two stores.
//!
//! It counts wall-clock time from the first input to the last output, as budgets do: interrupts in between are included.
//! Not for finding out where in a runnable the time goes, and meaningless on virtual time.

use crate::Observer;
use core::fmt;
use core::sync::atomic::{AtomicU32, Ordering};
use stampfly_bus::{Activation, ActivationInfo};
use stampfly_types::{Duration, Instant};

/// Upper ends of the classes, in eighths of the budget. Longer activations are one more class.
const ENDS: [u64; 6] = [1, 2, 4, 6, 8, 16];

/// Number of classes.
pub const CLASSES: usize = ENDS.len() + 1;

/// What stands above the columns of a [`Row`].
pub const HEADING: &str = "runnable      longest budget      1/8      1/4      1/2      3/4      all    twice   longer";

#[derive(Debug)]
struct Times {
    classes: [AtomicU32; CLASSES],
    longest: AtomicU32,
}

impl Times {
    #[allow(clippy::declare_interior_mutable_const, reason = "the start value of an array")]
    const ZERO: Self = Self { classes: [const { AtomicU32::new(0) }; CLASSES], longest: AtomicU32::new(0) };
}

/// Execution times of every runnable since power-on. Written by one [`Stopwatch`], read by any context.
///
/// ```
/// use stampfly_bus::{Activation, ActivationInfo, Band, Trigger};
/// use stampfly_flight::Observer;
/// use stampfly_flight::profile::{Profile, Stopwatch};
/// use stampfly_types::{Duration, Instant};
/// # use core::cell::Cell;
/// // A vehicle passes the `ACTIVATIONS` that `schedule!` has made.
/// const ACTIVATIONS: &[ActivationInfo] = &[ActivationInfo {
///     name: "control", doc: &[], trigger: Trigger::On(&[0]), at_latest: None, band: Band::Flight,
///     budget: Duration::from_micros(100),
/// }];
/// static PROFILE: Profile<{ ACTIVATIONS.len() }> = Profile::new(ACTIVATIONS);
///
/// # let time = Cell::new(Instant::ZERO);
/// # let clock = || time.get();
/// let mut stopwatch = Stopwatch::new(&PROFILE, clock);
/// // The flight loop calls these.
/// stopwatch.starts(0);
/// # time.set(Instant::from_micros(60));
/// stopwatch.finished(&Activation::live(0, Instant::ZERO));
///
/// let row = PROFILE.rows().next().unwrap();
/// assert_eq!((row.name, row.longest, row.over_budget()), ("control", Duration::from_micros(60), 0));
/// ```
#[derive(Debug)]
pub struct Profile<const ACTIVATIONS: usize> {
    table: &'static [ActivationInfo],
    times: [Times; ACTIVATIONS],
}

/// Execution times of one runnable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Its name.
    pub name: &'static str,
    /// What the activation table allows.
    pub budget: Duration,
    /// Activations in each class: up to 1/8, 1/4, 1/2, 3/4, all, twice the budget, and longer. Modulo 2³².
    pub classes: [u32; CLASSES],
    /// The longest activation.
    pub longest: Duration,
}

impl Row {
    /// Activations that took longer than the budget, modulo 2³².
    #[must_use]
    pub fn over_budget(&self) -> u32 {
        let [_, _, _, _, _, double, longer] = self.classes;
        double.wrapping_add(longer)
    }
}

/// One line: name, longest and budget in microseconds, the classes.
impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<14}{:>7}{:>7}", self.name, self.longest.as_micros(), self.budget.as_micros())?;
        self.classes.iter().try_for_each(|count| write!(f, "{count:>9}"))
    }
}

/// One [`Row`] a runnable, in the order of the activation table.
#[derive(Clone, Debug, Default)]
pub struct Rows<'p> {
    table: core::slice::Iter<'static, ActivationInfo>,
    times: core::slice::Iter<'p, Times>,
}

impl Iterator for Rows<'_> {
    type Item = Row;

    fn next(&mut self) -> Option<Row> {
        let (info, times) = (self.table.next()?, self.times.next()?);
        Some(Row {
            name: info.name,
            budget: info.budget,
            classes: times.classes.each_ref().map(|count| count.load(Ordering::Relaxed)),
            longest: Duration::from_micros(u64::from(times.longest.load(Ordering::Relaxed))),
        })
    }
}

impl<const ACTIVATIONS: usize> Profile<ACTIVATIONS> {
    /// No activation timed yet. `ACTIVATIONS` is the length of the table.
    #[must_use]
    pub const fn new(table: &'static [ActivationInfo]) -> Self {
        Self { table, times: [const { Times::ZERO }; ACTIVATIONS] }
    }

    /// One row a runnable, in the order of the activation table.
    #[must_use]
    pub fn rows(&self) -> Rows<'_> {
        Rows { table: self.table.iter(), times: self.times.iter() }
    }

    fn note(&self, index: usize, took: Duration) {
        let (Some(times), Some(info)) = (self.times.get(index), self.table.get(index)) else { return };
        let class = ENDS.iter().position(|end| took * 8 <= info.budget * *end).unwrap_or(ENDS.len());
        let Some(count) = times.classes.get(class) else { return };
        // One stopwatch writes; a load and a store are enough on cores without atomic addition.
        count.store(count.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        let took = u32::try_from(took.as_micros()).unwrap_or(u32::MAX);
        if took > times.longest.load(Ordering::Relaxed) {
            times.longest.store(took, Ordering::Relaxed);
        }
    }
}

/// Fills a [`Profile`]: an [`Observer`] for one flight loop. See there for an example.
#[derive(Debug)]
pub struct Stopwatch<'p, C, const ACTIVATIONS: usize> {
    profile: &'p Profile<ACTIVATIONS>,
    clock: C,
    started: Instant,
}

impl<'p, C: Fn() -> Instant, const ACTIVATIONS: usize> Stopwatch<'p, C, ACTIVATIONS> {
    /// A stopwatch on this clock. The finer the clock, the better: microseconds are the unit of the profile.
    pub const fn new(profile: &'p Profile<ACTIVATIONS>, clock: C) -> Self {
        Self { profile, clock, started: Instant::ZERO }
    }
}

impl<C: Fn() -> Instant, const ACTIVATIONS: usize> Observer for Stopwatch<'_, C, ACTIVATIONS> {
    fn starts(&mut self, _: usize) {
        self.started = (self.clock)();
    }

    fn finished(&mut self, activation: &Activation) {
        let took = (self.clock)().since(self.started);
        self.profile.note(usize::from(activation.record().index), took);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rover;
    use std::string::ToString;

    #[test]
    fn every_time_has_a_class() {
        let profile = Profile::<{ rover::COUNT }>::new(&rover::ACTIVATIONS);
        let drive = rover::Id::drive as usize;
        assert_eq!(rover::ACTIVATIONS[drive].budget, Duration::from_micros(100), "the times below are for this budget");
        // Two a class, at its ends: (0, 1/8], (1/8, 1/4], (1/4, 1/2], (1/2, 3/4], (3/4, 1], (1, 2], longer.
        let times = [0, 12, 13, 25, 26, 50, 51, 75, 76, 100, 101, 200, 201, u64::MAX / 8];
        for took in times {
            profile.note(drive, Duration::from_micros(took));
        }
        profile.note(usize::MAX, Duration::from_micros(1));
        let row = profile.rows().nth(drive).expect("in the table");
        assert_eq!(row.classes, [2; CLASSES]);
        assert_eq!((row.over_budget(), row.longest.as_micros()), (4, u64::from(u32::MAX)));
        assert!(profile.rows().filter(|other| other.name != "drive").all(|other| other.classes == [0; CLASSES]));
    }

    #[test]
    fn columns_stand_below_their_headings() {
        let profile = Profile::<{ rover::COUNT }>::new(&rover::ACTIVATIONS);
        assert_eq!(profile.rows().count(), rover::COUNT);
        assert!(profile.rows().all(|row| row.to_string().len() == HEADING.len()), "{HEADING}");
    }
}
