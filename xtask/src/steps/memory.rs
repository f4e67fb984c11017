//! `memory`: what the firmware takes of flash, memory and stack, by crate and by task, beside the committed figures.
//!
//! Read from the ESP32-C6 program, which is the same code as the StampFly's, with the radio's own libraries (written in
//! C) counted apart. Stack is a bound, not a measurement: frames and calls come from the machine code. Interrupts come on
//! top; the committed file says how much of each stack the tasks may take.

use super::esp32;
use crate::Failure;
use crate::elf::stack::{Pointers, Stack};
use crate::elf::{Place, Program};
use crate::ratchet::Budget;
use crate::repository::Repository;
use std::collections::BTreeMap;

const BUDGET: &str = "stampfly-board/esp32s3/memory.toml";
/// What is called through pointers, by whom: estimation reaches the estimator that the parameters chose, the scheduler
/// asks topics for their newest, a drained bus hands messages to a closure, formatted text asks each value to write
/// itself, everybody else wakes tasks.
const POINTERS: Pointers<'_> = &[
    ("runnables::estimation::Estimation", ESTIMATOR),
    ("FlightLoop>::complete", ESTIMATOR),
    ("FlightLoop>", &["AnyTopic>::"]),
    ("Scheduler", &["AnyTopic>::"]),
    ("drain", &["FnOnce<(stampfly_board::topic_table::wiring::Id"]),
    ("core::fmt::", &[" as core::fmt::"]),
    ("", &["raw::waker::"]),
];
const ESTIMATOR: &[&str] = &[" as stampfly_eskf::estimator::Estimator>::", "AnyTopic>::"];

pub fn run(repository: &Repository, arguments: &[String]) -> Result<(), Failure> {
    let path = match arguments {
        [] => esp32::c6(repository)?,
        [path] => path.into(),
        _ => return Err(format!("what is {arguments:?}?")),
    };
    let program = Program::read(&path)?;
    let budget = Budget::read(repository, BUDGET)?;
    sizes(&program, &budget)?;
    stacks(repository, &program, &budget)
}

/// Bytes of flash and of memory.
#[derive(Clone, Copy, Default)]
struct Sizes {
    flash: u64,
    memory: u64,
}

fn sizes(program: &Program, budget: &Budget) -> Result<(), Failure> {
    let mut owners: BTreeMap<&str, Sizes> = BTreeMap::new();
    for symbol in program.symbols.values() {
        let sizes = owners.entry(&symbol.owner).or_default();
        if symbol.place != Place::Memory {
            sizes.flash += symbol.size;
        }
        if symbol.place != Place::Flash {
            sizes.memory += symbol.size;
        }
    }
    let radio = owners.remove("C").unwrap_or_default();
    let all = owners.values().fold(Sizes::default(), |sum, sizes| Sizes {
        flash: sum.flash + sizes.flash,
        memory: sum.memory + sizes.memory,
    });
    let mut rows: Vec<_> = owners.into_iter().collect();
    rows.sort_by_key(|(_, sizes)| std::cmp::Reverse(sizes.flash + sizes.memory));
    println!("{:<28} {:>9} {:>9}", "crate", "flash", "memory");
    for (owner, sizes) in rows.iter().take(16) {
        println!("{owner:<28} {:>9} {:>9}", sizes.flash, sizes.memory);
    }
    println!("{:<28} {:>9} {:>9}", "all Rust", all.flash, all.memory);
    println!("{:<28} {:>9} {:>9}  (the radio's libraries, not ours)", "C", radio.flash, radio.memory);
    budget.hold("flash", all.flash as f64, "bytes of flash")?;
    budget.hold("memory", all.memory as f64, "bytes of static memory")
}

fn stacks(repository: &Repository, program: &Program, budget: &Budget) -> Result<(), Failure> {
    let configured = [
        ("flight", esp32::flight_stack(repository)? as f64),
        ("ground", (program.linker("_stack_start")? - program.linker("_stack_end")?) as f64),
    ];
    for part in POINTERS.iter().flat_map(|(_, targets)| *targets) {
        // A table that no longer fits the program would make every bound smaller.
        if program.functions(&[part]).next().is_none() {
            return Err(format!("the program has no function `{part}`, which is said to be behind a pointer"));
        }
    }
    let mut stack = Stack::new(program, POINTERS);
    for (task, parts, of) in TASKS {
        let root = program.functions(parts).map(|(address, _)| stack.below(address)).max_by_key(|depth| depth.bytes);
        let depth = root.ok_or_else(|| format!("the program has no task {parts:?}"))?;
        // A path is a Rust name; what the radio's libraries do below is not ours to bound.
        let (ours, radios): (Vec<_>, Vec<_>) = depth.unbounded.iter().partition(|name| name.contains("::"));
        if !radios.is_empty() {
            println!("{task}: without a bound in the radio's libraries: {radios:?}");
        }
        if !ours.is_empty() {
            return Err(format!("{task}: without a bound: {ours:?}"));
        }
        budget.hold(&format!("stack.{task}"), depth.bytes as f64, "bytes of stack")?;
        for (name, frame) in depth.way.iter().filter(|(_, frame)| *frame >= 256) {
            println!("    {frame:>6}  {:.100}", name);
        }
        let (_, configured) = configured.iter().find(|(name, _)| *name == of).ok_or("no such stack")?;
        let share = depth.bytes as f64 / configured;
        println!("{task}: {:.0} % of {configured:.0} bytes", share * 100.0);
        if share > 0.5 {
            return Err(format!("{task} may take more than half of its stack"));
        }
    }
    Ok(())
}

/// A task: its name, parts of the name of the function that polls it, whose stack it runs on.
type Task = (&'static str, &'static [&'static str], &'static str);

const TASKS: [Task; 8] = [
    ("flight", &["TaskStorage<stampfly_esp32s3::flight", ">::poll"], "flight"),
    ("sensors", &["TaskStorage<stampfly_esp32s3::sensors", ">::poll"], "ground"),
    ("people", &["TaskStorage<stampfly_esp32s3::people", ">::poll"], "ground"),
    ("radio", &["TaskStorage<stampfly_esp32s3::radio", ">::poll"], "ground"),
    ("console", &["TaskStorage<stampfly_esp32s3::console", ">::poll"], "ground"),
    ("memory", &["TaskStorage<stampfly_esp32s3::memory", ">::poll"], "ground"),
    // Before any task runs, one after the other. Each holds a whole vehicle.
    ("self_test", &["stampfly_esp32s3::self_test::run"], "ground"),
    ("assembly", &["stampfly_esp32s3::start"], "ground"),
];
