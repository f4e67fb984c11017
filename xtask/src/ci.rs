//! `ci`: everything, with a table of what it took.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository};
use crate::step::Step;
use std::time::Instant;

pub fn run(repository: &Repository, steps: &[Step]) -> Result<(), Failure> {
    let started = Instant::now();
    let mut table = Vec::new();
    let mut failed = None;
    for step in steps.iter().filter(|step| step.in_ci) {
        if failed.is_some() {
            table.push((step.name, "not run", 0.0));
            continue;
        }
        eprintln!("\n=== {}: {}", step.name, step.about);
        let begun = Instant::now();
        let outcome = step.check(repository, &Arguments::default());
        let seconds = begun.elapsed().as_secs_f64();
        table.push((step.name, if outcome.is_ok() { "ok" } else { "FAILED" }, seconds));
        failed = outcome.err().map(|failure| format!("step `{}` failed: {failure}", step.name));
    }
    println!("\n{:<12} {:<8} {:>8}", "step", "outcome", "seconds");
    for (name, outcome, seconds) in table {
        println!("{name:<12} {outcome:<8} {seconds:>8.1}");
    }
    println!(
        "{:<12} {:<8} {:>8.1}",
        "all",
        if failed.is_some() { "FAILED" } else { "ok" },
        started.elapsed().as_secs_f64()
    );
    failed.map_or(Ok(()), Err)
}
