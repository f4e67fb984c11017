//! `windows`: the program for Windows flies what the one for Linux flies, byte for byte, and repeats it.
//!
//! Debian's MinGW links it, Debian's Wine runs it: both are the work of others. The Windows of the
//! workflow `ci.yml` is the real one; this step also runs where there is none.

use super::program::released;
use crate::arguments::Arguments;
use crate::machine::{MINGW, WINE, provide};
use crate::repository::{Failure, Repository, add_targets, capture, run as run_program};
use std::fs;
use std::path::Path;
use std::process::Command;

const TARGET: &str = "x86_64-pc-windows-gnu";
const FLIGHT: [&str; 4] = ["fly", "--seed", "1", "--out"];
/// Rust's standard library takes random numbers from here, and Debian's Wine is older than it.
const RANDOM: &str = "\
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T size) { return SystemFunction036(data, size); }
";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&MINGW, &WINE])?;
    add_targets(repository, &[TARGET])?;
    let build = ["build", "--quiet", "--release", "--bin", "stampfly", "--target", TARGET];
    run_program(repository.cargo().args(build))?;
    let program = repository.target(TARGET).join("release/stampfly.exe");
    let folder = repository.target("windows");
    let [linux, windows] = ["linux", "windows"].map(|name| folder.join(name));
    // A flight of an earlier run must not be taken for one of this.
    let _ = fs::remove_dir_all(&linux);
    let _ = fs::remove_dir_all(&windows);
    random(repository, &folder, program.parent().unwrap_or(&folder))?;
    let wine = |arguments: &[&str]| {
        let mut wine = Command::new("/usr/lib/wine/wine64");
        wine.current_dir(&folder).arg(&program).args(arguments);
        wine.env("WINEPREFIX", folder.join("wine")).env("WINEDEBUG", "-all");
        capture(&mut wine)
    };
    capture(repository.command(&released(repository)?.to_string_lossy()).args(FLIGHT).arg(&linux))?;
    wine(&[&FLIGHT[..], &["windows"]].concat())?;
    for name in ["flight.ulg", "flight.html"] {
        let read = |folder: &Path| fs::read(folder.join(name)).map_err(|e| format!("{name}: {e}"));
        if read(&linux)? != read(&windows)? {
            return Err(format!("{name} of Windows is not {name} of Linux"));
        }
    }
    let (replayed, _) = wine(&["replay", "windows/flight.ulg"])?;
    let (golden, _) = wine(&["golden"])?;
    print!("{replayed}{golden}");
    Ok(())
}

/// Puts the missing library beside the program.
fn random(repository: &Repository, folder: &Path, beside: &Path) -> Result<(), Failure> {
    let source = folder.join("random.c");
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(&source, RANDOM))
        .map_err(|e| format!("{}: {e}", source.display()))?;
    let mut compile = repository.command("x86_64-w64-mingw32-gcc");
    compile.args(["-shared", "-o"]).arg(beside.join("bcryptprimitives.dll")).arg(&source).arg("-ladvapi32");
    run_program(&mut compile)
}
