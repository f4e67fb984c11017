//! `memory`: what the firmware takes of flash, memory and stack, by crate and by task, beside the committed figures.
//!
//! Read from the ESP32-C6 program, which is the same code as the StampFly's, with the radio's own libraries (written in
//! C) counted apart. What the compiler named itself belongs to no crate in particular, and what no symbol covers has a row
//! of its own, so that the rows add up to the sections.
//!
//! Stack is a bound, not a measurement: frames and calls come from the machine code. Interrupts come on top of it, which is
//! why half of a stack is kept free. `--fix` commits to what there is now, as far as the bounds allow.

use super::esp32::{self, Variant};
use super::s3_memory;
use crate::arguments::Arguments;
use crate::elf::stack::{Behind, Stack};
use crate::elf::{C, CONSTANTS, Program, Sizes};
use crate::ratchet::Budget;
use crate::repository::{Failure, Repository};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The committed figures of each variant of the firmware.
const BUDGETS: [(Variant, &str); 2] = [
    (Variant::Default, "stampfly-board/esp32s3/memory.toml"),
    (Variant::Wifi, "stampfly-board/esp32s3/memory-wifi.toml"),
];
/// What is called through pointers, by whom: the scheduler asks topics for their newest, a drained bus hands messages to a closure, formatted text asks each value to write
/// itself, executors run tasks, all other callers wake them or run the scheduler.
const POINTERS: &[Behind<'_>] = &[
    Behind { callers: "drain", targets: &["FnOnce<(usize, stampfly_types::time::Instant"], nests: None },
    // The deepest: the console's text has a storage error (1) whose text has the flash driver's error (2), whose number (3)
    // goes to the writer (4). A topic's fields are one less.
    Behind { callers: "core::fmt::", targets: &[" as core::fmt::"], nests: Some(4) },
    Behind { callers: "embassy::Executor>::run", targets: &["TaskStorage<stampfly_esp32s3::"], nests: None },
    // Tasks, and whatever the compiler puts the flight loop with its scheduler into.
    Behind { callers: "", targets: &["raw::waker::", "AnyTopic>::head", "AnyTopic>::newest_at"], nests: None },
];
/// Bytes of stack assumed for a function in ROM, whose code is not in the program. These compute with floating point, copy
/// memory, wait, or access the flash chip, and call little.
const ROM: u64 = 512;
/// Part of its stack that a task may take. The rest is for interrupts and for errors of this bound.
const SHARE: f64 = 0.5;

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    if let Some(file) = &arguments.file {
        let [(_, budget), _] = BUDGETS;
        return measure(repository, file, budget, arguments.fix);
    }
    let measured = BUDGETS.map(|(variant, budget)| {
        println!("{}:", variant.name());
        measure(repository, &esp32::c6(repository, variant)?, budget, arguments.fix)
            .map_err(|failure| format!("{}: {failure}", variant.name()))
    });
    let failures: Vec<Failure> = measured.into_iter().filter_map(Result::err).collect();
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) }
}

/// Measures a program, and compares it with its budget.
fn measure(repository: &Repository, path: &Path, file: &'static str, fix: bool) -> Result<(), Failure> {
    let program = Program::read(path)?;
    // What this program leaves of the S3's memory, not of the larger one it was built for.
    let ground = s3_memory::stack(repository, path, &esp32::s3_scripts(repository)?)?;
    let budget = Budget::read(repository, file)?;
    let mut ledger = Ledger { budget, file, fix, held: BTreeSet::new(), failures: Vec::new() };
    sizes(&program, &mut ledger)?;
    stacks(ground, &program, &mut ledger)?;
    ledger.close()
}

/// Tables of the budget.
const TABLES: [&str; 3] = ["flash", "memory", "stack"];

/// The committed figures beside the measured ones. Says all that is wrong at once: a change moves many of them.
struct Ledger {
    budget: Budget,
    /// Where they are.
    file: &'static str,
    /// Commit to what is measured instead of comparing it.
    fix: bool,
    /// Figures compared so far.
    held: BTreeSet<(&'static str, String)>,
    failures: Vec<Failure>,
}

impl Ledger {
    fn hold(&mut self, table: &'static str, name: &str, measured: u64, unit: &str) {
        let (key, measured) = ([table, name], measured as f64);
        let outcome = if self.fix { self.budget.set(&key, measured) } else { self.budget.hold(&key, measured, unit) };
        self.failures.extend(outcome.err());
        self.held.insert((table, name.to_owned()));
    }

    fn close(mut self) -> Result<(), Failure> {
        for table in TABLES {
            for name in self.budget.names(table).into_iter().filter(|name| !self.held.contains(&(table, name.clone())))
            {
                if self.fix {
                    self.budget.remove(table, &name);
                } else {
                    self.failures.push(format!("{table}.{name}: in {}, but not in the program", self.file));
                }
            }
        }
        if self.fix {
            self.budget.write()?;
        }
        if self.failures.is_empty() { Ok(()) } else { Err(self.failures.join("\n  ")) }
    }
}

/// The row of all crates that are not ours.
const OTHERS: &str = "others";
/// What no symbol covers: alignment, and text that was merged.
const NAMELESS: &str = "nameless";

fn sizes(program: &Program, held: &mut Ledger) -> Result<(), Failure> {
    let mut owners: BTreeMap<&str, Sizes> = BTreeMap::new();
    let mut covered = Sizes::default();
    for symbol in program.symbols.values() {
        owners.entry(&symbol.owner).or_default().add(symbol.size, symbol.place);
        covered.add(symbol.size, symbol.place);
    }
    let nameless = program.sections.checked_sub(covered).ok_or("symbols overlap: they are larger than the sections")?;
    owners.insert(NAMELESS, nameless);
    let mut rows: Vec<_> = owners.iter().collect();
    rows.sort_by_key(|(_, sizes)| std::cmp::Reverse(sizes.flash + sizes.memory));
    println!("{:<28} {:>9} {:>9}", "crate", "flash", "memory");
    for (owner, sizes) in rows {
        println!("{owner:<28} {:>9} {:>9}", sizes.flash, sizes.memory);
    }
    println!("{:<28} {:>9} {:>9}", "all", program.sections.flash, program.sections.memory);
    for (row, sizes) in rows_held(&owners) {
        held.hold("flash", row, sizes.flash, "bytes of flash");
        held.hold("memory", row, sizes.memory, "bytes of static memory");
    }
    Ok(())
}

/// The rows that are held: ours one by one, all other crates together.
fn rows_held<'a>(owners: &BTreeMap<&'a str, Sizes>) -> BTreeMap<&'a str, Sizes> {
    let mut rows: BTreeMap<&str, Sizes> = BTreeMap::new();
    for (owner, sizes) in owners {
        let own = owner.starts_with("stampfly_") || [CONSTANTS, C, NAMELESS].contains(owner);
        let row = rows.entry(if own { owner } else { OTHERS }).or_default();
        *row = Sizes { flash: row.flash + sizes.flash, memory: row.memory + sizes.memory };
    }
    rows
}

fn stacks(ground: u64, program: &Program, held: &mut Ledger) -> Result<(), Failure> {
    let mut stack = Stack::new(program, POINTERS, ROM)?;
    let mut elsewhere = BTreeSet::new();
    for (task, parts, core) in TASKS {
        let root = program.functions(parts).map(|(address, _)| stack.below(address)).max_by_key(|depth| depth.bytes);
        let depth = root.ok_or_else(|| format!("the program has no task {parts:?}"))?;
        elsewhere.extend(depth.elsewhere);
        // A path is a Rust name; what the radio's libraries do below is not ours to bound.
        let (ours, radios): (Vec<_>, Vec<_>) = depth.unbounded.iter().partition(|name| name.contains("::"));
        if !radios.is_empty() {
            println!("{task}: without a bound in the radio's libraries: {radios:?}");
        }
        if !ours.is_empty() {
            held.failures.push(format!("{task}: without a bound: {ours:?}"));
        }
        held.hold("stack", task, depth.bytes, "bytes of stack");
        for (name, frame) in depth.way.iter().filter(|(_, frame)| *frame >= 256) {
            println!("    {frame:>6}  {:.100}", name);
        }
        let available = match core {
            Core::Flight => s3_memory::sizes::FLIGHT_STACK as u64,
            Core::Ground => ground,
            Core::OnTopOfAssembly => continue,
        };
        let share = depth.bytes as f64 / available as f64;
        let said = format!("{task} may take {:.0} % of {available} bytes of stack", share * 100.0);
        println!("{said}");
        if share > SHARE {
            held.failures.push(format!("{said}; {:.0} % is the most", SHARE * 100.0));
        }
    }
    println!("{ROM} bytes each are allowed for what is in ROM: {elsewhere:?}");
    Ok(())
}

/// The stack that a task runs on.
enum Core {
    Flight,
    Ground,
    /// The first core's, above what assembled the vehicle, which never returns. Part of that bound.
    OnTopOfAssembly,
}

/// A task: name, parts of the name of the function that polls it, stack.
type Task = (&'static str, &'static [&'static str], Core);

const TASKS: [Task; 8] = [
    ("flight", &["TaskStorage<stampfly_esp32s3::flight", ">::poll"], Core::Flight),
    ("sensors", &["TaskStorage<stampfly_esp32s3::sensors", ">::poll"], Core::OnTopOfAssembly),
    ("people", &["TaskStorage<stampfly_esp32s3::people", ">::poll"], Core::OnTopOfAssembly),
    ("radio", &["TaskStorage<stampfly_esp32s3::radio", ">::poll"], Core::OnTopOfAssembly),
    ("console", &["TaskStorage<stampfly_esp32s3::console", ">::poll"], Core::OnTopOfAssembly),
    ("memory", &["TaskStorage<stampfly_esp32s3::memory", ">::poll"], Core::OnTopOfAssembly),
    // One after the other. Each holds a whole vehicle; the second runs the tasks when it has done so.
    ("self_test", &["stampfly_board::golden::self_test"], Core::Ground),
    ("assembly", &["stampfly_esp32s3::start"], Core::Ground),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn our_crates_have_a_row_each_and_all_others_share_one() {
        let sizes = |flash| Sizes { flash, memory: 1 };
        let owners = [("stampfly_eskf", 5), ("core", 6), ("libm", 7), ("C", 8), ("constants", 9)];
        let rows = rows_held(&owners.map(|(owner, flash)| (owner, sizes(flash))).into());
        assert_eq!(rows["others"], Sizes { flash: 13, memory: 2 });
        assert_eq!(rows.keys().collect::<Vec<_>>(), [&"C", &"constants", &"others", &"stampfly_eskf"]);
    }
}
