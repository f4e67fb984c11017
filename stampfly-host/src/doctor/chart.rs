//! What was found: a table for people, a file to send with a report.

use stampfly_flight::doctor::Verdict;
use std::fmt::{self, Write};

/// One result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// What was examined when it passed; the fault's stable name when it did not.
    pub name: String,
    /// How it ended.
    pub verdict: Verdict,
    /// What was seen.
    pub seen: String,
    /// What to do; empty when nothing.
    pub advice: String,
}

/// All results of one examination, and everything that was said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Chart {
    /// In the order in which they were found.
    pub rows: Vec<Row>,
    /// Every answer of the vehicle and of whoever stood beside it.
    pub transcript: String,
}

impl Chart {
    /// Notes what is as it should be.
    pub fn pass(&mut self, name: &str, seen: impl fmt::Display) {
        self.note(name, Verdict::Pass, seen, "");
    }

    /// Notes a result. A fault that is noted already is not noted again.
    pub fn note(&mut self, name: &str, verdict: Verdict, seen: impl fmt::Display, advice: &str) {
        if !self.rows.iter().any(|row| row.name == name) {
            let row = Row { name: name.to_owned(), verdict, seen: seen.to_string(), advice: advice.to_owned() };
            self.rows.push(row);
        }
    }

    /// What did not pass.
    pub fn findings(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.verdict != Verdict::Pass)
    }

    /// The file to send: what was found, and the whole conversation.
    #[must_use]
    pub fn file(&self) -> String {
        let mut text = format!("stampfly {} doctor\n\n{self}\n", env!("CARGO_PKG_VERSION"));
        let _ = write!(text, "Everything that was said\n------------------------\n{}", self.transcript);
        text
    }
}

/// A line each; below it, what to do.
impl fmt::Display for Chart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Row { name, verdict, seen, advice } in &self.rows {
            writeln!(f, "{verdict:<5}{name:<26}{seen}")?;
            if !advice.is_empty() {
                writeln!(f, "{:31}-> {advice}", "")?;
            }
        }
        match self.findings().count() {
            0 => writeln!(f, "\nAll passed."),
            1 => writeln!(f, "\nOne thing is not as it should be."),
            more => writeln!(f, "\n{more} things are not as they should be."),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_has_everything() {
        let mut chart = Chart { transcript: "> status\nIdleGround\n".into(), ..Chart::default() };
        chart.pass("battery", "4.1 V");
        assert!(chart.to_string().contains("All passed."));
        chart.note("imu-dead", Verdict::Fail, "no sample", "look at its wires");
        chart.note("imu-dead", Verdict::Look, "again", "");
        assert_eq!(chart.findings().map(|row| row.name.as_str()).collect::<Vec<_>>(), ["imu-dead"]);
        let file = chart.file();
        for part in ["pass battery", "FAIL imu-dead", "-> look at its wires", "One thing", "IdleGround"] {
            assert!(file.contains(part), "{part} is missing:\n{file}");
        }
    }
}
