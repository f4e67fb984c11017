//! `panic-calls`: does flight code, as it stands in the linked firmware, call anything that panics?
//!
//! `panic-proof` links the flight code alone; this looks at what the firmware made of it, drivers and their waiting
//! included, in the ESP32-C6 program. What the manufacturer's library does inside one of our generic functions is that
//! function's in the machine code: such calls are listed here, each with its reason, and a row that is no longer needed
//! fails like a call that is not listed.

use super::esp32;
use crate::Failure;
use crate::elf::{Program, Symbol, panics};
use crate::repository::Repository;
use std::collections::{BTreeMap, BTreeSet};

/// Crates that fly. The firmware itself may panic while it starts, before any motor can turn.
const FLIGHT: [&str; 8] = [
    "stampfly_board",
    "stampfly_bus",
    "stampfly_control",
    "stampfly_drivers",
    "stampfly_eskf",
    "stampfly_link",
    "stampfly_mode",
    "stampfly_types",
];

/// A part of the caller's name, a part of what it calls, and why nobody minds.
const ALLOWED: [(&str, &str, &str); 4] = [
    ("", "panic_const_async_fn_resumed", "a state machine polled after its end: only a broken executor does that"),
    // A subtraction of instants, and two slices that are split.
    ("stampfly_drivers::shared::Share", "panicking::panic_fmt", "esp-hal's I2C: time passes, and chunks are parts"),
    ("stampfly_drivers::chip::bmi270", "panicking::panic_fmt", "esp-hal's table of pins: it has every pin"),
    ("stampfly_drivers::chip::bmi270", "panicking::panic_bounds_check", "esp-hal's table of pins: it has every pin"),
];

pub fn run(repository: &Repository, arguments: &[String]) -> Result<(), Failure> {
    let path = arguments.first().map_or_else(|| esp32::c6(repository), |path| Ok(path.into()))?;
    let program = Program::read(&path)?;
    let found = calls(&program);
    // Nothing to be found would look just like nothing found.
    if found.is_empty() {
        return Err("the flight code calls nothing that panics, not even its state machines: was it read?".to_owned());
    }
    let mut failures: Vec<Failure> =
        unexplained(&found).into_iter().map(|(caller, callee)| format!("{caller:.200} calls {callee}")).collect();
    failures
        .extend(unused(&found).into_iter().map(|(caller, callee)| format!("no `{caller}` calls {callee} any more")));
    println!("{} functions of the flight code call something that panics", found.len());
    if failures.is_empty() { Ok(()) } else { Err(format!("{}:\n  {}", failures.len(), failures.join("\n  "))) }
}

/// Functions of the flight code, and what they call that panics.
type Calls<'p> = BTreeMap<&'p str, BTreeSet<&'p str>>;

fn calls(program: &Program) -> Calls<'_> {
    let mut found = Calls::new();
    let flies = |symbol: &&Symbol| FLIGHT.contains(&symbol.owner.as_str());
    for symbol in program.symbols.values().filter(flies) {
        let targets = symbol.code.iter().flat_map(|code| &code.calls).filter_map(|call| program.symbols.get(call));
        for target in targets.filter(|target| panics(&target.name)) {
            found.entry(&symbol.name).or_default().insert(&target.name);
        }
    }
    found
}

fn explains(row: &(&str, &str, &str), caller: &str, callee: &str) -> bool {
    caller.contains(row.0) && callee.contains(row.1)
}

fn unexplained<'p>(found: &Calls<'p>) -> Vec<(&'p str, &'p str)> {
    let pairs = found.iter().flat_map(|(caller, callees)| callees.iter().map(|callee| (*caller, *callee)));
    pairs.filter(|(caller, callee)| !ALLOWED.iter().any(|row| explains(row, caller, callee))).collect()
}

/// Rows that explain nothing.
fn unused(found: &Calls<'_>) -> Vec<(&'static str, &'static str)> {
    let used = |row: &&(&str, &str, &str)| {
        found.iter().any(|(caller, callees)| callees.iter().any(|callee| explains(row, caller, callee)))
    };
    ALLOWED.iter().filter(|row| !used(row)).map(|(caller, callee, _)| (*caller, *callee)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::program;

    const RESUMED: &str = "core::panicking::panic_const::panic_const_async_fn_resumed";
    const BOUNDS: &str = "core::panicking::panic_bounds_check";

    #[test]
    fn only_what_flies_is_asked() {
        let program = program(&[
            ("stampfly_eskf::step", 0, &[48, 64], 0),
            ("stampfly_esp32s3::start", 0, &[48], 0),
            (BOUNDS, 0, &[], 0),
            ("stampfly_eskf::other", 0, &[], 0),
        ]);
        let found = calls(&program);
        assert_eq!(found, [("stampfly_eskf::step", [BOUNDS].into())].into());
        assert_eq!(unexplained(&found), [("stampfly_eskf::step", BOUNDS)]);
    }

    #[test]
    fn what_is_listed_passes_and_what_is_listed_in_vain_does_not() {
        let found: Calls<'_> = [("stampfly_drivers::chip::bmi270::next", [BOUNDS, RESUMED].into())].into();
        assert!(unexplained(&found).is_empty());
        let unused = unused(&found);
        assert_eq!(unused.len(), 2);
        assert!(unused.iter().all(|(_, callee)| *callee == "panicking::panic_fmt"));
    }
}
