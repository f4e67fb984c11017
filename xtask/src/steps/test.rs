//! `test`: the README's `cargo test`, and whether the recorded flights were there.
//!
//! Some tests and examples compare with recorded flights, in the folder `STAMPFLY_DATA` names or beside the
//! repository. Without them the rest still means something on a developer's machine; in continuous integration
//! (`CI=true`) their absence is an error, so that a green run is never one that looked at nothing;
//! `STAMPFLY_DATA=none` says that they are left out on purpose, and `cargo test` then counts the ignored tests.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, in_ci, run as run_program, without_recorded_flights};
use std::process::Command;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    run_program(test(repository)?.args(&arguments.rest))?;
    // Not among the default members, so that `cargo test` at home builds only what flies.
    run_program(repository.cargo().args(["test", "--quiet", "-p", "xtask"]))
}

/// `thorough`: the tests that fly, with all of their seeds, and the fuzz targets with more mutations.
pub fn thorough(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    // By the name of the program and not of its package, whose features alone would build everything again. What flies in real time has
    // no seeds, passes at a push, and beside campaigns would measure the machine.
    let arguments = ["--test", "host", "--test", "corpora", "--", "--skip", "connect::", "--skip", "connect_radio::"];
    run_program(test(repository)?.env("STAMPFLY_THOROUGH", "1").args(arguments))
}

/// `cargo test`, after a look whether the recorded flights are there. The build script of the laboratory
/// finds them: if this step set `STAMPFLY_DATA`, cargo would build again what other steps are using.
fn test(repository: &Repository) -> Result<Command, Failure> {
    match repository.data() {
        Some(folder) => eprintln!("recorded data: {}", folder.display()),
        None if in_ci() && !without_recorded_flights() => {
            return Err("CI=true and no recorded data: set STAMPFLY_DATA to its folder".to_owned());
        }
        None => eprintln!("recorded data: none (STAMPFLY_DATA names its folder)"),
    }
    let mut test = repository.cargo();
    // A test that fails hides no other one.
    test.args(["test", "--no-fail-fast"]);
    Ok(test)
}
