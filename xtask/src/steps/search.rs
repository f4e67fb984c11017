//! `search`: libFuzzer with the address sanitizer, each fuzz target for some seconds.
//!
//! It needs no nightly compiler: libFuzzer's counters are a pass of LLVM, and the sanitizer's library comes with the stable compiler, which only has
//! to be told that unstable options are meant. That takes a C++ compiler; cargo-fuzz is built when it is missing. Inputs that are found go to
//! `target/search/corpus`, where the next search begins with them, and those that fail to `fuzz/artifacts`: a failure is kept as a file of
//! `fuzz/corpus`, which [`fuzz`](super::fuzz) replays ever after.

use super::fuzz::PACKAGE;
use crate::arguments::Arguments;
use crate::cargo_tool::cargo_tool;
use crate::repository::{Failure, Repository, run as run_program};
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

const CARGO_FUZZ: &str = "0.13.2";
/// How long a target is searched with unless a time is given.
const SECONDS: u64 = 20;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let seconds = arguments.seconds.unwrap_or(SECONDS);
    run_program(&mut cargo_fuzz(repository, "build")?)?;
    let (mut failed, mut total) = (Vec::new(), 0);
    for target in targets(repository)? {
        let output = search(repository, &target, seconds)?;
        let said = String::from_utf8_lossy(&output.stderr);
        let executions = executions(&said);
        total += executions;
        println!("{target:<18} {executions:>12} executions");
        // A search that did nothing found nothing either.
        if !output.status.success() || executions == 0 {
            eprintln!("{said}");
            failed.push(target);
        }
    }
    println!("{:<18} {total:>12} executions, {seconds} s each", "all");
    if failed.is_empty() { Ok(()) } else { Err(format!("fails: {}", failed.join(", "))) }
}

/// A subcommand of cargo-fuzz.
fn cargo_fuzz(repository: &Repository, subcommand: &str) -> Result<Command, Failure> {
    let mut fuzz = cargo_tool(repository, "cargo-fuzz", CARGO_FUZZ)?;
    fuzz.current_dir(repository.root.join(PACKAGE)).args(["fuzz", subcommand, "--sanitizer", "address"]);
    fuzz.arg("--target-dir").arg(place(repository));
    fuzz.env("RUSTC_BOOTSTRAP", "1");
    Ok(fuzz)
}

/// Where all of it is built.
fn place(repository: &Repository) -> PathBuf {
    repository.target("search")
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

/// Searches with one target.
fn search(repository: &Repository, target: &str, seconds: u64) -> Result<Output, Failure> {
    // The first folder takes what is found, the others are read.
    let found = place(repository).join("corpus").join(target);
    fs::create_dir_all(&found).map_err(|error| format!("{}: {error}", found.display()))?;
    let mut run = cargo_fuzz(repository, "run")?;
    run.arg(target).arg(&found).arg(repository.root.join(PACKAGE).join("corpus").join(target));
    run.args(["--", "-max_len=4096", "-timeout=10", "-print_final_stats=1"]).arg(format!("-max_total_time={seconds}"));
    run.output().map_err(|error| format!("cargo fuzz: {error}"))
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
