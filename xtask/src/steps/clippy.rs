//! `clippy`: no warning in any target, tests, examples and benchmarks included.

use crate::Failure;
use crate::repository::{Repository, run as run_program};

pub fn run(repository: &Repository, _: &[String]) -> Result<(), Failure> {
    run_program(repository.cargo().args(["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]))
}
