//! `vectors`: are the datagrams that other programs are tested against what this repository writes?
//!
//! Written again by `--fix`, after a change that is meant to change datagrams. Not part of `ci`: there a test of the same
//! crate compares them.

use super::program::example;
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture};
use std::fs;

/// The file, and the example that prints it.
const VECTORS: &[(&str, &str)] = &[("vehicles/rover/tests/vectors/datagrams.json", "datagram_vectors")];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    for (name, printer) in VECTORS {
        let printer = example(repository, printer)?;
        let (text, _) = capture(&mut repository.command(&printer.to_string_lossy()))?;
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
