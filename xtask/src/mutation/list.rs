//! The list of mutants that no test can or need tell from the program, and the record of what has been run:
//! `xtask/mutants.toml`. Comments and order survive an update.

use crate::repository::{Failure, Repository};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use toml_edit::{DocumentMut, Item, Table, value};

/// Its path in the repository.
pub const FILE: &str = "xtask/mutants.toml";

/// What has become of the mutants of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Figures {
    /// All that the tool makes.
    pub mutants: usize,
    /// A test fails.
    pub caught: usize,
    /// They survive, and the list says why.
    pub explained: usize,
    /// The compiler refuses them.
    pub unviable: usize,
}

/// A file whose mutants were all run.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    pub file: String,
    pub figures: Figures,
    /// Of the text that was run.
    pub digest: String,
}

/// The list and the file that it comes from.
#[derive(Debug)]
pub struct List {
    path: PathBuf,
    document: DocumentMut,
    /// Label of a mutant, and why it may survive.
    pub explained: BTreeMap<String, String>,
    /// Labels of the mutants that are run without a name.
    pub sample: Vec<String>,
    pub records: Vec<Record>,
}

impl List {
    pub fn read(repository: &Repository) -> Result<Self, Failure> {
        let path = repository.root.join(FILE);
        let text = fs::read_to_string(&path).map_err(|e| format!("{FILE}: {e}"))?;
        Self::parse(&text, path).map_err(|e| format!("{FILE}: {e}"))
    }

    pub fn parse(text: &str, path: PathBuf) -> Result<Self, Failure> {
        let document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
        let mut explained = BTreeMap::new();
        for table in document.get("explained").and_then(Item::as_array_of_tables).into_iter().flatten() {
            let why = table.get("why").and_then(Item::as_str).filter(|why| !why.is_empty());
            let why = why.ok_or_else(|| format!("mutants that nothing explains:\n{table}"))?;
            for label in labels(table, "mutants")? {
                if explained.insert(label.clone(), why.to_owned()).is_some() {
                    return Err(format!("explained twice: {label}"));
                }
            }
        }
        let sample = document
            .get("sample")
            .and_then(Item::as_table)
            .map_or_else(|| Ok(vec![]), |sample| labels(sample, "mutants"))?;
        if let Some(label) = sample.iter().find(|label| explained.contains_key(*label)) {
            return Err(format!("it is to be caught, and explained as well: {label}"));
        }
        let files = document.get("files").and_then(Item::as_table);
        let records = files.into_iter().flatten().map(|(file, item)| record(file, item)).collect::<Result<_, _>>()?;
        Ok(Self { path, document, explained, sample, records })
    }

    /// Why a mutant may survive.
    pub fn why(&self, label: &str) -> Option<&str> {
        self.explained.get(label).map(String::as_str)
    }

    /// Records that a file was run.
    pub fn record(&mut self, record: Record) {
        let Record { file, figures, digest } = &record;
        let files = self.document.entry("files").or_insert_with(|| Item::Table(Table::new()));
        let mut inline = toml_edit::InlineTable::new();
        let figures = [figures.mutants, figures.caught, figures.explained, figures.unviable];
        for (name, figure) in NAMES.into_iter().zip(figures) {
            inline.insert(name, i64::try_from(figure).unwrap_or_default().into());
        }
        inline.insert("text", digest.as_str().into());
        files[file.as_str()] = value(inline);
        match self.records.iter_mut().find(|known| known.file == *file) {
            Some(known) => *known = record,
            None => self.records.push(record),
        }
    }

    pub fn write(&self) -> Result<(), Failure> {
        fs::write(&self.path, self.document.to_string()).map_err(|e| format!("{FILE}: {e}"))
    }
}

/// Figures of a record, in the order of [`Figures`].
const NAMES: [&str; 4] = ["mutants", "caught", "explained", "unviable"];

fn labels(table: &Table, key: &str) -> Result<Vec<String>, Failure> {
    let array = table.get(key).and_then(Item::as_array).ok_or_else(|| format!("no list `{key}`:\n{table}"))?;
    let label = |value: &toml_edit::Value| value.as_str().map(str::to_owned).ok_or_else(|| format!("no text: {value}"));
    array.iter().map(label).collect()
}

fn record(file: &str, item: &Item) -> Result<Record, Failure> {
    let number = |name: &str| item.get(name).and_then(Item::as_integer).and_then(|number| number.try_into().ok());
    let [mutants, caught, explained, unviable] = NAMES.map(number);
    let figures =
        (|| Some(Figures { mutants: mutants?, caught: caught?, explained: explained?, unviable: unviable? }))();
    let digest = item.get("text").and_then(Item::as_str);
    let (figures, digest) = figures.zip(digest).ok_or_else(|| format!("{file}: no record: {item}"))?;
    Ok(Record { file: file.to_owned(), figures, digest: digest.to_owned() })
}

/// Tells texts apart: FNV-1a.
pub fn digest(text: &[u8]) -> String {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    format!("{:016x}", text.iter().fold(0xcbf2_9ce4_8422_2325, step))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Why.\n[sample]\nmutants = [\"f: z\"]\n\n[[explained]]\nwhy = \"w\"\nmutants = [\n    \"f: x\",\n    \"f: y\",\n]\n\n[files]\n\"a.rs\" = { mutants = 4, caught = 2, explained = 1, unviable = 1, text = \"00\" }\n";

    fn list(text: &str) -> Result<List, Failure> {
        List::parse(text, PathBuf::new())
    }

    #[test]
    fn a_mutant_is_explained_once_and_by_words() {
        let read = list(TEXT).expect("a list");
        assert_eq!((read.why("f: y"), read.why("f: z")), (Some("w"), None));
        assert_eq!(read.records[0].figures, Figures { mutants: 4, caught: 2, explained: 1, unviable: 1 });
        assert!(list(&TEXT.replace("f: y", "f: x")).is_err(), "twice");
        assert!(list(&TEXT.replace("f: y", "f: z")).is_err(), "to be caught, too");
        assert!(list(&TEXT.replace("\"w\"", "\"\"")).is_err(), "by nothing");
        assert!(list(&TEXT.replace("caught = 2, ", "")).is_err(), "half a record");
    }

    #[test]
    fn a_record_replaces_that_of_the_same_file_and_keeps_the_rest() {
        let mut read = list(TEXT).expect("a list");
        let figures = Figures { mutants: 9, caught: 9, ..Figures::default() };
        for file in ["a.rs", "b.rs"] {
            read.record(Record { file: file.into(), figures, digest: "01".into() });
        }
        let line =
            |file| format!("\"{file}\" = {{ mutants = 9, caught = 9, explained = 0, unviable = 0, text = \"01\" }}\n");
        let head = TEXT.split_once("\"a.rs\"").expect("a record").0;
        assert_eq!(read.document.to_string(), format!("{head}{}{}", line("a.rs"), line("b.rs")));
        assert_eq!(read.records.len(), 2);
    }

    /// Without the tool, which is not there in `ci`.
    #[test]
    fn the_committed_list_fits_the_sources_and_its_record() {
        let repository = Repository::find();
        let list = List::read(&repository).expect("the list");
        for label in list.explained.keys().chain(&list.sample) {
            let (file, change) = label.split_once(": ").expect("a file");
            let source = fs::read_to_string(repository.root.join(file)).expect(label);
            let change = change.split(" #").next().unwrap_or(change);
            if let Some((_, function)) = change.rsplit_once(" in ") {
                let name = function.rsplit("::").next().unwrap_or(function);
                assert!(source.contains(&format!("fn {name}")), "{label}");
            }
        }
        for Record { file, figures, .. } in &list.records {
            let explained = list.explained.keys().filter(|label| label.starts_with(&format!("{file}: "))).count();
            assert_eq!(figures.explained, explained, "{file}");
            assert_eq!(figures.caught + figures.explained + figures.unviable, figures.mutants, "{file}");
        }
    }

    #[test]
    fn texts_that_differ_have_other_digests() {
        assert_eq!(digest(b""), "cbf29ce484222325");
        assert_ne!(digest(b"a < b"), digest(b"a > b"));
    }
}
