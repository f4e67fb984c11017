//! `esp32`: the firmware for the StampFly's ESP32-S3, as far as it can be checked without Espressif's compiler.
//!
//! | check | proves | does not prove |
//! |---|---|---|
//! | S3, types | types, features, pins and borrows of the real firmware | machine code, linking, timing |
//! | S3, a wrong pin | that the check above refuses one | |
//! | C6, image | machine code, linking with the radio, an image that Espressif's tool accepts | the S3's |
//! | C6, memory | that the same statics leave the S3's first core its stack | to the byte: code differs |
//!
//! No stock compiler has inline assembly for Xtensa yet, so the first two present a 32-bit architecture that has it under
//! the S3's target name; nothing it makes is ever run. The third builds the same code for another chip. Debian's compiler
//! comes with the sources of its own core library, which both need, and is installed when it is missing.

use super::no_std::debian_cargo;
use crate::Failure;
use crate::repository::{Repository, capture, exists, install, python_tool, run as run_program};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const PACKAGE: &str = "stampfly-board/esp32s3";
const DEBIAN: [&str; 5] = ["rustc-web", "cargo-web", "rust-web-src", "rust-web-clippy", "lld-22"];
/// A 32-bit architecture with inline assembly and 32-bit atomics, which is all the type check needs.
const STAND_IN: &str = "loongarch32-unknown-none-softfloat";
/// The name cargo and esp-hal know the S3 by.
const S3: &str = "xtensa-esp32s3-none-elf.json";
const C6: &str = "riscv32imac-unknown-none-elf";
/// No S3 has this pin; `src/pins.rs` asks for it when told to.
const WRONG_PIN: &str = "GPIO22";

pub fn run(repository: &Repository, _: &[String]) -> Result<(), Failure> {
    let format = repository.root.join(PACKAGE).join("Cargo.toml");
    run_program(repository.cargo().args(["fmt", "--check", "--manifest-path"]).arg(format))?;
    if !Path::new("/usr/bin/cargo-clippy").exists() || !exists("ld.lld-22") {
        install(repository, &DEBIAN)?;
    }
    let target = stand_in(repository)?;
    // What `cargo clippy` is; spelled so, rustup's would be taken.
    let mut clippy = s3(repository, "check", &target);
    clippy.args(["--bins", "--examples"]);
    clippy.env("RUSTC_WORKSPACE_WRAPPER", "/usr/bin/clippy-driver").env("CLIPPY_ARGS", "-Dwarnings__CLIPPY_HACKERY__");
    run_program(&mut clippy)?;
    refuses_a_wrong_pin(s3(repository, "rustc", &target))?;
    let program = c6(repository)?;
    memory(&program)?;
    image(repository, &program)
}

/// The description of a target that says it is an S3.
fn stand_in(repository: &Repository) -> Result<PathBuf, Failure> {
    let mut rustc = repository.command("/usr/bin/rustc");
    rustc.env("RUSTC_BOOTSTRAP", "1").args(["-Zunstable-options", "--print", "target-spec-json", "--target", STAND_IN]);
    let (json, _) = capture(&mut rustc)?;
    let known = |line: &&str| !["\"is-builtin\"", "\"vendor\""].iter().any(|key| line.trim_start().starts_with(key));
    let body: Vec<&str> = json.lines().filter(known).collect();
    let json = body.join("\n").replacen('{', "{\n  \"vendor\": \"espressif\",", 1);
    let folder = repository.target("esp32");
    let path = folder.join(S3);
    fs::create_dir_all(&folder)
        .and_then(|()| fs::write(&path, json))
        .map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(path)
}

fn firmware(repository: &Repository, subcommand: &str) -> Command {
    let mut cargo = debian_cargo(repository);
    cargo.current_dir(repository.root.join(PACKAGE));
    cargo.args([subcommand, "--quiet", "--locked", "--target-dir"]).arg(repository.target("esp32"));
    cargo
}

fn s3(repository: &Repository, subcommand: &str, target: &Path) -> Command {
    let mut cargo = firmware(repository, subcommand);
    cargo.env("RUSTFLAGS", "-A explicit_builtin_cfgs_in_flags --cfg target_arch=\"xtensa\"");
    cargo.args(["-Zjson-target-spec", "--target"]).arg(target);
    cargo
}

/// A check that accepts everything would look just like one that found nothing.
fn refuses_a_wrong_pin(mut cargo: Command) -> Result<(), Failure> {
    cargo.args(["--profile", "check", "--", "--cfg", "wrong_pin"]);
    match capture(&mut cargo) {
        Ok(_) => Err(format!("the check of the S3 firmware accepts {WRONG_PIN}, which the chip does not have")),
        Err(said) => is_about_the_pin(&said),
    }
}

/// Refused, but for the right reason and for no other?
fn is_about_the_pin(said: &str) -> Result<(), Failure> {
    let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error[")).collect();
    match errors[..] {
        [only] if only.contains(WRONG_PIN) => {
            eprintln!("refused, as it should be: {only}");
            Ok(())
        }
        _ => Err(format!("a wrong pin should give one error, about {WRONG_PIN}:\n{said}")),
    }
}

/// Builds for the ESP32-C6 and returns the program.
pub fn c6(repository: &Repository) -> Result<PathBuf, Failure> {
    let mut cargo = firmware(repository, "build");
    cargo.env("CARGO_TARGET_RISCV32IMAC_UNKNOWN_NONE_ELF_LINKER", "ld.lld-22");
    cargo.env("RUSTFLAGS", "-Clinker-flavor=ld.lld -Cforce-frame-pointers");
    // One example is enough to see that they link.
    cargo.args(["--bins", "--example", "bmi270"]);
    cargo.args(["--release", "--no-default-features", "--features", "esp32c6,bmi270-config", "--target", C6]);
    run_program(&mut cargo)?;
    Ok(repository.target("esp32").join(C6).join("release/stampfly-esp32s3"))
}

/// The S3's data memory, which code in RAM shares (esp-hal's `ld/esp32s3/memory.x`: from 0x3FC88000 to 0x3FCDB700).
const S3_MEMORY: u32 = 0x3FCD_B700 - 0x3FC8_8000;
/// The second core's stack, which only the S3 has (`src/main.rs`).
const S3_SECOND_STACK: u32 = 16 * 1024;
/// What the first core needs at least: the vehicle is assembled on its stack, and a golden flight is flown there.
const S3_FIRST_STACK: u32 = 64 * 1024;
/// The C6's memory, as its program's sections see it.
const C6_MEMORY: std::ops::Range<u32> = 0x4080_0000..0x4088_0000;

/// Would what the C6 keeps in memory fit into the S3?
fn memory(program: &Path) -> Result<(), Failure> {
    let bytes = fs::read(program).map_err(|e| format!("{}: {e}", program.display()))?;
    let sections = sections(&bytes).ok_or("the program is no 32-bit ELF")?;
    // What is left over is the stack's, and the boot loader's memory is another region on the S3, too.
    let kept = sections.iter().filter(|section| !matches!(section.name, ".stack" | ".dram2_uninit"));
    let kept: u32 = kept.filter(|section| C6_MEMORY.contains(&section.address)).map(|section| section.size).sum();
    let left = S3_MEMORY.saturating_sub(kept + S3_SECOND_STACK);
    println!("esp32c6: {kept} bytes of memory in use; on the S3 that would leave {left} bytes of stack");
    if left < S3_FIRST_STACK {
        Err(format!("the S3 would have less than {S3_FIRST_STACK} bytes of stack"))
    } else {
        Ok(())
    }
}

#[derive(Debug, PartialEq)]
struct Section<'e> {
    name: &'e str,
    address: u32,
    size: u32,
}

/// The sections of a 32-bit little-endian ELF file.
fn sections(elf: &[u8]) -> Option<Vec<Section<'_>>> {
    let half = |at: usize| Some(usize::from(u16::from_le_bytes(elf.get(at..at + 2)?.try_into().ok()?)));
    let word = |at: usize| Some(u32::from_le_bytes(elf.get(at..at + 4)?.try_into().ok()?));
    if !elf.starts_with(b"\x7fELF\x01\x01") {
        return None;
    }
    let (table, entry, count, names) = (word(0x20)? as usize, half(0x2E)?, half(0x30)?, half(0x32)?);
    let names = word(table + names * entry + 0x10)? as usize;
    (0..count)
        .map(|index| {
            let header = table + index * entry;
            let name = elf.get(names + word(header)? as usize..)?.split(|byte| *byte == 0).next()?;
            let name = std::str::from_utf8(name).ok()?;
            Some(Section { name, address: word(header + 0x0C)?, size: word(header + 0x14)? })
        })
        .collect()
}

/// Makes a flash image with Espressif's own tool and says how large it is.
fn image(repository: &Repository, program: &Path) -> Result<(), Failure> {
    let image = program.with_extension("bin");
    let mut esptool = python_tool(repository, "esptool", "esptool")?;
    esptool.args(["--chip", "esp32c6", "elf2image", "--flash-mode", "dio", "--flash-size", "4MB", "-o"]);
    capture(esptool.arg(&image).arg(program))?;
    let mut esptool = python_tool(repository, "esptool", "esptool")?;
    let (said, _) = capture(esptool.args(["--chip", "esp32c6", "image-info"]).arg(&image))?;
    let bytes = fs::metadata(&image).map_err(|e| format!("{}: {e}", image.display()))?.len();
    let valid = said.lines().any(|line| line.starts_with("Validation hash") && line.contains("(valid)"));
    if !valid {
        return Err(format!("esptool does not find its own image valid:\n{said}"));
    }
    println!("esp32c6 image: {bytes} bytes, valid");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Section, is_about_the_pin, sections};

    #[test]
    fn reads_the_sections_of_an_elf() {
        // A header of 52 bytes, two section headers of 40, and the names.
        let mut elf = vec![0u8; 52 + 80];
        elf[..6].copy_from_slice(b"\x7fELF\x01\x01");
        let mut put = |at: usize, value: u32| elf[at..at + 4].copy_from_slice(&value.to_le_bytes());
        put(0x20, 52);
        put(0x2E, 40 | 2 << 16);
        put(0x32, 1);
        put(52, 1);
        put(52 + 0x0C, 0x4080_0000);
        put(52 + 0x14, 1234);
        put(92 + 0x10, 132);
        elf.extend(b"\0.bss\0");
        let [bss, _] = &sections(&elf).expect("an ELF")[..] else { panic!("two sections") };
        assert_eq!(bss, &Section { name: ".bss", address: 0x4080_0000, size: 1234 });
        assert!(sections(b"#!/bin/sh").is_none());
        assert!(sections(&elf[..60]).is_none(), "cut off");
    }

    #[test]
    fn only_the_right_refusal_counts() {
        let right = "error[E0609]: no field `GPIO22` on type `Peripherals`\n --> src/pins.rs:1:2\n";
        assert!(is_about_the_pin(right).is_ok());
        assert!(is_about_the_pin("error[E0609]: no field `GPIO23` on type `Peripherals`").is_err());
        assert!(is_about_the_pin(&format!("{right}error[E0308]: mismatched types")).is_err());
        assert!(is_about_the_pin("error: could not find `Cargo.toml`").is_err());
    }
}
