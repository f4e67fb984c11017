//! `loom`: the bus's models, in every interleaving and with every value the memory model allows.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    // Its own folder, because every dependency is built with another flag. No backtraces: the twins have to panic.
    run_program(
        repository
            .cargo()
            .env("RUSTFLAGS", "--cfg loom")
            .env("RUST_BACKTRACE", "0")
            .args(["test", "-p", "stampfly-bus", "--test", "loom", "--target-dir"])
            .arg(repository.target("loom"))
            .arg("--")
            .args(&arguments.rest),
    )
}
