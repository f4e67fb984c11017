//! `hals`: the drivers' examples build and link with the hardware abstraction layers that people have.
//!
//! Every chip's crate has a program for Linux, an RP2350, an STM32 and an ESP32 in its folder `examples`; the packages in
//! `stampfly-drivers/boards` say what each board's need. A bound of ours that a layer's bus, delay or error does not meet
//! fails here. A warning fails, too. Targets come from rustup, or else the core library is built by Debian's compiler.

use super::no_std::debian_cargo;
use crate::arguments::Arguments;
use crate::machine::{COMPILER, LINKER, provide};
use crate::repository::{Failure, Repository, add_targets, capture, run as run_program};
use std::fs;
use std::path::Path;
use std::process::Command;

const BOARDS: &str = "stampfly-drivers/boards";
/// Folder, and target; none is this machine.
const ALL: [(&str, Option<&str>); 4] = [
    ("linux", None),
    ("rp2350", Some("thumbv8m.main-none-eabihf")),
    ("stm32", Some("thumbv7em-none-eabihf")),
    ("esp32", Some("riscv32imac-unknown-none-elf")),
];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let targets: Vec<&str> = ALL.iter().filter_map(|(_, target)| *target).collect();
    let debian = arguments.debian
        || add_targets(repository, &targets).map_err(|e| eprintln!("{e}\nusing Debian's compiler instead")).is_err();
    if debian {
        provide(repository, &[&COMPILER, &LINKER])?;
    }
    for (board, target) in ALL {
        let folder = repository.root.join(BOARDS).join(board);
        lists_every_chip(repository, &folder, board)?;
        run_program(repository.cargo().current_dir(&folder).args(["fmt", "--check"]))?;
        let mut cargo = match target {
            Some(target) if debian => of_debian(repository, target),
            _ => repository.cargo(),
        };
        cargo.current_dir(&folder).args(["build", "--locked", "--examples", "--target-dir"]);
        cargo.arg(repository.target("hals").join(board));
        // Flags meant for the host would take the place of the board's own.
        cargo.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
        let (_, said) = capture(&mut cargo)?;
        if said.lines().any(|line| line.starts_with("warning")) {
            return Err(format!("{board}: a warning\n{said}"));
        }
    }
    Ok(())
}

/// A chip whose program is not in a board's list is not built, and nobody would notice.
fn lists_every_chip(repository: &Repository, folder: &Path, board: &str) -> Result<(), Failure> {
    let manifest = folder.join("Cargo.toml");
    let listed = fs::read_to_string(&manifest).map_err(|e| format!("{}: {e}", manifest.display()))?;
    let drivers = repository.root.join(BOARDS).with_file_name("");
    let entries = fs::read_dir(&drivers).map_err(|e| format!("{}: {e}", drivers.display()))?;
    let chips = entries.flatten().filter(|entry| entry.path().join("src/codec.rs").exists());
    let mut programs = 0;
    for chip in chips.filter_map(|entry| entry.file_name().into_string().ok()) {
        let program = format!("path = \"../../{chip}/examples/{board}.rs\"");
        if !listed.contains(&program) {
            return Err(format!("{}: no {program}", manifest.display()));
        }
        programs += 1;
    }
    if programs == 0 { Err(format!("{}: no chip", drivers.display())) } else { Ok(()) }
}

/// Debian's compiler, which builds its own core library.
pub(super) fn of_debian(repository: &Repository, target: &str) -> Command {
    let mut cargo = debian_cargo(repository);
    cargo.args(["-Zbuild-std=core,alloc", "--config", &format!("target.{target}.linker=\"ld.lld-22\"")]);
    cargo.args(["--config", &format!("target.{target}.rustflags=[\"-Clinker-flavor=ld.lld\"]")]);
    cargo
}
