//! How long each runnable takes, against its budget.
//!
//! A [`Stopwatch`] watches the flight loop and fills a [`Profile`]; somebody else, on another core even, reads it. One
//! histogram a runnable, with classes that are shares of its budget in the activation table, because the question is not
//! how long something takes but whether it takes too long. Costs two looks at the clock and two stores an activation.
//!
//! Counts wall-clock time from the first input to the last output, as budgets do: interrupts in between are included.

use crate::{Observer, plan};
use core::fmt;
use core::sync::atomic::{AtomicU32, Ordering};
use stampfly_bus::Activation;
use stampfly_drivers::Timebase;
use stampfly_types::{Duration, Instant};

/// Upper ends of the classes, in eighths of the budget. What is longer than the last one belongs to one more class.
const ENDS: [u64; 6] = [1, 2, 4, 6, 8, 16];

/// Number of classes.
pub const CLASSES: usize = ENDS.len() + 1;

/// Execution times of one runnable.
#[derive(Debug)]
struct Times {
    classes: [AtomicU32; CLASSES],
    longest: AtomicU32,
}

/// Execution times of every runnable since power-on. Written by one [`Stopwatch`], read by anybody.
#[derive(Debug)]
pub struct Profile {
    times: [Times; plan::COUNT],
}

/// What is known about one runnable.
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

/// What stands above the columns of a [`Row`].
pub const HEADING: &str = "runnable      longest budget      1/8      1/4      1/2      3/4      all    twice   longer";

impl Profile {
    /// Nothing has run yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            times: [const { Times { classes: [const { AtomicU32::new(0) }; CLASSES], longest: AtomicU32::new(0) } };
                plan::COUNT],
        }
    }

    /// One row a runnable, in the order of the activation table.
    pub fn rows(&self) -> impl Iterator<Item = Row> {
        self.times.iter().zip(&plan::ACTIVATIONS).map(|(times, info)| Row {
            name: info.name,
            budget: info.budget,
            classes: times.classes.each_ref().map(|count| count.load(Ordering::Relaxed)),
            longest: Duration::from_micros(u64::from(times.longest.load(Ordering::Relaxed))),
        })
    }

    fn note(&self, index: usize, took: Duration) {
        let (Some(times), Some(info)) = (self.times.get(index), plan::ACTIVATIONS.get(index)) else { return };
        let class =
            ENDS.iter().position(|end| took.as_micros() * 8 <= info.budget.as_micros() * end).unwrap_or(ENDS.len());
        let Some(count) = times.classes.get(class) else { return };
        // One stopwatch writes; a load and a store are enough where there is no atomic addition.
        count.store(count.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        let took = u32::try_from(took.as_micros()).unwrap_or(u32::MAX);
        if took > times.longest.load(Ordering::Relaxed) {
            times.longest.store(took, Ordering::Relaxed);
        }
    }
}

impl Default for Profile {
    fn default() -> Self {
        Self::new()
    }
}

/// Fills a [`Profile`]. Give it to the flight loop.
///
/// ```
/// use stampfly_board::profile::{Profile, Stopwatch};
/// use stampfly_board::{Observer, plan};
/// use stampfly_bus::Activation;
/// use stampfly_drivers::blocking::BlockingClock;
/// use stampfly_types::{Duration, Instant};
/// # use core::cell::Cell;
/// # #[derive(Clone)] struct Delay;
/// # impl embedded_hal::delay::DelayNs for Delay { fn delay_ns(&mut self, _: u32) {} }
/// # let time = Cell::new(0);
/// # let clock = BlockingClock::new(Delay, || Instant::from_micros(time.get()));
/// let profile = Profile::new();
/// let mut stopwatch = Stopwatch::new(&profile, clock);
/// let (control, activation) = (plan::Id::control as usize, Activation::live(Instant::ZERO));
/// stopwatch.starts(control);
/// # time.set(60);
/// stopwatch.finished(control, &activation);
///
/// let row = profile.rows().nth(control).unwrap();
/// assert_eq!((row.name, row.longest, row.over_budget()), ("control", Duration::from_micros(60), 0));
/// ```
#[derive(Debug)]
pub struct Stopwatch<'p, T> {
    profile: &'p Profile,
    clock: T,
    started: Instant,
}

impl<'p, T: Timebase> Stopwatch<'p, T> {
    /// A stopwatch for one flight loop.
    pub fn new(profile: &'p Profile, clock: T) -> Self {
        Self { profile, clock, started: Instant::ZERO }
    }
}

impl<T: Timebase> Observer for Stopwatch<'_, T> {
    fn has_read(&mut self, _: usize, _: &Activation) {}

    fn starts(&mut self, _: usize) {
        self.started = self.clock.now();
    }

    fn finished(&mut self, index: usize, _: &Activation) {
        self.profile.note(index, self.clock.now().since(self.started));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_time_has_a_class() {
        let profile = Profile::new();
        let control = plan::Id::control as usize;
        let budget = plan::ACTIVATIONS[control].budget;
        assert_eq!(budget, Duration::from_micros(100), "the times below are written for this budget");
        // Two a class, at its ends: (0, 1/8], (1/8, 1/4], (1/4, 1/2], (1/2, 3/4], (3/4, 1], (1, 2], longer.
        let times = [0, 12, 13, 25, 26, 50, 51, 75, 76, 100, 101, 200, 201, u64::MAX / 8];
        for took in times {
            profile.note(control, Duration::from_micros(took));
        }
        profile.note(usize::MAX, Duration::from_micros(1));
        let row = profile.rows().nth(control).expect("control");
        assert_eq!(row.classes, [2; CLASSES]);
        assert_eq!((row.over_budget(), row.longest), (4, Duration::from_micros(u64::from(u32::MAX))));
        assert!(profile.rows().filter(|other| other.name != "control").all(|other| other.classes == [0; CLASSES]));
    }

    #[test]
    fn columns_stand_below_their_headings() {
        let width = HEADING.len();
        assert!(Profile::new().rows().all(|row| row.to_string().len() == width), "{HEADING}");
    }
}
