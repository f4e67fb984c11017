//! The list of field bugs, `xtask/bugs.toml`. Comments and order survive an update.

use crate::repository::{Failure, Repository};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

/// Its path in the repository.
pub const FILE: &str = "xtask/bugs.toml";

/// What a bug replaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Part of an expression; has a value wherever it stands.
    Expression,
    /// One or more statements, or the last expression of a block.
    Statement,
}

impl Kind {
    /// From the word in the list.
    pub fn named(word: &str) -> Option<Self> {
        match word {
            "expression" => Some(Self::Expression),
            "statement" => Some(Self::Statement),
            _ => None,
        }
    }
}

/// A bug that somebody's vehicle had.
#[derive(Clone, Debug, PartialEq)]
pub struct Bug {
    pub name: String,
    /// Where it was met.
    pub source: String,
    /// What is wrong, for people.
    pub what: String,
    /// The source file, from the top of the repository.
    pub file: String,
    pub kind: Kind,
    /// The right code, exactly as it stands there.
    pub from: String,
    pub to: String,
    /// A flight that shows it: `stampfly fly …`.
    pub flight: Option<String>,
    /// How that flight ends with it, as a campaign says it.
    pub ends: Option<String>,
    /// Why no flight of the campaign shows it.
    pub missed: Option<String>,
}

impl Default for Bug {
    fn default() -> Self {
        let [name, source, what, file, from, to] = Default::default();
        let [flight, ends, missed] = Default::default();
        Self { name, source, what, file, kind: Kind::Expression, from, to, flight, ends, missed }
    }
}

/// The list and the file that it comes from.
pub struct List {
    path: PathBuf,
    document: DocumentMut,
    pub bugs: Vec<Bug>,
}

impl List {
    pub fn read(repository: &Repository) -> Result<Self, Failure> {
        let path = repository.root.join(FILE);
        let text = fs::read_to_string(&path).map_err(|e| format!("{FILE}: {e}"))?;
        Self::parse(&text, path).map_err(|e| format!("{FILE}: {e}"))
    }

    fn parse(text: &str, path: PathBuf) -> Result<Self, Failure> {
        let document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
        let tables = document.get("bug").and_then(Item::as_array_of_tables).ok_or("no `[[bug]]`")?;
        let bugs = tables.iter().map(bug).collect::<Result<Vec<_>, _>>()?;
        let mut names = BTreeSet::new();
        match bugs.iter().find(|bug| !names.insert(&bug.name)) {
            Some(bug) => Err(format!("two bugs are called `{}`", bug.name)),
            None => Ok(Self { path, document, bugs }),
        }
    }

    /// Records the flight that shows a bug, and how it ends; `None` when none does.
    pub fn record(&mut self, name: &str, found: Option<(&str, &str)>) {
        let of_name = |table: &&mut Table| text(table, "name").is_ok_and(|other| other == name);
        let tables = self.document.get_mut("bug").and_then(Item::as_array_of_tables_mut);
        let table = tables.and_then(|tables: &mut ArrayOfTables| tables.iter_mut().find(of_name));
        let Some((table, bug)) = table.zip(self.bugs.iter_mut().find(|bug| bug.name == name)) else { return };
        if let Some((flight, ends)) = found {
            (table["flight"], table["ends"]) = (value(flight), value(ends));
            (bug.flight, bug.ends) = (Some(flight.to_owned()), Some(ends.to_owned()));
            table.remove("missed");
            bug.missed = None;
        } else {
            table.remove("flight");
            table.remove("ends");
            (bug.flight, bug.ends) = (None, None);
        }
    }

    pub fn write(&self) -> Result<(), Failure> {
        fs::write(&self.path, self.document.to_string()).map_err(|e| format!("{FILE}: {e}"))
    }
}

fn text(table: &Table, key: &str) -> Result<String, Failure> {
    let text = table.get(key).and_then(Item::as_str);
    text.map(str::to_owned).ok_or_else(|| format!("a bug without `{key}`:\n{table}"))
}

fn bug(table: &Table) -> Result<Bug, Failure> {
    let name = text(table, "name")?;
    let kind = text(table, "kind")?;
    let kind = Kind::named(&kind).ok_or_else(|| format!("{name}: `{kind}` is neither expression nor statement"))?;
    let get = |key: &str| text(table, key);
    let [flight, ends, missed] = ["flight", "ends", "missed"].map(|key| get(key).ok());
    if flight.is_some() != ends.is_some() || (flight.is_some() && missed.is_some()) {
        return Err(format!("{name}: it has `flight` and `ends`, or `missed`, or none of them"));
    }
    let (source, what, file) = (get("source")?, get("what")?, get("file")?);
    let bug = Bug { source, what, file, kind, from: get("from")?, to: get("to")?, flight, ends, missed, name };
    if bug.from.is_empty() || bug.from == bug.to {
        return Err(format!("{}: it replaces nothing", bug.name));
    }
    Ok(bug)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Why.\n\n[[bug]]\nname = \"one\"\nsource = \"s\"\nwhat = \"w\"\nfile = \"f\"\nkind = \"expression\"\nfrom = \"a\"\nto = \"b\"\n";

    fn list(text: &str) -> Result<List, Failure> {
        List::parse(text, PathBuf::new())
    }

    #[test]
    fn a_bug_needs_all_but_its_flight() {
        assert_eq!(list(TEXT).map(|list| list.bugs[0].flight.clone()), Ok(None));
        for line in ["name", "source", "what", "file", "kind", "from", "to"] {
            let without: String = TEXT.lines().filter(|l| !l.starts_with(line)).map(|l| format!("{l}\n")).collect();
            assert!(list(&without).is_err(), "{line}");
        }
        assert!(list(&TEXT.replace("expression", "word")).is_err());
        assert!(list(&TEXT.replace("\"b\"", "\"a\"")).is_err(), "it changes nothing");
        assert!(list(&format!("{TEXT}flight = \"stampfly fly\"\n")).is_err(), "a flight without its end");
        assert!(list(&format!("{TEXT}\n{}", &TEXT[8..])).is_err(), "twice the same name");
    }

    #[test]
    fn a_flight_is_recorded_and_forgotten() {
        let mut list = list(TEXT).expect("a list");
        list.record("one", Some(("stampfly fly --seed 1", "crashed")));
        let text = list.document.to_string();
        assert_eq!(text, format!("{TEXT}flight = \"stampfly fly --seed 1\"\nends = \"crashed\"\n"));
        assert_eq!(list.bugs[0].ends.as_deref(), Some("crashed"));
        list.record("one", None);
        assert_eq!(list.document.to_string(), TEXT);
        assert_eq!(list.bugs[0].flight, None);
    }
}
