//! A step, and the command line that a table of steps makes with clap: one subcommand per step.

use crate::arguments::{Accepts, Arguments};
use crate::repository::{Failure, Repository};
use clap::{Arg, ArgAction, ArgMatches, Command};

/// What a step runs.
pub type Run = fn(&Repository, &Arguments) -> Result<(), Failure>;

/// Which command runs a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// `cargo xtask ci`, for every push.
    Ci,
    /// `cargo xtask nightly`.
    Nightly,
    /// Neither: a step that only writes figures or installs a compiler.
    Manual,
}

impl Lane {
    /// The subcommand, and the name of the lane's folder.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ci => "ci",
            Self::Nightly => "nightly",
            Self::Manual => "manual",
        }
    }
}

/// A part of the machine that one step uses at a time. Cargo locks a build folder, and a second step that
/// waits for the lock wastes a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// `target/debug`: the tests, Clippy, the documentation.
    Debug,
    /// `target/release`: the program `stampfly`.
    Release,
    /// `target/qemu`: the programs of the emulated cores.
    Qemu,
    /// `target/esp32`: the StampFly's firmware.
    Esp32,
    /// Both cores: the step measures time, or itself runs as many processes as there are cores.
    Machine,
}

/// One check.
pub struct Step {
    pub name: &'static str,
    /// For `--help`.
    pub about: &'static str,
    pub accepts: &'static [Accepts],
    pub lane: Lane,
    pub holds: &'static [Holds],
    /// Steps of the same lane that have to end first, because this one uses what they build.
    pub after: &'static [&'static str],
    pub run: Run,
}

impl Step {
    /// A step of `ci`.
    pub const fn ci(name: &'static str, about: &'static str, run: Run) -> Self {
        Self { name, about, accepts: &[], lane: Lane::Ci, holds: &[], after: &[], run }
    }

    /// A step of `nightly`.
    pub const fn nightly(name: &'static str, about: &'static str, run: Run) -> Self {
        Self { lane: Lane::Nightly, ..Self::ci(name, about, run) }
    }

    /// A step that runs only by its name.
    pub const fn manual(name: &'static str, about: &'static str, run: Run) -> Self {
        Self { lane: Lane::Manual, ..Self::ci(name, about, run) }
    }

    pub const fn accepting(self, accepts: &'static [Accepts]) -> Self {
        Self { accepts, ..self }
    }

    pub const fn holding(self, holds: &'static [Holds]) -> Self {
        Self { holds, ..self }
    }

    pub const fn after(self, after: &'static [&'static str]) -> Self {
        Self { after, ..self }
    }
}

/// What the command line asks for.
#[derive(Debug, PartialEq)]
pub enum Chosen {
    /// One step, by its name.
    Step(&'static str, Arguments),
    /// The steps of a lane.
    Lane(Lane, Selection),
}

/// Which steps of a lane run.
#[derive(Debug, Default, PartialEq)]
pub struct Selection {
    /// Only these; all if empty.
    pub only: Vec<String>,
    /// Also those that have passed for this commit today.
    pub again: bool,
}

/// The whole command line.
pub fn command(steps: &'static [Step]) -> Command {
    let names = |lane: Lane| steps.iter().filter(move |step| step.lane == lane).map(|step| step.name);
    let lane = |lane: Lane, about: &'static str| {
        let only = Arg::new("only").long("only").value_name("STEP").action(ArgAction::Append);
        let only = only.value_parser(clap::builder::PossibleValuesParser::new(names(lane)));
        let again = Arg::new("again").long("again").action(ArgAction::SetTrue);
        Command::new(lane.name())
            .about(about)
            .arg(only.help("Run only this step; may be given several times"))
            .arg(again.help("Run also the steps that have passed for this commit within a day"))
    };
    let subcommands = steps.iter().map(|step| {
        let of = match step.lane {
            Lane::Manual => String::new(),
            lane => format!(" [{}]", lane.name()),
        };
        let arguments = step.accepts.iter().map(|argument| argument.arg());
        Command::new(step.name).about(format!("{}{of}", step.about)).args(arguments)
    });
    Command::new("xtask")
        .bin_name("cargo xtask")
        .about("Checks of this repository")
        .after_help(
            "`ci` and `nightly` run their steps two at a time, all of them whatever fails, and write a table\n\
             to target/xtask. Exit code: 0 when every step passed, 1 when one failed, 2 when the command line\n\
             was wrong.",
        )
        .subcommand_required(true)
        .arg_required_else_help(true)
        .disable_help_subcommand(true)
        .subcommand(lane(Lane::Ci, "Run every step marked [ci], as for each push"))
        .subcommand(lane(Lane::Nightly, "Run every step marked [nightly], as every night"))
        .subcommands(subcommands)
}

/// The step or lane that the command line names.
pub fn chosen(steps: &'static [Step], matches: &ArgMatches) -> Result<Chosen, Failure> {
    let (name, matches) = matches.subcommand().ok_or("no step")?;
    if let Some(lane) = [Lane::Ci, Lane::Nightly].into_iter().find(|lane| lane.name() == name) {
        let only = matches.get_many::<String>("only").unwrap_or_default().cloned().collect();
        return Ok(Chosen::Lane(lane, Selection { only, again: matches.get_flag("again") }));
    }
    let step = steps.iter().find(|step| step.name == name).ok_or_else(|| format!("no step `{name}`"))?;
    let mut arguments = Arguments::default();
    for argument in step.accepts {
        argument.take(matches, &mut arguments);
    }
    Ok(Chosen::Step(step.name, arguments))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    const STEPS: &[Step] = &[
        Step::ci("plain", "", |_, _| Ok(())),
        Step::nightly("one", "", |_, _| Ok(())).accepting(&[Accepts::Fix, Accepts::File]),
        Step::manual("any", "", |_, _| Ok(())).accepting(&[Accepts::Rest]),
    ];

    /// What a command line asks for, or the exit code of a refusal.
    fn parsed(line: &str) -> Result<Chosen, i32> {
        let words = std::iter::once("xtask").chain(line.split_whitespace());
        let matches = command(STEPS).try_get_matches_from(words).map_err(|e| e.exit_code())?;
        Ok(chosen(STEPS, &matches).expect("clap knows the same steps"))
    }

    #[test]
    fn unknown_steps_and_arguments_are_refused() {
        for wrong in [
            "",
            "none",
            "plain --bogus",
            "plain --fix",
            "plain x",
            "one a.elf b.elf",
            "ci --fix",
            "ci plain",
            "ci --only one",
            "nightly --only plain",
            "nightly --only none",
        ] {
            assert_eq!(parsed(wrong), Err(2), "{wrong}");
        }
        assert_eq!(parsed("--help"), Err(0));
        assert_eq!(parsed("one --help"), Err(0));
    }

    #[test]
    fn a_lane_runs_all_of_its_steps_or_those_that_are_named() {
        assert_eq!(parsed("ci"), Ok(Chosen::Lane(Lane::Ci, Selection::default())));
        let only = Selection { only: vec!["one".to_owned()], again: true };
        assert_eq!(parsed("nightly --only one --again"), Ok(Chosen::Lane(Lane::Nightly, only)));
    }

    #[test]
    fn accepted_arguments_arrive() {
        let file = Some(PathBuf::from("a.elf"));
        let arguments = Arguments { fix: true, file, ..Arguments::default() };
        assert_eq!(parsed("one a.elf --fix"), Ok(Chosen::Step("one", arguments)));
        let rest = ["--nocapture", "x", "-y"].map(str::to_owned).into();
        let arguments = Arguments { rest, ..Arguments::default() };
        assert_eq!(parsed("any --nocapture x -y"), Ok(Chosen::Step("any", arguments)));
    }

    #[test]
    fn the_table_of_steps_makes_a_valid_command_line() {
        command(crate::STEPS).debug_assert();
    }

    #[test]
    fn a_step_comes_after_steps_above_it_in_its_own_lane() {
        for (place, step) in crate::STEPS.iter().enumerate() {
            for name in step.after {
                let mut before = crate::STEPS[..place].iter();
                assert!(
                    before.any(|other| other.name == *name && other.lane == step.lane),
                    "{} after {name}",
                    step.name
                );
            }
        }
    }
}
