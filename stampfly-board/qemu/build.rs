//! Hands each machine's memory layout to the linker.

use std::path::Path;
use std::process::Command;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=linker");
    println!("cargo:rerun-if-changed=xtensa");
    let variable = |name| env::var(name).map_err(io::Error::other);
    let out = variable("OUT_DIR")?;
    // The runtime crates' own scripts look for this name.
    let memory = Path::new(&out).join("memory.x");
    let arguments = match variable("CARGO_CFG_TARGET_ARCH")?.as_str() {
        "arm" => {
            fs::copy("linker/mps2-an386.x", memory)?;
            vec!["-Tlink.x".to_owned()]
        }
        "riscv32" => {
            fs::copy("linker/virt.x", memory)?;
            vec!["-Tmemory.x".to_owned(), "-Tlink.x".to_owned()]
        }
        "xtensa" => {
            let object = format!("{out}/start.o");
            let options = ["-triple=xtensa", "-mcpu=esp32", "-mattr=+windowed", "-filetype=obj"];
            let assembled =
                Command::new("llvm-mc-22").args(options).args(["xtensa/start.S", "-o", &object]).status()?;
            if !assembled.success() {
                return Err(io::Error::other("the start-up code does not assemble"));
            }
            let script = Path::new(&variable("CARGO_MANIFEST_DIR")?).join("linker/sim.ld");
            vec![object, format!("-T{}", script.display()), "--no-relax".to_owned()]
        }
        _ => Vec::new(),
    };
    println!("cargo:rustc-link-search={out}");
    for argument in arguments {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    Ok(())
}
