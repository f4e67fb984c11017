//! `clippy`: no warning in any target, tests, examples and benchmarks included.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

/// What `cargo test` builds, with the features it has there, so that build scripts and macros are built once; then what it leaves out.
const PACKAGES: [&[&str]; 2] = [&[], &["-p", "xtask"]];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for packages in PACKAGES {
        let mut clippy = repository.cargo();
        clippy.args(["clippy", "--all-targets", "--quiet"]).args(packages);
        run_program(clippy.args(["--", "-D", "warnings"]))?;
    }
    Ok(())
}

/// `alone`: what people build by itself has only the features that it asks for.
pub fn alone(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    for (package, targets) in [("stampfly-benches", "--benches"), ("examples", "--examples")] {
        run_program(repository.cargo().args(["check", "--quiet", "-p", package, targets]))?;
    }
    Ok(())
}
