//! `determinism`: the same flight, optimised and not, publishes the same bits.
//!
//! Compares the hash over everything published that `stampfly fly --seed N --json` prints.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository, capture, json};

const PROFILES: [&str; 2] = ["release", "dev"];
const SEEDS: [&str; 2] = ["1", "2"];

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    let mut hashes = Vec::new();
    for seed in SEEDS {
        let mut of_seed = Vec::new();
        for profile in PROFILES {
            let mut fly = repository.cargo();
            fly.args(["run", "--quiet", "--profile", profile, "--bin", "stampfly", "--"]);
            fly.args(["fly", "--seed", seed, "--json", "--out"]).arg(repository.target("determinism"));
            let (report, _) = capture(&mut fly)?;
            let hash =
                json(&report)?["log_hash"].as_str().filter(|hash| !hash.is_empty()).ok_or("no `log_hash`")?.to_owned();
            println!("seed {seed}, {profile:<12} {hash}");
            of_seed.push(hash);
        }
        if of_seed.iter().any(|hash| *hash != of_seed[0]) {
            return Err(format!("seed {seed}: the profiles {PROFILES:?} disagree: {of_seed:?}"));
        }
        hashes.append(&mut of_seed);
    }
    // A hash of nothing would agree with itself, too.
    if hashes.first() == hashes.last() { Err("two seeds have the same hash".to_owned()) } else { Ok(()) }
}
