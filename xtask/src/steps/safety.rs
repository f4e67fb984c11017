//! `safety`: flies the campaigns of `docs/safety.md`, keeps what they found in `xtask/safety.json`,
//! and prints the tables.
//!
//! Takes ten to twenty minutes, so it is in no lane; the document says with which commit it was
//! made. Names of campaigns on the command line fly these alone. The recordings of pilots need the
//! folder of recorded flights.
//!
//! What keeps the tables up to date: [`docs`](super::docs) compares the document with the file, and
//! says when the golden flight has changed since; [`campaign`](super::campaign) flies the first
//! campaign every night, and fails when another flight of it ends wrong than the file has, or one
//! ends well.

use super::program::released;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, announced, capture, json};
use crate::safety::page::tables;
use crate::safety::results::{Results, golden};
use std::path::Path;
use std::process::{Command, Stdio};

/// How many flights the first campaign has: every cell, and some drawn ones.
pub const FLIGHTS: u32 = 3_000;
/// The name of the first campaign.
pub const FIRST: &str = "usual sizes";

/// The repository's stick files, and those that people have flown.
const SET: &str = "stampfly-board/sticks";
const RECORDINGS: &str = "$STAMPFLY_DATA/sticks";

/// Names and arguments, but for the folder. `$STAMPFLY_DATA` is the folder of recorded flights.
const CAMPAIGNS: &[(&str, &[&str])] = &[
    (FIRST, &["--faults", "--flights", "3000"]),
    ("usual sizes, other seeds", &["--faults", "--flights", "3000", "--seed", "10001"]),
    ("drawn sizes", &["--faults", "--drawn", "--flights", "5000", "--seed", "20001"]),
    ("drawn sizes, two faults in half", &["--faults", "--drawn", "--pairs", "--flights", "5000", "--seed", "30001"]),
    ("drawn sizes, harsh world", &["--faults", "--drawn", "--world", "harsh", "--flights", "3000", "--seed", "40001"]),
    ("the repository's set, from 1.5 m", &["--sticks", SET, "--from-height", "1.5", "--flights", "3"]),
    ("the set, from 6 m", &["--sticks", SET, "--from-height", "6", "--flights", "3"]),
    ("recordings of pilots", &["--sticks", RECORDINGS, "--hover-throttle", "median", "--when-ready", "--flights", "3"]),
    (
        "harsh world: the set, from 1.5 m",
        &["--world", "harsh", "--sticks", SET, "--from-height", "1.5", "--flights", "3"],
    ),
    ("harsh world: the set, from 6 m", &["--world", "harsh", "--sticks", SET, "--from-height", "6", "--flights", "3"]),
    (
        "harsh world: recordings of pilots",
        &["--world", "harsh", "--sticks", RECORDINGS, "--hover-throttle", "median", "--when-ready", "--flights", "3"],
    ),
];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let names = || CAMPAIGNS.iter().map(|(name, _)| *name);
    if let Some(unknown) = arguments.rest.iter().find(|name| !names().any(|known| known == name.as_str())) {
        return Err(format!("no campaign `{unknown}`; there are: {}", names().collect::<Vec<_>>().join("; ")));
    }
    let program = released(repository)?;
    let mut results = Results::read(repository).unwrap_or_default();
    let chosen = |name: &str| arguments.rest.is_empty() || arguments.rest.iter().any(|chosen| chosen == name);
    for (name, words) in CAMPAIGNS.iter().filter(|(name, _)| chosen(name)) {
        let data = repository.data();
        let Some(words) = with_data(words, data.as_deref()) else {
            println!("{name}: left as it is, there is no folder of recorded flights");
            continue;
        };
        let mut report = fly(repository, &program, &words)?;
        // The document lists the failures of the first campaign, and the night compares them.
        if *name != FIRST
            && let Some(report) = report.as_object_mut()
        {
            report.remove("failures");
        }
        results.put(name, &line(name), &report);
    }
    results.flown_by = flown_by(repository)?;
    results.golden = golden(repository)?;
    results.write(repository)?;
    for ((document, begin, end), table) in tables(&results) {
        print!("{table}");
        repository.fill(document, begin, end, &table)?;
    }
    Ok(())
}

/// The command of a campaign, as documents have it.
pub fn line(name: &str) -> String {
    let words = CAMPAIGNS.iter().find(|(known, _)| *known == name).map_or(&[][..], |(_, words)| *words);
    format!("stampfly campaign {}", words.join(" "))
}

/// The arguments with the folder of recorded flights; `None` where it is missing and needed.
fn with_data(words: &[&str], data: Option<&Path>) -> Option<Vec<String>> {
    let word = |word: &&str| match word.strip_prefix("$STAMPFLY_DATA") {
        Some(rest) => Some(format!("{}{rest}", data?.display())),
        None => Some((*word).to_owned()),
    };
    words.iter().map(word).collect()
}

fn fly(repository: &Repository, program: &Path, words: &[String]) -> Result<serde_json::Value, Failure> {
    let mut command = repository.command(&program.to_string_lossy());
    command.arg("campaign").args(words).arg("--json");
    if words.iter().any(|word| word == "--faults") {
        command.args(["--again", "--out"]).arg(repository.target("safety"));
    }
    report(&mut command)
}

/// What a campaign prints with `--json`, whether flights failed or not.
pub fn report(campaign: &mut Command) -> Result<serde_json::Value, Failure> {
    let shown = announced(campaign);
    let output = campaign.stdin(Stdio::null()).stderr(Stdio::inherit()).output();
    let output = output.map_err(|e| format!("`{shown}` could not be started: {e}"))?;
    json(&String::from_utf8_lossy(&output.stdout))
}

/// Version and commit, with a word when the working copy has changes.
fn flown_by(repository: &Repository) -> Result<String, Failure> {
    let git = |arguments: &[&str]| capture(repository.command("git").args(arguments)).map(|(said, _)| said);
    let commit = git(&["rev-parse", "--short=10", "HEAD"])?;
    let changed = !git(&["status", "--porcelain", "--untracked-files=no"])?.trim().is_empty();
    let changes = if changed { " with changes" } else { "" };
    Ok(format!("version {}, commit {}{changes}", repository.version()?, commit.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_campaign_has_the_flights_that_every_night_has() {
        assert_eq!(line(FIRST), format!("stampfly campaign --faults --flights {FLIGHTS}"));
    }

    #[test]
    fn recordings_need_their_folder() {
        let words = ["--sticks", RECORDINGS];
        assert_eq!(with_data(&words, None), None);
        assert_eq!(with_data(&words, Some(Path::new("/data"))), Some(vec!["--sticks".into(), "/data/sticks".into()]));
        assert!(with_data(&["--faults"], None).is_some());
    }
}
