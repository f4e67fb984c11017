//! Flies the copy with a bug on or off, and looks for a flight that shows one.

use super::guard::VARIABLE;
use super::list::Bug;
use crate::repository::{Failure, Repository, json};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A fault that changed nothing: such a flight says nothing, as in a campaign.
const IDLE: &str = "I12";
/// How a flight ends whose program does not come to its end.
const PANICKED: &str = "panicked";
/// Where the drivers are.
const DRIVERS: &str = "stampfly-drivers/";
/// Campaigns that look for a flight: the first has every fault, the second every moment of a program's flight, the last every
/// mode and some at random. Flights without a fault come before all of them.
const CAMPAIGNS: [&str; 3] = ["90", "600", "3000"];

/// Other seeds with which a flight is flown again, and in how many of them it has to show the bug: a flight at the edge ends
/// otherwise whatever is changed, and says nothing about what was.
const OTHERS: std::ops::Range<u64> = 20_001..20_006;
const SHOWN: usize = 2;

/// The copy, ready to fly.
pub struct Copy {
    pub program: PathBuf,
    /// Where flights leave their logs.
    pub out: PathBuf,
}

impl Copy {
    /// Flies a line with a bug on, or with none. What is wrong with its end, as a campaign says it; `None` when it ends well.
    pub fn fly(&self, repository: &Repository, line: &str, bug: Option<&Bug>) -> Result<Option<String>, Failure> {
        let words = words(line)?;
        let arguments = words.strip_prefix(&["stampfly".to_owned()]).ok_or_else(|| format!("no flight: {line}"))?;
        let name = bug.map_or("none", |bug| &bug.name);
        let out = self.out.join(format!("{name}-{}", std::process::id()));
        let mut command = self.command(repository, bug);
        command.args(arguments).args(["--json", "--out"]).arg(&out);
        let output = command.output().map_err(|e| format!("stampfly could not be started: {e}"))?;
        let report = String::from_utf8_lossy(&output.stdout);
        match output.status.code() {
            Some(0 | 1) if report.starts_with('{') => Ok(wrong(&json(&report)?)),
            Some(101) => Ok(Some(PANICKED.to_owned())),
            _ => Err(format!("{line}: {}\n{}", output.status, String::from_utf8_lossy(&output.stderr))),
        }
    }

    /// The first flight of the campaigns that ends wrong with the bug and well without it, with other seeds as well, and how it
    /// ends.
    pub fn search(&self, repository: &Repository, bug: &Bug) -> Result<Option<(String, String)>, Failure> {
        for flights in CAMPAIGNS {
            let mut campaign = self.command(repository, Some(bug));
            campaign.args(["campaign", "--faults", "--again", "--json", "--flights", flights]);
            // Models of sensors have no drivers.
            if bug.file.starts_with(DRIVERS) {
                campaign.arg("--chips");
            }
            let output = campaign.arg("--out").arg(self.out.join("campaign")).output();
            let output = output.map_err(|e| format!("stampfly could not be started: {e}"))?;
            let report = json(&String::from_utf8_lossy(&output.stdout))?;
            for failure in report["failures"].as_array().into_iter().flatten() {
                let line = failure["line"].as_str().unwrap_or_default();
                let Some(ends) = self.shows(repository, line, bug)? else { continue };
                let mut shown = 0;
                for seed in OTHERS {
                    shown += usize::from(self.shows(repository, &with_seed(line, seed)?, bug)?.is_some());
                }
                if shown >= SHOWN {
                    return Ok(Some((line.to_owned(), ends)));
                }
            }
        }
        Ok(None)
    }

    /// How a flight ends that ends wrong with the bug and well without it.
    pub fn shows(&self, repository: &Repository, line: &str, bug: &Bug) -> Result<Option<String>, Failure> {
        match self.fly(repository, line, Some(bug))? {
            Some(ends) if self.fly(repository, line, None)?.is_none() => Ok(Some(ends)),
            _ => Ok(None),
        }
    }

    fn command(&self, repository: &Repository, bug: Option<&Bug>) -> Command {
        let mut command = repository.command(&self.program.display().to_string());
        command.env_remove(VARIABLE).envs(bug.map(|bug| (VARIABLE, &bug.name)));
        command.stdin(Stdio::null());
        command
    }
}

/// The program and its folder for flights.
pub fn copy(program: &Path, repository: &Repository) -> Copy {
    Copy { program: program.to_owned(), out: repository.target("bugs/flights") }
}

/// What is wrong with a flight's end: its class where that is not acceptable, and invariants that did not hold.
fn wrong(report: &Value) -> Option<String> {
    let outcome = report["outcome"].as_str().filter(|_| report["as_expected"] != true);
    let violations = report["violations"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let all: Vec<_> = outcome.into_iter().chain(violations.filter(|name| *name != IDLE)).collect();
    (!all.is_empty()).then(|| all.join(" "))
}

/// The same flight with another seed.
fn with_seed(line: &str, seed: u64) -> Result<String, Failure> {
    const OPTION: &str = "--seed ";
    let (before, after) = line.split_once(OPTION).ok_or_else(|| format!("no seed: {line}"))?;
    let rest = after.trim_start_matches(|letter: char| letter.is_ascii_digit());
    Ok(format!("{before}{OPTION}{seed}{rest}"))
}

/// Words as the campaign writes them for a shell: between single quotes where there is anything but letters.
fn words(line: &str) -> Result<Vec<String>, Failure> {
    let (mut words, mut word, mut quoted) = (Vec::new(), None::<String>, false);
    for letter in line.chars() {
        match letter {
            '\'' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            ' ' if !quoted => words.extend(word.take()),
            '"' | '\\' => return Err(format!("no plain words: {line}")),
            letter => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    if quoted { Err(format!("a quote is open: {line}")) } else { Ok(words) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn words_are_read_as_a_shell_reads_them() {
        let all = |line: &str| words(line).map(|words| words.join("|"));
        assert_eq!(
            all("stampfly fly --mission 'arm; land' --seed 1"),
            Ok("stampfly|fly|--mission|arm; land|--seed|1".into())
        );
        assert_eq!(all("a ''  b"), Ok("a||b".into()));
        assert!(all("a 'b").is_err() && all("a \"b\"").is_err());
    }

    #[test]
    fn a_flight_is_flown_again_with_another_seed() {
        assert_eq!(with_seed("stampfly fly --seed 17 --gust 1", 3), Ok("stampfly fly --seed 3 --gust 1".to_owned()));
        assert!(with_seed("stampfly fly", 3).is_err());
    }

    #[test]
    fn a_flight_is_wrong_as_in_a_campaign() {
        let ended = |outcome: &str, as_expected: bool, violations: &[&str]| {
            wrong(&json!({ "outcome": outcome, "as_expected": as_expected, "violations": violations }))
        };
        assert_eq!(ended("cut", true, &[]), None);
        assert_eq!(ended("cut", true, &["I12"]), None, "a fault that changed nothing");
        assert_eq!(ended("crashed", false, &[]).as_deref(), Some("crashed"));
        assert_eq!(ended("landed", true, &["I10"]).as_deref(), Some("I10"));
        assert_eq!(ended("kept-on", false, &["I10", "I12"]).as_deref(), Some("kept-on I10"));
    }
}
