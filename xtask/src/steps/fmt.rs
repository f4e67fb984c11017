//! `fmt`: is everything formatted?

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    run_program(repository.cargo().args(["fmt", "--all", "--check"])).map_err(|e| format!("{e}; run `cargo fmt --all`"))
}
