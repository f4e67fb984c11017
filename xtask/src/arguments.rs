//! What a step can be told, on the command line and in the program.

use clap::{Arg, ArgAction, ArgMatches, value_parser};
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
    /// `SECONDS`: how long to search.
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
    /// How long to search.
    pub seconds: Option<u64>,
    /// For the program that the step runs.
    pub rest: Vec<String>,
}

impl Accepts {
    /// As clap knows it.
    pub fn arg(self) -> Arg {
        match self {
            Self::Fix => Arg::new("fix")
                .long("fix")
                .action(ArgAction::SetTrue)
                .help("Write the committed file instead of comparing with it"),
            Self::Debian => {
                Arg::new("debian").long("debian").action(ArgAction::SetTrue).help("Build with Debian's compiler")
            }
            Self::File => Arg::new("FILE").value_parser(value_parser!(PathBuf)).help("Check this file"),
            Self::Seconds => Arg::new("SECONDS")
                .value_parser(value_parser!(u64))
                .help("Search for new inputs with libFuzzer, each target for this long"),
            Self::Rest => Arg::new("ARGUMENTS")
                .num_args(0..)
                .trailing_var_arg(true)
                .allow_hyphen_values(true)
                .help("Arguments for the program that the step runs"),
        }
    }

    /// Moves the value of this argument, if it was given.
    pub fn take(self, matches: &ArgMatches, arguments: &mut Arguments) {
        match self {
            Self::Fix => arguments.fix = matches.get_flag("fix"),
            Self::Debian => arguments.debian = matches.get_flag("debian"),
            Self::File => arguments.file = matches.get_one("FILE").cloned(),
            Self::Seconds => arguments.seconds = matches.get_one("SECONDS").copied(),
            Self::Rest => arguments.rest = matches.get_many("ARGUMENTS").unwrap_or_default().cloned().collect(),
        }
    }
}
