//! `qemu`: the golden flight on three emulated cores. The same bits as on this PC? Within the committed instructions, and
//! within the budgets of the activation table?
//!
//! The counts are exact and the same on every host. Instructions are not cycles: the comparison with a budget takes one for
//! one, and asks for a margin of two because of it. The package `stampfly-board/qemu` is outside the workspace, so its
//! format and its warnings are looked at here, too.

use crate::arguments::Arguments;
use crate::machine::{COMPILER, EMULATED_ARM, EMULATED_OTHERS, LINKER, XTENSA as XTENSA_BACK_END, provide};
use crate::ratchet::Budget;
use crate::repository::{Failure, Repository, add_targets, capture, run as run_program};
use crate::steps::no_std::debian_cargo;
use std::fmt::Write;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

/// The program.
pub const PACKAGE: &str = "stampfly-board/qemu";
/// The firmware's manifest.
const FIRMWARE: &str = "stampfly-board/esp32s3/Cargo.toml";
const BUDGET: &str = "stampfly-board/qemu/budget.toml";
/// The document the table is written into, and where.
const DOCUMENT: &str = "docs/reference/figures.md";
const BEGIN: &str = "<!-- instructions: cargo xtask qemu --fix -->\n";
const END: &str = "<!-- end of instructions -->";
/// A run takes some seconds. One that faulted would never end.
const SECONDS: &str = "120";
/// Clock of the ESP32-S3, MHz.
pub const CLOCK: f64 = 240.0;
/// An activation may use this part of its budget, because instructions are not cycles.
const SHARE: f64 = 0.5;
/// The flight band.
const CHAIN: &str = "chain";
/// What it may never take, in instructions, on a machine of this name: the mean, and the most.
const BAR: (&str, f64, f64) = ("Cortex-M4F", 13_600.0, 23_200.0);

/// The program that counts what a secured frame costs, and what the lines about it begin with.
const SECURED: (&str, &str) = ("stampfly-secured", "secured frame, ");
/// What none of them may ever take: at 50 frames a second each way, 2 % of a core of [`CLOCK`].
const SECURED_BAR: f64 = 48_000.0;

/// An emulated machine.
pub struct Machine {
    /// As in the budget and in the table.
    pub name: &'static str,
    /// As in the package's `.cargo/config.toml`.
    pub target: &'static str,
    /// Does its code stand for the ESP32-S3's? Then it is optimised as the firmware, and `cargo xtask cache` follows it.
    pub stands_for_s3: bool,
}

/// The one whose code is most like the ESP32-S3's.
pub const XTENSA: Machine = Machine { name: "Xtensa", target: "xtensa-none-elf", stands_for_s3: true };
/// All of them.
pub const MACHINES: [Machine; 3] = [
    Machine { name: "Cortex-M4F", target: "thumbv7em-none-eabihf", stands_for_s3: false },
    Machine { name: "RV32IMAFC", target: "riscv32imafc-unknown-none-elf", stands_for_s3: true },
    XTENSA,
];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let fix = arguments.fix;
    provide(repository, &[&EMULATED_ARM, &EMULATED_OTHERS])?;
    run_program(inside(repository, repository.cargo()).args(["fmt", "--check"]))?;
    let mut clippy = inside(repository, repository.cargo());
    clippy.args(["clippy", "--quiet", "--locked", "--target-dir"]).arg(repository.target("qemu"));
    run_program(clippy.args(["--", "-D", "warnings"]))?;

    let mut host = inside(repository, repository.cargo());
    host.args(["run", "--quiet", "--locked", "--target-dir"]).arg(repository.target("qemu"));
    let (host, _) = capture(&mut host)?;
    let expected = bits(&host);
    if expected.is_empty() {
        return Err(format!("this PC says nothing about bits:\n{host}"));
    }
    let budget = Budget::read(repository, BUDGET)?;
    let mut all = Vec::new();
    for machine in &MACHINES {
        let said = emulate(repository, machine, "stampfly-qemu")?;
        let found = bits(&said);
        if found != expected {
            return Err(format!("{}: other bits than on this PC:\n{found:#?}\n{expected:#?}", machine.name));
        }
        println!("{}: {}", machine.name, found.join("; "));
        let counts = counts(&said)?;
        hold(&budget, machine, &counts)?;
        hold_secured(&budget, machine, &emulate(repository, machine, SECURED.0)?)?;
        all.push(counts);
    }
    let table = table(&all)?;
    println!("\n{table}");
    if fix {
        repository.fill(DOCUMENT, BEGIN, END, &format!("\n{table}\n"))?;
    } else if !agree(&repository.between(DOCUMENT, BEGIN, END)?, &table, budget.tolerance()?) {
        return Err(format!("the table in {DOCUMENT} is out of date; run `cargo xtask qemu --fix`"));
    }
    all.iter().flatten().try_for_each(within_budget)
}

/// Builds the program for a machine.
pub fn program(repository: &Repository, machine: &Machine) -> Result<PathBuf, Failure> {
    let (mut cargo, options) = toolchain(repository, machine)?;
    run_program(cargo.arg("build").args(&options))?;
    Ok(repository.target("qemu").join(machine.target).join("release/stampfly-qemu"))
}

/// Builds the programs for a machine, runs one there and returns what it says.
fn emulate(repository: &Repository, machine: &Machine, name: &str) -> Result<String, Failure> {
    // Apart from running it, which has little time.
    program(repository, machine)?;
    let (cargo, options) = toolchain(repository, machine)?;
    let mut limited = inside(repository, repository.command("timeout"));
    limited.envs(cargo.get_envs().filter_map(|(key, value)| Some((key, value?))));
    limited.arg(SECONDS).arg(cargo.get_program()).arg("run").args(&options).args(["--bin", name]);
    Ok(capture(&mut limited)?.0)
}

/// The cargo for a machine, and what to tell it: rustup's where it has the target, else Debian's.
pub fn toolchain(repository: &Repository, machine: &Machine) -> Result<(Command, Vec<String>), Failure> {
    let target_folder = repository.target("qemu").display().to_string();
    let mut options: Vec<String> =
        ["--quiet", "--release", "--locked", "--target-dir", &target_folder].map(str::to_owned).into();
    let mut add = |more: &[&str]| options.extend(more.iter().map(|option| (*option).to_owned()));
    if machine.stands_for_s3 {
        add(&["--config", &format!("profile.release.opt-level={}", optimisation(repository)?)]);
    }
    if machine.target == XTENSA.target {
        provide(repository, &[&COMPILER, &LINKER, &XTENSA_BACK_END])?;
        let mut cargo = inside(repository, debian_cargo(repository));
        cargo.env("RUSTC", repository.root.join(PACKAGE).join("xtensa/rustc"));
        // The linker makes one module of everything, and debug information is more than the back end can take.
        add(&["--config", "profile.release.lto=false", "--config", "profile.release.debug=false"]);
        add(&["-Zbuild-std=core", "-Zbuild-std-features=compiler-builtins-mem", "-Zjson-target-spec"]);
        add(&["--target", "xtensa/xtensa-none-elf.json"]);
        return Ok((cargo, options));
    }
    add(&["--target", machine.target]);
    if add_targets(repository, &[machine.target]).is_ok() {
        return Ok((inside(repository, repository.cargo()), options));
    }
    eprintln!("no rustup target {}: using Debian's compiler instead", machine.target);
    provide(repository, &[&COMPILER, &LINKER])?;
    add(&["-Zbuild-std=core", "--config", &format!("target.{}.linker=\"ld.lld-22\"", machine.target)]);
    add(&[
        "--config",
        &format!("target.{}.rustflags=[\"-Clinker-flavor=ld.lld\",\"-Csymbol-mangling-version=v0\"]", machine.target),
    ]);
    Ok((inside(repository, debian_cargo(repository)), options))
}

/// How far the firmware is optimised: what stands for it is, too.
fn optimisation(repository: &Repository) -> Result<i64, Failure> {
    let path = repository.root.join(FIRMWARE);
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let manifest: toml_edit::DocumentMut = text.parse().map_err(|e| format!("{}: {e}", path.display()))?;
    manifest["profile"]["release"]["opt-level"].as_integer().ok_or(format!("{}: no opt-level", path.display()))
}

/// Runs in the package's folder: its own `.cargo/config.toml` says how it is run, and flags meant for the host would
/// replace that.
pub fn inside(repository: &Repository, mut command: Command) -> Command {
    command.current_dir(repository.root.join(PACKAGE)).env_remove("RUSTFLAGS");
    command
}

/// What the program says that must be the same everywhere.
fn bits(said: &str) -> Vec<&str> {
    let same = ["duties deviate by ", "published: ", "recorded: "];
    said.lines().filter(|line| same.iter().any(|start| line.starts_with(start))).collect()
}

/// What something took on a machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Count {
    pub name: String,
    /// Of its activation, us; `None` when it is no runnable.
    pub budget: Option<f64>,
    /// Instructions.
    pub mean: f64,
    pub most: f64,
}

impl Count {
    /// From a line `NAME[, budget N us]: mean N most N count N`.
    fn read(line: &str) -> Option<Self> {
        let (name, rest) = line.split_once(": ")?;
        let words: Vec<&str> = rest.split(' ').collect();
        let ["mean", mean, "most", most, "count", _] = words[..] else { return None };
        let (name, budget) = match name.split_once(", budget ") {
            Some((name, budget)) => (name, Some(budget.strip_suffix(" us")?.parse().ok()?)),
            None => (name, None),
        };
        Some(Self { name: name.to_owned(), budget, mean: mean.parse().ok()?, most: most.parse().ok()? })
    }
}

/// Everything that was counted.
pub fn counts(said: &str) -> Result<Vec<Count>, Failure> {
    let counts: Vec<Count> = said.lines().filter_map(Count::read).collect();
    // Nothing counted would be within every budget.
    let complete = counts.iter().any(|count| count.name == CHAIN) && counts.iter().any(|count| count.budget.is_some());
    if complete && counts.iter().all(|count| count.most > 0.0) {
        Ok(counts)
    } else {
        Err(format!("no counts:\n{said}"))
    }
}

/// Compares the chain with the committed figures of a machine.
fn hold(budget: &Budget, machine: &Machine, counts: &[Count]) -> Result<(), Failure> {
    for chain in counts.iter().filter(|count| count.name == CHAIN) {
        within_bar(machine.name, chain)?;
        for (what, measured) in [("mean", chain.mean), ("most", chain.most)] {
            budget.hold(&[machine.name, what], measured, "instructions from sample to motors")?;
        }
    }
    Ok(())
}

/// Compares what a secured frame takes with the committed figures of a machine, and with what it may never take.
fn hold_secured(budget: &Budget, machine: &Machine, said: &str) -> Result<(), Failure> {
    for Count { name, mean, most, .. } in secured(said)? {
        if most > SECURED_BAR {
            return Err(format!("{}: {name}: {most} instructions; {SECURED_BAR} is the bar", machine.name));
        }
        let what = name.strip_prefix(SECURED.1).unwrap_or(&name);
        budget.hold(&[machine.name, what], mean, "instructions of a secured frame")?;
    }
    Ok(())
}

/// What was counted of secured frames: sealed, opened, refused.
fn secured(said: &str) -> Result<Vec<Count>, Failure> {
    let counts = said.lines().filter_map(Count::read).filter(|count| count.name.starts_with(SECURED.1));
    let counts: Vec<Count> = counts.collect();
    if counts.len() == 3 && counts.iter().all(|count| count.mean > 0.0) {
        Ok(counts)
    } else {
        Err(format!("no counts of secured frames:\n{said}"))
    }
}

/// Is the chain within what it may never exceed?
fn within_bar(machine: &str, chain: &Count) -> Result<(), Failure> {
    let (barred, mean, most) = BAR;
    if machine != barred || (chain.mean <= mean && chain.most <= most) {
        return Ok(());
    }
    let Count { mean: was, most: peak, .. } = chain;
    Err(format!("{machine}: the chain takes {was} instructions, at most {peak}; {mean} and {most} are its bars"))
}

/// Does the most a runnable ever took fit into its budget, with the margin?
fn within_budget(count: &Count) -> Result<(), Failure> {
    let Count { name, budget: Some(budget), most, .. } = count else { return Ok(()) };
    let took = most / CLOCK;
    if took <= budget * SHARE {
        return Ok(());
    }
    Err(format!("{name}: {most} instructions are {took:.0} us at {CLOCK} MHz, more than {SHARE} of its {budget} us"))
}

/// One row for everything that was counted, two columns a machine.
fn table(all: &[Vec<Count>]) -> Result<String, Failure> {
    let mut text = String::from("| instructions of an activation | budget |");
    for machine in &MACHINES {
        let _ = write!(text, " {}, mean | most |", machine.name);
    }
    let _ = write!(text, "\n|---|---|{}", "---|---|".repeat(MACHINES.len()));
    let Some((first, others)) = all.split_first() else { return Ok(text) };
    if let Some(other) = others.iter().find(|other| other.len() != first.len()) {
        return Err(format!("machines count different things: {first:?}, {other:?}"));
    }
    for Count { name, budget, .. } in first {
        let budget = budget.map_or_else(String::new, |budget| format!("{budget} us"));
        let _ = write!(text, "\n| {name} | {budget} |");
        for counts in all {
            let count = counts.iter().find(|count| count.name == *name);
            let count = count.ok_or_else(|| format!("not every machine counts {name}: {counts:?}"))?;
            let _ = write!(text, " {} | {} |", count.mean, count.most);
        }
    }
    Ok(text + "\n")
}

/// Do two tables say the same, but for what one compiler's counts differ from another's?
fn agree(written: &str, counted: &str, tolerance: f64) -> bool {
    let cells = |text: &str| text.trim().split(['|', '\n']).map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let (written, counted) = (cells(written), cells(counted));
    let near = |(a, b): (&String, &String)| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= tolerance * b,
        _ => a == b,
    };
    written.len() == counted.len() && written.iter().zip(&counted).all(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAID: &str = "duties deviate by 0\npublished: 3 messages, hash 00ff\nstack: 5 bytes\n\
                        control, budget 100 us: mean 5 most 9 count 2\nchain: mean 7 most 12001 count 2\n";

    #[test]
    fn reads_what_the_program_says() {
        assert_eq!(bits(SAID), ["duties deviate by 0", "published: 3 messages, hash 00ff"]);
        let counts = counts(SAID).expect("counts");
        let control = Count { name: "control".to_owned(), budget: Some(100.0), mean: 5.0, most: 9.0 };
        assert_eq!((&counts[0], counts[1].name.as_str(), counts.len()), (&control, "chain", 2));
        assert!(super::counts("chain: mean 0 most 0 count 0").is_err());
        assert!(super::counts("panicked").is_err());
    }

    #[test]
    fn asks_for_a_margin_of_two() {
        let count = |most| Count { name: String::new(), budget: Some(100.0), mean: 0.0, most };
        assert!(within_budget(&count(12_000.0)).is_ok());
        assert!(within_budget(&count(12_001.0)).is_err());
    }

    #[test]
    fn the_chain_has_bars_on_one_machine() {
        assert!(MACHINES.iter().any(|machine| machine.name == BAR.0));
        let chain = |mean, most| Count { name: CHAIN.to_owned(), budget: None, mean, most };
        assert!(within_bar("Cortex-M4F", &chain(13_600.0, 23_200.0)).is_ok());
        assert!(within_bar("Cortex-M4F", &chain(13_601.0, 23_200.0)).is_err());
        assert!(within_bar("Cortex-M4F", &chain(13_600.0, 23_201.0)).is_err());
        assert!(within_bar("Xtensa", &chain(30_000.0, 56_000.0)).is_ok());
    }

    #[test]
    fn secured_frames_are_counted_or_it_is_said_that_they_are_not() {
        let said = "secured frame, sealed: mean 5 most 9 count 2\nsecured frame, opened: mean 6 most 9 count 2\n";
        let third = "secured frame, refused: mean 4 most 4 count 2\n";
        let counts = secured(&format!("{said}{third}")).expect("counts");
        assert_eq!((counts[2].name.as_str(), counts[2].mean), ("secured frame, refused", 4.0));
        assert!(secured(said).is_err() && secured("").is_err());
        assert!(secured(&format!("{said}{}", third.replace('4', "0"))).is_err());
    }

    #[test]
    fn the_table_has_a_column_pair_a_machine() {
        let counts = counts(SAID).expect("counts");
        // In whatever order a machine says it.
        let reversed: Vec<_> = counts.iter().rev().cloned().collect();
        let table = table(&[counts.clone(), reversed, counts.clone()]).expect("complete");
        assert!(table.contains("| control | 100 us | 5 | 9 | 5 | 9 | 5 | 9 |"), "{table}");
        assert!(super::table(&[counts.clone(), counts[..1].to_vec()]).is_err());
        let other = Count { name: "other".to_owned(), ..counts[0].clone() };
        assert!(super::table(&[counts.clone(), vec![other, counts[1].clone()]]).is_err());
    }

    #[test]
    fn a_table_is_out_of_date_when_a_count_is() {
        let table = table(&[counts(SAID).expect("counts")]).expect("complete");
        assert!(agree(&format!("\n{table}\n"), &table, 0.03));
        assert!(agree(&table.replace("12001", "12300"), &table, 0.03));
        assert!(!agree(&table.replace("12001", "12400"), &table, 0.03));
        assert!(!agree(&table.replace("control", "mode"), &table, 0.03));
        assert!(!agree("", &table, 0.03));
    }
}
