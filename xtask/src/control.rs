//! The list of what is broken to see each step fail, `xtask/controls.toml`, and its table in `docs/reference/checks.md`.

use crate::repository::{Failure, Repository};
use std::fmt::Write;
use std::fs;
use std::path::PathBuf;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

/// Its path in the repository.
const FILE: &str = "xtask/controls.toml";
/// The document, and what is before and after the table.
pub const PLACE: (&str, &str, &str) =
    ("docs/reference/checks.md", "<!-- controls: cargo xtask docs --fix -->\n", "<!-- end of controls -->");

/// What is broken to see one step fail.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Control {
    /// Name of the step.
    pub step: String,
    /// What is broken, for people.
    pub what: String,
    /// Text that the step has to write.
    pub says: String,
    /// The line in which it wrote that, when the control was tried last.
    pub said: Option<String>,
    pub changes: Vec<Change>,
    /// Words after the name of the step.
    pub arguments: Vec<String>,
    /// Environment variables for the step.
    pub environment: Vec<(String, String)>,
}

/// A change of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Its path from the top of the repository.
    pub file: String,
    /// The right text, which is in the file once; if empty, the wrong one is added at the end.
    pub right: String,
    pub wrong: String,
}

impl Change {
    /// The file with the change.
    pub fn broken(&self, text: &str) -> Result<String, Failure> {
        match (self.right.as_str(), text.matches(&self.right).count()) {
            ("", _) => Ok(format!("{text}{}", self.wrong)),
            (right, 1) => Ok(text.replacen(right, &self.wrong, 1)),
            (right, times) => Err(format!("`{right}` is there {times} times, not once")),
        }
    }
}

/// The list and the file that it comes from.
pub struct List {
    path: PathBuf,
    document: DocumentMut,
    pub controls: Vec<Control>,
}

impl List {
    pub fn read(repository: &Repository) -> Result<Self, Failure> {
        let path = repository.root.join(FILE);
        let text = fs::read_to_string(&path).map_err(|e| format!("{FILE}: {e}"))?;
        Self::parse(&text, path).map_err(|e| format!("{FILE}: {e}"))
    }

    fn parse(text: &str, path: PathBuf) -> Result<Self, Failure> {
        let document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
        let tables = document.get("control").and_then(Item::as_array_of_tables).ok_or("no `[[control]]`")?;
        let controls = tables.iter().map(control).collect::<Result<_, _>>()?;
        Ok(Self { path, document, controls })
    }

    /// Records what a step said, and writes the file. Its comments survive.
    pub fn record(&mut self, step: &str, said: &str) -> Result<(), Failure> {
        let tables = self.document.get_mut("control").and_then(Item::as_array_of_tables_mut);
        let of_step = |table: &&mut Table| table.get("step").and_then(Item::as_str) == Some(step);
        if let Some(table) = tables.and_then(|tables: &mut ArrayOfTables| tables.iter_mut().find(of_step)) {
            table["said"] = value(said);
        }
        for control in self.controls.iter_mut().filter(|control| control.step == step) {
            control.said = Some(said.to_owned());
        }
        fs::write(&self.path, self.document.to_string()).map_err(|e| format!("{FILE}: {e}"))
    }

    /// The table of the document.
    pub fn table(&self) -> String {
        let mut text = String::from("\n| step | broken | what it said |\n|---|---|---|\n");
        for Control { step, what, said, .. } in &self.controls {
            let what = what.replace('|', "\\|");
            let _ = match said {
                Some(said) => {
                    writeln!(text, "| `{step}` | {what} | `{}` |", said.replace('|', "\\|").replace('`', "'"))
                }
                None => writeln!(text, "| `{step}` | {what} | not tried yet |"),
            };
        }
        text + "\n"
    }
}

fn control(table: &Table) -> Result<Control, Failure> {
    let text = |table: &Table, key: &str| {
        table.get(key).and_then(Item::as_str).map(str::to_owned).ok_or_else(|| format!("a control without `{key}`"))
    };
    let change = |table: &Table| {
        let right = table.get("right").and_then(Item::as_str).unwrap_or_default().to_owned();
        Ok::<_, Failure>(Change { file: text(table, "file")?, right, wrong: text(table, "wrong")? })
    };
    let changes = table.get("change").and_then(Item::as_array_of_tables).into_iter().flatten();
    let arguments = table.get("arguments").and_then(Item::as_array).into_iter().flatten();
    let variables = table.get("environment").and_then(Item::as_table_like).into_iter().flat_map(|table| table.iter());
    Ok(Control {
        step: text(table, "step")?,
        what: text(table, "what")?,
        says: text(table, "says")?,
        said: table.get("said").and_then(Item::as_str).map(str::to_owned),
        changes: changes.map(change).collect::<Result<_, _>>()?,
        arguments: arguments.filter_map(|word| Some(word.as_str()?.to_owned())).collect(),
        environment: variables
            .map(|(key, value)| (key.to_owned(), value.as_str().unwrap_or_default().to_owned()))
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_replaces_what_is_there_once() {
        let change = |right: &str| Change { file: "a".into(), right: right.into(), wrong: "z".into() };
        assert_eq!(change("b").broken("abc"), Ok("azc".into()));
        assert_eq!(change("").broken("abc\n"), Ok("abc\nz".into()));
        assert!(change("a").broken("aba").is_err());
        assert!(change("x").broken("aba").is_err());
    }

    #[test]
    fn a_list_is_read_printed_and_written() {
        let text = "# Why.\n[[control]]\nstep = \"fmt\"\nwhat = \"a | b\"\nsays = \"Diff\"\nenvironment = { CI = \"true\" }\n\
                    [[control.change]]\nfile = \"a.rs\"\nright = \"x\"\nwrong = \"y\"\n";
        let path = std::env::temp_dir().join(format!("stampfly-controls-{}.toml", std::process::id()));
        let mut list = List::parse(text, path.clone()).expect("a list");
        let change = Change { file: "a.rs".into(), right: "x".into(), wrong: "y".into() };
        assert_eq!(list.controls[0].changes, [change]);
        assert_eq!(list.controls[0].environment, [("CI".into(), "true".into())]);
        assert!(list.table().contains("| `fmt` | a \\| b | not tried yet |"));
        list.record("fmt", "Diff in a.rs").expect("written");
        assert!(list.table().contains("| `fmt` | a \\| b | `Diff in a.rs` |"));
        let written = fs::read_to_string(&path).expect("the file");
        assert!(written.starts_with("# Why.\n") && written.contains("said = \"Diff in a.rs\""), "{written}");
        fs::remove_file(&path).expect("the file");
        assert!(List::parse("[[control]]\nstep = \"fmt\"\n", path).is_err());
    }
}
