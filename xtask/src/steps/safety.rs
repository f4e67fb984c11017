//! `safety`: flies the campaigns of `docs/explain/safety.md`, keeps what they found in `xtask/safety.json`,
//! and prints the tables.
//!
//! Takes half an hour on two cores, so it is in no lane; the document says which commit flew each
//! campaign. Names of campaigns on the command line fly these alone. The recordings of pilots need the
//! folder of recorded flights.
//!
//! One campaign more for each hypothesis of the monitor leaves it out: what ends wrong then and not
//! with all of them is what it is worth.
//!
//! What keeps the tables up to date: [`docs`](super::docs) compares the document with the file, and
//! says when the golden flight has changed since; [`campaign`](super::campaign) flies the first
//! campaign every night, and fails when another flight of it ends wrong than the file has, or one
//! ends well.

use super::program::released;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, announced, capture, json};
use crate::safety::page::{ALL, WITHOUT, tables};
use crate::safety::results::{Program, Results, golden};
use std::fs;
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

/// Where the monitor's hypotheses are listed, and what stands before and after them.
const HYPOTHESES: (&str, &str, &str) = ("stampfly-monitor/src/monitor.rs", "\nhypotheses! {\n", "\n}");
/// Faults of the sensors that they are about, and what else looks like one of them.
const JUDGED: &str = "gyro-bias,gyro-spikes,imu-garbage,\
                      tof-stuck,tof-bias,tof-scale,tof-alias,tof-outliers,slope,edge,baro-stuck,baro-step,\
                      flow-stuck,flow-zero,flow-reversed,flow-swapped,flow-bias,floor-dark,floor-moves";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let campaigns = campaigns(repository)?;
    let names = || campaigns.iter().map(|(name, _)| name.as_str());
    if let Some(unknown) = arguments.rest.iter().find(|name| !names().any(|known| known == name.as_str())) {
        return Err(format!("no campaign `{unknown}`; there are: {}", names().collect::<Vec<_>>().join("; ")));
    }
    let program = released(repository)?;
    let mut results = Results::read(repository).unwrap_or_default();
    let flies = Program { flown_by: flown_by(repository)?, golden: golden(repository)? };
    let chosen = |name: &str| arguments.rest.is_empty() || arguments.rest.iter().any(|chosen| chosen == name);
    for (name, line) in campaigns.iter().filter(|(name, _)| chosen(name)) {
        let words: Vec<_> = line.iter().map(String::as_str).collect();
        let data = repository.data();
        let Some(words) = with_data(&words, data.as_deref()) else {
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
        results.put(name, &format!("stampfly campaign {}", line.join(" ")), &flies, &report);
    }
    results.write(repository)?;
    for ((document, begin, end), table) in tables(&results) {
        print!("{table}");
        repository.fill(document, begin, end, &table)?;
    }
    Ok(())
}

/// Names and arguments of all campaigns, those that leave a hypothesis out included.
fn campaigns(repository: &Repository) -> Result<Vec<(String, Vec<String>)>, Failure> {
    let owned = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    let mut campaigns: Vec<_> = CAMPAIGNS.iter().map(|(name, words)| ((*name).to_owned(), owned(words))).collect();
    let judged = owned(&["--faults", "--drawn", "--flights", "3000", "--seed", "50001", "--only", JUDGED]);
    campaigns.push((ALL.to_owned(), judged.clone()));
    let (file, begin, end) = HYPOTHESES;
    let text = fs::read_to_string(repository.root.join(file)).map_err(|e| format!("{file}: {e}"))?;
    let names = hypotheses(&text, begin, end).ok_or_else(|| format!("{file} has no list of hypotheses"))?;
    for (bit, name) in names.iter().enumerate() {
        let without = ["--param".to_owned(), format!("monitor.without={}", 1 << bit)];
        campaigns.push((format!("{WITHOUT}{name}"), [&judged[..], &without].concat()));
    }
    Ok(campaigns)
}

/// The names in the list between these two texts.
fn hypotheses<'t>(text: &'t str, begin: &str, end: &str) -> Option<Vec<&'t str>> {
    let (_, list) = text.split_once(begin)?;
    let (list, _) = list.split_once(end)?;
    let names = list.lines().map(str::trim).filter(|line| !line.starts_with("//"));
    names.map(|line| Some(line.split_once(':')?.0)).collect()
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
        let (_, words) = CAMPAIGNS.first().expect("one");
        assert_eq!(words.join(" "), format!("--faults --flights {FLIGHTS}"));
    }

    #[test]
    fn the_hypotheses_are_those_of_the_list() {
        let text = "macro\nlist {\n    // The gyro first.\n    one: One,\n    two_more: TwoMore,\n}\n";
        assert_eq!(hypotheses(text, "\nlist {\n", "\n}"), Some(vec!["one", "two_more"]));
        assert_eq!(hypotheses("none", "\nlist {\n", "\n}"), None);
    }

    #[test]
    fn recordings_need_their_folder() {
        let words = ["--sticks", RECORDINGS];
        assert_eq!(with_data(&words, None), None);
        assert_eq!(with_data(&words, Some(Path::new("/data"))), Some(vec!["--sticks".into(), "/data/sticks".into()]));
        assert!(with_data(&["--faults"], None).is_some());
    }
}
