//! Programs that are Rust packages: built once by cargo, into a folder of cargo's home, so that every working copy has them.

use crate::repository::{Failure, Repository, run};
use std::env;
use std::path::PathBuf;
use std::process::Command;

/// Cargo's own folder, where it keeps what it has downloaded.
pub fn cargo_home() -> Result<PathBuf, Failure> {
    let default = || env::var_os("HOME").map(|home| PathBuf::from(home).join(".cargo"));
    env::var_os("CARGO_HOME").map(PathBuf::from).or_else(default).ok_or("neither CARGO_HOME nor HOME is set".to_owned())
}

/// The program `name` of the package of that name and this version, which is built when it is missing.
pub fn cargo_tool(repository: &Repository, name: &str, version: &str) -> Result<Command, Failure> {
    let place = cargo_home()?.join("stampfly-tools").join(format!("{name}-{version}"));
    let program = place.join("bin").join(name);
    if !program.exists() {
        let mut install = repository.cargo();
        install.args(["install", "--quiet", "--locked", "--version", version, "--root"]).arg(&place).arg(name);
        // They run for seconds, and some take a quarter of an hour to be optimised as a whole.
        install.env("CARGO_PROFILE_RELEASE_LTO", "false").env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1");
        install.env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16");
        run(&mut install)?;
    }
    Ok(repository.command(&program.to_string_lossy()))
}
