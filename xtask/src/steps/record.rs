//! `record`: does what the emulated board records of a flight replay bit for bit on this PC?
//!
//! The firmware's flight task, with its drivers and its executor, flies on an emulated core over a script of what its chips
//! answered (as for `cargo xtask cache`) and writes the compact record into a ring, out of which it is streamed in chunks as it goes.
//! They come out over the emulator's console at the end. The PC replays all of it, at least twenty seconds, and has to find the same bits; then it has to name what
//! differs after one bit of a sample has been changed.

use super::core1;
use super::qemu::{MACHINES, Machine, PACKAGE, inside};
use crate::arguments::Arguments;
use crate::machine::{EMULATED_OTHERS, provide};
use crate::ratchet::Budget;
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::fs;

/// What is flown: some 24 seconds in the air.
const MISSION: &str =
    "arm; takeoff 0.5; hover 4; goto 0.5 0 0.7; goto 0.5 0.5 0.5; hover 6; goto 0 0 0.5; hover 3; land";
/// The machine: its floating-point unit and number of registers are nearest to the ESP32-S3's among those that need no other compiler.
const MACHINE: &str = "RV32IMAFC";
/// A flight takes half a minute there. One that faulted would never end.
const SECONDS: &str = "240";
/// Of the chain's instructions, key frames included.
const MOST: f64 = 0.05;
const BUDGET: &str = "stampfly-board/qemu/budget.toml";
/// The feature with which the core records, and the program that replays.
const FEATURE: &str = "core1-compact";
const REPLAY: (&str, &str) = ("stampfly-core1-replay", "core1-replay");

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&EMULATED_OTHERS])?;
    let script = core1::script(repository, "record.bin", Some(MISSION))?;
    let machine = machine()?;
    let said = core1::emulate(repository, machine, &script, FEATURE, SECONDS)?;
    let figures: Vec<&str> = said.lines().filter(|line| !line.starts_with("record ")).collect();
    println!("{}: {}", machine.name, figures.join("\n  "));
    if !said.lines().any(|line| line.starts_with("compact: ") && line.ends_with(", 0 lost")) {
        return Err(format!("{}: something of the record was lost", machine.name));
    }
    hold(repository, &said)?;
    let target = repository.target("qemu");
    let printed = target.join("record.txt");
    fs::write(&printed, &said).map_err(|e| format!("{}: {e}", printed.display()))?;
    let cargo = |command: &str| {
        let mut cargo = inside(repository, repository.cargo());
        cargo.args([command, "--quiet", "--release", "--locked", "--target-dir"]).arg(&target);
        cargo.args(["--features", REPLAY.1, "--bin", REPLAY.0]);
        cargo
    };
    run_program(cargo("clippy").args(["--", "-D", "warnings"]))?;
    let (said, _) = capture(cargo("run").arg("--").arg(&printed))?;
    print!("{said}");
    // Two changes, of what came from outside and of what was computed: both must have been named.
    match said.lines().filter(|line| line.contains(" changed by a bit: activation ")).count() {
        2 => Ok(()),
        named => Err(format!("{PACKAGE}: {named} of 2 changes were named")),
    }
}

/// Holds what the record takes of a pass, in instructions, to its budget. Printed beside it: which share of the chain that is.
fn hold(repository: &Repository, said: &str) -> Result<(), Failure> {
    let (chain, record) =
        instructions(said).ok_or_else(|| format!("{PACKAGE}: nothing about instructions:\n{said}"))?;
    let share = record / chain;
    println!("the record takes {:.1} % of the chain's instructions", 100.0 * share);
    if share > MOST {
        return Err(format!("{PACKAGE}: the record takes more than {:.0} % of the chain's instructions", 100.0 * MOST));
    }
    Budget::read(repository, BUDGET)?.hold(&[MACHINE, "record"], record, "instructions a pass for the compact record")
}

/// Of a pass: the chain's, and the record's.
fn instructions(said: &str) -> Option<(f64, f64)> {
    let line = said.lines().find_map(|line| line.strip_prefix("instructions of a pass: "))?;
    let words: Vec<&str> = line.split(' ').collect();
    let ["chain", chain, "record", record, "of", ..] = words[..] else { return None };
    let numbers = (chain.parse().ok()?, record.parse().ok()?);
    (numbers.0 > 0.0 && numbers.1 > 0.0).then_some(numbers)
}

fn machine() -> Result<&'static Machine, Failure> {
    MACHINES.iter().find(|machine| machine.name == MACHINE).ok_or_else(|| format!("there is no machine {MACHINE}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_the_program_says() {
        let said = "until 5 us\ninstructions of a pass: chain 13545 record 664 of 10796 passes; of it key frames 39\n";
        assert_eq!(instructions(said), Some((13_545.0, 664.0)));
        assert_eq!((instructions(""), instructions(&said.replace("664", "0"))), (None, None));
        assert!(machine().is_ok());
    }
}
