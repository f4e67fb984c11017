//! `cortex-m4f`: instructions of an estimator's step on an emulated Cortex-M4F, beside the committed figures, and whether
//! its estimates have the same bits there as here.
//!
//! The count is exact and the same on every host. Instructions are not cycles. The package `benches/cortex-m4f` is outside
//! the workspace, so its format and its warnings are looked at here, too.

use crate::arguments::Arguments;
use crate::machine::{EMULATED_ARM, provide};
use crate::ratchet::Budget;
use crate::repository::{Failure, Repository, add_targets, capture, run as run_program};
use std::process::Command;

const TARGET: &str = "thumbv7em-none-eabihf";
/// Instructions that no configuration's step may take, ever: a tenth of a 72 MHz core at one and a half cycles each.
const BAR: f64 = 12_000.0;
/// A run takes less than a second. One that faulted would never end.
const SECONDS: &str = "120";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    add_targets(repository, &[TARGET])?;
    run_program(firmware(repository, "cargo").args(["fmt", "--check"]))?;
    let mut clippy = firmware(repository, "cargo");
    clippy.args(["clippy", "--quiet", "--release", "--locked", "--target-dir"]).arg(repository.target("cortex-m4f"));
    run_program(clippy.args(["--", "-D", "warnings"]))?;

    let there = emulate(repository)?;
    let mut host = repository.cargo();
    host.args(["run", "--quiet", "--release", "--bin", "estimate_hash"]);
    let (here, _) = capture(&mut host)?;
    let budget = Budget::read(repository, "benches/cortex-m4f.toml")?;
    let mut failures = Vec::new();
    for Counted { name, mean, most, hash } in read(&there)? {
        println!("{name}: estimates hash to {hash}, at most {most} instructions in a step");
        if !here.lines().any(|line| line == format!("{name}: hash {hash}")) {
            failures.push(format!("{name}: the host's estimates have other bits:\n{here}"));
        }
        failures.extend(budget.hold(&["instructions_per_step", name], mean, "instructions per step").err());
        if mean > BAR {
            failures.push(format!("{name}: {mean} instructions per step; {BAR} is the most there may ever be"));
        }
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// Builds the firmware, runs it and returns what it says.
pub fn emulate(repository: &Repository) -> Result<String, Failure> {
    add_targets(repository, &[TARGET])?;
    provide(repository, &[&EMULATED_ARM])?;
    let target = repository.target("cortex-m4f");
    // Apart from running it, which has little time.
    let build = ["build", "--quiet", "--release", "--locked", "--target-dir"];
    run_program(firmware(repository, "cargo").args(build).arg(&target))?;
    let mut emulated = firmware(repository, "timeout");
    emulated.args([SECONDS, "cargo", "run", "--quiet", "--release", "--locked", "--target-dir"]);
    Ok(capture(emulated.arg(&target))?.0)
}

/// A command in the firmware's folder: its own `.cargo/config.toml` says how it is built and run, and flags meant for the
/// host would replace that.
fn firmware(repository: &Repository, program: &str) -> Command {
    let mut command = repository.command(program);
    command.current_dir(repository.root.join("benches/cortex-m4f")).env_remove("RUSTFLAGS");
    command
}

/// What the firmware says about one configuration.
#[derive(Debug, PartialEq)]
pub struct Counted<'a> {
    pub name: &'a str,
    /// Instructions of a step.
    pub mean: f64,
    pub most: u64,
    hash: &'a str,
}

/// Everything the firmware says, and an error for anything else.
pub fn read(said: &str) -> Result<Vec<Counted<'_>>, Failure> {
    let counted = said.lines().map(|line| Counted::read(line).ok_or_else(|| format!("what is `{line}`?")));
    let counted = counted.collect::<Result<Vec<_>, _>>()?;
    // Nothing measured would be within every budget.
    if counted.is_empty() { Err("the firmware says nothing".to_owned()) } else { Ok(counted) }
}

impl<'a> Counted<'a> {
    fn read(line: &'a str) -> Option<Self> {
        let (name, rest) = line.split_once(": ")?;
        let words: Vec<&str> = rest.split(' ').collect();
        let ["mean", mean, "most", most, "hash", hash] = words[..] else { return None };
        Some(Self { name, mean: mean.parse().ok()?, most: most.parse().ok()?, hash })
    }
}

#[cfg(test)]
mod tests {
    use super::{Counted, read};

    #[test]
    fn reads_what_the_firmware_says() {
        let counted = Counted { name: "ours, bold", mean: 5.0, most: 9, hash: "00ff" };
        assert_eq!(read("ours, bold: mean 5 most 9 hash 00ff\n"), Ok(vec![counted]));
        assert!(read("panicked at 'x: y'").is_err());
        assert!(read("").is_err());
    }
}
