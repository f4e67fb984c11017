//! `program`: builds what `cargo test` runs. The other steps of a push run the program `stampfly` and
//! the examples of this build.
//!
//! | function | build | used by |
//! |---|---|---|
//! | [`built`], [`example`] | `cargo test`: optimised, with assertions | steps of a push |
//! | [`unoptimised`] | `cargo build` | a comparison of bits |
//! | [`released`] | `cargo run --release` | long campaigns, measurements |
//!
//! A step builds by one of these functions only. Cargo unites the features of the packages that a
//! command line names, so another command line builds half of the workspace again.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};
use std::path::PathBuf;
use std::process::Command;

/// Builds what `cargo test` runs, and ends.
const TESTS: [&str; 3] = ["test", "--quiet", "--no-run"];
/// As in `cargo run --release`.
const RELEASE: [&str; 5] = ["build", "--quiet", "--release", "--bin", "stampfly"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    built(repository).map(|program| println!("{}", program.display()))
}

/// Builds the program as its tests do and returns its path.
pub fn built(repository: &Repository) -> Result<PathBuf, Failure> {
    run_program(repository.cargo().args(TESTS))?;
    Ok(repository.target("debug/stampfly"))
}

/// Builds an example of any package as the tests do and returns its path.
pub fn example(repository: &Repository, name: &str) -> Result<PathBuf, Failure> {
    let program = built(repository)?;
    Ok(program.with_file_name("examples").join(name))
}

/// Builds the program as its users do and returns its path.
pub fn released(repository: &Repository) -> Result<PathBuf, Failure> {
    run_program(repository.cargo().args(RELEASE))?;
    Ok(repository.target("release/stampfly"))
}

/// Builds the program without optimisation and returns its path.
pub fn unoptimised(repository: &Repository) -> Result<PathBuf, Failure> {
    // In a folder of its own: in the usual one it would take the place of the program of the tests.
    let folder = repository.target("unoptimised");
    run_program(repository.cargo().args(["build", "--quiet", "--bin", "stampfly", "--target-dir"]).arg(&folder))?;
    Ok(folder.join("debug/stampfly"))
}

/// Builds the program as its tests do and returns a command that runs it in the top folder.
pub fn stampfly(repository: &Repository) -> Result<Command, Failure> {
    Ok(repository.command(&built(repository)?.to_string_lossy()))
}
