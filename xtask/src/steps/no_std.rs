//! `no-std`: every library but the simulator builds for bare metal, ARM with and RISC-V without an FPU.
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
        let mut build = if debian { debian_cargo(repository) } else { repository.cargo() };
        // Whether it builds is all that is asked here.
        build.env("CARGO_PROFILE_DEV_DEBUG", "false");
        build.args(["build", "--quiet", "--target", target]);
        if debian {
            build.args(["-Zbuild-std=core,alloc", "--target-dir"]).arg(repository.target("debian"));
        }
        for library in repository.libraries()?.iter().filter(|library| library.bare_metal) {
            build.args(["-p", &library.name]);
        }
        run_program(&mut build)?;
    }
    Ok(())
}

/// Debian's cargo with Debian's compiler. Full paths, because rustup's come first in `PATH`.
pub fn debian_cargo(repository: &Repository) -> Command {
    let mut cargo = repository.command("/usr/bin/cargo");
    cargo.env("RUSTC_BOOTSTRAP", "1").env("RUSTC", "/usr/bin/rustc").env_remove("RUSTUP_TOOLCHAIN");
    cargo
}
