//! `clippy`: no warning in any target, tests, examples and benchmarks included; and these build by themselves, too.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

/// Packages that people build by themselves, and what of them.
const ALONE: [(&str, &str); 2] = [("stampfly-benches", "--benches"), ("examples", "--examples")];

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
    // As people run a benchmark or an example: by themselves, a package has only the features it asks for.
    for (package, targets) in ALONE {
        run_program(repository.cargo().args(["check", "--quiet", "-p", package, targets]))?;
    }
    Ok(())
}
