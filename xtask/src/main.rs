//! Every check of this repository: `cargo xtask STEP`, `cargo xtask ci` for all of them.
//!
//! [`STEPS`] is the list; one file per step is in [`steps`]. A step prints the commands it runs to stderr and fails with a
//! sentence. Exit code: 0 passed, 1 failed, 2 wrong command line.

mod arguments;
mod cargo_tool;
mod changelog;
mod ci;
mod commit;
mod copy;
mod elf;
mod front_page;
mod machine;
mod modules;
mod mutation;
mod page;
mod ratchet;
mod reinserted;
mod repository;
mod step;
mod steps;

use arguments::Accepts::{Debian, File, Fix, Rest, Seconds};
use repository::Repository;
use std::process::ExitCode;
use step::Step;

/// In the order of `ci`: fast and frequent failures first. `foreign`, `panic-calls` and `memory` look at what
/// `esp32` has built.
const STEPS: &[Step] = &[
    Step::new("machine", "List the missing programs that the steps need", steps::machine::run),
    Step::new("fmt", "Check the formatting", steps::fmt::run),
    Step::new("files", "Find dependency cycles between source files", steps::files::run),
    Step::new("constants", "Find constants of the StampFly in generic crates", steps::constants::run),
    Step::new("lines", "Count the lines of the vehicles", steps::lines::run),
    Step::new("clippy", "Lint every target; a warning fails", steps::clippy::run),
    Step::new("test", "Run `cargo test`, on recorded data as well", steps::test::run).accepting(&[Rest]),
    Step::new("examples", "Run every example to its end", steps::examples::run),
    Step::new("doc", "Build the documentation; a warning fails", steps::doc::run),
    Step::new("no-std", "Check the libraries for bare metal", steps::no_std::run).accepting(&[Debian]),
    Step::new("hals", "Build the drivers' examples for Linux, RP2350, STM32 and ESP32", steps::hals::run)
        .beside()
        .accepting(&[Debian]),
    Step::new("stm32", "Build the STM32 quadcopter's firmware, hold it to flash and memory", steps::stm32::run)
        .beside()
        .accepting(&[Debian]),
    Step::new("features", "Check each library with each of its features alone", steps::features::run).beside(),
    Step::new("coverage", "Find lines of mode, failsafe and mixer that no test runs", steps::coverage::run).beside(),
    Step::new("loom", "Run the bus's loom models in every interleaving", steps::loom::run).beside().accepting(&[Rest]),
    Step::new("fuzz", "Run the fuzz targets over their corpora and seeded mutations", steps::fuzz::run),
    Step::new(
        "search",
        "Search with libFuzzer and the address sanitizer, each target for SECONDS (20)",
        steps::search::run,
    )
    .accepting(&[Seconds])
    .beside(),
    Step::new("ulog", "Read a flight log, or FILE, with the format's own tools", steps::ulog::run).accepting(&[File]),
    Step::new("budget", "Count the instructions of a 400 Hz step on this PC", steps::budget::run),
    Step::new(
        "cortex-m4f",
        "Count the estimator's instructions on a Cortex-M4F, compare its bits",
        steps::cortex_m4f::run,
    ),
    Step::new("panic-proof", "Link the flight code without a panic handler", steps::panic_proof::run).beside(),
    Step::new("esp32", "Type-check the ESP32-S3 firmware, build it for the ESP32-C6", steps::esp32::run).beside(),
    Step::new("foreign", "Run the ESP32-C6 firmware on an emulator that is not ours", steps::foreign::run).beside(),
    Step::new("memory", "Hold the firmware's (or FILE's) flash, memory and stack to their budgets", steps::memory::run)
        .beside()
        .accepting(&[Fix, File]),
    Step::new(
        "panic-calls",
        "Find calls that panic in the firmware's (or FILE's) flight code",
        steps::panic_calls::run,
    )
    .beside()
    .accepting(&[File]),
    Step::new(
        "package",
        "Build each crate from its package, and run the first example of its README",
        steps::package::run,
    )
    .beside(),
    Step::new("msrv", "Hold the libraries to the Rust version they promise", steps::msrv::run).beside(),
    Step::new("msrv-build", "Build the libraries with the oldest Rust they promise", steps::msrv::build).manual(),
    Step::new("semver", "Compare each library's interface with the last release's", steps::semver::run).beside(),
    Step::new("soak", "Watch ten vehicles for half an hour, or for SECONDS", steps::soak::run)
        .manual()
        .accepting(&[Rest]),
    Step::new("clients", "Let programs that others have written fly a simulated vehicle", steps::clients::run).beside(),
    Step::new("python", "Run the tests of the Python example, check its types", steps::python::run).beside(),
    Step::new("ground", "Fly from the ground station's page in a real browser", steps::ground::run).accepting(&[Rest]),
    Step::new("demo", "Make the page with a vehicle inside, and fly it in a real browser", steps::demo::run)
        .accepting(&[Rest]),
    Step::new("determinism", "Compare the bits of optimised and unoptimised flights", steps::determinism::run),
    Step::new("bars", "Fly a hundred missions and hold them to their limits", steps::bars::run).alone(),
    Step::new("shards", "Fly a campaign on a HyperQueue server that loses a worker", steps::shards::run),
    Step::new("golden", "Compare the golden flight with a new recording", steps::golden::run).accepting(&[Fix]),
    Step::new("qemu", "Replay the golden flight on emulated cores: bits and instructions", steps::qemu::run)
        .beside()
        .accepting(&[Fix]),
    Step::new("hil", "Fly a mission with the vehicle on an emulated core: the same bits", steps::hil::run),
    Step::new("record", "Replay what the emulated board recorded of a flight, bit for bit", steps::record::run)
        .beside(),
    Step::new("cache", "Count what a pass of the flight band would fetch from flash", steps::cache::run)
        .beside()
        .accepting(&[Fix]),
    Step::new("docs", "Check links, pictures and generated tables of the documents", steps::docs::run)
        .accepting(&[Fix]),
    Step::new("book", "Build the book, check its links, run its tutorial's commands", steps::book::run),
    Step::new("book-chapters", "Adapt the book's pages: mdBook calls it", steps::book::chapters)
        .accepting(&[Rest])
        .manual(),
    Step::new(
        "campaign",
        "Fly two thousand flights with faults: no invariant violated, no new wrong end",
        steps::campaign::run,
    )
    .alone(),
    Step::new("bugs", "Re-insert field bugs into a copy: the flight that finds each", steps::bugs::run)
        .beside()
        .accepting(&[Fix, Rest]),
    Step::new("mutants", "Change what decides whether motors turn: some test has to fail", steps::mutants::run)
        .accepting(&[Fix, Rest])
        .manual(),
    Step::new("figures", "Measure the README's figures and write them there", steps::figures::run).manual(),
    Step::new("peers", "Measure the estimator beside other crates", steps::peers::run).accepting(&[Fix]).manual(),
    Step::new("against", "Measure chain, control and simulation beside an earlier commit", steps::against::run)
        .manual(),
    Step::new("vectors", "Compare the datagrams that other programs are tested against", steps::vectors::run)
        .accepting(&[Fix])
        .manual(),
];

fn main() -> ExitCode {
    // Exits with 0 after `--help` and with 2 after a wrong command line.
    let matches = step::command(STEPS).get_matches();
    let repository = Repository::find();
    let outcome = match step::chosen(STEPS, &matches) {
        Ok(Some((step, arguments))) => {
            (step.run)(&repository, &arguments).map_err(|failure| format!("{}: {failure}", step.name))
        }
        Ok(None) => ci::run(&repository, STEPS),
        Err(failure) => Err(failure),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("xtask {failure}");
            ExitCode::FAILURE
        }
    }
}
