//! `files`: no source files of one crate that depend on each other in a cycle.
//!
//! Files in a cycle can only be understood, tested and moved together. How uses are found is written in
//! [`modules`](crate::modules). Cycles that are still there are listed in `xtask/cycles.toml`; an entry without a cycle fails
//! as well, so the list can only shrink.

use crate::arguments::Arguments;
use crate::modules::{Modules, cycles};
use crate::repository::{Failure, Repository, capture};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use toml_edit::{DocumentMut, Item, Value};

const KNOWN: &str = "xtask/cycles.toml";

/// Files of the repository that use each other.
type Cycle = BTreeSet<String>;

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let text = fs::read_to_string(repository.root.join(KNOWN)).map_err(|e| format!("{KNOWN}: {e}"))?;
    let known = known(&text).map_err(|e| format!("{KNOWN}: {e}"))?;
    let (mut files, mut found) = (0, Vec::new());
    for root in roots(repository)? {
        let uses = Modules::read(&repository.root.join(root))?.uses();
        files += uses.len();
        let name = |path: &PathBuf| path.strip_prefix(&repository.root).unwrap_or(path).to_string_lossy().into_owned();
        for cycle in cycles(&uses) {
            for file in &cycle {
                let inside = uses.get(file).into_iter().flatten().filter(|(other, _)| cycle.contains(*other));
                inside.for_each(|(other, path)| println!("{} uses {} of {}", name(file), path, name(other)));
            }
            println!();
            found.push(cycle.iter().map(name).collect::<Cycle>());
        }
    }
    println!("{files} files, {} cycles", found.len());
    let failures = compare(&found, &known);
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// Root files of all crates.
fn roots(repository: &Repository) -> Result<Vec<String>, Failure> {
    let patterns = ["*src/lib.rs", "*src/main.rs", "*src/bin/*/main.rs"];
    let mut list = repository.command("git");
    list.args(["ls-files", "--cached", "--others", "--exclude-standard"]).args(patterns);
    let (list, _) = capture(&mut list)?;
    let exists = |name: &&str| repository.root.join(name).exists();
    let roots: Vec<String> = list.lines().filter(exists).map(str::to_owned).collect();
    if roots.is_empty() { Err("no crate".to_owned()) } else { Ok(roots) }
}

/// The cycles of the list.
fn known(text: &str) -> Result<Vec<Cycle>, Failure> {
    let document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
    let list = document.get("cycles").and_then(Item::as_array).ok_or("no array `cycles`")?;
    let files =
        |value: &Value| Some(value.as_array()?.iter().filter_map(|file| Some(file.as_str()?.to_owned())).collect());
    list.iter().map(|value| files(value).ok_or_else(|| format!("no list of files: {value}"))).collect()
}

/// Cycles that are not in the list, and entries of the list that are no cycle.
fn compare(found: &[Cycle], known: &[Cycle]) -> Vec<Failure> {
    let new = found.iter().filter(|cycle| !known.contains(cycle)).map(|cycle| format!("files in a cycle: {cycle:?}"));
    let gone = known
        .iter()
        .filter(|cycle| !found.contains(cycle))
        .map(|cycle| format!("no longer a cycle, remove it from {KNOWN}: {cycle:?}"));
    new.chain(gone).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_cycles_and_stale_entries_fail() {
        let known = known("cycles = [[\"b\", \"a\"]] # why\n").expect("a list");
        let cycle = |files: [&str; 2]| files.map(str::to_owned).into();
        assert!(compare(&[cycle(["a", "b"])], &known).is_empty());
        assert_eq!(compare(&[cycle(["a", "b"]), cycle(["c", "d"])], &known).len(), 1);
        assert_eq!(compare(&[], &known).len(), 1);
        assert!(super::known("other = 1").is_err());
    }
}
