//! `test`: the README's `cargo test`. `thorough`: tests that fly, with all of their seeds.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};
use std::process::Command;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    run_program(test(repository).args(&arguments.rest))?;
    // Not among the default members, so that `cargo test` at home builds only what flies.
    run_program(repository.cargo().args(["test", "--quiet", "-p", "xtask"]))
}

/// `thorough`: the tests that fly, with all of their seeds, and the fuzz targets with more mutations.
pub fn thorough(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    // By the name of the program and not of its package, whose features alone would build everything
    // again. Tests in real time have no seeds; next to campaigns they would measure the machine.
    let arguments = ["--test", "host", "--test", "corpora", "--", "--skip", "connect::", "--skip", "connect_radio::"];
    run_program(test(repository).env("STAMPFLY_THOROUGH", "1").args(arguments))
}

fn test(repository: &Repository) -> Command {
    let mut test = repository.cargo();
    // A test that fails hides no other one.
    test.args(["test", "--no-fail-fast"]);
    test
}
