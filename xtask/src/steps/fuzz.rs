//! `fuzz`: every fuzz target over its corpus and seeded mutations of it, on the stable compiler.
//!
//! Each run has the same inputs; the step [`search`](super::search) looks for new ones.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

/// Its folder.
pub const PACKAGE: &str = "fuzz";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let mut test = repository.cargo();
    test.current_dir(repository.root.join(PACKAGE)).args(["test", "--quiet", "--locked", "--lib", "--target-dir"]);
    // Into the workspace's own folder: dependencies are built there already.
    run_program(test.arg(repository.target("")))
}
