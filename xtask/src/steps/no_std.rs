//! `no-std`: every library but the simulator compiles for bare metal, for ARM with an FPU and RISC-V
//! without one.
//!
//! The step checks and builds nothing: `panic-proof` and `esp32` link these libraries for these cores.
//!
//! The targets come from rustup. Where rustup cannot deliver them, Debian's compiler builds the core library from its
//! own sources instead; it is installed when it is missing.

use crate::arguments::Arguments;
use crate::machine::{COMPILER, provide};
use crate::repository::{Failure, Repository, add_targets, run as run_program};
use std::process::Command;

const TARGETS: [&str; 2] = ["thumbv7em-none-eabihf", "riscv32imac-unknown-none-elf"];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let debian = arguments.debian
        || add_targets(repository, &TARGETS).map_err(|e| eprintln!("{e}\nusing Debian's compiler instead")).is_err();
    if debian {
        provide(repository, &[&COMPILER])?;
    }
    for target in TARGETS {
        let mut check = if debian { debian_cargo(repository) } else { repository.cargo() };
        check.args(["check", "--quiet", "--target", target]);
        if debian {
            check.args(["-Zbuild-std=core,alloc", "--target-dir"]).arg(repository.target("debian"));
        }
        for library in repository.libraries()?.iter().filter(|library| library.bare_metal) {
            check.args(["-p", &library.name]);
        }
        run_program(&mut check)?;
    }
    Ok(())
}

/// Debian's cargo with Debian's compiler. Full paths, because rustup's come first in `PATH`.
pub fn debian_cargo(repository: &Repository) -> Command {
    let mut cargo = repository.command("/usr/bin/cargo");
    cargo.env("RUSTC_BOOTSTRAP", "1").env("RUSTC", "/usr/bin/rustc").env_remove("RUSTUP_TOOLCHAIN");
    cargo
}
