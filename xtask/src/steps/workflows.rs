//! `workflows`: the workflows in `.github` and the scripts that they run.
//!
//! The linter is jactionlint, a fork of actionlint with the same checks: GitHub's syntax, types in
//! expressions, the inputs of known actions. It also asks for least permissions, time limits and
//! pinned actions. The Python package of actionlint itself downloads the program from another place
//! when it is installed. The linter works without a network. Each run of the step first shows that
//! the linter refuses broken workflows.

use crate::arguments::Arguments;
use crate::machine::{SHELLCHECK, provide};
use crate::repository::{Failure, Repository, capture, python_tool, run as run_program};
use std::fs;

const LINTER: &str = "jactionlint==2.3.0";
const WORKFLOWS: &str = ".github/workflows";
/// Scripts that workflows run; the linter sees only what is written in a workflow.
const SCRIPTS: [&str; 4] = [".ci/run", ".github/prepare", ".github/recorded-flights", ".github/summary"];

/// A workflow without a mistake.
const SOUND: &str = "\
name: sound
on: workflow_dispatch
permissions:
  contents: read
concurrency:
  group: sound
  cancel-in-progress: true
jobs:
  first:
    runs-on: ubuntu-24.04
    timeout-minutes: 5
    steps:
      - run: echo ${{ github.sha }}
  second:
    needs: first
    runs-on: ubuntu-24.04
    timeout-minutes: 5
    steps:
      - run: echo second
";
/// Mistakes: what is replaced in [`SOUND`], by what, and what the linter has to say.
const BROKEN: [(&str, &str, &str); 5] = [
    ("timeout-minutes", "timeout-minuts", "unexpected key \"timeout-minuts\""),
    ("github.sha", "github.shaa", "property \"shaa\" is not defined"),
    ("needs: first", "needs: third", "needs job \"third\" which does not exist"),
    ("contents: read", "contents: everything", "\"everything\" is invalid"),
    ("    timeout-minutes: 5\n", "", "\"timeout-minutes\" is not set"),
];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&SHELLCHECK])?;
    refuses_broken_ones(repository)?;
    let folder = repository.root.join(WORKFLOWS);
    let entries = fs::read_dir(&folder).map_err(|e| format!("{WORKFLOWS}: {e}"))?;
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut files: Vec<_> =
        names.filter(|name| name.ends_with(".yml")).map(|name| format!("{WORKFLOWS}/{name}")).collect();
    files.sort();
    if files.is_empty() {
        return Err(format!("no workflow in {WORKFLOWS}"));
    }
    run_program(python_tool(repository, LINTER, "jactionlint")?.arg("--strict-exit").args(&files))?;
    run_program(repository.command("shellcheck").args(SCRIPTS))?;
    println!(
        "{} workflows and {} scripts are sound; {} broken workflows are refused",
        files.len(),
        SCRIPTS.len(),
        BROKEN.len()
    );
    Ok(())
}

/// Does the linter accept the sound workflow and refuse each broken one?
fn refuses_broken_ones(repository: &Repository) -> Result<(), Failure> {
    let file = repository.target("workflows").join("made.yml");
    let folder = file.parent().unwrap_or(&repository.root);
    let io = |e: std::io::Error| format!("{}: {e}", file.display());
    fs::create_dir_all(folder).map_err(io)?;
    let lint = |text: &str| {
        fs::write(&file, text).map_err(io)?;
        Ok::<_, Failure>(capture(python_tool(repository, LINTER, "jactionlint")?.arg("--strict-exit").arg(&file)))
    };
    lint(SOUND)??;
    for (from, to, says) in BROKEN {
        match lint(&SOUND.replacen(from, to, 1))? {
            Ok(_) => return Err(format!("{LINTER} accepts a workflow with `{to}` in the place of `{from}`")),
            Err(said) if said.contains(says) => {}
            Err(said) => return Err(format!("{LINTER} does not say `{says}`:\n{said}")),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_broken_workflow_differs_from_the_sound_one() {
        for (from, to, _) in BROKEN {
            assert_ne!(SOUND.replacen(from, to, 1), SOUND, "{from}");
        }
    }
}
