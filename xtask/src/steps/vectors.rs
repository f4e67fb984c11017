//! `vectors`: are the datagrams that other programs are tested against what this repository writes?
//!
//! Written again by `--fix`, after a change that is meant to change datagrams. Not part of `ci`: there a test of the same
//! crate compares them.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture};
use std::fs;

/// The file, the crate that writes it, and the example that prints it.
const VECTORS: &[(&str, &str, &str)] =
    &[("vehicles/rover/tests/vectors/datagrams.json", "stampfly-rover", "datagram_vectors")];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    for (name, package, example) in VECTORS {
        let mut cargo = repository.cargo();
        let (text, _) = capture(cargo.args(["run", "--quiet", "--package", package, "--example", example]))?;
        let path = repository.root.join(name);
        if fs::read_to_string(&path).is_ok_and(|committed| committed == text) {
            println!("{name}: up to date");
        } else if arguments.fix {
            fs::write(&path, text).map_err(|e| format!("{name}: {e}"))?;
            println!("{name}: written again");
        } else {
            return Err(format!("{name} is out of date; `cargo xtask vectors --fix` if datagrams were to change"));
        }
    }
    Ok(())
}
