//! `estimation`: lint the evaluation of estimators in `lab`, and test it on the recorded flights.
//!
//! The recorded flights are in the folder `STAMPFLY_DATA`, or next to the repository. On a developer's
//! machine tests without them are ignored. In continuous integration (`CI=true`) their absence is an
//! error, unless `STAMPFLY_DATA=none` states that they are left out on purpose.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, in_ci, run as run_program, without_recorded_flights};

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    match repository.data() {
        Some(folder) => eprintln!("recorded data: {}", folder.display()),
        None if in_ci() && !without_recorded_flights() => {
            return Err("CI=true and no recorded data: set STAMPFLY_DATA to its folder".to_owned());
        }
        None => eprintln!("recorded data: none (STAMPFLY_DATA names its folder)"),
    }
    let cargo = || {
        let mut cargo = repository.cargo();
        cargo.current_dir(repository.root.join("lab"));
        cargo
    };
    run_program(cargo().args(["clippy", "-p", "stampfly-lab", "--all-targets", "--quiet", "--", "-D", "warnings"]))?;
    run_program(cargo().args(["test", "-p", "stampfly-lab", "--no-fail-fast"]).args(&arguments.rest))
}
