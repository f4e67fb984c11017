//! Does the S3 have the memory that the firmware takes beside its data cache? Asked of the linker scripts that esp-hal has made for
//! it, and of a linker for Xtensa.
//!
//! The check of types builds esp-hal's scripts with the firmware's configuration, but links nothing: a region of
//! no length goes unnoticed there. GNU's linker takes the scripts as Espressif's does. What it links here is a section as large as the
//! heap, and, to see that it can refuse, one as large as the whole cache.

use super::esp32::sizes::SECOND_HEAP;
use crate::machine::{XTENSA, provide};
use crate::repository::{Failure, Repository, capture, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Memory that cache and heap share, bytes (esp-hal's `ld/esp32s3/memory.x`: from 0x3FCF0000 to 0x3FD00000).
const SHARED_WITH_CACHE: usize = 0x1_0000;

/// `check` is the command that checks the firmware's types for the S3.
pub fn run(repository: &Repository, mut check: Command) -> Result<(), Failure> {
    provide(repository, &[&XTENSA])?;
    let (messages, _) = capture(check.args(["--bins", "--message-format", "json"]))?;
    let scripts = scripts(&messages)?;
    link(repository, &scripts, SECOND_HEAP)
        .map_err(|said| format!("the S3 has not {SECOND_HEAP} bytes beside its data cache:\n{said}"))?;
    match link(repository, &scripts, SHARED_WITH_CACHE) {
        Err(said) if said.contains("will not fit in region") => {}
        Err(said) => return Err(format!("the linker should have found the region too small:\n{said}")),
        Ok(()) => return Err(format!("the linker gives all of the cache's {SHARED_WITH_CACHE} bytes away")),
    }
    println!("esp32s3: a heap of {SECOND_HEAP} bytes links beside the data cache, the whole of its memory does not");
    Ok(())
}

/// Where esp-hal's build script has put its linker scripts, from cargo's messages.
fn scripts(messages: &str) -> Result<PathBuf, Failure> {
    for line in messages.lines() {
        let message = json(line)?;
        let from_hal = message["package_id"].as_str().is_some_and(|id| id.contains("#esp-hal@"));
        if message["reason"] == "build-script-executed" && from_hal {
            return message["out_dir"].as_str().map(PathBuf::from).ok_or("a build script without a folder".to_owned());
        }
    }
    Err("esp-hal has made no linker scripts".to_owned())
}

/// Links a section of this size where the firmware's heap goes.
fn link(repository: &Repository, scripts: &Path, size: usize) -> Result<(), Failure> {
    let [source, object, program] =
        ["s", "o", "elf"].map(|kind| repository.target("esp32").join(format!("heap-{size}.{kind}")));
    let section = format!(".section .dcache_reclaimed_uninit,\"aw\",@nobits\nheap: .space {size}\n");
    fs::write(&source, section).map_err(|e| format!("{}: {e}", source.display()))?;
    capture(repository.command("xtensa-lx106-elf-as").arg(&source).arg("-o").arg(&object))?;
    let mut linker = repository.command("xtensa-lx106-elf-ld");
    linker.arg("-L").arg(scripts).args(["-T", "memory.x", "-T", "dcache_reclaimed.x", "-e", "0", "-o"]).arg(&program);
    capture(linker.arg(&object)).map(drop)
}

#[cfg(test)]
mod tests {
    use super::scripts;

    #[test]
    fn only_the_chips_layer_has_the_scripts() {
        let other =
            r#"{"reason":"build-script-executed","package_id":"registry+x#esp-hal-procmacros@0.2","out_dir":"/a"}"#;
        let hal = r#"{"reason":"build-script-executed","package_id":"registry+x#esp-hal@1.2.2","out_dir":"/b"}"#;
        assert_eq!(scripts(&format!("{other}\n{hal}\n")).unwrap().to_str(), Some("/b"));
        assert!(scripts(other).is_err());
    }
}
