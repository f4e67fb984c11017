//! `machine`: what is missing that the steps of `ci` need, with the commands to get it, before anything is built.
//!
//! Debian's packages are installed by the steps themselves where that is possible, which is as root with `apt-get`.

use crate::arguments::Arguments;
use crate::machine::{FOR_CI, exists, installing, missing};
use crate::repository::{Failure, Repository, capture};
use std::process::{Command, Stdio};

/// Programs that no step installs, and how to.
const PROGRAMS: [(&str, &str); 5] = [
    ("cc", "apt-get install -y build-essential"),
    ("git", "apt-get install -y git"),
    ("rustup", "rustup, from https://rustup.rs"),
    ("taskset", "apt-get install -y util-linux"),
    ("timeout", "apt-get install -y coreutils"),
];
/// Commands that only work when something is there, and how to get it.
const PARTS: [(&[&str], &str); 3] = [
    (&["cargo", "clippy", "--version"], "rustup component add clippy"),
    (&["cargo", "fmt", "--version"], "rustup component add rustfmt"),
    (&["python3", "-c", "import ensurepip, venv"], "apt-get install -y python3-venv"),
];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let programs = PROGRAMS.iter().filter(|(program, _)| !exists(program)).map(|(_, command)| *command);
    let parts = PARTS.iter().filter(|(test, _)| !works(repository, test)).map(|(_, command)| *command);
    let mut wanted: Vec<String> = programs.chain(parts).map(str::to_owned).collect();
    let packages = missing(&FOR_CI);
    if !packages.is_empty() && installs(repository) {
        println!("steps will install {packages:?}");
    } else if !packages.is_empty() {
        wanted.push(installing(&packages));
    }
    if wanted.is_empty() { Ok(()) } else { Err(format!("this machine needs\n  {}", wanted.join("\n  "))) }
}

fn works(repository: &Repository, command: &[&str]) -> bool {
    let Some((program, arguments)) = command.split_first() else { return false };
    let mut command: Command = repository.command(program);
    let status = command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

/// May we install packages?
fn installs(repository: &Repository) -> bool {
    let root = capture(repository.command("id").arg("-u")).is_ok_and(|(id, _)| id.trim() == "0");
    root && exists("apt-get")
}
