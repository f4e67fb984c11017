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
    // One folder per commit: cargo does not unpack a version twice, and ours does not change with every commit.
    let (commit, _) = capture(repository.command("git").args(["rev-parse", "--short", "HEAD"]))?;
    let packages = repository.target("packages");
    let _ = fs::remove_dir_all(&packages);
    let mut package = repository.cargo();
    package
        .current_dir(&clone)
        // Whether it builds is all that is asked here.
        .env("CARGO_PROFILE_DEV_DEBUG", "false")
        .args(["package", "--locked", "--quiet", "--target-dir"])
        .arg(packages.join(commit.trim()));
    // Together, because they depend on each other and none is published yet.
    for library in repository.libraries()? {
        package.args(["-p", &library.name]);
    }
    run_program(&mut package)
}
