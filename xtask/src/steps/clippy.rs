//! `clippy`: no warning in any target, tests, examples and benchmarks included.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    run_program(repository.cargo().args(["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]))
}
