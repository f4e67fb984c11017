//! `panic-proof` and `panic-proofs`: the flight code links without a panic handler. If any of it
//! could panic, the linker would miss the handler.
//!
//! The build is the shipped one: optimised for speed, with link-time optimisation. Each core needs its
//! own proof, because the compiler unrolls and merges code differently for each.
//!
//! | step | core |
//! |---|---|
//! | `panic-proof` | ARM with an FPU |
//! | `panic-proofs` | RISC-V with an FPU and without; ARM, optimised for size |
//!
//! `panic-proofs` also builds for each core a program that can panic, which must not link.
//!
//! Optimised for size, the code keeps a few index checks that never fail. The step prints where they
//! are, and fails if there are more than the budget allows.

use crate::arguments::Arguments;
use crate::ratchet::Budget;
use crate::repository::{Failure, Repository, add_targets, capture, run as run_program};
use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

const PACKAGE: &str = "stampfly-board/panic-proof";
const BUDGET: &str = "stampfly-board/panic-proof/budget.toml";
/// The core of every push; the calls in the program optimised for size are counted for it, too.
const ARM: &str = "thumbv7em-none-eabihf";
/// The other cores.
const OTHERS: [&str; 2] = ["riscv32imafc-unknown-none-elf", "riscv32imac-unknown-none-elf"];
/// The function that does not exist.
const MISSING: &str = "undefined symbol: a_panic_can_be_reached";

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    add_targets(repository, &[ARM])?;
    prove(repository, ARM)
}

/// `panic-proofs`: the other cores, and the build for size.
pub fn others(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    add_targets(repository, &[&[ARM], &OTHERS[..]].concat())?;
    // All of them, for what can panic on one core says little about another.
    let mut failures: Vec<Failure> = OTHERS.iter().filter_map(|target| prove(repository, target).err()).collect();
    failures.extend([ARM].iter().chain(&OTHERS).filter_map(|target| notices(repository, target).err()));
    failures.extend(for_size(repository).err());
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) }
}

/// Compares the calls in the program optimised for size with the committed figure.
fn for_size(repository: &Repository) -> Result<(), Failure> {
    let callers = callers(repository)?;
    for (caller, calls) in &callers {
        println!("size: {calls} in {caller}");
    }
    let calls: usize = callers.values().sum();
    Budget::read(repository, BUDGET)?.hold(&["size"], calls as f64, "calls that panic")
}

fn prove(repository: &Repository, target: &str) -> Result<(), Failure> {
    run_program(&mut build(repository, target))
        .map_err(|e| format!("{target}: a panic can be reached, or the build failed: {e}"))?;
    println!("{target}: no panic can be reached");
    Ok(())
}

/// An unchecked index is noticed: the proof can fail.
fn notices(repository: &Repository, target: &str) -> Result<(), Failure> {
    match capture(build(repository, target).args(["--features", "control"])) {
        Err(said) if said.contains(MISSING) => {
            println!("{target}: an unchecked index is noticed");
            Ok(())
        }
        Err(said) => Err(format!("{target}: the control failed for another reason: {said}")),
        Ok(_) => Err(format!("{target}: the control links: the proof proves nothing")),
    }
}

const NAME: &str = "panic-proof";

/// A cargo in the package's folder: its own `.cargo/config.toml` says how it is linked, and flags meant for the host would
/// replace that.
fn package(repository: &Repository) -> Command {
    let mut cargo = repository.cargo();
    cargo.current_dir(repository.root.join(PACKAGE)).env_remove("RUSTFLAGS");
    cargo
}

fn build(repository: &Repository, target: &str) -> Command {
    let mut cargo = package(repository);
    cargo.args(["build", "--quiet", "--release", "--locked", "--target", target, "--target-dir"]);
    cargo.arg(repository.target(NAME));
    cargo
}

/// Calls of functions that panic in the program optimised for size, by caller.
fn callers(repository: &Repository) -> Result<BTreeMap<String, usize>, Failure> {
    let target = repository.target(NAME).join("size");
    let folder = target.join(ARM).join("release/deps");
    // The assembly of an earlier version has another name and would be counted instead.
    let _ = fs::remove_dir_all(&folder);
    let mut cargo = package(repository);
    cargo.env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "s");
    cargo.args(["rustc", "--quiet", "--release", "--locked", "--target", ARM, "--target-dir"]).arg(&target);
    run_program(cargo.args(["--", "--emit=asm", "-Clink-arg=--unresolved-symbols=ignore-all"]))?;
    let io = |e| format!("{}: {e}", folder.display());
    let entries: Result<Vec<_>, _> = fs::read_dir(&folder).map_err(io)?.collect();
    let paths = entries.map_err(io)?.into_iter().map(|entry| entry.path());
    let assembly: Vec<_> = paths.filter(|path| path.extension().is_some_and(|extension| extension == "s")).collect();
    match &assembly[..] {
        [only] => Ok(panicking(&fs::read_to_string(only).map_err(io)?)),
        _ => Err(format!("one file of assembly was expected in {}, not {assembly:?}", folder.display())),
    }
}

/// Branches with link to anything in `core::panicking` or to what `Option` and slices call when they fail, by the function
/// they are in. One call in each of those functions, to the next, is not the program's.
fn panicking(assembly: &str) -> BTreeMap<String, usize> {
    let fails = |name: &str| {
        ["panicking", "expect_failed", "unwrap_failed", "index_fail"].iter().any(|part| name.contains(part))
    };
    let mut inside = "";
    let mut callers = BTreeMap::new();
    for line in assembly.lines() {
        if let Some(label) = line.strip_suffix(':').filter(|label| !label.starts_with('.')) {
            inside = label;
        }
        let mut words = line.split_whitespace();
        let is_call = matches!(words.next(), Some("bl" | "b" | "b.w")) && words.next().is_some_and(fails);
        if is_call && !fails(inside) {
            *callers.entry(format!("{:#}", rustc_demangle::demangle(inside))).or_default() += 1;
        }
    }
    callers
}

#[cfg(test)]
mod tests {
    use super::panicking;

    #[test]
    fn counts_calls_from_outside_of_what_panics() {
        let assembly = "flight:\n\tpush {r7}\n\tbl\t_ZN4core9panicking18panic_bounds_check17h0E\n\tbl\tother\n\
                        _ZN4core9panicking18panic_bounds_check17h0E:\n\tbl\t_ZN4core9panicking9panic_fmt17h0E\n";
        assert_eq!(panicking(assembly), [("flight".to_owned(), 1)].into());
        assert!(panicking("flight:\n\tbl\tother\n").is_empty());
    }
}
