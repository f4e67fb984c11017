//! What the flights of a fault campaign say together: how many passed, every cell of fault × moment, every kind of failure.

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
    /// That failed, for either reason.
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
        self.failed += usize::from(row.failed());
        if self.flights == 1 || severity(&row.outcome) > severity(&self.worst) {
            self.worst.clone_from(&row.outcome);
        }
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
    /// The line that repeats it, in its smallest form if one has been looked for.
    pub line: String,
}

/// A table whose rows are faults.
pub type Table = BTreeMap<(String, String), Cell>;

/// What the flights say together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// All flights.
    pub all: Cell,
    /// Fault and moment, of flights with one fault.
    pub cells: Table,
    /// Fault and other fault, of flights with two.
    pub pairs: Table,
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
            let key = match row.fault.split_once('+') {
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
        let failures = failures.into_iter().map(|([fault, phase, verdict], (flights, first))| Failure {
            fault: fault.into(),
            phase: phase.into(),
            verdict: verdict.into(),
            flights,
            first,
            line: rows.get(first).and_then(|row| row.case().ok()).map(|case| case.line()).unwrap_or_default(),
        });
        summary.failures = failures.collect();
        summary.failures.sort_by_key(|failure| std::cmp::Reverse(failure.flights));
        summary
    }

    /// The cells of fault × moment as CSV, every fault of the table and every moment in order.
    #[must_use]
    pub fn csv(&self, faults: &[FaultKind]) -> String {
        let mut text = "fault,phase,flights,idle,wrong_class,violated,failed,worst\n".to_owned();
        for fault in faults {
            for phase in phases() {
                if let Some(cell) = self.cells.get(&(fault.name.to_owned(), phase.to_owned())) {
                    let Cell { flights, idle, wrong, violated, failed, worst } = cell;
                    let name = fault.name;
                    let _ = writeln!(text, "{name},{phase},{flights},{idle},{wrong},{violated},{failed},{worst}");
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
