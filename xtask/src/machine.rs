//! Programs that steps need besides a Rust toolchain: whether they are there, and what Debian calls them.
//!
//! A tool is there when what is used of it is there, not when something of the same name is. A step asks for its tools with
//! [`provide`]; the step `machine` lists those of `ci` before anything is built.

use crate::repository::{Failure, Repository, run};
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

/// Something Debian packages.
pub struct Tool {
    pub packages: &'static [&'static str],
    is_there: fn() -> bool,
}

pub const VALGRIND: Tool = Tool { packages: &["valgrind"], is_there: || exists("valgrind") };
pub const EMULATED_ARM: Tool = Tool { packages: &["qemu-system-arm"], is_there: || exists("qemu-system-arm") };
pub const EMULATED_OTHERS: Tool = Tool {
    packages: &["qemu-system-misc"],
    is_there: || exists("qemu-system-riscv32") && exists("qemu-system-xtensa"),
};
/// A compiler with the sources of its library: rustup's cannot build that for a target it does not know.
pub const COMPILER: Tool = Tool {
    packages: &["rustc-web", "cargo-web", "rust-web-src"],
    is_there: || exists("/usr/bin/cargo") && library().is_some_and(|core| Path::new(&core).exists()),
};
pub const CLIPPY: Tool =
    Tool { packages: &["rust-web-clippy"], is_there: || Path::new("/usr/bin/clippy-driver").exists() };
pub const LINKER: Tool = Tool { packages: &["lld-22"], is_there: || exists("ld.lld-22") };
/// What makes Xtensa programs of LLVM's bit code.
pub const XTENSA: Tool = Tool {
    packages: &["llvm-22", "binutils-xtensa-lx106"],
    is_there: || exists("/usr/bin/llc-22") && exists("xtensa-lx106-elf-ld"),
};
/// LLVM's programs for profiles: one unites them, one counts lines. Of the compiler's version.
pub const PROFILES: [&str; 2] = ["llvm-profdata-22", "llvm-cov-22"];
pub const COVERAGE: Tool = Tool { packages: &["llvm-22"], is_there: || PROFILES.iter().all(|tool| exists(tool)) };
/// Without a window. A download of its own is nothing that we would have to trust.
pub const BROWSER: Tool = Tool { packages: &["chromium"], is_there: || exists("/usr/bin/chromium") };
pub const SHELLCHECK: Tool = Tool { packages: &["shellcheck"], is_there: || exists("shellcheck") };
/// What links programs for Windows, and what runs them.
pub const MINGW: Tool = Tool { packages: &["gcc-mingw-w64-x86-64"], is_there: || exists("x86_64-w64-mingw32-gcc") };
pub const WINE: Tool = Tool { packages: &["wine64"], is_there: || exists("/usr/lib/wine/wine64") };
/// What the steps of `ci` need. A step of the night asks for its own when it runs.
pub const FOR_CI: [&Tool; 6] = [&COMPILER, &CLIPPY, &LINKER, &XTENSA, &BROWSER, &SHELLCHECK];

/// Is there such a program, and does it run?
pub fn exists(program: &str) -> bool {
    let version = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    version.is_ok_and(|status| status.success())
}

/// Where Debian's compiler says that the sources of its library are.
fn library() -> Option<String> {
    let output = Command::new("/usr/bin/rustc").args(["--print", "sysroot"]).output().ok()?;
    let sysroot = String::from_utf8(output.stdout).ok()?;
    Some(format!("{}/lib/rustlib/src/rust/library/core", sysroot.trim()))
}

/// Packages of the tools that are not there.
pub fn missing(tools: &[&Tool]) -> Vec<&'static str> {
    tools.iter().filter(|tool| !(tool.is_there)()).flat_map(|tool| tool.packages).copied().collect()
}

/// Installs what is not there.
pub fn provide(repository: &Repository, tools: &[&Tool]) -> Result<(), Failure> {
    if missing(tools).is_empty() {
        return Ok(());
    }
    // The steps of both lanes of `ci` install; Debian's installer refuses to run twice at once.
    let place = repository.target("apt.lock");
    let lock = File::create(&place).map_err(|e| format!("{}: {e}", place.display()))?;
    lock.lock().map_err(|e| format!("{}: {e}", place.display()))?;
    let packages = missing(tools);
    if packages.is_empty() {
        return Ok(());
    }
    let by_hand = |e| format!("{e}; as root: {}", installing(&packages));
    run(repository.command("apt-get").args(["update", "-qq"])).map_err(by_hand)?;
    run(repository.command("apt-get").args(["install", "-y", "-qq", "--no-install-recommends"]).args(&packages))
        .map_err(by_hand)?;
    let still = missing(tools);
    if still.is_empty() { Ok(()) } else { Err(format!("{still:?} are installed, but what they are for is not there")) }
}

/// The command for it.
pub fn installing(packages: &[&str]) -> String {
    format!("apt-get install -y --no-install-recommends {}", packages.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const THERE: Tool = Tool { packages: &["a"], is_there: || true };
    const NOT_THERE: Tool = Tool { packages: &["b", "c"], is_there: || false };

    #[test]
    fn only_what_is_missing_is_asked_for() {
        assert_eq!(missing(&[&THERE, &NOT_THERE]), ["b", "c"]);
        assert_eq!(installing(&missing(&[&NOT_THERE])), "apt-get install -y --no-install-recommends b c");
        assert!(!exists("no-program-has-this-name"));
    }
}
