//! `ci` and `nightly`: every step of a lane, two at a time, and a table of what each took.
//!
//! Each step is a process of its own, `xtask STEP`, with a log in `target/xtask/LANE`. A step that fails stops no other one; its
//! log is printed whole when it ends. The table is printed at the end and written to `target/xtask/LANE.md`.
//!
//! | file | contents |
//! |---|---|
//! | `mod.rs` | runs the steps |
//! | `queue.rs` | which step may start next |
//! | `passed.rs` | which steps have passed for this commit within a day; `nightly` leaves them out |
//! | `table.rs` | the table |
//! | `disk.rs` | removes what passed steps have left, if the disk is nearly full |

mod disk;
mod passed;
mod queue;
mod table;

use crate::repository::{Failure, Repository};
use crate::step::{Lane, Selection, Step};
use passed::Passed;
use queue::{Next, Queue};
use std::fs::{self, File};
use std::process::Command;
use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use table::{Outcome, Row, Table};

/// Steps that run at the same time: one computes while the other one links, emulates or waits for a vehicle
/// that flies in real time.
const JOBS: usize = 2;
/// A step that takes longer hangs: the longest one takes a fifth of it.
const LONGEST: Duration = Duration::from_secs(3_600);
/// How often a running step is looked at.
const POLL: Duration = Duration::from_millis(50);

/// What the jobs share.
struct Work<'s> {
    queue: Queue<'s>,
    rows: Vec<Row>,
}

pub fn run(repository: &Repository, steps: &'static [Step], lane: Lane, selection: &Selection) -> Result<(), Failure> {
    let started = Instant::now();
    let folder = repository.target("xtask").join(lane.name());
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let passed = Passed::of(repository, lane)?;
    let is_chosen = |step: &&Step| {
        step.lane == lane && (selection.only.is_empty() || selection.only.iter().any(|name| name == step.name))
    };
    let chosen: Vec<&Step> = steps.iter().filter(is_chosen).collect();
    // A step that is asked for by name runs even if it has passed.
    let skips = lane == Lane::Nightly && selection.only.is_empty() && !selection.again;
    let (earlier, now): (Vec<&Step>, Vec<&Step>) =
        chosen.iter().partition(|step| skips && passed.seconds(step.name).is_some());
    let earlier = earlier.iter().map(|step| Row {
        name: step.name,
        outcome: Outcome::PassedEarlier,
        seconds: passed.seconds(step.name).unwrap_or_default(),
    });
    let work = Mutex::new(Work { queue: Queue::new(now), rows: earlier.collect() });
    let ended = Condvar::new();
    std::thread::scope(|scope| {
        for _ in 0..JOBS {
            scope.spawn(|| job(repository, lane, &work, &ended, &passed));
        }
    });

    let mut rows = work.into_inner().unwrap_or_else(|e| e.into_inner()).rows;
    rows.sort_by_key(|row| chosen.iter().position(|step| step.name == row.name));
    let table = Table { lane, rows, seconds: started.elapsed().as_secs_f64() };
    let path = folder.with_extension("md");
    fs::write(&path, table.markdown(repository)).map_err(|e| format!("{}: {e}", path.display()))?;
    print!("{}", table.text());
    println!("{} passed, {} failed", table.passed(), table.failed().len());
    // A step that neither passed nor failed did not run, and the lane has shown nothing of it.
    if table.passed() == chosen.len() { Ok(()) } else { Err(format!("{}: {}", lane.name(), table.failed().join(", "))) }
}

/// Runs one step after the other until none is left.
fn job(repository: &Repository, lane: Lane, work: &Mutex<Work>, ended: &Condvar, passed: &Passed) {
    loop {
        let mut guard = lock(work);
        let step = loop {
            match guard.queue.next() {
                Next::Start(step) => break step,
                Next::Wait => guard = ended.wait(guard).unwrap_or_else(|e| e.into_inner()),
                Next::Finished => return,
            }
        };
        drop(guard);
        let begun = Instant::now();
        let outcome = in_a_process(repository, lane, step);
        let seconds = begun.elapsed().as_secs_f64();
        let mut guard = lock(work);
        // Under the lock, so that the lines of two steps do not mix.
        match &outcome {
            Ok(()) => eprintln!("passed  {:<14} {seconds:>7.1} s", step.name),
            Err(log) => eprintln!("FAILED  {:<14} {seconds:>7.1} s\n{log}", step.name),
        }
        let outcome = if outcome.is_ok() { Outcome::Passed } else { Outcome::Failed };
        if let Err(failure) = passed.remember(step.name, seconds, outcome) {
            eprintln!("{failure}");
        }
        guard.rows.push(Row { name: step.name, outcome, seconds });
        if lane == Lane::Ci {
            let passed = guard.rows.iter().filter(|row| row.outcome == Outcome::Passed);
            disk::make_room(repository, passed.map(|row| row.name));
        }
        guard.queue.ended(step);
        drop(guard);
        ended.notify_all();
    }
}

/// A job that panicked leaves the rows that it has written; the others go on with them.
fn lock<'w, 's>(work: &'w Mutex<Work<'s>>) -> MutexGuard<'w, Work<'s>> {
    work.lock().unwrap_or_else(|e| e.into_inner())
}

/// Runs `xtask STEP`. Fails with everything that it wrote.
fn in_a_process(repository: &Repository, lane: Lane, step: &Step) -> Result<(), String> {
    let path = repository.target("xtask").join(lane.name()).join(format!("{}.log", step.name));
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let log = File::create(&path).map_err(|e| fail(&e))?;
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let mut xtask: Command = repository.command(&program.to_string_lossy());
    // Nothing is built twice here, and code that was compiled for it flies a tenth slower.
    xtask.env("CARGO_INCREMENTAL", "0").arg(step.name).stdin(std::process::Stdio::null());
    let mut child = xtask.stdout(log.try_clone().map_err(|e| fail(&e))?).stderr(log).spawn().map_err(|e| fail(&e))?;
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|e| fail(&e))? {
            break status;
        }
        if begun.elapsed() > LONGEST {
            child.kill().map_err(|e| fail(&e))?;
            child.wait().map_err(|e| fail(&e))?;
            let said = fs::read(&path).map_err(|e| fail(&e))?;
            return Err(format!(
                "{}\n{} was ended after {} s",
                String::from_utf8_lossy(&said),
                step.name,
                LONGEST.as_secs()
            ));
        }
        std::thread::sleep(POLL);
    };
    let said = fs::read(&path).map_err(|e| fail(&e))?;
    if status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&said).into_owned()) }
}
