//! `program`: the optimised program `stampfly`, which many other steps run.
//!
//! All of them build it by [`built`]: cargo unites the features of the packages that one command line names, so another command
//! line builds half of the workspace again.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};
use std::path::PathBuf;
use std::process::Command;

/// As in `cargo run --release`.
const BUILD: [&str; 5] = ["build", "--quiet", "--release", "--bin", "stampfly"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    built(repository).map(|program| println!("{}", program.display()))
}

/// Builds the program and returns its path.
pub fn built(repository: &Repository) -> Result<PathBuf, Failure> {
    run_program(repository.cargo().args(BUILD))?;
    Ok(repository.target("release/stampfly"))
}

/// Builds the program and returns a command that runs it in the top folder.
pub fn stampfly(repository: &Repository) -> Result<Command, Failure> {
    Ok(repository.command(&built(repository)?.to_string_lossy()))
}
