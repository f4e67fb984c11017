//! `foreign`: the firmware, and drivers, on a machine that nobody here wrote: labwired, an emulator with models of its own of
//! Espressif's chips and of sensors.
//!
//! | stage | on | said by |
//! |---|---|---|
//! | motors low, chip selects high, golden flight, first control passes | ESP32-C6 | `stampfly-board/foreign/stages.py` |
//! | drivers of BMP280, VL53L3CX and BMI270 over its sensors | ESP32-C3 | `stampfly-board/foreign/drivers.py` |
//!
//! The program for the C6 is the one that `esp32` builds. The chip's mask ROM, in whose functions a good part of it runs, is Espressif's, as
//! the archive of the crate `espflash` has it. Each stage that is not reached fails, and controls with a fault must be refused.

use super::esp32;
use super::no_std::debian_cargo;
use crate::arguments::Arguments;
use crate::machine::{COMPILER, LINKER, provide};
use crate::repository::{Failure, Repository, python_tool, run as run_program};
use std::path::{Path, PathBuf};
use std::process::Command;

const FOLDER: &str = "stampfly-board/foreign";
/// Its Python package. Descriptions and registers of this version are counted on.
const LABWIRED: &str = "labwired==0.25.0";
/// The crate with the mask ROMs, and its version.
const ESPFLASH: (&str, &str) = ("espflash", "4.7.0");
const C3: &str = "riscv32imc-unknown-none-elf";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let firmware = esp32::c6(repository)?;
    let record = repository.root.join("stampfly-board/golden/flight.bin");
    run_program(
        python(repository, "stages.py")?.arg(firmware).arg(rom(repository, "esp32c6_rev0_rom.elf")?).arg(record),
    )?;
    let program = drivers(repository)?;
    run_program(python(repository, "drivers.py")?.arg(program).arg(rom(repository, "esp32c3_rev300_rom.elf")?))
}

/// Python with labwired, running this file.
fn python(repository: &Repository, file: &str) -> Result<Command, Failure> {
    let mut python = python_tool(repository, LABWIRED, "python")?;
    python.env("PYTHONDONTWRITEBYTECODE", "1").arg(repository.root.join(FOLDER).join(file));
    Ok(python)
}

/// The mask ROM of a chip. Asked about a crate, cargo fetches its archive and unpacks it.
fn rom(repository: &Repository, file: &str) -> Result<PathBuf, Failure> {
    let (name, version) = ESPFLASH;
    run_program(
        repository.cargo().args(["info", "--quiet", &format!("{name}@{version}")]).stdout(std::process::Stdio::null()),
    )?;
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home =
        home.or_else(|| std::env::var_os("HOME").map(|home| Path::new(&home).join(".cargo"))).ok_or("no home")?;
    let sources = home.join("registry/src");
    let registries = sources.read_dir().map_err(|e| format!("{}: {e}", sources.display()))?.flatten();
    let mut places =
        registries.map(|registry| registry.path().join(format!("{name}-{version}/resources/roms")).join(file));
    places.find(|place| place.exists()).ok_or_else(|| format!("{name} {version} has no {file}"))
}

/// Builds the program with the drivers for an ESP32-C3.
fn drivers(repository: &Repository) -> Result<PathBuf, Failure> {
    provide(repository, &[&COMPILER, &LINKER])?;
    let manifest = repository.root.join(FOLDER).join("drivers/Cargo.toml");
    run_program(repository.cargo().args(["fmt", "--check", "--manifest-path"]).arg(&manifest))?;
    let mut cargo = debian_cargo(repository);
    cargo.args(["build", "--quiet", "--locked", "--release", "-Zbuild-std=core,alloc", "--target", C3]);
    cargo.arg("--target-dir").arg(repository.target("foreign")).arg("--manifest-path").arg(manifest);
    cargo.env("CARGO_TARGET_RISCV32IMC_UNKNOWN_NONE_ELF_LINKER", "ld.lld-22");
    cargo.env("RUSTFLAGS", "-Clinker-flavor=ld.lld -Cforce-frame-pointers");
    run_program(&mut cargo)?;
    Ok(repository.target("foreign").join(C3).join("release/stampfly-foreign-drivers"))
}
