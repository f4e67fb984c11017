//! Hands esp-hal's linker script to the linker, and what it asks for: which code is kept in RAM.

use std::path::Path;
use std::{env, fs, io};

/// What esp-hal's script includes into the section of code in RAM when `ESP_HAL_CONFIG_USE_RWTEXT_LD_HOOK` is set.
const HOOK: &str = "rwtext_hook.x";

fn main() -> io::Result<()> {
    println!("cargo:rustc-link-arg-bins=-Tlinkall.x");
    println!("cargo:rustc-link-arg-examples=-Tlinkall.x");
    println!("cargo:rerun-if-changed=in_ram.txt");
    let out = env::var("OUT_DIR").map_err(io::Error::other)?;
    let list = fs::read_to_string("in_ram.txt")?;
    let patterns = list.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    // A function's literals lie directly before it, where an Xtensa core can reach them.
    let script: String = patterns.map(|pattern| format!("*(.literal.{pattern} .text.{pattern})\n")).collect();
    fs::write(Path::new(&out).join(HOOK), script)?;
    println!("cargo:rustc-link-search={out}");
    Ok(())
}
