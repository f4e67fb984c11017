//! `panic-proof`: the flight code links without its panic handler, and would not if it could panic.
//!
//! Built as it is shipped: optimised for speed, with link-time optimisation. What is optimised for size keeps a few index
//! checks that are never hit; how many is said, and no more.

use crate::Failure;
use crate::repository::{Repository, add_targets, capture, run as run_program};
use std::process::Command;

const PACKAGE: &str = "stampfly-board/panic-proof";
const TARGET: &str = "thumbv7em-none-eabihf";
/// The function that does not exist.
const MISSING: &str = "undefined symbol: a_panic_can_be_reached";

pub fn run(repository: &Repository, _: &[String]) -> Result<(), Failure> {
    add_targets(repository, &[TARGET])?;
    run_program(package(repository).args(["fmt", "--check"]))?;
    let mut clippy = package(repository);
    run_program(
        clippy
            .args(["clippy", "--quiet", "--release", "--locked", "--target-dir"])
            .arg(repository.target(NAME))
            .args(["--", "-D", "warnings"]),
    )?;

    run_program(&mut build(repository)).map_err(|e| format!("a panic can be reached, or the build failed: {e}"))?;
    println!("speed: no panic can be reached");
    match capture(build(repository).args(["--features", "control"])) {
        Err(said) if said.contains(MISSING) => println!("control: an unchecked index is noticed"),
        Err(said) => return Err(format!("the control failed for another reason: {said}")),
        Ok(_) => return Err("the control links: the proof proves nothing".to_owned()),
    }
    println!("size: {} calls that panic are left", calls(repository)?);
    Ok(())
}

const NAME: &str = "panic-proof";

/// A cargo in the package's folder: its own `.cargo/config.toml` says how it is linked, and flags meant for the host would
/// replace that.
fn package(repository: &Repository) -> Command {
    let mut cargo = repository.cargo();
    cargo.current_dir(repository.root.join(PACKAGE)).env_remove("RUSTFLAGS");
    cargo
}

fn build(repository: &Repository) -> Command {
    let mut cargo = package(repository);
    cargo.args(["build", "--quiet", "--release", "--locked", "--target-dir"]).arg(repository.target(NAME));
    cargo
}

/// Calls of functions that panic in the program optimised for size.
fn calls(repository: &Repository) -> Result<usize, Failure> {
    let target = repository.target(NAME).join("size");
    let mut cargo = package(repository);
    cargo.env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "s");
    cargo.args(["rustc", "--quiet", "--release", "--locked", "--target-dir"]).arg(&target);
    run_program(cargo.args(["--", "--emit=asm", "-Clink-arg=--unresolved-symbols=ignore-all"]))?;
    let folder = target.join(TARGET).join("release/deps");
    let io = |e| format!("{}: {e}", folder.display());
    for entry in std::fs::read_dir(&folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.extension().is_some_and(|extension| extension == "s") {
            return Ok(panicking(&std::fs::read_to_string(&path).map_err(io)?));
        }
    }
    Err(format!("no assembly in {}", folder.display()))
}

/// Branches with link to anything in `core::panicking` or to what `Option` and slices call when they fail. One call in
/// each of those functions, to the next, is not the program's.
fn panicking(assembly: &str) -> usize {
    let fails = |name: &str| {
        ["panicking", "expect_failed", "unwrap_failed", "index_fail"].iter().any(|part| name.contains(part))
    };
    let mut inside = false;
    assembly
        .lines()
        .filter(|line| {
            if let Some(label) = line.strip_suffix(':').filter(|label| !label.starts_with('.')) {
                inside = fails(label);
            }
            let mut words = line.split_whitespace();
            !inside && matches!(words.next(), Some("bl" | "b" | "b.w")) && words.next().is_some_and(fails)
        })
        .count()
}

#[cfg(test)]
mod tests {
    use super::panicking;

    #[test]
    fn counts_calls_from_outside_of_what_panics() {
        let assembly = "flight:\n\tpush {r7}\n\tbl\t_ZN4core9panicking18panic_bounds_check17h0E\n\tbl\tother\n\
                        _ZN4core9panicking18panic_bounds_check17h0E:\n\tbl\t_ZN4core9panicking9panic_fmt17h0E\n";
        assert_eq!(panicking(assembly), 1);
        assert_eq!(panicking("flight:\n\tbl\tother\n"), 0);
    }
}
