//! Every check of this repository: `cargo xtask STEP`; `cargo xtask ci` for those of a push, `cargo xtask nightly` for the others.
//!
//! [`STEPS`] is the list; one file per step is in [`steps`]. A step prints the commands it runs to stderr and fails with a
//! sentence. Exit code: 0 passed, 1 failed, 2 wrong command line.

mod arguments;
mod cargo_tool;
mod changelog;
mod commit;
mod control;
mod copy;
mod elf;
mod front_page;
mod lane;
mod listing;
mod machine;
mod mutation;
mod page;
mod parallel;
mod ratchet;
mod reinserted;
mod repository;
mod safety;
mod step;
mod steps;

use arguments::Accepts::{Debian, File, Fix, Rest, Seconds};
use repository::Repository;
use std::process::ExitCode;
use step::Holds::{Debug, Esp32, Machine, Qemu, Release};
use step::{Chosen, Step};

/// In the order in which a lane starts them. A step that builds what others use, or that takes long, comes early.
const STEPS: &[Step] = &[
    // For every push. Steps that build in the workspace's own folder come first: one job runs them one
    // after the other, the other job runs the rest.
    Step::ci("machine", "List the missing programs that the steps need", steps::machine::run),
    Step::ci("program", "Build the programs of `cargo test`, which other steps run", steps::program::run)
        .holding(&[Debug]),
    Step::ci("fmt", "Check the formatting", steps::fmt::run),
    Step::ci("esp32", "Type-check the ESP32-S3 firmware, link it for the ESP32-C6", steps::esp32::run)
        .holding(&[Esp32]),
    Step::ci("clippy", "Lint every target; a warning fails", steps::clippy::run).holding(&[Debug]),
    Step::ci("features", "Check each library without any of its features", steps::features::run)
        .holding(&[Debug])
        .after(&["clippy"]),
    Step::ci("doc", "Build the documentation; a warning fails", steps::doc::run).holding(&[Debug]),
    Step::ci("no-std", "Check the libraries for bare metal", steps::no_std::run).holding(&[Debug]).accepting(&[Debian]),
    Step::ci("examples", "Run every example to its end", steps::examples::run).holding(&[Debug]).after(&["program"]),
    Step::ci("clients", "Let programs that others have written fly a simulated vehicle", steps::clients::run)
        .after(&["program"]),
    Step::ci("ground", "Fly from the ground station's page in a real browser", steps::ground::run)
        .after(&["program"])
        .accepting(&[Rest]),
    Step::ci("test", "Run `cargo test`, on recorded data as well", steps::test::run)
        .after(&["program"])
        .accepting(&[Rest]),
    Step::ci("demo", "Make the page with a vehicle inside, and fly it in a real browser", steps::demo::run)
        .after(&["program"])
        .accepting(&[Rest]),
    Step::ci("panic-proof", "Link the flight code for an ARM core without a panic handler", steps::panic_proof::run),
    Step::ci("golden", "Compare the golden flight with a new recording", steps::golden::run)
        .after(&["program"])
        .accepting(&[Fix]),
    Step::ci("faults", "Fly two hundred flights with faults", steps::campaign::some).after(&["program"]),
    Step::ci("envelope", "Fly four hundred sound vehicles through the whole envelope", steps::envelope::some)
        .after(&["program"]),
    Step::ci("docs", "Check links, pictures and generated tables of the documents", steps::docs::run)
        .after(&["program"])
        .accepting(&[Fix]),
    Step::ci("ulog", "Read a flight log, or FILE, with the format's own tools", steps::ulog::run)
        .after(&["program"])
        .accepting(&[File]),
    Step::ci("python", "Run the tests of the Python example, check its types", steps::python::run),
    Step::ci("workflows", "Check GitHub's workflows and the scripts they run", steps::workflows::run),
    // Every night.
    Step::nightly("thorough", "Run the tests that fly with all of their seeds", steps::test::thorough)
        .holding(&[Debug]),
    Step::nightly("estimation", "Test the estimators on recorded flights", steps::estimation::run).accepting(&[Rest]),
    Step::nightly("alone", "Lint packages that are built by themselves", steps::clippy::alone).holding(&[Debug]),
    Step::nightly("each-feature", "Check each library with each feature alone, and with all", steps::features::each)
        .holding(&[Debug]),
    Step::nightly("bugs", "Re-insert field bugs into a copy: the flight that finds each", steps::bugs::run)
        .accepting(&[Fix, Rest]),
    Step::nightly("mutants", "Change what decides whether motors turn: some test has to fail", steps::mutants::run)
        .accepting(&[Fix, Rest]),
    Step::nightly("coverage", "Find lines of mode, failsafe and mixer that no test runs", steps::coverage::run),
    Step::nightly("loom", "Run the bus's loom models in every interleaving", steps::loom::run).accepting(&[Rest]),
    Step::nightly("qemu", "Replay the golden flight on emulated cores: bits and instructions", steps::qemu::run)
        .holding(&[Qemu])
        .accepting(&[Fix]),
    Step::nightly("hil", "Fly a mission with the vehicle on an emulated core: the same bits", steps::hil::run)
        .holding(&[Qemu]),
    Step::nightly("record", "Replay what the emulated board recorded of a flight, bit for bit", steps::record::run)
        .holding(&[Qemu]),
    Step::nightly("cache", "Count what a pass of the flight band would fetch from flash", steps::cache::run)
        .holding(&[Qemu])
        .accepting(&[Fix]),
    Step::nightly("esp32-images", "Link the firmware as it is flashed, make images of it", steps::esp32::images)
        .holding(&[Esp32]),
    Step::nightly("foreign", "Run the ESP32-C6 firmware on an emulator that is not ours", steps::foreign::run)
        .holding(&[Esp32]),
    Step::nightly(
        "memory",
        "Hold the firmware's (or FILE's) flash, memory and stack to their budgets",
        steps::memory::run,
    )
    .holding(&[Esp32])
    .accepting(&[Fix, File]),
    Step::nightly("panic-proofs", "The panic proof for other cores, and for size", steps::panic_proof::others),
    Step::nightly(
        "panic-calls",
        "Find calls that panic in the firmware's (or FILE's) flight code",
        steps::panic_calls::run,
    )
    .holding(&[Esp32])
    .accepting(&[File]),
    Step::nightly("stm32", "Build the STM32 quadcopter's firmware, hold it to flash and memory", steps::stm32::run)
        .accepting(&[Debian]),
    Step::nightly("cortex-m4f", "Count the estimator's instructions on a Cortex-M4F", steps::cortex_m4f::run),
    Step::nightly("hals", "Build the drivers' examples for Linux, RP2350, STM32 and ESP32", steps::hals::run)
        .accepting(&[Debian]),
    Step::nightly(
        "package",
        "Build each crate from its package, and run the first example of its README",
        steps::package::run,
    ),
    Step::nightly("windows", "Fly with the program for Windows: the same bytes", steps::windows::run)
        .holding(&[Release]),
    Step::nightly("platforms", "Check everything of a PC for Windows and macOS", steps::platforms::run),
    Step::nightly("msrv", "Hold the libraries to the Rust version they promise", steps::msrv::run),
    Step::nightly("semver", "Compare each library's interface with the last release's", steps::semver::run),
    Step::nightly("book", "Build the book, check its links, run its tutorial's commands", steps::book::run),
    Step::nightly("determinism", "Compare the bits of optimised and unoptimised flights", steps::determinism::run)
        .holding(&[Release]),
    Step::nightly("shards", "Fly a campaign on a HyperQueue server that loses a worker", steps::shards::run),
    Step::nightly("vectors", "Compare the datagrams that other programs are tested against", steps::vectors::run)
        .holding(&[Debug])
        .accepting(&[Fix]),
    Step::nightly("budget", "Count the instructions of a 400 Hz step on this PC", steps::budget::run)
        .holding(&[Release]),
    Step::nightly(
        "search",
        "Search with libFuzzer and the address sanitizer, each target for SECONDS (20)",
        steps::search::run,
    )
    .accepting(&[Seconds]),
    Step::nightly("load", "Load every port for half an hour, or for SECONDS: all are served", steps::load::run)
        .accepting(&[Rest]),
    Step::nightly("soak", "Watch ten vehicles for half an hour, or for SECONDS", steps::soak::run).accepting(&[Rest]),
    Step::nightly(
        "campaign",
        "Fly three thousand flights with faults: no invariant violated, no new wrong end",
        steps::campaign::all,
    )
    .holding(&[Machine]),
    Step::nightly("envelope-all", "Fly five thousand sound vehicles through the whole envelope", steps::envelope::all)
        .holding(&[Machine])
        .accepting(&[Fix]),
    Step::nightly("bars", "Fly a hundred missions and hold them to their limits", steps::bars::run).holding(&[Machine]),
    Step::nightly("peers", "Measure the estimator beside other crates", steps::peers::run)
        .holding(&[Machine])
        .accepting(&[Fix]),
    // Only by name.
    Step::manual("controls", "Break what each step looks for: it has to fail", steps::controls::run)
        .accepting(&[Fix, Rest]),
    Step::manual("msrv-build", "Build the libraries with the oldest Rust they promise", steps::msrv::build),
    Step::manual("book-chapters", "Adapt the book's pages: mdBook calls it", steps::book::chapters).accepting(&[Rest]),
    Step::manual("safety", "Fly the campaigns of docs/explain/safety.md and write their tables", steps::safety::run)
        .accepting(&[Rest]),
    Step::manual(
        "figures",
        "Measure the figures of docs/reference/figures.md and write them there",
        steps::figures::run,
    ),
];

fn main() -> ExitCode {
    // Exits with 0 after `--help` and with 2 after a wrong command line.
    let matches = step::command(STEPS).get_matches();
    let repository = Repository::find();
    let outcome = step::chosen(STEPS, &matches).and_then(|chosen| match chosen {
        Chosen::Step(name, arguments) => {
            let step = STEPS.iter().find(|step| step.name == name).ok_or("no such step")?;
            (step.run)(&repository, &arguments).map_err(|failure| format!("{name}: {failure}"))
        }
        Chosen::Lane(lane, selection) => lane::run(&repository, STEPS, lane, &selection),
    });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("xtask {failure}");
            ExitCode::FAILURE
        }
    }
}
