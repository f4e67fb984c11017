//! `budget`: instructions per step of the 400 Hz chain, counted by valgrind, beside the committed figure.
//!
//! Two runs of different length of the same recorded flight; the difference per step leaves start-up out.
//! Instructions are not cycles, and a PC's are not the target's: the figure is for noticing change, and it is exact
//! enough to notice a per cent, which a clock on a shared machine is not.

use crate::arguments::Arguments;
use crate::machine::{VALGRIND, provide};
use crate::ratchet::Budget;
use crate::repository::{Failure, Repository, capture, run as run_program};

/// Steps of the two runs: both end in hover.
const SHORT: u64 = 6_000;
const LONG: u64 = 8_000;

pub fn run(repository: &Repository, _: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&VALGRIND])?;
    // As it is built to be fast, and not to be built again.
    let mut build = repository.cargo();
    build.env("CARGO_INCREMENTAL", "0");
    run_program(build.args(["build", "--quiet", "--release", "--bin", "chain_steps"]))?;
    let measured = (count(repository, LONG)? - count(repository, SHORT)?) as f64 / (LONG - SHORT) as f64;

    Budget::read(repository, "benches/budget.toml")?.hold(&["instructions_per_step"], measured, "instructions per step")
}

/// Instructions of one run.
fn count(repository: &Repository, steps: u64) -> Result<u64, Failure> {
    let program = repository.target("release/chain_steps");
    let mut valgrind = repository.command("valgrind");
    valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program).arg(steps.to_string());
    let (_, report) = capture(&mut valgrind)?;
    collected(&report).ok_or_else(|| format!("valgrind counted nothing:\n{report}"))
}

fn collected(report: &str) -> Option<u64> {
    report.lines().find_map(|line| line.split_once("Collected :")?.1.trim().parse().ok())
}

#[cfg(test)]
mod tests {
    use super::collected;

    #[test]
    fn reads_valgrinds_count() {
        assert_eq!(collected("==1== Events    : Ir\n==1== Collected : 12345\n"), Some(12345));
        assert_eq!(collected("==1== nothing"), None);
    }
}
