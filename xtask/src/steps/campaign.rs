//! `faults` and `campaign`: every flight with a fault ends as the fault allows, holds every
//! invariant, and stops its motors in the air only where flying on would have ended badly.
//!
//! | step | flights |
//! |---|---|
//! | `faults` | 200: flights without a fault, and every fault of the table at some moments of a flight under a program's commands |
//! | `campaign` | 3,000: every fault at every moment, under commands and in every mode of a pilot, and some at random |
//!
//! No invariant may be violated. Some flights are known to fail: those that `cargo xtask safety`
//! found in the first campaign of `xtask/safety.json`, by fault and by whether the motors were
//! stopped needlessly. Flights are the same on every machine, so the counts are exact.

use super::program::{built, released};
use super::safety::{FIRST, FLIGHTS, report};
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository};
use crate::safety::results::{FILE, Results};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Share of flights whose fault may change nothing: no wall is ahead of a vehicle that lands.
const MOST_IDLE: f64 = 0.04;

/// A campaign of this size.
struct Size {
    flights: u32,
    /// Are the known failures flights of it?
    all: bool,
    /// Longest run on two cores, s.
    longest: f64,
}

const SOME: Size = Size { flights: 200, all: false, longest: f64::INFINITY };
const ALL: Size = Size { flights: FLIGHTS, all: true, longest: 400.0 };

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
    let results = Results::read(repository)?;
    let known = results.of(FIRST).map(|found| failures(&found.report)).unwrap_or_default();
    let verdict = judged(&report, &known, size);
    let number = |name: &str| report[name].as_f64().unwrap_or_default();
    println!("{} flights of {} cells in {:.0} s", number("flights"), number("cells_flown"), number("wall_s"));
    println!("{}", repository.target(folder).join("campaign.html").display());
    verdict
}

/// How many flights failed, by fault, moment and verdict.
type Failures = BTreeMap<[String; 3], u64>;

fn failures(report: &Value) -> Failures {
    let mut all = Failures::new();
    for failure in report["failures"].as_array().into_iter().flatten() {
        *all.entry(kind(failure)).or_default() += failure["flights"].as_u64().unwrap_or(1);
    }
    all
}

fn kind(failure: &Value) -> [String; 3] {
    ["fault", "phase", "verdict"].map(|name| failure[name].as_str().unwrap_or_default().to_owned())
}

/// No flight failed but those that are known, and all of it was flown in time.
fn judged(report: &Value, known: &Failures, size: &Size) -> Result<(), Failure> {
    let number = |name: &str| report[name].as_f64().ok_or_else(|| format!("no `{name}`"));
    let mut wrong = Vec::new();
    if number("flights")? != f64::from(size.flights) || number("cells_flown")? == 0.0 {
        wrong.push("not all flights were flown".to_owned());
    }
    let idle = number("idle")? / number("flights")?.max(1.0);
    if idle > MOST_IDLE {
        wrong.push(format!("in {:.1} % of flights the fault changed nothing: they say nothing", 100.0 * idle));
    }
    if report["never_began"].as_object().is_some_and(|moments| !moments.is_empty()) {
        println!("moments that never came, so that faults never began: {}", report["never_began"]);
    }
    if number("wall_s")? > size.longest {
        wrong.push(format!("it took {:.0} s; {} s is the most", number("wall_s")?, size.longest));
    }
    let (failed, ends, violated) = (number("failed")?, number("wrong_class")?, number("violated")?);
    let (flown, needless) = (failures(report), number("needless_cuts")?);
    let too_many = |kind: &[String; 3]| flown.get(kind) > known.get(kind);
    let ends_well = size.all && known.iter().any(|(kind, flights)| flown.get(kind).is_none_or(|now| now < flights));
    let listed = report["failures"].as_array().map(Vec::as_slice).unwrap_or_default();
    let unknown: Vec<_> = listed.iter().filter(|failure| too_many(&kind(failure))).collect();
    if violated > 0.0 || ends_well || !unknown.is_empty() {
        wrong.push(format!(
            "{failed} flights failed: {ends} ended wrong, {violated} violated an invariant, {needless} stopped their motors needlessly"
        ));
        let count: u64 = known.values().sum();
        wrong.push(format!(
            "{count} are in {FILE}; no other may fail. When fewer do, `cargo xtask safety '{FIRST}'` says so"
        ));
        for failure in if unknown.is_empty() { listed.iter().collect() } else { unknown } {
            let [fault, phase, verdict, line] =
                ["fault", "phase", "verdict", "line"].map(|name| failure[name].as_str().unwrap_or_default());
            wrong.push(format!("{} × {fault} at {phase}: {verdict}: {line}", failure["flights"]));
        }
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\n  ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The verdict of a flight whose only mistake was to stop its motors.
    const NEEDLESS: &str = "needless-cut";

    #[test]
    fn one_failure_that_is_not_known_is_too_much() {
        let report = |failed: &[(&str, &str)], violated: u32, idle: u32, wall: f64| {
            let failure = |(fault, verdict): &(&str, &str)| json!({ "fault": fault, "phase": "hover", "verdict": verdict, "flights": 1, "line": "stampfly" });
            json!({
                "flights": FLIGHTS, "cells_flown": 371, "wall_s": wall, "failed": failed.len(), "idle": idle,
                "wrong_class": 0, "violated": violated, "needless_cuts": 0,
                "failures": failed.iter().map(failure).collect::<Vec<_>>(),
            })
        };
        let (edge, bias, cut) = (("edge", "crashed"), ("tof-bias", "flown-away"), ("wall", NEEDLESS));
        let all = [bias, edge, cut];
        let known = failures(&report(&all, 0, 0, 1.0));
        assert_eq!(known.len(), 3);
        assert_eq!(judged(&report(&all, 0, 120, 100.0), &known, &ALL), Ok(()));
        let failed =
            judged(&report(&[bias, edge, cut, ("hand", "I10")], 0, 0, 100.0), &known, &ALL).expect_err("a failure");
        assert!(failed.contains("1 × hand at hover: I10: stampfly") && !failed.contains("× edge"), "{failed}");
        assert!(failed.contains("flights failed"), "the control looks for it");
        assert!(judged(&report(&[bias, edge, edge, cut], 0, 0, 100.0), &known, &ALL).is_err(), "another one");
        let other = judged(&report(&[bias, ("wall", "crashed"), edge], 0, 0, 100.0), &known, &ALL);
        assert!(other.is_err(), "a crash is no needless cut");
        let well = report(&[bias, cut], 0, 0, 100.0);
        assert!(judged(&well, &known, &ALL).is_err(), "the file is out of date");
        let mut some = well.clone();
        some["flights"] = json!(SOME.flights);
        some["idle"] = json!(0);
        assert_eq!(judged(&some, &known, &SOME), Ok(()), "a part of it need not have all");
        assert!(judged(&report(&all, 1, 0, 100.0), &known, &ALL).is_err());
        assert!(judged(&report(&all, 0, 0, 401.0), &known, &ALL).is_err());
        assert!(judged(&report(&all, 0, 121, 100.0), &known, &ALL).is_err());
        assert!(judged(&json!({ "flights": FLIGHTS }), &known, &ALL).is_err());
    }
}
