//! `faults` and `campaign`: every flight with a fault ends as the fault allows, and holds every invariant.
//!
//! | step | flights |
//! |---|---|
//! | `faults` | 200: every fault of the table at some moments of a flight under a program's commands |
//! | `campaign` | 2,000: every fault at every moment, under commands and in every mode of a pilot, and some at random |
//!
//! No invariant may be violated. Some flights are known to end wrong; each has its row in `docs/safety.md`. Flights are the same
//! on every machine, so the rows are exact.

use super::program::{built, released};
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, json};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// Has a row for each flight that is known to end wrong, which begins with the fault. It only becomes shorter.
const KNOWN: &str = "docs/safety.md";
/// Share of flights whose fault may change nothing: no wall is ahead of a vehicle that lands.
const MOST_IDLE: f64 = 0.04;

/// A campaign of this size.
struct Size {
    flights: u32,
    /// Are the known rows flights of it?
    all: bool,
    /// Longest run on two cores, s.
    longest: f64,
}

const SOME: Size = Size { flights: 200, all: false, longest: f64::INFINITY };
const ALL: Size = Size { flights: 2_000, all: true, longest: 240.0 };

pub fn some(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    fly(repository, &built(repository)?, &SOME, "faults")
}

pub fn all(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    fly(repository, &released(repository)?, &ALL, "campaign")
}

fn fly(repository: &Repository, program: &Path, size: &Size, folder: &str) -> Result<(), Failure> {
    let mut campaign = repository.command(&program.to_string_lossy());
    campaign.args(["campaign", "--faults", "--again", "--json", "--flights", &size.flights.to_string(), "--out"]);
    let report = report(campaign.arg(repository.target(folder)))?;
    let text = fs::read_to_string(repository.root.join(KNOWN)).map_err(|e| format!("{KNOWN}: {e}"))?;
    let verdict = judged(&report, &known(&text), size);
    let number = |name: &str| report[name].as_f64().unwrap_or_default();
    println!("{} flights of {} cells in {:.0} s", number("flights"), number("cells_flown"), number("wall_s"));
    println!("{}", repository.target(folder).join("campaign.html").display());
    verdict
}

/// What it prints with `--json`, whether flights failed or not.
fn report(campaign: &mut Command) -> Result<Value, Failure> {
    let output = campaign.stdin(Stdio::null()).stderr(Stdio::inherit()).output();
    let output = output.map_err(|e| format!("stampfly could not be started: {e}"))?;
    json(&String::from_utf8_lossy(&output.stdout))
}

/// The faults of the flights that are known to end wrong, in the order of their rows.
fn known(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect()
}

/// No flight failed but those that are known, and all of it was flown in time.
fn judged(report: &Value, known: &[&str], size: &Size) -> Result<(), Failure> {
    let number = |name: &str| report[name].as_f64().ok_or_else(|| format!("no `{name}`"));
    let mut failures = Vec::new();
    if number("flights")? != f64::from(size.flights) || number("cells_flown")? == 0.0 {
        failures.push("not all flights were flown".to_owned());
    }
    let idle = number("idle")? / number("flights")?.max(1.0);
    if idle > MOST_IDLE {
        failures.push(format!("in {:.1} % of flights the fault changed nothing: they say nothing", 100.0 * idle));
    }
    if number("wall_s")? > size.longest {
        failures.push(format!("it took {:.0} s; {} s is the most", number("wall_s")?, size.longest));
    }
    let (failed, wrong, violated) = (number("failed")?, number("wrong_class")?, number("violated")?);
    let listed = report["failures"].as_array().map(Vec::as_slice).unwrap_or_default();
    let text = |failure: &Value, name: &str| failure[name].as_str().unwrap_or_default().to_owned();
    let unknown = |failure: &&Value| {
        let fault = text(failure, "fault");
        let rows = known.iter().filter(|row| row.split(['=', '@']).next() == Some(&fault)).count();
        listed.iter().filter(|other| text(other, "fault") == fault).count() > rows
    };
    let unknown: Vec<_> = listed.iter().filter(unknown).collect();
    let ends_well = size.all && failed < known.len() as f64;
    if violated > 0.0 || ends_well || !unknown.is_empty() {
        failures.push(format!("{failed} flights failed: {wrong} ended wrong, {violated} violated an invariant"));
        failures
            .push(format!("{} are in {KNOWN}; no row goes there, and one that ends well goes from there", known.len()));
        for failure in if unknown.is_empty() { listed.iter().collect() } else { unknown } {
            let [fault, phase, verdict, line] = ["fault", "phase", "verdict", "line"].map(|name| text(failure, name));
            failures.push(format!("{} × {fault} at {phase}: {verdict}: {line}", failure["flights"]));
        }
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn one_failure_that_is_not_known_is_too_much() {
        let report = |faults: &[&str], violated: u32, idle: u32, wall: f64| {
            let failure = |fault: &&str| json!({ "fault": fault, "phase": "hover", "verdict": "I10", "flights": 1, "line": "stampfly" });
            json!({
                "flights": 2000, "cells_flown": 371, "wall_s": wall, "failed": faults.len(), "idle": idle,
                "wrong_class": 0, "violated": violated, "failures": faults.iter().map(failure).collect::<Vec<_>>(),
            })
        };
        let known = known("| fault | flight |\n|---|---|\n| `edge@hover` | a |\n| `tof-bias=2@move` | b |\n");
        assert_eq!(known, ["edge@hover", "tof-bias=2@move"]);
        let both = ["tof-bias", "edge"];
        assert_eq!(judged(&report(&both, 0, 80, 100.0), &known, &ALL), Ok(()));
        let failed = judged(&report(&["tof-bias", "edge", "hand"], 0, 0, 100.0), &known, &ALL).expect_err("a failure");
        assert!(failed.contains("1 × hand at hover: I10: stampfly") && !failed.contains("× edge"), "{failed}");
        assert!(judged(&report(&["edge", "edge"], 0, 0, 100.0), &known, &ALL).is_err(), "another one");
        assert!(
            judged(&report(&["edge"], 0, 0, 100.0), &known, &ALL).is_err(),
            "one that ends well has to be taken out"
        );
        assert!(judged(&report(&both, 1, 0, 100.0), &known, &ALL).is_err());
        assert!(judged(&report(&both, 0, 0, 241.0), &known, &ALL).is_err());
        assert!(judged(&report(&both, 0, 81, 100.0), &known, &ALL).is_err());
        assert!(judged(&json!({ "flights": 2000 }), &known, &ALL).is_err());
    }
}
