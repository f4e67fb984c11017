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
mod machine;
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
    /// Arguments it may be given: flags, [`PATH`], [`ANYTHING`].
    accepts: &'static [&'static str],
    /// Is it part of `ci`?
    in_ci: bool,
    /// Seconds it may take.
    limit: Option<f64>,
    run: fn(&Repository, arguments: &[String]) -> Result<(), Failure>,
}

/// Make what is compared instead of comparing it.
const FIX: &str = "--fix";
/// One argument that is no flag.
const PATH: &str = "PATH";
/// Whatever the program takes that the step runs.
const ANYTHING: &str = "...";

/// A step of `ci` without arguments.
const fn check(
    name: &'static str,
    about: &'static str,
    run: fn(&Repository, &[String]) -> Result<(), Failure>,
) -> Step {
    Step { name, about, accepts: &[], in_ci: true, limit: None, run }
}

impl Step {
    const fn accepting(self, accepts: &'static [&'static str]) -> Self {
        Self { accepts, ..self }
    }

    const fn within(self, seconds: f64) -> Self {
        Self { limit: Some(seconds), ..self }
    }

    /// Not part of `ci`.
    const fn apart(self) -> Self {
        Self { in_ci: false, ..self }
    }

    /// The first argument that the step does not take.
    fn refuses<'a>(&self, arguments: &'a [String]) -> Option<&'a str> {
        let mut paths = usize::from(self.accepts.contains(&PATH));
        let mut takes = |argument: &str| {
            let is_path = !argument.starts_with('-') && std::mem::take(&mut paths) > 0;
            is_path || self.accepts.contains(&ANYTHING) || self.accepts.contains(&argument)
        };
        arguments.iter().map(String::as_str).find(|argument| !takes(argument))
    }

    /// Runs it, and looks at the clock where it has a limit.
    fn check(&self, repository: &Repository, arguments: &[String]) -> Result<(), Failure> {
        let begun = std::time::Instant::now();
        (self.run)(repository, arguments)?;
        self.in_time(begun.elapsed().as_secs_f64())
    }

    fn in_time(&self, seconds: f64) -> Result<(), Failure> {
        let Some(limit) = self.limit else { return Ok(()) };
        println!("{}: {seconds:.0} s; {limit} s is the most", self.name);
        if seconds > limit { Err(format!("took {seconds:.0} s; {limit} s is the most")) } else { Ok(()) }
    }
}

/// Does the command line have this flag?
fn asks(arguments: &[String], flag: &str) -> bool {
    arguments.iter().any(|argument| argument == flag)
}

/// In the order `ci` runs them: what fails fast and often comes first.
const STEPS: &[Step] = &[
    check("machine", "is everything there that the steps need?", steps::machine::run),
    check("fmt", "is everything formatted?", steps::fmt::run),
    check("clippy", "no warning in any target?", steps::clippy::run),
    check("test", "does `cargo test` pass, recorded data included?", steps::test::run).accepting(&[ANYTHING]),
    check("examples", "does every example run to its end?", steps::examples::run),
    check("doc", "does the documentation build without a warning?", steps::doc::run),
    check("no-std", "do the libraries build for bare metal?", steps::no_std::run).accepting(&["--debian"]),
    check("loom", "is the bus right in every interleaving?", steps::loom::run).accepting(&[ANYTHING]),
    check("consumers", "can each crate be used alone, from outside?", steps::consumers::run),
    check("ulog", "do public tools open our log, or this one?", steps::ulog::run).accepting(&[PATH]),
    check("budget", "does the 400 Hz chain stay within its instruction budget?", steps::budget::run),
    check(
        "cortex-m4f",
        "does the estimator stay within its budget on a Cortex-M4F, with the same bits?",
        steps::cortex_m4f::run,
    ),
    check("panic-proof", "does the flight code link without a panic handler?", steps::panic_proof::run),
    check("esp32", "does the firmware check for the ESP32-S3, and build and link for its sibling?", steps::esp32::run)
        .within(300.0),
    check("memory", "does the firmware stay within its flash, memory and stack, or this program?", steps::memory::run)
        .accepting(&[FIX, PATH]),
    check(
        "panic-calls",
        "does flight code in the firmware, or in this program, call what panics?",
        steps::panic_calls::run,
    )
    .accepting(&[PATH]),
    check("package", "would each crate, as committed, build from its package?", steps::package::run),
    check("determinism", "do optimised and unoptimised flights publish the same bits?", steps::determinism::run),
    check("bars", "do a hundred flights keep every bar?", steps::bars::run),
    check("golden", "is the golden flight what is flown, optimised and not?", steps::golden::run).accepting(&[FIX]),
    check("qemu", "the golden flight on emulated cores: the same bits, within the budgets?", steps::qemu::run)
        .accepting(&[FIX]),
    check("docs", "do the documents' links and tables agree with the sources?", steps::docs::run).accepting(&[FIX]),
    check("figures", "measure the README's figures and write them there", steps::figures::run).apart(),
    check("peers", "measure the estimator beside its peers", steps::peers::run).accepting(&[FIX]).apart(),
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
        Some(step) => match step.refuses(rest) {
            Some(argument) => {
                eprintln!("xtask {name}: what is `{argument}`?\n");
                return usage(2);
            }
            None => step.check(&repository, rest),
        },
        None if name == "ci" && rest.is_empty() => ci::run(&repository, STEPS),
        None => {
            eprintln!("xtask: there is no step `{}`\n", arguments.join(" "));
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
        text += &format!("{mark} {:<12} {}", step.name, step.about);
        text += &step.accepts.iter().map(|argument| format!(" [{argument}]")).collect::<String>();
        text += "\n";
    }
    text += "\nWith --fix, a step writes what it would otherwise compare; with --debian, Debian's compiler builds.\n";
    text += "Exit code: 0 when all is well, 1 when a step failed, 2 when the command line was wrong.\n";
    if code == 0 {
        print!("{text}")
    } else {
        eprint!("{text}")
    }
    ExitCode::from(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(step: &Step, arguments: &[&str]) -> Option<String> {
        let arguments: Vec<String> = arguments.iter().map(|argument| (*argument).to_owned()).collect();
        step.refuses(&arguments).map(str::to_owned)
    }

    #[test]
    fn arguments_nobody_knows_are_refused() {
        let plain = check("plain", "", |_, _| Ok(()));
        assert_eq!(refused(&plain, &[]), None);
        assert_eq!(refused(&plain, &["--bogus"]).as_deref(), Some("--bogus"));
        let one = check("one", "", |_, _| Ok(())).accepting(&[FIX, PATH]);
        assert_eq!(refused(&one, &["a.elf", "--fix"]), None);
        assert_eq!(refused(&one, &["a.elf", "b.elf"]).as_deref(), Some("b.elf"));
        assert_eq!(refused(&one, &["--bogus"]).as_deref(), Some("--bogus"));
        let any = check("any", "", |_, _| Ok(())).accepting(&[ANYTHING]);
        assert_eq!(refused(&any, &["--nocapture", "x", "y"]), None);
    }

    #[test]
    fn a_limit_is_kept() {
        let limited = check("limited", "", |_, _| Ok(())).within(300.0);
        assert!(limited.in_time(300.0).is_ok() && limited.in_time(301.0).is_err());
        assert!(check("free", "", |_, _| Ok(())).in_time(1e6).is_ok());
    }
}
