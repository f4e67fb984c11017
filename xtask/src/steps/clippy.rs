//! `clippy`: no warning in any target, tests, examples and benchmarks included; and these build by themselves, too.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

/// A package that people build by itself, and what of it.
const ALONE: (&str, &str) = ("stampfly-benches", "--benches");

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    run_program(repository.cargo().args([
        "clippy",
        "--workspace",
        "--all-targets",
        "--quiet",
        "--",
        "-D",
        "warnings",
    ]))?;
    // As people run a benchmark: by itself, a package has only the features it asks for.
    let (package, targets) = ALONE;
    run_program(repository.cargo().args(["check", "--quiet", "-p", package, targets]))
}
