//! `record`: does what the emulated board records of a flight replay bit for bit on this PC?
//!
//! The firmware's flight task, with its drivers and its executor, flies on an emulated core over a script of what its chips
//! answered (as for `cargo xtask cache`) and writes the compact record as it goes. What its memory holds at the end comes out over the
//! emulator's console. The PC replays all of it, at least twenty seconds, and has to find the same bits; then it has to name what
//! differs after one bit of a sample has been changed.

use super::core1;
use super::qemu::{MACHINES, Machine, PACKAGE, inside};
use crate::arguments::Arguments;
use crate::machine::{EMULATED_OTHERS, provide};
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::fs;

/// What is flown: some 24 seconds in the air.
const MISSION: &str =
    "arm; takeoff 0.5; hover 4; goto 0.5 0 0.7; goto 0.5 0.5 0.5; hover 6; goto 0 0 0.5; hover 3; land";
/// The machine: its floating-point unit and number of registers are nearest to the ESP32-S3's among those that need no other compiler.
const MACHINE: &str = "RV32IMAFC";
/// A flight takes half a minute there. One that faulted would never end.
const SECONDS: &str = "240";
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

fn machine() -> Result<&'static Machine, Failure> {
    MACHINES.iter().find(|machine| machine.name == MACHINE).ok_or_else(|| format!("there is no machine {MACHINE}"))
}
