//! `package`: each library, as committed, builds from the archive that would be published.
//!
//! Works on a fresh clone, so that a file that exists but was never committed is noticed.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::fs;

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let (uncommitted, _) = capture(repository.command("git").args(["status", "--porcelain"]))?;
    if !uncommitted.is_empty() {
        eprintln!("not committed and therefore not looked at:\n{uncommitted}");
    }
    let clone = repository.target("package-clone");
    let _ = fs::remove_dir_all(&clone);
    run_program(repository.command("git").args(["clone", "--quiet", "--local", "."]).arg(&clone))?;
    // Into the folder of `consumers`, whose programs have the same dependencies with the same features.
    let folder = repository.target("consumers");
    let libraries = repository.libraries()?;
    let inside = |arguments: &[&str]| {
        let mut cargo = repository.cargo();
        cargo.current_dir(&clone).args(arguments).arg("--target-dir").arg(&folder);
        // Whether it builds is all that is asked here.
        cargo.env("CARGO_PROFILE_DEV_DEBUG", "false");
        // Together, because they depend on each other and none is published yet.
        for library in &libraries {
            cargo.args(["-p", &library.name]);
        }
        cargo
    };
    // Cargo neither unpacks nor builds a version twice, and ours does not change with every commit.
    let _ = fs::remove_dir_all(folder.join("package"));
    run_program(&mut inside(&["clean", "--quiet"]))?;
    run_program(&mut inside(&["package", "--locked", "--quiet"]))
}
