//! `fuzz`: every fuzz target over its corpus and seeded mutations of it, on the stable compiler.
//!
//! With SECONDS, libFuzzer searches with each target for that long instead, on the stable compiler, too: its counters are a pass of LLVM and need no
//! sanitizer, and memory errors are what safe code does not have. That takes a C++ compiler; cargo-fuzz is built when it is missing. Inputs that it finds go to
//! `target/fuzz/corpus`, where the next search begins with them, and those that fail to `fuzz/artifacts`. The package `fuzz` is outside the
//! workspace, so its format and its warnings are checked here as well.

use crate::arguments::Arguments;
use crate::cargo_tool::cargo_tool;
use crate::repository::{Failure, Repository, run as run_program};
use std::fs;
use std::process::Command;

const PACKAGE: &str = "fuzz";
const CARGO_FUZZ: &str = "0.13.2";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    if let Some(seconds) = arguments.seconds {
        return search_all(repository, seconds);
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

/// Searches with every target, and says how many executions that were.
fn search_all(repository: &Repository, seconds: u64) -> Result<(), Failure> {
    let fuzz = |subcommand: &str| -> Result<Command, Failure> {
        let mut fuzz = cargo_tool(repository, "cargo-fuzz", CARGO_FUZZ)?;
        fuzz.current_dir(repository.root.join(PACKAGE)).args(["fuzz", subcommand, "--sanitizer", "none"]);
        fuzz.arg("--target-dir").arg(repository.target("fuzz"));
        Ok(fuzz)
    };
    run_program(&mut fuzz("build")?)?;
    let (mut failed, mut total) = (Vec::new(), 0);
    for target in targets(repository)? {
        // The first folder takes what is found, the others are read.
        let found = repository.target("fuzz").join("corpus").join(&target);
        fs::create_dir_all(&found).map_err(|error| format!("{}: {error}", found.display()))?;
        let mut run = fuzz("run")?;
        run.arg(&target).arg(&found).arg(repository.root.join(PACKAGE).join("corpus").join(&target));
        run.args(["--", "-max_len=4096", "-print_final_stats=1"]).arg(format!("-max_total_time={seconds}"));
        let output = run.output().map_err(|error| format!("cargo fuzz: {error}"))?;
        let said = String::from_utf8_lossy(&output.stderr);
        let executions = executions(&said);
        total += executions;
        println!("{target:<18} {executions:>12} executions");
        if !output.status.success() {
            eprintln!("{said}");
            failed.push(target);
        }
    }
    println!("{:<18} {total:>12} executions", "all");
    if failed.is_empty() { Ok(()) } else { Err(format!("fails: {}", failed.join(", "))) }
}

/// What libFuzzer counts at its end.
fn executions(said: &str) -> u64 {
    let line = said.lines().find_map(|line| line.strip_prefix("stat::number_of_executed_units:"));
    line.and_then(|number| number.trim().parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::executions;

    #[test]
    fn executions_are_read_from_what_libfuzzer_says() {
        let said =
            "Done 12 runs in 2 second(s)\nstat::number_of_executed_units: 12\nstat::average_exec_per_sec:     6\n";
        assert_eq!((executions(said), executions("nothing")), (12, 0));
    }
}
