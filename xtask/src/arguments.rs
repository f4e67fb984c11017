//! The command line: one subcommand per step of [`STEPS`](crate::STEPS), made with clap from that table.

use crate::{Failure, Step};
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use std::path::PathBuf;

/// An argument that a step accepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accepts {
    /// `--fix`: write the committed file instead of comparing with it.
    Fix,
    /// `--debian`: build with Debian's compiler.
    Debian,
    /// `FILE`: check this file instead of building one.
    File,
    /// `SECONDS`: how long to run.
    Seconds,
    /// Everything else on the line goes to the program that the step runs.
    Rest,
}

/// The arguments of one run of a step. What the step does not accept has its default.
#[derive(Debug, Default, PartialEq)]
pub struct Arguments {
    /// `--fix` was given.
    pub fix: bool,
    /// `--debian` was given.
    pub debian: bool,
    /// The file to check.
    pub file: Option<PathBuf>,
    /// How long to run.
    pub seconds: Option<u64>,
    /// For the program that the step runs.
    pub rest: Vec<String>,
}

/// The subcommand that runs every step of `ci`.
pub const CI: &str = "ci";

impl Accepts {
    fn arg(self) -> Arg {
        match self {
            Self::Fix => Arg::new("fix")
                .long("fix")
                .action(ArgAction::SetTrue)
                .help("Write the committed file instead of comparing with it"),
            Self::Debian => {
                Arg::new("debian").long("debian").action(ArgAction::SetTrue).help("Build with Debian's compiler")
            }
            Self::File => Arg::new("FILE").value_parser(value_parser!(PathBuf)).help("Check this file"),
            Self::Seconds => Arg::new("SECONDS").value_parser(value_parser!(u64)).help("Run each target for this long"),
            Self::Rest => Arg::new("ARGUMENTS")
                .num_args(0..)
                .trailing_var_arg(true)
                .allow_hyphen_values(true)
                .help("Arguments for the program that the step runs"),
        }
    }

    /// Moves the value of this argument, if it was given.
    fn take(self, matches: &ArgMatches, arguments: &mut Arguments) {
        match self {
            Self::Fix => arguments.fix = matches.get_flag("fix"),
            Self::Debian => arguments.debian = matches.get_flag("debian"),
            Self::File => arguments.file = matches.get_one("FILE").cloned(),
            Self::Seconds => arguments.seconds = matches.get_one("SECONDS").copied(),
            Self::Rest => arguments.rest = matches.get_many("ARGUMENTS").unwrap_or_default().cloned().collect(),
        }
    }
}

/// The whole command line. Steps of `ci` are marked with `*`.
pub fn command(steps: &'static [Step]) -> Command {
    let ci = Command::new(CI).about("* Run every step marked *, in this order, until one fails");
    let steps = steps.iter().map(|step| {
        let mark = if step.in_ci { '*' } else { ' ' };
        Command::new(step.name)
            .about(format!("{mark} {}", step.about))
            .args(step.accepts.iter().map(|argument| argument.arg()))
    });
    Command::new("xtask")
        .bin_name("cargo xtask")
        .about("Checks of this repository. Steps marked * are part of `ci`.")
        .after_help("Exit code: 0 when the step passed, 1 when it failed, 2 when the command line was wrong.")
        .subcommand_required(true)
        .arg_required_else_help(true)
        .disable_help_subcommand(true)
        .subcommand(ci)
        .subcommands(steps)
}

/// The step that the command line names and its arguments; `None` for `ci`.
pub fn chosen<'s>(steps: &'s [Step], matches: &ArgMatches) -> Result<Option<(&'s Step, Arguments)>, Failure> {
    let (name, matches) = matches.subcommand().ok_or("no step")?;
    if name == CI {
        return Ok(None);
    }
    let step = steps.iter().find(|step| step.name == name).ok_or_else(|| format!("no step `{name}`"))?;
    let mut arguments = Arguments::default();
    for argument in step.accepts {
        argument.take(matches, &mut arguments);
    }
    Ok(Some((step, arguments)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: &[Step] = &[
        Step::new("plain", "", |_, _| Ok(())),
        Step::new("one", "", |_, _| Ok(())).accepting(&[Accepts::Fix, Accepts::File]),
        Step::new("any", "", |_, _| Ok(())).accepting(&[Accepts::Rest]),
    ];

    /// The arguments of a step, or the exit code of a refusal.
    fn parsed(line: &str) -> Result<Arguments, i32> {
        let words = std::iter::once("xtask").chain(line.split_whitespace());
        let matches = command(STEPS).try_get_matches_from(words).map_err(|e| e.exit_code())?;
        Ok(chosen(STEPS, &matches)
            .expect("clap knows the same steps")
            .map(|(_, arguments)| arguments)
            .unwrap_or_default())
    }

    #[test]
    fn unknown_steps_and_arguments_are_refused() {
        for wrong in ["", "none", "plain --bogus", "plain --fix", "plain x", "one a.elf b.elf", "ci --fix", "ci plain"]
        {
            assert_eq!(parsed(wrong), Err(2), "{wrong}");
        }
        assert_eq!(parsed("--help"), Err(0));
        assert_eq!(parsed("one --help"), Err(0));
        assert_eq!(parsed("ci"), Ok(Arguments::default()));
    }

    #[test]
    fn accepted_arguments_arrive() {
        let file = Some(PathBuf::from("a.elf"));
        assert_eq!(parsed("one a.elf --fix"), Ok(Arguments { fix: true, file, ..Arguments::default() }));
        let rest = ["--nocapture", "x", "-y"].map(str::to_owned).into();
        assert_eq!(parsed("any --nocapture x -y"), Ok(Arguments { rest, ..Arguments::default() }));
    }

    #[test]
    fn the_table_of_steps_makes_a_valid_command_line() {
        command(crate::STEPS).debug_assert();
    }
}
