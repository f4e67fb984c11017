//! The core that flies, with its drivers and its executor, for `cargo xtask cache`: how its program is built, and what it is given.

use super::qemu::{Machine, PACKAGE, inside, toolchain};
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::path::{Path, PathBuf};

/// The program, and the one that writes what it is given; each has a feature of its own.
const PROGRAM: (&str, &str) = ("stampfly-core1", "core1");
const RECORDER: (&str, &str) = ("stampfly-core1-script", "core1-script");
/// By which the program knows where that is.
const VARIABLE: &str = "STAMPFLY_CORE1";

/// Flies over emulated chips on this PC. Returns the file with what the core was given, and what the program says of it here.
pub fn record(repository: &Repository) -> Result<(PathBuf, String), Failure> {
    let target = repository.target("qemu");
    let script = script(repository, "core1.bin", None)?;
    let cargo = |command: &str, (name, feature): (&str, &str)| {
        let mut cargo = inside(repository, repository.cargo());
        cargo.args([command, "--quiet", "--release", "--locked", "--target-dir"]).arg(&target);
        cargo.args(["--features", feature, "--bin", name]).env(VARIABLE, &script);
        cargo
    };
    run_program(cargo("clippy", PROGRAM).args(["--", "-D", "warnings"]))?;
    let (said, _) = capture(&mut cargo("run", PROGRAM))?;
    Ok((script, said))
}

/// Flies a mission, or the usual one, over emulated chips on this PC. Returns the file with what the core was given.
pub fn script(repository: &Repository, name: &str, mission: Option<&str>) -> Result<PathBuf, Failure> {
    let target = repository.target("qemu");
    let script = target.join(name);
    let cargo = |command: &str| {
        let mut cargo = inside(repository, repository.cargo());
        cargo.args([command, "--quiet", "--release", "--locked", "--target-dir"]).arg(&target);
        cargo.args(["--features", RECORDER.1, "--bin", RECORDER.0]);
        cargo
    };
    run_program(cargo("clippy").args(["--", "-D", "warnings"]))?;
    run_program(cargo("run").arg("--").arg(&script).args(mission))?;
    Ok(script)
}

/// Builds the program for a machine with this feature as well, runs it there and returns what it says.
pub fn emulate(
    repository: &Repository,
    machine: &Machine,
    script: &Path,
    feature: &str,
    seconds: &str,
) -> Result<String, Failure> {
    let (mut build, options) = toolchain(repository, machine)?;
    build.arg("build").args(&options).args(["--features", feature, "--bin", PROGRAM.0]).env(VARIABLE, script);
    run_program(&mut build)?;
    let mut limited = inside(repository, repository.command("timeout"));
    limited.envs(build.get_envs().filter_map(|(key, value)| Some((key, value?))));
    limited.arg(seconds).arg(build.get_program()).arg("run").args(&options);
    Ok(capture(limited.args(["--features", feature, "--bin", PROGRAM.0]))?.0)
}

/// Builds the program for a machine.
pub fn program(repository: &Repository, machine: &Machine, script: &Path) -> Result<PathBuf, Failure> {
    let (mut cargo, options) = toolchain(repository, machine)?;
    cargo.arg("build").args(&options).args(["--features", PROGRAM.1, "--bin", PROGRAM.0]).env(VARIABLE, script);
    run_program(&mut cargo)?;
    Ok(repository.target("qemu").join(machine.target).join("release").join(PROGRAM.0))
}

/// What must be the same everywhere: what was published, and how the sensors did.
pub fn bits(said: &str) -> Vec<&str> {
    let same = ["published: ", "sensors: ", "until "];
    said.lines().filter(|line| same.iter().any(|start| line.starts_with(start))).collect()
}

/// For how long the core itself waits for transfers in a period with motors that may turn, us: the mean, and the most.
pub fn waits(said: &str) -> Result<[f64; 2], Failure> {
    let line = said.lines().find_map(|line| line.strip_prefix("waits: mean "));
    let words: Vec<&str> = line.unwrap_or_default().split(' ').collect();
    let number = |text: &str| text.parse::<f64>().map_err(|e| format!("{PACKAGE}: {text}: {e}"));
    match words[..] {
        [mean, "most", most, "us", "of", periods, "periods"] if number(periods)? > 1_000.0 => {
            Ok([number(mean)?, number(most)?])
        }
        _ => Err(format!("{PACKAGE}: the core says nothing about waiting:\n{said}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_the_program_says() {
        let said = "published: 3 messages, hash 00ff\nwaits: mean 40 most 158 us of 2402 periods\n";
        assert_eq!(bits(said), ["published: 3 messages, hash 00ff"]);
        assert_eq!(waits(said), Ok([40.0, 158.0]));
        assert!(waits("").is_err());
        // It hardly flew.
        assert!(waits(&said.replace("2402", "9")).is_err());
    }
}
