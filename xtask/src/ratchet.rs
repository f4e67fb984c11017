//! Committed figures that may fall and may not rise: lines `name = number` of a small file, with a `tolerance`.

use crate::Failure;
use crate::repository::Repository;
use std::fs;

/// So much better, and the figure ought to follow.
const RATCHET: f64 = 0.03;

/// A file of such figures.
pub struct Budget {
    document: &'static str,
    text: String,
}

impl Budget {
    pub fn read(repository: &Repository, document: &'static str) -> Result<Self, Failure> {
        let text = fs::read_to_string(repository.root.join(document)).map_err(|e| format!("{document}: {e}"))?;
        Ok(Self { document, text })
    }

    /// The number in a line `name = number`.
    pub fn number(&self, name: &str) -> Result<f64, Failure> {
        number(&self.text, name).ok_or_else(|| format!("{}: no number `{name}`", self.document))
    }

    /// Says how a figure in `unit` compares with the one committed as `name`, and fails when it is too large.
    pub fn hold(&self, name: &str, measured: f64, unit: &str) -> Result<(), Failure> {
        let (allowed, tolerance) = (self.number(name)?, self.number("tolerance")?);
        let change = measured / allowed - 1.0;
        println!("{name}: {measured:.0} {unit}; the budget is {allowed:.0} ({:+.1} %)", change * 100.0);
        if change > tolerance {
            return Err(format!("{:.1} % over budget, {:.1} % is allowed", change * 100.0, tolerance * 100.0));
        }
        if change < -RATCHET {
            println!("well done: set {name} = {measured:.0} in {}", self.document);
        }
        Ok(())
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

    #[test]
    fn reads_its_file() {
        assert_eq!(number("# a = 1\na_b = 3\na = 1_000 # why\n", "a"), Some(1000.0));
        assert_eq!(number("ab = 1", "a"), None);
    }

    #[test]
    fn lets_pass_what_is_tolerated_and_no_more() {
        let budget = Budget { document: "here", text: "step = 1000\ntolerance = 0.03\n".to_owned() };
        assert!(budget.hold("step", 800.0, "bytes").is_ok());
        assert!(budget.hold("step", 1029.0, "bytes").is_ok());
        assert!(budget.hold("step", 1031.0, "bytes").is_err());
        assert!(budget.hold("other", 1.0, "bytes").is_err());
    }
}
