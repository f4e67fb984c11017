//! `platforms`: does everything that runs on a PC compile for Windows and macOS, with tests and
//! examples? A warning fails: code that one system does not use shows as a warning there.
//!
//! The step checks types and links nothing, so it needs no compiler and no library of those systems.
//! The workflow `ci.yml` runs the tests on the systems themselves.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, add_targets, run as run_program};

const TARGETS: [&str; 2] = ["x86_64-pc-windows-gnu", "aarch64-apple-darwin"];
/// Their benchmarks need criterion, which compiles C for the target. Other packages use all of these
/// but the last one, so their libraries are checked nevertheless.
const WITH_C: [&str; 4] = ["stampfly-control", "stampfly-link", "stampfly-log", "stampfly-benches"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    add_targets(repository, &TARGETS)?;
    for target in TARGETS {
        let mut check = repository.cargo();
        check.env("CARGO_PROFILE_DEV_DEBUG", "false").env("RUSTFLAGS", "-D warnings");
        check.args(["check", "--quiet", "--workspace", "--all-targets", "--keep-going", "--target", target]);
        check.args(WITH_C.iter().flat_map(|package| ["--exclude", *package]));
        // A folder of its own, so that no other step waits for the lock of this build.
        run_program(check.arg("--target-dir").arg(repository.target("platforms")))?;
    }
    println!("what runs on a PC compiles for {}", TARGETS.join(" and "));
    Ok(())
}
