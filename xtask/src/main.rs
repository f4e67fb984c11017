//! Every check there is, by name: `cargo xtask STEP`.
//!
//! | step | asks |
//! |---|---|
//! | one of [`STEPS`] | the question in its `about` |
//! | `ci` | all of them that need nothing but this repository, in order, until one fails |
//!
//! One file a step in [`steps`]. A step says what it runs on stderr and fails with a sentence; the exit code is 0, 1
//! for a failed step, 2 for a wrong command line.

mod ci;
mod elf;
mod ratchet;
mod repository;
mod steps;

use repository::Repository;
use std::process::ExitCode;

/// Why a step failed, for a person to read.
type Failure = String;

/// One check.
struct Step {
    name: &'static str,
    /// What it asks, for `--help`.
    about: &'static str,
    /// Is it part of `ci`?
    in_ci: bool,
    run: fn(&Repository, arguments: &[String]) -> Result<(), Failure>,
}

/// In the order `ci` runs them: what fails fast and often comes first.
const STEPS: &[Step] = &[
    Step { name: "fmt", about: "is everything formatted?", in_ci: true, run: steps::fmt::run },
    Step { name: "clippy", about: "no warning in any target?", in_ci: true, run: steps::clippy::run },
    Step { name: "test", about: "does `cargo test` pass, recorded data included?", in_ci: true, run: steps::test::run },
    Step { name: "examples", about: "does every example run to its end?", in_ci: true, run: steps::examples::run },
    Step { name: "doc", about: "does the documentation build without a warning?", in_ci: true, run: steps::doc::run },
    Step {
        name: "no-std",
        about: "do the libraries build for bare metal? (--debian: with Debian's compiler)",
        in_ci: true,
        run: steps::no_std::run,
    },
    Step { name: "loom", about: "is the bus right in every interleaving?", in_ci: true, run: steps::loom::run },
    Step {
        name: "consumers",
        about: "can each crate be used alone, from outside?",
        in_ci: true,
        run: steps::consumers::run,
    },
    Step {
        name: "ulog",
        about: "do public tools open our log? (optional: the log's path)",
        in_ci: true,
        run: steps::ulog::run,
    },
    Step {
        name: "budget",
        about: "does the 400 Hz chain stay within its instruction budget?",
        in_ci: true,
        run: steps::budget::run,
    },
    Step {
        name: "cortex-m4f",
        about: "does the estimator stay within its budget on a Cortex-M4F, with the same bits?",
        in_ci: true,
        run: steps::cortex_m4f::run,
    },
    Step {
        name: "panic-proof",
        about: "does the flight code link without a panic handler?",
        in_ci: true,
        run: steps::panic_proof::run,
    },
    Step {
        name: "esp32",
        about: "does the firmware check for the ESP32-S3, and build and link for its sibling?",
        in_ci: true,
        run: steps::esp32::run,
    },
    Step {
        name: "memory",
        about: "does the firmware stay within its flash, memory and stack? (optional: a program)",
        in_ci: true,
        run: steps::memory::run,
    },
    Step {
        name: "package",
        about: "would each crate, as committed, build from its package?",
        in_ci: true,
        run: steps::package::run,
    },
    Step {
        name: "determinism",
        about: "do optimised and unoptimised flights publish the same bits?",
        in_ci: true,
        run: steps::determinism::run,
    },
    Step {
        name: "golden",
        about: "is the golden flight what is flown, optimised and not? (--fix: record it again)",
        in_ci: true,
        run: steps::golden::run,
    },
    Step {
        name: "qemu",
        about: "the golden flight on emulated cores: the same bits, within the budgets? (--fix: write the table)",
        in_ci: true,
        run: steps::qemu::run,
    },
    Step {
        name: "docs",
        about: "do the documents' links and tables agree with the sources? (--fix: make them)",
        in_ci: true,
        run: steps::docs::run,
    },
    Step {
        name: "figures",
        about: "measure the README's figures and write them there",
        in_ci: false,
        run: steps::figures::run,
    },
    Step {
        name: "peers",
        about: "measure the estimator beside its peers (--fix: and write it into its README)",
        in_ci: false,
        run: steps::peers::run,
    },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (name, rest) = match arguments.split_first() {
        None => return usage(2),
        Some((name, _)) if matches!(name.as_str(), "--help" | "-h" | "help") => return usage(0),
        Some(split) => split,
    };
    if rest.iter().any(|argument| argument == "--help" || argument == "-h") {
        return usage(0);
    }
    let repository = Repository::find();
    let outcome = match STEPS.iter().find(|step| step.name == name) {
        Some(step) => (step.run)(&repository, rest),
        None if name == "ci" => ci::run(&repository, STEPS),
        None => {
            eprintln!("xtask: there is no step `{name}`\n");
            return usage(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("xtask {name}: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// Says what there is: to stdout when asked, to stderr when the command line was wrong.
fn usage(code: u8) -> ExitCode {
    let mut text = String::from("Usage: cargo xtask STEP [ARGUMENTS]\n\nSteps:\n");
    text += "  ci           every step marked *, in this order, until one fails\n";
    for step in STEPS {
        let mark = if step.in_ci { '*' } else { ' ' };
        text += &format!("{mark} {:<12} {}\n", step.name, step.about);
    }
    if code == 0 {
        print!("{text}")
    } else {
        eprint!("{text}")
    }
    ExitCode::from(code)
}
