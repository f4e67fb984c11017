//! `foreign`: the firmware on a machine that nobody here wrote: labwired, an emulator with models of its own of Espressif's chips.
//!
//! The program is the ESP32-C6's, as `esp32` builds it. `stampfly-board/foreign/stages.py` runs it from reset through motors low, chip selects
//! high and the golden flight to the first control passes: each stage that is not reached fails, and controls with a fault must be
//! refused. The chip's mask ROM, in whose functions the program's arithmetic runs, is Espressif's, as the archive of the
//! crate `espflash` has it. How far it comes, and why no further, is in `docs/explain/hardware-status.md`.

use super::esp32;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, python_tool, run as run_program};
use std::path::{Path, PathBuf};
use std::process::Stdio;

const FOLDER: &str = "stampfly-board/foreign";
/// Its Python package. Descriptions and registers of this version are counted on.
const LABWIRED: &str = "labwired==0.25.0";
/// The recorded flight that the program has.
const RECORD: &str = "stampfly-board/golden/flight.bin";
/// The crate with the mask ROMs, and its version.
const ESPFLASH: (&str, &str) = ("espflash", "4.7.0");
const ROM: &str = "esp32c6_rev0_rom.elf";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let firmware = esp32::c6(repository, esp32::Variant::Default)?;
    let mut python = python_tool(repository, LABWIRED, "python")?;
    python.env("PYTHONDONTWRITEBYTECODE", "1").arg(repository.root.join(FOLDER).join("stages.py"));
    python.arg(firmware).arg(rom(repository)?).arg(repository.root.join(RECORD));
    run_program(&mut python)
}

/// The mask ROM. Asked about a crate, cargo fetches its archive and unpacks it.
fn rom(repository: &Repository) -> Result<PathBuf, Failure> {
    let (name, version) = ESPFLASH;
    run_program(repository.cargo().args(["info", "--quiet", &format!("{name}@{version}")]).stdout(Stdio::null()))?;
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home =
        home.or_else(|| std::env::var_os("HOME").map(|home| Path::new(&home).join(".cargo"))).ok_or("no home")?;
    let sources = home.join("registry/src");
    let registries = sources.read_dir().map_err(|e| format!("{}: {e}", sources.display()))?.flatten();
    let mut places =
        registries.map(|registry| registry.path().join(format!("{name}-{version}/resources/roms")).join(ROM));
    places.find(|place| place.exists()).ok_or_else(|| format!("{name} {version} has no {ROM}"))
}
