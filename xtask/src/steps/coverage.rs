//! `coverage`: does a test of its own crate run every line of the code that decides whether motors turn?
//!
//! Not for code that only has to compute well: a line that ran says nothing about its result. What decides is small enough to ask
//! for all of it, and a line that no test reaches is one that nobody has thought of.

use crate::arguments::Arguments;
use crate::machine::{COVERAGE, PROFILES, provide};
use crate::repository::{Failure, Repository, announced, capture, run as run_program};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;

/// The crates whose tests count.
const CRATES: [&str; 2] = ["stampfly-mode", "stampfly-control"];
/// Mode machine, failsafe, arming, take-off and landing; and what makes motor commands of a demand.
const COVERED: [&str; 2] = ["stampfly-mode/src/", "stampfly-control/src/mixer/"];

/// How often each line of each file ran.
type Lines = BTreeMap<String, BTreeMap<u32, u64>>;

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&COVERAGE])?;
    let [build, profiles] = ["coverage", "coverage/profiles"].map(|name| repository.target(name));
    // Profiles of an older build would not fit the new programs.
    if profiles.exists() {
        fs::remove_dir_all(&profiles).map_err(|e| format!("{}: {e}", profiles.display()))?;
    }
    let test = |arguments: &[&str]| {
        let mut test = repository.cargo();
        test.env("RUSTFLAGS", "-C instrument-coverage").env("LLVM_PROFILE_FILE", profiles.join("%p-%m.profraw"));
        test.args(["test", "--quiet", "--lib", "--tests", "--target-dir"]).arg(&build);
        test.args(CRATES.iter().flat_map(|name| ["--package", name])).args(arguments);
        test
    };
    run_program(&mut test(&[]))?;
    let (said, _) = capture(&mut test(&["--no-run", "--message-format", "json"]))?;
    let programs = programs(&said);
    let (first, others) = programs.split_first().ok_or("no test was built")?;

    let data = build.join("all.profdata");
    let raw = fs::read_dir(&profiles).map_err(|e| format!("{}: {e}", profiles.display()))?;
    let raw: Vec<_> = raw.filter_map(|entry| Some(entry.ok()?.path())).collect();
    let [merge, export] = PROFILES;
    capture(repository.command(merge).args(["merge", "-sparse", "-o"]).arg(&data).args(&raw))?;
    let mut export = repository.command(export);
    export.args(["export", "-format=lcov", first, "-instr-profile"]).arg(&data);
    export.args(others.iter().flat_map(|program| ["-object", program]));
    let output = export.output().map_err(|e| format!("{}: {e}", announced(&export)))?;
    let lines = read(&String::from_utf8_lossy(&output.stdout), &format!("{}/", repository.root.display()));

    // Nothing to be found would look just like nothing missing.
    if let Some(place) = COVERED.iter().find(|place| !lines.keys().any(|file| file.starts_with(**place))) {
        return Err(format!("no line of {place} was counted"));
    }
    let counted: usize = lines.values().map(BTreeMap::len).sum();
    let missing = missing(&lines);
    println!("{counted} lines in {} files; {} of them did not run", lines.len(), missing.len());
    if missing.is_empty() { Ok(()) } else { Err(format!("no test runs\n  {}", missing.join("\n  "))) }
}

/// The programs that cargo says it has built.
fn programs(said: &str) -> Vec<String> {
    let messages = said.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    messages.filter_map(|message| message["executable"].as_str().map(str::to_owned)).collect()
}

/// Reads LLVM's line counts of the files that are to be covered; a line that several programs have ran as often as in all of them.
fn read(counts: &str, root: &str) -> Lines {
    let mut lines = Lines::new();
    let mut file = None;
    for line in counts.lines() {
        if let Some(path) = line.strip_prefix("SF:") {
            let path = path.strip_prefix(root).unwrap_or(path);
            let is_test = path.ends_with("/tests.rs") || path.contains("/tests/");
            let counts = !is_test && COVERED.iter().any(|place| path.starts_with(place));
            file = counts.then(|| lines.entry(path.to_owned()).or_default());
        } else if let (Some(counted), Some((line, times))) =
            (&mut file, line.strip_prefix("DA:").and_then(|numbers| numbers.split_once(',')))
            && let (Ok(line), Ok(times)) = (line.parse(), times.parse::<u64>())
        {
            *counted.entry(line).or_default() += times;
        }
    }
    lines
}

/// Places of the lines that never ran.
fn missing(lines: &Lines) -> Vec<String> {
    let never = |(file, lines): (&String, &BTreeMap<u32, u64>)| {
        let never: Vec<_> =
            lines.iter().filter(|(_, times)| **times == 0).map(|(n, _)| format!("{file}:{n}")).collect();
        never
    };
    lines.iter().flat_map(never).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_never_ran_are_found() {
        let counts = "SF:/here/stampfly-mode/src/arming.rs\nDA:7,3\nDA:8,0\nDA:9,0\nend_of_record\n\
                      SF:/here/stampfly-mode/src/machine/tests/arming.rs\nDA:1,0\nend_of_record\n\
                      SF:/here/stampfly-eskf/src/eskf.rs\nDA:1,0\nend_of_record\n\
                      SF:/here/stampfly-mode/src/arming.rs\nDA:9,1\nend_of_record\n";
        let lines = read(counts, "/here/");
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert_eq!(missing(&lines), ["stampfly-mode/src/arming.rs:8"]);
    }

    #[test]
    fn programs_are_what_cargo_names() {
        let said =
            "running 1 test\n{\"reason\":\"compiler-artifact\",\"executable\":\"/a/b\"}\n{\"executable\":null}\n";
        assert_eq!(programs(said), ["/a/b"]);
    }
}
