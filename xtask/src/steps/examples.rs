//! `examples`: every example of the examples package, and of every driver over its emulated chip, still runs to its end.

use super::program::example;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture};
use std::fs;

/// A driver's example for this PC.
const EMULATED: &str = "examples/emulated.rs";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let folder = repository.root.join("examples/examples");
    let entries = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    // What is no file is what examples share.
    let programs = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_file());
    let mut names: Vec<String> = programs.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned())).collect();
    let libraries = repository.libraries()?;
    let emulated = libraries.iter().filter(|library| repository.root.join(&library.folder).join(EMULATED).exists());
    names.extend(emulated.map(|library| library.name.replace("stampfly-", "emulated-")));
    names.sort();
    for name in &names {
        let program = example(repository, name)?;
        let (printed, _) = capture(&mut repository.command(&program.to_string_lossy()))?;
        if printed.is_empty() {
            return Err(format!("the example `{name}` shows nothing"));
        }
    }
    if names.is_empty() { Err(format!("no example in {}", folder.display())) } else { Ok(()) }
}
