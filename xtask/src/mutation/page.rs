//! The table of mutants in `docs/explain/safety.md`.

use super::list::{Figures, List, Record};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The document, and what is before and after the table.
pub const PLACE: (&str, &str, &str) =
    ("docs/explain/safety.md", "<!-- mutants: cargo xtask docs --fix -->\n", "<!-- end of mutants -->");

/// Figures of every file and their sum. A row begins with no code: in this document such rows are known failures of the campaign.
pub fn table(list: &List) -> String {
    let mut text = "\n| file | mutants | caught | explained | do not compile |\n|---|---|---|---|---|\n".to_owned();
    let mut all = Figures::default();
    let records: BTreeMap<&str, &Record> = list.records.iter().map(|record| (record.file.as_str(), record)).collect();
    for (file, Record { figures, .. }) in records {
        text += &row(file, figures);
        all.mutants += figures.mutants;
        all.caught += figures.caught;
        all.explained += figures.explained;
        all.unviable += figures.unviable;
    }
    text + &row("all", &all) + "\n"
}

/// A line of the table.
fn row(name: &str, figures: &Figures) -> String {
    let Figures { mutants, caught, explained, unviable } = figures;
    let mut text = String::new();
    let _ = writeln!(text, "| {name} | {mutants} | {caught} | {explained} | {unviable} |");
    text
}
