//! What the flights of a fault campaign say together: how many passed, every cell of fault ×
//! moment, every kind of failure, and whether protections were right to stop motors.

use super::rate::Rate;
use super::row::{IDLE, PANICKED, Row};
use serde::Serialize;
use stampfly_sim::fault::{Class, FaultKind, Moment};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Flights with the same fault at the same moment.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Cell {
    /// How many.
    pub flights: usize,
    /// In which the fault changed nothing.
    pub idle: usize,
    /// That ended in a way that is not acceptable.
    pub wrong: usize,
    /// In which an invariant did not hold.
    pub violated: usize,
    /// Whose motors were stopped in the air, and it is known whether that was right.
    pub cuts: usize,
    /// Of those, in which it was not: flown on, the flight ends acceptably.
    pub needless: usize,
    /// That failed, for any of these reasons.
    pub failed: usize,
    /// The worst end.
    pub worst: String,
}

impl Cell {
    /// Takes a flight into account.
    fn add(&mut self, row: &Row) {
        self.flights += 1;
        self.idle += usize::from(row.verdict == IDLE);
        self.wrong += usize::from(row.failed() && !row.as_expected);
        self.violated += usize::from(row.broken().next().is_some());
        self.cuts += usize::from(row.cut_was_needless().is_some());
        self.needless += usize::from(row.cut_was_needless() == Some(true));
        self.failed += usize::from(row.failed());
        if self.flights == 1 || severity(&row.outcome) > severity(&self.worst) {
            self.worst.clone_from(&row.outcome);
        }
    }

    /// Those that say something: the fault of the others changed nothing.
    #[must_use]
    pub const fn told(&self) -> usize {
        self.flights - self.idle
    }

    /// Those that neither failed nor say nothing.
    #[must_use]
    pub const fn passed(&self) -> usize {
        self.told() - self.failed
    }

    /// How many flights of those that say something failed.
    #[must_use]
    pub const fn failing(&self) -> Rate {
        Rate::of(self.failed, self.told())
    }

    /// What may go wrong, and how often it did, of those that say something.
    #[must_use]
    pub const fn rates(&self) -> [(&'static str, Rate); 3] {
        [
            ("failed", self.failing()),
            ("wrong end", Rate::of(self.wrong, self.told())),
            ("invariant violated", Rate::of(self.violated, self.told())),
        ]
    }

    /// How many cuts of those that were judged were needless.
    #[must_use]
    pub const fn needless_cuts(&self) -> Rate {
        Rate::of(self.needless, self.cuts)
    }
}

/// Ends from best to worst; a panic is worse than any.
fn severity(outcome: &str) -> usize {
    if outcome == PANICKED {
        Class::ALL.len()
    } else {
        Class::ALL.iter().position(|c| c.name() == outcome).unwrap_or(0)
    }
}

/// Flights that failed in the same way.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Failure {
    /// The fault, or both with `+` between them.
    pub fault: String,
    /// The moment.
    pub phase: String,
    /// What is wrong.
    pub verdict: String,
    /// How many.
    pub flights: usize,
    /// The first of them: its place among the rows.
    pub first: usize,
    /// Why the end of the first of them is no better.
    pub reason: String,
    /// The line that repeats it, in its smallest form if one has been looked for.
    pub line: String,
    /// The line that repeats it as it was flown.
    pub flown: String,
}

/// A table whose rows are faults.
pub type Table = BTreeMap<(String, String), Cell>;

/// What the flights say together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// All flights.
    pub all: Cell,
    /// Those with a fault.
    pub faulted: Cell,
    /// Those without one.
    pub nominal: Cell,
    /// By protection, whose motors it stopped in the air.
    pub cuts: BTreeMap<String, Cell>,
    /// By moment, in how many flights it never came, so that the fault never began.
    pub never_began: BTreeMap<String, usize>,
    /// Fault and moment, of flights with one fault.
    pub cells: Table,
    /// Fault and other fault, of flights with two.
    pub pairs: Table,
    /// Flights without a fault by the mode of the pilot; without a name by a program.
    pub nominal_by: BTreeMap<String, Cell>,
    /// How many flights ended how.
    pub outcomes: BTreeMap<String, usize>,
    /// In how many flights each invariant did not hold.
    pub violations: BTreeMap<String, usize>,
    /// Every kind of failure, the most frequent first.
    pub failures: Vec<Failure>,
    /// Simulated time, s.
    pub duration_s: f64,
}

impl Summary {
    /// Of these flights.
    #[must_use]
    pub fn of(rows: &[Row]) -> Self {
        let mut summary = Self::default();
        let mut failures: BTreeMap<[&str; 3], (usize, usize)> = BTreeMap::new();
        for (place, row) in rows.iter().enumerate() {
            summary.all.add(row);
            if row.is_nominal() { &mut summary.nominal } else { &mut summary.faulted }.add(row);
            if row.cut_was_needless().is_some() {
                summary.cuts.entry(row.cut_by.clone().unwrap_or_default()).or_default().add(row);
            }
            for moment in row.never_began.iter().flat_map(|moments| moments.split('+')) {
                *summary.never_began.entry(moment.into()).or_default() += 1;
            }
            let key = match row.fault.split_once('+') {
                _ if row.is_nominal() => {
                    &mut summary.nominal_by.entry(row.mode.clone().unwrap_or_default()).or_default()
                }
                None => &mut summary.cells.entry((row.fault.clone(), row.phase.clone())).or_default(),
                Some((one, other)) => &mut summary.pairs.entry((one.into(), other.into())).or_default(),
            };
            key.add(row);
            *summary.outcomes.entry(row.outcome.clone()).or_default() += 1;
            summary.duration_s += row.duration_s;
            for name in row.broken() {
                *summary.violations.entry(name.into()).or_default() += 1;
            }
            if row.failed() {
                failures.entry([&row.fault, &row.phase, &row.verdict]).or_insert((0, place)).0 += 1;
            }
        }
        let failures = failures.into_iter().map(|([fault, phase, verdict], (flights, first))| {
            let row = rows.get(first);
            let line = row.and_then(|row| row.case().ok()).map(|case| case.line()).unwrap_or_default();
            Failure {
                fault: fault.into(),
                phase: phase.into(),
                verdict: verdict.into(),
                flights,
                first,
                reason: row.and_then(|row| row.reason.clone()).unwrap_or_default(),
                flown: line.clone(),
                line,
            }
        });
        summary.failures = failures.collect();
        summary.failures.sort_by_key(|failure| std::cmp::Reverse(failure.flights));
        summary
    }

    /// By fault, or both with `+` between them, how many cuts were needless, of how many; of those
    /// that had one.
    #[must_use]
    pub fn needless_by_fault(&self) -> BTreeMap<String, Rate> {
        let mut all: BTreeMap<String, Rate> = BTreeMap::new();
        let one = self.cells.iter().map(|((fault, _), cell)| (fault.clone(), cell));
        let two = self.pairs.iter().map(|((one, other), cell)| (format!("{one}+{other}"), cell));
        for (fault, cell) in one.chain(two) {
            let rate = all.entry(fault).or_default();
            *rate = Rate::of(rate.count + cell.needless, rate.of + cell.cuts);
        }
        all.retain(|_, rate| rate.count > 0);
        all
    }

    /// The cells of fault × moment as CSV, every fault of the table and every moment in order;
    /// first the flights without a fault.
    #[must_use]
    pub fn csv(&self, faults: &[FaultKind]) -> String {
        let head =
            "fault,phase,flights,idle,wrong_class,violated,failed,worst,cuts,needless_cuts,failed_low,failed_high\n";
        let mut text = head.to_owned();
        let mut line = |fault: &str, phase: &str, cell: &Cell| {
            let Cell { flights, idle, wrong, violated, cuts, needless, failed, worst } = cell;
            let [low, high] = cell.failing().interval();
            let _ = write!(text, "{fault},{phase},{flights},{idle},{wrong},{violated},{failed},{worst},");
            let _ = writeln!(text, "{cuts},{needless},{low:.6},{high:.6}");
        };
        if self.nominal.flights > 0 {
            line("none", "", &self.nominal);
        }
        for fault in faults {
            for phase in phases() {
                if let Some(cell) = self.cells.get(&(fault.name.to_owned(), phase.to_owned())) {
                    line(fault.name, phase, cell);
                }
            }
        }
        text
    }
}

/// The columns of fault × moment: every moment, and `time`.
pub fn phases() -> impl Iterator<Item = &'static str> {
    Moment::ALL.into_iter().map(Moment::name).chain(["time"])
}
