//! `fuzz`: every fuzz target over its corpus and seeded mutations of it, on the stable compiler.
//!
//! With SECONDS, libFuzzer runs each target for that long instead, looks for new inputs and minimises the corpus; that takes
//! a nightly compiler and `cargo install cargo-fuzz`. The package `fuzz` is outside the workspace, so its format and its
//! warnings are checked here as well.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, run as run_program};
use std::fs;
use std::process::Command;

const PACKAGE: &str = "fuzz";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    if let Some(seconds) = arguments.seconds {
        return targets(repository)?.iter().try_for_each(|target| search(repository, target, seconds));
    }
    run_program(package(repository).args(["fmt", "--check"]))?;
    // Into the workspace's own folder: dependencies are built there already.
    let place = repository.target("");
    let mut clippy = package(repository);
    clippy.args(["clippy", "--quiet", "--locked", "--lib", "--tests", "--target-dir"]).arg(&place);
    run_program(clippy.args(["--", "-D", "warnings"]))?;
    run_program(package(repository).args(["test", "--quiet", "--locked", "--lib", "--target-dir"]).arg(&place))
}

/// A cargo in the package's folder.
fn package(repository: &Repository) -> Command {
    let mut cargo = repository.cargo();
    cargo.current_dir(repository.root.join(PACKAGE));
    cargo
}

/// Names of the targets.
fn targets(repository: &Repository) -> Result<Vec<String>, Failure> {
    let folder = repository.root.join(PACKAGE).join("fuzz_targets");
    let entries = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut names: Vec<String> = paths.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned())).collect();
    names.sort();
    if names.is_empty() { Err(format!("no target in {}", folder.display())) } else { Ok(names) }
}

/// Looks for new inputs of a target and keeps the fewest files that reach as much.
fn search(repository: &Repository, target: &str, seconds: u64) -> Result<(), Failure> {
    // rustup's cargo, which knows other compilers.
    let fuzz = |subcommand: &str| {
        let mut cargo = repository.command("cargo");
        cargo.args(["+nightly", "fuzz", subcommand, target, "--target-dir"]).arg(repository.target("fuzz"));
        cargo.env_remove("RUSTUP_TOOLCHAIN");
        cargo
    };
    run_program(fuzz("run").arg("--").arg(format!("-max_total_time={seconds}")).arg("-max_len=4096"))?;
    run_program(&mut fuzz("cmin"))
}
