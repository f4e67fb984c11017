//! `controls`: each step fails when what it looks for is there.
//!
//! `xtask/controls.toml` says, for each step, what is broken and what the step has to say then. Here the last commit is cloned
//! into `target/controls`, broken in one place, and the step is run in that clone: it has to fail, and with these words. Then the
//! place is repaired. Names of steps on the command line restrict the run to these. `--fix` records what each step said; the table of
//! all controls is printed into `docs/reference/checks.md` by `cargo xtask docs --fix`.
//!
//! It is in neither lane: it takes hours, and its result changes only with a step.

use crate::arguments::Arguments;
use crate::control::{Control, List};
use crate::repository::{Failure, Repository, announced, run as run_program};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

const FOLDER: &str = "controls";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let mut list = List::read(repository)?;
    let unknown = arguments.rest.iter().find(|name| !list.controls.iter().any(|control| control.step == **name));
    if let Some(name) = unknown {
        return Err(format!("no control of a step `{name}`"));
    }
    let clone = cloned(repository)?;
    let chosen = |control: &&Control| arguments.rest.is_empty() || arguments.rest.contains(&control.step);
    let mut failures = Vec::new();
    for control in list.controls.iter().filter(chosen).cloned().collect::<Vec<_>>() {
        let begun = Instant::now();
        let outcome = tried(repository, &clone, &control);
        let seconds = begun.elapsed().as_secs_f64();
        match outcome {
            Ok(line) => {
                println!("{:<14} {seconds:>7.1} s  {}: {line}", control.step, control.what);
                if arguments.fix {
                    list.record(&control.step, &line)?;
                }
            }
            Err(failure) => {
                println!("{:<14} {seconds:>7.1} s  {failure}", control.step);
                failures.push(failure);
            }
        }
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// A clone of the last commit. One that is there from before is brought up to it: files that are as
/// they were keep their times, and nothing is built for them again.
fn cloned(repository: &Repository) -> Result<PathBuf, Failure> {
    let clone = repository.target(FOLDER).join("clone");
    let brought_up = [&["fetch", "--quiet", "origin", "HEAD"][..], &["reset", "--quiet", "--hard", "FETCH_HEAD"]];
    let is_there = clone.join(".git").is_dir()
        && brought_up.iter().all(|arguments| {
            let mut git = repository.command("git");
            git.current_dir(&clone).args(*arguments);
            run_program(&mut git).is_ok()
        });
    if !is_there {
        let _ = fs::remove_dir_all(&clone);
        run_program(repository.command("git").args(["clone", "--quiet", "--local", "."]).arg(&clone))?;
    }
    Ok(clone)
}

/// Breaks the clone, runs the step in it and repairs it. Returns the line in which the step says what is wrong.
fn tried(repository: &Repository, clone: &Path, control: &Control) -> Result<String, Failure> {
    let git = |arguments: &[&str]| {
        let mut git = repository.command("git");
        git.current_dir(clone).args(arguments);
        run_program(&mut git)
    };
    for change in &control.changes {
        let path = clone.join(&change.file);
        let io = |e: std::io::Error| format!("{}: {e}", change.file);
        let text = fs::read_to_string(&path).map_err(io)?;
        let broken = change.broken(&text).map_err(|e| format!("{}: {}: {e}", control.step, change.file))?;
        fs::write(&path, broken).map_err(io)?;
    }
    // A step that looks at the last commit looks at this one.
    let identity = ["-c", "user.name=control", "-c", "user.email=control@localhost"];
    if !control.changes.is_empty() {
        git(&[&identity[..], &["commit", "--quiet", "--all", "--message", &control.what]].concat())?;
    }
    let said = said(repository, clone, control);
    if !control.changes.is_empty() {
        git(&["reset", "--quiet", "--hard", "HEAD~1"])?;
    }
    // Paths are those of the repository, whichever machine this is.
    let folders = [clone, &repository.target(FOLDER)].map(|folder| format!("{}/", folder.display()));
    judged(control, said?).map(|line| folders.iter().fold(line, |line, folder| line.replace(folder, "")))
}

/// Runs the step in the clone. Returns whether it passed and everything it wrote.
fn said(repository: &Repository, clone: &Path, control: &Control) -> Result<(bool, String), Failure> {
    let mut xtask = repository.cargo();
    xtask
        .current_dir(clone)
        .args(["run", "--quiet", "--package", "xtask", "--", &control.step])
        .args(&control.arguments);
    xtask.env("CARGO_TARGET_DIR", repository.target(FOLDER).join("target")).env("CARGO_INCREMENTAL", "0");
    // The clone has no recorded flights next to it.
    if let Some(data) = repository.data() {
        xtask.env("STAMPFLY_DATA", data);
    }
    xtask.envs(control.environment.iter().map(|(key, value)| (key, value)));
    let shown = announced(&xtask);
    let output = xtask.output().map_err(|e| format!("`{shown}` could not be started: {e}"))?;
    let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    Ok((output.status.success(), out + &err))
}

/// Did the step fail with these words?
fn judged(control: &Control, (passed, said): (bool, String)) -> Result<String, Failure> {
    let Control { step, what, says, .. } = control;
    let line = said.lines().find(|line| line.contains(says.as_str()));
    match (passed, line) {
        (false, Some(line)) => Ok(line.trim().to_owned()),
        (false, None) => Err(format!("{step} fails for another reason than `{says}`: {what}\n{said}")),
        (true, _) => Err(format!("{step} passes: {what}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::Lane;

    #[test]
    fn only_a_failure_for_the_right_reason_counts() {
        let control = Control { step: "fmt".into(), says: "Diff in".into(), ..Control::default() };
        assert_eq!(judged(&control, (false, "x\n Diff in a.rs\n".into())), Ok("Diff in a.rs".into()));
        assert!(judged(&control, (true, "Diff in a.rs".into())).is_err());
        assert!(judged(&control, (false, "no network".into())).is_err());
    }

    #[test]
    fn every_step_has_a_control() {
        let list = List::read(&Repository::find()).expect("a list");
        let has = |name: &str| list.controls.iter().any(|control| control.step == name);
        let steps = crate::STEPS.iter().filter(|step| step.lane != Lane::Manual).map(|step| step.name);
        assert_eq!(steps.filter(|name| !has(name)).collect::<Vec<_>>(), Vec::<&str>::new());
    }

    /// Code changes, and what a control replaces is there no more.
    #[test]
    fn every_control_finds_what_it_breaks() {
        let repository = Repository::find();
        for control in List::read(&repository).expect("a list").controls {
            for change in &control.changes {
                let text = std::fs::read_to_string(repository.root.join(&change.file)).expect("the file is there");
                assert!(change.broken(&text).is_ok(), "{}: {}: {:?}", control.step, change.file, change.broken(&text));
            }
        }
    }
}
