//! `fuzz`: every fuzz target over its corpus and seeded mutations of it, on the stable compiler.
//!
//! It is the same each time; [`search`](super::search) looks for inputs that nobody has thought of. The package `fuzz` is outside the workspace, so
//! its format and its warnings are checked here as well.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};
use std::process::Command;

/// Its folder.
pub const PACKAGE: &str = "fuzz";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    run_program(package(repository).args(["fmt", "--check"]))?;
    // Into the workspace's own folder: dependencies are built there already.
    let place = repository.target("");
    let mut clippy = package(repository);
    clippy.args(["clippy", "--quiet", "--locked", "--lib", "--tests", "--target-dir"]).arg(&place);
    run_program(clippy.args(["--", "-D", "warnings"]))?;
    run_program(package(repository).args(["test", "--quiet", "--locked", "--lib", "--target-dir"]).arg(&place))
}

/// A cargo in the package's folder.
fn package(repository: &Repository) -> Command {
    let mut cargo = repository.cargo();
    cargo.current_dir(repository.root.join(PACKAGE));
    cargo
}
