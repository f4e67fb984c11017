//! A step, and the command line that a table of steps makes with clap: one subcommand per step.

use crate::arguments::{Accepts, Arguments};
use crate::repository::{Failure, Repository};
use clap::{ArgMatches, Command};

/// The subcommand that runs every step of `ci`.
const CI: &str = "ci";

/// What a step runs.
pub type Run = fn(&Repository, &Arguments) -> Result<(), Failure>;

/// Where `ci` runs a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// One after the other, in the workspace's own build folder.
    First,
    /// The same, with nothing beside it, because it measures speed.
    Alone,
    /// Beside the first lane, in build folders of its own.
    Second,
    /// Not at all.
    Manual,
}

/// One check.
pub struct Step {
    pub name: &'static str,
    /// For `--help`.
    pub about: &'static str,
    pub accepts: &'static [Accepts],
    pub lane: Lane,
    pub run: Run,
}

impl Step {
    /// A step of `ci` without arguments.
    pub const fn new(name: &'static str, about: &'static str, run: Run) -> Self {
        Self { name, about, accepts: &[], lane: Lane::First, run }
    }

    pub const fn accepting(self, accepts: &'static [Accepts]) -> Self {
        Self { accepts, ..self }
    }

    /// Builds in folders of its own: `ci` runs it beside the others.
    pub const fn beside(self) -> Self {
        Self { lane: Lane::Second, ..self }
    }

    /// Measures speed: `ci` runs nothing beside it.
    pub const fn alone(self) -> Self {
        Self { lane: Lane::Alone, ..self }
    }

    /// Not part of `ci`.
    pub const fn manual(self) -> Self {
        Self { lane: Lane::Manual, ..self }
    }
}

/// The whole command line. Steps of `ci` are marked with `*`.
pub fn command(steps: &'static [Step]) -> Command {
    let ci = Command::new(CI).about("* Run every step marked *, in this order, until one fails");
    let steps = steps.iter().map(|step| {
        let mark = if step.lane == Lane::Manual { ' ' } else { '*' };
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
    use std::path::PathBuf;

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
