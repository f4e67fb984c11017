//! `cache`: what a pass of the flight band waits for the flash, on a model of the ESP32-S3's caches.
//!
//! Code that is not in the cache is fetched from flash, a line at a time, and the core waits. A pass runs through more code than the cache
//! holds, so that is most of its time; `cargo xtask qemu`, which counts instructions, does not see it. Here the golden flight is played
//! once more, with a plug-in of QEMU (`stampfly-board/qemu/cache`) that follows every instruction through the caches. Its counts are
//! exact for the model. Each runnable's longest activation is held to its budget, which the analysis of the schedule takes for granted.
//!
//! That is the flight stack alone. What the core does besides, a second program shows: the firmware's flight task with both drivers of
//! the SPI and embassy's executor, over a script of what the chips answered ([`core1`]). There, a pass is everything from one inertial
//! sample to the next, and to its time is added for how long the core itself waits for short transfers.
//!
//! The model is: caches as esp-hal sets them up, both of them this core's alone. Not in it are the HAL's registers, the entry of interrupts
//! and what the other core, which has the radio, takes of the bus to the flash.

use super::core1;
use super::qemu::{CLOCK, Count, MACHINES, Machine, PACKAGE, counts, inside, program};
use crate::arguments::Arguments;
use crate::elf::Names;
use crate::machine::{EMULATED_OTHERS, provide};
use crate::ratchet::Budget;
use crate::repository::{Failure, Repository, capture, run as run_program};
use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

const PLUGIN: &str = "stampfly-board/qemu/cache";
const BUDGET: &str = "stampfly-board/qemu/cache.toml";
/// Which code is kept in RAM.
const IN_RAM: &str = "stampfly-board/esp32s3/in_ram.txt";
/// What the emulator is given in `.cargo/config.toml`.
const CONFIG: &str = ".cargo/config.toml";
const SECONDS: &str = "300";
/// Clocks of the flash to read a line of 32 bytes over four wires: command 8, address 6, mode and waiting 6 (Winbond W25Q64JV, "Fast
/// Read Quad I/O (EBh)"), data 64.
const CLOCKS_A_LINE: f64 = 84.0;
/// Clock of the flash, MHz: what the runner of `stampfly-board/esp32s3` sets.
const FLASH_CLOCK: f64 = 80.0;
/// Functions shown with what they miss.
const SHOWN: usize = 12;
/// What all that the flight core does in a period with motors that may turn may take, us: the mean, and the most, half of the period.
const BAR: [f64; 2] = [500.0, 1_250.0];

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    provide(repository, &[&EMULATED_OTHERS])?;
    let plugin = plugin(repository)?;
    let in_ram = in_ram(repository)?;
    let in_ram: Vec<&str> = in_ram.iter().map(String::as_str).collect();
    let (script, here) = core1::record(repository)?;
    let mut budget = Budget::read(repository, BUDGET)?;
    let mut failures = Vec::new();
    // Where compilers inline a function differs.
    let mut unmatched = in_ram.clone();
    // An ARM core's code is another one's again; these two stand for the S3's.
    for machine in MACHINES.iter().filter(|machine| machine.stands_for_s3) {
        let mut figures = Vec::new();
        let mut examine = |what: &str, program: &Path| -> Result<(Found, String), Failure> {
            let names = Names::read(program)?;
            let ram = names.fitting(&in_ram);
            unmatched.retain(|pattern| names.fitting(&[pattern]).is_empty());
            println!(
                "{}, {what}: {} bytes of code in RAM",
                machine.name,
                ram.iter().map(|it| it.end - it.start).sum::<u64>()
            );
            let (found, said) = follow(repository, machine, &plugin, program, &names, &ram)?;
            let found = Found::read(&found)?;
            found.print(machine, &names);
            Ok((found, said))
        };
        let (found, said) = examine("flight stack", &program(repository, machine)?)?;
        failures.extend(found.beyond_budget(machine, &counts(&said)?)?);
        figures.extend(found.figures("", "an armed pass"));
        let (found, said) = examine("flight core", &core1::program(repository, machine, &script)?)?;
        if core1::bits(&said) != core1::bits(&here) {
            failures.push(format!(
                "{}: the flight core does something else than on this PC:\n{said}\n{here}",
                machine.name
            ));
        }
        let with_core = found.figures("core_", "an armed period of the flight core");
        failures.extend(beyond_bar(machine, &with_core, core1::waits(&here)?));
        figures.extend(with_core);
        for (figure, measured, unit) in figures {
            if arguments.fix {
                budget.set(&[machine.name, &figure], measured)?;
            } else if let Err(failure) = budget.hold(&[machine.name, &figure], measured, &unit) {
                failures.push(failure);
            }
        }
    }
    failures.extend(unmatched.iter().map(|pattern| format!("{IN_RAM}: no machine has a function {pattern}")));
    if arguments.fix && failures.is_empty() {
        return budget.write();
    }
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n  ")) }
}

/// Patterns of the functions that the firmware keeps in RAM.
pub fn in_ram(repository: &Repository) -> Result<Vec<String>, Failure> {
    let list = fs::read_to_string(repository.root.join(IN_RAM)).map_err(|e| format!("{IN_RAM}: {e}"))?;
    Ok(list.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned).collect())
}

/// Is all that the flight core does within what it may never take? Its longest waiting need not be in its longest period.
fn beyond_bar(machine: &Machine, figures: &[Figure], waits: [f64; 2]) -> Vec<Failure> {
    let times = figures.iter().filter(|(name, ..)| name.contains("_us_")).map(|(_, time, _)| time);
    let mut failures = Vec::new();
    for (((time, waits), bar), what) in times.zip(waits).zip(BAR).zip(["mean", "most"]) {
        println!("{}: flight core, {what}: {time:.0} us, and {waits:.0} us of waiting for transfers", machine.name);
        if time + waits > bar {
            failures.push(format!(
                "{}: the flight core takes {:.0} us; {bar} us is the bar",
                machine.name,
                time + waits
            ));
        }
    }
    failures
}

/// Checks and builds the plug-in.
fn plugin(repository: &Repository) -> Result<PathBuf, Failure> {
    let target = repository.target("qemu-cache");
    let cargo = |words: &[&str]| {
        let mut cargo = repository.cargo();
        cargo.current_dir(repository.root.join(PLUGIN)).args(words);
        cargo
    };
    run_program(&mut cargo(&["fmt", "--check"]))?;
    let options = ["--quiet", "--release", "--locked", "--target-dir"];
    run_program(cargo(&["clippy"]).args(options).arg(&target).args(["--all-targets", "--", "-D", "warnings"]))?;
    run_program(cargo(&["test"]).args(options).arg(&target))?;
    run_program(cargo(&["build"]).args(options).arg(&target))?;
    Ok(target.join("release/libstampfly_qemu_cache.so"))
}

/// Plays the flight with the plug-in. Returns what that writes, and what the program says.
fn follow(
    repository: &Repository,
    machine: &Machine,
    plugin: &Path,
    program: &Path,
    names: &Names,
    ram: &[Range<u64>],
) -> Result<(String, String), Failure> {
    let name = program.file_name().unwrap_or_default().to_string_lossy().replace('-', "_");
    let out = repository.target("qemu-cache").join(format!("{}_{name}.txt", machine.name));
    // Of an earlier run.
    let _ = fs::remove_file(&out);
    let mark = |mark: &str| names.address(&format!("{name}::marks::{mark}"));
    let mut words = format!("{},out={}", plugin.display(), out.display());
    for (word, at) in [
        ("begins", "pass_begins"),
        ("ground", "pass_ends_on_ground"),
        ("armed", "pass_ends_armed"),
        ("aside", "aside_begins"),
        ("back", "aside_ends"),
    ] {
        words += &format!(",{word}={:x}", mark(at)?);
    }
    // The flight core counts no activations.
    if let Ok(counts) = mark("counts") {
        words += &format!(",counts={counts:x}");
    }
    for (word, section) in [("code", ".text"), ("constants", ".rodata")] {
        let range = names.section(section)?;
        words += &format!(",{word}={:x}:{:x}", range.start, range.end);
    }
    for range in ram {
        words += &format!(",ram={:x}:{:x}", range.start, range.end);
    }
    let runner = runner(repository, machine)?;
    let (emulator, options) = runner.split_first().ok_or("no emulator")?;
    let mut limited = inside(repository, repository.command("timeout"));
    limited.args([SECONDS, emulator, "-plugin", &words]).args(options).arg(program);
    let (said, _) = capture(&mut limited)?;
    let found = fs::read_to_string(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    Ok((found, said))
}

/// How the machine is run.
fn runner(repository: &Repository, machine: &Machine) -> Result<Vec<String>, Failure> {
    let path = repository.root.join(PACKAGE).join(CONFIG);
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let config: toml_edit::DocumentMut = text.parse().map_err(|e| format!("{}: {e}", path.display()))?;
    let words = config["target"][machine.target]["runner"].as_array().ok_or("no runner")?;
    Ok(words.iter().filter_map(|word| word.as_str()).map(str::to_owned).collect())
}

/// What a pass or an activation takes.
struct Cost {
    instructions: f64,
    /// Lines fetched, of code and of constants.
    lines: f64,
}

impl Cost {
    /// Microseconds, at an instruction a clock.
    fn time(&self) -> f64 {
        self.instructions / CLOCK + self.lines * CLOCKS_A_LINE / FLASH_CLOCK
    }
}

/// Name, figure and unit of what is held.
type Figure = (String, f64, String);

/// What the plug-in has found.
struct Found {
    /// Passes in which the motors may turn.
    passes: Vec<Cost>,
    /// The longest activation of each runnable, us, by its place in the schedule.
    activations: BTreeMap<usize, f64>,
    /// Misses in those passes, by the address of the line.
    lines: BTreeMap<u64, f64>,
}

impl Found {
    fn read(said: &str) -> Result<Self, Failure> {
        let mut found = Self { passes: Vec::new(), activations: BTreeMap::new(), lines: BTreeMap::new() };
        for line in said.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            let number = |text: &str| text.parse::<f64>().map_err(|e| format!("{line}: {e}"));
            let cost = |instructions: &str, code: &str, constants: &str| -> Result<Cost, Failure> {
                Ok(Cost { instructions: number(instructions)?, lines: number(code)? + number(constants)? })
            };
            match words[..] {
                ["pass", "1", instructions, code, constants] => found.passes.push(cost(instructions, code, constants)?),
                ["pass", "0", ..] => {}
                ["activation", place, instructions, code, constants] => {
                    let place = place.parse().map_err(|e| format!("{line}: {e}"))?;
                    let most: &mut f64 = found.activations.entry(place).or_default();
                    *most = most.max(cost(instructions, code, constants)?.time());
                }
                ["line", address, misses] => {
                    let address = u64::from_str_radix(address, 16).map_err(|e| format!("{line}: {e}"))?;
                    found.lines.insert(address, number(misses)?);
                }
                _ => return Err(format!("not understood: {line}")),
            }
        }
        // Nothing followed would be within every budget.
        let plausible = found.passes.len() > 100 && found.passes.iter().all(|pass| pass.instructions > 1000.0);
        if plausible { Ok(found) } else { Err(format!("{} passes of a whole flight", found.passes.len())) }
    }

    /// Compares each runnable's longest activation with its budget, which the analysis of the schedule takes for granted. `counted` is in the
    /// schedule's order.
    fn beyond_budget(&self, machine: &Machine, counted: &[Count]) -> Result<Vec<Failure>, Failure> {
        let runnables: Vec<(&str, f64)> =
            counted.iter().filter_map(|count| Some((count.name.as_str(), count.budget?))).collect();
        // Before the flight the program watches an activation of nobody, to know what watching takes.
        let activations = self.activations.range(..runnables.len());
        if activations.clone().count() != runnables.len() {
            return Err(format!("{} of {} runnables ran", activations.count(), runnables.len()));
        }
        let mut failures = Vec::new();
        println!("{}: longest activation and budget, us", machine.name);
        for ((name, budget), longest) in runnables.into_iter().zip(activations.map(|(_, longest)| longest)) {
            println!("{name:<14} {longest:6.0} {budget:6.0}");
            if *longest > budget {
                failures.push(format!("{}: {name} may take {longest:.0} us of its {budget}", machine.name));
            }
        }
        Ok(failures)
    }

    /// What is held of these passes; names begin so.
    fn figures(&self, name: &str, of: &str) -> [Figure; 4] {
        let mean = |of: fn(&Cost) -> f64| self.passes.iter().map(of).sum::<f64>() / self.passes.len() as f64;
        let most = |of: fn(&Cost) -> f64| self.passes.iter().map(of).fold(0.0, f64::max);
        [
            ("lines_mean", mean(|cost| cost.lines), "lines fetched in"),
            ("lines_most", most(|cost| cost.lines), "lines fetched in"),
            ("us_mean", mean(Cost::time), "us"),
            ("us_most", most(Cost::time), "us"),
        ]
        .map(|(figure, measured, unit)| (format!("{name}{figure}"), measured, format!("{unit} {of}")))
    }

    fn print(&self, machine: &Machine, names: &Names) {
        let mut functions: BTreeMap<&str, f64> = BTreeMap::new();
        for (line, misses) in &self.lines {
            *functions.entry(names.of(*line)).or_default() += misses;
        }
        let mut functions: Vec<_> = functions.into_iter().collect();
        functions.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        println!("{}: lines fetched in a mean armed pass, of the functions that miss most", machine.name);
        for (name, misses) in functions.iter().take(SHOWN) {
            println!("{:8.1}  {name}", misses / self.passes.len() as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(passes: usize) -> String {
        "pass 0 9000 9 9\n".to_owned()
            + &"pass 1 2400 10 0\n".repeat(passes)
            + "pass 1 4800 90 10\nactivation 0 240 0 0\nactivation 1 240 0 0\nactivation 0 2400 90 10\nline 80001000 7\n"
    }

    #[test]
    fn armed_passes_are_what_is_held() {
        let found = Found::read(&said(199)).expect("understood");
        let [(_, mean, _), (_, most, _), (_, _, _), (_, longest, _)] = found.figures("", "a pass");
        assert_eq!((mean, most), (10.45, 100.0));
        assert_eq!(longest, 20.0 + 105.0);
        assert_eq!(found.lines, BTreeMap::from([(0x8000_1000, 7.0)]));
    }

    #[test]
    fn an_activation_has_its_budget() {
        let found = Found::read(&said(199)).expect("understood");
        let count = |name: &str, budget| Count { name: name.to_owned(), budget, mean: 1.0, most: 1.0 };
        // 10 us of instructions and 105 of lines.
        let enough = [count("a", Some(115.1)), count("b", Some(1.1)), count("chain", None)];
        assert_eq!(found.beyond_budget(&MACHINES[1], &enough), Ok(vec![]));
        let short = [count("a", Some(114.0)), count("b", Some(1.1))];
        assert_eq!(found.beyond_budget(&MACHINES[1], &short).expect("all ran").len(), 1);
        // A third one never ran.
        let three = [count("a", Some(200.0)), count("b", Some(9.0)), count("c", Some(9.0))];
        assert!(found.beyond_budget(&MACHINES[1], &three).is_err());
    }

    #[test]
    fn the_flight_core_has_bars() {
        let figures = Found::read(&said(199)).expect("understood").figures("core_", "a period");
        assert!(beyond_bar(&MACHINES[1], &figures, [478.0, 1_125.0]).is_empty());
        assert_eq!(beyond_bar(&MACHINES[1], &figures, [480.0, 1_125.0]).len(), 1);
        assert_eq!(beyond_bar(&MACHINES[1], &figures, [0.0, 1_126.0]).len(), 1);
    }

    #[test]
    fn a_flight_that_was_not_followed_is_no_result() {
        assert!(Found::read("").is_err());
        assert!(Found::read(&said(50)).is_err());
        assert!(Found::read(&said(199).replace("2400", "0")).is_err());
        assert!(Found::read(&(said(199) + "what?\n")).is_err());
    }
}
