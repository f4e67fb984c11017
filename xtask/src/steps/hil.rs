//! `hil`: a mission flown by a vehicle on an emulated core, over the line that the firmware has, against this PC's world. The
//! same bits as flown on this PC?
//!
//! `stampfly hil` has the world, and QEMU's RV32IMAFC core the vehicle: the flight loop, the bus and the vehicle's end of the
//! conversation, compiled for it. The hash is over everything published, the duties too. Controls: another seed must give
//! another hash, and a vehicle that is gone must be an error.

use super::program::released;
use super::qemu::{MACHINES, Machine, inside, toolchain};
use crate::arguments::Arguments;
use crate::machine::{EMULATED_OTHERS, provide};
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::path::PathBuf;

const PROGRAM: &str = "stampfly-hil";
const MISSION: &str = "hover";
/// The whole mission takes 11 s of wall time; one that hangs would never end.
const SECONDS: &str = "180";
const TARGET: &str = "riscv32imafc-unknown-none-elf";
/// The emulator, as in the package's `.cargo/config.toml`. By semihosting its program reads and writes what this command does.
const EMULATOR: &str = "qemu-system-riscv32 -M virt -cpu rv32 -bios none -nographic -monitor none -serial none \
                        -semihosting-config enable=on,target=native -icount shift=0 -kernel";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&EMULATED_OTHERS])?;
    let mut clippy = inside(repository, repository.cargo());
    clippy.args(["clippy", "--quiet", "--locked", "--bin", PROGRAM, "--features", "hil", "--target-dir"]);
    run_program(clippy.arg(repository.target("qemu")).args(["--", "-D", "warnings"]))?;
    let machine = MACHINES.iter().find(|machine| machine.target == TARGET).ok_or("no such machine")?;
    let vehicle = format!("{EMULATOR} {}", vehicle(repository, machine)?.display());
    let stampfly = released(repository)?;

    let flown = |seed: &str, options: &[&str]| -> Result<String, Failure> {
        let mut limited = repository.command("timeout");
        limited.arg(SECONDS).arg(&stampfly).args(options);
        let out = repository.target("hil");
        limited.args(["--mission", MISSION, "--seed", seed, "--json", "--out"]).arg(&out);
        Ok(capture(&mut limited)?.0)
    };
    let here = flown("1", &["fly"])?;
    let there = flown("1", &["hil", "--program", &vehicle])?;
    let hashes = [&here, &there].map(|said| field(said, "log_hash"));
    let [Some(here), Some(there)] = hashes else { return Err(format!("a flight says no hash: {here}\n{there}")) };
    if here != there {
        return Err(format!("{}: hash {there} over the line, {here} on this PC", machine.name));
    }
    println!("{}: mission {MISSION}, hash {there} over the line and on this PC", machine.name);
    if field(&flown("2", &["fly"])?, "log_hash") == Some(here) {
        return Err(format!("another flight has the same hash {here}"));
    }
    match flown("1", &["hil", "--program", "true"]) {
        Ok(said) => Err(format!("without a vehicle it flies all the same:\n{said}")),
        Err(said) if said.contains("the line to the vehicle is gone") => Ok(()),
        Err(said) => Err(format!("without a vehicle it should say that the line is gone:\n{said}")),
    }
}

/// Builds the vehicle's end for a machine.
fn vehicle(repository: &Repository, machine: &Machine) -> Result<PathBuf, Failure> {
    let (mut cargo, options) = toolchain(repository, machine)?;
    run_program(cargo.arg("build").args(&options).args(["--bin", PROGRAM, "--features", "hil"]))?;
    Ok(repository.target("qemu").join(machine.target).join("release").join(PROGRAM))
}

/// A text in a JSON object on one line.
fn field<'s>(said: &'s str, name: &str) -> Option<&'s str> {
    let (_, rest) = said.split_once(&format!("\"{name}\":\""))?;
    rest.split('"').next()
}

#[cfg(test)]
mod tests {
    use super::field;

    #[test]
    fn a_field_is_found() {
        let said = "{\"a\":1,\"log_hash\":\"00ff\",\"b\":\"x\"}";
        assert_eq!((field(said, "log_hash"), field(said, "a"), field(said, "c")), (Some("00ff"), None, None));
    }
}
