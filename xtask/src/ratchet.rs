//! Committed figures that may not rise, and that have to follow when they fall: the numbers of a TOML file.
//!
//! A figure may differ from the committed one by `tolerance`, a fraction of it, or by `slack`, in its own unit, where that is
//! more. Beyond that it fails in both directions: a gain that is not committed is lost again unnoticed. Comments of the file
//! survive an update.

use crate::repository::{Failure, Repository};
use std::fs;
use std::path::PathBuf;
use toml_edit::{DocumentMut, Item, Table, Value, value};

/// A file of such figures.
pub struct Budget {
    /// Its path in the repository.
    name: &'static str,
    path: PathBuf,
    document: DocumentMut,
}

impl Budget {
    pub fn read(repository: &Repository, name: &'static str) -> Result<Self, Failure> {
        let path = repository.root.join(name);
        let text = fs::read_to_string(&path).map_err(|e| format!("{name}: {e}"))?;
        let document = text.parse().map_err(|e| format!("{name}: {e}"))?;
        Ok(Self { name, path, document })
    }

    /// Fraction of a figure that it may differ by.
    pub fn tolerance(&self) -> Result<f64, Failure> {
        self.number(&["tolerance"])
    }

    /// Compares a measured figure with the committed one. `key` is its path in the file, such as `["flash", "core"]`.
    pub fn hold(&self, key: &[&str], measured: f64, unit: &str) -> Result<(), Failure> {
        let (committed, tolerance) = (self.number(key)?, self.tolerance()?);
        let slack = self.find(&["slack"]).and_then(number).unwrap_or_default();
        let (figure, file, change) = (key.join("."), self.name, measured - committed);
        println!("{figure}: {measured:.0} {unit}; committed {committed:.0} ({change:+.0})");
        if change.abs() <= (committed * tolerance).max(slack) {
            return Ok(());
        }
        Err(if change > 0.0 {
            format!("{figure}: {measured:.0} {unit} exceed the {committed:.0} of {file}")
        } else {
            format!("{figure}: lower {committed:.0} in {file} to {measured:.0} to keep the gain")
        })
    }

    /// Sets a figure, rounded to an integer.
    pub fn set(&mut self, key: &[&str], measured: f64) -> Result<(), Failure> {
        let [tables @ .., figure] = key else { return Err("a figure without a name".to_owned()) };
        let mut table: &mut Table = &mut self.document;
        for name in tables {
            let item = table.entry(name).or_insert_with(|| Item::Table(Table::new()));
            table = item.as_table_mut().ok_or_else(|| format!("{}: `{name}` is no table", self.name))?;
        }
        match table.get_mut(figure).and_then(Item::as_value_mut) {
            // Keeps the spaces and the comment of its line.
            Some(old) => {
                let decor = old.decor().clone();
                *old = Value::from(measured.round() as i64);
                *old.decor_mut() = decor;
            }
            None => {
                table.insert(figure, value(measured.round() as i64));
            }
        }
        Ok(())
    }

    /// The figures of a table.
    pub fn names(&self, table: &str) -> Vec<String> {
        let table = self.document.get(table).and_then(Item::as_table);
        table.into_iter().flatten().map(|(name, _)| name.to_owned()).collect()
    }

    /// Removes a figure of a table.
    pub fn remove(&mut self, table: &str, name: &str) {
        if let Some(table) = self.document.get_mut(table).and_then(Item::as_table_mut) {
            table.remove(name);
        }
    }

    /// Writes the file.
    pub fn write(&self) -> Result<(), Failure> {
        fs::write(&self.path, self.document.to_string()).map_err(|e| format!("{}: {e}", self.name))
    }

    fn find(&self, key: &[&str]) -> Option<&Item> {
        key.iter().try_fold(self.document.as_item(), |item, name| item.get(name))
    }

    fn number(&self, key: &[&str]) -> Result<f64, Failure> {
        self.find(key).and_then(number).ok_or_else(|| format!("{}: no number `{}`", self.name, key.join(".")))
    }
}

/// The value of a TOML integer or float.
fn number(item: &Item) -> Option<f64> {
    item.as_float().or_else(|| item.as_integer().map(|integer| integer as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budget(text: &str) -> Budget {
        Budget { name: "here", path: PathBuf::new(), document: text.parse().expect("valid TOML") }
    }

    #[test]
    fn reads_integers_floats_and_tables() {
        let budget = budget("a = 1_000 # why\n[b]\n\"c, d\" = 2.5\n");
        assert_eq!(budget.number(&["a"]), Ok(1000.0));
        assert_eq!(budget.number(&["b", "c, d"]), Ok(2.5));
        assert!(budget.number(&["b"]).is_err() && budget.number(&["c, d"]).is_err());
    }

    #[test]
    fn a_figure_may_differ_by_the_tolerance_and_no_more() {
        let budget = budget("step = 1000\ntolerance = 0.03\n");
        let passes = |measured| budget.hold(&["step"], measured, "bytes").is_ok();
        assert!(passes(1029.0) && passes(971.0) && passes(1000.0));
        assert!(!passes(1031.0));
        assert!(budget.hold(&["other"], 1.0, "bytes").is_err());
    }

    #[test]
    fn a_gain_has_to_be_committed() {
        let said = budget("step = 1000\ntolerance = 0.03\n").hold(&["step"], 969.0, "bytes");
        assert!(said.is_err_and(|said| said.contains("to 969")));
    }

    #[test]
    fn small_figures_have_slack() {
        let budget = budget("none = 0\nsmall = 100\ntolerance = 0.03\nslack = 64\n");
        let passes = |name, measured| budget.hold(&[name], measured, "bytes").is_ok();
        assert!(passes("none", 0.0) && passes("small", 36.0));
        assert!(!passes("none", 65.0) && !passes("small", 35.0));
    }

    #[test]
    fn an_update_keeps_comments_and_order() {
        let mut budget = budget("# first\na = 1_000 # why\nb = 2\n\n[t]\n# inner\nd = 9\n");
        budget.set(&["a"], 5.4).expect("a figure");
        budget.set(&["t", "d"], 7.6).expect("a figure");
        budget.set(&["t", "e"], 3.0).expect("a new figure");
        budget.set(&["u", "f"], 4.0).expect("a new table");
        let text = "# first\na = 5 # why\nb = 2\n\n[t]\n# inner\nd = 8\ne = 3\n\n[u]\nf = 4\n";
        assert_eq!(budget.document.to_string(), text);
        assert!(budget.set(&["b", "x"], 1.0).is_err());
        assert_eq!(budget.names("t"), ["d", "e"]);
        budget.remove("t", "d");
        assert_eq!(budget.names("t"), ["e"]);
    }
}
