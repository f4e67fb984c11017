//! `examples`: every example of the examples package still runs to its end.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::fs;

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let folder = repository.root.join("examples/examples");
    let entries = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    // What is no file is what examples share.
    let programs = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_file());
    let mut names: Vec<String> = programs.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned())).collect();
    names.sort();
    // All of the workspace's at once, as `cargo test` has built them: for one package alone, features and with them all
    // dependencies would be others.
    run_program(repository.cargo().args(["build", "--quiet", "--profile", "test", "--examples"]))?;
    for name in &names {
        let program = repository.target("debug/examples").join(name);
        let (printed, _) = capture(&mut repository.command(&program.to_string_lossy()))?;
        if printed.is_empty() {
            return Err(format!("the example `{name}` shows nothing"));
        }
    }
    if names.is_empty() { Err(format!("no example in {}", folder.display())) } else { Ok(()) }
}
