//! `ci`: everything, with a table of what it took.
//!
//! Steps run in two lanes, because one alone leaves a core idle while it links, emulates or measures. The first lane has what
//! builds in the workspace's own folder, in the order of the table. The second has the steps [beside](Step::beside) it: they
//! build in folders of their own, as processes of their own, and what one says is shown when it has ended.

use crate::arguments::Arguments;
use crate::repository::{Failure, Repository};
use crate::step::{Lane, Step};
use std::fs::{self, File};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A line of the table at the end.
struct Row {
    name: &'static str,
    outcome: &'static str,
    seconds: f64,
}

pub fn run(repository: &Repository, steps: &'static [Step]) -> Result<(), Failure> {
    let started = Instant::now();
    let failed = AtomicBool::new(false);
    let run_all = |lanes: &[Lane], check: &dyn Fn(&Step) -> Result<(), Failure>| {
        let (mut rows, mut failures) = (Vec::new(), Vec::new());
        for step in steps.iter().filter(|step| lanes.contains(&step.lane)) {
            if failed.load(Ordering::Relaxed) {
                rows.push(Row { name: step.name, outcome: "not run", seconds: 0.0 });
                continue;
            }
            let begun = Instant::now();
            let outcome = check(step);
            let seconds = begun.elapsed().as_secs_f64();
            rows.push(Row { name: step.name, outcome: if outcome.is_ok() { "ok" } else { "FAILED" }, seconds });
            if let Err(failure) = outcome {
                failed.store(true, Ordering::Relaxed);
                failures.push(format!("step `{}` failed: {failure}", step.name));
            }
        }
        (rows, failures)
    };
    // Held by the second lane while one of its steps runs, and by a step of the first that wants to be alone.
    let busy = Mutex::new(());
    let here = |step: &Step| {
        eprintln!("\n=== {}: {}", step.name, step.about);
        let _alone = (step.lane == Lane::Alone).then(|| busy.lock());
        (step.run)(repository, &Arguments::default())
    };
    let beside = |step: &Step| {
        let _busy = busy.lock();
        in_a_process(repository, step)
    };
    let ((mut rows, mut failures), (others, their_failures)) = std::thread::scope(|scope| {
        let second = scope.spawn(|| run_all(&[Lane::Second], &beside));
        let first = run_all(&[Lane::First, Lane::Alone], &here);
        (first, second.join().unwrap_or_else(|_| (Vec::new(), vec!["the second lane panicked".to_owned()])))
    });
    rows.extend(others);
    failures.extend(their_failures);

    println!("\n{:<12} {:<8} {:>8}", "step", "outcome", "seconds");
    for Row { name, outcome, seconds } in rows {
        println!("{name:<12} {outcome:<8} {seconds:>8.1}");
    }
    let all = if failures.is_empty() { "ok" } else { "FAILED" };
    println!("{:<12} {all:<8} {:>8.1}", "all", started.elapsed().as_secs_f64());
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) }
}

/// Runs a step as `xtask STEP` and shows at the end what it said.
fn in_a_process(repository: &Repository, step: &Step) -> Result<(), Failure> {
    let folder = repository.target("ci");
    let path = folder.join(format!("{}.log", step.name));
    let io = |e: std::io::Error| format!("{}: {e}", path.display());
    fs::create_dir_all(&folder).map_err(io)?;
    let log = File::create(&path).map_err(io)?;
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let mut xtask = repository.command(&program.to_string_lossy());
    xtask.arg(step.name).stdout(log.try_clone().map_err(io)?).stderr(log);
    let status = xtask.status().map_err(io)?;
    let said = String::from_utf8_lossy(&fs::read(&path).map_err(io)?).into_owned();
    eprintln!("\n=== {}: {} (beside the others)\n{said}", step.name, step.about);
    if status.success() { Ok(()) } else { Err(said.lines().last().unwrap_or_default().to_owned()) }
}
