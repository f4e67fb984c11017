//! `panic-calls`: does flight code, as it stands in the linked firmware, call anything that panics?
//!
//! `panic-proof` links the flight code alone; this looks at what the firmware made of it, drivers and their waiting
//! included, in the ESP32-C6 program. A call belongs to the source file that it passes on: what the
//! manufacturer's library does inside one of our generic functions is that library's. A call that tells no place is ours.
//!
//! Panics remain in what starts the vehicle. What they do before their message must not hang, so it may call nobody: whoever panicked may
//! hold any lock.

use super::esp32;
use crate::arguments::Arguments;
use crate::elf::{Program, panics};
use crate::repository::{Failure, Repository};
use std::collections::BTreeSet;

/// Libraries without flight code: parameters are read before the flight and written after it, logs are read on a PC. The
/// firmware itself may panic while it starts, before any motor can turn.
const NOT_FLIGHT: [&str; 2] = ["stampfly-log", "stampfly-param"];

/// Part of the place, part of the callee, and why the call is harmless.
const ALLOWED: [(&str, &str, &str); 3] = [
    ("", "panic_const_async_fn_resumed", "a state machine polled after its end: only a broken executor does that"),
    ("/esp-hal-", "", "the manufacturer's: a clock that stands still, a pin that its table has not"),
    ("/esp32c6-", "panic_bounds_check", "the manufacturer's table of registers: every pin has one"),
];

/// What a panic does to motors and watchdog.
const AT_A_PANIC: [&str; 2] = ["stampfly_esp32s3::cutoff::lock_out", "stampfly_esp32s3::cutoff::stand_down"];
/// Calls the manufacturer's drivers.
const CONTROL: &str = "stampfly_esp32s3::cutoff::__esp_hal_internal_look";
/// The program's own crate.
const FIRMWARE: &str = "stampfly_esp32s3";

pub fn run(repository: &Repository, arguments: &Arguments) -> Result<(), Failure> {
    let path = arguments.file.clone().map_or_else(|| esp32::c6(repository, esp32::Variant::Default), Ok)?;
    let libraries = repository.libraries()?.into_iter().filter(|library| library.bare_metal);
    let flight = libraries.map(|library| library.name).filter(|name| !NOT_FLIGHT.contains(&name.as_str()));
    let program = Program::read(&path)?;
    for function in AT_A_PANIC {
        let strangers = strangers(&program, function)?;
        if !strangers.is_empty() {
            return Err(format!("{function}, which a panic calls, may wait for {strangers:?}"));
        }
    }
    if strangers(&program, CONTROL)?.is_empty() {
        return Err(format!("{CONTROL} calls nobody: is the program read as it should be?"));
    }
    println!("a panic waits for nobody before its message");
    let found = calls(&program, &flight.map(|name| name.replace('-', "_")).collect());
    // Nothing to be found would look just like nothing found.
    if let Some((place, callee, _)) = ALLOWED.iter().find(|row| !found.iter().any(|call| call.is_allowed_by(row))) {
        return Err(format!("no call of `{callee}` from `{place}` is left: is the program read as it should be?"));
    }
    let ours: Vec<_> = found.iter().filter(|call| !ALLOWED.iter().any(|row| call.is_allowed_by(row))).collect();
    println!("{} calls that panic in the flight code, {} of them its own", found.len(), ours.len());
    let said: Vec<String> =
        ours.iter().map(|call| format!("{:.150} calls {} at {}", call.caller, call.callee, call.place)).collect();
    if said.is_empty() { Ok(()) } else { Err(said.join("\n  ")) }
}

/// What a function of the firmware calls that is not the firmware's own, at any depth.
fn strangers(program: &Program, name: &str) -> Result<BTreeSet<String>, Failure> {
    let root = program.symbols.iter().find(|(_, symbol)| symbol.name == name && symbol.code.is_some());
    let (root, _) = root.ok_or_else(|| format!("no function {name}"))?;
    let (mut found, mut seen, mut open) = (BTreeSet::new(), BTreeSet::new(), vec![*root]);
    while let Some(address) = open.pop() {
        let Some((start, symbol)) = program.at(address) else {
            found.insert(program.outside(address));
            continue;
        };
        if !seen.insert(start) {
            continue;
        }
        let Some(code) = symbol.code.as_ref().filter(|code| symbol.owner == FIRMWARE && code.indirect == 0) else {
            found.insert(symbol.name.clone());
            continue;
        };
        open.extend(&code.calls);
    }
    Ok(found)
}

/// A call of something that panics.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Call {
    caller: String,
    callee: String,
    /// `FILE:LINE`; empty when the call tells none.
    place: String,
}

impl Call {
    fn is_allowed_by(&self, (place, callee, _): &(&str, &str, &str)) -> bool {
        self.place.contains(place) && self.callee.contains(callee)
    }
}

/// What functions of the flight code call that panics.
fn calls(program: &Program, flight: &BTreeSet<String>) -> BTreeSet<Call> {
    let mut found = BTreeSet::new();
    for symbol in program.symbols.values().filter(|symbol| flight.contains(&symbol.owner)) {
        for (target, arguments) in symbol.code.iter().flat_map(|code| &code.constants) {
            let Some(target) = program.symbols.get(target).filter(|target| panics(&target.name)) else { continue };
            let place = arguments.iter().find_map(|argument| program.location(*argument)).unwrap_or_default();
            found.insert(Call { caller: symbol.name.clone(), callee: target.name.clone(), place });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::program;

    const BOUNDS: &str = "core::panicking::panic_bounds_check";

    fn call(place: &str, callee: &str) -> Call {
        Call { caller: "stampfly_eskf::step".to_owned(), callee: callee.to_owned(), place: place.to_owned() }
    }

    #[test]
    fn only_what_flies_is_asked() {
        let program = program(&[
            ("stampfly_eskf::step", 0, &[48, 64], 0),
            ("stampfly_esp32s3::start", 0, &[48], 0),
            (BOUNDS, 0, &[], 0),
            ("stampfly_eskf::other", 0, &[], 0),
        ]);
        assert_eq!(calls(&program, &["stampfly_eskf".to_owned()].into()), [call("", BOUNDS)].into());
    }

    #[test]
    fn a_panic_may_call_the_firmware_alone() {
        let program = program(&[
            ("stampfly_esp32s3::cutoff::lock_out", 0, &[32], 0),
            ("stampfly_esp32s3::safe_state::cut", 0, &[], 0),
            ("stampfly_esp32s3::cutoff::stand_down", 0, &[64], 0),
            ("stampfly_esp32s3::other", 0, &[80], 0),
            ("esp_hal::Wdt::new", 0, &[], 0),
        ]);
        assert!(strangers(&program, AT_A_PANIC[0]).expect("found").is_empty());
        assert_eq!(strangers(&program, AT_A_PANIC[1]).expect("found"), ["esp_hal::Wdt::new".to_owned()].into());
        assert!(strangers(&program, CONTROL).is_err());
    }

    #[test]
    fn the_place_says_whose_it_is() {
        let allowed = |place, callee| ALLOWED.iter().any(|row| call(place, callee).is_allowed_by(row));
        assert!(allowed("/x/esp-hal-1.2.2/src/gpio/mod.rs:9", BOUNDS));
        assert!(allowed(
            "/x/stampfly-drivers/core/src/slot.rs:9",
            "core::panicking::panic_const::panic_const_async_fn_resumed"
        ));
        assert!(!allowed("/x/stampfly-eskf/src/eskf.rs:9", BOUNDS));
        assert!(!allowed("", BOUNDS));
    }
}
