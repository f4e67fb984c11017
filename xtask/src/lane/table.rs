//! What came of each step and what it took, for the terminal and as a file.

use crate::repository::{Repository, capture};
use crate::step::Lane;
use std::fmt::Write;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Passed,
    /// For this commit within a day, in an earlier run.
    PassedEarlier,
    Failed,
}

impl Outcome {
    const fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::PassedEarlier => "passed earlier",
            Self::Failed => "FAILED",
        }
    }
}

/// A step that has ended.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub name: &'static str,
    pub outcome: Outcome,
    pub seconds: f64,
}

pub struct Table {
    pub lane: Lane,
    pub rows: Vec<Row>,
    /// Of the whole run.
    pub seconds: f64,
}

impl Table {
    pub fn passed(&self) -> usize {
        self.rows.iter().filter(|row| row.outcome != Outcome::Failed).count()
    }

    /// Names of the steps that failed.
    pub fn failed(&self) -> Vec<&'static str> {
        self.rows.iter().filter(|row| row.outcome == Outcome::Failed).map(|row| row.name).collect()
    }

    /// For a terminal.
    pub fn text(&self) -> String {
        let mut text = format!("\n{:<14} {:>8}  result\n", "step", "seconds");
        for Row { name, outcome, seconds } in &self.rows {
            let _ = writeln!(text, "{name:<14} {seconds:>8.1}  {}", outcome.word());
        }
        let _ = writeln!(text, "{:<14} {:>8.1}  {}", self.lane.name(), self.seconds, self.outcome().word());
        text
    }

    /// For a file.
    pub fn markdown(&self, repository: &Repository) -> String {
        let commit = capture(repository.command("git").args(["describe", "--always", "--dirty", "--abbrev=12"]));
        let commit = commit.map_or_else(|_| "an unknown commit".to_owned(), |(said, _)| said.trim().to_owned());
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let mut text = format!(
            "# `cargo xtask {}`\n\nCommit {commit}, {cores} cores.\n\n| step | seconds | result |\n|---|---:|---|\n",
            self.lane.name()
        );
        for Row { name, outcome, seconds } in &self.rows {
            let _ = writeln!(text, "| `{name}` | {seconds:.1} | {} |", outcome.word());
        }
        let _ = writeln!(text, "| all | {:.1} | {} |", self.seconds, self.outcome().word());
        text
    }

    fn outcome(&self) -> Outcome {
        if self.failed().is_empty() { Outcome::Passed } else { Outcome::Failed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_failure_fails_the_whole_and_is_named() {
        let row = |name, outcome| Row { name, outcome, seconds: 1.0 };
        let rows = vec![row("a", Outcome::Passed), row("b", Outcome::Failed), row("c", Outcome::PassedEarlier)];
        let table = Table { lane: Lane::Ci, rows, seconds: 2.0 };
        assert_eq!((table.passed(), table.failed()), (2, vec!["b"]));
        assert!(table.text().ends_with("ci                  2.0  FAILED\n"), "{}", table.text());
    }
}
