//! `budget`: instructions per step of the 400 Hz chain, counted by valgrind, beside the committed figure.
//!
//! Two runs of different length of the same recorded flight; the difference per step leaves start-up out.
//! Instructions are not cycles, and a PC's are not the target's: the figure is for noticing change, and it is exact
//! enough to notice a per cent, which a clock on a shared machine is not.

use crate::Failure;
use crate::repository::{Repository, capture, exists, install, run as run_program};
use std::fs;

/// Steps of the two runs: both end in hover.
const SHORT: u64 = 6_000;
const LONG: u64 = 8_000;
/// So much better, and the budget ought to follow.
const RATCHET: f64 = 0.03;

pub fn run(repository: &Repository, _: &[String]) -> Result<(), Failure> {
    if !exists("valgrind") {
        install(repository, &["valgrind"])?;
    }
    run_program(repository.cargo().args([
        "build",
        "--quiet",
        "--release",
        "-p",
        "stampfly-benches",
        "--example",
        "chain_steps",
    ]))?;
    let measured = (count(repository, LONG)? - count(repository, SHORT)?) as f64 / (LONG - SHORT) as f64;

    let path = repository.root.join("benches/budget.toml");
    let budget = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let field = |name: &str| number(&budget, name).ok_or_else(|| format!("{}: no number `{name}`", path.display()));
    let (allowed, tolerance) = (field("instructions_per_step")?, field("tolerance")?);
    let change = measured / allowed - 1.0;
    println!("{measured:.0} instructions per step; the budget is {allowed:.0} ({:+.1} %)", change * 100.0);
    if change > tolerance {
        return Err(format!("{:.1} % over budget, {:.1} % is allowed", change * 100.0, tolerance * 100.0));
    }
    if change < -RATCHET {
        println!("well done: set instructions_per_step = {measured:.0} in benches/budget.toml");
    }
    Ok(())
}

/// Instructions of one run of so many steps.
fn count(repository: &Repository, steps: u64) -> Result<u64, Failure> {
    let program = repository.target("release/examples/chain_steps");
    let mut valgrind = repository.command("valgrind");
    valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program).arg(steps.to_string());
    let (_, report) = capture(&mut valgrind)?;
    collected(&report).ok_or_else(|| format!("valgrind counted nothing:\n{report}"))
}

fn collected(report: &str) -> Option<u64> {
    report.lines().find_map(|line| line.split_once("Collected :")?.1.trim().parse().ok())
}

/// The number in a line `name = number`.
fn number(text: &str, name: &str) -> Option<f64> {
    text.lines().find_map(|line| {
        let (key, value) = line.split_once('=')?;
        let value = value.split('#').next()?.trim().replace('_', "");
        (key.trim() == name).then(|| value.parse().ok())?
    })
}

#[cfg(test)]
mod tests {
    use super::{collected, number};

    #[test]
    fn reads_its_sources() {
        assert_eq!(collected("==1== Events    : Ir\n==1== Collected : 12345\n"), Some(12345));
        assert_eq!(collected("==1== nothing"), None);
        assert_eq!(number("# a = 1\na_b = 3\na = 1_000 # why\n", "a"), Some(1000.0));
        assert_eq!(number("ab = 1", "a"), None);
    }
}
