//! Which steps have passed for the commit that is checked out, so that a lane that was broken off goes on where it was.
//!
//! A line a step in `target/xtask/LANE.passed`: commit, seconds since 1970, seconds that it took, name. A working copy with
//! changes is at no commit: its steps are neither kept nor left out.

use super::table::Outcome;
use crate::repository::{Failure, Repository, capture};
use crate::step::Lane;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// For how long a step that passed is not run again, s.
const DAY: u64 = 24 * 3600;

/// The steps that have passed.
pub struct Passed {
    path: PathBuf,
    /// The commit that is checked out; `None` if something was changed since.
    commit: Option<String>,
    /// Name and duration in seconds.
    steps: Vec<(String, f64)>,
}

impl Passed {
    pub fn of(repository: &Repository, lane: Lane) -> Result<Self, Failure> {
        let git = |arguments: &[&str]| {
            let mut git = repository.command("git");
            capture(git.args(arguments)).map(|(said, _)| said.trim().to_owned())
        };
        let is_clean = git(&["status", "--porcelain"])?.is_empty();
        let commit = if is_clean { Some(git(&["rev-parse", "HEAD"])?) } else { None };
        let path = repository.target("xtask").join(lane.name()).with_extension("passed");
        let text = fs::read_to_string(&path).unwrap_or_default();
        let steps = commit.as_ref().map(|commit| read(&text, commit, now())).unwrap_or_default();
        Ok(Self { path, commit, steps })
    }

    /// Duration of a step that has passed, s.
    pub fn seconds(&self, step: &str) -> Option<f64> {
        self.steps.iter().find(|(name, _)| name == step).map(|(_, seconds)| *seconds)
    }

    /// A step has ended now: writes it down if it has passed.
    pub fn remember(&self, step: &str, seconds: f64, outcome: Outcome) -> Result<(), Failure> {
        let Some(commit) = self.commit.as_ref().filter(|_| outcome == Outcome::Passed) else { return Ok(()) };
        let line = format!("{commit} {} {seconds:.1} {step}\n", now());
        let file = OpenOptions::new().create(true).append(true).open(&self.path);
        file.and_then(|mut file| file.write_all(line.as_bytes())).map_err(|e| format!("{}: {e}", self.path.display()))
    }
}

fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// The steps of a commit that passed within a day. A line that was cut short is none.
fn read(text: &str, commit: &str, now: u64) -> Vec<(String, f64)> {
    let step = |line: &str| {
        let words: Vec<&str> = line.split(' ').collect();
        let [of, at, seconds, name] = words[..] else { return None };
        let age = now.checked_sub(at.parse().ok()?)?;
        (of == commit && age < DAY).then_some((name.to_owned(), seconds.parse().ok()?))
    };
    text.lines().filter_map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::{Outcome, Passed, now, read};

    #[test]
    fn a_step_that_failed_is_run_again() {
        let path = std::env::temp_dir().join(format!("passed-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let passed = Passed { path: path.clone(), commit: Some("aa".to_owned()), steps: Vec::new() };
        for (step, outcome) in [("fmt", Outcome::Passed), ("doc", Outcome::Failed), ("late", Outcome::PassedEarlier)] {
            passed.remember(step, 1.0, outcome).expect("a file");
        }
        let text = std::fs::read_to_string(&path).expect("a file");
        std::fs::remove_file(&path).expect("removed");
        assert_eq!(read(&text, "aa", now()), [("fmt".to_owned(), 1.0)]);
    }

    #[test]
    fn only_this_commits_steps_of_the_last_day_count() {
        let text = "aa 100000 2.5 fmt\nbb 100000 3.0 test\naa 10000 1.0 doc\naa 200000 1.0 late\naa 1000";
        assert_eq!(read(text, "aa", 100_010), [("fmt".to_owned(), 2.5)]);
    }
}
