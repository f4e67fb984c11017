//! `stm32`: the STM32 quadcopter's firmware links, fits into an STM32F303CC, and boots; a pass of its flight band takes at most so many instructions.
//!
//! | file | what it looks at |
//! |---|---|
//! | `toolchain.rs` | warnings of the compiler and of Clippy |
//! | `mod.rs` | flash and memory of the linked program |
//! | `pass.rs` | instructions of a pass, on an emulated Cortex-M4F |
//! | `boot.rs` | the linked program, from reset to what it does then |
//!
//! Targets come from rustup, or else the core library is built by Debian's compiler, which has no Clippy for it.

mod boot;
mod pass;
mod toolchain;

use crate::arguments::Arguments;
use crate::machine::{COMPILER, LINKER, provide};
use crate::repository::{Failure, Repository, add_targets};
use object::{Object, ObjectSection, SectionFlags};
use std::fs;
use std::path::Path;
use toolchain::TARGET;

const PACKAGE: &str = "vehicles/stm32-quad/stm32f303";
/// What the chip has for a program (RM0316, table 3, less two pages that keep what is stored): begin, bytes.
const FLASH: (u64, u64) = (0x0800_0000, 252 * 1024);
const MEMORY: (u64, u64) = (0x2000_0000, 40 * 1024);
/// What has to be left for two stacks: the thread's, and that of the interrupt which flies. Both are the same memory.
const STACK: u64 = 12 * 1024;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let debian = arguments.debian
        || add_targets(repository, &[TARGET]).map_err(|e| eprintln!("{e}\nusing Debian's compiler instead")).is_err();
    if debian {
        provide(repository, &[&COMPILER, &LINKER])?;
    }
    let place = repository.target("stm32f303");
    toolchain::build(repository, PACKAGE, &place, debian)?;
    let program = place.join(TARGET).join("release/stampfly-stm32f303");
    let [flash, memory] = sizes(&program)?;
    println!("flash   {flash:>7} of {} bytes", FLASH.1);
    println!("memory  {memory:>7} of {} bytes; {STACK} have to be left for the stacks", MEMORY.1);
    if flash == 0 || flash > FLASH.1 || memory + STACK > MEMORY.1 {
        return Err("it does not fit".into());
    }
    let failures: Vec<Failure> = [pass::count(repository, debian), boot::boot(repository, &program)]
        .into_iter()
        .filter_map(Result::err)
        .collect();
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// Bytes of flash and of memory that a program takes.
fn sizes(path: &Path) -> Result<[u64; 2], Failure> {
    let fail = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let bytes = fs::read(path).map_err(|error| fail(&error))?;
    let file = object::File::parse(&*bytes).map_err(|error| fail(&error))?;
    let [mut flash, mut memory] = [0; 2];
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
        if sh_flags & u64::from(object::elf::SHF_ALLOC) == 0 {
            continue;
        }
        let is_in = |(begin, length): (u64, u64)| (begin..begin + length).contains(&section.address());
        // What begins as something is in both.
        let begins = section.name().is_ok_and(|name| name == ".data");
        flash += if is_in(FLASH) || begins { section.size() } else { 0 };
        memory += if is_in(MEMORY) { section.size() } else { 0 };
    }
    Ok([flash, memory])
}
