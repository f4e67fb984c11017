//! `determinism`: the same flight, optimised and not, publishes the same bits.
//!
//! Compares the hash over everything published that `stampfly fly --seed N --json` prints.

use crate::Failure;
use crate::repository::{Repository, capture};

const PROFILES: [&str; 2] = ["release", "unoptimised"];
const SEEDS: [&str; 2] = ["1", "2"];

pub fn run(repository: &Repository, _: &[String]) -> Result<(), Failure> {
    let mut hashes = Vec::new();
    for seed in SEEDS {
        let mut of_seed = Vec::new();
        for profile in PROFILES {
            let mut fly = repository.cargo();
            fly.args(["run", "--quiet", "--profile", profile, "--bin", "stampfly", "--"]);
            fly.args(["fly", "--seed", seed, "--json", "--out"]).arg(repository.target("determinism"));
            let (report, _) = capture(&mut fly)?;
            let hash = log_hash(&report).ok_or_else(|| format!("no `log_hash` in {report}"))?.to_owned();
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

/// The value of the one key we need, number or string, from a JSON object.
fn log_hash(report: &str) -> Option<&str> {
    let (_, rest) = report.split_once("\"log_hash\"")?;
    let value = rest.trim_start().strip_prefix(':')?.split([',', '}']).next()?;
    let value = value.trim().trim_matches('"');
    (!value.is_empty()).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::log_hash;

    #[test]
    fn finds_the_hash_and_nothing_else() {
        assert_eq!(log_hash(r#"{ "seed": 1, "log_hash": "00ff", "x": 2 }"#), Some("00ff"));
        assert_eq!(log_hash("{\"log_hash\":123}\n"), Some("123"));
        assert_eq!(log_hash("{\"log_hash\": \"\"}"), None);
        assert_eq!(log_hash("{\"hash\": 1}"), None);
    }
}
