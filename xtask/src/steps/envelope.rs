//! `envelope` and `envelope-all`: sound vehicles through everything that may be flown and met
//! (`stampfly campaign --envelope`).
//!
//! | step | flights |
//! |---|---|
//! | `envelope` | the first 400 |
//! | `envelope-all` | 5,000 |
//!
//! Nothing is broken in them, so each has to end well, and the vehicle does nothing by itself. The
//! flights that do not are listed in `xtask/envelope.json` by their seed, with what they end as: no
//! other may fail, and one that ends well has to leave the list. Flights are the same on every
//! machine. `--fix` writes the list; the folder of recorded flights is not used.

use super::program::{built, released};
use super::safety::report;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const FILE: &str = "xtask/envelope.json";
/// The repository's stick files.
const STICKS: &str = "stampfly-board/sticks";
const SEED: u64 = 1;
const SOME: u64 = 400;
const ALL: u64 = 5_000;

/// Ends of the flights that do not end well, by their seed.
type Failed = BTreeMap<u64, String>;

pub fn some(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let known = read(repository)?;
    judged(&fly(repository, &built(repository)?, SOME)?, &known, SOME)
}

pub fn all(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let report = fly(repository, &released(repository)?, ALL)?;
    if arguments.fix {
        let text = serde_json::to_string_pretty(&failed(&report)).map_err(|e| format!("{FILE}: {e}"))? + "\n";
        return fs::write(repository.root.join(FILE), text).map_err(|e| format!("{FILE}: {e}"));
    }
    judged(&report, &read(repository)?, ALL)
}

fn fly(repository: &Repository, program: &Path, flights: u64) -> Result<Value, Failure> {
    let mut campaign = repository.command(&program.to_string_lossy());
    campaign.args(["campaign", "--envelope", "--json", "--sticks", STICKS]);
    report(campaign.args(["--flights", &flights.to_string(), "--seed", &SEED.to_string()]))
}

fn read(repository: &Repository) -> Result<Failed, Failure> {
    let text = fs::read_to_string(repository.root.join(FILE)).map_err(|e| format!("{FILE}: {e}"))?;
    serde_json::from_str(&text).map_err(|e| format!("{FILE}: {e}"))
}

/// The flights that did not end well.
fn failed(report: &Value) -> Failed {
    let flights = report["each"].as_array().map(Vec::as_slice).unwrap_or_default();
    let bad = flights.iter().filter(|flight| flight["ended_well"] != true);
    bad.filter_map(|flight| Some((flight["seed"].as_u64()?, end(flight)))).collect()
}

/// What a sound vehicle did by itself, or how the flight ended.
fn end(flight: &Value) -> String {
    let interventions = flight["interventions"].as_array().map(Vec::as_slice).unwrap_or_default();
    let sound = interventions.iter().find(|one| one["sound"] == true);
    let word = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    sound.map_or_else(
        || format!("{}: {}", word(&flight["outcome"]), word(&flight["reason"])),
        |one| format!("{} {} of a sound vehicle", word(&one["alert"]), word(&one["action"])),
    )
}

/// The flights with these seeds fail, and no others.
fn judged(report: &Value, known: &Failed, flights: u64) -> Result<(), Failure> {
    if report["flights"].as_u64() != Some(flights) {
        return Err("not all flights were flown".to_owned());
    }
    let now = failed(report);
    println!("{} of {flights} flights did not end well", now.len());
    let flown = |seed: &&u64| (SEED..SEED + flights).contains(*seed);
    let mut wrong: Vec<_> = now
        .iter()
        .filter(|(seed, _)| !known.contains_key(seed))
        .map(|(seed, end)| format!("seed {seed} did not end well: {end}"))
        .collect();
    let better = known.keys().filter(flown).filter(|seed| !now.contains_key(seed));
    wrong.extend(better.map(|seed| format!("seed {seed} ends well: `cargo xtask envelope-all --fix`")));
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\n  ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn flight(seed: u64, well: bool) -> Value {
        json!({ "seed": seed, "ended_well": well, "outcome": "crashed", "reason": "into a wall", "interventions": [] })
    }

    #[test]
    fn only_known_flights_may_fail_and_they_have_to() {
        let report = |second: bool| json!({ "flights": 2, "each": [flight(1, true), flight(2, second)] });
        let known: Failed = [(2, String::new()), (7, String::new())].into();
        assert_eq!(judged(&report(false), &known, 2), Ok(()), "the other is not flown");
        assert!(judged(&report(true), &known, 2).expect_err("it has become better").contains("seed 2 ends well"));
        let failure = judged(&report(false), &Failed::new(), 2).expect_err("it is not known");
        assert!(failure.contains("seed 2 did not end well: crashed: into a wall"), "{failure}");
        assert!(judged(&report(false), &known, 3).is_err(), "a flight is missing");
    }

    #[test]
    fn what_a_sound_vehicle_did_is_what_is_told() {
        let mut told = flight(1, false);
        told["interventions"] = json!([
            { "alert": "IMPACT", "action": "cut", "sound": false },
            { "alert": "MOTOR_WEAK", "action": "land", "sound": true },
        ]);
        assert_eq!(end(&told), "MOTOR_WEAK land of a sound vehicle");
    }
}
