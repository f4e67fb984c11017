//! Committed figures that may not rise, and that follow when they fall: lines `name = number` of a small file.
//!
//! The file says how far a figure may be off, as a part of it (`tolerance`) and, where figures may be small, in its own
//! unit (`slack`, 0 when it is not there). Beyond that it fails either way: what was gained would otherwise be lost again
//! without anybody noticing.

use crate::Failure;
use crate::repository::Repository;
use std::fs;
use std::path::PathBuf;

/// A file of such figures.
pub struct Budget {
    document: &'static str,
    path: PathBuf,
    text: String,
}

impl Budget {
    pub fn read(repository: &Repository, document: &'static str) -> Result<Self, Failure> {
        let path = repository.root.join(document);
        let text = fs::read_to_string(&path).map_err(|e| format!("{document}: {e}"))?;
        Ok(Self { document, path, text })
    }

    /// The number in a line `name = number`.
    fn number(&self, name: &str) -> Result<f64, Failure> {
        number(&self.text, name).ok_or_else(|| format!("{}: no number `{name}`", self.document))
    }

    /// How far a figure may be off, as a part of it.
    pub fn tolerance(&self) -> Result<f64, Failure> {
        self.number("tolerance")
    }

    /// Says how a figure in `unit` compares with the one committed as `name`, and fails when it is too large, or so small
    /// that the committed one ought to follow.
    pub fn hold(&self, name: &str, measured: f64, unit: &str) -> Result<(), Failure> {
        let (committed, tolerance) = (self.number(name)?, self.tolerance()?);
        let slack = number(&self.text, "slack").unwrap_or_default();
        let change = measured - committed;
        println!("{name}: {measured:.0} {unit}; the budget is {committed:.0} ({change:+.0})");
        if change.abs() <= (committed * tolerance).max(slack) {
            return Ok(());
        }
        let document = self.document;
        Err(if change > 0.0 {
            format!("{name}: {measured:.0} {unit} are more than the budget of {committed:.0} in {document}")
        } else {
            format!("{name}: lower it to {measured:.0} in {document}, so that the gain is kept; it is {committed:.0}")
        })
    }

    /// Sets a figure, in its line or in a new one at the end.
    pub fn set(&mut self, name: &str, measured: f64) {
        let line = format!("{name} = {measured:.0}");
        let is_it = |old: &str| old.split_once('=').is_some_and(|(key, _)| key.trim() == name);
        let mut lines: Vec<&str> = self.text.lines().collect();
        match lines.iter().position(|old| is_it(old)) {
            Some(place) => lines[place] = &line,
            None => lines.push(&line),
        }
        self.text = lines.join("\n") + "\n";
    }

    /// Writes the file.
    pub fn write(&self) -> Result<(), Failure> {
        fs::write(&self.path, &self.text).map_err(|e| format!("{}: {e}", self.document))
    }
}

fn number(text: &str, name: &str) -> Option<f64> {
    text.lines().find_map(|line| {
        let (key, value) = line.split_once('=')?;
        let value = value.split('#').next()?.trim().replace('_', "");
        (key.trim() == name).then(|| value.parse().ok())?
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budget(text: &str) -> Budget {
        Budget { document: "here", path: PathBuf::new(), text: text.to_owned() }
    }

    #[test]
    fn reads_its_file() {
        assert_eq!(number("# a = 1\na_b = 3\na = 1_000 # why\n", "a"), Some(1000.0));
        assert_eq!(number("ab = 1", "a"), None);
    }

    #[test]
    fn lets_pass_what_is_tolerated_and_no_more() {
        let budget = budget("step = 1000\ntolerance = 0.03\n");
        let passes = |measured| budget.hold("step", measured, "bytes").is_ok();
        assert!(passes(1029.0) && passes(971.0) && passes(1000.0));
        assert!(!passes(1031.0));
        assert!(budget.hold("other", 1.0, "bytes").is_err());
    }

    #[test]
    fn a_gain_has_to_be_kept() {
        let said = budget("step = 1000\ntolerance = 0.03\n").hold("step", 969.0, "bytes");
        assert!(said.is_err_and(|said| said.contains("lower it to 969")));
    }

    #[test]
    fn small_figures_have_their_slack() {
        let budget = budget("none = 0\nsmall = 100\ntolerance = 0.03\nslack = 64\n");
        assert!(budget.hold("none", 0.0, "bytes").is_ok());
        assert!(budget.hold("none", 65.0, "bytes").is_err());
        assert!(budget.hold("small", 36.0, "bytes").is_ok());
        assert!(budget.hold("small", 35.0, "bytes").is_err());
    }

    #[test]
    fn sets_a_figure_in_its_line() {
        let mut budget = budget("# a = 1\na = 1_000\nb = 2\n");
        budget.set("a", 5.4);
        budget.set("c", 7.0);
        assert_eq!(budget.text, "# a = 1\na = 5\nb = 2\nc = 7\n");
    }
}
