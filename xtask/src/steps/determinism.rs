//! `determinism`: the same flight, optimised and not, publishes the same bits.
//!
//! Two builds fly the committed golden flight and two seeds; `stampfly fly --seed N --json` prints a
//! hash over all messages of a flight.

use super::golden;
use super::program::{released, unoptimised};
use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture, json};
use std::path::Path;

const SEEDS: [&str; 2] = ["1", "2"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let programs = [released(repository)?, unoptimised(repository)?];
    for program in &programs {
        golden::compare(repository, program)?;
    }
    let mut hashes = Vec::new();
    for seed in SEEDS {
        let [optimised, unoptimised] = programs.each_ref().map(|program| hash(repository, program, seed));
        let (optimised, unoptimised) = (optimised?, unoptimised?);
        println!("seed {seed}: {optimised} optimised, {unoptimised} not");
        if optimised != unoptimised {
            return Err(format!("seed {seed}: {optimised} optimised, {unoptimised} not"));
        }
        hashes.push(optimised);
    }
    // A hash of nothing would agree with itself, too.
    if hashes.first() == hashes.last() { Err("two seeds have the same hash".to_owned()) } else { Ok(()) }
}

/// The hash of a flight.
fn hash(repository: &Repository, program: &Path, seed: &str) -> Result<String, Failure> {
    let mut fly = repository.command(&program.to_string_lossy());
    fly.args(["fly", "--seed", seed, "--json", "--out"]).arg(repository.target("determinism"));
    let (report, _) = capture(&mut fly)?;
    let hash = json(&report)?["log_hash"].as_str().filter(|hash| !hash.is_empty()).map(str::to_owned);
    hash.ok_or_else(|| format!("seed {seed}: no `log_hash`"))
}
