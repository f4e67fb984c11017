//! `search`: libFuzzer with the address sanitizer, each fuzz target for some seconds, two at a time.
//!
//! It needs no nightly compiler: libFuzzer's counters are a pass of LLVM, and the sanitizer's library comes with the stable compiler, which only has
//! to be told that unstable options are meant. The options are cargo-fuzz's, but for its single codegen unit a crate, which takes longer
//! to build. It needs a C++ compiler. Inputs that are found go to `target/search/corpus`, where the next search begins with them, their number is added to
//! `target/search/executions`, and those that fail go to `fuzz/artifacts`: a failure is kept as a file of
//! `fuzz/corpus`, with which `cargo test` calls its target ever after.

use crate::arguments::Arguments;
use crate::parallel;
use crate::repository::{Failure, Repository, capture, in_ci, run as run_program};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

/// The package of cargo-fuzz.
const PACKAGE: &str = "fuzz";
/// How long a target is searched with unless a time is given.
const SECONDS: u64 = 20;
/// Shortest and longest limit of an input's length, bytes.
const LENGTHS: [u64; 2] = [128, 4096];
/// Counters for each branch, operands of comparisons, the sanitizer; arithmetic and slices are checked, too.
const FLAGS: &[&str] = &[
    "--cfg=fuzzing",
    "-Zsanitizer=address",
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "-Cdebug-assertions",
];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let seconds = arguments.seconds.unwrap_or(SECONDS);
    let programs = build(repository)?;
    // Two at a time.
    let outcomes = parallel::each(targets(repository)?, 2, |target| -> Result<_, Failure> {
        let output = search(repository, &programs.join(&target), &target, seconds)?;
        let said = String::from_utf8_lossy(&output.stderr);
        let executions = executions(&said);
        println!("{target:<18} {executions:>12} executions");
        // A search that did nothing found nothing either.
        let passed = output.status.success() && executions > 0;
        if !passed {
            eprintln!("{said}");
        }
        Ok((target, executions, passed))
    });
    let (mut total, mut failed) = (0, Vec::new());
    for outcome in outcomes {
        let (target, executions, passed) = outcome?;
        total += executions;
        failed.extend((!passed).then_some(target));
    }
    println!("{:<18} {total:>12} executions, {seconds} s each", "all");
    println!("{:<18} {:>12} executions", "with those before", tally(repository, total)?);
    if failed.is_empty() { Ok(()) } else { Err(format!("fails: {}", failed.join(", "))) }
}

/// Adds to what searches from this corpus have executed so far. Returns the sum.
fn tally(repository: &Repository, total: u64) -> Result<u64, Failure> {
    let path = place(repository).join("executions");
    let before = fs::read_to_string(&path).ok().and_then(|number| number.trim().parse().ok()).unwrap_or(0);
    let sum = before + total;
    fs::write(&path, format!("{sum}\n")).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(sum)
}

/// Builds all targets. Returns their folder.
fn build(repository: &Repository) -> Result<PathBuf, Failure> {
    // With a target, build scripts and macros are built without the options.
    let (said, _) = capture(repository.command("rustc").arg("-vV"))?;
    let host =
        said.lines().find_map(|line| line.strip_prefix("host: ")).ok_or("rustc does not say what its host is")?;
    let mut cargo = repository.cargo();
    cargo.current_dir(repository.root.join(PACKAGE)).args(["build", "--release", "--bins", "--target", host]);
    cargo.arg("--target-dir").arg(place(repository));
    cargo.env("RUSTC_BOOTSTRAP", "1").env("CARGO_ENCODED_RUSTFLAGS", FLAGS.join("\u{1f}"));
    cargo.env("CARGO_PROFILE_RELEASE_DEBUG", "line-tables-only").env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "2");
    run_program(&mut cargo)?;
    Ok(place(repository).join(host).join("release"))
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
fn search(repository: &Repository, program: &Path, target: &str, seconds: u64) -> Result<Output, Failure> {
    let io = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
    // The first folder takes what is found, the others are read.
    let found = place(repository).join("corpus").join(target);
    let artifacts = repository.root.join(PACKAGE).join("artifacts").join(target);
    let seeds = repository.root.join(PACKAGE).join("corpus").join(target);
    for folder in [&found, &artifacts] {
        fs::create_dir_all(folder).map_err(|error| io(folder, error))?;
    }
    let mut run = repository.command(&program.to_string_lossy());
    // libFuzzer and the sanitizer define some of the same symbols.
    run.env("ASAN_OPTIONS", "detect_odr_violation=0");
    run.arg(&found).arg(&seeds);
    run.arg(format!("-max_len={}", longest_input(&seeds)?));
    run.args(["-timeout=10", "-print_final_stats=1"]).arg(format!("-max_total_time={seconds}"));
    run.arg(format!("-artifact_prefix={}/", artifacts.display()));
    if in_ci() {
        // The same search each time, as far as it comes: a change is not refused for what another one's luck has found.
        run.arg("-seed=1");
    }
    run.output().map_err(|error| io(program, error))
}

/// Longest input to try, bytes: twice the longest seed. Two frames find what one leaves behind; forty only take forty times as long.
fn longest_input(seeds: &Path) -> Result<u64, Failure> {
    let entries = fs::read_dir(seeds).map_err(|error| format!("{}: {error}", seeds.display()))?;
    let lengths = entries.filter_map(|entry| entry.ok()?.metadata().ok()).map(|metadata| metadata.len());
    Ok((2 * lengths.max().unwrap_or_default()).clamp(LENGTHS[0], LENGTHS[1]))
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
