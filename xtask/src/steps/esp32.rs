//! `esp32` and `esp32-images`: checks of the firmware for the StampFly's ESP32-S3 that need no
//! compiler of Espressif's.
//!
//! | step | check | shows | does not show |
//! |---|---|---|---|
//! | `esp32` | S3, runner | espflash sets the fastest reading of the flash | that the chip does it |
//! | | S3, types: Wi-Fi, HIL | types, pins, borrows | machine code, linking, timing |
//! | | C6, linked, little optimised | machine code, linking with the radio | the S3's code; size |
//! | `esp32-images` | S3, types: flight record | types without Wi-Fi | as above |
//! | | S3, a wrong pin | the check of types refuses one | |
//! | | S3, linker scripts | its second heap has room | the rest of the program |
//! | | C6, images to flash | Espressif's tool accepts them | the S3's code |
//! | | S3, memory | its first core has a stack left | the exact size: code differs |
//!
//! No stock compiler has inline assembly for Xtensa. The checks of types therefore use a 32-bit
//! architecture that has it, under the name of the S3's target; its output is never run. The C6 runs
//! the same code on another chip. Both need the sources of the core library, which come with Debian's
//! compiler; the steps install it. [`esp32_link`](super::esp32_link) has the linker scripts,
//! [`s3_memory`](super::s3_memory) the memory.

use super::esp32_link::S3Scripts;
use super::no_std::debian_cargo;
use super::{esp32_link, s3_memory};
use crate::arguments::Arguments;
use crate::machine::{CLIPPY, COMPILER, LINKER, provide};
use crate::repository::{Failure, Repository, capture, python_tool, run as run_program};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const PACKAGE: &str = "stampfly-board/esp32s3";
/// A 32-bit architecture with inline assembly and 32-bit atomics, which is all the type check needs.
const STAND_IN: &str = "loongarch32-unknown-none-softfloat";
/// The name cargo and esp-hal know the S3 by.
const S3: &str = "xtensa-esp32s3-none-elf.json";
const C6: &str = "riscv32imac-unknown-none-elf";
/// Espressif's tool; its output is parsed here.
const ESPTOOL: &str = "esptool==5.6.0";
/// Profile of a push, which asks for neither speed nor size. Both chips have it, so that macros and
/// build scripts are built once.
const QUICK: [(&str, &str); 3] = [
    ("CARGO_PROFILE_RELEASE_LTO", "off"),
    ("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16"),
    ("CARGO_PROFILE_RELEASE_DEBUG", "false"),
];
/// No S3 has this pin; `src/pins.rs` asks for it when told to.
const WRONG_PIN: &str = "GPIO22";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let format = repository.root.join(PACKAGE).join("Cargo.toml");
    run_program(repository.cargo().args(["fmt", "--check", "--manifest-path"]).arg(format))?;
    provide(repository, &[&COMPILER, &CLIPPY, &LINKER])?;
    let config = repository.root.join(PACKAGE).join(".cargo/config.toml");
    flashes_fast(&fs::read_to_string(&config).map_err(|e| format!("{}: {e}", config.display()))?)?;
    run_program(types(repository, &stand_in(repository)?, "hil,wifi").envs(QUICK))?;
    // Without any optimisation the code exceeds the C6's RAM.
    run_program(for_c6(repository, Variant::Wifi).envs(QUICK).env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1"))
}

/// `esp32-images`: the firmware with the flashed profile, with Wi-Fi and without.
pub fn images(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&COMPILER, &CLIPPY, &LINKER])?;
    let target = stand_in(repository)?;
    run_program(&mut types(repository, &target, "hil,record"))?;
    refuses_a_wrong_pin(s3(repository, &target, "--cfg__CLIPPY_HACKERY__wrong_pin"))?;
    let scripts = s3_scripts(repository)?;
    esp32_link::heap(repository, &scripts)?;
    linked(repository, Variant::Default, &scripts)?;
    linked(repository, Variant::Wifi, &scripts)
}

/// A check of the S3's types with these features.
fn types(repository: &Repository, target: &Path, features: &str) -> Command {
    let mut cargo = s3(repository, target, "-Dwarnings");
    cargo.args(["--bins", "--examples", "--features", features]);
    cargo
}

fn linked(repository: &Repository, variant: Variant, scripts: &S3Scripts) -> Result<(), Failure> {
    println!("{}:", variant.name());
    let program = c6(repository, variant)?;
    s3_memory::stack(repository, &program, scripts)?;
    image(repository, &program)
}

/// What `cargo run` hands to espflash, whose own defaults are two wires at 40 MHz: a pass of the flight band would then take longer than
/// its period (`cargo xtask cache`, with four times the time for a line).
fn flashes_fast(config: &str) -> Result<(), Failure> {
    let config: toml_edit::DocumentMut = config.parse().map_err(|e| format!("settings of cargo: {e}"))?;
    let runner = config.get("target").and_then(|all| all.get("xtensa-esp32s3-none-elf")?.get("runner")?.as_str());
    let runner = runner.ok_or("no runner for the S3")?;
    let words: Vec<&str> = runner.split(' ').collect();
    let lacking = |setting: &&[&str; 2]| !words.windows(2).any(|pair| pair == *setting);
    match [["--flash-mode", "qio"], ["--flash-freq", "80mhz"]].iter().find(lacking) {
        Some([option, value]) => Err(format!("the runner has no `{option} {value}`: {runner}")),
        None => Ok(()),
    }
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
    // What is measured is what is flashed: without its debug information other functions are inlined, 4 % of a crate.
    cargo.env_remove("CARGO_PROFILE_RELEASE_DEBUG");
    cargo.args([subcommand, "--quiet", "--locked", "--target-dir"]).arg(repository.target("esp32"));
    cargo
}

/// Clippy for the S3, with these arguments for the firmware alone.
fn s3(repository: &Repository, target: &Path, arguments: &str) -> Command {
    let mut cargo = firmware(repository, "check");
    cargo.current_dir(repository.root.join(PACKAGE));
    cargo.env("RUSTFLAGS", "-A explicit_builtin_cfgs_in_flags --cfg target_arch=\"xtensa\"");
    // What `cargo clippy` is; spelled so, rustup's would be taken. Its arguments are separated by this word.
    cargo.env("RUSTC_WORKSPACE_WRAPPER", "/usr/bin/clippy-driver");
    cargo.env("CLIPPY_ARGS", format!("{arguments}__CLIPPY_HACKERY__"));
    // Macros and build scripts are then the same as for the C6. What is only checked is not optimised.
    cargo.env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "0");
    cargo.args(["--release", "-Zjson-target-spec", "--target"]).arg(target);
    cargo
}

/// What build scripts have made for the S3's linker.
pub fn s3_scripts(repository: &Repository) -> Result<S3Scripts, Failure> {
    provide(repository, &[&COMPILER, &CLIPPY])?;
    let target = stand_in(repository)?;
    let (messages, _) = capture(s3(repository, &target, "-Dwarnings").args(["--bins", "--message-format", "json"]))?;
    S3Scripts::read(&messages)
}

/// A check that accepts everything would look just like one that found nothing.
fn refuses_a_wrong_pin(mut cargo: Command) -> Result<(), Failure> {
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

/// The firmware, as it is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// What is flashed without further words.
    Default,
    /// With UDP and TCP in a Wi-Fi network.
    Wifi,
}

impl Variant {
    /// For people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Default => "default features",
            Self::Wifi => "with the feature wifi",
        }
    }

    const fn features(self) -> &'static str {
        match self {
            Self::Default => "esp32c6,bmi270-config",
            Self::Wifi => "esp32c6,bmi270-config,wifi",
        }
    }
}

/// Builds for the ESP32-C6 and returns the program.
pub fn c6(repository: &Repository, variant: Variant) -> Result<PathBuf, Failure> {
    provide(repository, &[&COMPILER, &LINKER])?;
    run_program(&mut for_c6(repository, variant))?;
    let built = repository.target("esp32").join(C6).join("release/stampfly-esp32s3");
    if variant == Variant::Default {
        return Ok(built);
    }
    // The next build of another variant takes its place.
    let kept = built.with_file_name("stampfly-esp32s3-wifi");
    fs::copy(&built, &kept).map_err(|e| format!("{}: {e}", kept.display()))?;
    Ok(kept)
}

/// A cargo that builds for the ESP32-C6.
fn for_c6(repository: &Repository, variant: Variant) -> Command {
    let mut cargo = firmware(repository, "build");
    // Not in the package's folder: its settings of cargo are the S3's, and the C6's layer of hardware refuses that of the data cache.
    cargo.current_dir(&repository.root).arg("--manifest-path").arg(repository.root.join(PACKAGE).join("Cargo.toml"));
    cargo.args(["-Zbuild-std=core,alloc"]).env("ESP_HAL_CONFIG_USE_RWTEXT_LD_HOOK", "true");
    cargo.env("CARGO_TARGET_RISCV32IMAC_UNKNOWN_NONE_ELF_LINKER", "ld.lld-22");
    cargo.env("RUSTFLAGS", "-Clinker-flavor=ld.lld -Cforce-frame-pointers -Csymbol-mangling-version=v0");
    // One example is enough to see that they link.
    cargo.args(["--bins", "--example", "bmi270"]);
    cargo.args(["--release", "--no-default-features", "--features", variant.features(), "--target", C6]);
    cargo
}

/// Makes a flash image with Espressif's own tool and says how large it is.
fn image(repository: &Repository, program: &Path) -> Result<(), Failure> {
    let image = program.with_extension("bin");
    let mut esptool = python_tool(repository, ESPTOOL, "esptool")?;
    esptool.args(["--chip", "esp32c6", "elf2image", "--flash-mode", "dio", "--flash-size", "4MB", "-o"]);
    capture(esptool.arg(&image).arg(program))?;
    let mut esptool = python_tool(repository, ESPTOOL, "esptool")?;
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
    use super::{flashes_fast, is_about_the_pin};

    #[test]
    fn slow_flash_is_refused() {
        let runner =
            |options: &str| format!("[target.xtensa-esp32s3-none-elf]\nrunner = \"espflash flash{options}\"\n");
        assert!(flashes_fast(&runner(" --flash-mode qio --flash-freq 80mhz")).is_ok());
        for options in
            ["", " --flash-mode qio", " --flash-mode dio --flash-freq 80mhz", " --flash-mode qio --flash-freq 40mhz"]
        {
            assert!(flashes_fast(&runner(options)).is_err(), "{options}");
        }
        assert!(flashes_fast("").is_err());
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
